// align_cameras.h - one set of cameras laid onto another, and how far apart they stay
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_ALIGN_CAMERAS_H
#define VT_RECONSTRUCT_ALIGN_CAMERAS_H

#include "base/adjust_camera.h"
#include "reconstruct/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

// target = scale rotation source + shift
typedef struct vt_similarity {
  double scale;
  vt_mat3 rotation;
  vt_vec3 shift;
} vt_similarity;

// The similarity that brings the cameras `from` nearest to `to` (the same number in the same order): least squares of places and
// of directions, which count like a displacement at the cameras' distance from `middle` (of the scene of `to`).
vt_similarity vt_align_cameras(int count, const vt_camera *from, const vt_camera *to, vt_vec3 middle);
// The same picture of the scene moved by a similarity.
vt_camera vt_move_camera_by(const vt_similarity *, const vt_camera *);

#ifdef __cplusplus
}
#endif
#endif
