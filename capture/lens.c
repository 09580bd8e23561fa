// lens.c - where a lens puts a ray, and which ray a pixel came from
// SPDX-License-Identifier: BSD-3-Clause
//
// With x, y on the plane z = 1 and r^2 = x^2 + y^2, the model of OpenCV and of COLMAP's OPENCV, RADIAL, FULL_OPENCV is
//   s = (1 + k1 r^2 + k2 r^4 + k3 r^6 + k r^8) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
//   x' = s x + 2 p1 x y + p2 (r^2 + 2 x^2),  y' = s y + p1 (r^2 + 2 y^2) + 2 p2 x y
// (the r^8 is nerfstudio's fourth coefficient) and the fisheye one [Kannala, Brandt 2006], with t = atan r,
//   x' = x/r (t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9), likewise y'.
// The pixel is (fx x' + cx, fy y' + cy). Both are polynomials that turn back somewhere: beyond that radius they put two
// rays on one pixel, and the way back is by Newton's steps from the middle, which ends at the inner one or nowhere.

#include "capture/lens.h"

bool vt_lens_is_pinhole(const vt_lens *lens) {
  if (lens->model == VT_LENS_PINHOLE) return true;
  if (lens->model == VT_LENS_FISHEYE) return false;
  for (int i = 0; i < 9; i++)
    if (lens->k[i] != 0) return false;
  return true;
}

static void bend(const vt_lens *lens, double x, double y, double out[2]) {
  const double *k = lens->k;
  double r2 = x * x + y * y;
  out[0] = x, out[1] = y;
  if (lens->model == VT_LENS_OPENCV) {
    double s = (1 + r2 * (k[0] + r2 * (k[1] + r2 * (k[4] + r2 * k[8])))) / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
    out[0] = s * x + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
    out[1] = s * y + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
  } else if (lens->model == VT_LENS_FISHEYE && r2 > 0) {
    double r = sqrt(r2), t = atan(r), t2 = t * t;
    double s = t * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])))) / r;
    out[0] = s * x, out[1] = s * y;
  }
}

void vt_lens_project(const vt_lens *lens, double x, double y, double pixel[2]) {
  double bent[2];
  bend(lens, x, y, bent);
  pixel[0] = lens->fx * bent[0] + lens->cx;
  pixel[1] = lens->fy * bent[1] + lens->cy;
}

bool vt_lens_unproject(const vt_lens *lens, const double pixel[2], double ray[2]) {
  double wanted[2] = {(pixel[0] - lens->cx) / lens->fx, (pixel[1] - lens->cy) / lens->fy}, at[2], error = 0;
  double r = hypot(wanted[0], wanted[1]);
  ray[0] = wanted[0], ray[1] = wanted[1];
  if (vt_lens_is_pinhole(lens)) return true;
  if (lens->model == VT_LENS_FISHEYE && r > 0 && r < 1.5) { // the start: without coefficients it is the answer
    ray[0] *= tan(r) / r;
    ray[1] *= tan(r) / r;
  }
  for (int turn = 0; turn < 100; turn++) {
    double h = 1e-6 * (1 + hypot(ray[0], ray[1])), right[2], below[2];
    bend(lens, ray[0], ray[1], at);
    bend(lens, ray[0] + h, ray[1], right);
    bend(lens, ray[0], ray[1] + h, below);
    double ex = wanted[0] - at[0], ey = wanted[1] - at[1];
    double a = (right[0] - at[0]) / h, b = (below[0] - at[0]) / h, c = (right[1] - at[1]) / h, d = (below[1] - at[1]) / h;
    double determinant = a * d - b * c;
    error = hypot(ex, ey);
    if (error < 1e-14) break;
    if (!(determinant > 1e-9)) return false; // it turns back here
    double dx = (d * ex - b * ey) / determinant, dy = (a * ey - c * ex) / determinant;
    double step = hypot(dx, dy), most = 0.3 * (1 + hypot(ray[0], ray[1])), cut = step > most ? most / step : 1;
    ray[0] += cut * dx, ray[1] += cut * dy;
  }
  return error < 1e-11 && isfinite(ray[0]) && isfinite(ray[1]);
}
