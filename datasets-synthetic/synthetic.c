// synthetic.c - a desc to photographs
// SPDX-License-Identifier: BSD-3-Clause

#include "datasets-synthetic/synthetic.h"
#include "datasets-synthetic/bark.h"
#include "datasets-synthetic/grow.h"
#include "datasets-synthetic/leaves.h"
#include "datasets-synthetic/light.h"
#include "datasets-synthetic/phantom.h"
#include "datasets-synthetic/photograph.h"
#include "datasets-synthetic/rig.h"

vt_synthetic_desc vt_default_synthetic_desc(void) {
  return (vt_synthetic_desc){.cookie = VT_COOKIE,
                             .kind = VT_SYNTHETIC_TREE,
                             .seed = 1,
                             .train_count = 48,
                             .test_count = 12,
                             .width = 400,
                             .height = 400,
                             .supersample = 4,
                             .leaf_count = 12000,
                             .fov_y = 0.6,
                             .peak_extinction = 4};
}

static vt_status check_desc(vt_context *ctx, const vt_synthetic_desc *d) {
  const struct {
    const char *name;
    int value, low, high;
  } counts[] = {{"kind", (int)d->kind, VT_SYNTHETIC_TREE, VT_SYNTHETIC_CROWN},
                {"train_count", d->train_count, 1, 1000},
                {"test_count", d->test_count, 0, 1000},
                {"width", d->width, 1, 8192},
                {"height", d->height, 1, 8192},
                {"supersample", d->supersample, 1, 8},
                {"leaf_count", d->leaf_count, 0, 1000000}};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i].value < counts[i].low || counts[i].value > counts[i].high)
      return vt_fail(ctx, VT_BAD_INPUT, "synthetic capture: %s is %d; give %d to %d", counts[i].name, counts[i].value,
                     counts[i].low, counts[i].high);
  if (!(d->fov_y >= 0.01 && d->fov_y <= 2.5))
    return vt_fail(ctx, VT_BAD_INPUT, "synthetic capture: fov_y is %g radians; give 0.01 to 2.5", d->fov_y);
  if (!(d->peak_extinction > 0 && d->peak_extinction <= 1e6))
    return vt_fail(ctx, VT_BAD_INPUT, "synthetic capture: peak_extinction is %g; give more than 0 and at most 1e6",
                   d->peak_extinction);
  return VT_OK;
}

static vt_status grow_tree(vt_context *ctx, const vt_synthetic_desc *desc, vt_mesh *mesh) {
  vt_skeleton skeleton = {0};
  vt_status status = vt_grow_skeleton(ctx, desc->seed, &skeleton);
  if (!status) status = vt_add_bark(ctx, &skeleton, desc->seed, mesh);
  if (!status) status = vt_add_leaves(ctx, &skeleton, desc->seed, desc->leaf_count, mesh);
  if (!status) vt_centre_mesh(mesh, 2);
  vt_free_skeleton(ctx, &skeleton);
  return status;
}

static vt_status make_tree_views(vt_context *ctx, const vt_synthetic_desc *desc, vt_views *out) {
  vt_mesh mesh = {0};
  vt_lighting lighting = {0};
  vt_status status = grow_tree(ctx, desc, &mesh);
  if (!status) status = vt_light_mesh(ctx, &mesh, desc->seed, &lighting);
  if (!status) status = vt_make_rig(ctx, desc, &mesh, 0, out);
  if (!status) status = vt_photograph_mesh(ctx, &mesh, &lighting, desc->supersample, out);
  vt_log(ctx, VT_LOG_VERBOSE, "tree %u: %zu vertices, %zu triangles", desc->seed, mesh.vertex_count,
         mesh.triangle_count);
  vt_free_lighting(ctx, &lighting);
  vt_free_mesh(ctx, &mesh);
  return status;
}

vt_status vt_make_synthetic_views(vt_context *ctx, const vt_synthetic_desc *desc, vt_views *out) {
  VT_ASSERT(desc->cookie == VT_COOKIE);
  *out = (vt_views){0};
  vt_status status = check_desc(ctx, desc);
  if (status) return status;
  if (desc->kind == VT_SYNTHETIC_TREE) {
    status = make_tree_views(ctx, desc, out);
  } else {
    vt_phantom phantom = vt_make_phantom(desc);
    status = vt_make_rig(ctx, desc, NULL, phantom.radius, out);
    if (!status) status = vt_photograph_phantom(ctx, &phantom, desc->supersample, out);
  }
  if (status) vt_free_views(ctx, out);
  return status;
}
