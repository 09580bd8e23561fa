// bench_opacity.c - error of the alpha-only opacity of a capture over levels and processor seconds, solver by solver
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_opacity CAPTURE LEVEL [adam|nesterov|majoriser|log]... 
//
// From mattes to each level, coarse to fine, without any colour; judged on the views of role VT_TEST (or every eighth, held
// out) at their full resolution: RMSE of alpha over all their pixels.

#include "capture/capture.h"
#include "reconstruct/bounds.h"
#include "reconstruct/hull.h"
#include "reconstruct/opacity.h"

#include <string.h>

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

typedef struct work {
  vt_context *context;
  vt_views views, train, test;
  vt_octree octree;
  double root_pixels, seconds[4]; // hull, rays, opacity, judge
} work;

static vt_status collect(work *w, const vt_views *views, int level, double pixels_per_ray, vt_reduced_views *reduced, vt_rays *rays) {
  double pixels = w->root_pixels / (1 << level);
  int factor = (int)(pixels / pixels_per_ray), coarse = level;
  if (factor < 1) factor = 1;
  while (coarse > 0 && w->root_pixels / (1 << coarse) < 8.0 * factor) coarse--;
  vt_status status = vt_reduce_views(w->context, views, factor, reduced);
  return status ? status : vt_collect_rays(w->context, &w->octree, level, coarse, reduced, 8ull << 30, rays);
}

static vt_status carve(work *w, int level) {
  vt_level *cells = &w->octree.levels[level], kept;
  int factor = (int)(w->root_pixels / (1 << level) / 4);
  vt_silhouettes silhouettes;
  vt_status status = vt_make_silhouettes(w->context, &w->train, factor < 1 ? 1 : factor, 2, &silhouettes);
  if (status) return status;
  uint8_t *keep = VT_NEW(w->context, uint8_t, cells->cell_count);
  status = keep ? vt_carve(w->context, &silhouettes, &w->octree, level, keep) : VT_OUT_OF_MEMORY;
  if (!status) status = vt_filter_level(w->context, 2, level, cells, keep, &kept);
  if (!status) vt_free_level(w->context, cells), *cells = kept;
  vt_free(w->context, keep);
  vt_free_silhouettes(w->context, &silhouettes);
  return status;
}

static vt_status judge(work *w, int level, double *rmse) {
  double sum = 0, pixels = 0;
  vt_tree tree = {.octree = w->octree};
  vt_status status = VT_OK;
  for (int i = 0; i < w->test.count && !status; i++) {
    vt_fimage picture = {0};
    const vt_view *view = &w->test.items[i];
    status = vt_composite(w->context, &tree, level, NULL, VT_BLEND_SUM, true, &view->camera, &picture);
    size_t count = (size_t)view->picture.width * (size_t)view->picture.height;
    for (size_t p = 0; p < count && !status; p++) {
      double error = (double)picture.pixels[4 * p + 3] - view->picture.pixels[4 * p + 3] / 255.0;
      sum += error * error;
    }
    pixels += (double)count;
    vt_free_fimage(w->context, &picture);
  }
  *rmse = sqrt(sum / pixels);
  return status;
}

