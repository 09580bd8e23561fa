// match_tiles.h - texels that add up to the photograph at the photograph's own camera
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_MATCH_TILES_H
#define VT_RECONSTRUCT_MATCH_TILES_H

#include "octree/octree.h"
#include "reconstruct/agreement.h"

#ifdef __cplusplus
extern "C" {
#endif

// Where the squared error of the mattes at the photographs' own cameras lies: mean over all pixels, and what part of it is due
// to which cause. rmse^2 = no_cells + limited + clamped + rounding.
typedef struct vt_match_report {
  double rmse;     // of alpha, 0..1
  double no_cells; // pixels that show something where no cell with a tile stands
  double limited;  // the cells on the ray cannot be made dense enough
  double clamped;  // cells wider than their tile, which show the texel at its rim
  double rounding; // 8 bits
  double clamped_share; // of the cells on rays, by chord
  double pruned_energy; // mean square of what cells without a tile would have added to a pixel's alpha, were the others as they are
} vt_match_report;

// Rewrites the texels that pixels' rays meet (the tiles must lie on the grid of the rays' pictures) so that front to back they
// composite to each pixel's colour and alpha. corner[tile]: column and row of the tile's first texel in its picture.
vt_status vt_match_tiles(vt_context *, const vt_rays *, const vt_agreement *, const int32_t (*corner)[2], float ratio_limit,
                         vt_tree *, vt_match_report *);

#ifdef __cplusplus
}
#endif
#endif
