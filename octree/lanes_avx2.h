// lanes_avx2.h - eight rays in a packet: the operations of ray_packet_kernel.h in AVX2
// SPDX-License-Identifier: BSD-3-Clause
//
// See lanes_plain.h for what each must do. Where AVX2 is weak something else stands in: gathers of whole bricks are eight
// loads and a transpose, scatters of chords are eight stores of eight bytes, popcounts are a table of nibbles.
#ifndef VT_OCTREE_LANES_AVX2_H
#define VT_OCTREE_LANES_AVX2_H

#include "octree/cells.h"
#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#include <string.h>

#define VT_LANE_COUNT 8
#define VT_LANE_TARGET __attribute__((target("avx2")))
#define VT_LANE_OP static inline __attribute__((always_inline, target("avx2")))

typedef __m256i vt_ints;
typedef struct vt_reals { __m256d a, b; } vt_reals;
typedef __m256i vt_choice;

VT_LANE_OP vt_ints spread(int32_t v) { return _mm256_set1_epi32(v); }
VT_LANE_OP vt_ints load_ints(const int32_t *p) { return _mm256_loadu_si256((const __m256i *)p); }
VT_LANE_OP void store_ints(int32_t *p, vt_ints v) { _mm256_storeu_si256((__m256i *)p, v); }
VT_LANE_OP vt_ints add(vt_ints a, vt_ints b) { return _mm256_add_epi32(a, b); }
VT_LANE_OP vt_ints subtract(vt_ints a, vt_ints b) { return _mm256_sub_epi32(a, b); }
VT_LANE_OP vt_ints shift_up(vt_ints v, int bits) { return _mm256_sll_epi32(v, _mm_cvtsi32_si128(bits)); }
VT_LANE_OP vt_ints lower(vt_ints a, vt_ints b) { return _mm256_min_epi32(a, b); }
VT_LANE_OP vt_ints higher(vt_ints a, vt_ints b) { return _mm256_max_epi32(a, b); }
VT_LANE_OP vt_ints bits_and(vt_ints a, vt_ints b) { return _mm256_and_si256(a, b); }
VT_LANE_OP vt_ints bits_or(vt_ints a, vt_ints b) { return _mm256_or_si256(a, b); }
VT_LANE_OP vt_ints bits_xor(vt_ints a, vt_ints b) { return _mm256_xor_si256(a, b); }
VT_LANE_OP vt_ints bits_without(vt_ints a, vt_ints b) { return _mm256_andnot_si256(b, a); }

VT_LANE_OP vt_choice equal(vt_ints a, vt_ints b) { return _mm256_cmpeq_epi32(a, b); }
VT_LANE_OP vt_choice greater(vt_ints a, vt_ints b) { return _mm256_cmpgt_epi32(a, b); }
VT_LANE_OP vt_choice both(vt_choice a, vt_choice b) { return _mm256_and_si256(a, b); }
VT_LANE_OP vt_choice without(vt_choice a, vt_choice b) { return _mm256_andnot_si256(b, a); }
VT_LANE_OP bool any(vt_choice a) { return !_mm256_testz_si256(a, a); }
VT_LANE_OP vt_ints choose(vt_choice c, vt_ints a, vt_ints b) { return _mm256_blendv_epi8(b, a, c); }
VT_LANE_OP vt_ints add_where(vt_choice c, vt_ints a, vt_ints b) { return _mm256_add_epi32(a, _mm256_and_si256(c, b)); }
VT_LANE_OP vt_choice chosen(const int32_t *p) { return load_ints(p); }

VT_LANE_OP vt_reals spread_real(double v) { return (vt_reals){_mm256_set1_pd(v), _mm256_set1_pd(v)}; }
VT_LANE_OP vt_reals load_reals(const double *p) { return (vt_reals){_mm256_loadu_pd(p), _mm256_loadu_pd(p + 4)}; }
VT_LANE_OP vt_reals to_reals(vt_ints v) {
  return (vt_reals){_mm256_cvtepi32_pd(_mm256_castsi256_si128(v)), _mm256_cvtepi32_pd(_mm256_extracti128_si256(v, 1))};
}
VT_LANE_OP vt_ints to_ints(vt_reals v) {
  return _mm256_inserti128_si256(_mm256_castsi128_si256(_mm256_cvtpd_epi32(v.a)), _mm256_cvtpd_epi32(v.b), 1);
}
VT_LANE_OP vt_reals whole_part(vt_reals v) {
  return (vt_reals){_mm256_round_pd(v.a, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC),
                    _mm256_round_pd(v.b, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC)};
}
VT_LANE_OP vt_reals add_reals(vt_reals a, vt_reals b) {
  return (vt_reals){_mm256_add_pd(a.a, b.a), _mm256_add_pd(a.b, b.b)};
}
VT_LANE_OP vt_reals subtract_reals(vt_reals a, vt_reals b) {
  return (vt_reals){_mm256_sub_pd(a.a, b.a), _mm256_sub_pd(a.b, b.b)};
}
VT_LANE_OP vt_reals multiply_reals(vt_reals a, vt_reals b) {
  return (vt_reals){_mm256_mul_pd(a.a, b.a), _mm256_mul_pd(a.b, b.b)};
}
VT_LANE_OP vt_reals lower_real(vt_reals a, vt_reals b) {
  return (vt_reals){_mm256_min_pd(a.a, b.a), _mm256_min_pd(a.b, b.b)};
}
VT_LANE_OP vt_reals higher_real(vt_reals a, vt_reals b) {
  return (vt_reals){_mm256_max_pd(a.a, b.a), _mm256_max_pd(a.b, b.b)};
}
VT_LANE_OP vt_choice narrow(__m256d a, __m256d b) {
  __m256 halves = _mm256_shuffle_ps(_mm256_castpd_ps(a), _mm256_castpd_ps(b), 0x88);
  return _mm256_permute4x64_epi64(_mm256_castps_si256(halves), 0xd8);
}
VT_LANE_OP vt_choice greater_real(vt_reals a, vt_reals b) {
  return narrow(_mm256_cmp_pd(a.a, b.a, _CMP_GT_OQ), _mm256_cmp_pd(a.b, b.b, _CMP_GT_OQ));
}
VT_LANE_OP vt_reals choose_equal(vt_reals p, vt_reals q, vt_reals a, vt_reals b) {
  return (vt_reals){_mm256_blendv_pd(b.a, a.a, _mm256_cmp_pd(p.a, q.a, _CMP_EQ_OQ)),
                    _mm256_blendv_pd(b.b, a.b, _mm256_cmp_pd(p.b, q.b, _CMP_EQ_OQ))};
}

