// image.h - pictures in memory
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_IMAGE_H
#define VT_BASE_IMAGE_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

// 8 bits a channel, rows from the top, channels interleaved. RGBA has straight alpha, colours are sRGB-encoded.
typedef struct vt_image {
  int width, height, channels; // channels 1 (grey or alpha), 3 (RGB) or 4 (RGBA)
  uint8_t *pixels;             // [height][width][channels]; owned
} vt_image;

// float, nominal range 0..1, same layout. RGBA is premultiplied, sRGB-encoded values.
typedef struct vt_fimage {
  int width, height, channels;
  float *pixels; // [height][width][channels]; owned
} vt_fimage;

// Zeroed pictures. VT_OUT_OF_MEMORY. Free with vt_free_image / vt_free_fimage (a zeroed struct may be freed).
vt_status vt_make_image(vt_context *, int width, int height, int channels, vt_image *out);
vt_status vt_make_fimage(vt_context *, int width, int height, int channels, vt_fimage *out);
void vt_free_image(vt_context *, vt_image *);
void vt_free_fimage(vt_context *, vt_fimage *);

// Straight 8-bit RGBA from premultiplied float RGBA, and back. Colour of alpha 0 is 0.
vt_status vt_image_from_fimage(vt_context *, const vt_fimage *premultiplied_rgba, vt_image *out_straight_rgba);
vt_status vt_fimage_from_image(vt_context *, const vt_image *straight_rgba, vt_fimage *out_premultiplied_rgba);
// Over a constant background (sRGB-encoded, 0..1): RGB, 3 channels.
vt_status vt_flatten(vt_context *, const vt_fimage *premultiplied_rgba, const float background[3], vt_image *out_rgb);
// A picture reduced by `factor` >= 1 (each side divided, rounded up) by a box filter that averages premultiplied colour
// and alpha, and gives straight RGBA back; the colour of fully transparent pixels is averaged unweighted.
vt_status vt_reduce_image(vt_context *, const vt_image *straight_rgba, int factor, vt_image *out);
// A one-channel picture reduced in the same way, each pixel the greatest of those it stands for.
vt_status vt_pool_image(vt_context *, const vt_image *grey, int factor, vt_image *out);
// Copies `source` into `target` with its top left corner at (x, y), clipped; channels must match.
void vt_paste(vt_image *target, const vt_image *source, int x, int y);

#ifdef __cplusplus
}
#endif
#endif
