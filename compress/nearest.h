// nearest.h - the nearest codeword of many vectors
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_COMPRESS_NEAREST_H
#define VT_COMPRESS_NEAREST_H

#include "base/context.h"

// Which instructions the inner loop uses. All give the same bits.
typedef enum vt_nearest_path { VT_PATH_PLAIN, VT_PATH_VECTOR, VT_PATH_AVX2, VT_PATH_AVX512 } vt_nearest_path;
vt_nearest_path vt_best_nearest_path(void); // the fastest that this machine has; those below it exist too

enum { VT_NEAREST_ROWS = 8, VT_NEAREST_LANES = 32, VT_NEAREST_CHUNK = 512 };

// A codebook laid out for the search.
typedef struct vt_nearest {
  vt_nearest_path path;
  int dimension, codeword_count;
  const float *codewords; // [codeword_count][dimension]; not owned
  float *mean;            // [dimension] of the codewords; owned
  float *packed;          // [groups of VT_NEAREST_LANES codewords][dimension][VT_NEAREST_LANES], less the mean; owned
  float *half_norm;       // [groups * VT_NEAREST_LANES] half the squared norm of a packed codeword; padding +inf; owned
  double longest;         // largest norm of a packed codeword
} vt_nearest;

// Room for codewords of that number and dimension; then vt_pack_nearest as often as they change.
vt_status vt_make_nearest(vt_context *, int dimension, int codeword_count, vt_nearest *out);
void vt_pack_nearest(vt_nearest *, const float *codewords);
void vt_free_nearest(vt_context *, vt_nearest *);

// code[i] and squared distance[i] (may be NULL) of vectors[row[i]] (row NULL: vectors[i]), i < count: the minimum of
// the sum of squared differences in double, ties to the lower index. Vectors must be finite.
void vt_find_nearest(const vt_nearest *, const float *vectors, const uint32_t *row, size_t count, uint16_t *code,
                     double *distance);
// Squared distance in double, always summed in the same order.
double vt_squared_distance(int dimension, const float *a, const float *b);

// The inner loop: scores[r][j] = half_norm[j] - x[.][r] . packed[j] for the VT_NEAREST_ROWS vectors x[dimension][rows],
// and their minimum per row. `groups` at most VT_NEAREST_CHUNK / VT_NEAREST_LANES.
typedef float vt_nearest_scores[VT_NEAREST_ROWS][VT_NEAREST_CHUNK];
void vt_score_codewords(vt_nearest_path, int dimension, int groups, const float *x, const float *packed,
                        const float *half_norm, vt_nearest_scores scores, float lowest[VT_NEAREST_ROWS]);

#endif
