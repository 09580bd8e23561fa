// adjust_lens.h - lenses, and cameras with them, adjusted to the tracks that a calibration left
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_ADJUST_LENS_H
#define VT_CAPTURE_ADJUST_LENS_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_lens_report {
  bool tried, kept;
  const char *why;         // a phrase
  size_t sight_count;      // that it was adjusted to
  double before, after;    // root mean square distance of sights that were held back, in their deviations
  double focal_share;      // mean change of the focal lengths
  double corner_pixels;    // mean over lenses: by how much a corner of the photograph moves at the same focal length
} vt_lens_report;

// Changes lenses (focal length, k1, k2, p1, p2 of all photographs that share one) and poses where points that were held back are
// then seen more nearly where they should be; landmarks move with them. Nothing is touched otherwise: without pixels of landmarks,
// with few of them, with pinhole lenses (their pictures were straightened before), without Ceres. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_adjust_lenses(vt_context *, vt_photos *, vt_lens_report *);

#ifdef __cplusplus
}
#endif
#endif
