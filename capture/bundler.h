// bundler.h - reading cameras of Bundler, and projection matrices
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_BUNDLER_H
#define VT_CAPTURE_BUNDLER_H

#include "base/file.h"
#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

// Adds the cameras of a Bundler file (.out) to `photos`; the photographs are named by list.txt beside it. Those that
// Bundler did not place (focal length 0) go into the report. VT_BAD_INPUT naming the file.
vt_status vt_read_bundler(vt_context *, const char *path, vt_photos *photos, vt_capture_report *report);

// A 3x4 matrix (row-major) that takes world points to pixels, as lens and pose. False if it is none of a camera.
bool vt_split_projection(const double p[12], vt_lens *lens, vt_mat3 *rotation, vt_vec3 *translation);
// True if a photograph of `names` in `folder` has its matrix beside it: NAME.P or NAME.txt with twelve numbers (a word
// CONTOUR in front is allowed), there or in txt/.
bool vt_has_projections(vt_context *, const char *folder, const vt_names *names);
// Adds the photographs that have one; the others go into the report. VT_BAD_INPUT naming the file.
vt_status vt_read_projections(vt_context *, const char *folder, const vt_names *names, vt_photos *photos,
                              vt_capture_report *report);

#ifdef __cplusplus
}
#endif
#endif
