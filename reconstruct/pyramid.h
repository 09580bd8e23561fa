// pyramid.h - the photographs at the resolution of a level
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_PYRAMID_H
#define VT_RECONSTRUCT_PYRAMID_H

#include "base/views.h"

#ifdef __cplusplus
extern "C" {
#endif

// Views whose pictures are reduced by one whole factor; cameras fit the reduced pictures. factor 1 borrows the pictures.
typedef struct vt_reduced_views {
  int count, factor;
  vt_camera *cameras; // [count]; owned
  vt_image *pictures; // [count] straight RGBA; owned unless factor is 1
  vt_image *ignored;  // [count] see vt_view: a pixel is, if any of those it stands for is; owned likewise
} vt_reduced_views;

vt_status vt_reduce_views(vt_context *, const vt_views *, int factor, vt_reduced_views *out);
void vt_free_reduced_views(vt_context *, vt_reduced_views *);

// Pixels (of the photographs as they are) that an edge of length `edge` at `point` covers: median over the views that
// have the point in front of them; 0 if there are none.
vt_status vt_projected_size(vt_context *, const vt_views *, vt_vec3 point, double edge, double *pixels);

#ifdef __cplusplus
}
#endif
#endif
