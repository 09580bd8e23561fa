// opacity_run.h - from mattes to the opacity of each level, coarse to fine, and its error on views that were held back
// SPDX-License-Identifier: BSD-3-Clause
//
// What reconstruct.c does for the opacity alone, without colours and textures, so that solvers can be compared and judged
// by nothing but alpha: RMSE over all pixels of the test views at their full resolution.
#ifndef VT_TESTS_OPACITY_RUN_H
#define VT_TESTS_OPACITY_RUN_H

#include "datasets-synthetic/synthetic.h"
#include "reconstruct/bounds.h"
#include "reconstruct/hull.h"
#include "reconstruct/opacity.h"
#include "reconstruct/split.h"

#include <math.h>
#include <string.h>

typedef struct opacity_run {
  vt_context *context;
  vt_views views, train, test; // train, test: chosen from views
  int empty_alpha;             // in 1/255: pixels at most this opaque carve (noise of a matte needs more than 2)
  vt_octree octree;
  double root_pixels;          // size of the root's edge in the photographs
  double seconds[3];           // of the processor: hull, rays, opacity
  double alpha_rmse;           // of the test views at the last level that was judged
  vt_opacity_report report;    // of the last level
  const vt_split_desc *splitting; // NULL: every cell is split
  uint8_t *split;              // [cells of the last level] those that are; NULL: all; owned
  vt_split_report split_report;
} opacity_run;

static inline void free_opacity_run(opacity_run *run) { // but for its context
  vt_free_octree(run->context, &run->octree);
  vt_free(run->context, run->split);
  vt_free(run->context, run->train.items);
  vt_free(run->context, run->test.items);
  vt_free_views(run->context, &run->views);
}

static inline vt_status choose_roles(opacity_run *run) {
  vt_status status = vt_select_views(run->context, &run->views, VT_TRAIN, &run->train);
  if (!status) status = vt_select_views(run->context, &run->views, VT_TEST, &run->test);
  if (!run->empty_alpha) run->empty_alpha = 2;
  return status;
}

// A scene of datasets-synthetic with another number of training views (0: its own) and noise in their mattes; the test
// views' stay exact. Noise of four deviations carves no more than an empty matte does.
static inline vt_status photograph_scene(opacity_run *run, const vt_synthetic_desc *scene, double matte_noise) {
  vt_status status = vt_make_synthetic_views(run->context, scene, &run->views);
  if (!status) status = choose_roles(run);
  vt_damage_desc damage = vt_default_damage_desc();
  damage.matte_noise = matte_noise;
  damage.seed = 5;
  if (!status && matte_noise > 0) status = vt_damage_views(run->context, &damage, &run->train); // pixels are changed in place
  if (matte_noise > 0) run->empty_alpha = (int)(4 * 255 * matte_noise);
  return status;
}

static inline double cell_pixels_of(const opacity_run *run, int level) {
  return run->root_pixels / (1 << level);
}

static inline vt_status collect_run(opacity_run *run, int level, double pixels_per_ray, vt_reduced_views *reduced, vt_rays *rays) {
  int factor = (int)(cell_pixels_of(run, level) / pixels_per_ray), coarse = level;
  if (factor < 1) factor = 1;
  while (coarse > 0 && cell_pixels_of(run, coarse) < 8.0 * factor) coarse--;
  vt_status status = vt_reduce_views(run->context, &run->train, factor, reduced);
  return status ? status : vt_collect_rays(run->context, &run->octree, level, coarse, reduced, 8ull << 30, rays);
}

static inline vt_status carve_run(opacity_run *run, int level) {
  vt_level *cells = &run->octree.levels[level], kept;
  int factor = (int)(cell_pixels_of(run, level) / 4);
  vt_silhouettes silhouettes;
  vt_status status = vt_make_silhouettes(run->context, &run->train, factor < 1 ? 1 : factor, run->empty_alpha, &silhouettes);
  if (status) return status;
  uint8_t *keep = VT_NEW(run->context, uint8_t, cells->cell_count);
  status = keep ? vt_carve(run->context, &silhouettes, &run->octree, level, keep) : VT_OUT_OF_MEMORY;
  if (!status) status = vt_filter_level(run->context, 2, level, cells, keep, &kept);
  if (!status) vt_free_level(run->context, cells), *cells = kept;
  vt_free(run->context, keep);
  vt_free_silhouettes(run->context, &silhouettes);
  return status;
}

