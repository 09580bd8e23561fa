// fit.h - the field of a level, opacity and colour together, improved through the compositor
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_FIT_H
#define VT_RECONSTRUCT_FIT_H

#include "octree/octree.h"
#include "reconstruct/sweep.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_fit_desc {
  uint32_t cookie;
  int epochs;            // sweeps over all photographs, >= 0
  int batch_count;       // steps per epoch, about; at least one photograph a step
  float opacity_step;    // of Adam, in optical depth per edge, first epoch
  float opacity_share;   // but no more than this share of a usual corner's depth
  float colour_step;     // of Adam, in sRGB 0..1, first epoch
  float last_step_share; // both steps fall to this share until the end
  float largest;         // bound of the optical depth across a cell's edge
  float ratio_limit;     // largest factor by which a matte may thicken the cells on its ray, >= 1
  bool linear_ratios;    // R, not ln R, is interpolated between the textures' pixels
  int neighbours;        // 0: each photograph is fitted by the bare field; else predicted from the view textures of so many
                         // others, 1..VT_MAX_BLEND_VIEWS - 1 (leave-one-out)
  float own_share;       // of the photograph's own texture in that prediction, < 1, negative: taken off
  const int *left_out;   // [photographs] the view that a photograph's prediction does without; NULL: each without itself
  int parts;             // a photograph's pixels are taken in so many steps, >= 1
  double begun, deadline; // vt_seconds() between which the steps fall; no further epoch begins after the deadline; 0: by epochs
} vt_fit_desc;
vt_fit_desc vt_default_fit_desc(void);

// Improves the corner values of the level that the rays were collected on (it must have corners). tree->cameras are the
// full-size cameras of the same views. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_fit_field(vt_context *, const vt_fit_desc *, const vt_rays *, const vt_tree *, vt_level *cells);

// What a ray's cells are and how they should change: for each chord depth[k] (optical depth of the chord itself) and colour
// value[k][1..3]. gradient: [count][4], of the loss by depth and by colour RGB. Returns the loss.
float vt_ray_gradient(const float *depth, float (*value)[4], size_t count, const float premultiplied_rgba[4],
                      float (*gradient)[4]);

// The same for one ray of a field: adds to sums [corner_count][4] the gradient of the loss by the corners' values, the
// ratios of the views' textures held still, and sets touched[corner / VT_FIT_BLOCK]. view_count 0: the bare field.
#define VT_FIT_BLOCK 32 // corners whose numbers follow each other lie together
typedef struct vt_fit_scratch { // each of `count` entries at least
  vt_field_samples samples;
  float *depth, (*gradient)[4];
} vt_fit_scratch;
float vt_field_gradient(const vt_octree *, int level, const vt_ray *, const vt_chord *, size_t count, const vt_field_view *views,
                        int view_count, const float premultiplied_rgba[4], vt_fit_scratch *, float *sums,
                        uint8_t *touched);

#ifdef __cplusplus
}
#endif
#endif
