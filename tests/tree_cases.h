// tree_cases.h - small trees with every feature of the .vtree file, and the means to damage their bytes on purpose
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_TREE_CASES_H
#define VT_TESTS_TREE_CASES_H

#include "base/hash.h"
#include "base/rng.h"
#include "octree/octree.h"
#include <math.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct tree_case {
  const char *name;
  int branching, level_count, texel_edge, view_count;
  bool packed;
  bool orphans; // the finest level has cells without a parent
  bool shuffled; // tiles are not numbered as the file numbers them
  int empty_from; // levels from here on have no cells
  bool corners, views; // from level 1 or 2 on, instead of tiles
  int field_codewords; // if packed
} tree_case;

static const tree_case tree_cases[] = {
    {"raw", 2, 4, 4, 3, false, false, false, 99, false, false, 0},
    {"packed", 2, 4, 4, 3, true, false, false, 99, false, false, 0},
    {"trigrid", 3, 3, 8, 1, false, false, false, 99, false, false, 0},
    {"packed_trigrid", 3, 3, 8, 2, true, false, true, 99, false, false, 0},
    {"orphans", 2, 4, 4, 2, false, true, true, 99, false, false, 0},
    {"no_views", 2, 3, 4, 0, true, false, false, 99, false, false, 0},
    {"empty_levels", 2, 4, 4, 2, true, false, true, 2, false, false, 0},
    {"nothing", 2, 1, 4, 1, false, false, false, 0, false, false, 0},
    {"field", 2, 4, 4, 3, false, false, false, 99, true, true, 0},
    {"packed_field", 2, 4, 4, 3, true, false, false, 99, true, true, 40},
    {"textured_cells", 2, 4, 4, 2, true, true, false, 99, false, true, 300},
    {"corners_alone", 3, 3, 8, 1, true, false, false, 2, true, false, 257},
};
#define TREE_CASE_COUNT ((int)(sizeof tree_cases / sizeof tree_cases[0]))

static inline uint8_t *random_bytes(vt_context *context, vt_rng *rng, size_t count, unsigned below) {
  uint8_t *bytes = VT_NEW(context, uint8_t, count);
  for (size_t i = 0; i < count; i++) bytes[i] = (uint8_t)(vt_random(rng) % below);
  return bytes;
}

static inline void fill_level(vt_context *context, vt_rng *rng, const tree_case *c, int l, vt_tree *tree) {
  vt_level *level = &tree->octree.levels[l];
  static uint16_t xyz[4096][3]; // enough for all cases
  size_t count = 0;
  if (l == 0 && c->empty_from > 0) memset(xyz[count++], 0, sizeof xyz[0]);
  for (uint32_t p = 0; l > 0 && l < c->empty_from && p < level[-1].cell_count; p++) {
    if (c->orphans && p % 3 == 0) continue;
    for (int d = 0; d < c->branching * c->branching * c->branching; d++) {
      if (vt_random(rng) % (c->branching == 2 ? 2 : 4) != 0) continue;
      xyz[count][0] = (uint16_t)(level[-1].x[p] * c->branching + d % c->branching);
      xyz[count][1] = (uint16_t)(level[-1].y[p] * c->branching + d / c->branching % c->branching);
      xyz[count++][2] = (uint16_t)(level[-1].z[p] * c->branching + d / c->branching / c->branching);
    }
  }
  if (c->orphans && l == 3) { // the last corner, whose parent does not exist as its grandparent has no child there
    uint32_t there = vt_find_cell(&level[-1], 2, 3, 3, 3);
    if (there == VT_NO_CELL) xyz[count][0] = xyz[count][1] = xyz[count][2] = 7, count++;
  }
  VT_ASSERT(vt_make_level(context, c->branching, l, count, (const uint16_t(*)[3])xyz, level) == VT_OK);
  for (uint32_t i = 0; i < level->cell_count; i++) {
    level->optical_depth[i] = vt_random(rng) % 8 == 0 ? 0 : (float)(0.001 + 3 * vt_random_unit(rng));
    for (int k = 0; k < 3; k++) level->colour[3 * i + (uint32_t)k] = (float)(vt_random(rng) % 256) / 255;
  }
}

