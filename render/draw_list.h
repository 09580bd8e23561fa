// draw_list.h - the cells to draw, far to near, kept from picture to picture
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RENDER_DRAW_LIST_H
#define VT_RENDER_DRAW_LIST_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_draw_list {
  int level, eye[3]; // what `order` was made for: the eye in cells, -1 and axis_cells standing for all beyond
  int view_count, view[VT_MAX_BLEND_VIEWS]; // what `cells` was made for; view_count 0: opacity, -1: nothing
  uint32_t *order;   // [cell_count] all cells of the level, far to near; NULL before the first picture; owned
  uint32_t *cells;   // [count] those of them that show something; owned
  uint32_t count;
} vt_draw_list;

void vt_free_draw_list(vt_context *, vt_draw_list *);
// Brings the list up to date; *changed tells whether it had to. Cells with opacity (somewhere, if the level has a field)
// are drawn flat (weights NULL) and where the level has view textures; where it has tiles, cells with one in a chosen view.
vt_status vt_update_draw_list(vt_context *, const vt_tree *, int level, const vt_view_weights *weights, vt_vec3 eye,
                              vt_draw_list *, bool *changed);
// How many cells of the level show something in these views: the count of such a list.
uint32_t vt_count_billboards(const vt_tree *, int level, const vt_view_weights *weights);

#ifdef __cplusplus
}
#endif
#endif
