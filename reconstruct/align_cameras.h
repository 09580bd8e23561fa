// align_cameras.h - one set of cameras laid onto another, and how far apart they stay
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_ALIGN_CAMERAS_H
#define VT_RECONSTRUCT_ALIGN_CAMERAS_H

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

// A camera turned and moved within its own frame: rotation vector pose[0..2] (radians, about its place), displacement
// pose[3..5] in `distance`s along its axes; focal lengths times exp(log_focal).
vt_camera vt_adjust_camera(const vt_camera *, const double pose[6], double log_focal, double distance);

vt_mat3 vt_mul_mat3(const vt_mat3 *, const vt_mat3 *);

#ifdef __cplusplus
}
#endif
#endif
