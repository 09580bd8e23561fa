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
  VT_LOG_DOMAIN,          // least squares of tau + ln(1 - a) [RMMD04; Andersen & Kak 1984]
  VT_TRANSMITTANCE_DOMAIN // least squares of exp(-tau) - (1 - a) (METHODS 2.1)
} vt_opacity_domain;

typedef enum vt_opacity_step {
  VT_STEP_MAJORISER, // gradient over the diagonal of a majoriser, after each subset (SART; in the transmittance domain reweighted)
  VT_STEP_NESTEROV,  // the same with momentum and restart, over all rays at once [Nesterov 1983; O'Donoghue & Candes 2015]
  VT_STEP_ADAM       // gradient over its own running size, after each subset [Kingma & Ba 2015]
} vt_opacity_step;

typedef struct vt_opacity_desc {
  uint32_t cookie;
  vt_opacity_domain domain;
  vt_opacity_step step;
  int iterations;          // sweeps over all photographs at most, >= 0
  int least_updates;       // more sweeps where few photographs make few subsets: so many changes of s at least
  int subset_count;        // ordered subsets of photographs per sweep, >= 1; Nesterov takes all at once
  float relaxation;        // of the majoriser's steps, 0..1
  float learning_rate;     // Adam: first step, as a share of the depth that a usual cell has at the start
  float last_rate;         // the share of it that is left at the end
  float largest;           // bound of the optical depth across a cell's edge
  float total_variation;   // weight of the Huber total variation over the faces between cells, >= 0; 0: none
  float variation_width;   // differences of s below this are smoothed by squares instead, > 0
  bool weigh_views;        // by the solid angle that each photograph has for itself
  float held_out_share;    // of the pixels, in blocks of 8x8, that only judge, 0..0.5
  float stop_gain;         // stop when a sweep lowers the held-out error by less than this share; negative: never
  const vt_image *confidence; // [views] one channel, of the reduced pictures' sizes: 0 says nothing, 255 is trusted; or NULL
} vt_opacity_desc;
vt_opacity_desc vt_default_opacity_desc(void); // transmittance domain, Adam
vt_opacity_desc vt_sart_opacity_desc(void);    // log domain, as the papers: three sweeps of twelve subsets, no more

typedef struct vt_opacity_report {
  uint64_t rays;          // that meet cells, per sweep
  double saturated_share; // of these, alpha > 0.99
  double alpha_rmse;      // over those fitted, in the last sweep, each before its own change
  double held_out_rmse;   // over those held out, in the last sweep; NAN without any
  int iterations;         // sweeps done
} vt_opacity_report;

// Improves cells->optical_depth from what it holds. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_estimate_opacity(vt_context *, const vt_opacity_desc *, const vt_rays *, vt_level *cells,
                              vt_opacity_report *or_null);

// 1/2 sum_r w_r (exp(-tau_r) - t_r)^2 + the regulariser, over all rays: what the transmittance domain minimises.
vt_status vt_opacity_objective(vt_context *, const vt_opacity_desc *, const vt_rays *, const vt_level *cells,
                               double *objective);

#ifdef __cplusplus
}
#endif
#endif
