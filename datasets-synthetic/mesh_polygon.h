// mesh_polygon.h - polygons cut into triangles
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_MESH_POLYGON_H
#define VT_DATASETS_SYNTHETIC_MESH_POLYGON_H

#include "base/vector.h"
#include <stddef.h>
#include <stdint.h>

#define VT_MAX_CONCAVE 256 // corners; polygons of more are cut as if they were convex

// Cuts a polygon of `count` >= 3 corners into count - 2 triangles of its winding, numbers of corners. order[count] is
// scratch.
void vt_cut_polygon(const vt_vec3 *corners, uint32_t count, uint32_t *order, uint32_t (*triangles)[3]);

#endif
