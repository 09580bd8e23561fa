// world.h - which way is up, and how long a unit is
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_WORLD_H
#define VT_CAPTURE_WORLD_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_up { // what the cameras say
  vt_vec3 direction;   // unit; zero: they do not say it
  double error;        // radians, about; NAN where it cannot be told
  const char *by;      // what said it
} vt_up;

// Up from the cameras alone.
vt_up vt_find_up(const vt_photos *);
// Fills photos->world: up as the source says it, else z where that is up, else from the cameras; metres from marks or markers
// where the desc has them. VT_BAD_INPUT naming what cannot be used.
vt_status vt_find_world(vt_context *, const vt_capture_desc *, bool z_is_up, vt_photos *photos);

// ---- points that are seen in several photographs (points.c)
typedef struct vt_sighting {
  int photo;       // index
  double pixel[2]; // in the photograph as its camera sees it; the first pixel's centre at (0.5, 0.5)
} vt_sighting;

typedef struct vt_point {
  vt_vec3 place;       // world
  double rms;          // pixels, of the sightings
  double worst;        // pixels
  int worst_sighting;  //
  double angle;        // radians, the widest between two of its rays
} vt_point;
// The point whose pictures are nearest to its sightings. False if they are fewer than two, or their rays are parallel.
bool vt_triangulate(const vt_photos *, const vt_sighting *, int count, vt_point *out);

#define VT_LEAST_ANGLE (1 * VT_PI / 180) // between two rays, below which a place is worth nothing

// A length that is known between two points that were found.
typedef struct vt_span { double units, metres; } vt_span;
// metres_per_unit: the median over spans of metres / units. *spread: half the range of the middle half, as a share.
double vt_scale_of_spans(vt_span *inout, int count, double *spread);
// The scale by the file of marks, and by markers in the photographs. VT_BAD_INPUT naming the file, the line, the mark.
vt_status vt_scale_by_marks(vt_context *, const char *path, const vt_photos *, double *metres_per_unit);
vt_status vt_scale_by_markers(vt_context *, double metres, int cells, const vt_photos *, double *metres_per_unit);

#ifdef __cplusplus
}
#endif
#endif
