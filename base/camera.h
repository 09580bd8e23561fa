// camera.h - a pinhole camera after undistortion
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_CAMERA_H
#define VT_BASE_CAMERA_H

#include "base/context.h"
#include "base/vector.h"

#ifdef __cplusplus
extern "C" {
#endif

// OpenCV/COLMAP axes: x right, y down, z forward. Pixel coordinates are continuous: the first pixel's centre is
// (0.5, 0.5). A point X of the world stands at x_cam = rotation X + translation and at pixel
// (fx x/z + cx, fy y/z + cy).
typedef struct vt_camera {
  int width, height;     // pixels
  double fx, fy, cx, cy; // pixels
  vt_mat3 rotation;      // cam_from_world
  vt_vec3 translation;   // cam_from_world, world units
} vt_camera;

typedef struct vt_ray {
  vt_vec3 origin;    // world
  vt_vec3 direction; // world, unit length
} vt_ray;

vt_vec3 vt_camera_centre(const vt_camera *);  // world: -R^T t
vt_vec3 vt_camera_forward(const vt_camera *); // world, unit: third row of R
vt_vec3 vt_to_camera(const vt_camera *, vt_vec3 world);
// Pixel of a world point; false (and pixel untouched) if it is not in front of the camera.
bool vt_project(const vt_camera *, vt_vec3 world, double pixel[2]);
vt_ray vt_camera_ray(const vt_camera *, double pixel_x, double pixel_y);
// The same view on a picture of another size (focal lengths and centre scaled).
vt_camera vt_resize_camera(const vt_camera *, int width, int height);
// A camera at `eye` that looks at `target`; `up` need not be orthogonal. fov_y in radians.
vt_camera vt_look_at(vt_vec3 eye, vt_vec3 target, vt_vec3 up, double fov_y, int width, int height);
// VT_BAD_INPUT, with `name` in the sentence, on NaN, infinity, no size, focal <= 0, or a rotation that is not one
// (|R R^T - I| > 1e-3 or determinant < 0).
vt_status vt_check_camera(vt_context *, const vt_camera *, const char *name);

#ifdef __cplusplus
}
#endif
#endif
