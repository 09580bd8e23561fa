// bench_opacity.c - error of the alpha-only opacity of a capture or a scene over levels and processor seconds, solver by solver
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_opacity CAPTURE|SCENE LEVEL [--views N] [--noise X] [--pose PIXELS] [--size PIXELS] [--peak X]
//       [--subsets N] [--iterations N] [--leaf-iterations N] [--rate X] [--last-rate X] [--variation X] [--thin X] [--unasked X]
//       [--hidden X] [--pictures FOLDER] [adam|nesterov|majoriser|log|oracle]...
//
// From mattes to each level, coarse to fine, without any colour; judged on the views of role VT_TEST (or every eighth, held
// out) at their full resolution: RMSE of alpha over all their pixels. Of a capture N training views are taken, evenly. A name
// that vt_find_scene knows is photographed, by N training views, with noise of deviation X in their mattes. --pose turns each
// training camera by an angle of that many pixels' deviation, which the solver does not know. `oracle` is no solver: it puts the
// scene's true mean extinction into each cell of the hull; its error is what constant cells leave at that level, if they hold
// what is there. A solver may do better, since it chooses the constants that predict best, not the means.

#include "capture/capture.h"
#include "bench/opacity_pictures.h"
#include "tests/opacity_run.h"

typedef struct solver {
  const char *name;
  vt_opacity_domain domain;
  vt_opacity_step step;
  int iterations; // 0: the truth is put in
} solver;

static const solver solvers[] = {{"adam", VT_TRANSMITTANCE_DOMAIN, VT_STEP_ADAM, 4},
                                 {"nesterov", VT_TRANSMITTANCE_DOMAIN, VT_STEP_NESTEROV, 40},
                                 {"majoriser", VT_TRANSMITTANCE_DOMAIN, VT_STEP_MAJORISER, 4},
                                 {"log", VT_LOG_DOMAIN, VT_STEP_MAJORISER, 3},
                                 {"oracle", VT_TRANSMITTANCE_DOMAIN, VT_STEP_ADAM, 0}};
enum { ORACLE = 4, SOLVER_COUNT = sizeof solvers / sizeof *solvers };

typedef struct arguments {
  const char *source, *pictures;
  int leaf;
  double views, noise, pose, size, peak, subsets, iterations, leaf_iterations; // 0: the default
  double rate, last_rate, variation, thin, unasked, hidden;                    // negative: the default
  bool wanted[SOLVER_COUNT];
  vt_synthetic_desc scene;
  bool is_scene;
} arguments;

static bool choose_solver(arguments *a, const char *name) {
  for (int i = 0; i < SOLVER_COUNT; i++)
    if (!strcmp(solvers[i].name, name)) return a->wanted[i] = true;
  return false;
}

static bool read_option(arguments *a, const char *name, const char *value) {
  const struct {
    const char *name;
    double *to;
  } options[] = {{"--views", &a->views},         {"--noise", &a->noise},           {"--pose", &a->pose},
                 {"--size", &a->size},           {"--peak", &a->peak},             {"--subsets", &a->subsets},
                 {"--iterations", &a->iterations}, {"--leaf-iterations", &a->leaf_iterations},
                 {"--rate", &a->rate},           {"--last-rate", &a->last_rate},   {"--variation", &a->variation},
                 {"--thin", &a->thin},           {"--unasked", &a->unasked},       {"--hidden", &a->hidden}};
  if (!strcmp(name, "--pictures")) a->pictures = value;
  for (size_t i = 0; i < sizeof options / sizeof *options; i++)
    if (!strcmp(options[i].name, name)) return *options[i].to = atof(value), true;
  return !strcmp(name, "--pictures");
}

static bool read_arguments(int count, char **words, arguments *a) {
  bool any = false;
  *a = (arguments){.source = count > 1 ? words[1] : NULL, .leaf = count > 2 ? atoi(words[2]) : 0};
  a->rate = a->last_rate = a->variation = a->thin = a->unasked = a->hidden = -1;
  if (a->leaf < 1 || a->leaf > VT_MAX_LEVEL) return false;
  for (int i = 3; i < count; i++) {
    bool option = words[i][0] == '-';
    if (option && (++i == count || !read_option(a, words[i - 1], words[i]))) return false;
    if (!option && !choose_solver(a, words[i])) return false;
    any = any || !option;
  }
  for (int i = 0; i < SOLVER_COUNT && !any; i++) a->wanted[i] = i != ORACLE;
  return true;
}

// Of the training views, which run->train lists without owning them, as many as wanted, evenly.
static void thin_out(vt_views *train, int wanted) {
  int kept = 0;
  if (wanted >= train->count) return;
  for (int i = 0; i < wanted; i++) train->items[kept++] = train->items[(long long)i * train->count / wanted];
  train->count = kept;
}

static vt_status forget_poses(opacity_run *run, double pixels) {
  vt_damage_desc damage = vt_default_damage_desc();
  damage.seed = 7;
  damage.pose_degrees = pixels / run->train.items[0].camera.fx * 180 / VT_PI;
  return vt_damage_views(run->context, &damage, &run->train);
}

static vt_status get_views(arguments *a, opacity_run *run) {
  vt_status status;
  a->is_scene = vt_find_scene(a->source, &a->scene);
  if (a->is_scene) {
    if (a->views > 0) a->scene.train_count = (int)a->views;
    if (a->peak > 0) a->scene.peak_extinction = a->peak;
    if (a->size > 0) a->scene.width = a->scene.height = (int)a->size;
    status = photograph_scene(run, &a->scene, a->noise);
  } else {
    vt_capture_desc source = vt_default_capture_desc();
    source.source = a->source;
    status = vt_load_views(run->context, &source, &run->views, NULL);
    if (!status && !vt_count_views(&run->views, VT_TEST)) vt_hold_out(&run->views, 8);
    if (!status) status = choose_roles(run);
    if (!status && a->views > 0) thin_out(&run->train, (int)a->views);
  }
  return !status && a->pose > 0 ? forget_poses(run, a->pose) : status;
}

