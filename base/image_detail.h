// image_detail.h - colour difference and sharpness over the foreground, for image_metrics.c
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_IMAGE_DETAIL_H
#define VT_BASE_IMAGE_DETAIL_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VT_FOREGROUND_BYTE 6 // the least true alpha, of 255, that counts as foreground: more than 0.02

// What is compared: premultiplied RGBA, straight RGBA of the same size, and what lies behind both.
typedef struct vt_picture_pair {
  const vt_fimage *result;
  const vt_image *truth;
  float background[3];
} vt_picture_pair;

// Row y of both over the background: RGB, 0..1, [3 width] each. NaN is 0.
void vt_flatten_pair(const vt_picture_pair *, size_t y, float *result_row, float *truth_row);
// Mean CIEDE2000 over the foreground, and the ratio of gradient energies; NAN where there is none to compare.
vt_status vt_measure_detail(vt_context *, const vt_picture_pair *, double *delta_e, double *sharpness);

#ifdef __cplusplus
}
#endif
#endif
