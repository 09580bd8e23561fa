// palette.c - the few colours of the tree that occur in each part of a photograph
// SPDX-License-Identifier: BSD-3-Clause
//
// Lloyd's iteration on encoded values, from starts that lie evenly along lightness, over the unmixed pixels of a cell and
// of its neighbours; where those are few, of a wider square. Neighbouring cells share most of their pixels, so that
// their palettes hardly differ and no seams are seen. Each colour has its variance, so that a mixture need not hit it.
#include "capture/palette.h"
#include "base/lab.h"
#include <math.h>
#include <string.h>

enum { CELLS = 24, FEW = 150, MANY = 600, ROUNDS = 6, WIDEST = 64 }; // CELLS along the longer side; FEW, MANY: pixels
#define LEAST_VARIANCE 6e-5f // of linear light

typedef struct pick {
  uint8_t colour[3];
  uint8_t of; // which colour of the palette
  int luma;
} pick;

void vt_free_palette(vt_context *context, vt_palette *palette) {
  vt_free(context, palette->cells);
  memset(palette, 0, sizeof *palette);
}

static int compare_lumas(const void *a, const void *b) {
  const pick *x = a, *y = b;
  return x->luma != y->luma ? (x->luma > y->luma) - (x->luma < y->luma) : memcmp(x->colour, y->colour, 3);
}

// Up to MANY known pixels of a rectangle, evenly; `total` says how many there are, by rows of `counts`.
static int pick_pixels(const vt_image *rgb, const uint8_t *known, const int box[4], size_t total, pick picks[MANY]) {
  size_t step = total / MANY + 1, seen = 0;
  int count = 0;
  for (int y = box[1]; y < box[3]; y++)
    for (int x = box[0]; x < box[2]; x++) {
      size_t p = (size_t)y * (size_t)rgb->width + (size_t)x;
      if (!known[p] || seen++ % step || count == MANY) continue;
      const uint8_t *c = rgb->pixels + 3 * p;
      picks[count] = (pick){.luma = 299 * c[0] + 587 * c[1] + 114 * c[2]};
      memcpy(picks[count++].colour, c, 3);
    }
  return count;
}

static void assign(pick *picks, int count, float means[][3], int colours) {
  for (int i = 0; i < count; i++) {
    float best = INFINITY;
    for (int k = 0; k < colours; k++) {
      float d2 = 0;
      for (int c = 0; c < 3; c++) d2 += ((float)picks[i].colour[c] - means[k][c]) * ((float)picks[i].colour[c] - means[k][c]);
      if (d2 < best) best = d2, picks[i].of = (uint8_t)k;
    }
  }
}

static void cluster(const float linear[256], pick *picks, int count, vt_palette_cell *cell) {
  float means[VT_PALETTE_COLOURS][3];
  int colours = count < VT_PALETTE_COLOURS ? count : VT_PALETTE_COLOURS, kept = 0;
  qsort(picks, (size_t)count, sizeof *picks, compare_lumas);
  for (int k = 0; k < colours; k++)
    for (int c = 0; c < 3; c++) means[k][c] = picks[(2 * k + 1) * count / (2 * colours)].colour[c];
  for (int round = 0; round < ROUNDS; round++) {
    assign(picks, count, means, colours);
    for (int k = 0; k < colours; k++) {
      float sum[3] = {0}, n = 0;
      for (int i = 0; i < count; i++)
        if (picks[i].of == k) {
          for (int c = 0; c < 3; c++) sum[c] += picks[i].colour[c];
          n++;
        }
      for (int c = 0; c < 3 && n > 0; c++) means[k][c] = sum[c] / n;
    }
  }
  for (int k = 0; k < colours; k++) {
    float sum[3] = {0}, square[3] = {0}, n = 0;
    for (int i = 0; i < count; i++)
      if (picks[i].of == k) {
        for (int c = 0; c < 3; c++) {
          float l = linear[picks[i].colour[c]];
          sum[c] += l, square[c] += l * l;
        }
        n++;
      }
    if (n < 1) continue;
    for (int c = 0; c < 3; c++) {
      cell->light[kept][c] = sum[c] / n;
      cell->variance[kept][c] = fmaxf(square[c] / n - sum[c] / n * (sum[c] / n), 0) + LEAST_VARIANCE;
    }
    kept++;
  }
  cell->count = kept;
}

vt_status vt_make_palette(vt_context *context, const vt_image *rgb, const uint8_t *known, vt_palette *out) {
  int longer = rgb->width > rgb->height ? rgb->width : rgb->height, edge = longer / CELLS > 8 ? longer / CELLS : 8;
  *out = (vt_palette){edge, (rgb->width + edge - 1) / edge, (rgb->height + edge - 1) / edge, NULL};
  out->cells = VT_NEW(context, vt_palette_cell, (size_t)out->columns * (size_t)out->rows);
  size_t *counts = VT_NEW(context, size_t, (size_t)out->columns * (size_t)out->rows);
  pick *picks = VT_NEW(context, pick, MANY);
  vt_status status = out->cells && counts && picks ? VT_OK : VT_OUT_OF_MEMORY;
  float linear[256];
  vt_fill_srgb_table(linear);
  for (int y = 0; y < rgb->height && !status; y++)
    for (int x = 0; x < rgb->width; x++)
      counts[y / edge * out->columns + x / edge] += known[(size_t)y * (size_t)rgb->width + (size_t)x] != 0;
  for (int row = 0; row < out->rows && !status; row++)
    for (int column = 0; column < out->columns; column++) {
      size_t total = 0;
      int box[4] = {0};
      for (int reach = 1; reach <= WIDEST && total < FEW; reach *= 2) {
        int c0 = column > reach ? column - reach : 0, c1 = column + reach + 1 < out->columns ? column + reach + 1 : out->columns;
        int r0 = row > reach ? row - reach : 0, r1 = row + reach + 1 < out->rows ? row + reach + 1 : out->rows;
        total = 0;
        for (int j = r0; j < r1; j++)
          for (int i = c0; i < c1; i++) total += counts[j * out->columns + i];
        int next[4] = {c0 * edge, r0 * edge, c1 * edge < rgb->width ? c1 * edge : rgb->width,
                       r1 * edge < rgb->height ? r1 * edge : rgb->height};
        memcpy(box, next, sizeof box);
      }
      int count = pick_pixels(rgb, known, box, total, picks);
      if (count) cluster(linear, picks, count, &out->cells[row * out->columns + column]);
    }
  vt_free(context, counts);
  vt_free(context, picks);
  if (status) vt_free_palette(context, out);
  return status;
}
