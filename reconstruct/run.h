// run.h - what the stages of one reconstruction share
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_RUN_H
#define VT_RECONSTRUCT_RUN_H

#include "reconstruct/billboards.h"
#include "reconstruct/fit.h"
#include "reconstruct/opacity.h"
#include "reconstruct/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_recipe { // what method and preset mean
  vt_opacity_desc opacity;
  vt_billboard_desc billboard;
  vt_fit_desc fit;
  bool field;       // opacity and colour at corners, fitted, and view textures; else constant cells and tiles
  int leaf_epochs;  // of the fit, on the leaf level; fit.epochs are those of the others
  double pixels;    // the leaf level is the coarsest whose cells cover at most so many
} vt_recipe;
vt_recipe vt_recipe_of(const vt_reconstruct_desc *);

typedef struct vt_run {
  vt_context *context;
  const vt_reconstruct_desc *desc;
  vt_recipe recipe;
  const vt_views *views;
  vt_tree *tree;
  vt_reconstruct_report *report;
  double start, root_pixels; // root_pixels: size of the root's edge in the photographs
  double fitted, seconds_after_fit; // when the last level's fit ended, and how long the level took from there
  int least_seen;            // a cell in the frames of fewer photographs is not believed
  int leaf;                  // the last level that is to be made
  int bare_epochs;           // opacity alone: of a fit of the last level's corners, without view textures; 0: cells are enough
  uint64_t bytes_before;     // in use when a level's hull was there and nothing else of it
  int *stand_in;             // [photographs] the view that says what it would say, itself as a rule; NULL: not known yet; owned
  uint8_t *split;            // [cells of the last level] those that the next comes from; NULL: all; owned
} vt_run;

vt_status vt_prepare_run(vt_run *);                 // cameras, the root cube (unless it has an edge), its size in the photographs
double vt_cell_pixels(const vt_run *, int level);

// run_level.c
vt_status vt_begin_level(vt_run *, int level);      // the children of those cells of the level before that are split
vt_status vt_carve_level(vt_run *, int level);      // by the mattes
vt_status vt_reduce_for_level(vt_run *, int level, vt_reduced_views *out);
int vt_coarse_level_for(const vt_run *, int level, int factor); // where pixels are looked for that may meet a cell
vt_status vt_estimate_level(vt_run *, int level, const vt_rays *); // opacity
vt_status vt_run_level(vt_run *, int level);        // everything after carving

// run_partial.c
vt_status vt_solve_opacity_levels(vt_run *);        // opacity alone of the levels up to `leaf`, from the preparation on

// run_plan.c
uint64_t vt_ray_bound(const vt_run *);              // bytes of chords that may be kept
uint64_t vt_level_bytes(const vt_run *, uint64_t hull_cells); // that a level will take, about
vt_status vt_plan_next_level(vt_run *, int level, const vt_rays *); // sets split, or leaf where memory ends
bool vt_time_is_left(const vt_run *, int level, double seconds_before); // for the level after one whose hull is known

#ifdef __cplusplus
}
#endif
#endif
