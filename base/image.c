// image.c - making, freeing, converting and reducing pictures
// SPDX-License-Identifier: BSD-3-Clause

#include "base/image.h"

#include <string.h>

static bool size_is_sane(int width, int height, int channels) {
  return width > 0 && height > 0 && width <= 65535 && height <= 65535 && channels >= 1 && channels <= 4;
}

vt_status vt_make_image(vt_context *context, int width, int height, int channels, vt_image *out) {
  VT_ASSERT(size_is_sane(width, height, channels));
  *out = (vt_image){width, height, channels, vt_alloc(context, (size_t)width * (size_t)height, (size_t)channels)};
  return out->pixels ? VT_OK : VT_OUT_OF_MEMORY;
}

vt_status vt_make_fimage(vt_context *context, int width, int height, int channels, vt_fimage *out) {
  VT_ASSERT(size_is_sane(width, height, channels));
  size_t count = (size_t)width * (size_t)height * (size_t)channels;
  *out = (vt_fimage){width, height, channels, VT_NEW(context, float, count)};
  return out->pixels ? VT_OK : VT_OUT_OF_MEMORY;
}

void vt_free_image(vt_context *context, vt_image *image) {
  vt_free(context, image->pixels);
  *image = (vt_image){0};
}

void vt_free_fimage(vt_context *context, vt_fimage *image) {
  vt_free(context, image->pixels);
  *image = (vt_fimage){0};
}

static uint8_t byte_from_unit(float v) { return (uint8_t)(v <= 0 ? 0 : v >= 1 ? 255 : (int)(v * 255 + 0.5f)); }

vt_status vt_image_from_fimage(vt_context *context, const vt_fimage *in, vt_image *out) {
  VT_ASSERT(in->channels == 4);
  vt_status status = vt_make_image(context, in->width, in->height, 4, out);
  if (status) return status;
  size_t count = (size_t)in->width * (size_t)in->height;
  for (size_t i = 0; i < count; i++) {
    const float *p = in->pixels + 4 * i;
    uint8_t *q = out->pixels + 4 * i;
    q[3] = byte_from_unit(p[3]);
    if (q[3])
      for (int c = 0; c < 3; c++) q[c] = byte_from_unit(p[c] / p[3]);
  }
  return VT_OK;
}

vt_status vt_fimage_from_image(vt_context *context, const vt_image *in, vt_fimage *out) {
  VT_ASSERT(in->channels == 4);
  vt_status status = vt_make_fimage(context, in->width, in->height, 4, out);
  if (status) return status;
  size_t count = (size_t)in->width * (size_t)in->height;
  for (size_t i = 0; i < count; i++) {
    const uint8_t *p = in->pixels + 4 * i;
    float *q = out->pixels + 4 * i;
    q[3] = (float)p[3] / 255.0f;
    for (int c = 0; c < 3; c++) q[c] = (float)p[c] / 255.0f * q[3];
  }
  return VT_OK;
}

vt_status vt_flatten(vt_context *context, const vt_fimage *in, const float background[3], vt_image *out) {
  VT_ASSERT(in->channels == 4);
  vt_status status = vt_make_image(context, in->width, in->height, 3, out);
  if (status) return status;
  size_t count = (size_t)in->width * (size_t)in->height;
  for (size_t i = 0; i < count; i++) {
    const float *p = in->pixels + 4 * i;
    for (int c = 0; c < 3; c++) out->pixels[3 * i + (size_t)c] = byte_from_unit(p[c] + (1 - p[3]) * background[c]);
  }
  return VT_OK;
}

// One output pixel: premultiplied averages; the plain colour average stands in where nothing is opaque.
static void reduce_pixel(const vt_image *in, int factor, int ox, int oy, uint8_t *out) {
  unsigned long alpha = 0, count = 0, premultiplied[3] = {0}, plain[3] = {0};
  for (int y = oy * factor; y < (oy + 1) * factor && y < in->height; y++)
    for (int x = ox * factor; x < (ox + 1) * factor && x < in->width; x++) {
      const uint8_t *p = in->pixels + 4 * ((size_t)y * (size_t)in->width + (size_t)x);
      for (int c = 0; c < 3; c++) premultiplied[c] += (unsigned long)p[c] * p[3], plain[c] += p[c];
      alpha += p[3];
      count++;
    }
  for (int c = 0; c < 3; c++)
    out[c] = (uint8_t)(alpha ? (premultiplied[c] + alpha / 2) / alpha : (plain[c] + count / 2) / count);
  out[3] = (uint8_t)((alpha + count / 2) / count);
}

vt_status vt_reduce_image(vt_context *context, const vt_image *in, int factor, vt_image *out) {
  VT_ASSERT(in->channels == 4 && factor >= 1);
  int width = (in->width + factor - 1) / factor, height = (in->height + factor - 1) / factor;
  vt_status status = vt_make_image(context, width, height, 4, out);
  if (status) return status;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      reduce_pixel(in, factor, x, y, out->pixels + 4 * ((size_t)y * (size_t)width + (size_t)x));
  return VT_OK;
}

vt_status vt_pool_image(vt_context *context, const vt_image *in, int factor, vt_image *out) {
  VT_ASSERT(in->channels == 1 && factor >= 1);
  int width = (in->width + factor - 1) / factor, height = (in->height + factor - 1) / factor;
  vt_status status = vt_make_image(context, width, height, 1, out);
  if (status) return status;
  for (int y = 0; y < in->height; y++)
    for (int x = 0; x < in->width; x++) {
      uint8_t from = in->pixels[(size_t)y * (size_t)in->width + (size_t)x];
      uint8_t *to = &out->pixels[(size_t)(y / factor) * (size_t)width + (size_t)(x / factor)];
      if (from > *to) *to = from;
    }
  return VT_OK;
}

void vt_paste(vt_image *target, const vt_image *source, int x, int y) {
  VT_ASSERT(target->channels == source->channels);
  int left = x < 0 ? -x : 0, right = source->width < target->width - x ? source->width : target->width - x;
  if (right <= left) return;
  for (int row = y < 0 ? -y : 0; row < source->height && row + y < target->height; row++)
    memcpy(target->pixels + ((size_t)(row + y) * (size_t)target->width + (size_t)(x + left)) * (size_t)target->channels,
           source->pixels + ((size_t)row * (size_t)source->width + (size_t)left) * (size_t)source->channels,
           (size_t)(right - left) * (size_t)source->channels);
}
