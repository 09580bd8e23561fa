// sky.h - where the sun stands and what light the sky sends
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_SKY_H
#define VT_DATASETS_SYNTHETIC_SKY_H

#include <stdint.h>

#include "base/vector.h"

// Unit, towards the sun. Index 0 is the seed's own; any two of the first eight stand at least 20 degrees apart.
vt_vec3 vt_sun_direction(uint32_t seed, int index);
// Linear light, in units in which a white matt surface shows what it receives: of the sun straight above it, of the sky
// (of the ground below the horizon) from a direction (unit).
void vt_sun_light(float colour[3]);
void vt_sky_light(const float direction[3], float colour[3]);

#endif
