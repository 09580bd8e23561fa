// nearest_kernel.c - scores of eight vectors against a chunk of a codebook: the inner loop of the quantiser
// SPDX-License-Identifier: BSD-3-Clause
//
// Lanes are codewords, and every lane adds its products dimension by dimension, in float, never fused (the build says
// -ffp-contract=off): so the width of the registers and the blocking change the speed and not one bit of the result. A
// panel of rows x vectors is kept in registers; it is chosen so that its sums just fit the 16 or 32 registers.
// The plain path is the reference in tests, and what a compiler without vector types gets.

#include "compress/nearest.h"
#include <math.h>

enum { ROWS = VT_NEAREST_ROWS, LANES = VT_NEAREST_LANES };

#if defined(__GNUC__)
#define ALWAYS_INLINE static inline __attribute__((always_inline))
#else
#define ALWAYS_INLINE static inline
#endif

// The lowest score of each row, by sixteen running minima: no order of comparison changes a minimum.
ALWAYS_INLINE void find_lowest(int count, vt_nearest_scores scores, float lowest[ROWS]) {
  for (int r = 0; r < ROWS; r++) {
    float lane[16];
    for (int l = 0; l < 16; l++) lane[l] = scores[r][l];
    for (int j = 16; j < count; j += 16)
      for (int l = 0; l < 16; l++) lane[l] = scores[r][j + l] < lane[l] ? scores[r][j + l] : lane[l];
    lowest[r] = lane[0];
    for (int l = 1; l < 16; l++) lowest[r] = lane[l] < lowest[r] ? lane[l] : lowest[r];
  }
}

static void score_plain(int dimension, int groups, const float *x, const float *packed, const float *half_norm,
                        vt_nearest_scores scores, float lowest[ROWS]) {
  for (int g = 0; g < groups; g++, packed += dimension * LANES)
    for (int r = 0; r < ROWS; r++) {
      float *sum = scores[r] + g * LANES;
      for (int l = 0; l < LANES; l++) sum[l] = half_norm[g * LANES + l];
      for (int d = 0; d < dimension; d++)
        for (int l = 0; l < LANES; l++) sum[l] -= x[d * ROWS + r] * packed[d * LANES + l];
    }
  find_lowest(groups * LANES, scores, lowest);
}

#if defined(__GNUC__)
#if defined(__clang__)
#define UNROLL _Pragma("unroll")
#else
#define UNROLL _Pragma("GCC unroll 8")
#endif

// One instance of the loop: registers of WIDTH floats, PANEL rows by two registers at a time.
#define SCORE_FUNCTION(NAME, TARGET, WIDTH, PANEL)                                                                     \
  typedef float NAME##_vector __attribute__((vector_size(4 * (WIDTH)), aligned(4 * (WIDTH)), may_alias));              \
  TARGET static void NAME(int dimension, int groups, const float *x, const float *packed, const float *half_norm,      \
                          vt_nearest_scores scores, float lowest[ROWS]) {                                              \
    for (int g = 0; g < groups; g++)                                                                                   \
      for (int l = 0; l < LANES; l += 2 * (WIDTH))                                                                     \
        for (int first = 0; first < ROWS; first += (PANEL)) {                                                          \
          const float *c = packed + (size_t)g * (size_t)dimension * LANES + l, *xd = x + first;                        \
          const float *h = half_norm + g * LANES + l;                                                                  \
          NAME##_vector sum[PANEL][2];                                                                                 \
          UNROLL for (int r = 0; r < (PANEL); r++) {                                                                   \
            sum[r][0] = *(const NAME##_vector *)h;                                                                     \
            sum[r][1] = *(const NAME##_vector *)(h + (WIDTH));                                                         \
          }                                                                                                            \
          for (int d = 0; d < dimension; d++, c += LANES, xd += ROWS) {                                                \
            NAME##_vector c0 = *(const NAME##_vector *)c, c1 = *(const NAME##_vector *)(c + (WIDTH));                  \
            UNROLL for (int r = 0; r < (PANEL); r++) {                                                                 \
              sum[r][0] -= c0 * xd[r];                                                                                 \
              sum[r][1] -= c1 * xd[r];                                                                                 \
            }                                                                                                          \
          }                                                                                                            \
          UNROLL for (int r = 0; r < (PANEL); r++) {                                                                   \
            *(NAME##_vector *)(scores[first + r] + g * LANES + l) = sum[r][0];                                         \
            *(NAME##_vector *)(scores[first + r] + g * LANES + l + (WIDTH)) = sum[r][1];                               \
          }                                                                                                            \
        }                                                                                                              \
    find_lowest(groups *LANES, scores, lowest);                                                                        \
  }

SCORE_FUNCTION(score_vector, , 4, 4)
#if defined(__x86_64__)
SCORE_FUNCTION(score_avx2, __attribute__((target("avx2"))), 8, 4)
SCORE_FUNCTION(score_avx512, __attribute__((target("avx512f"))), 16, 8)
#endif
#endif

vt_nearest_path vt_best_nearest_path(void) {
#if defined(__GNUC__) && defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return VT_PATH_AVX512;
  if (__builtin_cpu_supports("avx2")) return VT_PATH_AVX2;
#endif
#if defined(__GNUC__)
  return VT_PATH_VECTOR;
#else
  return VT_PATH_PLAIN;
#endif
}

void vt_score_codewords(vt_nearest_path path, int dimension, int groups, const float *x, const float *packed,
                        const float *half_norm, vt_nearest_scores scores, float lowest[ROWS]) {
  switch (path) {
#if defined(__GNUC__)
#if defined(__x86_64__)
  case VT_PATH_AVX512:
    score_avx512(dimension, groups, x, packed, half_norm, scores, lowest);
    return;
  case VT_PATH_AVX2:
    score_avx2(dimension, groups, x, packed, half_norm, scores, lowest);
    return;
#endif
  case VT_PATH_VECTOR:
    score_vector(dimension, groups, x, packed, half_norm, scores, lowest);
    return;
#endif
  default:
    score_plain(dimension, groups, x, packed, half_norm, scores, lowest);
    return;
  }
}
