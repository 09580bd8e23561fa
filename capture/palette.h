// palette.h - the few colours of the tree that occur in each part of a photograph
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_PALETTE_H
#define VT_CAPTURE_PALETTE_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VT_PALETTE_COLOURS = 6 };

typedef struct vt_palette_cell {
  int count;                               // of colours, 0..VT_PALETTE_COLOURS
  float light[VT_PALETTE_COLOURS][3];      // linear, 0..1
  float variance[VT_PALETTE_COLOURS][3];   // of linear light
} vt_palette_cell;

typedef struct vt_palette {
  int edge; // of a cell, pixels
  int columns, rows;
  vt_palette_cell *cells; // [rows][columns]; owned
} vt_palette;

// From the pixels where known[height][width] is not 0; a cell with few of them looks around. All counts are 0 if there
// are none at all.
vt_status vt_make_palette(vt_context *, const vt_image *rgb, const uint8_t *known, vt_palette *out);
void vt_free_palette(vt_context *, vt_palette *);
static inline const vt_palette_cell *vt_palette_at(const vt_palette *p, int x, int y) {
  return &p->cells[(size_t)(y / p->edge) * (size_t)p->columns + (size_t)(x / p->edge)];
}

#ifdef __cplusplus
}
#endif
#endif
