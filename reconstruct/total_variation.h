// total_variation.h - Huber total variation over the faces between the cells of a level
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_TOTAL_VARIATION_H
#define VT_RECONSTRUCT_TOTAL_VARIATION_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_variation {
  size_t cells;
  uint32_t (*neighbours)[6]; // [cells] across the faces, or VT_NO_CELL; owned
  float weight, width;       // lambda, delta
} vt_variation;

vt_status vt_begin_variation(vt_context *, const vt_level *, int branching, float weight, float width, vt_variation *out);
void vt_end_variation(vt_context *, vt_variation *);

// Adds to total[i * stride], and where stride is 2 to total[i * stride + 1], minus the gradient at s, and the diagonal of a
// majoriser, of `share` times lambda sum over faces of sqrt((s_i - s_j)^2 + delta^2) - delta.
vt_status vt_pull_by_variation(vt_context *, const vt_variation *, const float *s, float share, int stride, float *total);
double vt_variation_of(const vt_variation *, const float *s); // that sum itself

#ifdef __cplusplus
}
#endif
#endif
