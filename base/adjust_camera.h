// adjust_camera.h - a camera turned and moved a little, and what a point of the world does in it meanwhile
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_ADJUST_CAMERA_H
#define VT_BASE_ADJUST_CAMERA_H

#include "base/camera.h"

#ifdef __cplusplus
extern "C" {
#endif

// A camera turned and moved within its own frame: rotation vector pose[0..2] (radians, about its place), displacement
// pose[3..5] in `distance`s along its axes; focal lengths times exp(log_focal).
vt_camera vt_adjust_camera(const vt_camera *, const double pose[6], double log_focal, double distance);

// Where a point of the world stands in the frame of the camera so adjusted, and by_pose_or_null, by_point_or_null: how that
// changes with the pose and with the point. Exact for every pose, not only near 0.
vt_vec3 vt_adjusted_point(const vt_camera *, const double pose[6], double distance, vt_vec3 point,
                          double (*by_pose_or_null)[6], double (*by_point_or_null)[3]);

#ifdef __cplusplus
}
#endif
#endif
