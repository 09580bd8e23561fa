// cells.h - what the files of octree/ share about bricks
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_CELLS_H
#define VT_OCTREE_CELLS_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

static inline int vt_brick_edge(int branching) { return branching == 2 ? 4 : 3; }

// Number of a cell within its brick, in Morton order; x, y, z are 0..brick_edge-1. The tri-grid leaves numbers out, so that
// an axis has two bits there as well.
static inline unsigned vt_brick_bit(int branching, unsigned x, unsigned y, unsigned z) {
  if (branching == 3) return x + 4 * y + 16 * z;
  return (x & 1u) | (y & 1u) << 1 | (z & 1u) << 2 | (x & 2u) << 2 | (y & 2u) << 3 | (z & 2u) << 4;
}

// Number of set bits, without asking for a processor that has an instruction for it.
static inline unsigned vt_count_bits(uint64_t v) {
  v -= (v >> 1) & 0x5555555555555555ull;
  v = (v & 0x3333333333333333ull) + ((v >> 2) & 0x3333333333333333ull);
  v = (v + (v >> 4)) & 0x0f0f0f0f0f0f0f0full;
  return (unsigned)((v * 0x0101010101010101ull) >> 56);
}

// Number of the brick at integer coordinates (within the root) or -1. *skip: how many bricks on every side of it hold no
// cells for sure, itself included; 0 if it holds some.
int32_t vt_find_brick(const vt_level *, const int at[3], int *skip);
// The same in the coordinates of a ray that goes up along every axis (bit a of `turned`: axis a is turned round): ahead[a]
// is how many bricks further along each axis the empty space goes, 1 for a brick.
int32_t vt_look_up_turned(const vt_level *, const int at[3], int turned, int ahead[3]);

// Fills axis_bricks, bricks and map of a level whose cells stand in Morton order.
vt_status vt_build_bricks(vt_context *, int branching, vt_level *);
// At most so many bytes do bricks and map of so many cells take, wherever they are.
uint64_t vt_brick_memory_bound(int branching, int level, uint64_t cell_count);
// Arrays for `count` cells, zeroed; axis_cells set; no bricks yet.
vt_status vt_allocate_level(vt_context *, int branching, int level, size_t count, vt_level *out);

#ifdef __cplusplus
}
#endif
#endif
