// synthetic.c - a desc to photographs
// SPDX-License-Identifier: BSD-3-Clause

#include "datasets-synthetic/synthetic.h"
#include "datasets-synthetic/light.h"
#include "datasets-synthetic/phantom.h"
#include "datasets-synthetic/photograph.h"
#include "datasets-synthetic/photograph_traced.h"
#include "datasets-synthetic/rig.h"
#include "datasets-synthetic/sky.h"
#include "datasets-synthetic/tree.h"

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

const char *vt_synthetic_name(vt_synthetic_kind kind) {
  static const char *const names[] = {"tree", "oak",  "pine",  "small_oak", "birch", "willow",
                                      "mesh", "ball", "shell", "blobs",     "comb",  "crown"};
  VT_ASSERT((size_t)kind < sizeof names / sizeof *names);
  return names[kind];
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
                {"leaf_count", d->leaf_count, -1, 1000000},
                {"rig", (int)d->rig, VT_RIG_SPIRAL, VT_RIG_HANDHELD},
                {"backdrop", (int)d->backdrop, VT_BACKDROP_NONE, VT_BACKDROP_STUDIO},
                {"light_path", (int)d->light_path, VT_RASTERISED, VT_RAY_TRACED},
                {"sun", d->sun, 0, 1000000}};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i].value < counts[i].low || counts[i].value > counts[i].high)
      return vt_fail(ctx, VT_BAD_INPUT, "synthetic capture: %s is %d; give %d to %d", counts[i].name, counts[i].value,
                     counts[i].low, counts[i].high);
  if (!(d->fov_y >= 0.01 && d->fov_y <= 2.5))
    return vt_fail(ctx, VT_BAD_INPUT, "synthetic capture: fov_y is %g radians; give 0.01 to 2.5", d->fov_y);
  if (!(d->peak_extinction > 0 && d->peak_extinction <= 1e6))
    return vt_fail(ctx, VT_BAD_INPUT, "synthetic capture: peak_extinction is %g; give more than 0 and at most 1e6",
                   d->peak_extinction);
  if (!(d->wind >= 0 && d->wind <= 0.5))
    return vt_fail(ctx, VT_BAD_INPUT, "synthetic capture: wind is %g; give 0 to 0.5", d->wind);
  if (d->light_path == VT_RAY_TRACED && !vt_is_phantom(d->kind) && !vt_can_trace_rays())
    return vt_fail(ctx, VT_MISSING_PROGRAM,
                   "synthetic capture: ray tracing needs Embree, which this build lacks; install "
                   "libembree-dev and build again, or take rasterised photographs");
  return VT_OK;
}

static vt_status make_mesh(vt_context *ctx, const vt_synthetic_desc *desc, vt_mesh *mesh) {
  if (vt_is_grown(desc->kind)) return vt_grow_tree(ctx, desc->kind, desc->seed, desc->leaf_count, mesh);
  if (!desc->mesh_path) return vt_fail(ctx, VT_BAD_INPUT, "synthetic capture: kind mesh needs a file; give mesh_path (--mesh FILE)");
  vt_status status = vt_read_mesh(ctx, desc->mesh_path, mesh);
  if (!status) vt_centre_mesh(mesh, 2);
  return status;
}

vt_status vt_make_synthetic_mesh(vt_context *ctx, const vt_synthetic_desc *desc, vt_mesh *out) {
  VT_ASSERT(desc->cookie == VT_COOKIE);
  *out = (vt_mesh){0};
  vt_status status = check_desc(ctx, desc);
  if (status) return status;
  VT_ASSERT(!vt_is_phantom(desc->kind));
  status = make_mesh(ctx, desc, out);
  if (status) vt_free_mesh(ctx, out);
  return status;
}

static vt_status photograph_rasterised(vt_context *ctx, const vt_synthetic_desc *desc, const vt_mesh *mesh, vt_vec3 sun,
                                       const vt_wind *wind, vt_views *views) {
  vt_lighting lighting = {0};
  vt_status status = vt_light_mesh(ctx, mesh, sun, &lighting);
  if (!status) status = vt_photograph_mesh(ctx, mesh, &lighting, wind, desc->supersample, views);
  vt_free_lighting(ctx, &lighting);
  return status;
}

static vt_status make_mesh_views(vt_context *ctx, const vt_synthetic_desc *desc, vt_views *out) {
  vt_mesh mesh = {0};
  vt_wind wind = {0};
  vt_vec3 sun = vt_sun_direction(desc->seed, desc->sun);
  vt_status status = make_mesh(ctx, desc, &mesh);
  if (!status) status = vt_make_wind(ctx, &mesh, desc->seed, desc->wind, &wind);
  if (!status) status = vt_make_rig(ctx, desc, &mesh, 0, out);
  if (!status && desc->light_path == VT_RASTERISED)
    status = photograph_rasterised(ctx, desc, &mesh, sun, &wind, out);
  else if (!status)
    status = vt_photograph_traced(ctx, &mesh, sun, &wind, desc->supersample, out);
  vt_log(ctx, VT_LOG_VERBOSE, "%s %u: %zu vertices, %zu triangles", vt_synthetic_name(desc->kind), desc->seed,
         mesh.vertex_count, mesh.triangle_count);
  vt_free_wind(ctx, &wind);
  vt_free_mesh(ctx, &mesh);
  return status;
}

vt_status vt_make_synthetic_views(vt_context *ctx, const vt_synthetic_desc *desc, vt_views *out) {
  VT_ASSERT(desc->cookie == VT_COOKIE);
  *out = (vt_views){0};
  vt_status status = check_desc(ctx, desc);
  if (status) return status;
  if (!vt_is_phantom(desc->kind)) {
    status = make_mesh_views(ctx, desc, out);
  } else {
    vt_phantom phantom = vt_make_phantom(desc);
    status = vt_make_rig(ctx, desc, NULL, phantom.radius, out);
    if (!status) status = vt_photograph_phantom(ctx, &phantom, desc->supersample, out);
  }
  if (status) vt_free_views(ctx, out);
  return status;
}
