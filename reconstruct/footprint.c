// footprint.c - where cells fall in a photograph
// SPDX-License-Identifier: BSD-3-Clause

#include "reconstruct/footprint.h"

#include <string.h>

vt_footprint vt_footprint_of(const vt_camera *c, vt_vec3 centre, double half) {
  const double *m = c->rotation.m;
  vt_vec3 p = vt_to_camera(c, centre);
  double dx = half * (fabs(m[0]) + fabs(m[1]) + fabs(m[2])), dy = half * (fabs(m[3]) + fabs(m[4]) + fabs(m[5])),
         dz = half * (fabs(m[6]) + fabs(m[7]) + fabs(m[8])), nearest = p.z - dz;
  if (p.z + dz <= 0) return (vt_footprint){VT_BEHIND, 0, 0, 0, 0};
  if (nearest <= 0) return (vt_footprint){VT_AROUND, 0, 0, 0, 0};
  double ru = c->fx * (dx + fabs(p.x) * dz / p.z) / nearest, rv = c->fy * (dy + fabs(p.y) * dz / p.z) / nearest;
  double u = c->fx * p.x / p.z + c->cx, v = c->fy * p.y / p.z + c->cy;
  return (vt_footprint){VT_IN_FRONT, u - ru, v - rv, u + ru, v + rv};
}

static int block_of(double pixel, int count) {
  double block = floor(pixel / VT_BLOCK_PIXELS);
  return block < 0 ? 0 : block > count - 1 ? count - 1 : (int)block;
}

vt_status vt_mark_blocks(vt_context *context, const vt_octree *octree, int level, const vt_camera *camera,
                         vt_pixel_blocks *out) {
  out->width = (camera->width + VT_BLOCK_PIXELS - 1) / VT_BLOCK_PIXELS;
  out->height = (camera->height + VT_BLOCK_PIXELS - 1) / VT_BLOCK_PIXELS;
  size_t count = (size_t)out->width * (size_t)out->height;
  out->marked = VT_NEW(context, uint8_t, count);
  if (!out->marked) return VT_OUT_OF_MEMORY;
  double half = 0.5 * vt_cell_edge(octree, level);
  for (uint32_t i = 0; i < octree->levels[level].cell_count; i++) {
    vt_footprint f = vt_footprint_of(camera, vt_cell_centre(octree, level, i), half);
    if (f.kind == VT_AROUND) {
      memset(out->marked, 1, count);
      return VT_OK;
    }
    if (f.kind == VT_BEHIND || f.right < 0 || f.bottom < 0 || f.left > camera->width || f.top > camera->height) continue;
    int x0 = block_of(f.left, out->width), x1 = block_of(f.right, out->width), y1 = block_of(f.bottom, out->height);
    for (int y = block_of(f.top, out->height); y <= y1; y++)
      memset(out->marked + (size_t)y * (size_t)out->width + x0, 1, (size_t)(x1 - x0 + 1));
  }
  return VT_OK;
}
