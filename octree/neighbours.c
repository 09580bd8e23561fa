// neighbours.c - the cells beside a cell, and those below it on a finer level
// SPDX-License-Identifier: BSD-3-Clause
//
// Most neighbours stand in the cell's own brick, so the brick found last is tried first. Below: children of a cell follow
// each other in Morton order on every finer level, so they are one range, and two binary searches over Morton numbers (made
// from the coordinates, nothing is stored) find its ends.

#include "octree/cells.h"

typedef struct seen_brick {
  int at[3];
  int32_t number; // -1: holds no cells
} seen_brick;

static uint32_t find_near(const vt_level *level, int branching, const int cell[3], seen_brick *seen) {
  int e = vt_brick_edge(branching), at[3], skip;
  for (int a = 0; a < 3; a++) {
    if (cell[a] < 0 || cell[a] >= level->axis_cells) return VT_NO_CELL;
    at[a] = cell[a] / e;
  }
  if (at[0] != seen->at[0] || at[1] != seen->at[1] || at[2] != seen->at[2])
    *seen = (seen_brick){{at[0], at[1], at[2]}, vt_find_brick(level, at, &skip)};
  if (seen->number < 0) return VT_NO_CELL;
  const vt_brick *brick = &level->bricks[seen->number];
  uint64_t bit = 1ull << vt_brick_bit(branching, (unsigned)(cell[0] % e), (unsigned)(cell[1] % e), (unsigned)(cell[2] % e));
  return brick->mask & bit ? brick->first + vt_count_bits(brick->mask & (bit - 1)) : VT_NO_CELL;
}

void vt_face_neighbours(const vt_level *level, int branching, uint32_t cell, uint32_t out[6]) {
  seen_brick seen = {{-1, -1, -1}, -1};
  for (int k = 0; k < 6; k++) {
    int at[3] = {level->x[cell], level->y[cell], level->z[cell]};
    at[k / 2] += k % 2 ? 1 : -1;
    out[k] = find_near(level, branching, at, &seen);
  }
}

void vt_all_neighbours(const vt_level *level, int branching, uint32_t cell, uint32_t out[27]) {
  seen_brick seen = {{-1, -1, -1}, -1};
  for (int k = 0; k < 27; k++) {
    int at[3] = {level->x[cell] + k % 3 - 1, level->y[cell] + k / 3 % 3 - 1, level->z[cell] + k / 9 - 1};
    out[k] = find_near(level, branching, at, &seen);
  }
}

// The first cell whose Morton number is at least `key`.
static uint32_t lower_bound(const vt_level *level, int branching, uint64_t key) {
  uint32_t low = 0, high = level->cell_count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (vt_morton(branching, level->x[middle], level->y[middle], level->z[middle]) < key)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

vt_cell_range vt_cells_below(const vt_octree *octree, int level, uint32_t cell, int finer_level) {
  VT_ASSERT(level >= 0 && level <= finer_level && finer_level <= VT_MAX_LEVEL && cell < octree->levels[level].cell_count);
  const vt_level *coarse = &octree->levels[level], *fine = &octree->levels[finer_level];
  uint64_t b = (uint64_t)octree->branching, key = vt_morton(octree->branching, coarse->x[cell], coarse->y[cell], coarse->z[cell]);
  uint64_t next = key + 1;
  for (int i = level; i < finer_level; i++) key *= b * b * b, next *= b * b * b;
  return (vt_cell_range){lower_bound(fine, octree->branching, key), lower_bound(fine, octree->branching, next)};
}
