// reconstruct.c - the order of the stages from views to a raw tree
// SPDX-License-Identifier: BSD-3-Clause
//
// Coarse to fine: at each level the children of what stood at the level before are carved by the mattes, solved for
// opacity and colour on photographs of matching resolution, and pruned of what turned out empty. The finest levels are
// refined through the compositor. Then every level gets its textures from its own cells and its own photographs.

#include "reconstruct/reconstruct.h"
#include "reconstruct/billboards.h"
#include "reconstruct/bounds.h"
#include "reconstruct/colour.h"
#include "reconstruct/coverage.h"
#include "reconstruct/hull.h"
#include "reconstruct/opacity.h"
#include "reconstruct/probe_level.h"
#include "reconstruct/fit.h"
#include "reconstruct/view_textures.h"
#include <stdlib.h>
static double tune(const char *n, double d) { const char *v = getenv(n); return v ? atof(v) : d; }
#include "reconstruct/split.h"

#define LARGEST_RAY_STORE (3ull << 30) // bytes
#define LARGEST_SHARE_LEFT 0.05        // of the opacity, in cells that are not split for want of memory
#define TEXELS_PER_EDGE(tree) ((double)(tree)->texel_edge / (double)(tree)->tile_side)

vt_reconstruct_desc vt_default_reconstruct_desc(vt_method method, vt_preset preset) {
  return (vt_reconstruct_desc){.cookie = VT_COOKIE,
                               .method = method,
                               .preset = preset,
                               .hull_votes = 1,
                               .hidden_threshold = 0.99,
                               .skip_empty_pixels = true,
                               .keep_chords = true,
                               .prune_hidden = true,
                               .prune_thin = true,
                               .split_where_needed = method == VT_METHOD_BEST,
                               .refine_epochs = -1};
}

typedef struct recipe { // what method and preset mean
  vt_opacity_desc opacity;
  vt_billboard_desc billboard;
  int colour_iterations, refine_epochs;
  bool field;       // opacity and colour at corners, and view textures; else constant cells and tiles
  int finer_levels; // than the level at which a texel is a pixel
} recipe;

static recipe recipe_of(const vt_reconstruct_desc *desc) {
  recipe r = {vt_default_opacity_desc(), vt_default_billboard_desc(), 2, 4, desc->method == VT_METHOD_BEST, 0};
  r.billboard.hidden_threshold = desc->hidden_threshold;
  r.finer_levels = desc->preset == VT_PRESET_DRAFT ? -1 : desc->preset == VT_PRESET_NORMAL ? 0 : 1;
  if (desc->method != VT_METHOD_BEST) {
    r.refine_epochs = 0;
    r.opacity = vt_sart_opacity_desc();
    r.colour_iterations = 0;
    r.billboard.prune = desc->method == VT_METHOD_2006;
    r.billboard.neighbours = 0;
  }
  r.billboard.prune = r.billboard.prune && desc->prune_hidden;
  if (desc->refine_epochs >= 0) r.refine_epochs = desc->refine_epochs;
  return r;
}

typedef struct run {
  vt_context *context;
  const vt_reconstruct_desc *desc;
  recipe recipe;
  const vt_views *views;
  vt_tree *tree;
  vt_reconstruct_report *report;
  double start, root_pixels; // root_pixels: size of the root's edge in the photographs
  int leaf;                  // the last level that is to be made
  uint64_t bytes_before;     // in use when a level's hull was there and nothing else of it
  uint8_t *split;            // [cells of the last level] those that the next comes from; NULL: all; owned
} run;

static double cell_pixels(const run *r, int level) {
  return r->root_pixels * vt_cell_edge(&r->tree->octree, level) / r->tree->octree.edge;
}

// The level at which a texel is about a pixel (at most 1.25) of the photographs.
static int default_leaf_level(const run *r) {
  int level = 1;
  while (level < VT_MAX_LEVEL && cell_pixels(r, level) > 1.25 * TEXELS_PER_EDGE(r->tree)) level++;
  level += r->recipe.finer_levels;
  return level < 1 ? 1 : level > VT_MAX_LEVEL ? VT_MAX_LEVEL : level;
}

