// photograph.h - pictures of a mesh
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_PHOTOGRAPH_H
#define VT_DATASETS_SYNTHETIC_PHOTOGRAPH_H

#include "base/views.h"
#include "datasets-synthetic/light.h"
#include "datasets-synthetic/wind.h"

// Photographs the mesh from every view's camera into a new picture of the view: straight RGBA, alpha is the share of
// supersample^2 samples per pixel that are covered. With wind->amplitude > 0 every view has its own gust, in which light and
// shade stay where they were on each leaf. Every vertex stands in front of every camera (asserted; VT_BAD_INPUT where the wind
// blows one to the camera).
vt_status vt_photograph_mesh(vt_context *, const vt_mesh *, const vt_lighting *, const vt_wind *, int supersample,
                             vt_views *);

#endif
