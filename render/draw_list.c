// draw_list.c - the cells to draw, far to near, kept from picture to picture
// SPDX-License-Identifier: BSD-3-Clause
//
// The order depends only on which cell the eye is in (octree/order.c), beyond the root only on the side on which it is;
// which cells have textures, only on the chosen views. Most pictures of a flight therefore find their list ready made.

#include "render/draw_list.h"

#include <string.h>

void vt_free_draw_list(vt_context *context, vt_draw_list *list) {
  vt_free(context, list->order);
  vt_free(context, list->cells);
  *list = (vt_draw_list){0};
}

static int clamp_cell(double e, int n) { return e < 0 ? -1 : e >= n ? n : (int)e; }

// Whether a cell has opacity anywhere, be it only a corner's.
static bool has_opacity(const vt_level *level, uint32_t cell) {
  if (!level->corner_count) return level->optical_depth[cell] > 0;
  for (size_t i = 0; i < 8; i++)
    if (level->corner_values[4 * (size_t)level->corner_of[8 * (size_t)cell + i]] > 0) return true;
  return false;
}

static bool has_tile(const vt_tiles *tiles, const vt_view_weights *weights, uint32_t cell) {
  for (int v = 0; v < weights->count; v++)
    if (tiles->tile_of[(size_t)weights->view[v] * tiles->cell_count + cell] != VT_NO_TILE) return true;
  return false;
}

typedef enum what_shows { NOTHING, OPACITY, TILES } what_shows;

static what_shows what_is_drawn(const vt_tree *tree, int level, const vt_view_weights *weights) {
  if (!weights) return OPACITY;
  if (!weights->count || !vt_has_textures(tree, level)) return NOTHING;
  return tree->tiles[level].view_count ? TILES : OPACITY; // a ratio is never 0
}

static bool shows(const vt_tree *tree, int level, what_shows what, const vt_view_weights *weights, uint32_t cell) {
  return what == TILES ? has_tile(&tree->tiles[level], weights, cell)
                       : what == OPACITY && has_opacity(&tree->octree.levels[level], cell);
}

uint32_t vt_count_billboards(const vt_tree *tree, int level, const vt_view_weights *weights) {
  uint32_t count = 0;
  what_shows what = what_is_drawn(tree, level, weights);
  for (uint32_t i = 0; i < tree->octree.levels[level].cell_count; i++) count += shows(tree, level, what, weights, i);
  return count;
}

static vt_status sort_cells(vt_context *context, const vt_tree *tree, int level, vt_vec3 eye, const int eye_cell[3],
                            vt_draw_list *list) {
  size_t cells = tree->octree.levels[level].cell_count;
  if (!list->order || list->level != level) {
    vt_free_draw_list(context, list);
    list->order = VT_NEW(context, uint32_t, cells);
    list->cells = VT_NEW(context, uint32_t, cells);
  }
  vt_status status = VT_OUT_OF_MEMORY;
  if (list->order && list->cells) status = vt_order_back_to_front(context, &tree->octree, level, eye, list->order);
  if (status) vt_free_draw_list(context, list);
  list->level = level;
  memcpy(list->eye, eye_cell, sizeof list->eye);
  return status;
}

vt_status vt_update_draw_list(vt_context *context, const vt_tree *tree, int number, const vt_view_weights *weights,
                              vt_vec3 eye, vt_draw_list *list, bool *changed) {
  const vt_level *level = &tree->octree.levels[number];
  what_shows what = what_is_drawn(tree, number, weights);
  vt_vec3 e = vt_scale(vt_sub(eye, tree->octree.origin), 1 / vt_cell_edge(&tree->octree, number));
  int n = level->axis_cells, eye_cell[3] = {clamp_cell(e.x, n), clamp_cell(e.y, n), clamp_cell(e.z, n)};
  int view_count = what == TILES ? weights->count : what == OPACITY ? 0 : -1; // only tiles depend on the views
  bool same_order = list->order && list->level == number && !memcmp(list->eye, eye_cell, sizeof eye_cell);
  *changed = !same_order || list->view_count != view_count ||
             (what == TILES && memcmp(list->view, weights->view, (size_t)view_count * sizeof *list->view));
  if (!*changed) return VT_OK;
  if (!same_order) {
    vt_status status = sort_cells(context, tree, number, eye, eye_cell, list);
    if (status) return status;
  }
  list->view_count = view_count;
  if (what == TILES) memcpy(list->view, weights->view, sizeof list->view);
  list->count = 0;
  for (uint32_t i = 0; i < level->cell_count; i++)
    if (shows(tree, number, what, weights, list->order[i])) list->cells[list->count++] = list->order[i];
  return VT_OK;
}
