// backdrop_model.h - what the backdrop of one photograph looks like, place by place
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_BACKDROP_MODEL_H
#define VT_CAPTURE_BACKDROP_MODEL_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_backdrop_tile {
  float mean[3];    // colour, 0..255
  float inverse[6]; // of its covariance: xx xy xz yy yz zz
  bool known;       // most of the tile is backdrop, or enough of it
  uint8_t rounds;   // since it became known
} vt_backdrop_tile;

typedef struct vt_backdrop {
  int x0, y0, x1, y1;      // the picture without bars of one colour beside it; what is outside is backdrop
  int tile;                // edge of a tile, pixels
  int columns, rows;       // the grid starts at the picture's corner
  vt_backdrop_tile *tiles; // [rows][columns]; owned
  bool careful;            // as it was asked for
} vt_backdrop;

// Finds the backdrop of an RGB picture by itself: dark or light cloth or paper.
// careful: for a plant that is hardly farther from the backdrop than its folds.
vt_status vt_model_backdrop(vt_context *, const vt_image *rgb, bool careful, vt_backdrop *out);
void vt_free_backdrop(vt_context *, vt_backdrop *);
// The share of the left, right and upper border that one smooth surface explains: near 1 before a plain backdrop.
vt_status vt_measure_plainness(vt_context *, const vt_image *rgb, double *share);
// Mahalanobis distance, in standard deviations, of a pixel's colour from the likest of the nine tiles around it;
// 0..VT_FAR. x, y inside x0..x1-1, y0..y1-1.
#define VT_FAR 60.0f
float vt_backdrop_distance(const vt_backdrop *, const uint8_t colour[3], int x, int y);

#ifdef __cplusplus
}
#endif
#endif