static vt_status replace_level(run *r, int level, const uint8_t *keep, vt_rays *rays_or_null) {
  vt_level kept, *cells = &r->tree->octree.levels[level];
  vt_status status = vt_filter_level(r->context, r->tree->octree.branching, level, cells, keep, &kept);
  if (status) return status;
  if (rays_or_null) {
    uint32_t *new_index = VT_NEW(r->context, uint32_t, cells->cell_count), next = 0;
    if (!new_index) {
      vt_free_level(r->context, &kept);
      return VT_OUT_OF_MEMORY;
    }
    for (uint32_t i = 0; i < cells->cell_count; i++) new_index[i] = keep[i] ? next++ : VT_NO_CELL;
    vt_renumber_rays(r->context, rays_or_null, new_index);
    vt_free(r->context, new_index);
  }
  vt_free_level(r->context, cells);
  *cells = kept;
  return VT_OK;
}

static vt_status carve_level(run *r, int level) {
  vt_context *context = r->context;
  vt_level *cells = &r->tree->octree.levels[level];
  int factor = (int)(cell_pixels(r, level) / 4);
  vt_silhouettes silhouettes;
  vt_status status = vt_make_silhouettes(context, r->views, factor < 1 ? 1 : factor, 2, &silhouettes);
  if (status) return status;
  silhouettes.votes = r->desc->hull_votes;
  uint8_t *keep = VT_NEW(context, uint8_t, cells->cell_count);
  status = keep ? vt_carve(context, &silhouettes, &r->tree->octree, level, keep) : VT_OUT_OF_MEMORY;
  if (!status) status = replace_level(r, level, keep, NULL);
  vt_free(context, keep);
  vt_free_silhouettes(context, &silhouettes);
  return status;
}

// A cell thinner than what half a pixel of full opacity would give, or than 0.01, is empty.
static float least_depth(const run *r, int level) {
  double pixels = cell_pixels(r, level);
  return (float)fmin(0.01, 0.5 / (pixels * pixels));
}

// Only the leaf level loses its empty cells: on coarser ones they may still hold the tips of twigs, and their children
// are looked for within them. They get no textures.
static vt_status prune_level(run *r, int level, vt_rays *rays) {
  vt_level *cells = &r->tree->octree.levels[level];
  float least = least_depth(r, level);
  if (!r->desc->prune_thin) return VT_OK;
  uint8_t *keep = VT_NEW(r->context, uint8_t, cells->cell_count);
  if (!keep) return VT_OUT_OF_MEMORY;
  for (uint32_t i = 0; i < cells->cell_count; i++) keep[i] = cells->optical_depth[i] >= least;
  vt_status status = replace_level(r, level, keep, rays);
  vt_free(r->context, keep);
  return status;
}

static vt_status reduce_for_level(run *r, int level, vt_reduced_views *out) {
  int factor = (int)(cell_pixels(r, level) / TEXELS_PER_EDGE(r->tree));
  return vt_reduce_views(r->context, r->views, factor < 1 ? 1 : factor, out);
}

static vt_status begin_level(run *r, int level) {
  vt_octree *octree = &r->tree->octree;
  if (level) {
    vt_status status = vt_split_level(r->context, octree->branching, level - 1, &octree->levels[level - 1], r->split,
                                      &octree->levels[level]);
    vt_free(r->context, r->split);
    r->split = NULL;
    return status;
  }
  const uint16_t root[1][3] = {{0, 0, 0}};
  vt_status status = vt_make_level(r->context, octree->branching, 0, 1, root, &octree->levels[0]);
  if (!status) octree->levels[0].optical_depth[0] = 0.5f;
  return status;
}

static vt_status estimate_level(run *r, int level, const vt_rays *rays) {
  vt_level *cells = &r->tree->octree.levels[level];
  vt_level_report *report = &r->report->levels[level];
  vt_opacity_report opacity;
  vt_coverage coverage = {0};
  vt_status status = vt_estimate_opacity(r->context, &r->recipe.opacity, rays, cells, &opacity);
  if (!status) status = vt_measure_coverage(r->context, rays, cells, NULL, &coverage);
  report->rays = opacity.rays;
  report->saturated_share = opacity.saturated_share;
  report->alpha_rmse = opacity.alpha_rmse;
  report->held_out_rmse = opacity.held_out_rmse;
  report->unconstrained = coverage.unconstrained;
  report->coverage_degrees = coverage.median_degrees;
  report->narrow_share = coverage.narrow_share;
  return status;
}

// ---- the next level

static uint64_t ray_bound(const run *r) {
  uint64_t quarter = vt_memory_bound(r->context) / 4;
  if (!r->desc->keep_chords) return 0;
  return quarter < LARGEST_RAY_STORE ? quarter : LARGEST_RAY_STORE;
}

