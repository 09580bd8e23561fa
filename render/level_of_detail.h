// level_of_detail.h - the level a camera needs, with textures or without
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RENDER_LEVEL_OF_DETAIL_H
#define VT_RENDER_LEVEL_OF_DETAIL_H

#include "render/render.h"

#ifdef __cplusplus
extern "C" {
#endif

// vt_choose_level; flat: a cell is as coarse as a texel should be.
int vt_choose_level_for(const vt_tree *, const vt_camera *, double texel_pixels, bool flat);

#ifdef __cplusplus
}
#endif
#endif
