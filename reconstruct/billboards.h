// billboards.h - the textures of one level, a tile for each view and cell that shows
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_BILLBOARDS_H
#define VT_RECONSTRUCT_BILLBOARDS_H

#include "octree/octree.h"
#include "reconstruct/agreement.h"
#include "reconstruct/match_tiles.h"
#include "reconstruct/pyramid.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_billboard_desc {
  uint32_t cookie;
  bool prune;              // leave out what is hidden; false: a tile for every cell within a photograph's frame
  double hidden_threshold; // opacity before a cell from which on it is hidden
  float least_depth;       // cells of a smaller optical depth show nothing and get no tile, >= 0
  float ratio_limit;       // largest factor by which a matte may thicken the cells on its ray, >= 1
  float match_limit;       // the same for the texels that the photograph's own pixels see, >= 1
} vt_billboard_desc;
vt_billboard_desc vt_default_billboard_desc(void);

// Fills tree->tiles of the rays' level from the cells' optical depth and colour and the photographs of the rays.
// tree->cameras are the full-size cameras of the same views. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_make_billboards(vt_context *, const vt_billboard_desc *, const vt_rays *, vt_tree *tree,
                             vt_match_report *);

#ifdef __cplusplus
}
#endif
#endif
