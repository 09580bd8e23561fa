// photograph_traced.h - pictures of a mesh by ray tracing
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_PHOTOGRAPH_TRACED_H
#define VT_DATASETS_SYNTHETIC_PHOTOGRAPH_TRACED_H

#include "base/views.h"
#include "datasets-synthetic/wind.h"

// Photographs the mesh from every view's camera into a new picture of the view, in the sun from that direction (unit,
// towards it): straight RGBA, alpha is the share of the samples_edge^2 (1..32 an edge) samples per pixel that are covered.
// With wind->amplitude > 0 every view has its own gust. Degenerate triangles are ignored. VT_BAD_INPUT for a vertex that is no
// number, VT_MISSING_PROGRAM in builds without Embree, VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_photograph_traced(vt_context *, const vt_mesh *, vt_vec3 sun, const vt_wind *, int samples_edge, vt_views *);

#endif
