// colmap_model.h - reading a COLMAP sparse model
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_COLMAP_MODEL_H
#define VT_CAPTURE_COLMAP_MODEL_H

#include "base/camera.h"
#include "capture/landmarks.h"
#include "capture/lens.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_colmap_image {
  char *name;          // as in the model, relative to the image folder; owned
  vt_lens lens;        //
  vt_mat3 rotation;    // cam_from_world
  vt_vec3 translation; // cam_from_world
} vt_colmap_image;

typedef struct vt_colmap_model {
  int count;
  vt_colmap_image *items;    // owned, sorted by name
  double reprojection_error; // pixels, mean over observations; NAN where the model has no points
  vt_landmarks landmarks;    // seen_by: places in items
} vt_colmap_model;

// True if `folder` holds cameras and images, as .bin or as .txt.
bool vt_is_colmap_model(vt_context *, const char *folder);
// Binary files are taken where both are there. VT_BAD_INPUT naming the file.
vt_status vt_read_colmap_model(vt_context *, const char *folder, vt_colmap_model *out);
void vt_free_colmap_model(vt_context *, vt_colmap_model *);

#ifdef __cplusplus
}
#endif
#endif
