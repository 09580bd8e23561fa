// views.c - choosing and freeing views
// SPDX-License-Identifier: BSD-3-Clause

#include "base/views.h"

void vt_free_views(vt_context *context, vt_views *views) {
  for (int i = 0; i < views->count && views->items; i++) {
    vt_free(context, views->items[i].name);
    vt_free_image(context, &views->items[i].picture);
    vt_free_image(context, &views->items[i].ignored);
  }
  vt_free(context, views->items);
  vt_free_tracks(context, &views->tracks);
  *views = (vt_views){0};
}

int vt_count_views(const vt_views *views, vt_role role) {
  int count = 0;
  for (int i = 0; i < views->count; i++) count += views->items[i].role == role;
  return count;
}

vt_status vt_select_views(vt_context *context, const vt_views *views, vt_role role, vt_views *out) {
  *out = (vt_views){.world = views->world};
  out->items = VT_NEW(context, vt_view, (size_t)views->count);
  if (!out->items) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < views->count; i++)
    if (views->items[i].role == role) out->items[out->count++] = views->items[i];
  return VT_OK;
}

void vt_hold_out(vt_views *views, int n) {
  if (n < 2) return;
  int seen = 0;
  for (int i = 0; i < views->count; i++)
    if (views->items[i].role == VT_TRAIN && ++seen % n == 0) views->items[i].role = VT_TEST;
}
