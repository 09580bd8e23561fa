// gla.h - what the parts of the codebook training hand each other
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_COMPRESS_GLA_H
#define VT_COMPRESS_GLA_H

#include "compress/compress.h"

// The distinct vectors of a training set, and how much each of them counts.
typedef struct vt_training_set {
  int dimension;
  const float *vectors; // the caller's; not owned
  uint32_t count;
  uint32_t *row;  // [count] rows of `vectors`, rising; owned
  double *weight; // [count] > 0, sum over equal vectors; owned
} vt_training_set;

// VT_BAD_INPUT for a NaN or infinity, a negative weight, or weights that are all zero.
vt_status vt_make_training_set(vt_context *, int dimension, const float *vectors, const float *weight, size_t count,
                               vt_training_set *out);
void vt_free_training_set(vt_context *, vt_training_set *);

// k-means++: writes codewords[codeword_count][dimension]; codeword_count < set->count (asserted).
vt_status vt_seed_codewords(vt_context *, const vt_training_set *set, int codeword_count, uint64_t seed,
                            float *codewords);

#endif
