// split.h - which cells of a solved level have children on the next
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_SPLIT_H
#define VT_RECONSTRUCT_SPLIT_H

#include "octree/octree.h"
#include "reconstruct/sweep.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_split_desc {
  uint32_t cookie;
  float least_depth;      // a cell thinner than this across its edge is empty, if its rays want it so; 0: none is
  float least_unasked;    // its rays would take away at least this depth, if it had any, for it to count as empty; >= 0
  float least_fitted;     // where the level has corners instead: a cell whose corners are all thinner is empty; 0: none is
  int least_axis_cells;   // on levels with fewer cells along an edge of the root none counts as empty
  float hidden_threshold; // a cell behind more than this opacity, 0..1, on all its rays is hidden; 1: none is
  uint32_t most_cells;    // so many are split at most; UINT32_MAX: no bound
} vt_split_desc;
vt_split_desc vt_default_split_desc(void); // no bound

typedef struct vt_split_report {
  uint32_t split, empty, hidden, for_memory; // their sum is the level's cells
  double opacity_left;                       // share of all cells' opacity that those left unsplit for memory hold
} vt_split_report;

// split: [cell_count], 1 or 0. One sweep over the rays of the level. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_choose_splits(vt_context *, const vt_split_desc *, const vt_rays *, const vt_level *cells, uint8_t *split,
                           vt_split_report *out);

#ifdef __cplusplus
}
#endif
#endif