static vt_status solve_level(work *w, const solver *s, int level, bool last) {
  static const uint16_t root[1][3] = {{0, 0, 0}};
  double start = vt_cpu_seconds(), rmse = 0;
  vt_status status = level ? vt_split_level(w->context, 2, level - 1, &w->octree.levels[level - 1], NULL, &w->octree.levels[level])
                           : vt_make_level(w->context, 2, 0, 1, root, &w->octree.levels[0]);
  if (!status && !level) w->octree.levels[0].optical_depth[0] = 0.5f;
  w->octree.level_count = level + 1;
  if (!status) status = carve(w, level);
  double hull = vt_cpu_seconds();
  vt_reduced_views reduced = {0};
  vt_rays rays = {0};
  if (!status) status = collect(w, &w->train, level, last ? 2 : 3, &reduced, &rays);
  double collected = vt_cpu_seconds();
  vt_opacity_desc desc = vt_default_opacity_desc();
  vt_opacity_report report = {0};
  desc.domain = s->domain, desc.step = s->step, desc.iterations = s->iterations;
  if (s->step == VT_STEP_MAJORISER) desc.subset_count = 12, desc.total_variation = 0, desc.least_updates = 0;
  if (getenv("VT_TV")) desc.total_variation = (float)atof(getenv("VT_TV"));
  if (getenv("VT_RATE")) desc.learning_rate = (float)atof(getenv("VT_RATE"));
  if (getenv("VT_ITER")) desc.iterations = atoi(getenv("VT_ITER"));
  if (getenv("VT_SUB")) desc.subset_count = atoi(getenv("VT_SUB"));
  if (getenv("VT_WEIGH")) desc.weigh_views = atoi(getenv("VT_WEIGH"));
  if (!status) status = vt_estimate_opacity(w->context, &desc, &rays, &w->octree.levels[level], &report);
  double solved = vt_cpu_seconds();
  vt_free_rays(w->context, &rays);
  vt_free_reduced_views(w->context, &reduced);
  w->seconds[0] += hull - start, w->seconds[1] += collected - hull, w->seconds[2] += solved - collected;
  if (!status && level >= 4) status = judge(w, level, &rmse);
  if (!status && level >= 4)
    printf("%-10s %5d %9u %10llu %9.1f %8.4f %8.4f %9.4f %7.2f %7.2f %7.2f %7.2f\n", s->name, level, w->octree.levels[level].cell_count,
           (unsigned long long)report.rays, 100 * report.saturated_share, report.alpha_rmse, report.held_out_rmse, rmse,
           w->seconds[0], w->seconds[1], w->seconds[2], w->seconds[0] + w->seconds[1] + w->seconds[2]);
  fflush(stdout);
  return status;
}

static vt_status run_solver(work *w, const solver *s, int leaf) {
  w->octree = (vt_octree){.branching = 2};
  memset(w->seconds, 0, sizeof w->seconds);
  vt_status status = vt_find_bounds(w->context, &w->train, &w->octree);
  double half = w->octree.edge / 2;
  vt_vec3 middle = vt_add(w->octree.origin, vt_v3(half, half, half));
  if (!status) status = vt_projected_size(w->context, &w->train, middle, w->octree.edge, &w->root_pixels);
  for (int level = 0; level <= leaf && !status; level++) status = solve_level(w, s, level, level == leaf);
  vt_free_octree(w->context, &w->octree);
  return status;
}

static bool is_wanted(const char *name, int count, char **names) {
  for (int i = 0; i < count; i++)
    if (!strcmp(name, names[i])) return true;
  return count == 0;
}

int main(int count, char **arguments) {
  if (count < 3 || atoi(arguments[2]) < 1 || atoi(arguments[2]) > VT_MAX_LEVEL) {
    fprintf(stderr, "bench_opacity CAPTURE LEVEL [adam|nesterov|majoriser|log]...\n");
    return VT_BAD_USAGE;
  }
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  work w = {.context = vt_create_context(&desc)};
  vt_capture_desc source = vt_default_capture_desc();
  source.source = arguments[1];
  vt_status status = vt_load_views(w.context, &source, &w.views, NULL);
  if (!status && !vt_count_views(&w.views, VT_TEST)) vt_hold_out(&w.views, 8);
  if (!status) status = vt_select_views(w.context, &w.views, VT_TRAIN, &w.train);
  if (!status) status = vt_select_views(w.context, &w.views, VT_TEST, &w.test);
  printf("solver     level     cells       rays saturated %%  train held out      test    hull    rays opacity  in all (processor s)\n");
  for (size_t i = 0; i < sizeof solvers / sizeof *solvers && !status; i++)
    if (is_wanted(solvers[i].name, count - 3, arguments + 3)) status = run_solver(&w, &solvers[i], atoi(arguments[2]));
  if (status) fprintf(stderr, "bench_opacity: %s\n", vt_last_error(w.context));
  vt_free(w.context, w.train.items);
  vt_free(w.context, w.test.items);
  vt_free_views(w.context, &w.views);
  vt_destroy_context(w.context);
  return (int)status;
}
