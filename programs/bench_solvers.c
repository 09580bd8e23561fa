// bench_solvers.c - error over seconds of each solver of opacity, level by level, on the captures of the frontier
// SPDX-License-Identifier: BSD-3-Clause
//
// Opacity alone, from mattes to a level, without colour, textures or packing: what the tomography is worth before anything else
// helps. Each solver is given more and more sweeps; seconds are processor seconds of everything from mattes to that level, since
// a solver that needs half the sweeps still walks the same rays.

#include "programs/bench_frontier.h"
#include "octree/octree.h"

typedef struct trial {
  const char *name;
  vt_solver solver;
  int sweeps, level;
} trial;

static const trial quick_trials[] = {{"adam", VT_SOLVER_ADAM, 8, 4}, {"log SART", VT_SOLVER_LOG, 4, 4}};
static const trial trials[] = {
    {"adam", VT_SOLVER_ADAM, 2, 6},           {"adam", VT_SOLVER_ADAM, 4, 6},           {"adam", VT_SOLVER_ADAM, 1, 7},
    {"adam", VT_SOLVER_ADAM, 2, 7},           {"adam", VT_SOLVER_ADAM, 4, 7},           {"adam", VT_SOLVER_ADAM, 8, 7},
    {"adam", VT_SOLVER_ADAM, 4, 8},           {"majoriser", VT_SOLVER_MAJORISER, 4, 6}, {"majoriser", VT_SOLVER_MAJORISER, 2, 7},
    {"majoriser", VT_SOLVER_MAJORISER, 4, 7}, {"majoriser", VT_SOLVER_MAJORISER, 8, 7}, {"nesterov", VT_SOLVER_NESTEROV, 20, 7},
    {"log SART", VT_SOLVER_LOG, 2, 6},        {"log SART", VT_SOLVER_LOG, 2, 7},        {"log SART", VT_SOLVER_LOG, 4, 7}};

// RMSE of alpha over all pixels of the judged views.
static vt_status judge_alpha(vt_context *context, const vt_tree *tree, const vt_views *judged, double *rmse) {
  double sum = 0, pixels = 0;
  vt_status status = VT_OK;
  for (int i = 0; i < judged->count && !status; i++) {
    const vt_view *view = &judged->items[i];
    vt_fimage picture = {0};
    status = vt_composite(context, tree, tree->octree.level_count - 1, NULL, VT_BLEND_SUM, true, &view->camera, &picture);
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

static vt_status run_trial(vt_frontier *f, const trial *t, vt_bench_table *table) {
  vt_tree tree;
  vt_reconstruct_report report;
  double start = vt_cpu_seconds(), rmse = 0;
  vt_status status = vt_reconstruct_opacity(f->context, &f->views, t->solver, t->sweeps, t->level, &tree, &report);
  double seconds = vt_cpu_seconds() - start;
  if (status) return status;
  status = judge_alpha(f->context, &tree, &f->judged, &rmse);
  const vt_level_report *level = &report.levels[report.leaf_level];
  char label[80];
  snprintf(label, sizeof label, "%s at level %d/%d", t->name, t->level, t->sweeps);
  vt_add_row(table, label);
  const double values[] = {t->sweeps,  report.leaf_level, seconds, rmse, level->alpha_rmse, level->held_out_rmse, level->cells, (double)level->rays * 1e-6,
                           100 * level->saturated_share, level->coverage_degrees, level->unconstrained};
  for (size_t i = 0; i < sizeof values / sizeof *values; i++) vt_put_value(table, values[i]);
  vt_free_tree(f->context, &tree);
  return status;
}

vt_status vt_put_solvers(vt_frontier *f) {
  static const vt_bench_column columns[] = {{"sweeps", "", VT_NEITHER_BETTER, 0, 0},
                                            {"level", "", VT_NEITHER_BETTER, 0, 0},
                                            {"CPU time", "CPU s", VT_LESS_BETTER, 0.3, 0.2},
                                            {"alpha RMSE", "", VT_LESS_BETTER, 0.01, 1e-4},
                                            {"of fitted rays", "", VT_NEITHER_BETTER, 0.01, 1e-4},
                                            {"of held-out rays", "", VT_NEITHER_BETTER, 0.01, 1e-4},
                                            {"cells", "", VT_NEITHER_BETTER, 0.01, 0},
                                            {"rays", "M", VT_NEITHER_BETTER, 0.01, 0},
                                            {"saturated", "%", VT_NEITHER_BETTER, 0.01, 0},
                                            {"coverage", "degrees", VT_NEITHER_BETTER, 0.01, 0},
                                            {"cells unreached", "", VT_NEITHER_BETTER, 0.01, 1}};
  char name[160], caption[300];
  bool quick = vt_is_quick(f->bench);
  const trial *list = quick ? quick_trials : trials;
  size_t count = quick ? sizeof quick_trials / sizeof *quick_trials : sizeof trials / sizeof *trials;
  snprintf(name, sizeof name, "%s_opacity", f->name);
  snprintf(caption, sizeof caption, "%s: opacity alone, from mattes, on the held-out views, by solver, level and sweeps", f->name);
  vt_bench_table *table = vt_add_table(f->bench, name, caption, columns, (int)(sizeof columns / sizeof *columns));
  vt_status status = VT_OK;
  for (size_t i = 0; i < count && !status; i++) status = run_trial(f, &list[i], table);
  snprintf(name, sizeof name, "%s_opacity_plot", f->name);
  snprintf(caption, sizeof caption, "%s: alpha RMSE of opacity alone over processor seconds", f->name);
  vt_add_plot(f->bench, table, &(vt_plot){name, caption, "CPU time", "alpha RMSE", true, false, true});
  return status;
}
