// draw_gl.h - drawing with OpenGL: the face of the bridge, whose twin says that it is not there
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RENDER_DRAW_GL_H
#define VT_RENDER_DRAW_GL_H

#include "render/draw_list.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_gl vt_gl;

// A context of its own, without a window; `tree` must outlive it. VT_MISSING_PROGRAM, with what the driver said, if
// there is no OpenGL 3.3 or OpenGL ES 3.0.
vt_status vt_create_gl(vt_context *, const vt_tree *tree, vt_gl **out);
void vt_destroy_gl(vt_context *, vt_gl *);
const char *vt_gl_name(const vt_gl *); // driver and version
// The cells of `list` from `camera`, over one another in their order; weights NULL: flat. `upload_list`: the list is
// not the one of the last call. out: premultiplied RGBA, made by the caller in the camera's size. VT_FAILED or
// VT_OUT_OF_MEMORY with what the driver said.
vt_status vt_draw_with_gl(vt_context *, vt_gl *, int level, const vt_view_weights *weights, vt_blend,
                          const vt_camera *camera, const vt_draw_list *list, bool upload_list, vt_fimage *out);

#ifdef __cplusplus
}
#endif
#endif
