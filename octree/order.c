// order.c - cells of a uniform level from far to near
// SPDX-License-Identifier: BSD-3-Clause
//
// Along a ray from the eye every step into the next cell moves one cell away from the eye's own cell on one axis, so
// k = |x-ex| + |y-ey| + |z-ez| grows strictly along every ray: descending k is an exact back-to-front order for every
// eye, also at crown height and inside the crown, and for any branching. k is a small integer, so one counting sort does
// it. (METHODS 7 gives the closed-form key for mixed levels; on one level this is the same order with less work.)

#include "octree/octree.h"

#include <math.h>

// The eye's cell on one axis; an eye farther out than one cell beyond the root sorts like one just outside.
static int eye_cell(double eye, double origin, double edge, int n) {
  double e = floor((eye - origin) / edge);
  return e < -1 ? -1 : e > n ? n : (int)e;
}

static unsigned planes_between(const vt_level *level, const int eye[3], uint32_t i) {
  int dx = level->x[i] - eye[0], dy = level->y[i] - eye[1], dz = level->z[i] - eye[2];
  return (unsigned)(abs(dx) + abs(dy) + abs(dz));
}

vt_status vt_order_back_to_front(vt_context *context, const vt_octree *octree, int level_number, vt_vec3 eye,
                                 uint32_t *order) {
  const vt_level *level = &octree->levels[level_number];
  int n = level->axis_cells;
  double edge = octree->edge / n;
  int e[3] = {eye_cell(eye.x, octree->origin.x, edge, n), eye_cell(eye.y, octree->origin.y, edge, n),
              eye_cell(eye.z, octree->origin.z, edge, n)};
  unsigned keys = 3u * (unsigned)n + 4u;
  uint32_t *start = VT_NEW(context, uint32_t, keys + 1);
  if (!start) return VT_OUT_OF_MEMORY;
  for (uint32_t i = 0; i < level->cell_count; i++) start[keys - planes_between(level, e, i)]++; // far first
  uint32_t sum = 0;
  for (unsigned k = 0; k <= keys; k++) {
    uint32_t here = start[k];
    start[k] = sum;
    sum += here;
  }
  for (uint32_t i = 0; i < level->cell_count; i++) order[start[keys - planes_between(level, e, i)]++] = i;
  vt_free(context, start);
  return VT_OK;
}
