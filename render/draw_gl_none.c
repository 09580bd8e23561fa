// draw_gl_none.c - the twin of draw_gl_epoxy.c in builds without OpenGL
// SPDX-License-Identifier: BSD-3-Clause

#include "render/draw_gl.h"

vt_status vt_create_gl(vt_context *context, const vt_tree *tree, vt_gl **out) {
  (void)tree;
  *out = NULL;
  return vt_fail(context, VT_MISSING_PROGRAM,
                 "OpenGL: this build has no OpenGL renderer; build with -DVT_WITH_OPENGL=ON or draw on the CPU");
}

void vt_destroy_gl(vt_context *context, vt_gl *gl) {
  (void)context;
  VT_ASSERT(!gl);
}

const char *vt_gl_name(const vt_gl *gl) {
  VT_ASSERT(!gl);
  return "";
}

vt_status vt_draw_with_gl(vt_context *context, vt_gl *gl, int level, const vt_view_weights *weights, vt_blend blend,
                          const vt_camera *camera, const vt_draw_list *list, bool upload_list, vt_fimage *out) {
  (void)gl, (void)level, (void)weights, (void)blend, (void)camera, (void)list, (void)upload_list, (void)out;
  return vt_fail(context, VT_MISSING_PROGRAM, "OpenGL: this build has no OpenGL renderer; draw on the CPU");
}
