// truth_cells.h - what a grid's cells truly hold
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_TRUTH_CELLS_H
#define VT_DATASETS_SYNTHETIC_TRUTH_CELLS_H

#include "datasets-synthetic/phantom.h"

typedef struct vt_grid {
  vt_vec3 origin; // its corner
  double edge;    // of a cell, world
  int axis_cells;
} vt_grid;

// Mean extinction of each cell, per world unit. VT_CANCELLED.
vt_status vt_phantom_cells(vt_context *, const vt_phantom *, const vt_grid *, size_t count, const uint16_t (*xyz)[3],
                           float *extinction);
// The same of a mesh, and the area of its leaves; area or NULL. Cells are half-open, but what lies in the far faces of the
// root counts to its last cells. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_mesh_cells(vt_context *, const vt_mesh *, const vt_grid *, size_t count, const uint16_t (*xyz)[3],
                        float *extinction, float *area_or_null);

#endif
