// ground.h - what of the picture below the horizon is the tree's
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_GROUND_H
#define VT_CAPTURE_GROUND_H

#include "capture/sky_model.h"

#ifdef __cplusplus
extern "C" {
#endif

// Below the horizon, strength[height][width] becomes `sure` where the tree stands before the ground, else 0.
vt_status vt_cut_ground(vt_context *, const vt_sky *, const vt_image *rgb, uint8_t sure, uint8_t *strength);

#ifdef __cplusplus
}
#endif
#endif
