// bench_opacity.c - error of the alpha-only opacity of a capture over levels and processor seconds, solver by solver
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_opacity CAPTURE LEVEL [SWEEPS [adam|nesterov|majoriser|log]...]
//
// From mattes to LEVEL, coarse to fine, without any colour; judged on the views of role VT_TEST (or every eighth, held
// out) at their full resolution: RMSE of alpha over all their pixels. SWEEPS 0: as many as the solver usually does.

#include "capture/capture.h"
#include "reconstruct/reconstruct.h"

#include <string.h>

static const char *const names[] = {"adam", "nesterov", "majoriser", "log"}; // in the order of vt_solver

static vt_status judge(vt_context *context, const vt_tree *tree, const vt_views *views, int level, double *rmse) {
  double sum = 0, pixels = 0;
  vt_status status = VT_OK;
  for (int i = 0; i < views->count && !status; i++) {
    vt_fimage picture = {0};
    const vt_view *view = &views->items[i];
    if (view->role != VT_TEST) continue;
    status = vt_composite(context, tree, level, NULL, VT_BLEND_SUM, true, &view->camera, &picture);
    size_t count = (size_t)view->picture.width * (size_t)view->picture.height;
    for (size_t p = 0; p < count && !status; p++) {
      double error = (double)picture.pixels[4 * p + 3] - view->picture.pixels[4 * p + 3] / 255.0;
      sum += error * error;
    }
    pixels += (double)count;
    vt_free_fimage(context, &picture);
  }
  *rmse = sqrt(sum / pixels);
  return status;
}

static vt_status run_solver(vt_context *context, const vt_views *views, int solver, int sweeps, int leaf) {
  vt_tree tree;
  vt_reconstruct_report report;
  double start = vt_cpu_seconds(), rmse = 0;
  vt_status status = vt_reconstruct_opacity(context, views, (vt_solver)solver, sweeps, leaf, &tree, &report);
  double seconds = vt_cpu_seconds() - start;
  for (int l = leaf < 4 ? leaf : 4; l <= report.leaf_level && !status; l++) {
    const vt_level_report *level = &report.levels[l];
    status = judge(context, &tree, views, l, &rmse);
    printf("%-10s %5d %9u %10llu %9.1f %8.4f %8.4f %8.4f %8.0f %9u", names[solver], l, level->cells, (unsigned long long)level->rays,
           100 * level->saturated_share, level->alpha_rmse, level->held_out_rmse, rmse, level->coverage_degrees, level->unconstrained);
    if (l == report.leaf_level) printf(" %9.2f", seconds);
    printf("\n");
  }
  if (!status) vt_free_tree(context, &tree);
  return status;
}

static bool is_wanted(const char *name, int count, char **wanted) {
  for (int i = 0; i < count; i++)
    if (!strcmp(name, wanted[i])) return true;
  return count <= 0;
}

int main(int count, char **arguments) {
  if (count < 3 || atoi(arguments[2]) < 1 || atoi(arguments[2]) > VT_MAX_LEVEL) {
    fprintf(stderr, "bench_opacity CAPTURE LEVEL [SWEEPS [adam|nesterov|majoriser|log]...]\n");
    return VT_BAD_USAGE;
  }
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  vt_capture_desc source = vt_default_capture_desc();
  source.source = arguments[1];
  vt_views views = {0};
  vt_status status = vt_load_views(context, &source, &views, NULL);
  if (!status && !vt_count_views(&views, VT_TEST)) vt_hold_out(&views, 8);
  printf("solver     level     cells       rays saturated %%  train held out    test  degrees unreached  processor s\n");
  for (int i = 0; i < 4 && !status; i++)
    if (is_wanted(names[i], count - 4, arguments + 4))
      status = run_solver(context, &views, i, count > 3 ? atoi(arguments[3]) : 0, atoi(arguments[2]));
  if (status) fprintf(stderr, "bench_opacity: %s\n", vt_last_error(context));
  vt_free_views(context, &views);
  vt_destroy_context(context);
  return (int)status;
}
