// sky.c - sun, sky and ground as lights
// SPDX-License-Identifier: BSD-3-Clause
//
// The sky runs from a pale horizon to a blue zenith, (1 - z)^3 of the way over the height z of a direction; the ground
// is one colour, since what lies there is in the sun but for the tree's own shadow. The sums over both halves, weighted
// by the cosine, are those that light.c gives to matt surfaces: two ways to light a tree, one brightness.

#include "datasets-synthetic/sky.h"
#include "base/rng.h"

vt_vec3 vt_sun_direction(uint32_t seed, int index) {
  vt_rng rng = vt_seed_rng(seed, 4);
  double height = vt_random_between(&rng, 0.75, 1.0), azimuth = vt_random_between(&rng, 0, 2 * VT_PI);
  if (index > 0) {
    // The golden angle is never near one of the last few; a sequence of its own spreads the heights.
    double share = 0.2 + index * sqrt(2);
    azimuth += index * VT_PI * (3 - sqrt(5));
    height = asin(0.4 + 0.48 * (share - floor(share)));
  }
  return vt_v3(cos(height) * cos(azimuth), cos(height) * sin(azimuth), sin(height));
}

void vt_sun_light(float colour[3]) {
  colour[0] = 2.75f, colour[1] = 2.6f, colour[2] = 2.3f;
}

void vt_sky_light(const float direction[3], float colour[3]) {
  static const float zenith[3] = {0.84f, 1.01f, 1.27f}, horizon[3] = {1.64f, 1.41f, 1.07f},
                     ground[3] = {0.5f, 0.5f, 0.4f};
  float z = direction[2], low = 1 - fmaxf(z, 0);
  low = low * low * low;
  // The step at the horizon is a hundredth of a unit wide: thinner than anything that reflects it, and no edge.
  float above = fminf(fmaxf(0.5f + 50 * z, 0), 1);
  for (int k = 0; k < 3; k++) colour[k] = ground[k] + above * (zenith[k] + (horizon[k] - zenith[k]) * low - ground[k]);
}
