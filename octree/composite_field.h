// composite_field.h - a picture of one level that is drawn from its field and view textures
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_COMPOSITE_FIELD_H
#define VT_OCTREE_COMPOSITE_FIELD_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

// What vt_composite_skipping does for a level with corners or view textures; weights NULL: flat. out: of the camera's size,
// zero before.
vt_status vt_composite_field(vt_context *, const vt_tree *, int level, const vt_view_weights *, float least_transmittance,
                             const vt_camera *, vt_fimage *out);

#ifdef __cplusplus
}
#endif
#endif
