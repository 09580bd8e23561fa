// tree.c - the tree as a whole: freeing, copying, sizes
// SPDX-License-Identifier: BSD-3-Clause

#include "octree/cells.h"

#include <string.h>

bool vt_is_packed(const vt_tree *tree) {
  return tree->alpha_codebook.codeword_count > 0 || tree->field_codebook.codeword_count > 0;
}

bool vt_has_textures(const vt_tree *tree, int level) {
  return tree->tiles[level].view_count > 0 || tree->view_textures[level].view_count > 0;
}

void vt_free_view_textures(vt_context *context, vt_view_textures *textures) {
  for (int v = 0; v < textures->view_count; v++) vt_free(context, textures->views[v].codes);
  vt_free(context, textures->views);
  *textures = (vt_view_textures){0};
}

uint64_t vt_count_view_pixels(const vt_view_textures *textures) {
  uint64_t sum = 0;
  for (int v = 0; v < textures->view_count; v++)
    sum += (uint64_t)textures->views[v].columns * (uint64_t)textures->views[v].rows;
  return sum;
}

void vt_free_tree(vt_context *context, vt_tree *tree) {
  vt_free_octree(context, &tree->octree);
  for (int i = 0; i <= VT_MAX_LEVEL; i++) vt_free_tiles(context, &tree->tiles[i]);
  for (int i = 0; i <= VT_MAX_LEVEL; i++) vt_free_view_textures(context, &tree->view_textures[i]);
  vt_free(context, tree->cameras);
  vt_free(context, tree->alpha_codebook.codewords);
  vt_free(context, tree->colour_codebook.codewords);
  vt_free(context, tree->field_codebook.codewords);
  vt_free(context, tree->metadata);
  *tree = (vt_tree){0};
}

uint64_t vt_texture_bytes(const vt_tree *tree) {
  uint64_t texels = (uint64_t)(tree->texel_edge * tree->texel_edge), tiles = 0;
  uint64_t view_bytes = 3 * (uint64_t)tree->field_codebook.codeword_count;
  for (int i = 0; i <= VT_MAX_LEVEL; i++) {
    tiles += tree->tiles[i].tile_count;
    view_bytes += vt_count_view_pixels(&tree->view_textures[i]);
  }
  if (!tree->alpha_codebook.codeword_count) return view_bytes + tiles * texels * 4;
  return view_bytes + tiles * 4 + texels * ((uint64_t)tree->alpha_codebook.codeword_count +
                               3 * (uint64_t)tree->colour_codebook.codeword_count);
}

static vt_status copy_corners(vt_context *context, const vt_level *in, vt_level *out) {
  if (!in->corner_count) return VT_OK;
  size_t links = 8 * (size_t)in->cell_count, values = 4 * (size_t)in->corner_count;
  out->corner_of = VT_NEW(context, uint32_t, links);
  out->corner_values = VT_NEW(context, float, values);
  if (!out->corner_of || !out->corner_values) return VT_OUT_OF_MEMORY;
  out->corner_count = in->corner_count;
  memcpy(out->corner_of, in->corner_of, links * sizeof *in->corner_of);
  memcpy(out->corner_values, in->corner_values, values * sizeof *in->corner_values);
  return VT_OK;
}

static vt_status copy_octree(vt_context *context, const vt_octree *in, vt_octree *out) {
  *out = *in;
  memset(out->levels, 0, sizeof out->levels);
  for (int i = 0; i < in->level_count; i++) {
    vt_status status = vt_filter_level(context, in->branching, i, &in->levels[i], NULL, &out->levels[i]);
    if (!status) status = copy_corners(context, &in->levels[i], &out->levels[i]);
    if (status) return status;
  }
  return VT_OK;
}

static vt_status copy_view_textures(vt_context *context, const vt_view_textures *in, vt_view_textures *out) {
  if (!in->view_count) return VT_OK;
  out->views = VT_NEW(context, vt_view_texture, (size_t)in->view_count);
  if (!out->views) return VT_OUT_OF_MEMORY;
  out->view_count = in->view_count, out->factor = in->factor;
  for (int v = 0; v < in->view_count; v++) {
    size_t size = (size_t)in->views[v].columns * (size_t)in->views[v].rows;
    out->views[v] = in->views[v];
    out->views[v].codes = VT_NEW(context, uint8_t, size);
    if (!out->views[v].codes) return VT_OUT_OF_MEMORY; // the views behind it have none yet
    if (size) memcpy(out->views[v].codes, in->views[v].codes, size);
  }
  return VT_OK;
}

vt_status vt_copy_tree_without_tiles(vt_context *context, const vt_tree *in, vt_tree *out) {
  *out = (vt_tree){.texel_edge = in->texel_edge, .tile_side = in->tile_side, .view_count = in->view_count};
  vt_status status = copy_octree(context, &in->octree, &out->octree);
  for (int l = 0; !status && l < in->octree.level_count; l++)
    status = copy_view_textures(context, &in->view_textures[l], &out->view_textures[l]);
  out->cameras = VT_NEW(context, vt_camera, (size_t)in->view_count);
  out->metadata = vt_strdup(context, in->metadata ? in->metadata : "{}");
  if (!status && (!out->cameras || !out->metadata)) status = VT_OUT_OF_MEMORY;
  if (status)
    vt_free_tree(context, out);
  else
    memcpy(out->cameras, in->cameras, (size_t)in->view_count * sizeof *in->cameras);
  return status;
}
