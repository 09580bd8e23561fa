// shade_traced.h - what a ray's hit looks like, and which rays ask for its light
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_SHADE_TRACED_H
#define VT_DATASETS_SYNTHETIC_SHADE_TRACED_H

#include "datasets-synthetic/synthetic.h"
#include "datasets-synthetic/trace.h"

// What all photographs of a mesh share.
typedef struct vt_look {
  const vt_mesh *mesh;           // borrowed
  float sun[3], across[3][2];    // unit, towards the sun; the two directions across it, column by column
  float sunlight[3], foliage[3]; // linear light: of the sun; that comes back from inside a crown
  float step;                    // world units that rays start off a surface
  float decode[256];             // linear light of an sRGB byte
} vt_look;

typedef struct vt_surface { // a place on the side that is seen
  float position[3];
  float rounded[3];          // the place on the smooth surface that the triangles of a solid stand for
  float flat[3], normal[3];  // unit, towards the eye: of the triangle; of the smooth surface
  float eye[3];              // unit, towards it
  float albedo[3], through[3]; // shares of light: reflected; let through (thin ones)
  float specular, roughness;
  bool thin;
} vt_surface;

// Rays that a surface's light is the sum of; each wants its own two random numbers.
typedef enum vt_light_part { VT_LIGHT_SUN, VT_LIGHT_SKY, VT_LIGHT_SKY_BEHIND, VT_LIGHT_SHEEN, VT_LIGHT_PARTS } vt_light_part;

typedef struct vt_light_sample {
  vt_trace_ray ray;
  float open[3], stopped[3]; // linear light towards the eye if nothing stops the ray, and if something does
  size_t surface;            // for the caller
} vt_light_sample;

// VT_BAD_INPUT naming a vertex that is no number. Indices out of range are the maker's bug (asserted).
vt_status vt_make_look(vt_context *, const vt_mesh *, vt_vec3 sun, vt_look *out);
// A tracer of the mesh with its cut-outs as holes, for as long as `look` and `vertices` stay: those of the mesh, or moved by
// wind. Degenerate triangles meet no ray. Statuses of vt_create_tracer.
vt_status vt_trace_look(vt_context *, const vt_look *, const vt_vertex *vertices, vt_tracer **out);
void vt_find_surface(const vt_look *, const vt_vertex *vertices, const float direction[3], const vt_trace_hit *, vt_surface *);
// False if the part gives no light. random: 0..1 each.
bool vt_sample_light(const vt_look *, const vt_surface *, vt_light_part, const float random[2], vt_light_sample *);

#endif
