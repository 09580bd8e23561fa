// reconstruct.c - the order of the stages from views to a raw tree
// SPDX-License-Identifier: BSD-3-Clause
//
// Coarse to fine: at each level the children of what stood at the level before are carved by the mattes, solved for
// opacity and colour on photographs of matching resolution, and pruned of what turned out empty. The finest levels are
// refined through the compositor. Then every level gets its textures from its own cells and its own photographs.

#include "reconstruct/bounds.h"
#include "reconstruct/level_mass.h"
#include "reconstruct/run.h"
#include "reconstruct/thinness.h"

#define THIN_SHARE 0.375   // of the mattes, from which on a tree is a thin one
#define THIN_PIXELS 1.25   // cells of its leaf level are not asked to be smaller

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
                               .drop_redundant = method == VT_METHOD_BEST,
                               .refine_epochs = -1};
}

vt_recipe vt_recipe_of(const vt_reconstruct_desc *desc) {
  vt_recipe r = {vt_default_opacity_desc(), vt_default_billboard_desc(), vt_default_fit_desc(), true, 2, 2.5};
  r.billboard.hidden_threshold = desc->hidden_threshold;
  r.billboard.prune = desc->prune_hidden;
  if (desc->preset == VT_PRESET_DRAFT) r.leaf_epochs = 1, r.pixels = 5;
  if (desc->preset == VT_PRESET_HIGH) r.pixels = 1.25;
  if (desc->time_budget > 0) r.leaf_epochs = 8;
  if (desc->refine_epochs >= 0) r.leaf_epochs = desc->refine_epochs;
  if (desc->method == VT_METHOD_BEST) return r;
  r.field = false;
  r.opacity = vt_sart_opacity_desc();
  r.billboard.prune = desc->method == VT_METHOD_2006 && desc->prune_hidden;
  double b = desc->method == VT_METHOD_2004 ? 3 : 2; // texels of a pixel; a level coarser, or finer
  r.pixels = desc->method == VT_METHOD_2004 ? 6.6 : 3.3; // of a pixel: a tile then holds a cell's projection
  if (desc->preset == VT_PRESET_DRAFT) r.pixels *= b;
  if (desc->preset == VT_PRESET_HIGH) r.pixels /= b;
  return r;
}

double vt_cell_pixels(const vt_run *r, int level) {
  return r->root_pixels * vt_cell_edge(&r->tree->octree, level) / r->tree->octree.edge;
}

// The coarsest level whose cells cover at most so many pixels of the photographs as the recipe says.
static int default_leaf_level(const vt_run *r) {
  int level = 1;
  while (level < VT_MAX_LEVEL && vt_cell_pixels(r, level) > r->recipe.pixels) level++;
  return level;
}

// A thin tree takes cells of half the size, and textures whose lines keep what they have (thinness.c).
static vt_status fit_recipe_to_thinness(vt_run *r) {
  double share = 0;
  if (!r->recipe.field) return VT_OK;
  vt_status status = vt_measure_thinness(r->context, r->views, &share);
  r->report->thin_share = share;
  if (status || share < THIN_SHARE) return status;
  r->recipe.fit.linear_ratios = true;
  r->recipe.pixels = fmax(0.5 * r->recipe.pixels, THIN_PIXELS);
  vt_log(r->context, VT_LOG_NORMAL, "%.0f %% of the mattes is thinner than %d pixels: a thin tree, cells are made half as large",
         100 * share, VT_THIN_WIDTH);
  return VT_OK;
}

static vt_status make_all_levels(vt_run *r) {
  double seconds_before = 0; // of the level before
  for (int level = 0; level <= r->leaf; level++) {
    double start = vt_seconds();
    vt_status status = vt_begin_level(r, level);
    if (!status) status = vt_carve_level(r, level);
    if (status) return status;
    uint32_t cells = r->tree->octree.levels[level].cell_count;
    if (!cells) {
      if (level < 2)
        return vt_fail(r->context, VT_BAD_INPUT, "mattes: nothing is left of the tree at level %d; check that masks are "
                       "white on the tree and that cameras and photographs belong together", level);
      vt_free_level(r->context, &r->tree->octree.levels[level]);
      return VT_OK;
    }
    if (level > 3 && level < r->leaf && !vt_time_is_left(r, level, seconds_before)) r->leaf = level;
    r->bytes_before = vt_bytes_in_use(r->context);
    r->report->seconds_hull += vt_seconds() - start;
    r->tree->octree.level_count = level + 1;
    status = vt_run_level(r, level);
    if (status) return status;
    seconds_before = vt_seconds() - start;
    r->seconds_after_fit = vt_seconds() - r->fitted;
    if (!r->tree->octree.levels[level].cell_count) { // pruned to nothing: the level before shows what there is
      r->tree->octree.level_count = level;
      vt_free_level(r->context, &r->tree->octree.levels[level]);
    }
    vt_progress(r->context, "levels", (level + 1.0) / (r->leaf + 1));
  }
  return VT_OK;
}

