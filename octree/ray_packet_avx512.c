// ray_packet_avx512.c - the walk of a packet of rays, sixteen at a time, AVX-512
// SPDX-License-Identifier: BSD-3-Clause

#include "octree/lanes_avx512.h"

#ifdef VT_LANE_COUNT
#include "octree/ray_packet_kernel.h"

VT_LANE_TARGET void vt_walk_lanes_avx512(const vt_walk_grid *grid, const vt_ray_packet *packet, int first, vt_chord *out,
                                     size_t capacity, uint32_t *count) {
  walk_lanes(grid, packet, first, out, capacity, count);
}
#else // another processor or compiler: never chosen
#include "octree/ray_packet.h"

void vt_walk_lanes_avx512(const vt_walk_grid *grid, const vt_ray_packet *packet, int first, vt_chord *out, size_t capacity,
                      uint32_t *count) {
  vt_walk_lanes_plain(grid, packet, first, out, capacity, count);
}
#endif
