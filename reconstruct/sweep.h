// sweep.h - every pixel's ray through the cells, in fixed lanes
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_SWEEP_H
#define VT_RECONSTRUCT_SWEEP_H

#include "octree/octree.h"
#include "reconstruct/pyramid.h"

#ifdef __cplusplus
extern "C" {
#endif

// Sums over rays are kept per lane and added up in the order of lanes: the lanes are the same for any number of threads.
#define VT_LANES 8

typedef struct vt_swept_ray {
  int lane, view;         // view: index into the reduced views
  int x, y;               // pixel
  const uint8_t *pixel;   // straight RGBA
  const vt_chord *chords; // front to back
  size_t chord_count;     // > 0
} vt_swept_ray;

typedef void (*vt_ray_visitor)(void *user, const vt_swept_ray *);

// The rays of some photographs through one level, walked once and kept where memory allows.
typedef struct vt_rays {
  const vt_octree *octree;
  const vt_reduced_views *views;
  int level;
  vt_walk_path path;           // all give the same bits
  struct vt_pixel_blocks *blocks; // [views] pixels that may meet a cell; owned
  bool kept;                   // false: walked anew at each sweep
  struct vt_ray_lane *lanes;   // [VT_LANES]; owned
} vt_rays;

// Walks all rays that meet a cell of the level. coarse_level <= level: a level whose cells hold all cells of `level`; rays
// are looked for only where its cells fall in the photographs. memory_bound: bytes that may be kept; above it nothing is kept and each
// sweep walks again. The octree's level may afterwards change its values, and lose cells with vt_renumber_rays.
vt_status vt_collect_rays(vt_context *, const vt_octree *, int level, int coarse_level, const vt_reduced_views *,
                          uint64_t memory_bound, vt_rays *out);
void vt_free_rays(vt_context *, vt_rays *);
// After the level was filtered: new_index[old cell] is the cell's new number, or VT_NO_CELL.
void vt_renumber_rays(vt_context *, vt_rays *, const uint32_t *new_index);

// Calls visit for each ray of the chosen views ([chosen_count] indices; NULL: all); calls of one lane come one after
// another in a fixed order, lanes run side by side.
vt_status vt_sweep_rays(vt_context *, const vt_rays *, const int *chosen, int chosen_count, vt_ray_visitor visit,
                        void *user);

// Only the pixels with (x + y) mod parts = part, so that a photograph can be taken in several steps that each see all of it.
vt_status vt_sweep_part(vt_context *, const vt_rays *, const int *chosen, int chosen_count, int parts, int part,
                        vt_ray_visitor visit, void *user);

// out[i] = sum over lanes of lanes[lane][i], and zeroes the lanes. lanes: [VT_LANES][count].
vt_status vt_add_lanes(vt_context *, float *lanes, size_t count, float *out);

#ifdef __cplusplus
}
#endif
#endif
