// field_avx2.c - the loops of field.c, eight chords at a time, AVX2
// SPDX-License-Identifier: BSD-3-Clause
//
// Middles of four chords in doubles at a time; a cell's corners two to a register, so that mixing along x and z takes them
// in pairs; pixels of a texture by gathers of four bytes, of which two are used. Chords that do not fill eight are filled up
// with the last of them.

#include "octree/field.h"

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#include <string.h>

#define TARGET __attribute__((target("avx2")))
#define OP static inline __attribute__((always_inline, target("avx2")))

// ---- middles

OP __m128i four_of(const uint16_t *p, const vt_chord *c) {
  return _mm_setr_epi32(p[c[0].cell], p[c[1].cell], p[c[2].cell], p[c[3].cell]);
}

// (from - at) + t d, within 0..1
OP __m128 place_inside(const vt_field_ray *ray, int a, __m256d at, __m256d t) {
  __m256d from = _mm256_sub_pd(_mm256_set1_pd(ray->origin[a]), at);
  __m128 place = _mm256_cvtpd_ps(_mm256_add_pd(from, _mm256_mul_pd(t, _mm256_set1_pd(ray->direction[a]))));
  return _mm_min_ps(_mm_max_ps(place, _mm_setzero_ps()), _mm_set1_ps(1));
}

OP void middles_of_four(const vt_level *cells, const vt_field_ray *ray, const vt_chord *chords, float *along,
                        float (*inside)[4]) {
  const __m128i places[3] = {four_of(cells->x, chords), four_of(cells->y, chords), four_of(cells->z, chords)};
  __m256d at[3], enter = _mm256_setzero_pd();
  for (int a = 0; a < 3; a++) {
    at[a] = _mm256_cvtepi32_pd(places[a]);
    __m256d ahead = _mm256_add_pd(at[a], _mm256_set1_pd(ray->ahead[a]));
    ahead = _mm256_sub_pd(ahead, _mm256_set1_pd(ray->origin[a]));
    enter = _mm256_max_pd(_mm256_mul_pd(ahead, _mm256_set1_pd(ray->inverse[a])), enter);
  }
  __m128 length = _mm_setr_ps(chords[0].length, chords[1].length, chords[2].length, chords[3].length);
  __m256d t = _mm256_add_pd(enter, _mm256_mul_pd(_mm256_set1_pd(0.5), _mm256_cvtps_pd(length)));
  _mm_storeu_ps(along, _mm256_cvtpd_ps(t));
  __m128 row[4] = {place_inside(ray, 0, at[0], t), place_inside(ray, 1, at[1], t), place_inside(ray, 2, at[2], t),
                   _mm_setzero_ps()};
  _MM_TRANSPOSE4_PS(row[0], row[1], row[2], row[3]);
  for (int i = 0; i < 4; i++) _mm_storeu_ps(inside[i], row[i]);
}

// ---- values

OP __m256 two_corners(const float *values, uint32_t low, uint32_t high) {
  __m256 pair = _mm256_castps128_ps256(_mm_loadu_ps(values + 4 * (size_t)low));
  return _mm256_insertf128_ps(pair, _mm_loadu_ps(values + 4 * (size_t)high), 1);
}

OP __m256 mix_two(__m256 a, __m256 b, __m256 share) {
  return _mm256_add_ps(a, _mm256_mul_ps(_mm256_sub_ps(b, a), share));
}

OP void interpolate(const vt_level *cells, uint32_t cell, const float inside[4], float value[4]) {
  const uint32_t *corner = cells->corner_of + 8 * (size_t)cell;
  const float *values = cells->corner_values;
  __m256 x = _mm256_broadcast_ss(inside), z = _mm256_broadcast_ss(inside + 2); // low half: y = 0; high half: y = 1
  __m256 near = mix_two(two_corners(values, corner[0], corner[2]), two_corners(values, corner[1], corner[3]), x);
  __m256 far = mix_two(two_corners(values, corner[4], corner[6]), two_corners(values, corner[5], corner[7]), x);
  __m256 both = mix_two(near, far, z);
  __m128 low = _mm256_castps256_ps128(both), high = _mm256_extractf128_ps(both, 1);
  __m128 share = _mm_broadcast_ss(inside + 1);
  _mm_storeu_ps(value, _mm_add_ps(low, _mm_mul_ps(_mm_sub_ps(high, low), share)));
}

