// render_scenes.h - small trees made by hand for the tests of compositing and rendering
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_RENDER_SCENES_H
#define VT_TESTS_RENDER_SCENES_H

#include "base/rng.h"
#include "octree/octree.h"
#include "tests/unit.h"

static inline vt_context *scene_context(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads;
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

// A tree with cells on one level only, a tile of its own for every view and cell (texels zero), root [-1, 1]^3.
static inline vt_tree scene_tree(vt_context *context, int level, size_t count, const uint16_t (*xyz)[3], int view_count,
                                 const vt_camera *cameras, int texel_edge) {
  vt_tree tree = {.texel_edge = texel_edge, .tile_side = 1.5f, .view_count = view_count};
  tree.octree = (vt_octree){.origin = {-1, -1, -1}, .edge = 2, .branching = 2, .level_count = level + 1};
  assert_int_equal(vt_make_level(context, 2, level, count, xyz, &tree.octree.levels[level]), VT_OK);
  tree.metadata = vt_strdup(context, "{}");
  if (!view_count) return tree;
  tree.cameras = VT_NEW(context, vt_camera, (size_t)view_count);
  memcpy(tree.cameras, cameras, sizeof *cameras * (size_t)view_count);
  vt_tiles *tiles = &tree.tiles[level];
  *tiles = (vt_tiles){.view_count = view_count, .cell_count = (uint32_t)count,
                      .tile_count = (uint32_t)(count * (size_t)view_count)};
  tiles->tile_of = VT_NEW(context, uint32_t, tiles->tile_count);
  tiles->texels = vt_alloc(context, tiles->tile_count, (size_t)(4 * texel_edge * texel_edge));
  for (uint32_t i = 0; i < tiles->tile_count; i++) tiles->tile_of[i] = i;
  return tree;
}

static inline uint8_t *scene_texel(vt_tree *tree, int level, int view, uint32_t cell, int x, int y) {
  vt_tiles *tiles = &tree->tiles[level];
  size_t n = (size_t)tree->texel_edge, tile = tiles->tile_of[(size_t)view * tiles->cell_count + cell];
  return tiles->texels + 4 * ((tile * n + (size_t)y) * n + (size_t)x);
}

static inline void scene_paint(vt_tree *tree, int level, int view, uint32_t cell, int r, int g, int b, int a) {
  for (int y = 0; y < tree->texel_edge; y++)
    for (int x = 0; x < tree->texel_edge; x++) {
      uint8_t *t = scene_texel(tree, level, view, cell, x, y);
      t[0] = (uint8_t)r, t[1] = (uint8_t)g, t[2] = (uint8_t)b, t[3] = (uint8_t)a;
    }
}

static inline vt_camera scene_camera(double x, double y, double z, int size) {
  return vt_look_at(vt_v3(x, y, z), vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.8, size, size);
}

// Cameras on a ring around the tree, slightly above.
static inline void scene_ring(int count, vt_camera *out) {
  for (int i = 0; i < count; i++) {
    double t = 2 * VT_PI * (i + 0.3) / count;
    out[i] = scene_camera(3.5 * cos(t), 3.5 * sin(t), 0.8 + 0.3 * sin(3 * t), 160);
    out[i].fy *= 1 + 0.02 * i;
    out[i].cx -= i;
  }
}

// About `share` of the cells within the unit ball of a level, with random smooth tiles, some of them missing.
static inline vt_tree scene_random_tree(vt_context *context, int level, double share, int view_count, int texel_edge,
                                        uint64_t seed) {
  vt_rng rng = vt_seed_rng(seed, 1);
  int n = 1 << level;
  uint16_t(*xyz)[3] = vt_alloc(context, (size_t)n * (size_t)n * (size_t)n, sizeof *xyz);
  size_t count = 0;
  for (int z = 0; z < n; z++)
    for (int y = 0; y < n; y++)
      for (int x = 0; x < n; x++) {
        vt_vec3 p = vt_scale(vt_v3(x + 0.5 - 0.5 * n, y + 0.5 - 0.5 * n, z + 0.5 - 0.5 * n), 2.0 / n);
        if (vt_length(p) > 1 || vt_random_unit(&rng) > share) continue;
        xyz[count][0] = (uint16_t)x, xyz[count][1] = (uint16_t)y, xyz[count][2] = (uint16_t)z;
        count++;
      }
  vt_camera cameras[64];
  scene_ring(view_count, cameras);
  vt_tree tree = scene_tree(context, level, count, (const uint16_t(*)[3])xyz, view_count, cameras, texel_edge);
  vt_free(context, xyz);
  vt_level *l = &tree.octree.levels[level];
  for (uint32_t i = 0; i < l->cell_count; i++) {
    l->optical_depth[i] = (float)vt_random_between(&rng, 0, 3);
    for (int c = 0; c < 3; c++) l->colour[3 * i + (uint32_t)c] = (float)vt_random_unit(&rng);
  }
  for (int v = 0; v < view_count; v++)
    for (uint32_t i = 0; i < l->cell_count; i++) {
      for (int y = 0; y < texel_edge; y++)
        for (int x = 0; x < texel_edge; x++) {
          uint8_t *t = scene_texel(&tree, level, v, i, x, y);
          for (int c = 0; c < 3; c++) t[c] = (uint8_t)(vt_random(&rng) & 255);
          uint32_t kind = vt_random(&rng) & 7;
          t[3] = (uint8_t)(kind == 0 ? 0 : kind == 1 ? 255 : vt_random(&rng) & 255);
        }
      if ((vt_random(&rng) & 7) == 0) tree.tiles[level].tile_of[(size_t)v * l->cell_count + i] = VT_NO_TILE;
    }
  return tree;
}

// A random tree whose level has a field at its corners, textures in the views' picture planes, or both, and no tiles. A third
// of the ball is empty; the first view keeps nothing of its picture, the others a part. Codes crowd around R = 1.
static inline vt_tree scene_field_tree(vt_context *context, int level, double share, int view_count, bool corners, bool views,
                                       uint64_t seed) {
  vt_tree tree = scene_random_tree(context, level, share, view_count, 4, seed);
  vt_rng rng = vt_seed_rng(seed, 2);
  vt_level *l = &tree.octree.levels[level];
  vt_free_tiles(context, &tree.tiles[level]);
  for (int i = 0; i < level; i++) // coarser levels without cells, as a file has them
    assert_int_equal(vt_make_level(context, 2, i, 0, NULL, &tree.octree.levels[i]), VT_OK);
  for (uint32_t i = 0; i < l->cell_count; i++)
    if (3 * l->x[i] < l->axis_cells) l->optical_depth[i] = 0;
  if (corners) {
    assert_int_equal(vt_make_corners(context, 2, l), VT_OK);
    assert_int_equal(vt_corners_from_cells(context, l), VT_OK);
    vt_cells_from_corners(l);
  }
  if (!views) return tree;
  vt_view_textures *textures = &tree.view_textures[level];
  *textures = (vt_view_textures){view_count, 2, VT_NEW(context, vt_view_texture, (size_t)view_count)};
  for (int v = 0; v < view_count; v++) {
    vt_view_texture *t = &textures->views[v];
    t->width = (tree.cameras[v].width + 1) / 2, t->height = (tree.cameras[v].height + 1) / 2;
    if (v > 0) t->left = t->width / 8, t->top = t->height / 8, t->columns = 3 * t->width / 4, t->rows = 3 * t->height / 4;
    t->codes = VT_NEW(context, uint8_t, (size_t)(t->columns * t->rows));
    for (int i = 0; i < t->columns * t->rows; i++) {
      double r = vt_random_between(&rng, -1, 1), s = vt_random_between(&rng, 0, 1);
      t->codes[i] = (uint8_t)(127.5 + 127.4 * r * s * s);
    }
  }
  return tree;
}

// Packs the tiles of a level without loss: every tile its own codewords (at most 65536 tiles).
static inline void scene_pack(vt_context *context, vt_tree *tree, int level) {
  vt_tiles *tiles = &tree->tiles[level];
  size_t texels = (size_t)(tree->texel_edge * tree->texel_edge), all = tiles->tile_count * texels;
  assert_true(tiles->tile_count <= 65536);
  tree->alpha_codebook = (vt_codebook){(int)tiles->tile_count, 1, VT_NEW(context, uint8_t, all)};
  tree->colour_codebook = (vt_codebook){(int)tiles->tile_count, 3, VT_NEW(context, uint8_t, 3 * all)};
  tiles->alpha_code = VT_NEW(context, uint16_t, tiles->tile_count);
  tiles->colour_code = VT_NEW(context, uint16_t, tiles->tile_count);
  for (uint32_t t = 0; t < tiles->tile_count; t++) {
    uint32_t other = tiles->tile_count - 1 - t; // the two codes of a tile differ
    tiles->alpha_code[t] = (uint16_t)t;
    tiles->colour_code[t] = (uint16_t)other;
    for (size_t i = 0; i < texels; i++) {
      const uint8_t *texel = tiles->texels + 4 * (t * texels + i);
      tree->alpha_codebook.codewords[t * texels + i] = texel[3];
      memcpy(tree->colour_codebook.codewords + 3 * (other * texels + i), texel, 3);
    }
  }
  vt_free(context, tiles->texels);
  tiles->texels = NULL;
}

// The same camera, and tree with its cameras, in another unit and elsewhere in the world.
static inline void scene_move_camera(vt_camera *camera, double scale, vt_vec3 shift) {
  vt_vec3 eye = vt_add(vt_scale(vt_camera_centre(camera), scale), shift);
  camera->translation = vt_scale(vt_mul(&camera->rotation, eye), -1);
}

static inline void scene_move(vt_tree *tree, double scale, vt_vec3 shift) {
  tree->octree.origin = vt_add(vt_scale(tree->octree.origin, scale), shift);
  tree->octree.edge *= scale;
  for (int i = 0; i < tree->view_count; i++) scene_move_camera(&tree->cameras[i], scale, shift);
}

static inline const float *scene_pixel(const vt_fimage *image, int x, int y) {
  return image->pixels + 4 * ((size_t)y * (size_t)image->width + (size_t)x);
}

// Mean and largest absolute difference of two pictures, all channels.
static inline double scene_difference(const vt_fimage *a, const vt_fimage *b, double *largest) {
  assert_true(a->width == b->width && a->height == b->height);
  double sum = 0, most = 0;
  size_t count = 4 * (size_t)a->width * (size_t)a->height;
  for (size_t i = 0; i < count; i++) {
    double d = fabs((double)a->pixels[i] - (double)b->pixels[i]);
    sum += d;
    if (!(d <= most)) most = d;
  }
  if (largest) *largest = most;
  return sum / (double)count;
}

// Where a ray is within the cube [low, low + edge]^3, in world units. False if nowhere.
static inline bool scene_slab(const vt_ray *ray, vt_vec3 low, double edge, double *enter, double *leave) {
  double o[3] = {ray->origin.x, ray->origin.y, ray->origin.z};
  double d[3] = {ray->direction.x, ray->direction.y, ray->direction.z}, l[3] = {low.x, low.y, low.z};
  *enter = 0;
  *leave = INFINITY;
  for (int a = 0; a < 3; a++) {
    if (fabs(d[a]) < 1e-12) {
      if (o[a] < l[a] || o[a] >= l[a] + edge) return false;
      continue;
    }
    double t0 = (l[a] - o[a]) / d[a], t1 = (l[a] + edge - o[a]) / d[a];
    *enter = fmax(*enter, fmin(t0, t1));
    *leave = fmin(*leave, fmax(t0, t1));
  }
  return *leave > *enter;
}

#endif
