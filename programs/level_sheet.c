// level_sheet.c - the levels of a tree beside each other, with the number of the level and its billboards
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/level_sheet.h"

#include "programs/contact_sheet.h"
#include "programs/stage_options.h"

#define FIRST_LEVEL 3
#define CELL 320 // pixels of the longer side of a picture

vt_status vt_write_level_sheet(vt_session *session, const vt_tree *tree, const vt_render_desc *given,
                               vt_backend backend, const vt_camera *camera, const float background[3],
                               const char *path) {
  vt_context *context = session->context;
  int finest = vt_finest_level(tree), count = 0;
  VT_ASSERT(finest >= 0);
  for (int l = finest < FIRST_LEVEL ? 0 : FIRST_LEVEL; l <= finest; l++) count += vt_has_textures(tree, l);
  double fit = (double)CELL / (camera->width > camera->height ? camera->width : camera->height);
  int width = fit < 1 ? (int)(camera->width * fit) : camera->width;
  int height = fit < 1 ? (int)(camera->height * fit) : camera->height;
  vt_renderer *renderer = NULL;
  vt_sheet sheet = {0};
  vt_status status = vt_create_renderer(context, tree, backend, &renderer);
  if (!status)
    status = vt_begin_sheet(context, count, 4, width > 1 ? width : 1, height > 1 ? height : 1, background, &sheet);
  for (int l = finest < FIRST_LEVEL ? 0 : FIRST_LEVEL; l <= finest && !status; l++) {
    if (!vt_has_textures(tree, l)) continue;
    vt_render_desc desc = *given;
    vt_render_report report;
    vt_fimage picture = {0};
    char label[48];
    desc.level = l;
    status = vt_render(context, renderer, &desc, camera, &picture, &report);
    snprintf(label, sizeof label, "L%d %lluB", l, (unsigned long long)(status ? 0 : report.billboards));
    if (!status) status = vt_put_on_sheet(context, &sheet, &picture, label);
    vt_free_fimage(context, &picture);
  }
  if (!status) status = vt_write_sheet(context, &sheet, path);
  if (renderer) vt_destroy_renderer(context, renderer);
  vt_free_sheet(context, &sheet);
  return status;
}
