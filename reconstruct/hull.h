// hull.h - which cells the mattes leave standing
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_HULL_H
#define VT_RECONSTRUCT_HULL_H

#include "octree/octree.h"
#include "reconstruct/pyramid.h"

#ifdef __cplusplus
extern "C" {
#endif

// Where a matte is not empty, summed up for rectangles. One per view, at a resolution where a cell covers a few pixels.
typedef struct vt_silhouettes {
  int count, factor;
  vt_camera *cameras;  // of the reduced pictures; owned
  uint32_t **sums;     // [count] -> [(height+1)*(width+1)] summed-area table of "alpha > threshold"; owned
  int votes;           // so many views must see a cell empty before it is carved
  int least_seen;      // a cell that fewer views have within their frame is unknown and dropped
} vt_silhouettes;

// factor >= 1: pixels are pooled by maximum, so that nothing thin is lost. threshold: alpha in 1/255 above which a pixel
// is not empty.
vt_status vt_make_silhouettes(vt_context *, const vt_views *, int factor, int threshold, vt_silhouettes *out);
void vt_free_silhouettes(vt_context *, vt_silhouettes *);

// keep[cell] = 0 for cells of `level` that are carved: `votes` views whose frame holds the cell's whole projection
// (grown by a pixel) see nothing there, or fewer than least_seen views see it at all.
vt_status vt_carve(vt_context *, const vt_silhouettes *, const vt_octree *, int level, uint8_t *keep);

#ifdef __cplusplus
}
#endif
#endif
