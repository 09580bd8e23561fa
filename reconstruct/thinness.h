// thinness.h - how much of the tree is thinner than a few pixels
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_THINNESS_H
#define VT_RECONSTRUCT_THINNESS_H

#include "base/views.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VT_THIN_WIDTH 3 // pixels

// Share (0..1) of the views' mattes that no square of VT_THIN_WIDTH pixels within the mattes covers; 0 where there is no
// tree. Of many views so many, evenly spread, are looked at. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_measure_thinness(vt_context *, const vt_views *, double *share);

#ifdef __cplusplus
}
#endif
#endif
