// field_checks.h - whether a tree of method best holds numbers that can be, and shows pictures that can be believed
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_FIELD_CHECKS_H
#define VT_TESTS_FIELD_CHECKS_H

#include "base/hash.h"
#include "base/views.h"
#include "octree/octree.h"
#include "tests/unit.h"

static inline uint64_t hash_of_field_tree(const vt_tree *tree) {
  uint64_t hash = 0;
  for (int l = 0; l < tree->octree.level_count; l++) {
    const vt_level *level = &tree->octree.levels[l];
    hash = vt_hash(level->optical_depth, level->cell_count * sizeof(float), hash);
    hash = vt_hash(level->colour, 3 * level->cell_count * sizeof(float), hash);
    hash = vt_hash(level->corner_values, 4 * level->corner_count * sizeof(float), hash);
    for (int v = 0; v < tree->view_textures[l].view_count; v++) {
      const vt_view_texture *t = &tree->view_textures[l].views[v];
      hash = vt_hash(&t->width, 6 * sizeof(int), hash); // width .. rows
      hash = vt_hash(t->codes, (size_t)t->columns * (size_t)t->rows, hash);
    }
  }
  return hash;
}

// Every level has corners and a texture for each photograph, and nothing in it is out of its range.
static inline void check_field(const vt_tree *tree) {
  assert_true(tree->octree.level_count > 0);
  for (int l = 0; l < tree->octree.level_count; l++) {
    const vt_level *level = &tree->octree.levels[l];
    int wrong = 0;
    assert_true(level->cell_count > 0 && level->corner_count > level->cell_count);
    assert_int_equal(tree->view_textures[l].view_count, tree->view_count);
    assert_int_equal(tree->tiles[l].view_count, 0);
    for (uint32_t i = 0; i < level->corner_count; i++) {
      const float *v = level->corner_values + 4 * (size_t)i;
      wrong += !(v[0] >= 0 && v[0] <= 30); // also NaN
      for (int c = 1; c < 4; c++) wrong += !(v[c] >= 0 && v[c] <= 1);
    }
    for (uint32_t i = 0; i < level->cell_count; i++) wrong += !(level->optical_depth[i] >= 0 && level->optical_depth[i] <= 30);
    assert_int_equal(wrong, 0);
  }
}

// Encoded luma of the darkest pixel of the photographs that is more than half there.
static inline double darkest_luma(const vt_views *views) {
  double least = 1;
  for (int v = 0; v < views->count; v++) {
    const vt_image *picture = &views->items[v].picture;
    for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; i++) {
      const uint8_t *p = picture->pixels + 4 * i;
      if (p[3] > 127) least = fmin(least, (0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2]) / 255);
    }
  }
  return least;
}

// No channel of a picture is NaN or out of range. Returns how many pixels that are a quarter there or more are darker than
// `darkest` by more than a tenth of white: black speckles.
static inline int count_speckles(const vt_fimage *picture, double darkest) {
  int wrong = 0, speckles = 0;
  for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; i++) {
    const float *p = picture->pixels + 4 * i;
    wrong += !(p[3] >= 0 && p[3] <= 1.0001f);
    for (int c = 0; c < 3; c++) wrong += !(p[c] >= 0 && p[c] <= p[3] + 1e-4f);
    speckles += p[3] > 0.25f && (0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2]) / p[3] < darkest - 0.1;
  }
  assert_int_equal(wrong, 0);
  return speckles;
}

static inline vt_fimage draw_level(vt_context *context, const vt_tree *tree, int level, int k, const vt_camera *camera) {
  vt_fimage picture;
  vt_view_weights weights = vt_choose_views(tree, vt_camera_centre(camera), k);
  assert_int_equal(vt_composite(context, tree, level, &weights, VT_BLEND_GEOMETRIC, false, camera, &picture), VT_OK);
  return picture;
}

static inline double alpha_error(const vt_fimage *picture, const vt_image *truth) {
  double sum = 0;
  size_t count = (size_t)truth->width * (size_t)truth->height;
  assert_true(picture->width == truth->width && picture->height == truth->height);
  for (size_t i = 0; i < count; i++) {
    double e = (double)picture->pixels[4 * i + 3] - truth->pixels[4 * i + 3] / 255.0;
    sum += e * e;
  }
  return sqrt(sum / (double)count);
}

#endif
