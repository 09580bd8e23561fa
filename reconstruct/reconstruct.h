// reconstruct.h - views to opacity octree to billboard tiles
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_RECONSTRUCT_H
#define VT_RECONSTRUCT_RECONSTRUCT_H

#include "base/views.h"
#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_method { VT_METHOD_2004, VT_METHOD_2006, VT_METHOD_BEST } vt_method; // RMMD04, LRMDM06, ours
typedef enum vt_preset { VT_PRESET_DRAFT, VT_PRESET_NORMAL, VT_PRESET_HIGH } vt_preset;

typedef struct vt_reconstruct_desc {
  uint32_t cookie;
  vt_method method;
  vt_preset preset;
  int leaf_level;         // 1..VT_MAX_LEVEL; 0: the level at which a texel is about a pixel of the photographs
  double time_budget;     // seconds of wall time for opacity and textures; 0: none. Fewer iterations and levels are done.
  int hull_votes;         // photographs that must see a cell empty before it is carved, 1..; more than 1 where mattes are
                          // estimated and lose a thin twig now and then
  double hidden_threshold; // a cell hidden behind more than this opacity (0..1) is invisible from a view [LRMDM06 3.2]
  // What a scene does not need is skipped; `voltree bench skips` turns each of these off to see what it saves and costs.
  bool skip_empty_pixels; // pixels in a block that no cell of a coarser level can reach are not looked at
  bool keep_chords;       // the chords of a level's rays are walked once and kept, within the bound of memory
  bool prune_hidden;      // billboards hidden from their view and its neighbours are left out (never by 2004)
  bool prune_thin;        // cells of the leaf level that turn out all but empty are dropped
  bool split_where_needed; // empty cells, and cells that no photograph sees, have no finer ones; where memory is short, only
                          // the cells that matter most have (best; 2004 and 2006 split all)
  bool drop_redundant;    // photographs that the textures of the others show as well get none of their own (best)
  int refine_epochs;      // sweeps of the joint fit of opacity and colour, 0..; -1: as many as the method does
} vt_reconstruct_desc;
// 2004: branching 3, 8x8 texels, log-domain SART. 2006: octree, 4x4, log-domain SART, pruning. Normal ends at the level whose
// texels are about a pixel, draft one before, high one after. best: transmittance-domain tomography, then a field at the cells'
// corners fitted leave-one-out, and view textures; cells of at most 5, 2.5 and 1.25 pixels at the finest level; of a tree most of which is about
// a pixel wide 2.5, 1.25 and 1.25.
vt_reconstruct_desc vt_default_reconstruct_desc(vt_method, vt_preset);

typedef struct vt_level_report {
  int level;
  uint32_t hull_cells, cells;             // before and after pruning by opacity
  uint64_t billboards_before, billboards; // (view, cell) pairs before and after pruning by visibility
  uint32_t view_least, view_median, view_most; // billboards left of one view, over the views [LRMDM06 Fig. 4]
  double mass_factor;                     // by which the level was made denser to be as opaque as the next finer one; 0: was not
  double pruned_energy;                   // mean square of what the pruned billboards add to a pixel's alpha at the own cameras
  double own_alpha_rmse;                  // of the textures at the photographs' own cameras (tiles; best: 0)
  uint64_t rays;                          // per iteration
  double saturated_share;                 // of the rays, alpha > 0.99
  double alpha_rmse;                      // of the training rays in the last iteration
  double held_out_rmse;                   // of the rays that opacity did not see; NAN where it saw all
  uint32_t unconstrained;                 // cells that no ray says anything about
  uint32_t unsplit_empty, unsplit_hidden; // cells without finer ones: empty, or seen by no photograph
  uint32_t unsplit_for_memory;            // or for want of memory
  double coverage_degrees, narrow_share;  // of the others: median of the widest angle between lines of sight; share below 30
  double seconds_opacity, seconds_tiles;
} vt_level_report;

typedef struct vt_reconstruct_report {
  int leaf_level;
  double seconds_bounds, seconds_hull, seconds_rays, seconds_opacity, seconds_colour, seconds_refinement, seconds_tiles;
  uint64_t peak_bytes_opacity, peak_bytes_tiles; // most memory handed out until the last such stage had ended
  double thin_share;     // of the mattes, thinner than three pixels, 0..1: from 3/8 on cells are half as large, and R is interpolated, not
                         // ln R
  int redundant_views;   // photographs that the others show as well: used, but without textures of their own
  uint64_t estimated_bytes; // printed before the work starts
  vt_level_report levels[VT_MAX_LEVEL + 1];
} vt_reconstruct_report;

