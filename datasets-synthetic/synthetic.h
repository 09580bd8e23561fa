// synthetic.h - procedural trees and phantoms, photographed with exact cameras and mattes
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_SYNTHETIC_H
#define VT_DATASETS_SYNTHETIC_SYNTHETIC_H

#include "base/views.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_synthetic_kind {
  VT_SYNTHETIC_TREE,  // grown from a seed: trunk, branches, cut-out leaves; sun, sky, shadows
  VT_SYNTHETIC_BALL,  // phantom: uniform extinction in a ball
  VT_SYNTHETIC_SHELL, // phantom: a hollow ball
  VT_SYNTHETIC_BLOBS  // phantom: Gaussian blobs of extinction
} vt_synthetic_kind;

typedef struct vt_synthetic_desc {
  uint32_t cookie;
  vt_synthetic_kind kind;
  uint32_t seed;
  int train_count; // views on a golden spiral over the upper hemisphere, 1..1000
  int test_count;  // views between them, role VT_TEST, 0..1000
  int width, height; // pixels, 1..8192
  int supersample;   // samples per pixel edge for exact alpha, 1..8
  int leaf_count;    // tree only, 0 (bare)..1000000; fewer leaves are larger
  double fov_y;      // radians, 0.01..2.5
  double peak_extinction; // phantoms: per unit length, > 0, <= 1e6; the object has radius about 1
} vt_synthetic_desc;
vt_synthetic_desc vt_default_synthetic_desc(void);

// Grows the object and photographs it. Names are "train/r_0.png", ...; world z is up, the object about 2 units high
// around the origin. Same desc, same bits, for any number of threads. Caller frees `out`. VT_BAD_INPUT where a field is
// out of range, VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_make_synthetic_views(vt_context *, const vt_synthetic_desc *, vt_views *out);

// Truth of the phantoms in closed form: optical depth along a ray from `near` to `far` (world distances along it), and
// extinction at a point (per world unit). Not for VT_SYNTHETIC_TREE (asserted).
double vt_true_optical_depth(const vt_synthetic_desc *, const vt_ray *, double near, double far);
double vt_true_extinction(const vt_synthetic_desc *, vt_vec3 point);

#ifdef __cplusplus
}
#endif
#endif