VT_LANE_OP vt_ints gather(const int32_t *table, vt_ints at) { return _mm256_i32gather_epi32(table, at, 4); }

typedef struct vt_lane_bricks { vt_ints low, high, first_low, first_high; } vt_lane_bricks;

VT_LANE_OP vt_ints count_set(vt_ints v) {
  const __m256i table = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4, 0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3,
                                         2, 3, 3, 4),
                nibble = _mm256_set1_epi8(15);
  __m256i bytes = _mm256_add_epi8(_mm256_shuffle_epi8(table, _mm256_and_si256(v, nibble)),
                                  _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi32(v, 4), nibble)));
  return _mm256_madd_epi16(_mm256_maddubs_epi16(bytes, _mm256_set1_epi8(1)), _mm256_set1_epi16(1));
}
VT_LANE_OP __m256i two_bricks(const vt_brick *bricks, int32_t a, int32_t b) {
  return _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_loadu_si128((const __m128i *)(bricks + a))),
                                 _mm_loadu_si128((const __m128i *)(bricks + b)), 1);
}
VT_LANE_OP vt_lane_bricks load_bricks(const vt_brick *bricks, vt_ints at) {
  int32_t i[8];
  store_ints(i, at);
  __m256i a = two_bricks(bricks, i[0], i[4]), b = two_bricks(bricks, i[1], i[5]), c = two_bricks(bricks, i[2], i[6]),
          d = two_bricks(bricks, i[3], i[7]);
  __m256i ab = _mm256_unpacklo_epi32(a, b), cd = _mm256_unpacklo_epi32(c, d);
  __m256i low = _mm256_unpacklo_epi64(ab, cd), high = _mm256_unpackhi_epi64(ab, cd);
  __m256i first = _mm256_unpacklo_epi64(_mm256_unpackhi_epi32(a, b), _mm256_unpackhi_epi32(c, d));
  return (vt_lane_bricks){low, high, first, add(first, count_set(low))};
}
VT_LANE_OP vt_choice find_in_brick(const vt_lane_bricks *b, vt_ints bit, vt_ints *cell) {
  __m256 in_high = _mm256_castsi256_ps(_mm256_slli_epi32(bit, 26)); // the sign decides
  __m256i half = _mm256_castps_si256(_mm256_blendv_ps(_mm256_castsi256_ps(b->low), _mm256_castsi256_ps(b->high), in_high));
  __m256i first = _mm256_castps_si256(
      _mm256_blendv_ps(_mm256_castsi256_ps(b->first_low), _mm256_castsi256_ps(b->first_high), in_high));
  __m256i one = _mm256_sllv_epi32(_mm256_set1_epi32(1), _mm256_and_si256(bit, _mm256_set1_epi32(31)));
  __m256i below = _mm256_add_epi32(one, _mm256_set1_epi32(-1));
  *cell = _mm256_add_epi32(first, count_set(_mm256_and_si256(half, below)));
  return _mm256_cmpeq_epi32(_mm256_and_si256(half, one), one);
}
VT_LANE_OP void store_two(vt_chord *out, int32_t a, int32_t b, __m128 pair) {
  _mm_storel_pi((__m64 *)(void *)(out + a), pair);
  _mm_storeh_pi((__m64 *)(void *)(out + b), pair);
}
VT_LANE_OP void store_chords(vt_chord *out, vt_ints at, vt_choice c, vt_ints cell, vt_ints length, float unit) {
  (void)c;
  __m256 l = _mm256_mul_ps(_mm256_cvtepi32_ps(length), _mm256_set1_ps(unit)), k = _mm256_castsi256_ps(cell);
  __m256 p = _mm256_unpacklo_ps(k, l), q = _mm256_unpackhi_ps(k, l); // lanes 0 1 4 5 and 2 3 6 7
  int32_t i[8];
  store_ints(i, at);
  store_two(out, i[0], i[1], _mm256_castps256_ps128(p));
  store_two(out, i[2], i[3], _mm256_castps256_ps128(q));
  store_two(out, i[4], i[5], _mm256_extractf128_ps(p, 1));
  store_two(out, i[6], i[7], _mm256_extractf128_ps(q, 1));
}

#endif
#endif
