// plan.h - what a run would do, what the cache has of it, and about what it costs
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_PLAN_H
#define VT_PROGRAMS_PLAN_H

#include "programs/stage_options.h"
#include "reconstruct/reconstruct.h"

typedef struct vt_plan {
  vt_capture_plan source;
  bool wants_tree, tree_kept;
  int level;               // of the tree, if it fills the photographs
  double cell_pixels;      // of that level
  double seconds_tree;     // estimate
  uint64_t tree_bytes;     // estimate, in memory, with the views
} vt_plan;

// The part up to the views; the rest is zero.
vt_status vt_plan_source(vt_session *, const char *source, vt_plan *out);
// Adds the tree.
vt_status vt_guess_tree(vt_session *, const vt_reconstruct_desc *, vt_plan *);
// The level of a tree that fills photographs of so many pixels, and the pixels of its cells there.
int vt_guess_level(const vt_reconstruct_desc *, double longer_side, double *cell_pixels);
// Bytes that the reconstruction takes at that level, about.
uint64_t vt_guess_tree_bytes(int level, int views, uint64_t view_bytes);
// Prints it, and the JSON document.
vt_status vt_show_plan(vt_session *, const char *source, const char *output, const vt_plan *);

#endif
