// vector.h - three-vectors and 3x3 matrices in double
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_VECTOR_H
#define VT_BASE_VECTOR_H

#include <math.h>

#ifdef __cplusplus
extern "C" {
#endif

#define VT_PI 3.14159265358979323846

typedef struct vt_vec3 { double x, y, z; } vt_vec3;
typedef struct vt_mat3 { double m[9]; } vt_mat3; // row-major

static inline vt_vec3 vt_v3(double x, double y, double z) { return (vt_vec3){x, y, z}; }
static inline vt_vec3 vt_add(vt_vec3 a, vt_vec3 b) { return (vt_vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline vt_vec3 vt_sub(vt_vec3 a, vt_vec3 b) { return (vt_vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline vt_vec3 vt_scale(vt_vec3 a, double s) { return (vt_vec3){a.x * s, a.y * s, a.z * s}; }
static inline double vt_dot(vt_vec3 a, vt_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline vt_vec3 vt_cross(vt_vec3 a, vt_vec3 b) {
  return (vt_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double vt_length(vt_vec3 a) { return sqrt(vt_dot(a, a)); }
static inline vt_vec3 vt_normalise(vt_vec3 a) { // zero stays zero
  double l = vt_length(a);
  return l > 0 ? vt_scale(a, 1 / l) : a;
}
static inline vt_vec3 vt_mul(const vt_mat3 *a, vt_vec3 v) {
  const double *m = a->m;
  return (vt_vec3){m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
                   m[6] * v.x + m[7] * v.y + m[8] * v.z};
}
static inline vt_mat3 vt_mul_mat3(const vt_mat3 *a, const vt_mat3 *b) {
  vt_mat3 out;
  for (int i = 0; i < 9; i++) {
    const double *row = a->m + 3 * (i / 3), *column = b->m + i % 3;
    out.m[i] = row[0] * column[0] + row[1] * column[3] + row[2] * column[6];
  }
  return out;
}
static inline vt_vec3 vt_mul_transposed(const vt_mat3 *a, vt_vec3 v) {
  const double *m = a->m;
  return (vt_vec3){m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z,
                   m[2] * v.x + m[5] * v.y + m[8] * v.z};
}

#ifdef __cplusplus
}
#endif
#endif
