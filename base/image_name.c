// image_name.c - what every reader of pictures shares: names, masks, a look at PNG files
// SPDX-License-Identifier: BSD-3-Clause
#include "base/image_pam.h"

#include "base/file.h"
#include <string.h>
#include <strings.h>
#include <sys/types.h>

bool vt_has_ending(const char *path, const char *ending) {
  const char *name = vt_base_name(path), *dot = strrchr(name, '.');
  return dot && dot != name && !strcasecmp(dot + 1, ending);
}

bool vt_is_image_name(const char *path) {
  static const char *const endings[] = {"jpg",  "jpeg", "png",  "tif",  "tiff", "exr",
                                        "webp", "heic", "heif", "avif", "bmp",  "pam", // developed pictures
                                        "dng",  "cr2",  "cr3",  "nef",  "nrw",  "arw",
                                        "sr2",  "orf",  "raf",  "rw2",  "pef",  "raw", // as the sensor saw them
                                        "srw",  "3fr",  "iiq",  "erf",  "mrw",  "x3f",
                                        "kdc",  "dcr",  "mef",  "mos",  "crw",  "rwl"};
  for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
    if (vt_has_ending(path, endings[i])) return true;
  return false;
}

// A PNG file is a signature and chunks: size (4 bytes, high first), name (4), data, checksum (4); the last is IEND.
bool vt_is_cut_png(const char *path) {
  unsigned char head[8];
  bool cut = false;
  FILE *file = fopen(path, "rb");
  if (!file) return false;
  if (fread(head, 1, 8, file) == 8 && !memcmp(head, "\x89PNG\r\n\x1a\n", 8)) {
    off_t size = fseeko(file, 0, SEEK_END) ? 0 : ftello(file), at = 8;
    for (bool last = false; !last && !cut;) {
      cut = fseeko(file, at, SEEK_SET) || fread(head, 1, 8, file) != 8;
      at += 12 + ((off_t)head[0] << 24 | (off_t)head[1] << 16 | (off_t)head[2] << 8 | (off_t)head[3]);
      cut = cut || at > size;
      last = !memcmp(head + 4, "IEND", 4);
    }
  }
  fclose(file);
  return cut;
}

bool vt_are_cut_png_bytes(const uint8_t *bytes, size_t size) {
  if (size < 8 || memcmp(bytes, "\x89PNG\r\n\x1a\n", 8)) return false;
  for (size_t at = 8;;) {
    if (size - at < 12) return true;
    const uint8_t *head = bytes + at;
    size_t length = (size_t)head[0] << 24 | (size_t)head[1] << 16 | (size_t)head[2] << 8 | (size_t)head[3];
    if (length > size - at - 12) return true;
    if (!memcmp(head + 4, "IEND", 4)) return false;
    at += 12 + length;
  }
}

vt_status vt_read_mask(vt_context *context, const char *path, vt_image *out) {
  vt_image picture = {0};
  *out = picture;
  vt_status status = vt_read_image(context, path, &picture);
  if (!status) status = vt_make_image(context, picture.width, picture.height, 1, out);
  if (status) {
    vt_free_image(context, &picture);
    return status;
  }
  size_t count = (size_t)picture.width * (size_t)picture.height;
  const uint8_t *p = picture.pixels;
  if (picture.channels == 4)
    for (size_t i = 0; i < count; i++) out->pixels[i] = p[4 * i + 3];
  else // luma of ITU-R BT.601 in 256ths: their sum is 256, so that grey stays the same grey
    for (size_t i = 0; i < count; i++)
      out->pixels[i] = (uint8_t)((77u * p[3 * i] + 150u * p[3 * i + 1] + 29u * p[3 * i + 2] + 128u) >> 8);
  vt_free_image(context, &picture);
  return VT_OK;
}
