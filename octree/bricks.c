// bricks.c - the bricks of a level, and the map that says where they are
// SPDX-License-Identifier: BSD-3-Clause
//
// Only bricks with cells are kept, so a level costs what its cells cost. The map on top is a plain grid with one number
// per brick as long as that is small beside the cells (or below a megabyte): one read finds a brick, and an empty
// entry knows how far the nearest cells are, which lets a ray jump. Where a level is too fine and too sparse for that
// (level 10: 256^3 bricks; the tri-grid's level 10: 19683^3), the grid is made of blocks of bricks, with a page for each block
// that holds cells, and pages below pages if need be. Bricks come in Morton order, so the bricks of a page are neighbours.

#include "octree/cells.h"

#define SMALL_MAP (1u << 18) // entries that any level may have
#define ENTRIES_PER_CELL 4   // 16 bytes beside the 22 of a cell

static int page_edge_of(int branching) { return branching == 2 ? 4 : 3; }

static uint64_t map_bound(uint64_t cell_count) {
  return cell_count * ENTRIES_PER_CELL > SMALL_MAP ? cell_count * ENTRIES_PER_CELL : SMALL_MAP;
}

static size_t cube(int n) { return (size_t)n * (size_t)n * (size_t)n; }

static void brick_coordinates(const vt_level *level, int edge, uint32_t cell, int at[3]) {
  at[0] = level->x[cell] / edge;
  at[1] = level->y[cell] / edge;
  at[2] = level->z[cell] / edge;
}

// Cells whose block (of `edge`^3 cells) differs from that of the cell before: blocks are runs of cells in Morton order.
static size_t count_blocks(const vt_level *level, int64_t edge) {
  size_t count = 0;
  for (uint32_t i = 0; i < level->cell_count; i++)
    count += i == 0 || level->x[i] / edge != level->x[i - 1] / edge || level->y[i] / edge != level->y[i - 1] / edge ||
             level->z[i] / edge != level->z[i - 1] / edge;
  return count;
}

// One sweep of the two-pass chessboard distance transform [Rosenfeld & Pfaltz 1968]: each empty entry against the 13
// neighbours that come before it (step 1) or after it (step -1).
static void spread_distance(int32_t *entries, int n, int step) {
  int begin = step > 0 ? 0 : n - 1, end = step > 0 ? n : -1;
  for (int z = begin; z != end; z += step)
    for (int y = begin; y != end; y += step)
      for (int x = begin; x != end; x += step) {
        int32_t *here = &entries[(size_t)x + (size_t)n * ((size_t)y + (size_t)n * (size_t)z)];
        for (int k = 0; k < 13 && *here < -1; k++) { // k = 0..12 of the 27, all before the middle one
          int nx = x + step * (k % 3 - 1), ny = y + step * (k / 3 % 3 - 1), nz = z + step * (k / 9 - 1);
          if (nx < 0 || ny < 0 || nz < 0 || nx >= n || ny >= n || nz >= n) continue;
          int32_t there = entries[(size_t)nx + (size_t)n * ((size_t)ny + (size_t)n * (size_t)nz)];
          int32_t distance = there < 0 ? there - 1 : -1;
          if (distance > *here) *here = distance;
        }
      }
}

// The shape of the map: as deep as it must be to stay small.
static vt_brick_map plan_map(const vt_level *level, int branching) {
  vt_brick_map map = {.axis = level->axis_bricks, .top_edge = 1, .page_edge = page_edge_of(branching)};
  while (cube(map.axis) > map_bound(level->cell_count) && map.axis > 1) {
    map.depth++;
    map.top_edge *= map.page_edge;
    map.axis = (level->axis_bricks + map.top_edge - 1) / map.top_edge;
  }
  map.entry_count = cube(map.axis);
  int64_t block = (int64_t)map.top_edge * vt_brick_edge(branching);
  for (int d = 0; d < map.depth; d++, block /= map.page_edge) map.entry_count += cube(map.page_edge) * count_blocks(level, block);
  return map;
}

uint64_t vt_brick_memory_bound(int branching, int level, uint64_t cell_count) {
  uint64_t axis = 1, edge = (uint64_t)vt_brick_edge(branching), page = (uint64_t)page_edge_of(branching), depth = 0;
  for (int i = 0; i < level; i++) axis *= (uint64_t)branching;
  axis = (axis + edge - 1) / edge;
  for (uint64_t top = axis; top * top * top > map_bound(cell_count) && top > 1; top = (top + page - 1) / page) depth++;
  uint64_t entries = depth || axis * axis * axis > map_bound(cell_count) ? map_bound(cell_count) : axis * axis * axis;
  return cell_count * sizeof(vt_brick) + (entries + cell_count * depth * page * page * page) * sizeof(int32_t);
}