// Bytes that a level will take, about: chords of rays, sums of the lanes, and textures of the cells that are kept (two in
// five of the hull).
static uint64_t level_bytes(const run *r, uint64_t hull_cells) {
  uint64_t tile = 4 * (uint64_t)(r->tree->texel_edge * r->tree->texel_edge), views = (uint64_t)r->views->count;
  uint64_t chords = hull_cells * views * 64, most = ray_bound(r);
  return (chords < most ? chords : most) + hull_cells * (64 + 16 * VT_LANES) + hull_cells * 2 / 5 * views * (tile + 5);
}

static double growth_of(const run *r) { return r->tree->octree.branching == 2 ? 6 : 13; } // of the cells of a hull

// So many cells can be split within memory.
static uint32_t most_splits(const run *r, int level) {
  uint32_t low = 0, high = r->tree->octree.levels[level].cell_count;
  while (low < high) {
    uint32_t middle = high - (high - low) / 2;
    if (r->bytes_before + level_bytes(r, (uint64_t)(growth_of(r) * middle)) <= vt_memory_bound(r->context))
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

static void end_tree(run *r, int level) {
  uint64_t bytes = level_bytes(r, (uint64_t)(growth_of(r) * r->tree->octree.levels[level].cell_count));
  vt_log(r->context, VT_LOG_NORMAL, "level %d would take about %.0f MB of %.0f MB; the tree ends at level %d", level + 1,
         (double)bytes * 1e-6, (double)vt_memory_bound(r->context) * 1e-6, level);
  r->leaf = level;
}

static void report_split(run *r, int level, const vt_split_report *split) {
  vt_level_report *report = &r->report->levels[level];
  report->unsplit_empty = split->empty;
  report->unsplit_hidden = split->hidden;
  report->unsplit_for_memory = split->for_memory;
  if (split->for_memory)
    vt_log(r->context, VT_LOG_NORMAL, "level %d: memory is short, %u of %u cells with %.1f %% of the opacity are not split", level,
           split->for_memory, r->tree->octree.levels[level].cell_count, 100 * split->opacity_left);
}

// Which cells of the solved level the next one comes from. Where too much would have to be left behind for want of memory, this
// level is the last.
static vt_status plan_next_level(run *r, int level, const vt_rays *rays) {
  const vt_level *cells = &r->tree->octree.levels[level];
  uint32_t most = level > 3 ? most_splits(r, level) : cells->cell_count;
  if (!r->desc->split_where_needed) {
    if (most < cells->cell_count) end_tree(r, level);
    return VT_OK;
  }
  vt_split_desc desc = vt_default_split_desc();
  vt_split_report split;
  desc.hidden_threshold = (float)r->desc->hidden_threshold;
  desc.most_cells = most;
  r->split = VT_NEW(r->context, uint8_t, cells->cell_count);
  if (!r->split) return VT_OUT_OF_MEMORY;
  vt_status status = vt_choose_splits(r->context, &desc, rays, cells, r->split, &split);
  if (!status && split.split && split.opacity_left <= LARGEST_SHARE_LEFT) {
    report_split(r, level, &split);
    return VT_OK;
  }
  vt_free(r->context, r->split);
  r->split = NULL;
  if (!status && split.split < cells->cell_count) end_tree(r, level);
  return status;
}

static vt_status fit_level(run *r, int level, int leaf, vt_rays *rays) {
  vt_context *context = r->context;
  vt_level *cells = &r->tree->octree.levels[level];
  vt_status status = vt_make_corners(context, r->tree->octree.branching, cells);
  if (!status) status = vt_corners_from_cells(context, cells);
  vt_fit_desc fit = vt_default_fit_desc();
  fit.epochs = level == leaf ? (int)tune("EA", 2) : (int)tune("EI", 1);
  fit.opacity_step = (float)tune("SA", .05);
  fit.colour_step = (float)tune("CA", .02);
  fit.last_step_share = (float)tune("DA", .3);
  fit.batch_count = (int)tune("BA", 48);
  if (!status) status = vt_fit_field(context, &fit, rays, r->tree, cells);
  if (level == leaf) {
    fit.epochs = (int)tune("EB", 2);
    fit.neighbours = (int)tune("NB", 4);
    fit.opacity_step = (float)tune("SB", .05);
    fit.colour_step = (float)tune("CB", .01);
    fit.last_step_share = (float)tune("DB", .2);
    fit.batch_count = (int)tune("BA", 48);
    fit.ratio_limit = (float)tune("RL", 10);
    if (!status) status = vt_fit_field(context, &fit, rays, r->tree, cells);
  }
  if (!status) vt_cells_from_corners(cells);
  return status;
}

// Opacity and colour of a level whose rays are there.
static vt_status solve_level(run *r, int level, vt_rays *rays) {
  vt_context *context = r->context;
  vt_level *cells = &r->tree->octree.levels[level];
  double start = vt_seconds();
  vt_status status = estimate_level(r, level, rays);
  if (!status && level == r->leaf) status = prune_level(r, level, rays);
  double solved = vt_seconds();
  bool fitted = r->recipe.field;
  if (!status) status = vt_estimate_colour(context, rays, cells, fitted ? 0 : r->recipe.colour_iterations);
  double coloured = vt_seconds();
  if (!status && fitted) status = fit_level(r, level, r->leaf, rays);
  if (!status && level < r->leaf) status = plan_next_level(r, level, rays);
  r->report->seconds_opacity += solved - start;
  r->report->seconds_colour += coloured - solved;
  r->report->seconds_refinement += vt_seconds() - coloured;
  r->report->peak_bytes_opacity = vt_peak_bytes(context);
  return status;
}

static vt_status texture_level(run *r, int level, const vt_rays *rays) {
  vt_level_report *report = &r->report->levels[level];
  double start = vt_seconds();
  if (r->recipe.field) {
    vt_status made = vt_make_view_textures(r->context, rays, (float)tune("RL", 10), &r->tree->view_textures[level]);
    report->seconds_tiles = vt_seconds() - start;
    r->report->seconds_tiles += report->seconds_tiles;
    return made;
  }
  vt_billboard_desc desc = r->recipe.billboard;
  if (r->desc->prune_thin) desc.least_depth = least_depth(r, level);
  vt_status status = vt_make_billboards(r->context, &desc, rays, r->tree);
  report->billboards_before = (uint64_t)report->cells * (uint64_t)r->views->count;
  report->billboards = r->tree->tiles[level].tile_count;
  report->seconds_tiles = vt_seconds() - start;
  r->report->seconds_tiles += report->seconds_tiles;
  return status;
}

// A level whose cells cover about a block of the reduced pictures: fine enough to leave out empty pixels, and few.
static int coarse_level_for(const run *r, int level, int factor) {
  int coarse = level;
  if (!r->desc->skip_empty_pixels) return 0; // the root's cube: every pixel that can meet anything
  while (coarse > 0 && cell_pixels(r, coarse) < 8.0 * factor) coarse--;
  return coarse;
}

// Everything of one level (already carved) while its rays are in memory.
static vt_status make_level(run *r, int level) {
  vt_context *context = r->context;
  vt_octree *octree = &r->tree->octree;
  vt_level_report *report = &r->report->levels[level];
  double start = vt_seconds();
  *report = (vt_level_report){.level = level, .hull_cells = octree->levels[level].cell_count};
  vt_reduced_views reduced;
  vt_status status = reduce_for_level(r, level, &reduced);
  if (status) return status;
  double walk = vt_seconds();
  vt_rays rays;
  status = vt_collect_rays(context, octree, level, coarse_level_for(r, level, reduced.factor), &reduced, ray_bound(r),
                           &rays);
  r->report->seconds_rays += vt_seconds() - walk;
  if (!status) status = solve_level(r, level, &rays);
  report->cells = octree->levels[level].cell_count;
  report->seconds_opacity = vt_seconds() - start;
  vt_log(context, VT_LOG_VERBOSE,
         "level %d: %u cells in the hull, %u kept, %llu rays, %.1f %% saturated, alpha RMSE %.4f, held out %.4f, seen from "
         "within %.0f degrees (%.0f %% below 30), %u cells that no ray says anything about, %.2f s",
         level, report->hull_cells, report->cells, (unsigned long long)report->rays, 100 * report->saturated_share,
         report->alpha_rmse, report->held_out_rmse, report->coverage_degrees, 100 * report->narrow_share, report->unconstrained,
         report->seconds_opacity);
  if (!status && report->cells) status = texture_level(r, level, &rays);
  if (!status && report->cells) status = vt_probe_level(context, r->tree, level, &reduced);
  vt_free_rays(context, &rays);
  vt_free_reduced_views(context, &reduced);
  return status;
}

// Whether the level after `level`, whose hull is known, can be made within the time that was given.
static bool time_is_left(const run *r, int level, double seconds_per_cell) {
  double left = r->start + r->desc->time_budget - vt_seconds(), cells = r->tree->octree.levels[level].cell_count;
  return !(r->desc->time_budget > 0) || seconds_per_cell * (1 + growth_of(r)) * cells < left;
}

static vt_status make_all_levels(run *r) {
  double seconds_per_cell = 0; // of the last level, by cells of its hull
  for (int level = 0; level <= r->leaf; level++) {
    double start = vt_seconds();
    vt_status status = begin_level(r, level);
    if (!status) status = carve_level(r, level);
    if (status) return status;
    uint32_t cells = r->tree->octree.levels[level].cell_count;
    if (!cells) {
      if (level < 2)
        return vt_fail(r->context, VT_BAD_INPUT, "mattes: nothing is left of the tree at level %d; check that masks are "
                       "white on the tree and that cameras and photographs belong together", level);
      vt_free_level(r->context, &r->tree->octree.levels[level]);
      return VT_OK;
    }
    if (level > 3 && level < r->leaf && !time_is_left(r, level, seconds_per_cell)) r->leaf = level;
    r->bytes_before = vt_bytes_in_use(r->context);
    r->report->seconds_hull += vt_seconds() - start;
    r->tree->octree.level_count = level + 1;
    status = make_level(r, level);
    if (status) return status;
    seconds_per_cell = (vt_seconds() - start) / cells;
    if (!r->tree->octree.levels[level].cell_count) { // pruned to nothing: the level before shows what there is
      r->tree->octree.level_count = level;
      vt_free_level(r->context, &r->tree->octree.levels[level]);
    }
    vt_progress(r->context, "levels", (level + 1.0) / (r->leaf + 1));
  }
  return VT_OK;
}

static vt_status prepare(run *r) {
  vt_tree *tree = r->tree;
  bool old = r->desc->method == VT_METHOD_2004;
  tree->octree.branching = old ? 3 : 2;
  tree->texel_edge = old ? 8 : 4;
  tree->tile_side = 1;
  tree->view_count = r->views->count;
  tree->cameras = VT_NEW(r->context, vt_camera, (size_t)r->views->count);
  tree->metadata = vt_strdup(r->context, "{}");
  if (!tree->cameras || !tree->metadata) return VT_OUT_OF_MEMORY;
  vt_status status = VT_OK;
  for (int i = 0; i < r->views->count && !status; i++) {
    tree->cameras[i] = r->views->items[i].camera;
    status = vt_check_camera(r->context, &tree->cameras[i], r->views->items[i].name);
  }
  if (!status) status = vt_find_bounds(r->context, r->views, &tree->octree);
  if (status) return status;
  double half = 0.5 * tree->octree.edge;
  vt_vec3 middle = vt_add(tree->octree.origin, vt_v3(half, half, half));
  return vt_projected_size(r->context, r->views, middle, tree->octree.edge, &r->root_pixels);
}

static vt_status reconstruct_views(run *r) {
  if (r->views->count < 1)
    return vt_fail(r->context, VT_TOO_FEW_VIEWS, "photographs: there is none to reconstruct from; give at least 3");
  r->start = vt_seconds();
  vt_status status = prepare(r);
  if (status) return status;
  int leaf = r->desc->leaf_level ? r->desc->leaf_level : default_leaf_level(r);
  if (r->tree->octree.branching == 3 && leaf > 6) leaf = 6; // 729 cells along an edge
  r->report->seconds_bounds = vt_seconds() - r->start;
  r->report->estimated_bytes = level_bytes(r, (uint64_t)(3.0 * pow(r->tree->octree.branching, 2.3 * leaf)));
  vt_log(r->context, VT_LOG_VERBOSE, "leaf level %d, cells of %.1f pixels; memory about %.1f GB for a full crown", leaf,
         cell_pixels(r, leaf), (double)r->report->estimated_bytes * 1e-9);
  vt_reset_peak(r->context);
  r->leaf = leaf;
  status = make_all_levels(r);
  r->report->peak_bytes_tiles = vt_peak_bytes(r->context);
  r->report->leaf_level = r->tree->octree.level_count - 1;
  return status;
}

vt_status vt_reconstruct(vt_context *context, const vt_reconstruct_desc *desc, const vt_views *views, vt_tree *out,
                         vt_reconstruct_report *or_null) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->leaf_level >= 0 && desc->leaf_level <= VT_MAX_LEVEL);
  VT_ASSERT(desc->hull_votes >= 1 && desc->refine_epochs >= -1);
  vt_reconstruct_report report = {0};
  *out = (vt_tree){0};
  vt_views train;
  vt_status status = vt_select_views(context, views, VT_TRAIN, &train);
  if (status) return status;
  run r = {context, desc, recipe_of(desc), &train, out, &report, .root_pixels = 0};
  status = reconstruct_views(&r);
  vt_free(context, r.split);
  vt_free(context, train.items);
  if (status) vt_free_tree(context, out);
  if (or_null) *or_null = report;
  return status;
}

