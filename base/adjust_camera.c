// adjust_camera.c - a camera turned and moved a little, and what a point of the world does in it meanwhile
// SPDX-License-Identifier: BSD-3-Clause
//
// With E(w) = exp [w]x the camera X_c = R (X - C) becomes X_c' = E(w) (R (X - C) - d u): turned by w about its place, which
// moves by d u. Its derivatives are
//
//   dX_c'/du = -d E,   dX_c'/dX = E R,   dX_c'/dw = -[X_c']x J(w),   J = I + (1 - cos t)/t^2 [w]x + (t - sin t)/t^3 [w]x^2
//
// with t = |w| and J the left Jacobian of the rotation group: poses count from the cameras that came, so w is not 0.

#include "base/adjust_camera.h"

static vt_mat3 rotation_of(const double w[3]) {
  double angle = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  double a = angle > 1e-9 ? sin(angle) / angle : 1, b = angle > 1e-9 ? (1 - cos(angle)) / (angle * angle) : 0.5;
  double x = w[0], y = w[1], z = w[2];
  return (vt_mat3){{1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y, b * x * y + a * z, 1 - b * (x * x + z * z),
                    b * y * z - a * x, b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y)}};
}

vt_camera vt_adjust_camera(const vt_camera *camera, const double pose[6], double log_focal, double distance) {
  vt_camera out = *camera;
  vt_vec3 moved = vt_scale(vt_v3(pose[3], pose[4], pose[5]), distance);
  vt_vec3 centre = vt_add(vt_camera_centre(camera), vt_mul_transposed(&camera->rotation, moved));
  vt_mat3 turn = rotation_of(pose);
  out.rotation = vt_mul_mat3(&turn, &camera->rotation);
  out.translation = vt_scale(vt_mul(&out.rotation, centre), -1);
  out.fx *= exp(log_focal), out.fy *= exp(log_focal);
  return out;
}

static vt_mat3 cross_with(vt_vec3 v) { return (vt_mat3){{0, -v.z, v.y, v.z, 0, -v.x, -v.y, v.x, 0}}; }

static vt_mat3 left_jacobian(const double w[3]) {
  double t = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  double a = t > 1e-4 ? (1 - cos(t)) / (t * t) : 0.5 - t * t / 24, b = t > 1e-4 ? (t - sin(t)) / (t * t * t) : 1.0 / 6;
  vt_mat3 x = cross_with(vt_v3(w[0], w[1], w[2])), square = vt_mul_mat3(&x, &x), out = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};
  for (int k = 0; k < 9; k++) out.m[k] += a * x.m[k] + b * square.m[k];
  return out;
}

vt_vec3 vt_adjusted_point(const vt_camera *camera, const double pose[6], double distance, vt_vec3 point, double (*by_pose)[6],
                          double (*by_point)[3]) {
  vt_mat3 turn = rotation_of(pose);
  vt_vec3 moved = vt_scale(vt_v3(pose[3], pose[4], pose[5]), distance);
  vt_vec3 out = vt_mul(&turn, vt_sub(vt_to_camera(camera, point), moved));
  if (by_pose) {
    vt_mat3 cross = cross_with(out), jacobian = left_jacobian(pose), by_turn = vt_mul_mat3(&cross, &jacobian);
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++) by_pose[i][k] = -by_turn.m[3 * i + k], by_pose[i][3 + k] = -distance * turn.m[3 * i + k];
  }
  if (by_point) {
    vt_mat3 whole = vt_mul_mat3(&turn, &camera->rotation);
    for (int k = 0; k < 9; k++) by_point[k / 3][k % 3] = whole.m[k];
  }
  return out;
}
