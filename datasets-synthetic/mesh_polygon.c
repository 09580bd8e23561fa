// mesh_polygon.c - polygons cut into triangles
// SPDX-License-Identifier: BSD-3-Clause
//
// A convex polygon is a fan around its first corner. A concave one loses its ears [Meisters 1975]: a corner that turns
// left and whose triangle holds no other corner is cut off, until three are left. Left and right are told along the
// polygon's own normal by Newell's sum, so that corners that are not quite in a plane do no harm. Where rounding or a
// self-crossing leaves no ear, the next corner goes: the count of triangles is right whatever comes in.
#include "datasets-synthetic/mesh_polygon.h"

#include <stdbool.h>

static vt_vec3 newell_normal(const vt_vec3 *corners, uint32_t count) {
  vt_vec3 sum = {0, 0, 0};
  for (uint32_t i = 1; i + 1 < count; i++)
    sum = vt_add(sum, vt_cross(vt_sub(corners[i], corners[0]), vt_sub(corners[i + 1], corners[0])));
  return sum;
}

static double turn(vt_vec3 a, vt_vec3 b, vt_vec3 c, vt_vec3 normal) { // > 0: left
  return vt_dot(normal, vt_cross(vt_sub(b, a), vt_sub(c, b)));
}

static bool is_convex(const vt_vec3 *corners, uint32_t count, vt_vec3 normal) {
  for (uint32_t i = 0; i < count; i++)
    if (turn(corners[i], corners[(i + 1) % count], corners[(i + 2) % count], normal) < 0) return false;
  return true;
}

static bool is_ear(const vt_vec3 *corners, const uint32_t *order, uint32_t count, uint32_t i, vt_vec3 normal) {
  uint32_t before = (i + count - 1) % count, behind = (i + 1) % count;
  vt_vec3 a = corners[order[before]], b = corners[order[i]], c = corners[order[behind]];
  if (turn(a, b, c, normal) <= 0) return false;
  for (uint32_t k = 0; k < count; k++) {
    if (k == before || k == i || k == behind) continue;
    vt_vec3 p = corners[order[k]];
    if (turn(a, b, p, normal) >= 0 && turn(b, c, p, normal) >= 0 && turn(c, a, p, normal) >= 0) return false;
  }
  return true;
}

void vt_cut_polygon(const vt_vec3 *corners, uint32_t count, uint32_t *order, uint32_t (*triangles)[3]) {
  vt_vec3 normal = newell_normal(corners, count);
  for (uint32_t i = 0; i < count; i++) order[i] = i;
  if (count <= 3 || count > VT_MAX_CONCAVE || is_convex(corners, count, normal)) {
    for (uint32_t i = 0; i + 2 < count; i++) triangles[i][0] = 0, triangles[i][1] = i + 1, triangles[i][2] = i + 2;
    return;
  }
  for (uint32_t left = count, cut = 0; left >= 3; left--, cut++) {
    uint32_t ear = 0;
    while (ear < left && !is_ear(corners, order, left, ear, normal)) ear++;
    if (ear == left) ear = 0;
    triangles[cut][0] = order[(ear + left - 1) % left];
    triangles[cut][1] = order[ear];
    triangles[cut][2] = order[(ear + 1) % left];
    for (uint32_t k = ear; k + 1 < left; k++) order[k] = order[k + 1];
  }
}
