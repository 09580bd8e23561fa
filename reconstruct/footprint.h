// footprint.h - where cells fall in a photograph
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_FOOTPRINT_H
#define VT_RECONSTRUCT_FOOTPRINT_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_footprint_kind {
  VT_BEHIND,  // wholly behind the camera
  VT_AROUND,  // the camera's plane cuts the cell: it may fall anywhere
  VT_IN_FRONT // the rectangle holds the whole projection
} vt_footprint_kind;

typedef struct vt_footprint {
  vt_footprint_kind kind;
  double left, top, right, bottom; // pixels, not clipped to the picture
} vt_footprint;

// A rectangle that holds the projection of a cube: with half extents dx, dy, dz of the rotated cube, its points lie
// within f (|x| dz/z + dx) / (z - dz) of the centre's projection.
vt_footprint vt_footprint_of(const vt_camera *, vt_vec3 centre, double half_edge);

// Pixels whose rays may meet a cell of a level, as blocks of VT_BLOCK_PIXELS squared.
#define VT_BLOCK_PIXELS 8
typedef struct vt_pixel_blocks {
  int width, height; // in blocks
  uint8_t *marked;   // [height][width]; owned
} vt_pixel_blocks;
vt_status vt_mark_blocks(vt_context *, const vt_octree *, int level, const vt_camera *, vt_pixel_blocks *out);

#ifdef __cplusplus
}
#endif
#endif