// All stages below in order, on the VT_TRAIN views only; out is a raw tree, metadata "{}". VT_BAD_INPUT (views that see
// no tree, or no volume in common), VT_TOO_FEW_VIEWS (no view at all), VT_OUT_OF_MEMORY, VT_CANCELLED. Caller frees.
vt_status vt_reconstruct(vt_context *, const vt_reconstruct_desc *, const vt_views *, vt_tree *out,
                         vt_reconstruct_report *or_null);

// ==== before it: mattes that do not belong to the others =============================================================

typedef struct vt_matte_report {
  bool tried;        // false: fewer than 8 views, or no volume in common
  int view_count;    // views looked at
  double *disagreement; // [all views, -1 where not looked at] squared difference of the matte from what the others let expect,
                     // over what either shows, 0..; owned
  double usual;      // its median
  int doubtful_count; // views that were given the role VT_DOUBTFUL
  double seconds;
} vt_matte_report;
void vt_free_matte_report(vt_context *, vt_matte_report *);

// Gives VT_TRAIN views whose mattes contradict the volume of the others the role VT_DOUBTFUL: the hull, the tomography, the fit and
// the view textures then do without them. At most a quarter of the views. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_check_mattes(vt_context *, vt_views *, vt_matte_report *or_null);

// ==== before it: cameras =============================================================================================

typedef enum vt_refine_mode { VT_REFINE_AUTO, VT_REFINE_ON, VT_REFINE_OFF } vt_refine_mode;

typedef struct vt_refine_desc {
  uint32_t cookie;
  vt_refine_mode mode;     // auto: where a quick look says that there is something to gain
  int fold_count;          // each view is compared with a volume of the other folds' views, 2..8
  double turn_deviation;   // how far cameras may be off: degrees
  double shift_deviation;  // and share of their distance
  double focal_deviation;  // and share of the focal length, one for all cameras of a lens
  int most_pixels;         // of a view that are looked at, >= 100
  int rounds[2];           // of volumes and poses, on the last level but one (>= 1) and on the last (cells of three to five pixels)
} vt_refine_desc;
vt_refine_desc vt_default_refine_desc(void);

typedef struct vt_refine_report {
  bool tried, kept;                     // kept: the cameras were changed
  const char *why;                      // a phrase: why not tried, why not kept, or why kept
  double first_gain;                    // share by which a first look lowered the error of the mattes
  double mean_degrees, most_degrees;    // changes of direction
  double mean_share, most_share;        // of place, share of the distance
  double mean_pixels, most_pixels;      // of where points of the tree fall in the photographs
  double focal_share;                   // mean change of focal length
  double alpha_before, alpha_after;     // RMSE of mattes in a volume without them, poses fitted to it; NAN where unknown
  size_t sight_count;                   // of points that were used, 0: there are no tracks
  double track_before, track_after;     // mean distance of sights from their points, pixels of the views; 0 without tracks
  double seconds;
} vt_refine_report;

// Changes the cameras of the VT_TRAIN views where that makes each matte agree better with a volume made from other views. Views
// that cannot be refined stay as they are, and that is no error. VT_MISSING_PROGRAM where mode is `on` and the build has no
// Ceres; VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_refine_views(vt_context *, const vt_refine_desc *, vt_views *, vt_refine_report *or_null);

// ==== before it: exposure and white balance ==========================================================================

typedef struct vt_balance_report {
  bool changed;     // false: the photographs are of one exposure, or too few; nothing was touched
  double deviation; // of ln of the gains that cannot be light, the channel where it is largest
  double most_gain; // |ln| of the largest gain of the first pass
  double seconds;
} vt_balance_report;

// Brings the VT_TRAIN views' colours to one exposure and white balance, by a gain a channel in linear light, pictures changed in
// place. The test views stay as they are. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_balance_views(vt_context *, vt_views *, vt_balance_report *or_null);

typedef enum vt_solver {
  VT_SOLVER_ADAM,      // transmittance domain, Adam (what `best` takes)
  VT_SOLVER_NESTEROV,  // transmittance domain, majoriser with momentum, all rays at once
  VT_SOLVER_MAJORISER, // transmittance domain, reweighted, ordered subsets
  VT_SOLVER_LOG        // log domain, SART (what `2004` and `2006` take)
} vt_solver;
// Opacity alone, from the mattes of the VT_TRAIN views to `level`, coarse to fine. out: a tree without tiles or colours, to be
// drawn flat, levels 0..level. sweeps: of each level, or 0 for as many as the solver usually does.
vt_status vt_reconstruct_opacity(vt_context *, const vt_views *, vt_solver, int sweeps, int level, vt_tree *out,
                                 vt_reconstruct_report *or_null);

// The trivial predictor that every method must beat: the hull at `level` with one mean colour per cell, opaque.
// out: a tree without tiles, to be drawn flat.
vt_status vt_reconstruct_hull(vt_context *, const vt_views *, int level, vt_tree *out);

#ifdef __cplusplus
}
#endif
#endif
