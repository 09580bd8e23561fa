// sky_model.h - where a photograph shows sky, and what the sky looks like behind the tree
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_SKY_MODEL_H
#define VT_CAPTURE_SKY_MODEL_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_sky_tile {
  float mean[3];    // colour, 0..255
  float inverse[6]; // of its covariance: xx xy xz yy yz zz
  int pixels;       // of this tile that are sky
  uint8_t window;   // three by three squares of 2^window tiles around it hold enough sky that is free of the tree
} vt_sky_tile;

enum { VT_SKY_BINS = 16 }; // along each channel

typedef struct vt_sky {
  int width, height;     // of the picture
  int tile;              // edge, pixels
  int columns, rows;     //
  vt_sky_tile *tiles;    // [rows][columns]; owned
  bool colours[VT_SKY_BINS * VT_SKY_BINS * VT_SKY_BINS]; // which the sky has where it is free of the tree
  float noise;           // of a channel, standard deviation, levels
  double share;          // of the picture that is sky
  double top_share;      // of its upper edge that sky touches
  double horizon[2];     // row at the left and at the right edge below which there is ground; height: none
} vt_sky;

// Finds the sky of an RGB picture. share is 0 where there is none; tiles are then black.
vt_status vt_model_sky(vt_context *, const vt_image *rgb, vt_sky *out);
void vt_free_sky(vt_context *, vt_sky *);
// Mahalanobis distance of a colour from the sky at its place, standard deviations, 0..VT_SKY_FAR.
#define VT_SKY_FAR 60.0f
float vt_sky_distance(const vt_sky *, const uint8_t colour[3], int x, int y);
// True if the sky has this colour anywhere.
bool vt_is_sky_colour(const vt_sky *, const uint8_t colour[3]);
// The sky's colour behind a pixel, 0..255.
void vt_sky_colour(const vt_sky *, int x, int y, float colour[3]);
// True if (x, y) lies below the horizon.
static inline bool vt_is_ground(const vt_sky *sky, int x, int y) {
  return (double)y >= sky->horizon[0] + (sky->horizon[1] - sky->horizon[0]) * ((double)x + 0.5) / (double)sky->width;
}

#ifdef __cplusplus
}
#endif
#endif
