// level_of_detail.c - the level a camera needs
// SPDX-License-Identifier: BSD-3-Clause
//
// A texel of level l covers tile_side * edge_l / texel_edge of the world (of a tile; photographs are reduced so that view
// textures have texel_edge texels a cell), at distance d that times f / d pixels. Where no textures are drawn a cell is one
// texel. The distance planes of [LRMDM06, 3.3] with the distance measured along the ray instead of along the view's axis, so that
// turning the head changes nothing. The nearest point of the tree is looked for on a coarse level, whose few cells
// hold all finer ones: the root cube alone is a third air.

#include "render/level_of_detail.h"

#define SEARCH_LEVEL 3 // at most 512 cells

static double beyond(double p, double low, double high) { return p < low ? low - p : p > high ? p - high : 0; }

// Distance from the eye to the nearest cell of a coarse level, or to the root cube; 0 within.
static double distance_to_tree(const vt_octree *octree, vt_vec3 eye) {
  int number = octree->level_count - 1 < SEARCH_LEVEL ? octree->level_count - 1 : SEARCH_LEVEL;
  while (number > 0 && !octree->levels[number].cell_count) number--;
  const vt_level *level = &octree->levels[number];
  double edge = vt_cell_edge(octree, number), nearest = INFINITY;
  vt_vec3 e = vt_scale(vt_sub(eye, octree->origin), 1 / edge);
  for (uint32_t i = 0; i < level->cell_count; i++) {
    vt_vec3 d = {beyond(e.x, level->x[i], level->x[i] + 1), beyond(e.y, level->y[i], level->y[i] + 1),
                 beyond(e.z, level->z[i], level->z[i] + 1)};
    nearest = fmin(nearest, vt_dot(d, d));
  }
  if (!level->cell_count) {
    double n = octree->edge / edge;
    vt_vec3 d = {beyond(e.x, 0, n), beyond(e.y, 0, n), beyond(e.z, 0, n)};
    nearest = vt_dot(d, d);
  }
  return sqrt(nearest) * edge;
}

// In cell edges.
static double texel_of(const vt_tree *tree, int level) {
  return (tree->tiles[level].view_count ? (double)tree->tile_side : 1) / tree->texel_edge;
}

int vt_choose_level_for(const vt_tree *tree, const vt_camera *camera, double texel_pixels, bool flat) {
  VT_ASSERT(tree->octree.level_count > 0);
  int finest = tree->octree.level_count - 1;
  bool textured = false;
  for (int i = 0; i <= finest; i++) textured = textured || vt_has_textures(tree, i);
  while (textured && !vt_has_textures(tree, finest)) finest--;
  double distance = distance_to_tree(&tree->octree, vt_camera_centre(camera)), f = fmax(camera->fx, camera->fy);
  for (int i = 0; i < finest; i++) {
    if (textured && !vt_has_textures(tree, i)) continue;
    double texel = textured && !flat ? texel_of(tree, i) : 1;
    if (texel * vt_cell_edge(&tree->octree, i) * f <= texel_pixels * distance) return i;
  }
  return finest;
}

int vt_choose_level(const vt_tree *tree, const vt_camera *camera, double texel_pixels) {
  return vt_choose_level_for(tree, camera, texel_pixels, false);
}
