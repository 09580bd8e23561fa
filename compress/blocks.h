// blocks.h - billboard tiles as vectors, and codewords as texels
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_COMPRESS_BLOCKS_H
#define VT_COMPRESS_BLOCKS_H

#include "compress/compress.h"

// A texel below this alpha (2 % of 255) shows nothing of its colour.
#define VT_VISIBLE_ALPHA 6

// All tiles of a tree, numbered through its levels, coarse first.
typedef struct vt_blocks {
  const vt_tree *tree;              // not owned
  uint64_t first[VT_MAX_LEVEL + 2]; // number of a level's first tile; the last one is the number of tiles
  int level_count;
  size_t texel_count; // of a tile
  bool in_lab;        // colour vectors are CIELab; else sRGB 0..255
  float linear[256];
} vt_blocks;

vt_blocks vt_make_blocks(const vt_tree *, bool in_lab);
int vt_block_level(const vt_blocks *, uint64_t block);
const uint8_t *vt_block_texels(const vt_blocks *, uint64_t block); // RGBA

typedef enum vt_block_alpha { VT_BLOCK_TRANSPARENT, VT_BLOCK_MIXED, VT_BLOCK_OPAQUE } vt_block_alpha;
// Alpha 0..255 to vector[texel_count]; whether it is all 0 or all 255.
vt_block_alpha vt_gather_alpha(const vt_blocks *, const uint8_t *texels, float *vector);
// Colours to vector[3 * texel_count]; texels that do not show get the alpha-weighted mean of those that do. Returns the
// mean alpha 0..1; 0: nothing to see, the vector is zero.
float vt_gather_colour(const vt_blocks *, const uint8_t *texels, float *vector);

// A codeword rounded to what is stored, and the vector that this stands for.
void vt_store_alpha_codeword(const vt_blocks *, const float *vector, uint8_t *alpha);
void vt_store_colour_codeword(const vt_blocks *, const float *vector, uint8_t *rgb);
void vt_load_alpha_codeword(const vt_blocks *, const uint8_t *alpha, float *vector);
void vt_load_colour_codeword(const vt_blocks *, const uint8_t *rgb, float *vector);

#endif
