// blocks.c - billboard tiles as vectors, and codewords as texels
// SPDX-License-Identifier: BSD-3-Clause
//
// A transparent texel has no colour, whatever is stored there (mostly black). If it entered a codeword, the codeword
// would darken, and where a tile of another alpha uses the same codeword the black would show. LRMDM06 let the
// brightest pixel decide; here such texels take the mean colour of their tile, weighted by alpha, before training and
// encoding, so that no black exists that could leak.

#include "compress/blocks.h"
#include "base/lab.h"
#include <math.h>
#include <string.h>

vt_blocks vt_make_blocks(const vt_tree *tree, bool in_lab) {
  vt_blocks b = {.tree = tree, .level_count = tree->octree.level_count, .in_lab = in_lab};
  b.texel_count = (size_t)tree->texel_edge * (size_t)tree->texel_edge;
  for (int l = 0; l < b.level_count; l++) b.first[l + 1] = b.first[l] + tree->tiles[l].tile_count;
  vt_fill_srgb_table(b.linear);
  return b;
}

int vt_block_level(const vt_blocks *b, uint64_t block) {
  int level = 0;
  while (block >= b->first[level + 1]) level++;
  return level;
}

const uint8_t *vt_block_texels(const vt_blocks *b, uint64_t block) {
  int level = vt_block_level(b, block);
  return b->tree->tiles[level].texels + (size_t)(block - b->first[level]) * b->texel_count * 4;
}

vt_block_alpha vt_gather_alpha(const vt_blocks *b, const uint8_t *texels, float *vector) {
  int any = 0, all = 255;
  for (size_t t = 0; t < b->texel_count; t++) {
    int alpha = texels[4 * t + 3];
    any |= alpha;
    all &= alpha;
    vector[t] = (float)alpha;
  }
  return !any ? VT_BLOCK_TRANSPARENT : all == 255 ? VT_BLOCK_OPAQUE : VT_BLOCK_MIXED;
}

float vt_gather_colour(const vt_blocks *b, const uint8_t *texels, float *vector) {
  int sum_all = 0, sum_visible = 0, hidden = 0;
  for (size_t t = 0; t < b->texel_count; t++) {
    int alpha = texels[4 * t + 3];
    bool visible = alpha >= VT_VISIBLE_ALPHA;
    sum_all += alpha;
    sum_visible += visible ? alpha : 0;
    hidden += !visible;
  }
  if (!sum_all) {
    memset(vector, 0, 3 * b->texel_count * sizeof *vector);
    return 0;
  }
  if (b->in_lab)
    vt_lab_from_bytes(b->linear, texels, 4, b->texel_count, vector);
  else
    for (size_t t = 0; t < b->texel_count; t++)
      for (size_t c = 0; c < 3; c++) vector[3 * t + c] = (float)texels[4 * t + c];
  if (!hidden) return (float)sum_all / (255 * (float)b->texel_count);
  int least = sum_visible ? VT_VISIBLE_ALPHA : 1; // nothing but faint texels: their own mean
  float mean[3] = {0}, weight = (float)(sum_visible ? sum_visible : sum_all);
  for (size_t t = 0; t < b->texel_count; t++)
    if (texels[4 * t + 3] >= least)
      for (size_t c = 0; c < 3; c++) mean[c] += vector[3 * t + c] * ((float)texels[4 * t + 3] / weight);
  for (size_t t = 0; t < b->texel_count; t++)
    if (texels[4 * t + 3] < VT_VISIBLE_ALPHA) memcpy(vector + 3 * t, mean, sizeof mean);
  return (float)sum_all / (255 * (float)b->texel_count);
}

static uint8_t to_byte(float v) {
  return (uint8_t)(v <= 0 ? 0 : v >= 255 ? 255 : (int)(v + 0.5f));
}

void vt_store_alpha_codeword(const vt_blocks *b, const float *vector, uint8_t *alpha) {
  for (size_t t = 0; t < b->texel_count; t++) alpha[t] = to_byte(vector[t]);
}

void vt_store_colour_codeword(const vt_blocks *b, const float *vector, uint8_t *rgb) {
  for (size_t t = 0; t < b->texel_count; t++) {
    float srgb[3];
    if (b->in_lab) vt_srgb_from_lab(vector + 3 * t, srgb);
    for (size_t c = 0; c < 3; c++) rgb[3 * t + c] = to_byte(b->in_lab ? 255 * srgb[c] : vector[3 * t + c]);
  }
}

void vt_load_alpha_codeword(const vt_blocks *b, const uint8_t *alpha, float *vector) {
  for (size_t t = 0; t < b->texel_count; t++) vector[t] = (float)alpha[t];
}

void vt_load_colour_codeword(const vt_blocks *b, const uint8_t *rgb, float *vector) {
  if (b->in_lab)
    vt_lab_from_bytes(b->linear, rgb, 3, b->texel_count, vector);
  else
    for (size_t i = 0; i < 3 * b->texel_count; i++) vector[i] = (float)rgb[i];
}
