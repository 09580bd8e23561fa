// field_scenes.h - small trees with fields and view textures for the tests of compositing and rendering
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_FIELD_SCENES_H
#define VT_TESTS_FIELD_SCENES_H

#include "tests/render_scenes.h"

// Random values at the corners of a level, a sixth of them transparent, and cells that are their means.
static inline void scene_add_field(vt_context *context, vt_tree *tree, int level, uint64_t seed) {
  vt_level *cells = &tree->octree.levels[level];
  vt_rng rng = vt_seed_rng(seed, 2);
  assert_int_equal(vt_make_corners(context, tree->octree.branching, cells), VT_OK);
  for (size_t i = 0; i < cells->corner_count; i++) {
    float *v = cells->corner_values + 4 * i;
    v[0] = vt_random_unit(&rng) < 0.17 ? 0 : (float)vt_random_between(&rng, 0, 2);
    for (int c = 1; c < 4; c++) v[c] = (float)vt_random_unit(&rng);
  }
  vt_cells_from_corners(cells);
}

// Random smooth textures for all views, whole photographs reduced by `factor`.
static inline void scene_add_textures(vt_context *context, vt_tree *tree, int level, int factor, uint64_t seed) {
  vt_rng rng = vt_seed_rng(seed, 3);
  vt_view_textures *textures = &tree->view_textures[level];
  *textures = (vt_view_textures){tree->view_count, factor, VT_NEW(context, vt_view_texture, (size_t)tree->view_count)};
  for (int v = 0; v < tree->view_count; v++) {
    int width = tree->cameras[v].width / factor, height = tree->cameras[v].height / factor;
    uint8_t *codes = VT_NEW(context, uint8_t, (size_t)width * (size_t)height);
    for (int i = 0; i < width * height; i++) codes[i] = (uint8_t)(60 + vt_random(&rng) % 120);
    textures->views[v] = (vt_view_texture){width, height, 0, 0, width, height, codes, false};
  }
}

// R, not ln R, is interpolated between the textures' pixels.
static inline void scene_make_linear(vt_tree *tree, int level) {
  for (int v = 0; v < tree->view_textures[level].view_count; v++) tree->view_textures[level].views[v].linear = true;
}

// Keeps a random rectangle of each texture, sometimes a pixel, a row, a column or nothing.
static inline void scene_cut_textures(vt_tree *tree, int level, vt_rng *rng) {
  for (int v = 0; v < tree->view_count; v++) {
    vt_view_texture *t = &tree->view_textures[level].views[v];
    t->left = (int)(vt_random(rng) % (uint32_t)t->width);
    t->top = (int)(vt_random(rng) % (uint32_t)t->height);
    uint32_t kind = vt_random(rng) % 6;
    t->columns = kind < 2 ? (int)kind : 1 + (int)(vt_random(rng) % (uint32_t)(t->width - t->left));
    t->rows = kind == 0 ? 0 : kind == 2 ? 1 : 1 + (int)(vt_random(rng) % (uint32_t)(t->height - t->top));
  }
}

// A tree of one level, root [-1, 1]^3, without tiles.
static inline vt_tree scene_random_field(vt_context *context, int level, double share, int view_count, uint64_t seed,
                                       bool field, bool textures) {
  vt_tree tree = scene_random_tree(context, level, share, view_count, 1, seed);
  vt_free_tiles(context, &tree.tiles[level]);
  tree.texel_edge = 4;
  if (field) scene_add_field(context, &tree, level, seed);
  if (textures) scene_add_textures(context, &tree, level, 2, seed);
  return tree;
}

// Rays from outside and inside, some along an axis, some along faces or edges of cells, some nearly so.
static inline vt_ray scene_random_ray(vt_rng *rng) {
  double origin[3], direction[3];
  double size = vt_random(rng) % 3 ? 3 : 1;
  for (int a = 0; a < 3; a++) origin[a] = vt_random_between(rng, -size, size);
  for (int a = 0; a < 3; a++) direction[a] = vt_random_between(rng, -1, 1) - 0.3 * origin[a];
  for (int a = 0; a < 3; a++) {
    uint32_t kind = vt_random(rng) % 12;
    if (kind == 0) direction[a] = 0;
    if (kind == 1 || kind == 2) direction[a] *= 1e-6;
    if (kind < 3) origin[a] = floor(vt_random_between(rng, -8, 8)) / 8;
    if (kind == 2) origin[a] += vt_random_between(rng, -1e-6, 1e-6); // goes through that face at the next cells
  }
  vt_vec3 d = {direction[0], direction[1], direction[2]};
  if (!(vt_length(d) > 0.01)) d = vt_v3(0, 0, 1);
  return (vt_ray){{origin[0], origin[1], origin[2]}, vt_normalise(d)};
}

#endif