#define AHEAD 6 // chords, as far ahead as memory takes to answer

OP void prefetch_corners(const vt_level *cells, uint32_t cell) {
  const uint32_t *corner = cells->corner_of + 8 * (size_t)cell;
  for (int i = 0; i < 8; i++) _mm_prefetch((const char *)(cells->corner_values + 4 * (size_t)corner[i]), _MM_HINT_T0);
}

OP void find_middles(const vt_level *cells, const vt_field_ray *ray, const vt_chord *chords, size_t count,
                     vt_field_samples *out) {
  size_t k = 0;
  for (; k + 4 <= count; k += 4) middles_of_four(cells, ray, chords + k, out->along + k, out->inside + k);
  if (k == count) return;
  vt_chord rest[4];
  float along[4], inside[4][4];
  for (size_t i = 0; i < 4; i++) rest[i] = chords[k + i < count ? k + i : count - 1];
  middles_of_four(cells, ray, rest, along, inside);
  memcpy(out->along + k, along, (count - k) * sizeof *along);
  memcpy(out->inside + k, inside, (count - k) * sizeof *inside);
}

TARGET void vt_sample_field_avx2(const vt_level *cells, const vt_field_ray *ray, const vt_chord *chords, size_t count,
                                 vt_field_samples *out) {
  if (cells->corner_count)
    for (size_t k = 0; k < count; k++) _mm_prefetch((const char *)(cells->corner_of + 8 * (size_t)chords[k].cell), _MM_HINT_T0);
  find_middles(cells, ray, chords, count, out);
  if (cells->corner_count)
    for (size_t k = 0; k < count; k++) {
      if (k + AHEAD < count) prefetch_corners(cells, chords[k + AHEAD].cell);
      interpolate(cells, chords[k].cell, out->inside[k], out->value[k]);
    }
  else
    for (size_t k = 0; k < count; k++) {
      size_t cell = chords[k].cell;
      const float *colour = cells->colour + 3 * cell;
      _mm_storeu_ps(out->value[k], _mm_setr_ps(cells->optical_depth[cell], colour[0], colour[1], colour[2]));
    }
}

// ---- ratios

// Two neighbouring bytes of each lane, from byte number `at` on: four are read, and never one behind the last of all.
OP void gather_pairs(const uint8_t *codes, __m256i at, __m256i last, __m256 *left, __m256 *right) {
  const __m256i byte = _mm256_set1_epi32(255);
  __m256i first = _mm256_min_epi32(at, last);
  __m256i four = _mm256_i32gather_epi32((const int *)(const void *)codes, first, 1);
  four = _mm256_srlv_epi32(four, _mm256_slli_epi32(_mm256_sub_epi32(at, first), 3));
  *left = _mm256_cvtepi32_ps(_mm256_and_si256(four, byte));
  *right = _mm256_cvtepi32_ps(_mm256_and_si256(_mm256_srli_epi32(four, 8), byte));
}

// Where the last pixel of a row or column is asked for, the one before it is taken with a share of 1 for the last: as exact.
OP __m256 codes_at(const vt_field_sight *s, __m256 x, __m256 y) {
  const __m256i columns = _mm256_set1_epi32(s->columns), zero = _mm256_setzero_si256();
  const __m256i last_pair = _mm256_set1_epi32(s->columns > 1 ? s->columns - 2 : 0);
  const __m256i last_row = _mm256_set1_epi32(s->rows > 1 ? s->rows - 2 : 0);
  const __m256i last = _mm256_set1_epi32(s->columns * s->rows - 4);
  x = _mm256_min_ps(_mm256_max_ps(x, _mm256_setzero_ps()), _mm256_set1_ps(s->right));
  y = _mm256_min_ps(_mm256_max_ps(y, _mm256_setzero_ps()), _mm256_set1_ps(s->bottom));
  __m256i column = _mm256_min_epi32(_mm256_cvttps_epi32(x), last_pair);
  __m256i row = _mm256_min_epi32(_mm256_cvttps_epi32(y), last_row);
  __m256 u = _mm256_sub_ps(x, _mm256_cvtepi32_ps(column)), v = _mm256_sub_ps(y, _mm256_cvtepi32_ps(row));
  __m256i at = _mm256_add_epi32(_mm256_mullo_epi32(row, columns), column);
  __m256 left, right, low_left, low_right;
  gather_pairs(s->codes, at, last, &left, &right);
  gather_pairs(s->codes, _mm256_add_epi32(at, s->rows > 1 ? columns : zero), last, &low_left, &low_right);
  __m256 above = mix_two(left, right, u), under = mix_two(low_left, low_right, u);
  return mix_two(above, under, v);
}

