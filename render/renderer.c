// renderer.c - one picture: its level, its views, its back end
// SPDX-License-Identifier: BSD-3-Clause

#include "render/render.h"

#include "render/draw_gl.h"
#include "render/level_of_detail.h"

#include <string.h>

struct vt_renderer {
  const vt_tree *tree;
  vt_gl *gl;              // NULL: CPU
  vt_draw_list list;      // what gl drew last
  bool gl_has_list;       // and still holds
  bool may_fall_back;     // asked for as VT_BACKEND_AUTO
  char name[256];
};

vt_render_desc vt_default_render_desc(void) {
  return (vt_render_desc){
      .cookie = VT_COOKIE, .level = -1, .texel_pixels = 1, .blend_views = 0, .blend = VT_BLEND_GEOMETRIC,
      .skips = VT_SKIP_ALL};
}

static void use_cpu(vt_context *context, vt_renderer *renderer) {
  vt_destroy_gl(context, renderer->gl);
  renderer->gl = NULL;
  vt_free_draw_list(context, &renderer->list);
  snprintf(renderer->name, sizeof renderer->name, "CPU");
}

// Where the caller left the choice open, a driver that refuses is no error.
static bool may_draw_on_cpu(vt_context *context, const vt_renderer *renderer, vt_status status) {
  if (!renderer->may_fall_back || status == VT_CANCELLED) return false;
  vt_log(context, VT_LOG_VERBOSE, "drawing on the CPU: %s", vt_last_error(context));
  vt_clear_error(context);
  return true;
}

static bool is_software(const char *driver) {
  return strstr(driver, "llvmpipe") || strstr(driver, "softpipe") || strstr(driver, "swrast");
}

vt_status vt_create_renderer(vt_context *context, const vt_tree *tree, vt_backend backend, vt_renderer **out) {
  *out = NULL;
  vt_renderer *renderer = VT_NEW(context, vt_renderer, 1);
  if (!renderer) return VT_OUT_OF_MEMORY;
  renderer->tree = tree;
  renderer->may_fall_back = backend == VT_BACKEND_AUTO;
  snprintf(renderer->name, sizeof renderer->name, "CPU");
  if (backend != VT_BACKEND_CPU) {
    vt_status status = vt_create_gl(context, tree, &renderer->gl);
    if (status && !may_draw_on_cpu(context, renderer, status)) {
      vt_free(context, renderer);
      return status;
    }
    // where OpenGL is itself drawn by the processor our own renderer is as fast, and obeys --threads
    if (renderer->gl && backend == VT_BACKEND_AUTO && is_software(vt_gl_name(renderer->gl))) use_cpu(context, renderer);
    if (renderer->gl) snprintf(renderer->name, sizeof renderer->name, "OpenGL: %s", vt_gl_name(renderer->gl));
  }
  *out = renderer;
  return VT_OK;
}

void vt_destroy_renderer(vt_context *context, vt_renderer *renderer) {
  if (!renderer) return;
  use_cpu(context, renderer);
  vt_free(context, renderer);
}

const char *vt_renderer_name(const vt_renderer *renderer) { return renderer->name; }

static vt_status draw_on_gl(vt_context *context, vt_renderer *renderer, const vt_render_desc *desc, int level,
                            const vt_view_weights *weights, const vt_camera *camera, vt_fimage *out,
                            vt_render_report *report) {
  double start = vt_seconds();
  bool changed;
  vt_status status = vt_update_draw_list(context, renderer->tree, level, weights, vt_camera_centre(camera),
                                         &renderer->list, &changed);
  report->seconds_order = vt_seconds() - start;
  report->billboards = renderer->list.count;
  if (!status) status = vt_make_fimage(context, camera->width, camera->height, 4, out);
  if (!status)
    status = vt_draw_with_gl(context, renderer->gl, level, weights, desc->blend, camera, &renderer->list,
                             changed || !renderer->gl_has_list, out);
  renderer->gl_has_list = !status;
  report->seconds_draw = vt_seconds() - start - report->seconds_order;
  if (status) vt_free_fimage(context, out);
  return status;
}

static vt_status choose_level(vt_context *context, const vt_tree *tree, const vt_render_desc *desc,
                              const vt_camera *camera, int *level) {
  *level = desc->level;
  if (desc->level >= tree->octree.level_count)
    return vt_fail(context, VT_BAD_USAGE, "level %d: the tree has levels 0 to %d; choose one of them", desc->level,
                   tree->octree.level_count - 1);
  if (desc->level < 0) *level = vt_choose_level_for(tree, camera, desc->texel_pixels, desc->flat);
  if (!desc->flat && !vt_has_textures(tree, *level))
    return vt_fail(context, VT_BAD_USAGE, "level %d: it has no textures; draw it flat or choose another level", *level);
  return VT_OK;
}

vt_status vt_render(vt_context *context, vt_renderer *renderer, const vt_render_desc *desc, const vt_camera *camera,
                    vt_fimage *out, vt_render_report *or_null) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->texel_pixels > 0);
  VT_ASSERT(desc->blend_views >= 0 && desc->blend_views <= VT_MAX_BLEND_VIEWS);
  *out = (vt_fimage){0};
  vt_render_report report = {.backend = renderer->gl ? VT_BACKEND_GL : VT_BACKEND_CPU};
  vt_status status = vt_check_camera(context, camera, "the picture's camera");
  if (!status) status = choose_level(context, renderer->tree, desc, camera, &report.level);
  if (status) return status;
  if (vt_cancelled(context)) return VT_CANCELLED;
  vt_view_weights chosen, *weights = NULL;
  if (!desc->flat) {
    int usual = renderer->tree->view_textures[report.level].view_count ? 4 : 2;
    chosen = vt_choose_views(renderer->tree, vt_camera_centre(camera), desc->blend_views ? desc->blend_views : usual);
    weights = &chosen;
  }
  if (renderer->gl) {
    status = draw_on_gl(context, renderer, desc, report.level, weights, camera, out, &report);
    if (status && may_draw_on_cpu(context, renderer, status)) use_cpu(context, renderer);
  }
  if (!renderer->gl) {
    report.backend = VT_BACKEND_CPU;
    report.seconds_order = 0;
    double start = vt_seconds();
    status = vt_composite_skipping(context, renderer->tree, report.level, weights, desc->blend, desc->flat, desc->skips,
                                   camera, out);
    report.seconds_draw = vt_seconds() - start;
    if (or_null) report.billboards = vt_count_billboards(renderer->tree, report.level, weights);
  }
  if (or_null) *or_null = report;
  return status;
}