static inline vt_status judge_run(opacity_run *run, int level) {
  double sum = 0, pixels = 0;
  vt_tree tree = {.octree = run->octree};
  vt_status status = VT_OK;
  for (int i = 0; i < run->test.count && !status; i++) {
    vt_fimage picture = {0};
    const vt_view *view = &run->test.items[i];
    status = vt_composite(run->context, &tree, level, NULL, VT_BLEND_SUM, true, &view->camera, &picture);
    size_t count = (size_t)view->picture.width * (size_t)view->picture.height;
    for (size_t p = 0; p < count && !status; p++) {
      double error = (double)picture.pixels[4 * p + 3] - view->picture.pixels[4 * p + 3] / 255.0;
      sum += error * error;
    }
    pixels += (double)count;
    vt_free_fimage(run->context, &picture);
  }
  run->alpha_rmse = sqrt(sum / pixels);
  return status;
}

// Finds the root cube; no level is there yet.
static inline vt_status begin_run(opacity_run *run) {
  vt_free_octree(run->context, &run->octree);
  vt_free(run->context, run->split);
  run->split = NULL;
  run->octree = (vt_octree){.branching = 2};
  memset(run->seconds, 0, sizeof run->seconds);
  vt_status status = vt_find_bounds(run->context, &run->train, &run->octree);
  double half = run->octree.edge / 2;
  vt_vec3 middle = vt_add(run->octree.origin, vt_v3(half, half, half));
  return status ? status : vt_projected_size(run->context, &run->train, middle, run->octree.edge, &run->root_pixels);
}

static inline vt_status choose_run_splits(opacity_run *run, const vt_level *cells, const vt_rays *rays) {
  vt_free(run->context, run->split);
  run->split = NULL;
  if (!run->splitting) return VT_OK;
  run->split = VT_NEW(run->context, uint8_t, cells->cell_count);
  if (!run->split) return VT_OUT_OF_MEMORY;
  return vt_choose_splits(run->context, run->splitting, rays, cells, run->split, &run->split_report);
}

// Level after level from 0 on; pixels_per_ray: of the photographs, reduced as they are for a level, a cell's edge covers at
// least so many.
static inline vt_status solve_run_level(opacity_run *run, const vt_opacity_desc *desc, int level, double pixels_per_ray) {
  static const uint16_t root[1][3] = {{0, 0, 0}};
  vt_level *cells = &run->octree.levels[level];
  double start = vt_cpu_seconds();
  vt_status status = level ? vt_split_level(run->context, 2, level - 1, &run->octree.levels[level - 1], run->split, cells)
                           : vt_make_level(run->context, 2, 0, 1, root, cells);
  if (!status && !level) cells->optical_depth[0] = 0.5f;
  run->octree.level_count = level + 1;
  if (!status) status = carve_run(run, level);
  double hull = vt_cpu_seconds();
  vt_reduced_views reduced = {0};
  vt_rays rays = {0};
  if (!status) status = collect_run(run, level, pixels_per_ray, &reduced, &rays);
  double collected = vt_cpu_seconds();
  if (!status) status = vt_estimate_opacity(run->context, desc, &rays, cells, &run->report);
  if (!status) status = choose_run_splits(run, cells, &rays);
  vt_free_rays(run->context, &rays);
  vt_free_reduced_views(run->context, &reduced);
  run->seconds[0] += hull - start, run->seconds[1] += collected - hull, run->seconds[2] += vt_cpu_seconds() - collected;
  return status;
}

// All levels up to the leaf, and the leaf's error.
static inline vt_status solve_run(opacity_run *run, const vt_opacity_desc *desc, int leaf) {
  vt_status status = begin_run(run);
  for (int level = 0; level <= leaf && !status; level++) status = solve_run_level(run, desc, level, level == leaf ? 2 : 3);
  return status ? status : judge_run(run, leaf);
}

#endif
