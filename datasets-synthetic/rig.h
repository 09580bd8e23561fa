// rig.h - where the cameras stand
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_RIG_H
#define VT_DATASETS_SYNTHETIC_RIG_H

#include "datasets-synthetic/mesh.h"
#include "datasets-synthetic/synthetic.h"

// Names, roles and cameras of all views, pictures empty. All cameras stand equally far from the origin and look at it
// (VT_RIG_HANDHELD: about so), as near as possible with the mesh (or, if that is NULL, a ball of `radius` around the
// origin) within the middle 84 % of every picture. VT_OUT_OF_MEMORY.
vt_status vt_make_rig(vt_context *, const vt_synthetic_desc *, const vt_mesh *or_null, double radius, vt_views *out);

#endif
