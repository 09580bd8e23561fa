// image_file_none.c - pictures on disk in builds without OpenImageIO: PAM only
// SPDX-License-Identifier: BSD-3-Clause
#include "base/image_pam.h"

#include <string.h>

static vt_status refuse(vt_context *context, const char *path) {
  return vt_fail(context, VT_MISSING_PROGRAM,
                 "%s: this build knows PAM pictures only; build voltree with OpenImageIO or convert it to .pam", path);
}

vt_status vt_read_image_info(vt_context *context, const char *path, vt_image_info *out) {
  memset(out, 0, sizeof *out);
  return vt_has_ending(path, "pam") ? vt_read_pam_info(context, path, out) : refuse(context, path);
}

vt_status vt_read_image(vt_context *context, const char *path, vt_image *out) {
  memset(out, 0, sizeof *out);
  return vt_has_ending(path, "pam") ? vt_read_pam(context, path, out) : refuse(context, path);
}

bool vt_is_output_name(const char *path, bool alpha) {
  (void)alpha;
  return vt_has_ending(path, "pam");
}

vt_status vt_write_image(vt_context *context, const char *path, const vt_image *image) {
  return vt_has_ending(path, "pam") ? vt_write_pam(context, path, image) : refuse(context, path);
}

vt_status vt_decode_image(vt_context *context, const uint8_t *bytes, size_t size, const char *name, vt_image *out) {
  memset(out, 0, sizeof *out);
  return vt_is_pam(bytes, size) ? vt_parse_pam(context, bytes, size, name, out) : refuse(context, name);
}

vt_status vt_encode_png(vt_context *context, const vt_image *image, uint8_t **bytes, size_t *size) {
  (void)image;
  *bytes = NULL;
  *size = 0;
  return vt_fail(context, VT_MISSING_PROGRAM, "PNG: this build cannot write it; build voltree with OpenImageIO");
}
