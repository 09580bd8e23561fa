// quality_none.c - builds without OpenCV's quality module
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/quality.h"

bool vt_has_opencv_quality(void) {
  return false;
}

vt_status vt_opencv_quality(vt_context *context, const vt_image *a, const vt_image *b, double *psnr, float *ssim_map) {
  (void)a, (void)b, (void)psnr, (void)ssim_map;
  return vt_fail(context, VT_MISSING_PROGRAM, "quality: this build has no OpenCV; install its contrib modules");
}

vt_status vt_opencv_jpeg(vt_context *context, const vt_image *rgb, int quality, vt_image *out) {
  (void)rgb, (void)quality, (void)out;
  return vt_fail(context, VT_MISSING_PROGRAM, "quality: this build has no OpenCV; install its contrib modules");
}
