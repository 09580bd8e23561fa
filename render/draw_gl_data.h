// draw_gl_data.h - what the OpenGL renderer uploads, as plain arrays
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RENDER_DRAW_GL_DATA_H
#define VT_RENDER_DRAW_GL_DATA_H

#include "render/draw_list.h"

#ifdef __cplusplus
extern "C" {
#endif

// All arrays are the caller's, to be freed; NULL: no memory.
uint16_t (*vt_gl_places(vt_context *, const vt_level *))[4];          // [cell_count] x, y, z, 0
float (*vt_gl_looks(vt_context *, const vt_level *))[4];              // [cell_count] RGB, optical depth
uint32_t *vt_gl_tile_codes(vt_context *, const vt_tiles *);           // [tile_count] colour code << 16 | alpha code
// [view_count][cell_count] of a level with a grid: tile number, and in its upper four bits the column and the row of the
// tile's first texel on the photograph's grid, modulo 4. At most VT_GL_MAX_GRID_TILES tiles.
#define VT_GL_MAX_GRID_TILES 0x0fffffffu
uint32_t *vt_gl_grid_tiles(vt_context *, const vt_tree *, int level);
uint32_t (*vt_gl_quads(vt_context *, const vt_draw_list *))[6];       // [count] two triangles: 4 * cell + corner
// The kept parts of all views, one behind the other, row by row. *count: how many codes, 0 if all views are empty.
uint8_t *vt_gl_ratio_codes(vt_context *, const vt_view_textures *, size_t *count);

// The chosen views as the shaders see them: homogeneous pixel = m X + b, X in cell edges from the root's centre; pixels of
// the photograph, or of the reduced one where the level has view textures.
typedef struct vt_gl_views {
  float m[VT_MAX_BLEND_VIEWS][9], b[VT_MAX_BLEND_VIEWS][3]; // m column by column
  float weight[VT_MAX_BLEND_VIEWS];                         // 0: nothing is kept of the view's texture
  float texel_rate[VT_MAX_BLEND_VIEWS];                     // tiles: texels per pixel at depth 1
  // view textures: left, top: centre of the first pixel kept; right, bottom: from there to that of the last
  float kept[VT_MAX_BLEND_VIEWS][4], photograph[VT_MAX_BLEND_VIEWS][2]; // photograph: width and height
  uint32_t first_code[VT_MAX_BLEND_VIEWS];
  float linear; // 1: R is interpolated between pixels, 0: ln R
} vt_gl_views;
vt_gl_views vt_aim_gl_views(const vt_tree *, int level, const vt_view_weights *);

#ifdef __cplusplus
}
#endif
#endif
