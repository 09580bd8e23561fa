// ray_packet_kernel.h - the walk of a packet of rays, written once for any number of lanes
// SPDX-License-Identifier: BSD-3-Clause
//
// Included by ray_packet_plain.c, ray_packet_avx2.c and ray_packet_avx512.c behind their lanes_*.h; see ray_packet.c.
#ifndef VT_OCTREE_RAY_PACKET_KERNEL_H
#define VT_OCTREE_RAY_PACKET_KERNEL_H

#include "octree/ray_packet.h"
#ifndef VT_LANE_COUNT
#include "octree/lanes_plain.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define SHORTEST_CHORD 64 // units: 1e-6 edges
#define LONGEST_SPACING 0x1p30

// One axis of all lanes: distances in units, places in cells.
typedef struct vt_lane_axis {
  vt_reals origin, speed, inverse, stride;
  vt_reals corner; // of the brick; whole numbers
  vt_reals plane;  // distance at which the ray leaves the empty space ahead, or its brick
} vt_lane_axis;

typedef struct vt_lane_cells {
  vt_ints to_plane[3], spacing[3], number; // units to each axis' next plane; the cell's number within its brick
} vt_lane_cells;

VT_LANE_OP vt_reals place_at(const vt_lane_axis *axis, vt_reals t) {
  return add_reals(axis->origin, multiply_reals(t, axis->speed));
}

// Corner of the brick that holds a place, within [low, high].
VT_LANE_OP vt_reals corner_at(const vt_walk_grid *grid, vt_reals place, vt_reals low, vt_reals high) {
  vt_reals corner = multiply_reals(whole_part(multiply_reals(place, spread_real(1.0 / grid->width))), spread_real(grid->width));
  return lower_real(higher_real(corner, low), high);
}

// The cells of one brick in each chosen lane: at most 3 width - 2 steps, each to the nearest plane.
VT_LANE_OP vt_ints walk_cells(const vt_walk_grid *grid, const vt_ray_packet *p, int first, vt_choice here,
                              const vt_lane_bricks *bricks, vt_lane_cells c, vt_chord *out, vt_ints at) {
  const vt_ints bx = spread(grid->axis_bits[0]), by = spread(grid->axis_bits[1]), bz = spread(grid->axis_bits[2]);
  const vt_ints turn = load_ints(p->turn + first), shift = load_ints(p->shift + first), one = spread(1);
  vt_ints begun = spread(0), cell;
  do {
    vt_ints exit = lower(lower(c.to_plane[0], c.to_plane[1]), c.to_plane[2]), length = subtract(exit, begun);
    vt_choice there = find_in_brick(bricks, subtract(bits_xor(c.number, turn), shift), &cell);
    vt_choice long_enough = greater(length, spread(SHORTEST_CHORD - 1));
    there = both(both(there, long_enough), here);
    store_chords(out, at, there, cell, length, (float)(1 / VT_CHORD_UNITS));
    at = add_where(there, at, one);
    begun = choose(long_enough, exit, begun); // a shorter piece goes to the next cell
    vt_choice x = equal(c.to_plane[0], exit), y = without(equal(c.to_plane[1], exit), x);
    c.to_plane[0] = add_where(x, c.to_plane[0], c.spacing[0]);
    c.to_plane[1] = add_where(y, c.to_plane[1], c.spacing[1]);
    vt_ints bits = choose(x, bx, choose(y, by, bz));
    vt_choice z = equal(bits, bz);
    c.to_plane[2] = add_where(z, c.to_plane[2], c.spacing[2]);
    vt_ints counted = bits_and(add(bits_or(c.number, bits_xor(bits, spread(-1))), one), bits);
    c.number = bits_or(bits_without(c.number, bits), counted);
    here = both(here, greater(spread(64), c.number));
  } while (any(here));
  return at;
}

// Where each lane enters its brick: number of the cell, and units to the next plane of each axis.
VT_LANE_OP vt_lane_cells enter_brick(const vt_walk_grid *grid, const vt_ray_packet *p, int first, const vt_lane_axis axes[3],
                                     vt_reals t) {
  vt_lane_cells c;
  c.number = spread(0);
  for (int a = 0; a < 3; a++) {
    vt_reals last = spread_real(grid->width - 1), local = whole_part(subtract_reals(place_at(&axes[a], t), axes[a].corner));
    local = lower_real(higher_real(local, spread_real(0)), last);
    vt_reals beyond = multiply_reals(subtract_reals(last, local), load_reals(p->spacing[a] + first)); // planes after the next
    vt_reals units = subtract_reals(subtract_reals(axes[a].plane, t), beyond);
    c.to_plane[a] = to_ints(lower_real(units, spread_real(LONGEST_SPACING)));
    c.spacing[a] = load_ints(p->units[a] + first);
    vt_ints turned = add(to_ints(local), spread(4 - grid->width)), high = bits_and(turned, spread(grid->high_bit));
    turned = add(add(turned, high), add(high, high));
    c.number = add(c.number, shift_up(turned, grid->low_bit[a]));
  }
  return c;
}

// On to distance t, where the nearest plane ahead is: exactly there along its axis (or axes, at an edge or corner), and
// along the others as far as the empty space goes.
VT_LANE_OP void advance(const vt_walk_grid *grid, vt_lane_axis axes[3], bool jump, const vt_reals end[3], vt_reals nearest,
                        vt_reals t) {
  for (int a = 0; a < 3; a++) {
    vt_reals within = axes[a].corner;
    if (jump)
      within = corner_at(grid, place_at(&axes[a], t), within, subtract_reals(end[a], spread_real(grid->width)));
    axes[a].corner = choose_equal(axes[a].plane, nearest, end[a], within);
  }
}

