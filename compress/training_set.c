// training_set.c - the distinct vectors of a training set, checked
// SPDX-License-Identifier: BSD-3-Clause
//
// Flat leaves and empty corners make many tiles the same. Equal vectors are merged into one that weighs as much as all
// of them: the codebook is the same, training is faster, and a codebook larger than the data is seen before it starts.

#include "compress/gla.h"
#include <math.h>
#include <string.h>

static uint64_t hash_vector(int dimension, const float *vector) {
  uint64_t hash = 0x9e3779b97f4a7c15u;
  for (int d = 0; d < dimension; d++) {
    float v = vector[d] + 0.0f; // -0 and 0 are equal
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    hash = (hash ^ bits) * 0xff51afd7ed558ccdu;
    hash ^= hash >> 32;
  }
  return hash;
}

static bool are_equal(int dimension, const float *a, const float *b) {
  for (int d = 0; d < dimension; d++)
    if (!(a[d] == b[d])) return false;
  return true;
}

static vt_status check_vectors(vt_context *ctx, int dimension, const float *vectors, const float *weight,
                               size_t count) {
  double sum = 0;
  for (size_t i = 0; i < count; i++) {
    for (int d = 0; d < dimension; d++)
      if (!isfinite(vectors[i * (size_t)dimension + (size_t)d]))
        return vt_fail(ctx, VT_BAD_INPUT,
                       "codebook: value %d of training vector %zu is not a finite number; check what "
                       "made it",
                       d, i);
    double w = weight ? (double)weight[i] : 1;
    if (!isfinite(w) || w < 0)
      return vt_fail(ctx, VT_BAD_INPUT,
                     "codebook: the weight of training vector %zu is %g; it must be a finite number "
                     "from 0 on",
                     i, w);
    sum += w;
  }
  if (count && !(sum > 0))
    return vt_fail(ctx, VT_BAD_INPUT, "codebook: no training vector has a weight; give at least one a weight above 0");
  return VT_OK;
}

vt_status vt_make_training_set(vt_context *ctx, int dimension, const float *vectors, const float *weight, size_t count,
                               vt_training_set *out) {
  *out = (vt_training_set){.dimension = dimension, .vectors = vectors};
  VT_ASSERT(count < UINT32_MAX / 4);
  vt_status status = check_vectors(ctx, dimension, vectors, weight, count);
  if (status) return status;
  size_t slots = 16;
  while (slots < 2 * count) slots *= 2;
  uint32_t *table = VT_NEW(ctx, uint32_t, slots); // number in the set plus 1; 0: free
  out->row = VT_NEW(ctx, uint32_t, count);
  out->weight = VT_NEW(ctx, double, count);
  if (!table || !out->row || !out->weight) {
    vt_free(ctx, table);
    vt_free_training_set(ctx, out);
    return VT_OUT_OF_MEMORY;
  }
  for (size_t i = 0; i < count; i++) {
    double w = weight ? (double)weight[i] : 1;
    if (!(w > 0)) continue;
    const float *vector = vectors + i * (size_t)dimension;
    size_t slot = hash_vector(dimension, vector) & (slots - 1);
    while (table[slot] &&
           !are_equal(dimension, vector, vectors + (size_t)out->row[table[slot] - 1] * (size_t)dimension))
      slot = (slot + 1) & (slots - 1);
    if (!table[slot]) {
      out->row[out->count] = (uint32_t)i;
      table[slot] = ++out->count;
    }
    out->weight[table[slot] - 1] += w;
  }
  vt_free(ctx, table);
  return VT_OK;
}

void vt_free_training_set(vt_context *ctx, vt_training_set *set) {
  vt_free(ctx, set->row);
  vt_free(ctx, set->weight);
  *set = (vt_training_set){0};
}
