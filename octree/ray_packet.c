// ray_packet.c - the occupied cells along many rays at once
// SPDX-License-Identifier: BSD-3-Clause
//
// Rays of neighbouring pixels walk side by side, one per lane of the vector registers (16 with AVX-512, 8 with AVX2, 1
// without), through the same code in ray_packet_kernel.h. What makes that pay, and keeps it exact:
//
// - Turned axes. An axis that a ray follows downwards is turned round, x -> n - x, so every ray moves up along every axis
//   and no lane differs from its neighbour by a sign. Cells stay half-open; a ray along a face belongs to the cell above.
// - One move for empty space and for the next brick. The map says for each brick s = 1 if it holds cells, else the
//   distance to the nearest that does (in bricks, the larger of the axes' distances). The cube of s - 1 bricks around is
//   empty, so the ray goes on to its surface, t = min_a ((b_a + s) w - o_a) / d_a, where it enters brick b_a + s of that axis
//   exactly, by its integer number; the other axes are located from o + t d, held within the cube. No brick is missed
//   and none met twice, whatever is rounded. Where no lane may jump (s = 1 in all) the next brick is known before the map has
//   answered, and the processor runs ahead: what is slow here is the chain of dependent operations, not their number.
// - Doubles for bricks, integers for cells. Distances to a brick's planes are made anew from their integer numbers, in
//   double. Within a brick they are whole units of 2^-26 edges from where the ray enters it: what is added up there is exact, the
//   last plane is the brick's own, so chords telescope: those of a ray sum to its clipped length within 2^-27 edges a
//   brick and a float's last bit a chord, 10^-7 of the root's edge in all.
//   Floats would be 30 times coarser and lose the cells' order near corners; half of the lanes would pay for doubles.
// - A cell's number within its brick is kept with its bits spread out (Morton order), two of x, y and z each and a third
//   on top: adding one with the other axes' bits set carries along one axis only, and number >= 64 means that the ray has left.
// - An axis without movement has its planes 10^30 edges away, not infinitely far: no product is ever 0 x infinity.
//
// Every lane does the same operations in the same order as the plain instance and nothing is fused, so chords have the
// same bits for any number of lanes. Pieces below 10^-6 edges are joined to the next cell of the brick.
// Amanatides & Woo 1987, A fast voxel traversal algorithm; distances as in Museth 2013, VDB (there hierarchical).

#include "octree/ray_packet.h"

#include <math.h>

#define FAR_AWAY 1e30

vt_walk_path vt_best_walk_path(void) {
#if defined(__GNUC__) && defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq"))
    return VT_WALK_AVX512;
  if (__builtin_cpu_supports("avx2")) return VT_WALK_AVX2;
#endif
  return VT_WALK_PLAIN;
}

static vt_walk_grid grid_of(const vt_level *level, int branching) {
  vt_walk_grid grid = {.level = level, .bricks = level->axis_bricks, .width = vt_brick_edge(branching)};
  if (grid.width > level->axis_cells) grid.width = level->axis_cells; // the root and its children are less than a brick
  for (int a = 0; a < 3; a++) {
    int low = branching == 2 ? a : 2 * a, high = branching == 2 ? a + 3 : 2 * a + 1; // x + 4 y + 16 z in the tri-grid
    grid.axis_bits[a] = 1 << low | 1 << high | 1 << (a + 6);
    grid.low_bit[a] = low;
  }
  grid.high_bit = branching == 2 ? 2 : 0;
  return grid;
}

