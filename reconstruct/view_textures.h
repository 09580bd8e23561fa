// view_textures.h - each photograph's matte against the field's, as a texture in the photograph's own plane
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_VIEW_TEXTURES_H
#define VT_RECONSTRUCT_VIEW_TEXTURES_H

#include "octree/octree.h"
#include "reconstruct/sweep.h"

#ifdef __cplusplus
extern "C" {
#endif

// The textures of the rays' level: ratio_limit >= 1 is the largest factor by which a matte may thicken the cells on its ray.
// linear: R, not ln R, is what is interpolated between its pixels.
// VT_OUT_OF_MEMORY, VT_CANCELLED. The caller frees out.
vt_status vt_make_view_textures(vt_context *, const vt_rays *, float ratio_limit, bool linear,
                                vt_view_textures *out);

#ifdef __cplusplus
}
#endif
#endif
