// image_outline.c - whether a rendered tree keeps to the photograph's matte, and hangs together as it does there
// SPDX-License-Identifier: BSD-3-Clause
//
// A slender plant covers few pixels, so that fog all over the picture and a stem with a gap hardly move PSNR. Three
// figures see them: the error inside the matte alone; the share of the rendered alpha that lies within three pixels of
// the matte,
//     near = sum_{p near} a_p / sum_p a_p,
// which fog lowers however thin it is; and the length of the largest connected piece against the truth's, by the
// diagonals of their bounding boxes. A piece of half the length is a broken stem; leaves that hang loose in the
// photograph too do not matter, since the truth is measured by the same rule.
#include "base/image_outline.h"
#include "base/image_detail.h"

#include <math.h>

enum { NEAR = 3, PIECE_BYTE = 64, INSIDE_BYTE = 128 };

static float alpha_of(const vt_fimage *picture, size_t pixel) {
  float a = picture->pixels[4 * pixel + 3];
  return a > 0 ? (a < 1 ? a : 1) : 0;
} // NaN is 0

static double inside_error(vt_context *context, const vt_picture_pair *pair, vt_status *status) {
  size_t width = (size_t)pair->result->width;
  float *rows = VT_NEW(context, float, 6 * width);
  double sum = 0, count = 0;
  if (!rows) *status = VT_OUT_OF_MEMORY;
  for (size_t y = 0; rows && y < (size_t)pair->result->height; y++) {
    vt_flatten_pair(pair, y, rows, rows + 3 * width);
    for (size_t x = 0; x < width; x++) {
      if (pair->truth->pixels[4 * (y * width + x) + 3] < INSIDE_BYTE) continue;
      for (size_t c = 3 * x; c < 3 * x + 3; c++)
        sum += ((double)rows[c] - rows[c + 3 * width]) * ((double)rows[c] - rows[c + 3 * width]);
      count += 3;
    }
  }
  vt_free(context, rows);
  return count > 0 ? sum / count : (double)NAN;
}

static bool is_near(const vt_image *truth, int x, int y) {
  for (int dy = -NEAR; dy <= NEAR; dy++)
    for (int dx = -NEAR; dx <= NEAR; dx++) {
      int u = x + dx, v = y + dy;
      if (dx * dx + dy * dy > NEAR * NEAR || u < 0 || v < 0 || u >= truth->width || v >= truth->height) continue;
      if (truth->pixels[4 * ((size_t)v * (size_t)truth->width + (size_t)u) + 3] >= VT_FOREGROUND_BYTE) return true;
    }
  return false;
}

static double near_share(const vt_fimage *result, const vt_image *truth) {
  double all = 0, near = 0;
  for (int y = 0; y < result->height; y++)
    for (int x = 0; x < result->width; x++) {
      double a = (double)alpha_of(result, (size_t)y * (size_t)result->width + (size_t)x);
      if (!(a > 0)) continue;
      all += a;
      if (is_near(truth, x, y)) near += a;
    }
  return all > 0 ? near / all : 1;
}

typedef struct piece {
  size_t pixels;
  int x0, y0, x1, y1;
} piece;

// Empties `set` of the piece that holds `start`; `stack` has room for every pixel.
static piece take_piece(uint8_t *set, uint32_t *stack, int width, int height, uint32_t start) {
  piece p = {0, width, height, -1, -1};
  size_t depth = 0;
  stack[depth++] = start, set[start] = 0;
  while (depth) {
    uint32_t at = stack[--depth];
    int x = (int)(at % (uint32_t)width), y = (int)(at / (uint32_t)width);
    p.pixels++;
    p.x0 = x < p.x0 ? x : p.x0, p.x1 = x > p.x1 ? x : p.x1;
    p.y0 = y < p.y0 ? y : p.y0, p.y1 = y > p.y1 ? y : p.y1;
    for (int v = y > 0 ? y - 1 : 0; v <= y + 1 && v < height; v++)
      for (int u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; u++) {
        uint32_t next = (uint32_t)v * (uint32_t)width + (uint32_t)u;
        if (set[next]) set[next] = 0, stack[depth++] = next;
      }
  }
  return p;
}

// Diagonal of the largest piece, 0 if there is none.
static double longest(uint8_t *set, uint32_t *stack, int width, int height) {
  piece best = {0, 0, 0, -1, -1};
  uint32_t count = (uint32_t)width * (uint32_t)height;
  for (uint32_t i = 0; i < count; i++) {
    if (!set[i]) continue;
    piece p = take_piece(set, stack, width, height, i);
    if (p.pixels > best.pixels) best = p;
  }
  return best.pixels ? hypot(best.x1 - best.x0 + 1, best.y1 - best.y0 + 1) : 0;
}

vt_status vt_measure_outline(vt_context *context, const vt_fimage *result, const vt_image *truth,
                             const float background[3], vt_outline *out) {
  VT_ASSERT(result->channels == 4 && truth->channels == 4);
  VT_ASSERT(result->width == truth->width && result->height == truth->height);
  size_t count = (size_t)result->width * (size_t)result->height;
  VT_ASSERT(count <= UINT32_MAX);
  vt_picture_pair pair = {
      .result = result, .truth = truth, .background = {background[0], background[1], background[2]}};
  vt_status status = VT_OK;
  *out = (vt_outline){0};
  uint8_t *set = VT_NEW(context, uint8_t, count);
  uint32_t *stack = VT_NEW(context, uint32_t, count);
  if (!set || !stack) status = VT_OUT_OF_MEMORY;
  if (!status) {
    double error = inside_error(context, &pair, &status);
    out->psnr_inside = error > 0 ? fmin(-10 * log10(error), 99) : isnan(error) ? error : 99;
    out->near = near_share(result, truth);
    for (size_t i = 0; i < count; i++) set[i] = truth->pixels[4 * i + 3] >= PIECE_BYTE;
    double true_length = longest(set, stack, result->width, result->height);
    for (size_t i = 0; i < count; i++) set[i] = alpha_of(result, i) * 255 >= PIECE_BYTE;
    double length = longest(set, stack, result->width, result->height);
    out->reach = true_length > 0 ? length / true_length : (double)NAN;
  }
  vt_free(context, set);
  vt_free(context, stack);
  return status;
}
