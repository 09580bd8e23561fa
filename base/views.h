// views.h - calibrated, matted photographs: what capture makes and reconstruct takes
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_VIEWS_H
#define VT_BASE_VIEWS_H

#include "base/camera.h"
#include "base/image.h"
#include "base/tracks.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_role {
  VT_TRAIN,
  VT_TEST,    // never looked at by reconstruct, only judged against
  VT_DOUBTFUL // neither: its matte contradicts those of the others
} vt_role;

typedef struct vt_view {
  char *name;       // file name within its capture, forward slashes; owned
  vt_role role;     //
  vt_camera camera; // width and height are the picture's
  vt_image picture; // straight RGBA; alpha is the matte; foreground colours where 0 < alpha < 1
  vt_image ignored; // one channel, the picture's size: where it is not 0 the picture says nothing, its alpha is 0 there and
                    // no emptiness; no pixels: all of the picture counts
} vt_view;

// What is known of the world that the cameras stand in, and how surely.
typedef struct vt_world {
  vt_vec3 up;             // unit, away from the ground; zero: not known
  double metres_per_unit; // 0: not known
  double tree_height;     // metres along `up`, as somebody measured it: gives the scale once the tree is there; 0: not said
  bool estimated;         // cameras or mattes were found from the photographs, so they may be mended; false: they are given
} vt_world;

typedef struct vt_views {
  int count;
  vt_view *items; // owned, each with its name and pictures
  vt_world world;
  vt_tracks tracks; // what a calibration saw in several of the views; none where nobody says
} vt_views;

void vt_free_views(vt_context *, vt_views *);
int vt_count_views(const vt_views *, vt_role);
// A shallow choice: `out->items` is a new array (free it with vt_free only) whose names and pictures are borrowed; without tracks.
vt_status vt_select_views(vt_context *, const vt_views *, vt_role, vt_views *out);
// Gives every n-th VT_TRAIN view (the n-th, 2n-th, ...) the role VT_TEST. n < 2 changes nothing.
void vt_hold_out(vt_views *, int n);

#ifdef __cplusplus
}
#endif
#endif