static inline void fill_tiles(vt_context *context, vt_rng *rng, const tree_case *c, int l, vt_tree *tree) {
  vt_tiles *tiles = &tree->tiles[l];
  if (c->view_count == 0 || l == 1) return; // a level without textures among others that have them
  *tiles = (vt_tiles){.view_count = c->view_count, .cell_count = tree->octree.levels[l].cell_count};
  size_t pairs = (size_t)tiles->view_count * tiles->cell_count;
  tiles->tile_of = VT_NEW(context, uint32_t, pairs);
  for (size_t i = 0; i < pairs; i++) tiles->tile_of[i] = vt_random(rng) % 3 == 0 ? VT_NO_TILE : tiles->tile_count++;
  for (size_t i = 0; c->shuffled && i < pairs; i++)
    if (tiles->tile_of[i] != VT_NO_TILE) tiles->tile_of[i] = tiles->tile_count - 1 - tiles->tile_of[i];
  size_t texels = (size_t)(c->texel_edge * c->texel_edge) * tiles->tile_count;
  if (!c->packed) {
    tiles->texels = random_bytes(context, rng, texels * 4, 9); // few values, so that they pack
    return;
  }
  tiles->alpha_code = VT_NEW(context, uint16_t, tiles->tile_count);
  tiles->colour_code = VT_NEW(context, uint16_t, tiles->tile_count);
  for (uint32_t i = 0; i < tiles->tile_count; i++) {
    tiles->alpha_code[i] = (uint16_t)(vt_random(rng) % 7);
    tiles->colour_code[i] = (uint16_t)(vt_random(rng) % 260);
  }
}

// Corners' values from few depths, so that they pack; colours from the codebook if there is one.
static inline void fill_corners(vt_context *context, vt_rng *rng, const tree_case *c, int l, vt_tree *tree) {
  vt_level *level = &tree->octree.levels[l];
  const vt_codebook *book = &tree->field_codebook;
  if (c->corners && l > 0) VT_ASSERT(vt_make_corners(context, c->branching, level) == VT_OK);
  size_t count = level->corner_count ? level->corner_count : level->cell_count;
  for (size_t i = 0; i < count; i++) {
    float *colour = level->corner_count ? level->corner_values + 4 * i + 1 : level->colour + 3 * i;
    if (level->corner_count) colour[-1] = vt_random(rng) % 4 == 0 ? 0 : ldexpf(1, -(int)(vt_random(rng) % 7));
    for (size_t k = 0, word = vt_random(rng); k < 3; k++)
      colour[k] = book->codeword_count ? (float)book->codewords[word % (size_t)book->codeword_count * 3 + k] / 255
                  : level->corner_count ? (float)vt_random_unit(rng)
                                        : (float)(vt_random(rng) % 256) / 255;
  }
  if (level->corner_count) vt_cells_from_corners(level);
}

// The second view keeps nothing, the others a part.
static inline void fill_views(vt_context *context, vt_rng *rng, const tree_case *c, int l, vt_tree *tree) {
  vt_view_textures *textures = &tree->view_textures[l];
  if (!c->views || l < 2) return;
  *textures = (vt_view_textures){c->view_count, 32 >> l, VT_NEW(context, vt_view_texture, (size_t)c->view_count)};
  for (int v = 0; v < c->view_count; v++) {
    vt_view_texture t = {.width = 20 * l + v, .height = 15 * l, .left = 3 * v, .top = 7, .columns = 11 + v, .rows = 5};
    if (v == 1) t.left = t.top = t.columns = t.rows = 0;
    t.codes = random_bytes(context, rng, (size_t)(t.columns * t.rows), 5);
    textures->views[v] = t;
  }
}

