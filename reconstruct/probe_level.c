// probe_level.c - pictures of a solved level for context.probe
// SPDX-License-Identifier: BSD-3-Clause

#include "reconstruct/probe_level.h"

vt_status vt_probe_level(vt_context *context, const vt_tree *tree, int level, const vt_reduced_views *views) {
  if (!vt_wants_probes(context) || !views->count) return VT_OK;
  vt_fimage cells, residual = {0};
  vt_status status = vt_composite(context, tree, level, NULL, VT_BLEND_SUM, true, &views->cameras[0], &cells);
  if (status) return status;
  status = vt_make_fimage(context, cells.width, cells.height, 1, &residual);
  if (!status) {
    char name[64];
    for (size_t i = 0; i < (size_t)cells.width * (size_t)cells.height; i++)
      residual.pixels[i] = 0.5f + 0.5f * (cells.pixels[4 * i + 3] - (float)views->pictures[0].pixels[4 * i + 3] / 255.0f);
    snprintf(name, sizeof name, "level_%d_cells", level);
    vt_probe(context, name, &cells);
    snprintf(name, sizeof name, "level_%d_residual", level);
    vt_probe(context, name, &residual);
  }
  vt_free_fimage(context, &residual);
  vt_free_fimage(context, &cells);
  return status;
}
