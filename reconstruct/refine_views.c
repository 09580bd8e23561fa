// refine_views.c - whether cameras need refinement, and whether it was worth it
// SPDX-License-Identifier: BSD-3-Clause

#include "base/least_squares.h"
#include "reconstruct/refine_cameras.h"

vt_status vt_refine_views(vt_context *context, const vt_refine_desc *desc, vt_views *views, vt_refine_report *or_null) {
  vt_views train;
  vt_refine_report report = {.why = "", .alpha_before = (double)NAN, .alpha_after = (double)NAN};
  vt_status status = vt_select_views(context, views, VT_TRAIN, &train);
  if (status) return status;
  vt_refinement r = {0};
  double start = vt_seconds();
  status = vt_begin_refinement(context, desc, &train, 2, &r);
  int top = status ? 0 : vt_finest_refinement_level(&r);
  for (int l = 0; l < 3 && !status; l++)
    for (int round = 0; round < desc->rounds[l] && !status; round++) {
      int level = top - 2 + l;
      double a, b, t0 = vt_cpu_seconds(), t1;
      status = vt_renew_volumes(&r, level, 2);
      t1 = vt_cpu_seconds();
      if (!status) status = vt_refinement_error(&r, &a, NULL);
      if (!status) status = vt_solve_poses(&r, 10);
      if (!status) status = vt_refinement_error(&r, &b, NULL);
      if (!status) vt_fix_gauge(&r);
      printf("level %d: alpha %.4f -> %.4f  volumes %.2f s solve %.2f s\n", level, a, b, t1 - t0, vt_cpu_seconds() - t1);
      if (getenv("VT_TRUTH_HOOK")) {
        extern void vt_hook(vt_refinement *);
        vt_hook(&r);
      }
    }
  report.seconds = vt_seconds() - start;
  for (int i = 0, k = 0; i < views->count && !status; i++)
    if (views->items[i].role == VT_TRAIN) views->items[i].camera = r.views.items[k++].camera;
  vt_end_refinement(&r);
  vt_free(context, train.items);
  if (or_null) *or_null = report;
  return status;
}