static size_t top_entry(const vt_brick_map *map, const int at[3]) {
  size_t n = (size_t)map->axis, e = (size_t)map->top_edge;
  return (size_t)at[0] / e + n * ((size_t)at[1] / e + n * ((size_t)at[2] / e));
}

static size_t page_entry(const vt_brick_map *map, int32_t page, const int at[3], int edge) {
  int p = map->page_edge;
  return (size_t)page + (size_t)(at[0] / edge % p + p * (at[1] / edge % p + p * (at[2] / edge % p)));
}

static void enter_brick(vt_brick_map *map, const int at[3], int32_t number, size_t *used) {
  size_t entry = top_entry(map, at);
  for (int edge = map->top_edge; edge > 1;) {
    if (map->entries[entry] < 0) {
      map->entries[entry] = (int32_t)*used;
      *used += cube(map->page_edge);
    }
    edge /= map->page_edge;
    entry = page_entry(map, map->entries[entry], at, edge);
  }
  map->entries[entry] = number;
}

static void fill_bricks(vt_level *level, int branching) {
  int edge = vt_brick_edge(branching);
  size_t used = cube(level->map.axis), brick_count = 0;
  int last[3] = {-1, -1, -1}, at[3];
  for (uint32_t i = 0; i < level->cell_count; i++) {
    brick_coordinates(level, edge, i, at);
    if (at[0] != last[0] || at[1] != last[1] || at[2] != last[2]) {
      enter_brick(&level->map, at, (int32_t)brick_count, &used);
      level->bricks[brick_count++].first = i;
      for (int a = 0; a < 3; a++) last[a] = at[a];
    }
    vt_brick *brick = &level->bricks[brick_count - 1];
    unsigned e = (unsigned)edge;
    uint64_t bit = 1ull << vt_brick_bit(branching, level->x[i] % e, level->y[i] % e, level->z[i] % e);
    VT_ASSERT(!(brick->mask & bit));
    VT_VALIDATE(brick->first + vt_count_bits(brick->mask & (bit - 1)) == i);
    brick->mask |= bit;
  }
  VT_VALIDATE(used == level->map.entry_count && brick_count == level->brick_count);
}

vt_status vt_build_bricks(vt_context *context, int branching, vt_level *level) {
  int edge = vt_brick_edge(branching);
  level->axis_bricks = (level->axis_cells + edge - 1) / edge;
  level->brick_count = (uint32_t)count_blocks(level, edge);
  level->map = plan_map(level, branching);
  if (level->map.entry_count > INT32_MAX)
    return vt_fail(context, VT_OUT_OF_MEMORY, "cells: %u of them are too scattered; reconstruct a coarser level",
                   level->cell_count);
  level->bricks = VT_NEW(context, vt_brick, level->brick_count);
  level->map.entries = VT_NEW(context, int32_t, level->map.entry_count);
  if (!level->bricks || !level->map.entries) return VT_OUT_OF_MEMORY;
  size_t top = cube(level->map.axis);
  for (size_t i = 0; i < level->map.entry_count; i++) level->map.entries[i] = i < top ? -level->map.axis : -1;
  fill_bricks(level, branching);
  spread_distance(level->map.entries, level->map.axis, 1);
  spread_distance(level->map.entries, level->map.axis, -1);
  return VT_OK;
}

// The entry that decides about a brick, and the edge, in bricks, of what it stands for.
static int32_t descend(const vt_brick_map *map, const int at[3], int *edge) {
  *edge = map->top_edge;
  int32_t entry = map->entries[top_entry(map, at)];
  while (*edge > 1 && entry >= 0) {
    *edge /= map->page_edge;
    entry = map->entries[page_entry(map, entry, at, *edge)];
  }
  return entry;
}

int32_t vt_find_brick(const vt_level *level, const int at[3], int *skip) {
  int edge;
  int32_t entry = descend(&level->map, at, &edge);
  *skip = entry >= 0 ? 0 : edge == 1 ? -entry : 1 + (-entry - 1) * edge; // at[] may stand at the border of its block
  return entry >= 0 ? entry : -1;
}

int32_t vt_look_up_turned(const vt_level *level, const int at[3], int turned, int ahead[3]) {
  int place[3], edge;
  for (int a = 0; a < 3; a++) place[a] = turned >> a & 1 ? level->axis_bricks - 1 - at[a] : at[a];
  int32_t entry = descend(&level->map, place, &edge);
  for (int a = 0; a < 3; a++) {
    int into = place[a] % edge, left = turned >> a & 1 ? into + 1 : edge - into;
    ahead[a] = entry >= 0 ? 1 : left + (-entry - 1) * edge;
  }
  return entry;
}
