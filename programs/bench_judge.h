// bench_judge.h - pictures of held-out views, however they were made, and how far they are from the photographs
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_BENCH_JUDGE_H
#define VT_PROGRAMS_BENCH_JUDGE_H

#include "base/image_metrics.h"
#include "base/views.h"
#include "programs/bench.h"
#include "programs/scores.h"

// One picture for each judged view, in their order: straight RGBA, or RGB over a background; empty where there is none.
typedef struct vt_pictures {
  int count;
  vt_image *items; // owned, each with its pixels
} vt_pictures;
void vt_free_pictures(vt_context *, vt_pictures *);
vt_status vt_make_pictures(vt_context *, int count, vt_pictures *out); // empty ones

// The finest level of the tree, from the camera of each view. blur: deviation of a Gaussian over the pictures, pixels;
// 0: none. seconds_per_frame: mean, without the first frame's upload; may be NULL.
vt_status vt_draw_pictures(vt_session *, const vt_tree *, vt_blend, double blur, const vt_views *judged,
                           vt_pictures *out, double *seconds_per_frame);
// What a predictor without any method shows. seconds: of making what it needs, NAN where that is nothing.
vt_status vt_predict_pictures(vt_session *, vt_predictor, const vt_views *training, const vt_views *judged,
                              vt_vec3 centre, vt_pictures *out, vt_spread *seconds);

// Means over the views that have a picture, both over the background; alpha_rmse is NAN where pictures are opaque.
vt_status vt_judge_pictures(vt_context *, const vt_pictures *, const vt_views *judged, const float background[3],
                            vt_metrics *out);

// ---- the metrics as columns of a table, with their noise
#define VT_MAX_METRIC_COLUMNS 12
int vt_metric_columns(vt_bench_column out[VT_MAX_METRIC_COLUMNS]);               // their number
void vt_put_metrics(vt_bench_table *, const vt_metrics *repetitions, int count); // count 0: empty cells

#endif
