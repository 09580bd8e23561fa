// coverage.c - from where a capture looks at the tree, and from where it does not
// SPDX-License-Identifier: BSD-3-Clause
//
// The tree is taken to stand at the point nearest to the optical axes, sum |(I - d d^T)(x - c)|^2 -> min. Up is the direction
// that is orthogonal to the rows of pixels, since photographs are taken upright: sum (u . x_i)^2 -> min. From few directions
// this says too little (all rows are parallel), so a weak pull towards the mean of the pictures' own up is added, which gives
// the 3 x 3 system (sum x x^T + eps I) u = eps m.
// What goes wrong: where portraits and landscapes are mixed rows are not all horizontal, and up is a compromise.
#include "capture/capture.h"

#include <math.h>

// Solves a x = b for a symmetric positive a with entries near 1. False where it is singular.
static bool solve(const double a[3][3], const double b[3], double x[3]) {
  double minor[3][3], det = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int r = (i + 1) % 3, s = (i + 2) % 3, t = (j + 1) % 3, u = (j + 2) % 3;
      minor[i][j] = a[r][t] * a[s][u] - a[r][u] * a[s][t];
    }
  for (int j = 0; j < 3; j++) det += a[0][j] * minor[0][j];
  if (!(fabs(det) > 1e-9)) return false;
  for (int i = 0; i < 3; i++) x[i] = (minor[0][i] * b[0] + minor[1][i] * b[1] + minor[2][i] * b[2]) / det;
  return true;
}

static bool find_centre(const vt_camera *cameras, int count, vt_vec3 *centre) {
  double a[3][3] = {{0}}, b[3] = {0}, x[3];
  for (int i = 0; i < count; i++) {
    vt_vec3 p = vt_camera_centre(&cameras[i]), f = vt_camera_forward(&cameras[i]);
    double c[3] = {p.x, p.y, p.z}, d[3] = {f.x, f.y, f.z};
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) {
        double m = ((j == k) - d[j] * d[k]) / count;
        a[j][k] += m;
        b[j] += m * c[k];
      }
  }
  if (!solve(a, b, x)) return false;
  *centre = (vt_vec3){x[0], x[1], x[2]};
  return true;
}

static bool find_up(const vt_camera *cameras, int count, vt_vec3 *up) {
  double a[3][3] = {{0}}, mean[3] = {0}, x[3];
  for (int i = 0; i < count; i++)
    for (int j = 0; j < 3; j++) {
      const double *m = cameras[i].rotation.m;
      mean[j] -= m[3 + j] / count;
      for (int k = 0; k < 3; k++) a[j][k] += m[j] * m[k] / count;
    }
  for (int j = 0; j < 3; j++) a[j][j] += 0.01;
  if (!solve(a, mean, x)) return false;
  double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  if (!(length > 1e-12)) return false;
  *up = (vt_vec3){x[0] / length, x[1] / length, x[2] / length};
  return true;
}

static double dot(vt_vec3 a, vt_vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

void vt_capture_coverage(const vt_camera *cameras, int count, vt_coverage *out) {
  const double degrees = 57.29577951308232;
  vt_vec3 centre, up;
  *out = (vt_coverage){0};
  if (count < 1 || !find_centre(cameras, count, &centre) || !find_up(cameras, count, &up)) return;
  vt_vec3 east = fabs(up.x) < 0.8 ? (vt_vec3){1, 0, 0} : (vt_vec3){0, 1, 0};
  double along = dot(east, up), length;
  east = (vt_vec3){east.x - along * up.x, east.y - along * up.y, east.z - along * up.z};
  length = sqrt(dot(east, east));
  east = (vt_vec3){east.x / length, east.y / length, east.z / length};
  vt_vec3 north = {up.y * east.z - up.z * east.y, up.z * east.x - up.x * east.z, up.x * east.y - up.y * east.x};
  *out = (vt_coverage){.count = count, .largest_gap = -1, .lowest = 90, .highest = -90};
  for (int i = 0; i < count; i++) { // to the next camera in azimuth; some thousand cameras are compared quickly enough
    vt_vec3 p = vt_camera_centre(&cameras[i]), d = {p.x - centre.x, p.y - centre.y, p.z - centre.z};
    double azimuth = atan2(dot(d, north), dot(d, east)), gap = 360;
    double elevation = degrees * asin(fmax(-1, fmin(1, dot(d, up) / sqrt(dot(d, d)))));
    int next = i;
    for (int k = 0; k < count; k++) {
      vt_vec3 q = vt_camera_centre(&cameras[k]), e = {q.x - centre.x, q.y - centre.y, q.z - centre.z};
      double step = degrees * (atan2(dot(e, north), dot(e, east)) - azimuth);
      if (step < 0) step += 360;
      if (k != i && step < gap && (step > 0 || k > i)) gap = step, next = k;
    }
    if (gap > out->largest_gap) out->largest_gap = gap, out->gap_begin = i, out->gap_end = next;
    out->lowest = fmin(out->lowest, elevation);
    out->highest = fmax(out->highest, elevation);
  }
  out->around = 360 - out->largest_gap;
}
