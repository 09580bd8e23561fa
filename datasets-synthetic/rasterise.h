// rasterise.h - which triangle each sample of a picture sees
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_RASTERISE_H
#define VT_DATASETS_SYNTHETIC_RASTERISE_H

#include <stdint.h>

#include "datasets-synthetic/mesh.h"

enum { VT_SAMPLE_UNITS = 256, VT_NO_TRIANGLE = -1 };

// A vertex on a grid of samples; sample (i, j) stands at ((i + 1/2), (j + 1/2)) VT_SAMPLE_UNITS.
typedef struct vt_projected {
  int32_t x, y; // VT_SAMPLE_UNITS to a sample, |x| and |y| < 2^29
  float near;   // grows towards the eye and is affine over the picture: 1/z, or -z of a parallel projection
} vt_projected;

// Twice the area in square units; with y down it is negative for a triangle that faces the eye.
int64_t vt_twice_area(const vt_projected *a, const vt_projected *b, const vt_projected *c);
static inline int64_t vt_sample_centre(int32_t sample) {
  return (int64_t)sample * VT_SAMPLE_UNITS + VT_SAMPLE_UNITS / 2;
}

typedef struct vt_sample_band { // rows [first_row, first_row + row_count) of a grid of samples
  int width, first_row, row_count;
  float *near;       // [row_count][width], -INFINITY where nothing is
  int32_t *triangle; // [row_count][width], VT_NO_TRIANGLE where nothing is; or NULL
} vt_sample_band;

void vt_clear_band(vt_sample_band *);
// Draws all triangles; of equally near ones the first wins. `hide_backs` leaves out solid ones whose inside would be
// seen.
void vt_draw_mesh(const vt_mesh *, const vt_projected *, bool hide_backs, vt_sample_band *);

#endif
