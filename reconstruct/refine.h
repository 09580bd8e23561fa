// refine.h - opacity and colour improved together through the compositor
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_REFINE_H
#define VT_RECONSTRUCT_REFINE_H

#include "octree/octree.h"
#include "reconstruct/sweep.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_refine_desc {
  uint32_t cookie;
  int epochs;             // sweeps over all photographs, >= 0
  int batch_count;        // steps per epoch, about; at least one photograph a step
  float opacity_step;     // of Adam, in optical depth per edge, first epoch
  float colour_step;      // of Adam, in sRGB 0..1, first epoch
  float last_step_share;  // both steps fall to this share until the end
  float largest;          // bound of the optical depth across a cell's edge
  double deadline;        // vt_seconds() after which no further epoch begins; 0: none
} vt_refine_desc;
vt_refine_desc vt_default_refine_desc(void);

// Improves optical depth and colour of the level that the rays were collected on. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_refine(vt_context *, const vt_refine_desc *, const vt_rays *, vt_level *cells);

// The gradient of one ray's loss by finite-difference-checked formulas; for tests and for vt_refine.
// gradient: [chord_count][4], by optical depth and by colour RGB. Returns the loss.
float vt_ray_gradient(const float *optical_depth, const float *colour, const vt_chord *, size_t chord_count,
                      const float premultiplied_rgba[4], float (*gradient)[4]);

#ifdef __cplusplus
}
#endif
#endif
