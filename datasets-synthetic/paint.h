// paint.h - small textures for leaves and bark
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_PAINT_H
#define VT_DATASETS_SYNTHETIC_PAINT_H

#include "datasets-synthetic/leaf_shapes.h"

enum { VT_PAINT_SIZE = 128 }; // texels an edge

// Paint material->texture and set material->albedo so that texture times albedo has the mean 1 in each channel (over what
// the leaf's outline, or the whole bark, takes of it): drawn without the texture, the vertices' albedo alone is right.
// VT_OUT_OF_MEMORY.
vt_status vt_paint_leaf(vt_context *, vt_leaf_form, uint32_t seed, vt_material *);
vt_status vt_paint_bark(vt_context *, vt_bark_pattern, uint32_t seed, vt_material *);

#endif
