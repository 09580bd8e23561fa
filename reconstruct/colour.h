// colour.h - each cell's own colour
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_COLOUR_H
#define VT_RECONSTRUCT_COLOUR_H

#include "octree/octree.h"
#include "reconstruct/sweep.h"

#ifdef __cplusplus
extern "C" {
#endif

// Writes cells->colour (of the level that the rays were collected on): the mean of the photographs' colours weighted by what the cell contributes to
// each pixel. Cells that nothing shows keep their colour.
vt_status vt_estimate_colour(vt_context *, const vt_rays *, vt_level *cells);

#ifdef __cplusplus
}
#endif
#endif
