// tree.c - the tree as a whole: freeing, copying, sizes
// SPDX-License-Identifier: BSD-3-Clause

#include "octree/cells.h"

#include <string.h>

bool vt_is_packed(const vt_tree *tree) { return tree->alpha_codebook.codeword_count > 0; }

void vt_free_tree(vt_context *context, vt_tree *tree) {
  vt_free_octree(context, &tree->octree);
  for (int i = 0; i <= VT_MAX_LEVEL; i++) vt_free_tiles(context, &tree->tiles[i]);
  vt_free(context, tree->cameras);
  vt_free(context, tree->alpha_codebook.codewords);
  vt_free(context, tree->colour_codebook.codewords);
  vt_free(context, tree->metadata);
  *tree = (vt_tree){0};
}

uint64_t vt_texture_bytes(const vt_tree *tree) {
  uint64_t texels = (uint64_t)(tree->texel_edge * tree->texel_edge), tiles = 0;
  for (int i = 0; i <= VT_MAX_LEVEL; i++) tiles += tree->tiles[i].tile_count;
  if (!vt_is_packed(tree)) return tiles * texels * 4;
  return tiles * 4 + texels * ((uint64_t)tree->alpha_codebook.codeword_count +
                               3 * (uint64_t)tree->colour_codebook.codeword_count);
}

static vt_status copy_octree(vt_context *context, const vt_octree *in, vt_octree *out) {
  *out = *in;
  memset(out->levels, 0, sizeof out->levels);
  for (int i = 0; i < in->level_count; i++) {
    vt_status status = vt_filter_level(context, in->branching, i, &in->levels[i], NULL, &out->levels[i]);
    if (status) return status;
  }
  return VT_OK;
}

vt_status vt_copy_tree_without_tiles(vt_context *context, const vt_tree *in, vt_tree *out) {
  *out = (vt_tree){.texel_edge = in->texel_edge, .tile_side = in->tile_side, .view_count = in->view_count};
  vt_status status = copy_octree(context, &in->octree, &out->octree);
  out->cameras = VT_NEW(context, vt_camera, (size_t)in->view_count);
  out->metadata = vt_strdup(context, in->metadata ? in->metadata : "{}");
  if (!status && (!out->cameras || !out->metadata)) status = VT_OUT_OF_MEMORY;
  if (status)
    vt_free_tree(context, out);
  else
    memcpy(out->cameras, in->cameras, (size_t)in->view_count * sizeof *in->cameras);
  return status;
}