// Rays of a level for opacity alone: two to three pixels a cell say what cells can hold.
static vt_status solve_alone(run *r, int level) {
  double start = vt_seconds();
  int factor = (int)(cell_pixels(r, level) / (level == r->leaf ? 2 : 3));
  vt_reduced_views reduced;
  vt_rays rays = {0};
  vt_status status = vt_reduce_views(r->context, r->views, factor < 1 ? 1 : factor, &reduced);
  if (status) return status;
  r->report->levels[level] = (vt_level_report){.level = level, .hull_cells = r->tree->octree.levels[level].cell_count};
  r->report->levels[level].cells = r->report->levels[level].hull_cells;
  status = vt_collect_rays(r->context, &r->tree->octree, level, coarse_level_for(r, level, reduced.factor), &reduced, ray_bound(r),
                           &rays);
  r->report->seconds_rays += vt_seconds() - start;
  if (!status) status = estimate_level(r, level, &rays);
  if (!status && level < r->leaf) status = plan_next_level(r, level, &rays);
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

vt_status vt_reconstruct_opacity(vt_context *context, const vt_views *views, vt_solver solver, int sweeps, int level,
                                 vt_tree *out, vt_reconstruct_report *or_null) {
  VT_ASSERT(level >= 0 && level <= VT_MAX_LEVEL);
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_DRAFT);
  vt_reconstruct_report report = {0};
  vt_views train;
  *out = (vt_tree){0};
  vt_status status = vt_select_views(context, views, VT_TRAIN, &train);
  if (status) return status;
  run r = {context, &desc, recipe_of(&desc), &train, out, &report, .start = vt_seconds(), .leaf = level};
  desc.split_where_needed = solver != VT_SOLVER_LOG; // which stays as the papers have it
  r.recipe.opacity = desc_of_solver(solver, sweeps);
  status = train.count ? prepare(&r) : vt_fail(context, VT_TOO_FEW_VIEWS, "photographs: there is none; give at least 3");
  for (int l = 0; l <= r.leaf && !status; l++) {
    double start = vt_seconds();
    status = begin_level(&r, l);
    if (!status) status = carve_level(&r, l);
    r.bytes_before = vt_bytes_in_use(context);
    report.seconds_hull += vt_seconds() - start;
    out->octree.level_count = l + 1;
    if (!status && !out->octree.levels[l].cell_count) break; // nothing so fine
    if (!status) status = solve_alone(&r, l);
  }
  vt_free(context, r.split);
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
  run r = {context, &desc, recipe_of(&desc), &train, out, &report, .leaf = level};
  status = train.count ? prepare(&r) : vt_fail(context, VT_TOO_FEW_VIEWS, "photographs: there is none; give at least 3");
  for (int l = 0; l <= level && !status; l++) {
    status = begin_level(&r, l);
    if (!status) status = carve_level(&r, l);
  }
  vt_reduced_views reduced = {0};
  if (!status) status = reduce_for_level(&r, level, &reduced);
  vt_level *cells = &out->octree.levels[level];
  for (uint32_t i = 0; i < cells->cell_count && !status; i++) cells->optical_depth[i] = 30;
  vt_rays rays = {0};
  if (!status) status = vt_collect_rays(context, &out->octree, level, coarse_level_for(&r, level, reduced.factor), &reduced,
                                          LARGEST_RAY_STORE, &rays);
  if (!status) status = vt_estimate_colour(context, &rays, cells, 0);
  vt_free_rays(context, &rays);
  out->octree.level_count = level + 1;
  vt_free_reduced_views(context, &reduced);
  vt_free(context, train.items);
  if (status) vt_free_tree(context, out);
  return status;
}
