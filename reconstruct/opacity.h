// opacity.h - extinction of the cells of one level from mattes
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_OPACITY_H
#define VT_RECONSTRUCT_OPACITY_H

#include "octree/octree.h"
#include "reconstruct/sweep.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_opacity_domain {
  VT_LOG_DOMAIN,          // SART on b = -ln(1 - a) [RMMD04; Andersen & Kak 1984]
  VT_TRANSMITTANCE_DOMAIN // least squares of exp(-tau) - (1 - a), reweighted (METHODS 2.1, 9)
} vt_opacity_domain;

typedef struct vt_opacity_desc {
  uint32_t cookie;
  vt_opacity_domain domain;
  int iterations;    // sweeps over all photographs, >= 0
  int subset_count;  // ordered subsets of photographs per sweep, >= 1
  float relaxation;  // 0..1
  float largest;     // bound of the optical depth across a cell's edge
} vt_opacity_desc;
vt_opacity_desc vt_default_opacity_desc(void);

typedef struct vt_opacity_report {
  uint64_t rays;          // that meet cells, per sweep
  double saturated_share; // of these, alpha > 0.99
  double alpha_rmse;      // over these, before the last update of each subset
} vt_opacity_report;

// Improves cells->optical_depth (the level that the rays were collected on), starting from what stands there. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_estimate_opacity(vt_context *, const vt_opacity_desc *, const vt_rays *, vt_level *cells,
                              vt_opacity_report *or_null);

#ifdef __cplusplus
}
#endif
#endif
