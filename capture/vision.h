// vision.h - what is taken from a computer vision library (OpenCV)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_VISION_H
#define VT_CAPTURE_VISION_H

#include "capture/lens.h"

#ifdef __cplusplus
extern "C" {
#endif

// Where rays (x, y, 1) of the camera's own axes meet the photograph: pixels, xy pairs. VT_MISSING_PROGRAM without
// OpenCV.
vt_status vt_distort_points(vt_context *, const vt_lens *, int count, const double *rays_xy, double *pixels_xy);
// Resamples `in`, taken through `lens`, to the pinhole camera whose size, focal lengths and centre are given, by
// bicubic interpolation. Outside the photograph its edge is repeated, with alpha 0 where there are 4 channels. `out`
// has its size and channels already.
vt_status vt_resample_picture(vt_context *, const vt_lens *, const vt_image *in, const vt_camera *pinhole,
                              vt_image *out);

#ifdef __cplusplus
}
#endif
#endif
