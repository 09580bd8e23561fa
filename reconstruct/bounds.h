// bounds.h - the root cube from cameras and mattes alone
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_BOUNDS_H
#define VT_RECONSTRUCT_BOUNDS_H

#include "octree/octree.h"
#include "reconstruct/pyramid.h"

#ifdef __cplusplus
extern "C" {
#endif

// The tight cube around the visual hull: octree->origin and edge are set (branching must be, levels stay empty).
// VT_BAD_INPUT if no photograph shows any tree, or the mattes have no volume in common.
vt_status vt_find_bounds(vt_context *, const vt_views *, vt_octree *octree);
// The same where so many photographs must see a place empty before it is cut away.
vt_status vt_find_bounds_by(vt_context *, const vt_views *, int votes, vt_octree *octree);

#ifdef __cplusplus
}
#endif
#endif
