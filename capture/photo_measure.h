// photo_measure.h - what a photograph says about itself: sharpness, exposure, white balance, a thumbnail
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_PHOTO_MEASURE_H
#define VT_CAPTURE_PHOTO_MEASURE_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VT_THUMB 24 // edge of the thumbnail, pixels

typedef struct vt_photo_measure {
  double sharpness;       // fine contrast over coarse contrast of the strongest edges, about 0.1 (blurred) .. 0.7; NAN: no edges
  double exposure;        // log2 of the mean luma, linear light; -20 for black
  double red, blue;       // log2 of mean red and blue over mean green, linear light; 0 for black
  uint8_t thumb[VT_THUMB * VT_THUMB][3];
} vt_photo_measure;

// VT_OUT_OF_MEMORY.
vt_status vt_measure_photo(vt_context *, const vt_image *picture, vt_photo_measure *out);

#ifdef __cplusplus
}
#endif
#endif
