// coverage.h - how well the photographs determine each cell
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_COVERAGE_H
#define VT_RECONSTRUCT_COVERAGE_H

#include "octree/octree.h"
#include "reconstruct/sweep.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_coverage {
  uint32_t unconstrained; // cells that no ray says anything about
  double median_degrees;  // of the others: widest angle between two lines of sight that say something, 0..90
  double narrow_share;    // of the others: those below 30 degrees, where opacity smears along the lines of sight
} vt_coverage;

// A ray says something about its cells if its matte or its cells let at least a hundredth through; one that is opaque twice
// over says nothing about any one of them. degrees_or_null [cell_count]: -1 where unconstrained. VT_OUT_OF_MEMORY.
vt_status vt_measure_coverage(vt_context *, const vt_rays *, const vt_level *cells, float *degrees_or_null, vt_coverage *out);

#ifdef __cplusplus
}
#endif
#endif
