// image_file.h - pictures on disk and in memory (OpenImageIO; image_file_none.c knows PAM only)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_IMAGE_FILE_H
#define VT_BASE_IMAGE_FILE_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_image_info {
  int width, height, channels; // as stored, before any orientation is applied
  int orientation;             // EXIF 1..8; 1 if absent
  double focal_35mm;           // EXIF focal length in 35 mm film, mm; 0 if absent
  double focal_mm;             // EXIF focal length, mm; 0 if absent
  char make[64], model[64];    // EXIF; "" if absent
} vt_image_info;

// True if the name ends like a picture that can be read (jpg jpeg png tif tiff exr webp heic heif avif bmp pam and raw kinds).
bool vt_is_image_name(const char *path);
// True if the name ends like a picture that vt_write_image can write in this build; with alpha, if it keeps alpha.
bool vt_is_output_name(const char *path, bool alpha);
// Reads the header. VT_BAD_INPUT naming the file if it is no picture, empty or damaged.
vt_status vt_read_image_info(vt_context *, const char *path, vt_image_info *out);
// Reads a picture as 8-bit sRGB: grey, grey+alpha, RGB, RGBA of any depth become 3 channels (opaque) or 4 (alpha in the
// file, straight). Pixels as stored: the EXIF orientation is NOT applied. VT_BAD_INPUT naming the file if it cannot be
// decoded to the last row. The caller frees `out`.
vt_status vt_read_image(vt_context *, const char *path, vt_image *out);
// One channel: alpha if the file has it, else luma. For masks. As vt_read_image otherwise.
vt_status vt_read_mask(vt_context *, const char *path, vt_image *out);
// Writes 1, 3 or 4 channels, format by the ending (png jpg tif pam), to a temporary name that is renamed when complete.
// VT_FAILED naming the file.
vt_status vt_write_image(vt_context *, const char *path, const vt_image *image);

// ---- pictures in memory, as other files carry them
// Decodes the bytes of a PNG, JPEG, WebP, TIFF, BMP or PAM file (told by their first bytes) as vt_read_image does.
// VT_BAD_INPUT naming `name`; VT_MISSING_PROGRAM in builds that know PAM only. The caller frees `out`.
vt_status vt_decode_image(vt_context *, const uint8_t *bytes, size_t size, const char *name, vt_image *out);
// The bytes of a PNG file of 1, 3 or 4 channels: the same picture, the same bytes. VT_MISSING_PROGRAM in builds without
// OpenImageIO. Free *bytes with vt_free.
vt_status vt_encode_png(vt_context *, const vt_image *image, uint8_t **bytes, size_t *size);

#ifdef __cplusplus
}
#endif
#endif
