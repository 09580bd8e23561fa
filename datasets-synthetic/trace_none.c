// trace_none.c - rays in builds without Embree: there are none
// SPDX-License-Identifier: BSD-3-Clause
#include "datasets-synthetic/synthetic.h"
#include "datasets-synthetic/trace.h"

bool vt_can_trace_rays(void) {
  return false;
}

vt_status vt_create_tracer(vt_context *ctx, const vt_trace_mesh *mesh, vt_tracer **out) {
  (void)mesh;
  *out = NULL;
  return vt_fail(
      ctx, VT_MISSING_PROGRAM,
      "ray tracing: this build has none; build voltree with Embree (libembree-dev), or photograph rasterised");
}

void vt_destroy_tracer(vt_context *ctx, vt_tracer *tracer) {
  (void)ctx;
  VT_ASSERT(!tracer);
}

void vt_nearest_hits(const vt_tracer *tracer, const vt_trace_ray *rays, size_t count, vt_trace_hit *hits) {
  (void)rays;
  VT_ASSERT(tracer);
  for (size_t i = 0; i < count; i++) hits[i].triangle = VT_NO_HIT;
}

void vt_any_hits(const vt_tracer *tracer, const vt_trace_ray *rays, size_t count, bool *stopped) {
  (void)rays;
  VT_ASSERT(tracer);
  for (size_t i = 0; i < count; i++) stopped[i] = false;
}
