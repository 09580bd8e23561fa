// render.h - pictures of a tree: which views, which level, OpenGL or CPU
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RENDER_RENDER_H
#define VT_RENDER_RENDER_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_backend { VT_BACKEND_AUTO, VT_BACKEND_GL, VT_BACKEND_CPU } vt_backend; // auto: GL on a GPU, else CPU

typedef struct vt_render_desc {
  uint32_t cookie;
  int level;          // 0..; -1: chosen by distance
  double texel_pixels; // level by distance: the coarsest level whose texels are at most this many pixels; default 1
  int blend_views;    // k closest views, 1..VT_MAX_BLEND_VIEWS; 0: 4 of view textures, 2 of tiles [LRMDM06]
  vt_blend blend;
  bool flat;          // cells' own colours, no textures
  unsigned skips;     // VT_SKIP_... of octree.h, of the CPU renderer; default VT_SKIP_ALL
} vt_render_desc;
vt_render_desc vt_default_render_desc(void);

// The coarsest level with textures whose texels are at most texel_pixels at the distance of the tree's nearest point;
// the finest where none is fine enough. [LRMDM06 3.3]
int vt_choose_level(const vt_tree *, const vt_camera *, double texel_pixels);

typedef struct vt_renderer vt_renderer;
typedef struct vt_render_report {
  vt_backend backend; // used
  int level;
  uint64_t billboards; // drawn; of a level with view textures, the cells that are not empty
  double seconds_order, seconds_draw;
} vt_render_report;

// Keeps what drawing needs of `tree` (which must outlive it); the OpenGL renderer uploads each level once, when it is
// first drawn. GL: an EGL context without a display. VT_MISSING_PROGRAM if the back end is not there.
vt_status vt_create_renderer(vt_context *, const vt_tree *tree, vt_backend, vt_renderer **out);
void vt_destroy_renderer(vt_context *, vt_renderer *);
// A picture of the camera's size, premultiplied RGBA; the caller frees it.
vt_status vt_render(vt_context *, vt_renderer *, const vt_render_desc *, const vt_camera *, vt_fimage *out,
                    vt_render_report *or_null);
const char *vt_renderer_name(const vt_renderer *); // "CPU", or "OpenGL: ..." with driver and version

#ifdef __cplusplus
}
#endif
#endif