static vt_opacity_desc desc_of(const solver *s, const arguments *a) {
  vt_opacity_desc desc = vt_default_opacity_desc();
  desc.domain = s->domain, desc.step = s->step, desc.iterations = s->iterations;
  if (s->step == VT_STEP_MAJORISER) desc.subset_count = 12, desc.total_variation = 0, desc.least_updates = 0;
  if (a->subsets > 0) desc.subset_count = (int)a->subsets;
  if (a->iterations > 0 && s->iterations) desc.iterations = (int)a->iterations;
  if (a->rate >= 0) desc.learning_rate = (float)a->rate;
  if (a->last_rate >= 0) desc.last_rate = (float)a->last_rate;
  if (a->variation >= 0) desc.total_variation = (float)a->variation;
  return desc;
}

static vt_split_desc splitting_of(const solver *s, const arguments *a) {
  vt_split_desc desc = vt_default_split_desc();
  if (a->thin >= 0) desc.least_depth = (float)a->thin;
  if (a->unasked >= 0) desc.least_unasked = (float)a->unasked;
  if (a->hidden >= 0) desc.hidden_threshold = (float)a->hidden;
  if (s->domain == VT_LOG_DOMAIN || !s->iterations) desc.least_depth = 0, desc.hidden_threshold = 1; // all are split
  return desc;
}

static vt_status put_truth_in(opacity_run *run, const arguments *a, int level) {
  vt_level *cells = &run->octree.levels[level];
  vt_truth *truth = NULL;
  uint16_t(*xyz)[3] = vt_alloc(run->context, cells->cell_count, sizeof *xyz);
  vt_status status = xyz ? vt_create_truth(run->context, &a->scene, &truth) : VT_OUT_OF_MEMORY;
  for (uint32_t i = 0; i < cells->cell_count && !status; i++)
    xyz[i][0] = cells->x[i], xyz[i][1] = cells->y[i], xyz[i][2] = cells->z[i];
  if (!status)
    status = vt_true_cells(run->context, truth, run->octree.origin, run->octree.edge, cells->axis_cells, cells->cell_count,
                           (const uint16_t(*)[3])xyz, cells->optical_depth, NULL);
  double edge = vt_cell_edge(&run->octree, level);
  for (uint32_t i = 0; i < cells->cell_count && !status; i++) cells->optical_depth[i] *= (float)edge;
  vt_destroy_truth(run->context, truth);
  vt_free(run->context, xyz);
  return status;
}

static vt_status run_solver(opacity_run *run, const solver *s, const arguments *a) {
  vt_opacity_desc desc = desc_of(s, a);
  vt_split_desc splitting = splitting_of(s, a);
  vt_status status = begin_run(run);
  run->splitting = &splitting;
  for (int level = 0; level <= a->leaf && !status; level++) {
    vt_opacity_desc here = desc;
    if (level == a->leaf && a->leaf_iterations > 0 && s->iterations) here.iterations = (int)a->leaf_iterations;
    status = solve_run_level(run, &here, level, level == a->leaf ? 2 : 3);
    if (!status && !s->iterations) status = put_truth_in(run, a, level);
    if (status || level < 4) continue;
    status = judge_run(run, level);
    const double *t = run->seconds;
    printf("%-10s %5d %9u %8u %8u %10llu %9.1f %8.4f %8.4f %9.4f %7.2f %7.2f %7.2f %7.2f\n", s->name, level,
           run->octree.levels[level].cell_count, run->split_report.empty, run->split_report.hidden,
           (unsigned long long)run->report.rays, 100 * run->report.saturated_share, run->report.alpha_rmse,
           run->report.held_out_rmse, run->alpha_rmse, t[0], t[1], t[2], t[0] + t[1] + t[2]);
    fflush(stdout);
  }
  if (!status && a->pictures) status = write_opacity_pictures(run->context, &run->octree, a->leaf, &run->test, a->pictures, s->name);
  return status;
}

int main(int count, char **words) {
  arguments a;
  if (!read_arguments(count, words, &a)) {
    fprintf(stderr, "bench_opacity CAPTURE|SCENE LEVEL [--views N] [--noise X] ... [adam|nesterov|majoriser|log|oracle]...\n");
    return VT_BAD_USAGE;
  }
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  opacity_run run = {.context = vt_create_context(&desc)};
  vt_status status = run.context ? get_views(&a, &run) : VT_OUT_OF_MEMORY;
  printf("solver     level     cells    empty   hidden       rays saturated %%  train held out      test    hull    rays opacity  in all (processor s)\n");
  if (!status && a.wanted[ORACLE] && !a.is_scene)
    status = vt_fail(run.context, VT_BAD_USAGE, "oracle: only a scene's truth is known; give one of vt_find_scene");
  for (int i = 0; i < SOLVER_COUNT && !status; i++)
    if (a.wanted[i]) status = run_solver(&run, &solvers[i], &a);
  if (status && run.context) fprintf(stderr, "bench_opacity: %s\n", vt_last_error(run.context));
  if (run.context) free_opacity_run(&run);
  vt_destroy_context(run.context);
  return (int)status;
}
