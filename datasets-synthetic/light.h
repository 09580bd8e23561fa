// light.h - sun and sky on a mesh
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_LIGHT_H
#define VT_DATASETS_SYNTHETIC_LIGHT_H

#include "base/context.h"
#include "base/vector.h"
#include "datasets-synthetic/mesh.h"

typedef struct vt_lit_vertex {
  float sun_x, sun_y, sun_near; // place in the sun's map: texels, texels, world units towards the sun
  float sky;                    // share of the sky that it sees, 0..1
} vt_lit_vertex;

typedef struct vt_lighting {
  vt_vec3 sun;             // unit, towards it
  int map_size;            // texels an edge
  float *map;              // [map_size][map_size]; nearness to the sun of what it meets first; owned
  vt_lit_vertex *vertices; // one for each of the mesh; owned
} vt_lighting;

// A point of a surface as it is shaded.
typedef struct vt_surface_point {
  float albedo[3], normal[3]; // normal of the upper side or outside, any length
  float sun_x, sun_y, sun_near, sky;
  bool thin; // a leaf: light also comes through it
  bool back; // the side that the normal points away from is seen
} vt_surface_point;

vt_status vt_light_mesh(vt_context *, const vt_mesh *, vt_vec3 sun, vt_lighting *out); // sun: unit, towards it
void vt_free_lighting(vt_context *, vt_lighting *);
// Linear light that leaves the point, the same in all directions on the side that is seen.
void vt_shade(const vt_lighting *, const vt_surface_point *, float colour[3]);

#endif
