// colmap_photos.h - photographs as colmap wants them: readable, and grouped by their camera
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_COLMAP_PHOTOS_H
#define VT_CAPTURE_COLMAP_PHOTOS_H

#include "base/file.h"
#include "base/image_file.h"

#ifdef __cplusplus
extern "C" {
#endif

// The headers of all photographs; where not `strict`, one that cannot be read counts as a picture without size.
vt_status vt_read_headers(vt_context *, const char *folder, const vt_names *names, bool strict, vt_image_info *infos);
// Which photographs share a camera: those whose make, model, focal length and size agree. group[count] counts from 0 in the
// order of the photographs. Returns their number.
int vt_group_photographs(const vt_image_info *infos, int count, int *group);
// One name a line of the photographs of a group.
vt_status vt_write_photo_list(vt_context *, const vt_names *names, const int *group, int which, const char *path);
// *images: a folder with the same names, where colmap can read all of them: `folder` itself, or links and copies in
// workspace/images. Free with vt_free.
vt_status vt_make_readable(vt_context *, const char *folder, const vt_names *names, const char *workspace, char **images);

#ifdef __cplusplus
}
#endif
#endif
