// refine_cameras.h - cameras that fit the mattes of all photographs better
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_REFINE_CAMERAS_H
#define VT_RECONSTRUCT_REFINE_CAMERAS_H

#include "base/least_squares.h"
#include "reconstruct/align_cameras.h"
#include "reconstruct/silhouette.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VT_MOST_FOLDS 8

// Some views, what has been found out about their cameras, and volumes that each do without some of them.
typedef struct vt_refinement {
  vt_context *context;
  const vt_refine_desc *desc;
  vt_views views;           // their items are owned, names and pictures borrowed; cameras as they are now
  vt_camera *input;         // [views] as they came; owned
  double (*pose)[6];        // [views] from there on (vt_adjust_camera); owned
  double (*smooth)[VT_SMOOTH_TERMS]; // [views] of each view's volume; owned
  double *distance;         // [views] from the middle, world; owned
  int *lens;                // [views] which lens: cameras of one size and focal length share it; owned
  double *log_focal;        // [views, of which the first lens_count count]; owned
  int lens_count, fold_count;
  double deviation;         // of alpha at the sampled pixels, before poses are solved
  vt_octree cube;           // where the volume is looked for; no levels
  double root_pixels;       // its edge in the photographs
  vt_soft_volume volumes[VT_MOST_FOLDS]; // volume k does without the views i with i % fold_count == k; the only one has all
  vt_silhouette *silhouettes;            // [views]; owned
  vt_response *response;                 // [views] of each matte to the volume; owned
  vt_tracks tracks;                      // as they came; owned
  bool without_tracks;                   // they are passed over
} vt_refinement;

// Copies what it needs of the views; VT_BAD_INPUT where they see no tree or have no volume in common.
vt_status vt_begin_refinement(vt_context *, const vt_refine_desc *, const vt_views *, int votes, vt_refinement *out);
void vt_end_refinement(vt_refinement *);

int vt_finest_refinement_level(const vt_refinement *); // cells of about three pixels, 5..7
// The volumes of a level from the cameras as they are now, and the mattes at the level's resolution. fold_count 1: one volume of
// all views, which all are compared with.
vt_status vt_renew_volumes(vt_refinement *, int level, int votes, int fold_count);
// Cameras for these volumes, from where they are now.
vt_status vt_solve_poses(vt_refinement *, int iterations);
// Other poses (NULL: those that it has), and the views' cameras after them.
void vt_set_poses(vt_refinement *, double (*pose_or_null)[6], const double *log_focal_or_null);
// Root mean square of alpha's error, each view seen in the volume that does without it; of all sampled pixels, and of each
// view in view_error_or_null [views] (-1: nothing was sampled).
vt_status vt_refinement_error(vt_refinement *, double *error, double *view_error_or_null);
// Mean distance in pixels of the tracks' sights from their places, by the cameras as they are now, and how many there are.
vt_status vt_refinement_track_error(vt_refinement *, double *pixels, size_t *sight_count);
// What no photograph says (place, turn and size of all cameras together) is put back as it was.
void vt_fix_gauge(vt_refinement *);

// ---- tracks beside the mattes (refine_tracks.c)

typedef struct vt_sight_block {
  const vt_camera *came;
  double distance, weight, width; // weight: 1 / pixels
  double pixel[2];
  int groups[3];                  // pose, lens, place
} vt_sight_block;

// The tracks that are worked with, by the cameras as they are now; none where there are none, or they are passed over. *usual: as
// vt_choose_tracks says it.
vt_status vt_choose_refinement_tracks(vt_refinement *, vt_tracks *out, double *usual);
// Groups [tracks] for their places, numbered from first_group, and blocks [sights] that depend on these, on the views' poses (groups
// 0 ..) and on lenses (from first_lens); `sights` [sights] is what the blocks point to.
void vt_add_sights(vt_refinement *, vt_tracks *chosen, double usual, int first_lens, int first_group, vt_parameter_group *groups,
                   vt_sight_block *sights, vt_residual_block *blocks);

#ifdef __cplusplus
}
#endif
#endif
