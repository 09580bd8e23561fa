// masks.h - which mask belongs to which photograph, and what it does to it
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_MASKS_H
#define VT_CAPTURE_MASKS_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

// True for "a.mask.png", "a_mask.png" and for files in a folder of masks: no photographs, whatever they look like.
bool vt_is_mask_name(const char *name);
// Fills photo.mask of every photograph whose mask is found, in `chosen_folder` if that is not NULL, else by the usual
// rules in and below `root` (the capture's folder); logs the rules that matched. *found: how many have one.
vt_status vt_find_masks(vt_context *, const char *chosen_folder, const char *root, vt_photos *photos, int *found);
// Makes `picture` (3 or 4 channels) RGBA with the photograph's mask as alpha; white is tree unless `invert`.
// *border_share: the part of the picture's border that is tree.
vt_status vt_apply_mask(vt_context *, const vt_photo *, bool invert, vt_image *picture, double *border_share);
// `picture` as RGBA with alpha 255 everywhere.
vt_status vt_make_opaque(vt_context *, vt_image *picture);

#ifdef __cplusplus
}
#endif
#endif
