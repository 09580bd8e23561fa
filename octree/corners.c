// corners.c - the corners of a level's cells, each once
// SPDX-License-Identifier: BSD-3-Clause
//
// A corner is shared by up to eight cells. It belongs to the first of them in Morton order, so numbers follow from the
// cells alone: a reader of a file finds the same corners again, and nothing but their values needs to be stored.

#include "octree/cells.h"

#include <string.h>

// Of the eight cells around a corner of a cell, the first; *as_corner: which of that cell's corners it is.
static uint32_t owner_of(const uint32_t around[27], int corner, int *as_corner) {
  uint32_t first = VT_NO_CELL;
  for (int k = 0; k < 8; k++) { // neighbour at -1 or 0 (corner at the low side) or 0 or 1 along each axis
    int x = (corner & 1) + (k & 1), y = (corner >> 1 & 1) + (k >> 1 & 1), z = (corner >> 2 & 1) + (k >> 2 & 1);
    uint32_t cell = around[x + 3 * y + 9 * z];
    if (cell >= first) continue; // also VT_NO_CELL
    first = cell;
    *as_corner = 7 - k;
  }
  return first;
}

typedef struct corner_job {
  const vt_level *level;
  int branching;
  uint8_t *own;    // [cell_count] bit c: the cell's corner c is its own
  uint32_t *first; // [cell_count] number of the cell's first own corner
} corner_job;

static void find_own(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  corner_job *job = user;
  uint32_t around[27];
  for (size_t i = begin; i < end; i++) {
    vt_all_neighbours(job->level, job->branching, (uint32_t)i, around);
    for (int c = 0, as; c < 8; c++)
      if (owner_of(around, c, &as) == i) job->own[i] |= (uint8_t)(1 << c);
  }
}

static void number_corners(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  corner_job *job = user;
  uint32_t around[27];
  for (size_t i = begin; i < end; i++) {
    vt_all_neighbours(job->level, job->branching, (uint32_t)i, around);
    for (int c = 0; c < 8; c++) {
      int as = 0;
      uint32_t owner = owner_of(around, c, &as);
      unsigned before = vt_count_bits((uint64_t)job->own[owner] & ((1u << as) - 1));
      job->level->corner_of[8 * i + (size_t)c] = job->first[owner] + before;
    }
  }
}

static void drop_corners(vt_context *context, vt_level *level) {
  vt_free(context, level->corner_of);
  vt_free(context, level->corner_values);
  level->corner_of = NULL;
  level->corner_values = NULL;
  level->corner_count = 0;
}

vt_status vt_make_corners(vt_context *context, int branching, vt_level *level) {
  size_t cells = level->cell_count;
  drop_corners(context, level);
  corner_job job = {level, branching, VT_NEW(context, uint8_t, cells), VT_NEW(context, uint32_t, cells)};
  level->corner_of = VT_NEW(context, uint32_t, 8 * cells);
  vt_status status = VT_OUT_OF_MEMORY;
  if (!job.own || !job.first || !level->corner_of) goto done;
  status = vt_parallel(context, cells, 4096, find_own, &job);
  uint32_t count = 0;
  for (size_t i = 0; i < cells; i++) {
    job.first[i] = count;
    count += vt_count_bits(job.own[i]);
  }
  if (!status) status = vt_parallel(context, cells, 4096, number_corners, &job);
  level->corner_values = VT_NEW(context, float, 4 * (size_t)count);
  level->corner_count = count;
  if (!status && !level->corner_values) status = VT_OUT_OF_MEMORY;
done:
  vt_free(context, job.own);
  vt_free(context, job.first);
  if (status) drop_corners(context, level);
  return status;
}

vt_status vt_corners_from_cells(vt_context *context, vt_level *level) {
  uint8_t *met = VT_NEW(context, uint8_t, level->corner_count);
  if (!met) return VT_OUT_OF_MEMORY;
  memset(level->corner_values, 0, 4 * (size_t)level->corner_count * sizeof(float));
  for (size_t i = 0; i < 8 * (size_t)level->cell_count; i++) {
    float *v = level->corner_values + 4 * (size_t)level->corner_of[i];
    const float *colour = level->colour + 3 * (i / 8);
    v[0] += level->optical_depth[i / 8];
    for (int k = 0; k < 3; k++) v[k + 1] += colour[k];
    met[level->corner_of[i]]++;
  }
  for (size_t i = 0; i < 4 * (size_t)level->corner_count; i++) level->corner_values[i] /= (float)met[i / 4];
  vt_free(context, met);
  return VT_OK;
}

void vt_cells_from_corners(vt_level *level) {
  for (size_t i = 0; i < level->cell_count; i++) {
    float sum[4] = {0, 0, 0, 0};
    for (size_t c = 0; c < 8; c++)
      for (size_t k = 0; k < 4; k++) // an eighth of each, so that the sum of the greatest floats is one
        sum[k] += 0.125f * level->corner_values[4 * (size_t)level->corner_of[8 * i + c] + k];
    level->optical_depth[i] = sum[0];
    for (size_t k = 0; k < 3; k++) level->colour[3 * i + k] = sum[k + 1];
  }
}
