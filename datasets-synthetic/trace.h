// trace.h - what rays meet among triangles (Embree 3; trace_none.c meets nothing)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_TRACE_H
#define VT_DATASETS_SYNTHETIC_TRACE_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VT_NO_HIT = 0xffffffff };

typedef struct vt_trace_ray {
  float origin[3], near;   // near and far: multiples of the direction, 0 <= near
  float direction[3], far; // any length but 0
} vt_trace_ray;

typedef struct vt_trace_hit {
  uint32_t triangle; // VT_NO_HIT: none
  float distance;    // multiples of the direction
  float u, v;        // the place is (1 - u - v) a + u b + v c
} vt_trace_hit;

// True if there is nothing at this place of this triangle after all. Asked from all threads at once.
typedef bool (*vt_hole_test)(const void *user, uint32_t triangle, float u, float v);

// Borrowed for as long as the tracer lives. Triangles that are degenerate, or have a corner that is no number, meet no ray.
typedef struct vt_trace_mesh {
  const float *positions; // x, y, z of the first vertex; 16 bytes can be read at every one
  size_t vertex_stride;   // bytes, a multiple of 4
  size_t vertex_count;
  const uint32_t *triangles; // three indices each, all < vertex_count (the caller's promise)
  size_t triangle_count;
  vt_hole_test is_hole; // NULL: no holes
  const void *user;     // of is_hole
} vt_trace_mesh;

typedef struct vt_tracer vt_tracer;

// VT_MISSING_PROGRAM in builds without Embree, VT_OUT_OF_MEMORY. What a ray meets does not depend on the number of threads;
// of surfaces that it meets at the same distance it may be either.
vt_status vt_create_tracer(vt_context *, const vt_trace_mesh *, vt_tracer **out);
void vt_destroy_tracer(vt_context *, vt_tracer *); // NULL is allowed
// For each ray what it meets first, or whether it meets anything. From any number of threads at once. Fast where rays that
// follow each other are alike; those of vt_nearest_hits had better start at one place.
void vt_nearest_hits(const vt_tracer *, const vt_trace_ray *rays, size_t count, vt_trace_hit *hits);
void vt_any_hits(const vt_tracer *, const vt_trace_ray *rays, size_t count, bool *stopped);

#ifdef __cplusplus
}
#endif
#endif
