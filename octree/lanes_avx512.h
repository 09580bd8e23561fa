// lanes_avx512.h - sixteen rays in a packet: the operations of ray_packet_kernel.h in AVX-512 (F, BW, DQ)
// SPDX-License-Identifier: BSD-3-Clause
//
// See lanes_plain.h for what each must do.
#ifndef VT_OCTREE_LANES_AVX512_H
#define VT_OCTREE_LANES_AVX512_H

#include "octree/cells.h"
#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>

#define VT_LANE_COUNT 16
#define VT_LANE_TARGET __attribute__((target("avx512f,avx512bw,avx512dq")))
#define VT_LANE_OP static inline __attribute__((always_inline, target("avx512f,avx512bw,avx512dq")))

typedef __m512i vt_ints;
typedef struct vt_reals { __m512d a, b; } vt_reals;
typedef __mmask16 vt_choice;

VT_LANE_OP vt_ints spread(int32_t v) { return _mm512_set1_epi32(v); }
VT_LANE_OP vt_ints load_ints(const int32_t *p) { return _mm512_loadu_si512(p); }
VT_LANE_OP void store_ints(int32_t *p, vt_ints v) { _mm512_storeu_si512(p, v); }
VT_LANE_OP vt_ints add(vt_ints a, vt_ints b) { return _mm512_add_epi32(a, b); }
VT_LANE_OP vt_ints subtract(vt_ints a, vt_ints b) { return _mm512_sub_epi32(a, b); }
VT_LANE_OP vt_ints shift_up(vt_ints v, int bits) { return _mm512_sllv_epi32(v, _mm512_set1_epi32(bits)); }
VT_LANE_OP vt_ints lower(vt_ints a, vt_ints b) { return _mm512_min_epi32(a, b); }
VT_LANE_OP vt_ints higher(vt_ints a, vt_ints b) { return _mm512_max_epi32(a, b); }
VT_LANE_OP vt_ints bits_and(vt_ints a, vt_ints b) { return _mm512_and_si512(a, b); }
VT_LANE_OP vt_ints bits_or(vt_ints a, vt_ints b) { return _mm512_or_si512(a, b); }
VT_LANE_OP vt_ints bits_xor(vt_ints a, vt_ints b) { return _mm512_xor_si512(a, b); }
VT_LANE_OP vt_ints bits_without(vt_ints a, vt_ints b) { return _mm512_andnot_si512(b, a); }

VT_LANE_OP vt_choice equal(vt_ints a, vt_ints b) { return _mm512_cmpeq_epi32_mask(a, b); }
VT_LANE_OP vt_choice greater(vt_ints a, vt_ints b) { return _mm512_cmpgt_epi32_mask(a, b); }
VT_LANE_OP vt_choice both(vt_choice a, vt_choice b) { return (vt_choice)(a & b); }
VT_LANE_OP vt_choice without(vt_choice a, vt_choice b) { return (vt_choice)(a & ~b); }
VT_LANE_OP bool any(vt_choice a) { return a != 0; }
VT_LANE_OP vt_ints choose(vt_choice c, vt_ints a, vt_ints b) { return _mm512_mask_mov_epi32(b, c, a); }
VT_LANE_OP vt_ints add_where(vt_choice c, vt_ints a, vt_ints b) { return _mm512_mask_add_epi32(a, c, a, b); }
VT_LANE_OP vt_choice chosen(const int32_t *p) { return _mm512_cmpneq_epi32_mask(load_ints(p), _mm512_setzero_si512()); }

