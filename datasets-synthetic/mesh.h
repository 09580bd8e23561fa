// mesh.h - filling a mesh
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_MESH_H
#define VT_DATASETS_SYNTHETIC_MESH_H

#include "datasets-synthetic/synthetic.h"

// Room for so many more vertices and triangles, which the two calls below then take without fail. VT_OUT_OF_MEMORY.
vt_status vt_reserve_mesh(vt_context *, vt_mesh *, size_t vertex_count, size_t triangle_count);
uint32_t vt_add_vertex(vt_mesh *, vt_vec3 position, vt_vec3 normal, vt_vec3 albedo); // its index
void vt_add_triangle(vt_mesh *, uint32_t a, uint32_t b, uint32_t c);
// Scales and moves the mesh so that its bounding box is centred on the origin and `height` high.
void vt_centre_mesh(vt_mesh *, double height);

#endif
