// write_cameras.h - cameras as the files that other programs of the field read
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_WRITE_CAMERAS_H
#define VT_CAPTURE_WRITE_CAMERAS_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_listed { // a photograph as it stands in a list; texts are borrowed
  const char *name;            // file_path, or the name in images.txt
  const char *mask, *ignored;  // mask_path and ignore_path, or NULL
  vt_lens lens;
  vt_mat3 rotation;            // cam_from_world
  vt_vec3 translation;         // cam_from_world
} vt_listed;

// transforms.json (or one of its kind) of instant-ngp, nerfstudio and NeRF, complete or not at all.
vt_status vt_write_transforms(vt_context *, const vt_listed *, int count, const vt_world *, const char *path);
// cameras, images and an empty points3D in a folder that is not there or empty, complete or not at all.
vt_status vt_write_colmap_model(vt_context *, const vt_listed *, int count, bool binary, const char *folder);
// Photographs in one of the formats of capture.h; by_path: transforms.json names files by their way from the folder.
vt_status vt_export_photos(vt_context *, const vt_photos *, bool by_path, vt_camera_format, const char *folder);
// The lens of a pinhole camera.
vt_lens vt_lens_of_camera(const vt_camera *);

#ifdef __cplusplus
}
#endif
#endif
