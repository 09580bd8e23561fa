// to_merge.c - functions of the face that other work brings; each refuses until then
// SPDX-License-Identifier: BSD-3-Clause
#include "datasets-synthetic/synthetic.h"

const char *vt_synthetic_name(vt_synthetic_kind kind) {
  static const char *const names[] = {"tree", "oak",  "pine",  "small_oak", "birch", "willow",
                                      "mesh", "ball", "shell", "blobs",     "comb",  "crown"};
  VT_ASSERT((size_t)kind < sizeof names / sizeof *names);
  return names[kind];
}

bool vt_can_trace_rays(void) {
  return false;
}

static vt_status refuse(vt_context *ctx, const char *what) {
  return vt_fail(ctx, VT_MISSING_PROGRAM, "%s: this build cannot do that; use another", what);
}

vt_status vt_put_before_backdrop(vt_context *ctx, const vt_synthetic_desc *desc, vt_views *views) {
  (void)views;
  return desc->backdrop == VT_BACKDROP_NONE ? VT_OK : refuse(ctx, "backdrops");
}

vt_status vt_make_synthetic_mesh(vt_context *ctx, const vt_synthetic_desc *desc, vt_mesh *out) {
  *out = (vt_mesh){0};
  return refuse(ctx, vt_synthetic_name(desc->kind));
}

vt_status vt_read_mesh(vt_context *ctx, const char *path, vt_mesh *out) {
  *out = (vt_mesh){0};
  return refuse(ctx, path);
}

vt_status vt_write_mesh(vt_context *ctx, const vt_mesh *mesh, const char *path) {
  (void)mesh;
  return refuse(ctx, path);
}
