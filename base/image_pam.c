// image_pam.c - pictures as PAM files (P7 of Netpbm), the one format that needs no library
// SPDX-License-Identifier: BSD-3-Clause
//
//   P7 \n WIDTH w \n HEIGHT h \n DEPTH channels \n MAXVAL 1..65535 \n TUPLTYPE name \n ENDHDR \n  then the samples,
// rows from the top, channels interleaved, one byte each or (MAXVAL > 255) two, high byte first. Lines that are empty
// or begin with # say nothing. Alpha is straight. All of a header is checked against the bytes that are there before
// memory is asked for, so that a damaged size cannot ask for much.
#include "base/image_pam.h"

#include "base/file.h"
#include <string.h>

typedef struct pam_header {
  uint32_t width, height, depth, max_value; // 0: not said yet
  size_t size;                              // bytes before the first sample
} pam_header;

static bool starts_with(const char *line, size_t length, const char *word) {
  size_t n = strlen(word);
  return length > n && !memcmp(line, word, n) && (line[n] == ' ' || line[n] == '\t');
}

// The number behind a key, 1..limit; 0 if it is not one.
static uint32_t read_number(const char *line, size_t length, size_t key_length, uint32_t limit) {
  uint32_t value = 0;
  size_t i = key_length;
  while (i < length && (line[i] == ' ' || line[i] == '\t')) i++;
  if (i == length) return 0;
  for (; i < length && line[i] >= '0' && line[i] <= '9'; i++) {
    value = value * 10 + (uint32_t)(line[i] - '0');
    if (value > limit) return 0;
  }
  while (i < length && (line[i] == ' ' || line[i] == '\t' || line[i] == '\r')) i++;
  return i == length ? value : 0;
}

static bool parse_header(const uint8_t *bytes, size_t size, pam_header *header) {
  static const struct {
    const char *key;
    uint32_t limit;
  } keys[4] = {{"WIDTH", VT_MAX_IMAGE_SIDE}, {"HEIGHT", VT_MAX_IMAGE_SIDE}, {"DEPTH", 4}, {"MAXVAL", 65535}};
  memset(header, 0, sizeof *header);
  uint32_t *values[4] = {&header->width, &header->height, &header->depth, &header->max_value};
  const char *text = (const char *)bytes;
  if (size < 3 || memcmp(text, "P7\n", 3)) return false;
  for (size_t begin = 3; begin < size;) {
    const char *line = text + begin, *end = memchr(line, '\n', size - begin);
    if (!end) return false;
    size_t length = (size_t)(end - line);
    begin += length + 1;
    if (length == 6 && !memcmp(line, "ENDHDR", 6)) {
      header->size = begin;
      return header->width && header->height && header->depth && header->max_value;
    }
    for (int i = 0; i < 4; i++) {
      if (!starts_with(line, length, keys[i].key)) continue;
      *values[i] = read_number(line, length, strlen(keys[i].key), keys[i].limit);
      if (!*values[i]) return false;
    }
  }
  return false;
}

bool vt_is_pam(const uint8_t *bytes, size_t size) {
  return size >= 3 && !memcmp(bytes, "P7\n", 3);
}

// Finds header and samples good.
static vt_status check_pam(vt_context *context, const uint8_t *bytes, size_t size, const char *name,
                           pam_header *header) {
  if (!parse_header(bytes, size, header))
    return vt_fail(context, VT_BAD_INPUT,
                   "%s: not a PAM picture of at most 65535 pixels a side and 4 channels; write it again", name);
  if ((uint64_t)header->width * header->height * header->depth * (header->max_value > 255 ? 2 : 1) >
      size - header->size)
    return vt_fail(context, VT_BAD_INPUT, "%s: ends before its last row; copy or write it again", name);
  return VT_OK;
}

vt_status vt_read_pam_info(vt_context *context, const char *path, vt_image_info *out) {
  uint8_t *bytes;
  size_t size;
  pam_header header;
  memset(out, 0, sizeof *out);
  vt_status status = vt_read_file(context, path, &bytes, &size);
  if (!status) status = check_pam(context, bytes, size, path, &header);
  vt_free(context, bytes);
  if (status) return status;
  out->width = (int)header.width;
  out->height = (int)header.height;
  out->channels = (int)header.depth;
  out->orientation = 1;
  return VT_OK;
}

// Samples of one row as 0..255, still interleaved as in the file.
static void scale_row(const uint8_t *from, size_t count, uint32_t max_value, uint8_t *to) {
  for (size_t i = 0; i < count; i++) {
    uint32_t v = max_value > 255 ? (uint32_t)from[2 * i] << 8 | from[2 * i + 1] : from[i];
    to[i] = (uint8_t)(v >= max_value ? 255 : (v * 255u + max_value / 2) / max_value);
  }
}

vt_status vt_parse_pam(vt_context *context, const uint8_t *bytes, size_t size, const char *name, vt_image *out) {
  uint8_t *row = NULL;
  pam_header h;
  memset(out, 0, sizeof *out);
  vt_status status = check_pam(context, bytes, size, name, &h);
  if (status) return status;
  int channels = h.depth == 2 || h.depth == 4 ? 4 : 3;
  size_t samples = (size_t)h.width * h.depth, row_size = samples * (h.max_value > 255 ? 2 : 1);
  status = vt_make_image(context, (int)h.width, (int)h.height, channels, out);
  if (status) goto done;
  row = vt_alloc(context, samples, 1);
  if (!row) {
    status = VT_OUT_OF_MEMORY;
    goto done;
  }
  for (size_t y = 0; y < h.height; y++) {
    uint8_t *to = out->pixels + y * h.width * (size_t)channels;
    scale_row(bytes + h.size + y * row_size, samples, h.max_value, row);
    if (h.depth >= 3) {
      memcpy(to, row, samples);
      continue;
    }
    for (size_t x = 0; x < h.width; x++, to += channels) {
      memset(to, row[x * h.depth], 3);
      if (h.depth == 2) to[3] = row[2 * x + 1];
    }
  }
done:
  vt_free(context, row);
  if (status) vt_free_image(context, out);
  return status;
}

vt_status vt_read_pam(vt_context *context, const char *path, vt_image *out) {
  uint8_t *bytes;
  size_t size;
  memset(out, 0, sizeof *out);
  vt_status status = vt_read_file(context, path, &bytes, &size);
  if (!status) status = vt_parse_pam(context, bytes, size, path, out);
  vt_free(context, bytes);
  return status;
}

vt_status vt_write_pam(vt_context *context, const char *path, const vt_image *image) {
  static const char *const kinds[5] = {NULL, "GRAYSCALE", NULL, "RGB", "RGB_ALPHA"};
  char header[160];
  VT_ASSERT(image->channels == 1 || image->channels == 3 || image->channels == 4);
  int length = snprintf(header, sizeof header, "P7\nWIDTH %d\nHEIGHT %d\nDEPTH %d\nMAXVAL 255\nTUPLTYPE %s\nENDHDR\n",
                        image->width, image->height, image->channels, kinds[image->channels]);
  size_t pixels = (size_t)image->width * (size_t)image->height * (size_t)image->channels;
  uint8_t *bytes = vt_alloc(context, (size_t)length + pixels, 1);
  if (!bytes) return VT_OUT_OF_MEMORY;
  memcpy(bytes, header, (size_t)length);
  memcpy(bytes + length, image->pixels, pixels);
  vt_status status = vt_write_file(context, path, bytes, (size_t)length + pixels);
  vt_free(context, bytes);
  return status;
}
