// ray_packet_plain.c - the walk of a packet of rays, one ray at a time, for every processor
// SPDX-License-Identifier: BSD-3-Clause

#include "octree/lanes_plain.h"

#include "octree/ray_packet_kernel.h"

void vt_walk_lanes_plain(const vt_walk_grid *grid, const vt_ray_packet *packet, int first, vt_chord *out, size_t capacity,
                         uint32_t *count) {
  walk_lanes(grid, packet, first, out, capacity, count);
}
