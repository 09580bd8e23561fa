// mesh.h - triangles with a normal and a colour at every vertex
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_MESH_H
#define VT_DATASETS_SYNTHETIC_MESH_H

#include "base/context.h"
#include "base/vector.h"

typedef struct vt_vertex {
  float position[3]; // world
  float normal[3];   // unit; of a leaf: of its upper side
  float albedo[3];   // linear light, 0..1
} vt_vertex;

typedef struct vt_mesh {
  size_t vertex_count, vertex_capacity;
  vt_vertex *vertices; // owned
  size_t triangle_count, triangle_capacity;
  uint32_t (*triangles)[3]; // owned; counter-clockwise seen from the side the normals point to
  size_t solid_count; // triangles before this one close a solid (bark); those from it on are thin, two-sided leaves
} vt_mesh;

void vt_free_mesh(vt_context *, vt_mesh *);
// Room for so many more vertices and triangles, which the two calls below then take without fail. VT_OUT_OF_MEMORY.
vt_status vt_reserve_mesh(vt_context *, vt_mesh *, size_t vertex_count, size_t triangle_count);
uint32_t vt_add_vertex(vt_mesh *, vt_vec3 position, vt_vec3 normal, vt_vec3 albedo); // its index
void vt_add_triangle(vt_mesh *, uint32_t a, uint32_t b, uint32_t c);
// Scales and moves the mesh so that its bounding box is centred on the origin and `height` high.
void vt_centre_mesh(vt_mesh *, double height);

#endif
