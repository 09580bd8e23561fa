// lanes_plain.h - a packet of one ray: the operations of ray_packet_kernel.h without vector instructions
// SPDX-License-Identifier: BSD-3-Clause
//
// The twins lanes_avx2.h and lanes_avx512.h offer the same names for 8 and 16 lanes. A file includes one of them, then the
// kernel. Every operation rounds alike in all three, so a ray's chords have the same bits in a packet of any width.
#ifndef VT_OCTREE_LANES_PLAIN_H
#define VT_OCTREE_LANES_PLAIN_H

#include "octree/cells.h"

#include <math.h>

#ifdef __cplusplus
extern "C" {
#endif

#define VT_LANE_COUNT 1
#define VT_LANE_TARGET
#define VT_LANE_OP static inline

typedef int32_t vt_ints;   // one number per lane
typedef double vt_reals;   //
typedef int32_t vt_choice; // all bits set where a lane is chosen

VT_LANE_OP vt_ints spread(int32_t v) { return v; }
VT_LANE_OP vt_ints load_ints(const int32_t *p) { return *p; }
VT_LANE_OP void store_ints(int32_t *p, vt_ints v) { *p = v; }
VT_LANE_OP vt_ints add(vt_ints a, vt_ints b) { return a + b; }
VT_LANE_OP vt_ints subtract(vt_ints a, vt_ints b) { return a - b; }
VT_LANE_OP vt_ints shift_up(vt_ints v, int bits) { return v << bits; }
VT_LANE_OP vt_ints lower(vt_ints a, vt_ints b) { return a < b ? a : b; }
VT_LANE_OP vt_ints higher(vt_ints a, vt_ints b) { return a > b ? a : b; }
VT_LANE_OP vt_ints bits_and(vt_ints a, vt_ints b) { return a & b; }
VT_LANE_OP vt_ints bits_or(vt_ints a, vt_ints b) { return a | b; }
VT_LANE_OP vt_ints bits_xor(vt_ints a, vt_ints b) { return a ^ b; }
VT_LANE_OP vt_ints bits_without(vt_ints a, vt_ints b) { return a & ~b; }

VT_LANE_OP vt_choice equal(vt_ints a, vt_ints b) { return -(a == b); }
VT_LANE_OP vt_choice greater(vt_ints a, vt_ints b) { return -(a > b); }
VT_LANE_OP vt_choice both(vt_choice a, vt_choice b) { return a & b; }
VT_LANE_OP vt_choice without(vt_choice a, vt_choice b) { return a & ~b; }
VT_LANE_OP bool any(vt_choice a) { return a != 0; }
VT_LANE_OP vt_ints choose(vt_choice c, vt_ints a, vt_ints b) { return c ? a : b; }
VT_LANE_OP vt_ints add_where(vt_choice c, vt_ints a, vt_ints b) { return a + (c & b); }
VT_LANE_OP vt_choice chosen(const int32_t *p) { return *p; }

VT_LANE_OP vt_reals spread_real(double v) { return v; }
VT_LANE_OP vt_reals load_reals(const double *p) { return *p; }
VT_LANE_OP vt_reals to_reals(vt_ints v) { return (double)v; }
VT_LANE_OP vt_ints to_ints(vt_reals v) { return (int32_t)lrint(v); } // to the nearest, as the others
VT_LANE_OP vt_reals whole_part(vt_reals v) { return (double)(int32_t)v; }
VT_LANE_OP vt_reals add_reals(vt_reals a, vt_reals b) { return a + b; }
VT_LANE_OP vt_reals subtract_reals(vt_reals a, vt_reals b) { return a - b; }
VT_LANE_OP vt_reals multiply_reals(vt_reals a, vt_reals b) { return a * b; }
VT_LANE_OP vt_reals lower_real(vt_reals a, vt_reals b) { return a < b ? a : b; }
VT_LANE_OP vt_reals higher_real(vt_reals a, vt_reals b) { return a > b ? a : b; }
VT_LANE_OP vt_choice greater_real(vt_reals a, vt_reals b) { return -(a > b); }
// a where p equals q, else b
VT_LANE_OP vt_reals choose_equal(vt_reals p, vt_reals q, vt_reals a, vt_reals b) { return p == q ? a : b; }

VT_LANE_OP vt_ints gather(const int32_t *table, vt_ints at) { return table[at]; }

// The brick of each lane; what `below` counts starts at the lower or the upper half of the mask.
typedef struct vt_lane_bricks { vt_ints low, high, first_low, first_high; } vt_lane_bricks;

VT_LANE_OP vt_ints count_set(vt_ints v) { return (int32_t)vt_count_bits((uint32_t)v); }
VT_LANE_OP vt_lane_bricks load_bricks(const vt_brick *bricks, vt_ints at) {
  const vt_brick *b = &bricks[at];
  uint32_t low = (uint32_t)b->mask, high = (uint32_t)(b->mask >> 32);
  return (vt_lane_bricks){(int32_t)low, (int32_t)high, (int32_t)b->first, (int32_t)(b->first + vt_count_bits(low))};
}
// Number of the cell at `bit` (0..63) of its lane's brick, and whether there is one.
VT_LANE_OP vt_choice find_in_brick(const vt_lane_bricks *b, vt_ints bit, vt_ints *cell) {
  bool in_high = (bit & 32) != 0;
  uint32_t half = (uint32_t)(in_high ? b->high : b->low), one = 1u << (bit & 31);
  *cell = (in_high ? b->first_high : b->first_low) + (int32_t)vt_count_bits(half & (one - 1));
  return -((half & one) != 0);
}

// Chords go to out[at]; lanes that are not chosen may write there too, since `at` of theirs does not move on.
VT_LANE_OP void store_chords(vt_chord *out, vt_ints at, vt_choice c, vt_ints cell, vt_ints length, float unit) {
  (void)c;
  out[at] = (vt_chord){(uint32_t)cell, (float)length * unit};
}

#ifdef __cplusplus
}
#endif
#endif