// Turns one axis of a ray so that it moves up, and clips the ray to 0 <= x < n along it.
static void prepare_axis(const vt_walk_grid *grid, double origin, double direction, int axis, int i, vt_ray_packet *p,
                         double *near, double *far) {
  double n = grid->level->axis_cells, speed = fabs(direction);
  bool still = speed <= 1e-12, turned = direction < 0 && !still;
  if (turned) origin = n - origin;
  double inverse = still ? FAR_AWAY : 1 / speed, enter = (0 - origin) * inverse, leave = (n - origin) * inverse;
  if (still) enter = origin >= 0 && origin < n ? 0 : FAR_AWAY, leave = FAR_AWAY;
  *near = enter > *near ? enter : *near;
  *far = leave < *far ? leave : *far;
  p->origin[axis][i] = origin;
  p->speed[axis][i] = still ? 0 : speed / VT_CHORD_UNITS;
  double units = inverse * VT_CHORD_UNITS;
  p->inverse[axis][i] = units;
  p->units[axis][i] = units < 0x1p30 ? (int32_t)(units + 0.5) : 1 << 30;
  p->spacing[axis][i] = units < 0x1p30 ? p->units[axis][i] : still ? 0 : units;
  double across = grid->bricks, stride = axis == 0 ? 1 : axis == 1 ? across : across * across;
  p->stride[axis][i] = (turned ? -stride : stride) / grid->width;
  p->start[i] += turned ? stride * (across - 1) : 0;
  p->turned[i] |= (uint8_t)(turned << axis);
  int32_t gap = 4 - grid->width;
  p->turn[i] |= turned ? (3 + 3 * grid->high_bit) << grid->low_bit[axis] : 0;
  p->shift[i] += turned ? 0 : (gap + (gap & grid->high_bit) * 3) << grid->low_bit[axis];
}

static void prepare_ray(const vt_walk_grid *grid, vt_vec3 origin, vt_vec3 direction, int i, vt_ray_packet *p) {
  double near = 0, far = FAR_AWAY;
  p->start[i] = 0;
  p->turn[i] = p->shift[i] = 0;
  p->turned[i] = 0;
  prepare_axis(grid, origin.x, direction.x, 0, i, p, &near, &far);
  prepare_axis(grid, origin.y, direction.y, 1, i, p, &near, &far);
  prepare_axis(grid, origin.z, direction.z, 2, i, p, &near, &far);
  double n = grid->level->axis_cells;
  double finite = 0 * (origin.x + origin.y + origin.z + direction.x + direction.y + direction.z); // else NaN
  p->alive[i] = near < far && far < FAR_AWAY && finite == 0 && grid->level->cell_count ? -1 : 0;
  for (int a = 0; a < 3 && near > 0; a++) { // the walk begins at the root's surface: distances small, however far the eye
    double place = p->origin[a][i] + near * VT_CHORD_UNITS * p->speed[a][i];
    p->origin[a][i] = place > 0 ? place < n ? place : n : 0;
  }
}

void vt_walk_rays(const vt_octree *octree, int level_number, vt_walk_path path, const vt_ray *rays, int count,
                  vt_chord *out, size_t capacity, uint32_t *chord_count) {
  VT_ASSERT(count >= 0 && count <= VT_PACKET_RAYS && capacity >= vt_max_segments(&octree->levels[level_number]));
  const vt_level *level = &octree->levels[level_number];
  vt_walk_grid grid = grid_of(level, octree->branching);
  vt_ray_packet packet;
  double scale = level->axis_cells / octree->edge;
  for (int i = 0; i < count; i++)
    prepare_ray(&grid, vt_scale(vt_sub(rays[i].origin, octree->origin), scale), rays[i].direction, i, &packet);
  uint32_t found[VT_PACKET_RAYS] = {0};
  int lanes = path == VT_WALK_AVX512 ? 16 : path == VT_WALK_AVX2 ? 8 : 1;
  for (int i = count; i % lanes; i++) prepare_ray(&grid, vt_v3(0, 0, 0), vt_v3(0, 0, 0), i, &packet);
  vt_walk_lanes *walk = path == VT_WALK_AVX512 ? vt_walk_lanes_avx512 : path == VT_WALK_AVX2 ? vt_walk_lanes_avx2
                                                                                            : vt_walk_lanes_plain;
  for (int first = 0; first < count; first += lanes)
    walk(&grid, &packet, first, out + (size_t)first * capacity, capacity, found + first);
  for (int i = 0; i < count; i++) chord_count[i] = found[i];
}
