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

static bool shows_something(const vt_level *level, const vt_tiles *tiles, const vt_view_weights *weights, uint32_t i) {
  if (!weights) return level->optical_depth[i] > 0;
  for (int v = 0; v < weights->count; v++)
    if (tiles->tile_of[(size_t)weights->view[v] * tiles->cell_count + i] != VT_NO_TILE) return true;
  return false;
}

uint32_t vt_count_billboards(const vt_tree *tree, int number, const vt_view_weights *weights) {
  uint32_t count = 0;
  bool pictures = tree->view_textures[number].view_count > 0; // one for all cells: those show that hold something
  if (weights && !pictures && !tree->tiles[number].view_count) return 0;
  if (pictures) weights = NULL;
  for (uint32_t i = 0; i < tree->octree.levels[number].cell_count; i++)
    count += shows_something(&tree->octree.levels[number], &tree->tiles[number], weights, i);
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
  const vt_tiles *tiles = &tree->tiles[number];
  vt_vec3 e = vt_scale(vt_sub(eye, tree->octree.origin), 1 / vt_cell_edge(&tree->octree, number));
  int n = level->axis_cells, eye_cell[3] = {clamp_cell(e.x, n), clamp_cell(e.y, n), clamp_cell(e.z, n)};
  int view_count = weights ? weights->count : 0;
  bool same_order = list->order && list->level == number && !memcmp(list->eye, eye_cell, sizeof eye_cell);
  *changed = !same_order || list->view_count != view_count ||
             (weights && memcmp(list->view, weights->view, (size_t)view_count * sizeof *list->view));
  if (!*changed) return VT_OK;
  if (!same_order) {
    vt_status status = sort_cells(context, tree, number, eye, eye_cell, list);
    if (status) return status;
  }
  list->view_count = view_count;
  if (weights) memcpy(list->view, weights->view, sizeof list->view);
  list->count = 0;
  if (weights && !tiles->view_count) return VT_OK;
  for (uint32_t i = 0; i < level->cell_count; i++)
    if (shows_something(level, tiles, weights, list->order[i])) list->cells[list->count++] = list->order[i];
  return VT_OK;
}
