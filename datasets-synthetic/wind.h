// wind.h - a mesh moved by a gust, another one in every photograph
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_WIND_H
#define VT_DATASETS_SYNTHETIC_WIND_H

#include "datasets-synthetic/synthetic.h"

typedef struct vt_wind {
  uint32_t seed;
  double amplitude;   // the farthest that anything moves, world units; 0: still
  double foot, crown; // z of what stands still, and of what moves most
  bool *flutters;     // for each vertex of the mesh: of a leaf; owned
} vt_wind;

vt_status vt_make_wind(vt_context *, const vt_mesh *, uint32_t seed, double amplitude, vt_wind *out);
void vt_free_wind(vt_context *, vt_wind *);
// Positions and normals of the mesh's vertices, moved, into out[mesh->vertex_count]; the rest of each vertex is copied.
void vt_blow(const vt_wind *, const vt_mesh *, uint64_t gust, vt_vertex *out);
// The gust of a photograph: its own, and the same one however many there are of the other role.
uint64_t vt_gust_of(const vt_views *, int view);

#endif
