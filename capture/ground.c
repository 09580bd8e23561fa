// ground.c - what of the picture below the horizon is the tree's
// SPDX-License-Identifier: BSD-3-Clause
#include "capture/ground.h"

vt_status vt_cut_ground(vt_context *context, const vt_sky *sky, const vt_image *rgb, uint8_t sure, uint8_t *strength) {
  (void)context, (void)sure;
  for (int y = 0; y < rgb->height; y++)
    for (int x = 0; x < rgb->width; x++)
      if (vt_is_ground(sky, x, y)) strength[(size_t)y * (size_t)rgb->width + (size_t)x] = 0;
  return VT_OK;
}
