// masks.h - which mask belongs to which photograph, and what it does to it
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_MASKS_H
#define VT_CAPTURE_MASKS_H

#include "base/file.h"
#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

// True for "a.mask.png", "a_mask.png" and for files in a folder of masks: no photographs, whatever they look like.
bool vt_is_mask_name(const char *name);
// Takes the files of the folder `inner` out of `names`, which are those in `folder`.
void vt_drop_inside(vt_context *, const char *folder, const char *inner, vt_names *names);
// Fills photo.mask of every photograph whose mask is found: in the folder `chosen`, or all with the file `chosen`, if that is
// not NULL, else by the usual rules in and below `root` (the capture's folder); logs the rules that matched. *found: how
// many have one.
vt_status vt_find_masks(vt_context *, const char *chosen, const char *root, vt_photos *photos, int *found);
// Fills photo.ignored likewise from the folder or file `chosen`, if that is not NULL. Photographs without one count whole.
// VT_BAD_INPUT if none has one.
vt_status vt_find_ignored(vt_context *, const char *chosen, vt_photos *photos);
// What photo.ignored marks, as 0 and 255, at width x height. The caller frees `out`.
vt_status vt_read_ignored(vt_context *, const vt_photo *, int width, int height, vt_image *out);
// What --ignore marks of the photographs `names` in `folder`, for COLMAP's --ImageReader.mask_path: to/NAME.png at each one's
// own size, black where no features are to be looked for. *written: how many; the others have none, as COLMAP allows.
vt_status vt_write_colmap_masks(vt_context *, const char *chosen, const char *folder, const vt_names *names, const char *to,
                                int *written);
// Makes `picture` (3 or 4 channels) RGBA with the photograph's mask as alpha; white is tree unless `invert`.
// *border_share: the part of the picture's border that is tree.
vt_status vt_apply_mask(vt_context *, const vt_photo *, bool invert, vt_image *picture, double *border_share);
// `picture` as RGBA with alpha 255 everywhere.
vt_status vt_make_opaque(vt_context *, vt_image *picture);

#ifdef __cplusplus
}
#endif
#endif