static inline bool has_field(const tree_case *c) { return c->corners || c->views; }

// The same tree for ever: the golden files hold it.
static inline void make_tree(vt_context *context, const tree_case *c, vt_tree *tree) {
  vt_rng rng = vt_seed_rng(2006, (uint64_t)(c - tree_cases));
  *tree = (vt_tree){.texel_edge = c->texel_edge, .tile_side = 1.25f, .view_count = c->view_count};
  tree->octree = (vt_octree){.origin = {-1.5, 0.25, 1e-3}, .edge = 3.7, .branching = c->branching,
                             .level_count = c->level_count};
  tree->metadata = vt_strdup(context, "{\"source\": \"a tree_case\"}\n");
  tree->cameras = VT_NEW(context, vt_camera, (size_t)c->view_count);
  for (int v = 0; v < c->view_count; v++) { // by quarter turns about z: exact in every maths library
    double cosine = v % 2 ? 0 : 1, sine = v % 2 ? 1 : 0;
    tree->cameras[v] = (vt_camera){.width = 640 + v, .height = 480, .fx = 500.5, .fy = 501, .cx = 320, .cy = 240.25 - v,
                                   .rotation = {{cosine, sine, 0, 0 - sine, cosine, 0, 0, 0, 1}},
                                   .translation = {0.1 * v, -0.2, 5}};
  }
  if (c->packed && has_field(c)) {
    uint8_t *words = random_bytes(context, &rng, 3 * (size_t)c->field_codewords, 256);
    for (int i = 0; i < c->field_codewords; i++) words[3 * i] = (uint8_t)(i / 2), words[3 * i + 1] = (uint8_t)(i % 2 ? 255 : 7);
    tree->field_codebook = (vt_codebook){c->field_codewords, 3, words};
  } else if (c->packed) {
    size_t texels = (size_t)(c->texel_edge * c->texel_edge);
    tree->alpha_codebook = (vt_codebook){7, 1, random_bytes(context, &rng, 7 * texels, 256)};
    tree->colour_codebook = (vt_codebook){260, 3, random_bytes(context, &rng, 260 * texels * 3, 4)};
  }
  for (int l = 0; l < c->level_count; l++) {
    fill_level(context, &rng, c, l, tree);
    if (has_field(c)) {
      fill_corners(context, &rng, c, l, tree);
      fill_views(context, &rng, c, l, tree);
    } else {
      fill_tiles(context, &rng, c, l, tree);
    }
  }
}

// ---- bytes of a file, as docs/format.md has them
static inline uint64_t get_number(const uint8_t *p, int bytes) {
  uint64_t v = 0;
  for (int i = bytes; i-- > 0;) v = v << 8 | p[i];
  return v;
}
static inline void put_number(uint8_t *p, int bytes, uint64_t v) {
  for (int i = 0; i < bytes; i++) p[i] = (uint8_t)(v >> 8 * i);
}
static inline size_t chunk_count(const uint8_t *file) { return (size_t)get_number(file + 12, 4); }
static inline uint8_t *chunk_entry(uint8_t *file, size_t i) { return file + 24 + 32 * i; }

// Makes length and checksums true as far as the table allows, so that damage gets past them.
static inline void mend_checksums(uint8_t *file, size_t size) {
  if (size < 32) return;
  put_number(file + 16, 8, size);
  size_t count = chunk_count(file);
  if (count > (size - 32) / 32) return;
  size_t at = 24 + 32 * count + 8;
  for (size_t i = 0; i < count; i++) {
    uint8_t *entry = chunk_entry(file, i);
    uint64_t stored = get_number(entry + 8, 8);
    if (stored > size - at) break;
    put_number(entry + 24, 8, vt_hash(file + at, (size_t)stored, 0));
    at += (size_t)stored;
  }
  put_number(file + 24 + 32 * count, 8, vt_hash(file, 24 + 32 * count, 0));
}

#ifdef __cplusplus
}
#endif
#endif
