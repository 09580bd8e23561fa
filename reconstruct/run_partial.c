// run_partial.c - opacity alone, and the hull alone
// SPDX-License-Identifier: BSD-3-Clause

#include "reconstruct/colour.h"
#include "reconstruct/run.h"

// Corners whose field shows the mattes, rather than cells that do.
static vt_status fit_bare(vt_run *r, int level, const vt_rays *rays) {
  vt_level *cells = &r->tree->octree.levels[level];
  vt_fit_desc fit = vt_default_fit_desc();
  fit.neighbours = 0, fit.epochs = r->bare_epochs;
  vt_status status = vt_estimate_colour(r->context, rays, cells);
  if (!status) status = vt_make_corners(r->context, r->tree->octree.branching, cells);
  if (!status) status = vt_corners_from_cells(r->context, cells);
  return status ? status : vt_fit_field(r->context, &fit, rays, r->tree, cells);
}

// Rays of a level for opacity alone: two to three pixels a cell say what cells can hold.
static vt_status solve_alone(vt_run *r, int level) {
  double start = vt_seconds();
  int factor = (int)(vt_cell_pixels(r, level) / (level == r->leaf ? 2 : 3));
  vt_reduced_views reduced;
  vt_rays rays = {0};
  vt_status status = vt_reduce_views(r->context, r->views, factor < 1 ? 1 : factor, &reduced);
  if (status) return status;
  r->report->levels[level] = (vt_level_report){.level = level, .hull_cells = r->tree->octree.levels[level].cell_count};
  r->report->levels[level].cells = r->report->levels[level].hull_cells;
  status = vt_collect_rays(r->context, &r->tree->octree, level, vt_coarse_level_for(r, level, reduced.factor), &reduced, vt_ray_bound(r),
                           &rays);
  r->report->seconds_rays += vt_seconds() - start;
  if (!status) status = vt_estimate_level(r, level, &rays);
  if (!status && level == r->leaf && r->bare_epochs) status = fit_bare(r, level, &rays);
  if (!status && level < r->leaf) status = vt_plan_next_level(r, level, &rays);
  r->report->levels[level].seconds_opacity = vt_seconds() - start;
  r->report->seconds_opacity += vt_seconds() - start;
  vt_free_rays(r->context, &rays);
  vt_free_reduced_views(r->context, &reduced);
  return status;
}

static vt_opacity_desc desc_of_solver(vt_solver solver, int sweeps) {
  vt_opacity_desc desc = solver == VT_SOLVER_LOG ? vt_sart_opacity_desc() : vt_default_opacity_desc();
  if (solver == VT_SOLVER_NESTEROV) desc.step = VT_STEP_NESTEROV, desc.iterations = 40;
  if (solver == VT_SOLVER_MAJORISER) {
    desc = vt_sart_opacity_desc();
    desc.domain = VT_TRANSMITTANCE_DOMAIN;
    desc.iterations = 4;
  }
  if (sweeps > 0) desc.iterations = sweeps, desc.least_updates = 0;
  return desc;
}

vt_status vt_solve_opacity_levels(vt_run *r) {
  vt_octree *octree = &r->tree->octree;
  vt_status status = r->views->count ? vt_prepare_run(r)
                                     : vt_fail(r->context, VT_TOO_FEW_VIEWS, "photographs: there is none; give at least 3");
  for (int l = 0; l <= r->leaf && !status; l++) {
    double start = vt_seconds();
    status = vt_begin_level(r, l);
    if (!status) status = vt_carve_level(r, l);
    r->bytes_before = vt_bytes_in_use(r->context);
    r->report->seconds_hull += vt_seconds() - start;
    octree->level_count = l + 1;
    if (!status && !octree->levels[l].cell_count) break; // nothing so fine
    if (!status) status = solve_alone(r, l);
  }
  vt_free(r->context, r->split);
  r->split = NULL;
  return status;
}

vt_status vt_reconstruct_opacity(vt_context *context, const vt_views *views, vt_solver solver, int sweeps, int level,
                                 vt_tree *out, vt_reconstruct_report *or_null) {
  VT_ASSERT(level >= 0 && level <= VT_MAX_LEVEL);
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_DRAFT);
  vt_reconstruct_report report = {0};
  vt_views train;
  *out = (vt_tree){0};
  vt_status status = vt_select_views(context, views, VT_TRAIN, &train);
  if (status) return status;
  vt_run r = {context, &desc, vt_recipe_of(&desc), &train, out, &report, .start = vt_seconds(), .leaf = level};
  desc.split_where_needed = solver != VT_SOLVER_LOG; // which stays as the papers have it
  r.recipe.opacity = desc_of_solver(solver, sweeps);
  status = vt_solve_opacity_levels(&r);
  report.leaf_level = out->octree.level_count - 1;
  vt_free(context, train.items);
  if (status) vt_free_tree(context, out);
  if (or_null) *or_null = report;
  return status;
}

vt_status vt_reconstruct_hull(vt_context *context, const vt_views *views, int level, vt_tree *out) {
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_DRAFT);
  vt_reconstruct_report report = {0};
  *out = (vt_tree){0};
  vt_views train;
  vt_status status = vt_select_views(context, views, VT_TRAIN, &train);
  if (status) return status;
  vt_run r = {context, &desc, vt_recipe_of(&desc), &train, out, &report, .leaf = level};
  status = train.count ? vt_prepare_run(&r) : vt_fail(context, VT_TOO_FEW_VIEWS, "photographs: there is none; give at least 3");
  for (int l = 0; l <= level && !status; l++) {
    status = vt_begin_level(&r, l);
    if (!status) status = vt_carve_level(&r, l);
  }
  vt_reduced_views reduced = {0};
  if (!status) status = vt_reduce_for_level(&r, level, &reduced);
  vt_level *cells = &out->octree.levels[level];
  for (uint32_t i = 0; i < cells->cell_count && !status; i++) cells->optical_depth[i] = 30;
  vt_rays rays = {0};
  if (!status) status = vt_collect_rays(context, &out->octree, level, vt_coarse_level_for(&r, level, reduced.factor), &reduced,
                                          vt_ray_bound(&r), &rays);
  if (!status) status = vt_estimate_colour(context, &rays, cells);
  vt_free_rays(context, &rays);
  out->octree.level_count = level + 1;
  vt_free_reduced_views(context, &reduced);
  vt_free(context, train.items);
  if (status) vt_free_tree(context, out);
  return status;
}
