// ray_packet.h - rays made ready for the packet walk, and its three instances
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_RAY_PACKET_H
#define VT_OCTREE_RAY_PACKET_H

#include "octree/cells.h"

#ifdef __cplusplus
extern "C" {
#endif

// Chords are counted in whole units within a brick: integers add up exactly, and a brick's diagonal is below 2^29.
#define VT_CHORD_UNITS 0x1p26

// Rays, every axis turned round that the ray follows downwards: then each ray moves up along each axis. Places are in cells,
// distances in units.
typedef struct vt_ray_packet {
  double origin[3][VT_PACKET_RAYS];   // where the ray enters the root
  double speed[3][VT_PACKET_RAYS];    // cells per unit, >= 0; 0 where the ray does not move along the axis
  double inverse[3][VT_PACKET_RAYS];  // 1 / speed; huge where it is 0
  double spacing[3][VT_PACKET_RAYS];  // distance between two planes, a whole number where it is short
  int32_t units[3][VT_PACKET_RAYS];   // the same, at most 2^30
  double stride[3][VT_PACKET_RAYS];   // what a cell further adds to the number of the map's entry
  double start[VT_PACKET_RAYS];       // number of the entry at the corner where turned coordinates are 0
  int32_t turn[VT_PACKET_RAYS], shift[VT_PACKET_RAYS]; // bit in a brick's mask = (turned number ^ turn) - shift
  uint8_t turned[VT_PACKET_RAYS];     // bit a: axis a is turned round
  int32_t alive[VT_PACKET_RAYS];      // -1 where the ray meets the root, else 0
} vt_ray_packet;

// What the rays of a level have in common.
typedef struct vt_walk_grid {
  const vt_level *level;
  int bricks, width;    // bricks along an edge of the root, cells along an edge of a brick
  int32_t axis_bits[3]; // bits of a cell's number within a brick that count each axis, the highest one for "left it"
  int low_bit[3];       // the lowest of them
  int32_t high_bit;     // 2 where the second bit stands three places higher (Morton order), 0 where it follows
} vt_walk_grid;

// The rays of a packet from number `first` on, as many as there are lanes (1, 8, 16): chords of lane i from
// out + i * capacity on, and their number to count[i].
typedef void vt_walk_lanes(const vt_walk_grid *, const vt_ray_packet *, int first, vt_chord *out, size_t capacity,
                           uint32_t *count);
vt_walk_lanes vt_walk_lanes_plain, vt_walk_lanes_avx2, vt_walk_lanes_avx512;

#ifdef __cplusplus
}
#endif
#endif
