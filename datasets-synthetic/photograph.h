// photograph.h - pictures of a lit mesh
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_PHOTOGRAPH_H
#define VT_DATASETS_SYNTHETIC_PHOTOGRAPH_H

#include "base/views.h"
#include "datasets-synthetic/light.h"

// Photographs the mesh from every view's camera into a new picture of the view: straight RGBA, alpha is the share of
// supersample^2 samples per pixel that are covered. Every vertex stands in front of every camera (asserted).
vt_status vt_photograph_mesh(vt_context *, const vt_mesh *, const vt_lighting *, int supersample, vt_views *);

#endif
