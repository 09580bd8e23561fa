// truth_scores.h - a tree against what the synthetic object truly is
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_TRUTH_SCORES_H
#define VT_PROGRAMS_TRUTH_SCORES_H

#include "base/json.h"
#include "datasets-synthetic/synthetic.h"
#include "octree/octree.h"
#include "programs/session.h"

// Mean extinctions of cells: those of the tree that hold any, and those of the truth that hold at least a thousandth of the
// level's largest.
typedef struct vt_truth_level {
  int level;
  size_t cell_count, tree_count, true_count; // in either, in the tree, in the truth
  double relative_rms;                       // root of sum (tree - truth)^2 over sum truth^2; 1 for an empty tree
  double correlation;                        // Pearson's
  double mass_ratio;                         // sum of tree over sum of truth; 1 is right
} vt_truth_level;

typedef struct vt_truth_scores {
  int level_count; // of the tree
  vt_truth_level levels[VT_MAX_LEVEL + 1];
  int chord_count;
  double transmittance_rmse; // of exp(-tau) on chords of the finest level
  double depth_rmse;         // of tau, both clipped at 4
} vt_truth_scores;

vt_status vt_score_truth(vt_session *, const vt_tree *, const vt_truth *, bool is_phantom, vt_truth_scores *out);
void vt_report_truth(vt_json_writer *, const vt_truth_scores *); // "truth": levels and chords
void vt_say_truth(vt_session *, const vt_truth_scores *);

#endif
