// damage_matte.h - mattes cut badly
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_DAMAGE_MATTE_H
#define VT_DATASETS_SYNTHETIC_DAMAGE_MATTE_H

#include "base/context.h"
#include "base/rng.h"

// Gives transparent pixels of a straight RGBA picture the colour of their surroundings; alpha stays. scratch: 4 (width + 32)
// (height + 32) floats and more.
void vt_fill_transparent(uint8_t *rgba, int width, int height, float *scratch);
// Moves every edge of the matte inwards by `pixels` (negative: outwards), |pixels| <= 16. scratch: width height.
void vt_erode_matte(float *alpha, int width, int height, double pixels, float *scratch);
// Takes round holes of 2 to 4 pixels across out of it until `share` of its area is lost.
void vt_punch_matte(float *alpha, int width, int height, double share, vt_rng *);

#endif