// What vt_look_up_turned says of each lane's brick: rare and slow, for very fine and very sparse levels.
VT_LANE_TARGET static void look_up_pages(const vt_walk_grid *grid, const vt_ray_packet *p, int first, vt_choice alive,
                                         const vt_lane_axis axes[3], int32_t entry[VT_LANE_COUNT],
                                         int32_t reach[3][VT_LANE_COUNT]) {
  int32_t corner[3][VT_LANE_COUNT], active[VT_LANE_COUNT];
  for (int a = 0; a < 3; a++) store_ints(corner[a], to_ints(axes[a].corner));
  store_ints(active, choose(alive, spread(1), spread(0)));
  for (int l = 0; l < VT_LANE_COUNT; l++) {
    int at[3], ahead[3] = {1, 1, 1};
    for (int a = 0; a < 3; a++) at[a] = corner[a][l] / grid->width;
    entry[l] = active[l] ? vt_look_up_turned(grid->level, at, p->turned[first + l], ahead) : -1;
    for (int a = 0; a < 3; a++) reach[a][l] = ahead[a];
  }
}

// The map's entry of each lane's brick, and how many bricks further along each axis the same holds.
VT_LANE_OP vt_ints look_up(const vt_walk_grid *grid, const vt_ray_packet *p, int first, vt_choice alive,
                           const vt_lane_axis axes[3], vt_ints reach[3]) {
  const vt_brick_map *map = &grid->level->map;
  if (map->depth) {
    int32_t entry[VT_LANE_COUNT], further[3][VT_LANE_COUNT];
    look_up_pages(grid, p, first, alive, axes, entry, further);
    for (int a = 0; a < 3; a++) reach[a] = load_ints(further[a]);
    return load_ints(entry);
  }
  vt_reals at = load_reals(p->start + first);
  for (int a = 0; a < 3; a++) at = add_reals(at, multiply_reals(axes[a].corner, axes[a].stride));
  vt_ints entry = gather(map->entries, choose(alive, to_ints(at), spread(0)));
  reach[0] = reach[1] = reach[2] = higher(subtract(spread(0), entry), spread(1));
  return entry;
}

VT_LANE_OP void begin_axes(const vt_walk_grid *grid, const vt_ray_packet *p, int first, vt_lane_axis axes[3]) {
  for (int a = 0; a < 3; a++) {
    axes[a].origin = load_reals(p->origin[a] + first);
    axes[a].speed = load_reals(p->speed[a] + first);
    axes[a].inverse = load_reals(p->inverse[a] + first);
    axes[a].stride = load_reals(p->stride[a] + first);
    axes[a].corner = corner_at(grid, axes[a].origin, spread_real(0), spread_real((grid->bricks - 1) * grid->width));
  }
}

VT_LANE_TARGET static void walk_lanes(const vt_walk_grid *grid, const vt_ray_packet *p, int first, vt_chord *out,
                                      size_t capacity, uint32_t *count) {
  vt_choice alive = chosen(p->alive + first);
  if (!any(alive)) return;
  vt_lane_axis axes[3];
  begin_axes(grid, p, first, axes);
  int32_t begin[VT_LANE_COUNT], last[VT_LANE_COUNT];
  for (int l = 0; l < VT_LANE_COUNT; l++) // lanes store even what is no chord: those without a ray where no ray gets
    begin[l] = (int32_t)(p->alive[first + l] ? (size_t)l * capacity : capacity - 1);
  vt_ints at = load_ints(begin);
  vt_reals t = spread_real(0);
  do {
    vt_ints reach[3], entry = look_up(grid, p, first, alive, axes, reach);
    bool jump = any(greater(higher(higher(reach[0], reach[1]), reach[2]), spread(1))); // else nothing waits for the map
    vt_reals end[3];
    for (int a = 0; a < 3; a++) {
      end[a] = add_reals(axes[a].corner, spread_real(grid->width));
      if (jump) end[a] = add_reals(axes[a].corner, multiply_reals(to_reals(reach[a]), spread_real(grid->width)));
      axes[a].plane = multiply_reals(subtract_reals(end[a], axes[a].origin), axes[a].inverse);
    }
    vt_choice here = both(alive, greater(entry, spread(-1)));
    if (any(here)) {
      vt_lane_bricks bricks = load_bricks(grid->level->bricks, higher(entry, spread(0)));
      at = walk_cells(grid, p, first, here, &bricks, enter_brick(grid, p, first, axes, t), out, at);
    }
    vt_reals nearest = lower_real(lower_real(axes[0].plane, axes[1].plane), axes[2].plane);
    t = higher_real(nearest, t); // rounding may have put a plane behind
    advance(grid, axes, jump, end, nearest, t);
    vt_reals farthest = higher_real(higher_real(axes[0].corner, axes[1].corner), axes[2].corner);
    alive = both(alive, greater_real(spread_real(grid->bricks * grid->width), farthest));
  } while (any(alive));
  store_ints(last, at);
  for (int l = 0; l < VT_LANE_COUNT; l++) count[l] = (uint32_t)(last[l] - begin[l]);
}

#ifdef __cplusplus
}
#endif
#endif
