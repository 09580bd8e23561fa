// soft_volume.h - a coarse volume whose silhouettes have derivatives
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_SOFT_VOLUME_H
#define VT_RECONSTRUCT_SOFT_VOLUME_H

#include "base/views.h"
#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

// Optical depth per cell edge at the corners of a cubic grid, trilinear between them, 0 around it.
typedef struct vt_soft_volume {
  int cells;       // corners along an edge, with a rim of zeros
  vt_vec3 origin;  // world, the place of depth[0]
  double edge;     // world, of a cell
  float *depth;    // [cells][cells][cells], x fastest; owned
  int blocks;      // along an edge
  uint8_t *filled; // [blocks][blocks][blocks] whether a block of VT_SOFT_BLOCK^3 cells has anything in it; owned
} vt_soft_volume;
#define VT_SOFT_BLOCK 4

typedef struct vt_soft_volume_desc {
  int level;     // of the octree, at most 8
  float densest; // depths are cut to this: behind it nothing shows
  int votes;     // views that must see a cell empty, 1..
} vt_soft_volume_desc;

// Opacity alone of the views, within a cube that is given, its corners fitted. All views are taken, whatever their role.
// VT_BAD_INPUT where nothing stands, VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_make_soft_volume(vt_context *, const vt_views *, vt_vec3 origin, double edge, const vt_soft_volume_desc *,
                              vt_soft_volume *out);
void vt_free_soft_volume(vt_context *, vt_soft_volume *);

// What a ray meets: its optical depth, and the integrals of the depth's gradient g (world axes, by world length) along it
// that derivatives are made of: sum[0..2] of g, sum[3..5] of t g, t the world distance from the ray's origin. NULL: not wanted.
double vt_trace_soft_ray(const vt_soft_volume *, const vt_ray *, double sum_or_null[6]);

// alpha [height][width] of a camera's picture.
vt_status vt_draw_soft_volume(vt_context *, const vt_soft_volume *, const vt_camera *, float *alpha);

#ifdef __cplusplus
}
#endif
#endif
