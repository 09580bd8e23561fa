// spread.c - colours known at some pixels, carried smoothly to all others
// SPDX-License-Identifier: BSD-3-Clause
//
// Pull and push (Gortler, Grzeszczuk, Szeliski, Cohen, "The Lumigraph", 1996, section 3.4): going up a pyramid of
// halves, a cell averages the known pixels below it, and counts as known, with weight min(1, number of them); coming
// down, what is missing is taken from the level above by bilinear interpolation. O(pixels), whatever the distance.
#include "capture/spread.h"
#include <string.h>

enum { LEVELS = 32 };

typedef struct level {
  int width, height;
  float *cells; // [height][width][4]: colour, weight
} level;

static float *cell_of(const level *l, int x, int y) {
  x = x < 0 ? 0 : x >= l->width ? l->width - 1 : x;
  y = y < 0 ? 0 : y >= l->height ? l->height - 1 : y;
  return l->cells + ((size_t)y * (size_t)l->width + (size_t)x) * 4;
}

// Bilinear value of the coarser level at a pixel of the finer one.
static void interpolate(const level *coarse, int x, int y, float colour[3]) {
  int i = x >> 1, j = y >> 1, di = x & 1 ? 1 : -1, dj = y & 1 ? 1 : -1;
  const float *a = cell_of(coarse, i, j), *b = cell_of(coarse, i + di, j);
  const float *c = cell_of(coarse, i, j + dj), *d = cell_of(coarse, i + di, j + dj);
  for (int k = 0; k < 3; k++) colour[k] = 0.5625f * a[k] + 0.1875f * (b[k] + c[k]) + 0.0625f * d[k];
}

static void pull_pixels(const vt_image *rgb, const uint8_t *known, level *up) {
  for (int y = 0; y < rgb->height; y++)
    for (int x = 0; x < rgb->width; x++) {
      size_t p = (size_t)y * (size_t)rgb->width + (size_t)x;
      if (!known[p]) continue;
      float *cell = cell_of(up, x >> 1, y >> 1);
      for (int c = 0; c < 3; c++) cell[c] += rgb->pixels[p * 3 + (size_t)c];
      cell[3] += 1;
    }
}

static void pull_cells(const level *down, level *up) {
  for (int y = 0; y < down->height; y++)
    for (int x = 0; x < down->width; x++) {
      const float *from = cell_of(down, x, y);
      float *cell = cell_of(up, x >> 1, y >> 1);
      for (int c = 0; c < 3; c++) cell[c] += from[c] * from[3];
      cell[3] += from[3];
    }
}

static void normalise(level *l) {
  size_t count = (size_t)l->width * (size_t)l->height;
  for (size_t i = 0; i < count; i++) {
    float *cell = l->cells + i * 4;
    if (cell[3] <= 0) continue;
    for (int c = 0; c < 3; c++) cell[c] /= cell[3];
    if (cell[3] > 1) cell[3] = 1;
  }
}

static void push_cells(const level *coarse, level *fine) {
  for (int y = 0; y < fine->height; y++)
    for (int x = 0; x < fine->width; x++) {
      float *cell = cell_of(fine, x, y), colour[3];
      if (cell[3] >= 1) continue;
      interpolate(coarse, x, y, colour);
      for (int c = 0; c < 3; c++) cell[c] = cell[3] * cell[c] + (1 - cell[3]) * colour[c];
    }
}

static void push_pixels(const level *coarse, const vt_image *rgb, const uint8_t *known, vt_image *out) {
  for (int y = 0; y < rgb->height; y++)
    for (int x = 0; x < rgb->width; x++) {
      size_t p = (size_t)y * (size_t)rgb->width + (size_t)x;
      float colour[3];
      if (known[p]) {
        memcpy(out->pixels + p * 3, rgb->pixels + p * 3, 3);
        continue;
      }
      interpolate(coarse, x, y, colour);
      for (int c = 0; c < 3; c++) out->pixels[p * 3 + (size_t)c] = (uint8_t)(colour[c] + 0.5f);
    }
}

vt_status vt_spread_colours(vt_context *context, const vt_image *rgb, const uint8_t *known, vt_image *out) {
  VT_ASSERT(rgb->channels == 3);
  level levels[LEVELS] = {{0}};
  int count = 0;
  vt_status status = vt_make_image(context, rgb->width, rgb->height, 3, out);
  for (int w = rgb->width, h = rgb->height; status == VT_OK && (count == 0 || w > 1 || h > 1); count++) {
    w = (w + 1) / 2;
    h = (h + 1) / 2;
    levels[count] = (level){w, h, VT_NEW(context, float, (size_t)w *(size_t)h * 4)};
    if (!levels[count].cells) {
      status = VT_OUT_OF_MEMORY;
      break;
    }
    if (count == 0)
      pull_pixels(rgb, known, &levels[0]);
    else
      pull_cells(&levels[count - 1], &levels[count]);
    normalise(&levels[count]);
  }
  if (status == VT_OK) {
    for (int l = count - 2; l >= 0; l--) push_cells(&levels[l + 1], &levels[l]);
    push_pixels(&levels[0], rgb, known, out);
  } else {
    vt_free_image(context, out);
  }
  for (int l = 0; l < LEVELS; l++) vt_free(context, levels[l].cells);
  return status;
}
