// contact_sheet.c - many pictures in one, with a number under each
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/contact_sheet.h"

#include "base/image_file.h"

#include <string.h>

#define LABEL_SCALE 2
#define LABEL_HEIGHT (5 * LABEL_SCALE + 6)
#define GAP 4

// ---- resampling

// The share of source pixel `s` that lies in [begin, end).
static float overlap(int s, double begin, double end) {
  double low = s > begin ? s : begin, high = s + 1 < end ? s + 1 : end;
  return high > low ? (float)(high - low) : 0.0f;
}

static void average_pixel(const vt_fimage *in, double x0, double x1, double y0, double y1, float out[4]) {
  double sum[4] = {0}, weight = 0;
  for (int y = (int)y0; y < in->height && y < y1; y++)
    for (int x = (int)x0; x < in->width && x < x1; x++) {
      double w = (double)overlap(x, x0, x1) * (double)overlap(y, y0, y1);
      const float *p = in->pixels + 4 * ((size_t)y * (size_t)in->width + (size_t)x);
      for (int c = 0; c < 4; c++) sum[c] += w * (double)p[c];
      weight += w;
    }
  for (int c = 0; c < 4; c++) out[c] = weight > 0 ? (float)(sum[c] / weight) : 0.0f;
}

vt_status vt_resample_fimage(vt_context *context, const vt_fimage *in, int width, int height, vt_fimage *out) {
  VT_ASSERT(in->channels == 4);
  vt_status status = vt_make_fimage(context, width, height, 4, out);
  if (status) return status;
  double sx = (double)in->width / width, sy = (double)in->height / height;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      // Where the picture grows, the average over a pixel is the pixel under its centre.
      double x0 = sx < 1 ? (int)((x + 0.5) * sx) : x * sx, x1 = sx < 1 ? x0 + 1 : (x + 1) * sx;
      double y0 = sy < 1 ? (int)((y + 0.5) * sy) : y * sy, y1 = sy < 1 ? y0 + 1 : (y + 1) * sy;
      average_pixel(in, x0, x1, y0, y1, out->pixels + 4 * ((size_t)y * (size_t)width + (size_t)x));
    }
  return VT_OK;
}

// ---- labels: 3x5 dots a sign, rows from the top, the left dot is 4

static const char signs[] = "0123456789.-LB";
static const uint8_t dots[][5] = {{7, 5, 5, 5, 7}, {2, 6, 2, 2, 7}, {7, 1, 7, 4, 7}, {7, 1, 7, 1, 7}, {5, 5, 7, 1, 1},
                                  {7, 4, 7, 1, 7}, {7, 4, 7, 5, 7}, {7, 1, 2, 2, 2}, {7, 5, 7, 5, 7}, {7, 5, 7, 1, 7},
                                  {0, 0, 0, 0, 2}, {0, 0, 7, 0, 0}, {4, 4, 4, 4, 7}, {6, 5, 6, 5, 6}};

void vt_draw_label(vt_image *image, const char *label, int left, int top, int scale) {
  VT_ASSERT(image->channels == 3);
  for (; *label; label++, left += 4 * scale) {
    const char *sign = strchr(signs, *label);
    if (!sign) continue;
    for (int y = 0; y < 5 * scale; y++)
      for (int x = 0; x < 3 * scale; x++) {
        bool set = dots[sign - signs][y / scale] >> (2 - x / scale) & 1;
        if (!set || left + x < 0 || top + y < 0 || left + x >= image->width || top + y >= image->height) continue;
        memset(image->pixels + 3 * ((size_t)(top + y) * (size_t)image->width + (size_t)(left + x)), 96, 3);
      }
  }
}

// ---- sheets

vt_status vt_begin_sheet(vt_context *context, int count, int columns, int width, int height, const float background[3],
                         vt_sheet *out) {
  VT_ASSERT(count > 0 && columns > 0 && width > 0 && height > 0);
  if (columns > count) columns = count;
  *out = (vt_sheet){.columns = columns, .cell_width = width, .cell_height = height};
  memcpy(out->background, background, sizeof out->background);
  int rows = (count + columns - 1) / columns;
  vt_status status =
      vt_make_image(context, columns * (width + GAP) + GAP, rows * (height + LABEL_HEIGHT + GAP) + GAP, 3, &out->image);
  if (status) return status;
  size_t pixels = (size_t)out->image.width * (size_t)out->image.height;
  for (size_t i = 0; i < pixels; i++)
    for (size_t c = 0; c < 3; c++) out->image.pixels[3 * i + c] = (uint8_t)(background[c] * 255 + 0.5f);
  return VT_OK;
}

vt_status vt_put_on_sheet(vt_context *context, vt_sheet *sheet, const vt_fimage *picture, const char *label) {
  double fit_x = (double)sheet->cell_width / picture->width, fit_y = (double)sheet->cell_height / picture->height;
  double fit = fit_x < fit_y ? fit_x : fit_y;
  int width = (int)(picture->width * fit), height = (int)(picture->height * fit);
  vt_fimage fitted = {0};
  vt_image flat = {0};
  vt_status status = vt_resample_fimage(context, picture, width > 1 ? width : 1, height > 1 ? height : 1, &fitted);
  if (!status) status = vt_flatten(context, &fitted, sheet->background, &flat);
  if (!status) {
    int x = GAP + sheet->count % sheet->columns * (sheet->cell_width + GAP);
    int y = GAP + sheet->count / sheet->columns * (sheet->cell_height + LABEL_HEIGHT + GAP);
    vt_paste(&sheet->image, &flat, x + (sheet->cell_width - width) / 2, y);
    vt_draw_label(&sheet->image, label, x + 2, y + sheet->cell_height + 4, LABEL_SCALE);
    sheet->count++;
  }
  vt_free_fimage(context, &fitted);
  vt_free_image(context, &flat);
  return status;
}

vt_status vt_write_sheet(vt_context *context, const vt_sheet *sheet, const char *path) {
  return vt_write_image(context, path, &sheet->image);
}

void vt_free_sheet(vt_context *context, vt_sheet *sheet) {
  vt_free_image(context, &sheet->image);
  *sheet = (vt_sheet){0};
}

vt_status vt_write_row(vt_context *context, const vt_fimage *const *pictures, int count, const float background[3],
                       const char *path) {
  int width = 0;
  vt_image row = {0}, flat = {0};
  for (int i = 0; i < count; i++) width += pictures[i]->width;
  vt_status status = vt_make_image(context, width, pictures[0]->height, 3, &row);
  for (int i = 0, x = 0; i < count && !status; x += pictures[i++]->width) {
    status = vt_flatten(context, pictures[i], background, &flat);
    if (!status) vt_paste(&row, &flat, x, 0);
    vt_free_image(context, &flat);
  }
  if (!status) status = vt_write_image(context, path, &row);
  vt_free_image(context, &row);
  return status;
}
