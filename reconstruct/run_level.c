// run_level.c - the stages of one level, from its hull to its textures
// SPDX-License-Identifier: BSD-3-Clause

#include "reconstruct/colour.h"
#include "reconstruct/coverage.h"
#include "reconstruct/hull.h"
#include "reconstruct/probe_level.h"
#include "reconstruct/redundant.h"
#include "reconstruct/run.h"
#include "reconstruct/view_textures.h"

#include <string.h>

#define TAIL_GROWTH 3 // of the seconds after a level's fit, from level to level

vt_status vt_begin_level(vt_run *r, int level) {
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

// Corners of the cells that are kept take their values along.
static vt_status carry_corners(vt_run *r, const vt_level *from, const uint8_t *keep, vt_level *to) {
  vt_status status = from->corner_count ? vt_make_corners(r->context, r->tree->octree.branching, to) : VT_OK;
  for (size_t i = 0, j = 0; i < from->cell_count && from->corner_count && !status; i++) {
    for (size_t c = 0; c < 8 && keep[i]; c++)
      memcpy(to->corner_values + 4 * (size_t)to->corner_of[8 * j + c],
             from->corner_values + 4 * (size_t)from->corner_of[8 * i + c], 4 * sizeof(float));
    j += keep[i];
  }
  return status;
}

static vt_status replace_level(vt_run *r, int level, const uint8_t *keep, vt_rays *rays_or_null) {
  vt_level kept, *cells = &r->tree->octree.levels[level];
  vt_status status = vt_filter_level(r->context, r->tree->octree.branching, level, cells, keep, &kept);
  if (status) return status;
  status = carry_corners(r, cells, keep, &kept);
  if (status) {
    vt_free_level(r->context, &kept);
    return status;
  }
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

vt_status vt_carve_level(vt_run *r, int level) {
  vt_context *context = r->context;
  vt_level *cells = &r->tree->octree.levels[level];
  int factor = (int)(vt_cell_pixels(r, level) / 4);
  vt_silhouettes silhouettes;
  vt_status status = vt_make_silhouettes(context, r->views, factor < 1 ? 1 : factor, 2, &silhouettes);
  if (status) return status;
  silhouettes.votes = r->desc->hull_votes;
  if (r->least_seen > silhouettes.least_seen) silhouettes.least_seen = r->least_seen;
  uint8_t *keep = VT_NEW(context, uint8_t, cells->cell_count);
  status = keep ? vt_carve(context, &silhouettes, &r->tree->octree, level, keep) : VT_OUT_OF_MEMORY;
  if (!status) status = replace_level(r, level, keep, NULL);
  vt_free(context, keep);
  vt_free_silhouettes(context, &silhouettes);
  return status;
}

// A cell thinner than what half a pixel of full opacity would give, or than 0.01, is empty. A field is asked to show the
// photographs' mattes: 0.003 there, since a soft fringe is a long way through thin cells (blobs_64, own photographs: alpha RMSE
// 0.0095 with 0.01, 0.0026 with 0.003, 0.0015 with 0.001; trees keep 5 to 10 % more cells).
static float least_depth(const vt_run *r, int level) {
  double pixels = vt_cell_pixels(r, level), least = r->recipe.field ? 0.003 : 0.01;
  return (float)fmin(least, 0.5 / (pixels * pixels));
}

static float densest(const vt_level *cells, uint32_t cell) {
  float most = cells->optical_depth[cell];
  for (size_t c = 0; c < 8 && cells->corner_count; c++)
    most = fmaxf(most, cells->corner_values[4 * (size_t)cells->corner_of[8 * (size_t)cell + c]]);
  return most;
}

// Only the leaf level loses its empty cells: on coarser ones they may still hold the tips of twigs, and their children
// are looked for within them. They get no textures.
static vt_status prune_level(vt_run *r, int level, vt_rays *rays) {
  vt_level *cells = &r->tree->octree.levels[level];
  float least = least_depth(r, level);
  if (!r->desc->prune_thin) return VT_OK;
  uint8_t *keep = VT_NEW(r->context, uint8_t, cells->cell_count);
  if (!keep) return VT_OUT_OF_MEMORY;
  for (uint32_t i = 0; i < cells->cell_count; i++) keep[i] = densest(cells, i) >= least;
  vt_status status = replace_level(r, level, keep, rays);
  vt_free(r->context, keep);
  return status;
}

// A texel of a tile covers about a pixel of the reduced picture. A field is fitted to three to six pixels across a cell: more cost time and say
// little that the view textures, as fine as these pixels, do not say again.
vt_status vt_reduce_for_level(vt_run *r, int level, vt_reduced_views *out) {
  double edges = (double)r->tree->tile_side / (double)r->tree->texel_edge; // a texel of a tile
  double factor = r->recipe.field ? vt_cell_pixels(r, level) / 3 : vt_cell_pixels(r, level) * edges + 0.5;
  return vt_reduce_views(r->context, r->views, factor < 1 ? 1 : (int)factor, out);
}

vt_status vt_estimate_level(vt_run *r, int level, const vt_rays *rays) {
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

// The level's own field, fitted so that each photograph is predicted from its neighbours.
static vt_status fit_level(vt_run *r, int level, const vt_rays *rays) {
  vt_level *cells = &r->tree->octree.levels[level];
  vt_fit_desc fit = r->recipe.fit;
  fit.left_out = r->stand_in;
  if (level == r->leaf) fit.epochs = r->recipe.leaf_epochs;
  else fit.own_share = 0;
  if (r->desc->time_budget > 0) {
    fit.begun = vt_seconds();
    fit.deadline = r->start + 0.97 * r->desc->time_budget - TAIL_GROWTH * r->seconds_after_fit;
  }
  vt_status status = vt_make_corners(r->context, r->tree->octree.branching, cells);
  if (!status) status = vt_corners_from_cells(r->context, cells);
  if (!status) status = vt_fit_field(r->context, &fit, rays, r->tree, cells);
  if (!status) vt_cells_from_corners(cells);
  return status;
}

static vt_status collect_rays(vt_run *r, int level, const vt_reduced_views *reduced, vt_rays *out) {
  int coarse = vt_coarse_level_for(r, level, reduced->factor);
  return vt_collect_rays(r->context, &r->tree->octree, level, coarse, reduced, vt_ray_bound(r), out);
}

// The hull's chords were too many to be kept; those of the cells that are left, half as many, may not be.
static vt_status collect_again(vt_run *r, int level, vt_rays *rays) {
  const vt_reduced_views *reduced = rays->views;
  vt_free_rays(r->context, rays);
  return collect_rays(r, level, reduced, rays);
}

// Opacity and colour of a level whose rays are there.
static vt_status solve_level(vt_run *r, int level, vt_rays *rays) {
  vt_level *cells = &r->tree->octree.levels[level];
  double start = vt_seconds();
  vt_status status = vt_estimate_level(r, level, rays);
  if (!status && level == r->leaf) status = prune_level(r, level, rays);
  if (!status && level == r->leaf && !rays->kept) status = collect_again(r, level, rays);
  double solved = vt_seconds();
  if (!status) status = vt_estimate_colour(r->context, rays, cells);
  double coloured = vt_seconds();
  if (!status && r->recipe.field) status = fit_level(r, level, rays);
  if (!status && r->recipe.field && level == r->leaf) status = prune_level(r, level, rays); // what the fit has emptied
  double fitted = r->fitted = vt_seconds();
  if (!status && level < r->leaf) status = vt_plan_next_level(r, level, rays);
  r->report->seconds_opacity += solved - start + (vt_seconds() - fitted);
  r->report->seconds_colour += coloured - solved;
  r->report->seconds_refinement += fitted - coloured;
  r->report->peak_bytes_opacity = vt_peak_bytes(r->context);
  return status;
}

static int compare_counts(const void *a, const void *b) {
  uint32_t p = *(const uint32_t *)a, q = *(const uint32_t *)b;
  return p < q ? -1 : p > q;
}

// Billboards by view [LRMDM06 Fig. 4].
static vt_status count_billboards(vt_context *context, const vt_tiles *tiles, vt_level_report *report) {
  size_t views = (size_t)tiles->view_count;
  if (!views) return VT_OK;
  uint32_t *left = VT_NEW(context, uint32_t, views);
  if (!left) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < views * tiles->cell_count; i++) left[i / tiles->cell_count] += tiles->tile_of[i] != VT_NO_TILE;
  qsort(left, views, sizeof *left, compare_counts);
  report->view_least = left[0];
  report->view_median = left[views / 2];
  report->view_most = left[views - 1];
  vt_free(context, left);
  return VT_OK;
}

static vt_status texture_level(vt_run *r, int level, const vt_rays *rays) {
  vt_level_report *report = &r->report->levels[level];
  double start = vt_seconds();
  vt_billboard_desc desc = r->recipe.billboard;
  vt_match_report match = {0};
  if (r->desc->prune_thin) desc.least_depth = least_depth(r, level);
  vt_status status = r->recipe.field ? vt_make_view_textures(r->context, rays, r->recipe.fit.ratio_limit, r->recipe.fit.linear_ratios,
                                                             &r->tree->view_textures[level])
                                     : vt_make_billboards(r->context, &desc, rays, r->tree, &match);
  if (!status && !r->recipe.field)
    vt_log(r->context, VT_LOG_VERBOSE, "level %d: at the photographs' own cameras alpha RMSE %.4f (squares: %.2g without cells, %.2g "
           "too thin, %.2g beyond tiles, %.2g rounding); %.1f %% of the chords beyond tiles", level, match.rmse, match.no_cells,
           match.limited, match.clamped, match.rounding, 100 * match.clamped_share);
  for (int v = 0; v < r->views->count && !status && r->stand_in; v++)
    if (r->stand_in[v] != v) vt_silence_view(r->context, &r->tree->view_textures[level], v);
  report->billboards_before = (uint64_t)report->cells * (uint64_t)r->views->count;
  report->billboards = r->tree->tiles[level].tile_count;
  report->pruned_energy = match.pruned_energy;
  report->own_alpha_rmse = match.rmse;
  if (!status) status = count_billboards(r->context, &r->tree->tiles[level], report);
  report->seconds_tiles = vt_seconds() - start;
  r->report->seconds_tiles += report->seconds_tiles;
  return status;
}

// Before the finest level, whose textures are most of the tree.
static vt_status drop_redundant(vt_run *r, const vt_rays *rays) {
  vt_redundant_desc desc = vt_default_redundant_desc();
  size_t views = (size_t)r->views->count;
  vt_redundancy *found = VT_NEW(r->context, vt_redundancy, views);
  r->stand_in = VT_NEW(r->context, int, views);
  vt_status status = found && r->stand_in ? vt_drop_redundant(r->context, &desc, rays, r->tree, found) : VT_OUT_OF_MEMORY;
  for (int v = 0; v < r->views->count && !status; v++) {
    r->stand_in[v] = found[v].stand_in;
    if (found[v].stand_in == v) continue;
    r->report->redundant_views++;
    vt_log(r->context, VT_LOG_VERBOSE, "%s: %s and others show it as well (error %.3g, its own %.3g), its textures are dropped",
           r->views->items[v].name, r->views->items[found[v].stand_in].name, found[v].others, found[v].own);
  }
  if (!status && r->report->redundant_views)
    vt_log(r->context, VT_LOG_NORMAL, "%d of %d photographs are shown as well by the textures of others; theirs are dropped",
           r->report->redundant_views, r->views->count);
  vt_free(r->context, found);
  return status;
}

// A level whose cells cover about a block of the reduced pictures: fine enough to leave out empty pixels, and few.
int vt_coarse_level_for(const vt_run *r, int level, int factor) {
  int coarse = level;
  if (!r->desc->skip_empty_pixels) return 0; // the root's cube: every pixel that can meet anything
  while (coarse > 0 && vt_cell_pixels(r, coarse) < 8.0 * factor) coarse--;
  return coarse;
}

// Everything of one level (already carved) while its rays are in memory.
vt_status vt_run_level(vt_run *r, int level) {
  vt_context *context = r->context;
  vt_octree *octree = &r->tree->octree;
  vt_level_report *report = &r->report->levels[level];
  double start = vt_seconds();
  *report = (vt_level_report){.level = level, .hull_cells = octree->levels[level].cell_count};
  vt_reduced_views reduced;
  vt_status status = vt_reduce_for_level(r, level, &reduced);
  if (status) return status;
  double walk = vt_seconds();
  vt_rays rays;
  status = collect_rays(r, level, &reduced, &rays);
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
  bool judged = r->recipe.field && r->desc->drop_redundant && level + 1 == r->leaf && !r->stand_in;
  if (!status && report->cells && judged) status = drop_redundant(r, &rays);
  if (!status && report->cells) status = vt_probe_level(context, r->tree, level, &reduced);
  vt_free_rays(context, &rays);
  vt_free_reduced_views(context, &reduced);
  return status;
}
