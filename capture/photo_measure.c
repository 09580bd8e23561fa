// photo_measure.c - what a photograph says about itself: sharpness, exposure, white balance, a thumbnail
// SPDX-License-Identifier: BSD-3-Clause
//
// Sharpness: with D_n the mean square difference of luma between pixels n apart, D_1 / D_8 is near 1 for a step edge of one
// pixel's width and falls with the square of the blur's width. As a ratio it does not depend on contrast or exposure. It is
// taken in blocks of 16 x 16 pixels and summed over the tenth of them with the largest D_8: there is always something that the
// camera focused on, and noise, which is as large in D_1 as in D_8, counts least there. Rows and columns are summed apart and
// the smaller ratio is taken, so that motion along one axis shows.
// What goes wrong: a photograph of other things (a close-up among overviews) has another natural sharpness, so it is compared
// with its neighbours only (check.c), and noise of a dark photograph makes it look sharper than it is.
#include "capture/photo_measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 16, FAR = 8, LONGEST = 2000 }; // pixels

typedef struct block {
  float fine[2], coarse[2]; // along x, along y
} block;

static int compare_blocks(const void *a, const void *b) { // most contrast first
  const block *p = a, *q = b;
  float x = p->coarse[0] + p->coarse[1], y = q->coarse[0] + q->coarse[1];
  return x > y ? -1 : x < y;
}

static double linear(double v) { // of an sRGB-encoded 0..255
  v /= 255;
  return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static void measure_light(const vt_image *p, vt_photo_measure *out) {
  double table[256], sum[3] = {0};
  for (int i = 0; i < 256; i++) table[i] = linear(i);
  size_t count = (size_t)p->width * (size_t)p->height, c = (size_t)p->channels;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 3; k++) sum[k] += table[p->pixels[i * c + (c < 3 ? 0 : k)]];
  double luma = (0.2126 * sum[0] + 0.7152 * sum[1] + 0.0722 * sum[2]) / (double)count;
  out->exposure = luma > 1e-6 ? log2(luma) : -20;
  out->red = sum[0] > 0 && sum[1] > 0 ? log2(sum[0] / sum[1]) : 0;
  out->blue = sum[2] > 0 && sum[1] > 0 ? log2(sum[2] / sum[1]) : 0;
}

static void make_thumb(const vt_image *p, vt_photo_measure *out) {
  size_t c = (size_t)p->channels;
  for (int y = 0; y < VT_THUMB; y++)
    for (int x = 0; x < VT_THUMB; x++) {
      int x0 = x * p->width / VT_THUMB, x1 = (x + 1) * p->width / VT_THUMB, y0 = y * p->height / VT_THUMB;
      int y1 = (y + 1) * p->height / VT_THUMB;
      if (x1 == x0) x1++;
      if (y1 == y0) y1++;
      for (size_t k = 0; k < 3; k++) {
        uint64_t sum = 0;
        for (int v = y0; v < y1; v++)
          for (int u = x0; u < x1; u++)
            sum += p->pixels[((size_t)v * (size_t)p->width + (size_t)u) * c + (c < 3 ? 0 : k)];
        out->thumb[y * VT_THUMB + x][k] = (uint8_t)(sum / ((uint64_t)(x1 - x0) * (uint64_t)(y1 - y0)));
      }
    }
}

// Luma, reduced by a whole factor to at most LONGEST pixels a side or little more.
static vt_status take_luma(vt_context *context, const vt_image *p, float **out, int *width, int *height) {
  int longer = p->width > p->height ? p->width : p->height, factor = longer > LONGEST ? longer / LONGEST : 1;
  size_t c = (size_t)p->channels, green = c < 3 ? 0 : 1, blue = c < 3 ? 0 : 2;
  *width = p->width / factor;
  *height = p->height / factor;
  *out = VT_NEW(context, float, (size_t)*width * (size_t)*height);
  if (!*out) return VT_OUT_OF_MEMORY;
  for (int y = 0; y < *height; y++)
    for (int x = 0; x < *width; x++) {
      unsigned sum = 0;
      for (int v = 0; v < factor; v++)
        for (int u = 0; u < factor; u++) {
          const uint8_t *q = p->pixels + ((size_t)(y * factor + v) * (size_t)p->width + (size_t)(x * factor + u)) * c;
          sum += 2u * q[0] + 5u * q[green] + q[blue];
        }
      (*out)[(size_t)y * (size_t)*width + (size_t)x] = (float)sum / (8.0f * (float)(factor * factor));
    }
  return VT_OK;
}

static block measure_block(const float *luma, int width, int left, int top) {
  block out = {{0}, {0}};
  for (int y = top; y < top + BLOCK; y++)
    for (int x = left; x < left + BLOCK; x++) {
      const float *at = luma + (size_t)y * (size_t)width + (size_t)x;
      size_t row = (size_t)width;
      float dx = at[1] - at[0], dy = at[row] - at[0], ex = at[FAR] - at[0], ey = at[FAR * row] - at[0];
      out.fine[0] += dx * dx;
      out.fine[1] += dy * dy;
      out.coarse[0] += ex * ex;
      out.coarse[1] += ey * ey;
    }
  return out;
}

static double sharpness_of(block *blocks, size_t count) {
  double fine[2] = {0}, coarse[2] = {0};
  size_t most = count / 10 + 1;
  qsort(blocks, count, sizeof *blocks, compare_blocks);
  for (size_t i = 0; i < most && i < count; i++)
    for (int k = 0; k < 2; k++) {
      fine[k] += blocks[i].fine[k];
      coarse[k] += blocks[i].coarse[k];
    }
  double all = coarse[0] + coarse[1], best = NAN;
  for (int k = 0; k < 2; k++) // a direction without edges says nothing
    if (coarse[k] > 0.1 * all && coarse[k] > 0) best = fmin(best, sqrt(fine[k] / coarse[k])); // fmin passes over NAN
  return best;
}

vt_status vt_measure_photo(vt_context *context, const vt_image *picture, vt_photo_measure *out) {
  int width, height;
  float *luma = NULL;
  *out = (vt_photo_measure){.sharpness = NAN};
  measure_light(picture, out);
  make_thumb(picture, out);
  vt_status status = take_luma(context, picture, &luma, &width, &height);
  int columns = (width - FAR) / BLOCK, rows = (height - FAR) / BLOCK;
  if (status || columns < 1 || rows < 1) {
    vt_free(context, luma);
    return status;
  }
  size_t count = (size_t)columns * (size_t)rows;
  block *blocks = VT_NEW(context, block, count);
  for (int y = 0; blocks && y < rows; y++)
    for (int x = 0; x < columns; x++)
      blocks[(size_t)y * (size_t)columns + (size_t)x] = measure_block(luma, width, x * BLOCK, y * BLOCK);
  if (blocks) out->sharpness = sharpness_of(blocks, count);
  vt_free(context, luma);
  vt_free(context, blocks);
  return blocks ? VT_OK : VT_OUT_OF_MEMORY;
}
