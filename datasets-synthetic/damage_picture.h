// damage_picture.h - what lens, shutter and sensor do to light
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_DAMAGE_PICTURE_H
#define VT_DATASETS_SYNTHETIC_DAMAGE_PICTURE_H

#include "base/camera.h"
#include "base/rng.h"

// Standard normal (Box and Muller 1958, one of the pair).
static inline double vt_random_normal(vt_rng *rng) {
  double u = 1 - vt_random_unit(rng), angle = 2 * VT_PI * vt_random_unit(rng);
  return sqrt(-2 * log(u)) * cos(angle);
}

// Premultiplied RGBA in linear light from straight sRGB bytes.
void vt_linear_from_bytes(const uint8_t *straight, size_t count, float *light);
// The picture through a lens with x_bent = x (1 + k1 r^2) in coordinates of the camera. Outside the old frame its edge is
// repeated.
void vt_bend_picture(const vt_camera *, double k1, const float *light, float *out);
// Convolves with a discrete Gaussian of exactly this deviation (pixels); scratch as large as the picture.
void vt_blur_picture(float *pixels, int width, int height, int channels, double deviation, float *scratch);
// Straight sRGB bytes of light times `exposure`, counted by a sensor whose noise at mid grey has the deviation `noise`
// (encoded), times `balance`; what is over 1 is clipped by the sensor and again at the end.
void vt_bytes_from_light(const float *light, size_t count, double exposure, double noise, const double balance[3],
                         vt_rng *, uint8_t *straight);

#endif
