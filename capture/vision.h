// vision.h - what is taken from a computer vision library (OpenCV)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_VISION_H
#define VT_CAPTURE_VISION_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

// Rows [first, first + rows) of `out` from `in` (1, 3 or 4 channels, as `out`) by bicubic interpolation: pixel i of these
// rows is what `in` has at (x[i], y[i]), counted from the centre of its first pixel; beyond its border the border is
// repeated. VT_MISSING_PROGRAM without OpenCV.
vt_status vt_resample_rows(vt_context *, const vt_image *in, const float *x, const float *y, int first, int rows,
                           vt_image *out);

#define VT_MAX_MARKERS 256
typedef struct vt_marker {
  int id;
  double corners[4][2]; // pixels, the first pixel's centre at (0.5, 0.5); clockwise from the marker's own top left
} vt_marker;
// The square markers of an ArUco dictionary of 4x4, 5x5, 6x6 or 7x7 cells (cells = 4..7) that a grey picture shows, their
// corners to a part of a pixel, by number; *count of them. VT_MISSING_PROGRAM without OpenCV's aruco.
vt_status vt_find_markers(vt_context *, const vt_image *grey, int cells, vt_marker out[VT_MAX_MARKERS], int *count);

#ifdef __cplusplus
}
#endif
#endif
