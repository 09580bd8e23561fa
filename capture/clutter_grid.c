// clutter_grid.c - how often a colour is tree, and how often not, at places of a picture
// SPDX-License-Identifier: BSD-3-Clause
//
// A bilateral grid [Paris, Durand 2006, "A fast approximation of the bilateral filter"] of six axes: row, column,
// roughness (two kinds), L, a, b. Pixels are added to the nearest cell; after blurring the grid is read linearly. The
// two kinds of roughness are not blurred: they would be one. Both masses of a cell lie side by side, for they are
// always read together.

#include "capture/clutter_grid.h"

enum { T_BINS = 2, L_BINS = 10, C_BINS = 12, COLUMNS = 12, ROWS = 12 };
_Static_assert(T_BINS *L_BINS *C_BINS *C_BINS == VT_GRID_COLOURS && COLUMNS * ROWS == VT_GRID_PLACES,
               "as the header says");
#define ROUGH 12.0f // CIELab steps from pixel to pixel at which a place is fully rough

typedef struct tap {
  int low;
  float share; // of the higher one
} tap;

static tap tap_of(float at, int bins) { // at in bins, centres at halves
  at -= 0.5f;
  if (!(at > 0)) at = 0;
  if (at > (float)(bins - 1)) at = (float)(bins - 1);
  int low = (int)at < bins - 1 ? (int)at : bins - 2;
  return (tap){low, at - (float)low};
}

static void find_taps(const vt_spot *s, tap taps[6]) {
  taps[0] = tap_of(s->y * ROWS, ROWS);
  taps[1] = tap_of(s->x * COLUMNS, COLUMNS);
  taps[2] = tap_of(0.5f + (s->step < ROUGH ? s->step / ROUGH : 1), T_BINS);
  taps[3] = tap_of(s->lab[0] * (L_BINS / 100.0f), L_BINS);
  taps[4] = tap_of((s->lab[1] + 50) * (C_BINS / 100.0f), C_BINS);
  taps[5] = tap_of((s->lab[2] + 50) * (C_BINS / 110.0f), C_BINS);
}

static size_t colour_cell(int t, int l, int a, int b) {
  return (size_t)(((t * L_BINS + l) * C_BINS + a) * C_BINS + b);
}

void vt_add_to_grid(float *grid, int places, const vt_spot *spot, float p, float weight) {
  tap taps[6];
  int n[6];
  find_taps(spot, taps);
  for (int i = 0; i < 6; i++) n[i] = taps[i].low + (taps[i].share > 0.5f);
  size_t place = places > 1 ? (size_t)(n[0] * COLUMNS + n[1]) * VT_GRID_COLOURS : 0;
  float *cell = grid + 2 * (place + colour_cell(n[2], n[3], n[4], n[5]));
  cell[0] += weight * p;
  cell[1] += weight * (1 - p);
}

// [1 2 1] / 4 along one axis, as the means of neighbours taken twice: up, then down.
static void blur_axis(float *cells, size_t count, size_t stride, size_t length) {
  for (float *block = cells; block < cells + count; block += stride * length) {
    for (size_t n = 0; n + 1 < length; n++)
      for (size_t k = n * stride; k < (n + 1) * stride; k++) block[k] = 0.5f * (block[k] + block[k + stride]);
    for (size_t n = length - 1; n > 0; n--)
      for (size_t k = n * stride; k < (n + 1) * stride; k++) block[k] = 0.5f * (block[k] + block[k - stride]);
  }
}

void vt_blur_grid(float *grid, int places) {
  size_t count = (size_t)places * VT_GRID_COLOURS * 2;
  blur_axis(grid, count, 2, C_BINS);
  blur_axis(grid, count, 2 * C_BINS, C_BINS);
  blur_axis(grid, count, 2 * C_BINS * C_BINS, L_BINS);
  if (places == 1) return;
  blur_axis(grid, count, 2 * VT_GRID_COLOURS, COLUMNS);
  blur_axis(grid, count, 2 * VT_GRID_COLOURS * COLUMNS, ROWS);
}

static void read_colours(const float *cells, const size_t at[16], const float weights[16], float scale,
                         float masses[2]) {
  for (int k = 0; k < 16; k++) {
    masses[0] += scale * weights[k] * cells[2 * at[k]];
    masses[1] += scale * weights[k] * cells[2 * at[k] + 1];
  }
}

void vt_read_grids(const float *near, const float *general, const vt_spot *spot, float near_masses[2],
                   float general_masses[2]) {
  tap taps[6];
  size_t at[16];
  float weights[16];
  find_taps(spot, taps);
  for (int k = 0; k < 16; k++) {
    int high[4] = {k >> 3, k & 1, k >> 1 & 1, k >> 2 & 1};
    weights[k] = 1;
    for (int i = 0; i < 4; i++) weights[k] *= high[i] ? taps[2 + i].share : 1 - taps[2 + i].share;
    at[k] = colour_cell(taps[2].low + high[0], taps[3].low + high[1], taps[4].low + high[2], taps[5].low + high[3]);
  }
  near_masses[0] = near_masses[1] = general_masses[0] = general_masses[1] = 0;
  read_colours(general, at, weights, 1, general_masses);
  for (int k = 0; k < 4; k++) {
    int v = k & 1, u = k >> 1;
    float w = (v ? taps[0].share : 1 - taps[0].share) * (u ? taps[1].share : 1 - taps[1].share);
    size_t place = (size_t)((taps[0].low + v) * COLUMNS + taps[1].low + u);
    if (w > 0) read_colours(near + 2 * place * VT_GRID_COLOURS, at, weights, w, near_masses);
  }
}
