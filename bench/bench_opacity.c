// bench_opacity.c - error of the alpha-only opacity of a capture or a scene over levels and processor seconds, solver by solver
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_opacity CAPTURE|SCENE LEVEL [--views N] [--noise X] [--size PIXELS] [--subsets N] [--iterations N]
//                                   [--rate X] [adam|nesterov|majoriser|log]...
//
// From mattes to each level, coarse to fine, without any colour; judged on the views of role VT_TEST (or every eighth, held
// out) at their full resolution: RMSE of alpha over all their pixels. A name that vt_find_scene knows is photographed, by N
// training views, with noise of deviation X in their mattes.

#include "capture/capture.h"
#include "tests/opacity_run.h"

typedef struct solver {
  const char *name;
  vt_opacity_domain domain;
  vt_opacity_step step;
  int iterations;
} solver;

static const solver solvers[] = {{"adam", VT_TRANSMITTANCE_DOMAIN, VT_STEP_ADAM, 4},
                                 {"nesterov", VT_TRANSMITTANCE_DOMAIN, VT_STEP_NESTEROV, 40},
                                 {"majoriser", VT_TRANSMITTANCE_DOMAIN, VT_STEP_MAJORISER, 4},
                                 {"log", VT_LOG_DOMAIN, VT_STEP_MAJORISER, 2}};

typedef struct arguments {
  const char *source;
  int leaf, views, size, subsets, iterations; // 0: the default
  double noise, rate, peak;
  vt_split_desc splitting;
  bool wanted[sizeof solvers / sizeof *solvers];
} arguments;

static bool choose_solver(arguments *a, const char *name) {
  for (size_t i = 0; i < sizeof solvers / sizeof *solvers; i++)
    if (!strcmp(solvers[i].name, name)) return a->wanted[i] = true;
  return false;
}

static bool read_arguments(int count, char **words, arguments *a) {
  bool any = false;
  *a = (arguments){.splitting = vt_default_split_desc(), .source = count > 1 ? words[1] : NULL, .leaf = count > 2 ? atoi(words[2]) : 0};
  if (a->leaf < 1 || a->leaf > VT_MAX_LEVEL) return false;
  for (int i = 3; i < count; i++) {
    bool option = words[i][0] == '-';
    if (option && ++i == count) return false;
    if (!option && !choose_solver(a, words[i])) return false;
    if (option && !strcmp(words[i - 1], "--views"))
      a->views = atoi(words[i]);
    else if (option && !strcmp(words[i - 1], "--noise"))
      a->noise = atof(words[i]);
    else if (option && !strcmp(words[i - 1], "--size"))
      a->size = atoi(words[i]);
    else if (option && !strcmp(words[i - 1], "--subsets"))
      a->subsets = atoi(words[i]);
    else if (option && !strcmp(words[i - 1], "--iterations"))
      a->iterations = atoi(words[i]);
    else if (option && !strcmp(words[i - 1], "--rate"))
      a->rate = atof(words[i]);
    else if (option && !strcmp(words[i - 1], "--thin"))
      a->splitting.least_depth = (float)atof(words[i]);
    else if (option && !strcmp(words[i - 1], "--unasked"))
      a->splitting.least_unasked = (float)atof(words[i]);
    else if (option && !strcmp(words[i - 1], "--peak"))
      a->peak = atof(words[i]);
    else if (option && !strcmp(words[i - 1], "--hidden"))
      a->splitting.hidden_threshold = (float)atof(words[i]);
    else if (option)
      return false;
    any = any || !option;
  }
  for (size_t i = 0; i < sizeof solvers / sizeof *solvers && !any; i++) a->wanted[i] = true;
  return true;
}

static vt_status get_views(const arguments *a, opacity_run *run) {
  vt_synthetic_desc scene;
  if (vt_find_scene(a->source, &scene)) {
    if (a->views) scene.train_count = a->views;
    if (a->peak > 0) scene.peak_extinction = a->peak;
    if (a->size) scene.width = scene.height = a->size;
    return photograph_scene(run, &scene, a->noise);
  }
  vt_capture_desc source = vt_default_capture_desc();
  source.source = a->source;
  vt_status status = vt_load_views(run->context, &source, &run->views, NULL);
  if (!status && !vt_count_views(&run->views, VT_TEST)) vt_hold_out(&run->views, 8);
  return status ? status : choose_roles(run);
}

static vt_status run_solver(opacity_run *run, const solver *s, const arguments *a) {
  vt_opacity_desc desc = vt_default_opacity_desc();
  desc.domain = s->domain, desc.step = s->step, desc.iterations = s->iterations;
  if (s->step == VT_STEP_MAJORISER) desc.subset_count = 12, desc.total_variation = 0, desc.least_updates = 0;
  if (a->subsets) desc.subset_count = a->subsets;
  if (a->iterations) desc.iterations = a->iterations;
  if (a->rate > 0) desc.learning_rate = (float)a->rate;
  vt_status status = begin_run(run);
  run->splitting = &a->splitting;
  for (int level = 0; level <= a->leaf && !status; level++) {
    status = solve_run_level(run, &desc, level, level == a->leaf ? 2 : 3);
    if (status || level < 4) continue;
    status = judge_run(run, level);
    const double *t = run->seconds;
    printf("%-10s %5d %9u %10llu %9.1f %8.4f %8.4f %9.4f %7.2f %7.2f %7.2f %7.2f  %u %u\n", s->name, level,
           run->octree.levels[level].cell_count, (unsigned long long)run->report.rays, 100 * run->report.saturated_share,
           run->report.alpha_rmse, run->report.held_out_rmse, run->alpha_rmse, t[0], t[1], t[2], t[0] + t[1] + t[2], run->split_report.empty, run->split_report.hidden);
    fflush(stdout);
  }
  return status;
}

int main(int count, char **words) {
  arguments a;
  if (!read_arguments(count, words, &a)) {
    fprintf(stderr, "bench_opacity CAPTURE|SCENE LEVEL [--views N] [--noise X] [adam|nesterov|majoriser|log]...\n");
    return VT_BAD_USAGE;
  }
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  opacity_run run = {.context = vt_create_context(&desc)};
  vt_status status = run.context ? get_views(&a, &run) : VT_OUT_OF_MEMORY;
  printf("solver     level     cells       rays saturated %%  train held out      test    hull    rays opacity  in all (processor s)\n");
  for (size_t i = 0; i < sizeof solvers / sizeof *solvers && !status; i++)
    if (a.wanted[i]) status = run_solver(&run, &solvers[i], &a);
  if (status && run.context) fprintf(stderr, "bench_opacity: %s\n", vt_last_error(run.context));
  if (run.context) free_opacity_run(&run);
  vt_destroy_context(run.context);
  return (int)status;
}