VT_LANE_OP vt_reals spread_real(double v) { return (vt_reals){_mm512_set1_pd(v), _mm512_set1_pd(v)}; }
VT_LANE_OP vt_reals load_reals(const double *p) { return (vt_reals){_mm512_loadu_pd(p), _mm512_loadu_pd(p + 8)}; }
VT_LANE_OP vt_reals to_reals(vt_ints v) {
  return (vt_reals){_mm512_cvtepi32_pd(_mm512_castsi512_si256(v)), _mm512_cvtepi32_pd(_mm512_extracti64x4_epi64(v, 1))};
}
VT_LANE_OP vt_ints to_ints(vt_reals v) {
  return _mm512_inserti64x4(_mm512_castsi256_si512(_mm512_cvtpd_epi32(v.a)), _mm512_cvtpd_epi32(v.b), 1);
}
VT_LANE_OP vt_reals whole_part(vt_reals v) {
  return (vt_reals){_mm512_roundscale_pd(v.a, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC),
                    _mm512_roundscale_pd(v.b, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC)};
}
VT_LANE_OP vt_reals add_reals(vt_reals a, vt_reals b) {
  return (vt_reals){_mm512_add_pd(a.a, b.a), _mm512_add_pd(a.b, b.b)};
}
VT_LANE_OP vt_reals subtract_reals(vt_reals a, vt_reals b) {
  return (vt_reals){_mm512_sub_pd(a.a, b.a), _mm512_sub_pd(a.b, b.b)};
}
VT_LANE_OP vt_reals multiply_reals(vt_reals a, vt_reals b) {
  return (vt_reals){_mm512_mul_pd(a.a, b.a), _mm512_mul_pd(a.b, b.b)};
}
VT_LANE_OP vt_reals lower_real(vt_reals a, vt_reals b) {
  return (vt_reals){_mm512_min_pd(a.a, b.a), _mm512_min_pd(a.b, b.b)};
}
VT_LANE_OP vt_reals higher_real(vt_reals a, vt_reals b) {
  return (vt_reals){_mm512_max_pd(a.a, b.a), _mm512_max_pd(a.b, b.b)};
}
VT_LANE_OP vt_choice greater_real(vt_reals a, vt_reals b) {
  unsigned p = _mm512_cmp_pd_mask(a.a, b.a, _CMP_GT_OQ), q = _mm512_cmp_pd_mask(a.b, b.b, _CMP_GT_OQ);
  return (vt_choice)(p | q << 8);
}
VT_LANE_OP vt_reals choose_equal(vt_reals p, vt_reals q, vt_reals a, vt_reals b) {
  return (vt_reals){_mm512_mask_mov_pd(b.a, _mm512_cmp_pd_mask(p.a, q.a, _CMP_EQ_OQ), a.a),
                    _mm512_mask_mov_pd(b.b, _mm512_cmp_pd_mask(p.b, q.b, _CMP_EQ_OQ), a.b)};
}

VT_LANE_OP vt_ints gather(const int32_t *table, vt_ints at) { return _mm512_i32gather_epi32(at, table, 4); }

typedef struct vt_lane_bricks { vt_ints low, high, first_low, first_high; } vt_lane_bricks;

VT_LANE_OP vt_ints count_set(vt_ints v) {
  const __m512i table = _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4)),
                nibble = _mm512_set1_epi8(15);
  __m512i bytes = _mm512_add_epi8(_mm512_shuffle_epi8(table, _mm512_and_si512(v, nibble)),
                                  _mm512_shuffle_epi8(table, _mm512_and_si512(_mm512_srli_epi32(v, 4), nibble)));
  return _mm512_madd_epi16(_mm512_maddubs_epi16(bytes, _mm512_set1_epi8(1)), _mm512_set1_epi16(1));
}
VT_LANE_OP vt_lane_bricks load_bricks(const vt_brick *bricks, vt_ints at) {
  const int32_t *words = (const int32_t *)(const void *)bricks; // mask, first and a spare word
  __m512i i = _mm512_slli_epi32(at, 2);
  __m512i low = _mm512_i32gather_epi32(i, words, 4), high = _mm512_i32gather_epi32(i, words + 1, 4),
          first = _mm512_i32gather_epi32(i, words + 2, 4);
  return (vt_lane_bricks){low, high, first, add(first, count_set(low))};
}
VT_LANE_OP vt_choice find_in_brick(const vt_lane_bricks *b, vt_ints bit, vt_ints *cell) {
  __mmask16 in_high = _mm512_test_epi32_mask(bit, _mm512_set1_epi32(32));
  __m512i half = _mm512_mask_mov_epi32(b->low, in_high, b->high);
  __m512i first = _mm512_mask_mov_epi32(b->first_low, in_high, b->first_high);
  __m512i one = _mm512_sllv_epi32(_mm512_set1_epi32(1), _mm512_and_si512(bit, _mm512_set1_epi32(31)));
  __m512i below = _mm512_add_epi32(one, _mm512_set1_epi32(-1));
  *cell = _mm512_add_epi32(first, count_set(_mm512_and_si512(half, below)));
  return _mm512_test_epi32_mask(half, one);
}
VT_LANE_OP void store_chords(vt_chord *out, vt_ints at, vt_choice c, vt_ints cell, vt_ints length, float unit) {
  __m512i l = _mm512_castps_si512(_mm512_mul_ps(_mm512_cvtepi32_ps(length), _mm512_set1_ps(unit)));
  const __m512i low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23),
                high = _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
  _mm512_mask_i32scatter_epi64(out, (__mmask8)c, _mm512_castsi512_si256(at), _mm512_permutex2var_epi32(cell, low, l), 8);
  _mm512_mask_i32scatter_epi64(out, (__mmask8)(c >> 8), _mm512_extracti64x4_epi64(at, 1),
                               _mm512_permutex2var_epi32(cell, high, l), 8);
}

#endif
#endif
