// camera.c - pinhole projection and its inverse
// SPDX-License-Identifier: BSD-3-Clause

#include "base/camera.h"

vt_vec3 vt_camera_centre(const vt_camera *camera) {
  return vt_scale(vt_mul_transposed(&camera->rotation, camera->translation), -1);
}

vt_vec3 vt_camera_forward(const vt_camera *camera) {
  const double *m = camera->rotation.m;
  return vt_v3(m[6], m[7], m[8]);
}

vt_vec3 vt_to_camera(const vt_camera *camera, vt_vec3 world) {
  return vt_add(vt_mul(&camera->rotation, world), camera->translation);
}

bool vt_project(const vt_camera *camera, vt_vec3 world, double pixel[2]) {
  vt_vec3 p = vt_to_camera(camera, world);
  if (!(p.z > 0)) return false;
  pixel[0] = camera->fx * p.x / p.z + camera->cx;
  pixel[1] = camera->fy * p.y / p.z + camera->cy;
  return true;
}

vt_ray vt_camera_ray(const vt_camera *camera, double pixel_x, double pixel_y) {
  vt_vec3 d = vt_v3((pixel_x - camera->cx) / camera->fx, (pixel_y - camera->cy) / camera->fy, 1);
  return (vt_ray){vt_camera_centre(camera), vt_normalise(vt_mul_transposed(&camera->rotation, d))};
}

vt_camera vt_resize_camera(const vt_camera *camera, int width, int height) {
  vt_camera out = *camera;
  double sx = (double)width / camera->width, sy = (double)height / camera->height;
  out.width = width;
  out.height = height;
  out.fx *= sx;
  out.cx *= sx;
  out.fy *= sy;
  out.cy *= sy;
  return out;
}

vt_camera vt_look_at(vt_vec3 eye, vt_vec3 target, vt_vec3 up, double fov_y, int width, int height) {
  vt_vec3 forward = vt_normalise(vt_sub(target, eye));
  vt_vec3 right = vt_cross(forward, up);
  if (vt_length(right) < 1e-9 * vt_length(up)) // looking along `up`: any right will do
    right = vt_cross(forward, fabs(forward.x) < 0.9 ? vt_v3(1, 0, 0) : vt_v3(0, 1, 0));
  right = vt_normalise(right);
  vt_vec3 down = vt_cross(forward, right);
  double f = 0.5 * height / tan(0.5 * fov_y);
  vt_camera out = {.width = width, .height = height, .fx = f, .fy = f, .cx = 0.5 * width, .cy = 0.5 * height};
  out.rotation = (vt_mat3){{right.x, right.y, right.z, down.x, down.y, down.z, forward.x, forward.y, forward.z}};
  out.translation = vt_scale(vt_mul(&out.rotation, eye), -1);
  return out;
}

vt_status vt_check_camera(vt_context *context, const vt_camera *camera, const char *name) {
  const double *m = camera->rotation.m;
  double numbers[] = {camera->fx, camera->fy, camera->cx, camera->cy,
                      camera->translation.x, camera->translation.y, camera->translation.z};
  bool finite = true;
  for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) finite = finite && isfinite(numbers[i]);
  for (int i = 0; i < 9; i++) finite = finite && isfinite(m[i]);
  if (!finite)
    return vt_fail(context, VT_BAD_INPUT, "%s: the camera has NaN or infinity; export the cameras again", name);
  if (camera->width < 1 || camera->height < 1 || camera->width > 65535 || camera->height > 65535)
    return vt_fail(context, VT_BAD_INPUT, "%s: the camera's picture size %d x %d is not 1..65535; export the cameras again",
                   name, camera->width, camera->height);
  if (!(camera->fx > 0) || !(camera->fy > 0))
    return vt_fail(context, VT_BAD_INPUT, "%s: the focal length is not positive; export the cameras again", name);
  double worst = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      double dot = m[3 * i] * m[3 * j] + m[3 * i + 1] * m[3 * j + 1] + m[3 * i + 2] * m[3 * j + 2];
      worst = fmax(worst, fabs(dot - (i == j)));
    }
  double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                       m[2] * (m[3] * m[7] - m[4] * m[6]);
  if (worst > 1e-3 || determinant < 0)
    return vt_fail(context, VT_BAD_INPUT, "%s: the camera's matrix is no rotation (singular, mirrored or scaled); "
                   "export the cameras again", name);
  return VT_OK;
}
