// jpeg_loss.h - what a JPEG of a given quality leaves of a picture
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_JPEG_LOSS_H
#define VT_DATASETS_SYNTHETIC_JPEG_LOSS_H

#include "base/context.h"

// Colours of an RGBA picture become those that are read back from a baseline JPEG with 4:2:0 chroma; alpha stays.
// quality 1..100. scratch: 2 (width + 16) (height + 16) floats.
void vt_lose_jpeg(uint8_t *rgba, int width, int height, int quality, float *scratch);

#endif
