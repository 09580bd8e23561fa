// align_cameras.c - one set of cameras laid onto another, and how far apart they stay
// SPDX-License-Identifier: BSD-3-Clause
//
// Where a scene stands, how it is turned and how large it is no photograph of it says: cameras are compared after the best
// similarity between the two sets. Places alone leave it open where they stand on a line, so directions count too: with
// centred places a_i (source), b_i (target) and rotations A_i, B_i the wanted rotation Q maximises the trace of
//
//   Q^T M,  M = sum b_i a_i^T + sum d_i^2 B_i^T A_i
//
// [Umeyama 1991, with rows for directions]: the orthogonal factor of M, by Newton's iteration X <- (X + X^-T) / 2 [Higham 1986],
// which needs no singular values; M is regular, since the sets are nearly the same.

#include "reconstruct/align_cameras.h"

#include <string.h>

static vt_mat3 transpose(const vt_mat3 *a) {
  const double *m = a->m;
  return (vt_mat3){{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}};
}

// The nearest rotation to a matrix that is nearly one times a number; false where it is singular.
static bool orthogonal_factor(vt_mat3 *x) {
  double size = 0;
  for (int i = 0; i < 9; i++) size = fmax(size, fabs(x->m[i]));
  if (!(size > 0)) return false;
  for (int i = 0; i < 9; i++) x->m[i] /= size;
  for (int step = 0; step < 40; step++) {
    const double *m = x->m;
    vt_vec3 a = {m[0], m[1], m[2]}, b = {m[3], m[4], m[5]}, c = {m[6], m[7], m[8]};
    vt_vec3 bc = vt_cross(b, c), ca = vt_cross(c, a), ab = vt_cross(a, b);
    double det = vt_dot(a, bc);
    if (!(det > 1e-12)) return false;
    double cofactors[9] = {bc.x, bc.y, bc.z, ca.x, ca.y, ca.z, ab.x, ab.y, ab.z}, change = 0; // of X: det X^-T
    for (int i = 0; i < 9; i++) {
      double next = 0.5 * (x->m[i] + cofactors[i] / det);
      change = fmax(change, fabs(next - x->m[i]));
      x->m[i] = next;
    }
    if (change < 1e-15) break;
  }
  return true;
}

vt_similarity vt_align_cameras(int count, const vt_camera *from, const vt_camera *to, vt_vec3 middle) {
  vt_similarity out = {1, {{1, 0, 0, 0, 1, 0, 0, 0, 1}}, {0, 0, 0}};
  vt_vec3 mean_from = {0, 0, 0}, mean_to = {0, 0, 0};
  for (int i = 0; i < count; i++) {
    mean_from = vt_add(mean_from, vt_scale(vt_camera_centre(&from[i]), 1.0 / count));
    mean_to = vt_add(mean_to, vt_scale(vt_camera_centre(&to[i]), 1.0 / count));
  }
  vt_mat3 m = {{0}};
  for (int i = 0; i < count; i++) {
    vt_vec3 a = vt_sub(vt_camera_centre(&from[i]), mean_from), b = vt_sub(vt_camera_centre(&to[i]), mean_to);
    vt_vec3 away = vt_sub(vt_camera_centre(&to[i]), middle);
    double ax[3] = {a.x, a.y, a.z}, bx[3] = {b.x, b.y, b.z}, weight = vt_dot(away, away);
    vt_mat3 turned = transpose(&to[i].rotation), both = vt_mul_mat3(&turned, &from[i].rotation);
    for (int k = 0; k < 9; k++) m.m[k] += bx[k / 3] * ax[k % 3] + weight * both.m[k];
  }
  if (orthogonal_factor(&m)) out.rotation = m;
  double along = 0, square = 0;
  for (int i = 0; i < count; i++) {
    vt_vec3 a = vt_mul(&out.rotation, vt_sub(vt_camera_centre(&from[i]), mean_from));
    along += vt_dot(a, vt_sub(vt_camera_centre(&to[i]), mean_to)), square += vt_dot(a, a);
  }
  if (along > 0 && square > 0) out.scale = along / square;
  out.shift = vt_sub(mean_to, vt_scale(vt_mul(&out.rotation, mean_from), out.scale));
  return out;
}

vt_camera vt_move_camera_by(const vt_similarity *s, const vt_camera *camera) {
  vt_camera out = *camera;
  vt_vec3 centre = vt_add(vt_scale(vt_mul(&s->rotation, vt_camera_centre(camera)), s->scale), s->shift);
  vt_mat3 back = transpose(&s->rotation);
  out.rotation = vt_mul_mat3(&camera->rotation, &back);
  out.translation = vt_scale(vt_mul(&out.rotation, centre), -1);
  return out;
}