OP __m256 ratios_of_eight(const vt_field_sight *sights, int sight_count, __m256 t) {
  const __m256 zero = _mm256_setzero_ps(), nearest = _mm256_set1_ps(VT_NEAREST_DEPTH);
  __m256 sum = zero, weights = zero;
  for (int v = 0; v < sight_count; v++) {
    const vt_field_sight *s = &sights[v];
    __m256 h[3];
    for (int i = 0; i < 3; i++)
      h[i] = _mm256_add_ps(_mm256_set1_ps(s->a[i]), _mm256_mul_ps(t, _mm256_set1_ps(s->b[i])));
    __m256 inverse = _mm256_div_ps(_mm256_set1_ps(1), _mm256_max_ps(h[2], nearest));
    __m256 x = _mm256_mul_ps(h[0], inverse), y = _mm256_mul_ps(h[1], inverse);
    __m256 low = _mm256_and_ps(_mm256_cmp_ps(x, zero, _CMP_GE_OQ), _mm256_cmp_ps(y, zero, _CMP_GE_OQ));
    __m256 high = _mm256_and_ps(_mm256_cmp_ps(x, _mm256_set1_ps(s->width), _CMP_LE_OQ),
                                _mm256_cmp_ps(y, _mm256_set1_ps(s->height), _CMP_LE_OQ));
    __m256 seen = _mm256_and_ps(_mm256_and_ps(low, high), _mm256_cmp_ps(h[2], nearest, _CMP_GT_OQ));
    __m256 weight = _mm256_and_ps(seen, _mm256_set1_ps(s->weight));
    __m256 codes = codes_at(s, _mm256_sub_ps(x, _mm256_set1_ps(s->left)), _mm256_sub_ps(y, _mm256_set1_ps(s->top)));
    weights = _mm256_add_ps(weights, weight);
    sum = _mm256_add_ps(sum, _mm256_mul_ps(weight, codes));
  }
  __m256 scaled = _mm256_mul_ps(_mm256_set1_ps(VT_LOG_RATIO_STEP), _mm256_div_ps(sum, weights));
  __m256 any = _mm256_cmp_ps(weights, zero, _CMP_GT_OQ);
  return _mm256_and_ps(any, _mm256_add_ps(_mm256_set1_ps(VT_LEAST_LOG_RATIO), scaled));
}

TARGET void vt_sample_ratios_avx2(const vt_field_sight *sights, int sight_count, const float *along, size_t count,
                                  float *log_ratio) {
  for (int v = 0; v < sight_count; v++)
    if (sights[v].columns * sights[v].rows < 4 || sights[v].linear) { // no four bytes to read; thin trees are small
      vt_sample_ratios_plain(sights, sight_count, along, count, log_ratio);
      return;
    }
  size_t k = 0;
  for (; k + 8 <= count; k += 8)
    _mm256_storeu_ps(log_ratio + k, ratios_of_eight(sights, sight_count, _mm256_loadu_ps(along + k)));
  if (k == count) return;
  float rest[8] = {0};
  memcpy(rest, along + k, (count - k) * sizeof *rest);
  _mm256_storeu_ps(rest, ratios_of_eight(sights, sight_count, _mm256_loadu_ps(rest)));
  memcpy(log_ratio + k, rest, (count - k) * sizeof *rest);
}
#else // another processor or compiler: never chosen

void vt_sample_field_avx2(const vt_level *cells, const vt_field_ray *ray, const vt_chord *chords, size_t count,
                          vt_field_samples *out) {
  vt_sample_field_plain(cells, ray, chords, count, out);
}

void vt_sample_ratios_avx2(const vt_field_sight *sights, int sight_count, const float *along, size_t count,
                           float *log_ratio) {
  vt_sample_ratios_plain(sights, sight_count, along, count, log_ratio);
}
#endif
