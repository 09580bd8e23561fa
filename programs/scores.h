// scores.h - how well a tree shows photographs that it is compared with, beside trivial predictors
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_SCORES_H
#define VT_PROGRAMS_SCORES_H

#include "base/image_metrics.h"
#include "base/image_outline.h"
#include "base/json.h"
#include "base/views.h"
#include "programs/session.h"
#include "render/render.h"

typedef struct vt_scores {
  int count;
  vt_metrics *of_view;  // [count]; owned
  vt_outline *outlines; // [count]; owned
  vt_metrics mean;      // what may be NAN over the views where it is not
  vt_outline outline;   // likewise
  double least_reach;   // of all views; NAN if none has any tree
  int level;
  double seconds_per_frame;
  char renderer[160];
} vt_scores;
void vt_free_scores(vt_context *, vt_scores *);

// Draws the tree from each view's camera and measures. The desc's level must be >= 0. `pictures`: a folder that gets
// truth and result of each view side by side and a contact sheet, or NULL.
vt_status vt_score_tree(vt_session *, const vt_tree *, const vt_render_desc *, vt_backend, const float background[3],
                        const vt_views *judged, const char *pictures, vt_scores *out);

typedef enum vt_predictor { VT_PREDICT_WHITE, VT_PREDICT_NEAREST, VT_PREDICT_HULL, VT_PREDICTOR_COUNT } vt_predictor;
// What needs no method: nothing but the background; the training photograph whose camera stands in the nearest
// direction (itself excepted), as it is; the hull on level 6 with one colour a cell. `centre`: of the tree, world.
vt_status vt_score_predictors(vt_session *, const vt_views *training, const vt_views *judged, vt_vec3 centre,
                              const float background[3], vt_metrics out[VT_PREDICTOR_COUNT]);
// One of their pictures; `hull` from vt_reconstruct_hull for VT_PREDICT_HULL. Premultiplied RGBA, caller frees.
vt_status vt_predict_view(vt_context *, vt_predictor, const vt_views *training, const vt_view *, vt_vec3 centre,
                          const vt_tree *hull, vt_fimage *out);

// Members of the object that is open: views, level, means, per_view, seconds_per_frame, renderer.
void vt_report_scores(vt_json_writer *, const vt_scores *, const vt_views *judged);
void vt_report_predictors(vt_json_writer *,
                          const vt_metrics metrics[VT_PREDICTOR_COUNT]); // "predictors" and their metrics
void vt_say_metrics(vt_session *, const char *name, const vt_metrics *);
void vt_say_metrics_head(vt_session *);
void vt_say_outline(vt_session *, const vt_scores *); // in a sentence
const char *vt_predictor_name(vt_predictor);
vt_vec3 vt_tree_centre(const vt_tree *);

#endif
