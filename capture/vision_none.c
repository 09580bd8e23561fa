// vision_none.c - what is said where there is no computer vision library
// SPDX-License-Identifier: BSD-3-Clause
#include "capture/vision.h"

vt_status vt_resample_rows(vt_context *context, const vt_image *in, const float *x, const float *y, int first, int rows,
                           vt_image *out) {
  (void)in, (void)x, (void)y, (void)first, (void)rows, (void)out;
  return vt_fail(
      context, VT_MISSING_PROGRAM,
      "undistortion: this build has no OpenCV; build voltree with it, or undistort the photographs first (colmap "
      "image_undistorter)");
}

vt_status vt_find_markers(vt_context *context, const vt_image *grey, int cells, vt_marker out[VT_MAX_MARKERS], int *count) {
  (void)grey, (void)cells, (void)out;
  *count = 0;
  return vt_fail(context, VT_MISSING_PROGRAM,
                 "markers: this build has no OpenCV, which finds them; build voltree with it, or give the scale by "
                 "--marks or --height");
}