// Photographs that hold a point. What is seen by less than a third of those that see the tree's middle lies beside the tree as
// a rule: a cell near one camera that the few others which see so far out happen to see before the crown. The hull cannot
// carve it, and it would hang in the air of other views.
static int count_sights(const vt_run *r, vt_vec3 point) {
  int count = 0;
  for (int i = 0; i < r->views->count; i++) {
    const vt_camera *camera = &r->views->items[i].camera;
    double pixel[2];
    count += vt_project(camera, point, pixel) && pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] <= camera->width &&
             pixel[1] <= camera->height;
  }
  return count;
}

vt_status vt_prepare_run(vt_run *r) {
  vt_tree *tree = r->tree;
  bool old = r->desc->method == VT_METHOD_2004;
  tree->octree.branching = old ? 3 : 2;
  tree->texel_edge = old ? 8 : 4;
  tree->tile_side = r->recipe.field ? 1 : 1.5f;
  tree->view_count = r->views->count;
  tree->cameras = VT_NEW(r->context, vt_camera, (size_t)r->views->count);
  tree->metadata = vt_strdup(r->context, "{}");
  if (!tree->cameras || !tree->metadata) return VT_OUT_OF_MEMORY;
  vt_status status = VT_OK;
  for (int i = 0; i < r->views->count && !status; i++) {
    tree->cameras[i] = r->views->items[i].camera;
    status = vt_check_camera(r->context, &tree->cameras[i], r->views->items[i].name);
  }
  if (!status && !(tree->octree.edge > 0)) status = vt_find_bounds(r->context, r->views, &tree->octree);
  if (status) return status;
  double half = 0.5 * tree->octree.edge;
  vt_vec3 middle = vt_add(tree->octree.origin, vt_v3(half, half, half));
  r->least_seen = count_sights(r, middle) / 3;
  return vt_projected_size(r->context, r->views, middle, tree->octree.edge, &r->root_pixels);
}

// Each level as opaque as the next finer one, now that all are there.
static vt_status match_levels(vt_run *r) {
  float factors[VT_MAX_LEVEL + 1];
  double start = vt_seconds();
  if (!r->recipe.field) return VT_OK;
  vt_status status = vt_match_level_mass(r->context, r->tree, r->recipe.fit.neighbours, factors);
  for (int level = 0; level + 1 < r->tree->octree.level_count && !status; level++) r->report->levels[level].mass_factor = factors[level];
  r->report->seconds_tiles += vt_seconds() - start;
  return status;
}

static vt_status reconstruct_views(vt_run *r) {
  if (r->views->count < 1)
    return vt_fail(r->context, VT_TOO_FEW_VIEWS, "photographs: there is none to reconstruct from; give at least 3");
  r->start = vt_seconds();
  vt_status status = vt_prepare_run(r);
  if (!status) status = fit_recipe_to_thinness(r);
  if (status) return status;
  int leaf = r->desc->leaf_level ? r->desc->leaf_level : default_leaf_level(r);
  if (r->tree->octree.branching == 3 && leaf > 6) leaf = 6; // 729 cells along an edge
  r->report->seconds_bounds = vt_seconds() - r->start;
  r->report->estimated_bytes = vt_level_bytes(r, (uint64_t)(3.0 * pow(r->tree->octree.branching, 2.3 * leaf)));
  vt_log(r->context, VT_LOG_NORMAL, "leaf level %d, cells of %.1f pixels; memory up to about %.1f GB for a full crown", leaf,
         vt_cell_pixels(r, leaf), (double)r->report->estimated_bytes * 1e-9);
  vt_reset_peak(r->context);
  r->leaf = leaf;
  status = make_all_levels(r);
  if (!status) status = match_levels(r);
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
  vt_run r = {context, desc, vt_recipe_of(desc), &train, out, &report, .root_pixels = 0};
  status = reconstruct_views(&r);
  vt_free(context, r.split);
  vt_free(context, r.stand_in);
  vt_free(context, train.items);
  if (status) vt_free_tree(context, out);
  if (or_null) *or_null = report;
  return status;
}
