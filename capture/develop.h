// develop.h - from calibrated photographs to views: reading, mattes, undistortion, reduction
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_DEVELOP_H
#define VT_CAPTURE_DEVELOP_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

// Decides where the mattes come from (report->matte), looking for masks in `root`, and takes the photographs that lack
// what that needs out of `photos` into report->left_out.
vt_status vt_choose_mattes(vt_context *, const vt_capture_desc *, const char *root, vt_photos *photos,
                           vt_capture_report *report);
// A view of every photograph, in the same order, with the mattes that were chosen. Takes the names from `photos`.
vt_status vt_develop_photos(vt_context *, const vt_capture_desc *, vt_photos *photos, vt_capture_report *report,
                            vt_views *out);

#ifdef __cplusplus
}
#endif
#endif
