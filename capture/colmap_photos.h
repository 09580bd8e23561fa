// colmap_photos.h - photographs as colmap wants them: readable, and grouped by their camera
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_COLMAP_PHOTOS_H
#define VT_CAPTURE_COLMAP_PHOTOS_H

#include "base/file.h"
#include "base/image_file.h"

#ifdef __cplusplus
extern "C" {
#endif

// Which photographs share a camera: those whose make, model, focal length and size agree. group[names->count] counts from 0 in
// the order of the photographs. infos (or NULL): their headers.
vt_status vt_group_photographs(vt_context *, const char *folder, const vt_names *names, int *group, vt_image_info *infos,
                               int *group_count);
// One name a line of the photographs of a group.
vt_status vt_write_photo_list(vt_context *, const vt_names *names, const int *group, int which, const char *path);
// *images: a folder with the same names, where colmap can read all of them: `folder` itself, or links and copies in
// workspace/images. Free with vt_free.
vt_status vt_make_readable(vt_context *, const char *folder, const vt_names *names, const char *workspace, char **images);

#ifdef __cplusplus
}
#endif
#endif
