// cells.c - the occupied cells of a level: making, splitting, choosing, finding
// SPDX-License-Identifier: BSD-3-Clause
//
// A level is a sorted list, not a tree of pointers: the children of cell i stand in Morton order behind those of cell
// i-1, so splitting a sorted level gives a sorted level. Bricks of 4^3 cells (3^3 for the tri-grid of [RMMD04]) say
// which cells exist in 64 bits; a cell's index is the brick's first plus the number of set bits below its own. bricks.c
// says where the bricks are.

#include "octree/cells.h"

#include <string.h>

static int axis_cells_of(int branching, int level) {
  int n = 1;
  for (int i = 0; i < level; i++) n *= branching;
  return n;
}

void vt_free_level(vt_context *context, vt_level *level) {
  vt_free(context, level->x);
  vt_free(context, level->y);
  vt_free(context, level->z);
  vt_free(context, level->optical_depth);
  vt_free(context, level->colour);
  vt_free(context, level->corner_of);
  vt_free(context, level->corner_values);
  vt_free(context, level->bricks);
  vt_free(context, level->map.entries);
  *level = (vt_level){0};
}

void vt_free_octree(vt_context *context, vt_octree *octree) {
  for (int i = 0; i <= VT_MAX_LEVEL; i++) vt_free_level(context, &octree->levels[i]);
  *octree = (vt_octree){0};
}

static uint64_t spread_bits(uint32_t v) { // 16 bits, two zeros between
  uint64_t x = v & 0xffff;
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

uint64_t vt_morton(int branching, uint32_t x, uint32_t y, uint32_t z) {
  if (branching == 2) return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
  uint64_t key = 0, place = 1;
  for (; x | y | z; x /= 3, y /= 3, z /= 3, place *= 27) key += place * (x % 3 + 3 * (y % 3) + 9 * (z % 3));
  return key;
}

vt_status vt_allocate_level(vt_context *context, int branching, int level, size_t count, vt_level *out) {
  VT_ASSERT((branching == 2 || branching == 3) && level >= 0 && level <= VT_MAX_LEVEL && count < VT_NO_CELL);
  *out = (vt_level){.cell_count = (uint32_t)count, .axis_cells = axis_cells_of(branching, level)};
  out->x = VT_NEW(context, uint16_t, count);
  out->y = VT_NEW(context, uint16_t, count);
  out->z = VT_NEW(context, uint16_t, count);
  out->optical_depth = VT_NEW(context, float, count);
  out->colour = VT_NEW(context, float, 3 * count);
  if (out->x && out->y && out->z && out->optical_depth && out->colour) return VT_OK;
  vt_free_level(context, out);
  return VT_OUT_OF_MEMORY;
}

typedef struct keyed { uint64_t key; uint32_t item; } keyed;

static int compare_keyed(const void *a, const void *b) {
  uint64_t p = ((const keyed *)a)->key, q = ((const keyed *)b)->key;
  return p < q ? -1 : p > q;
}

vt_status vt_make_level(vt_context *context, int branching, int level, size_t count, const uint16_t (*xyz)[3],
                        vt_level *out) {
  vt_status status = vt_allocate_level(context, branching, level, count, out);
  if (status) return status;
  keyed *order = VT_NEW(context, keyed, count);
  if (!order) {
    vt_free_level(context, out);
    return VT_OUT_OF_MEMORY;
  }
  for (size_t i = 0; i < count; i++) {
    VT_ASSERT(xyz[i][0] < out->axis_cells && xyz[i][1] < out->axis_cells && xyz[i][2] < out->axis_cells);
    order[i] = (keyed){vt_morton(branching, xyz[i][0], xyz[i][1], xyz[i][2]), (uint32_t)i};
  }
  qsort(order, count, sizeof *order, compare_keyed);
  for (size_t i = 0; i < count; i++) {
    const uint16_t *p = xyz[order[i].item];
    out->x[i] = p[0];
    out->y[i] = p[1];
    out->z[i] = p[2];
  }
  vt_free(context, order);
  status = vt_build_bricks(context, branching, out);
  if (status) vt_free_level(context, out);
  return status;
}

static void copy_cell(const vt_level *from, uint32_t i, vt_level *to, uint32_t j) {
  to->x[j] = from->x[i];
  to->y[j] = from->y[i];
  to->z[j] = from->z[i];
  to->optical_depth[j] = from->optical_depth[i];
  memcpy(to->colour + 3 * (size_t)j, from->colour + 3 * (size_t)i, 3 * sizeof(float));
}

static size_t count_kept(const vt_level *level, const uint8_t *keep) {
  size_t count = 0;
  for (uint32_t i = 0; i < level->cell_count; i++) count += !keep || keep[i];
  return count;
}

vt_status vt_filter_level(vt_context *context, int branching, int level_number, const vt_level *level,
                          const uint8_t *keep, vt_level *out) {
  vt_status status = vt_allocate_level(context, branching, level_number, count_kept(level, keep), out);
  if (status) return status;
  for (uint32_t i = 0, j = 0; i < level->cell_count; i++)
    if (!keep || keep[i]) copy_cell(level, i, out, j++);
  status = vt_build_bricks(context, branching, out);
  if (status) vt_free_level(context, out);
  return status;
}

vt_status vt_split_level(vt_context *context, int branching, int level, const vt_level *parent, const uint8_t *keep,
                         vt_level *out) {
  uint32_t b = (uint32_t)branching, children = b * b * b;
  vt_status status = vt_allocate_level(context, branching, level + 1, children * count_kept(parent, keep), out);
  if (status) return status;
  uint32_t j = 0;
  for (uint32_t i = 0; i < parent->cell_count; i++) {
    if (keep && !keep[i]) continue;
    for (uint32_t child = 0; child < children; child++, j++) { // x runs fastest: Morton order
      copy_cell(parent, i, out, j);
      out->x[j] = (uint16_t)(parent->x[i] * b + child % b);
      out->y[j] = (uint16_t)(parent->y[i] * b + child / b % b);
      out->z[j] = (uint16_t)(parent->z[i] * b + child / (b * b));
      out->optical_depth[j] = parent->optical_depth[i] / (float)branching;
    }
  }
  status = vt_build_bricks(context, branching, out);
  if (status) vt_free_level(context, out);
  return status;
}

uint32_t vt_find_cell(const vt_level *level, int branching, int x, int y, int z) {
  if (x < 0 || y < 0 || z < 0 || x >= level->axis_cells || y >= level->axis_cells || z >= level->axis_cells)
    return VT_NO_CELL;
  int e = vt_brick_edge(branching), at[3] = {x / e, y / e, z / e}, skip;
  int32_t number = vt_find_brick(level, at, &skip);
  if (number < 0) return VT_NO_CELL;
  const vt_brick *brick = &level->bricks[number];
  uint64_t bit = 1ull << vt_brick_bit(branching, (unsigned)(x % e), (unsigned)(y % e), (unsigned)(z % e));
  return brick->mask & bit ? brick->first + vt_count_bits(brick->mask & (bit - 1)) : VT_NO_CELL;
}

double vt_cell_edge(const vt_octree *octree, int level) {
  return octree->edge / axis_cells_of(octree->branching, level);
}

vt_vec3 vt_cell_centre(const vt_octree *octree, int level, uint32_t cell) {
  const vt_level *cells = &octree->levels[level];
  double edge = octree->edge / cells->axis_cells;
  vt_vec3 offset = vt_v3(cells->x[cell] + 0.5, cells->y[cell] + 0.5, cells->z[cell] + 0.5);
  return vt_add(octree->origin, vt_scale(offset, edge));
}
