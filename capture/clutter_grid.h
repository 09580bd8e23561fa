// clutter_grid.h - how often a colour is tree, and how often not, at places of a picture
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_CLUTTER_GRID_H
#define VT_CAPTURE_CLUTTER_GRID_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VT_GRID_PLACES = 144, VT_GRID_COLOURS = 2880 }; // cells of position; of colour and roughness

typedef struct vt_spot { // what a cell is found by
  float lab[3], step;    // CIELab; how much it changes from pixel to pixel around
  float x, y;            // share of the picture, 0..1
} vt_spot;

// A grid is float [places][VT_GRID_COLOURS][2]: masses of tree and of rest, in pixels; places is 1 or VT_GRID_PLACES.
// Adds a pixel that is tree with certainty p.
void vt_add_to_grid(float *grid, int places, const vt_spot *, float p, float weight);
// Blurs by [1 2 1] / 4 along colour, and along position where there are places.
void vt_blur_grid(float *grid, int places);
// Masses of tree and of rest at a spot, in `near` (of VT_GRID_PLACES) and in `general` (of one), read linearly.
void vt_read_grids(const float *near, const float *general, const vt_spot *, float near_masses[2],
                   float general_masses[2]);

#ifdef __cplusplus
}
#endif
#endif
