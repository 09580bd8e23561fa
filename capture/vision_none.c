// vision_none.c - what is said where there is no computer vision library
// SPDX-License-Identifier: BSD-3-Clause
#include "capture/vision.h"

static vt_status refuse(vt_context *context) {
  return vt_fail(
      context, VT_MISSING_PROGRAM,
      "undistortion: this build has no OpenCV; build voltree with it, or undistort the photographs first (colmap "
      "image_undistorter)");
}

vt_status vt_distort_points(vt_context *context, const vt_lens *lens, int count, const double *rays_xy,
                            double *pixels_xy) {
  (void)lens, (void)count, (void)rays_xy, (void)pixels_xy;
  return refuse(context);
}

vt_status vt_resample_picture(vt_context *context, const vt_lens *lens, const vt_image *in, const vt_camera *pinhole,
                              vt_image *out) {
  (void)lens, (void)in, (void)pinhole, (void)out;
  return refuse(context);
}
