// image_pam.h - what image_file_oiio.cc and image_file_none.c share: names, PAM files, a look at PNG files
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_IMAGE_PAM_H
#define VT_BASE_IMAGE_PAM_H

#include "base/image_file.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VT_MAX_IMAGE_SIDE 65535

bool vt_has_ending(const char *path, const char *ending);     // without its dot, in any case
bool vt_is_cut_png(const char *path);                         // a PNG file that ends before its last chunk does
bool vt_are_cut_png_bytes(const uint8_t *bytes, size_t size); // the same in memory
bool vt_is_pam(const uint8_t *bytes, size_t size);            // it begins like one
vt_status vt_read_pam_info(vt_context *, const char *path, vt_image_info *out);
vt_status vt_read_pam(vt_context *, const char *path, vt_image *out); // 3 or 4 channels, see vt_read_image
vt_status vt_parse_pam(vt_context *, const uint8_t *bytes, size_t size, const char *name, vt_image *out);
vt_status vt_write_pam(vt_context *, const char *path, const vt_image *image);

#ifdef __cplusplus
}
#endif
#endif
