// tiles.c - where a billboard's texture lies in the picture plane of its view
// SPDX-License-Identifier: BSD-3-Clause

#include "octree/octree.h"

#include <math.h>

vt_tile_frame vt_tile_frame_of(const vt_camera *camera, vt_vec3 cell_centre, double cell_edge, double tile_side,
                               int texel_edge) {
  vt_vec3 p = vt_to_camera(camera, cell_centre);
  if (!(p.z > 0)) return (vt_tile_frame){0};
  double side = tile_side * 0.5 * (camera->fx + camera->fy) * cell_edge / p.z;
  double u = camera->fx * p.x / p.z + camera->cx, v = camera->fy * p.y / p.z + camera->cy;
  return (vt_tile_frame){(float)(u - 0.5 * side), (float)(v - 0.5 * side), (float)(texel_edge / side)};
}

vt_tile_frame vt_snapped_frame_of(const vt_camera *camera, vt_vec3 cell_centre, int grid, int texel_edge) {
  vt_vec3 p = vt_to_camera(camera, cell_centre);
  if (!(p.z > 0)) return (vt_tile_frame){0};
  double u = camera->fx * p.x / p.z + camera->cx, v = camera->fy * p.y / p.z + camera->cy, half = 0.5 * texel_edge - 0.5;
  return (vt_tile_frame){(float)(grid * floor(u / grid - half)), (float)(grid * floor(v / grid - half)), 1 / (float)grid};
}

vt_tile_frame vt_frame_of_tile(const vt_tree *tree, int level, int view, vt_vec3 cell_centre) {
  const vt_camera *camera = &tree->cameras[view];
  if (tree->tiles[level].grid) return vt_snapped_frame_of(camera, cell_centre, tree->tiles[level].grid, tree->texel_edge);
  return vt_tile_frame_of(camera, cell_centre, vt_cell_edge(&tree->octree, level), tree->tile_side, tree->texel_edge);
}

void vt_free_tiles(vt_context *context, vt_tiles *tiles) {
  vt_free(context, tiles->tile_of);
  vt_free(context, tiles->texels);
  vt_free(context, tiles->alpha_code);
  vt_free(context, tiles->colour_code);
  *tiles = (vt_tiles){0};
}
