// truth_scores.c - a tree against what the synthetic object truly is
// SPDX-License-Identifier: BSD-3-Clause
//
// Pictures can be right for wrong reasons: with few photographs a wrong volume shows them all. So the solved extinction
// is compared with the true mean of each cell, level by level, and the tree's optical depth with the true line integral
// on chords that no photograph took: through random points of the cells of either, in random directions of the whole
// sphere. Saturated rays say only that tau is large, so tau is compared clipped at 4 (alpha 0.98).
//
// Which cells are compared: the true ones are found from coarse to fine, children of cells that hold anything; beside
// them all that the tree has, so that matter in empty air counts. Mass outside the root cube is seen by chords only.
#include "programs/truth_scores.h"

#include "base/rng.h"

#include <string.h>

enum { CHORDS = 4000, CHORD_BLOCK = 16 };

static const double clip_depth = 4, least_share = 1e-3; // share: of the level's largest, to count as occupied

typedef struct cell_set { // of one level
  size_t count;
  uint16_t (*xyz)[3];
  float *truth; // mean extinction
} cell_set;

static void free_cells(vt_context *context, cell_set *set) {
  vt_free(context, set->xyz);
  vt_free(context, set->truth);
  *set = (cell_set){0};
}

static int compare_keys(const void *a, const void *b) {
  uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
  return (x > y) - (x < y);
}

// ---- cells

// Keys of the tree's cells and of the children of those of `parents` that hold anything; their number.
static size_t gather_keys(const vt_octree *octree, const vt_level *level, const cell_set *parents, double least,
                          uint64_t *keys) {
  uint64_t axis = (uint64_t)level->axis_cells;
  size_t count = 0;
  int n = octree->branching;
  for (size_t i = 0; i < level->cell_count; i++)
    keys[count++] = ((uint64_t)level->z[i] * axis + level->y[i]) * axis + level->x[i];
  for (size_t i = 0; i < parents->count; i++) {
    if (!((double)parents->truth[i] > least)) continue;
    for (int k = 0; k < n * n * n; k++) {
      uint64_t x = (uint64_t)(parents->xyz[i][0] * n + k % n), y = (uint64_t)(parents->xyz[i][1] * n + k / n % n);
      uint64_t z = (uint64_t)(parents->xyz[i][2] * n + k / (n * n));
      keys[count++] = (z * axis + y) * axis + x;
    }
  }
  qsort(keys, count, sizeof *keys, compare_keys);
  size_t kept = 0;
  for (size_t i = 0; i < count; i++)
    if (!i || keys[i] != keys[i - 1]) keys[kept++] = keys[i];
  return kept;
}

static double largest_of(const cell_set *set) {
  double largest = 0;
  for (size_t i = 0; i < set->count; i++) largest = fmax(largest, (double)set->truth[i]);
  return largest;
}

static vt_status find_cells(vt_context *context, const vt_octree *octree, int number, const vt_truth *truth,
                            bool is_phantom, const cell_set *parents, cell_set *out) {
  const vt_level *level = &octree->levels[number];
  size_t children = (size_t)(octree->branching * octree->branching * octree->branching);
  uint64_t *keys = VT_NEW(context, uint64_t, level->cell_count + children * parents->count + 1);
  vt_status status = VT_OUT_OF_MEMORY;
  if (!keys) return status;
  // Gaussians have no end: far below what counts is nothing. Of a mesh every leaf is.
  out->count = gather_keys(octree, level, parents, is_phantom ? 1e-4 * largest_of(parents) : 0, keys);
  if (!out->count && number == 0) keys[out->count++] = 0;
  out->xyz = vt_alloc(context, out->count, sizeof *out->xyz);
  out->truth = VT_NEW(context, float, out->count);
  if (out->xyz && out->truth) {
    uint64_t axis = (uint64_t)level->axis_cells;
    for (size_t i = 0; i < out->count; i++) {
      out->xyz[i][0] = (uint16_t)(keys[i] % axis), out->xyz[i][1] = (uint16_t)(keys[i] / axis % axis);
      out->xyz[i][2] = (uint16_t)(keys[i] / axis / axis);
    }
    status = vt_true_cells(context, truth, octree->origin, octree->edge, level->axis_cells, out->count,
                           (const uint16_t(*)[3])out->xyz, out->truth, NULL);
  }
  vt_free(context, keys);
  return status;
}

typedef struct moments {
  double count, tree, truth, tree_squares, true_squares, products, errors;
} moments;

// Compares, and keeps only the cells that either has anything in.
static void compare_cells(const vt_octree *octree, int number, cell_set *set, vt_truth_level *out) {
  const vt_level *level = &octree->levels[number];
  double edge = vt_cell_edge(octree, number), least = least_share * largest_of(set);
  moments m = {0};
  size_t kept = 0;
  *out = (vt_truth_level){.level = number};
  for (size_t i = 0; i < set->count; i++) {
    uint32_t cell = vt_find_cell(level, octree->branching, set->xyz[i][0], set->xyz[i][1], set->xyz[i][2]);
    double tree = cell == VT_NO_CELL ? 0 : (double)level->optical_depth[cell] / edge, truth = (double)set->truth[i];
    bool occupied = truth > 0 && truth >= least;
    out->tree_count += tree > 0, out->true_count += occupied;
    if (!(tree > 0) && !occupied) continue;
    m.count++, m.tree += tree, m.truth += truth, m.errors += (tree - truth) * (tree - truth);
    m.tree_squares += tree * tree, m.true_squares += truth * truth, m.products += tree * truth;
    memmove(set->xyz[kept], set->xyz[i], sizeof set->xyz[i]);
    set->truth[kept++] = set->truth[i];
  }
  double tree_variance = m.count * m.tree_squares - m.tree * m.tree,
         true_variance = m.count * m.true_squares - m.truth * m.truth;
  out->cell_count = set->count = kept;
  out->relative_rms = m.true_squares > 0 ? sqrt(m.errors / m.true_squares) : (double)NAN;
  out->correlation = tree_variance > 0 && true_variance > 0
                         ? (m.count * m.products - m.tree * m.truth) / sqrt(tree_variance * true_variance)
                         : (double)NAN;
  out->mass_ratio = m.truth > 0 ? m.tree / m.truth : (double)NAN;
}

// ---- chords

typedef struct chord_job {
  const vt_octree *octree;
  const vt_truth *truth;
  const cell_set *cells;
  size_t segment_limit;
  vt_segment *segments; // [worker][segment_limit]
  double *errors;       // [CHORDS][2]: squared, of transmittance and of clipped depth
} chord_job;

static vt_ray draw_chord(const chord_job *job, size_t i) {
  vt_rng rng = vt_seed_rng(i, 21);
  const vt_octree *octree = job->octree;
  double edge = vt_cell_edge(octree, octree->level_count - 1);
  const uint16_t *cell = job->cells->xyz[(size_t)(vt_random_unit(&rng) * (double)job->cells->count)];
  double x = (cell[0] + vt_random_unit(&rng)) * edge, y = (cell[1] + vt_random_unit(&rng)) * edge;
  vt_vec3 point = vt_add(octree->origin, vt_v3(x, y, (cell[2] + vt_random_unit(&rng)) * edge));
  double z = vt_random_between(&rng, -1, 1), angle = vt_random_between(&rng, 0, 2 * VT_PI), r = sqrt(1 - z * z);
  vt_vec3 direction = {r * cos(angle), r * sin(angle), z};
  return (vt_ray){vt_sub(point, vt_scale(direction, 2 * octree->edge)), direction};
}

static void follow_chords(void *user, size_t begin, size_t end, int worker) {
  chord_job *job = user;
  int leaf = job->octree->level_count - 1;
  const float *depths = job->octree->levels[leaf].optical_depth;
  vt_segment *segments = job->segments + (size_t)worker * job->segment_limit;
  for (size_t i = begin; i < end; i++) {
    vt_ray ray = draw_chord(job, i);
    size_t count = vt_walk_ray(job->octree, leaf, &ray, segments);
    double tree = 0, radius = 0.5 * vt_cell_edge(job->octree, leaf); // a cell knows no finer detail than itself
    for (size_t k = 0; k < count; k++) tree += (double)segments[k].length * (double)depths[segments[k].cell];
    double truth = vt_true_optical_depth(job->truth, &ray, 0, 4 * job->octree->edge, radius);
    double through = exp(-tree) - exp(-truth), depth = fmin(tree, clip_depth) - fmin(truth, clip_depth);
    job->errors[2 * i] = through * through, job->errors[2 * i + 1] = depth * depth;
  }
}

static vt_status compare_chords(vt_context *context, const vt_octree *octree, const vt_truth *truth,
                                const cell_set *cells, vt_truth_scores *out) {
  chord_job job = {.octree = octree, .truth = truth, .cells = cells};
  out->transmittance_rmse = out->depth_rmse = NAN;
  if (!cells->count) return VT_OK;
  job.segment_limit = vt_max_segments(&octree->levels[octree->level_count - 1]);
  job.segments = VT_NEW(context, vt_segment, (size_t)vt_thread_count(context) * job.segment_limit);
  job.errors = VT_NEW(context, double, 2 * CHORDS);
  vt_status status = VT_OUT_OF_MEMORY;
  if (job.segments && job.errors) status = vt_parallel(context, CHORDS, CHORD_BLOCK, follow_chords, &job);
  if (!status) {
    double sums[2] = {0, 0};
    for (size_t i = 0; i < 2 * CHORDS; i++) sums[i % 2] += job.errors[i];
    out->chord_count = CHORDS;
    out->transmittance_rmse = sqrt(sums[0] / CHORDS), out->depth_rmse = sqrt(sums[1] / CHORDS);
  }
  vt_free(context, job.segments);
  vt_free(context, job.errors);
  return status;
}

// ---- the whole

vt_status vt_score_truth(vt_session *session, const vt_tree *tree, const vt_truth *truth, bool is_phantom,
                         vt_truth_scores *out) {
  vt_context *context = session->context;
  cell_set parents = {0}, cells = {0};
  vt_status status = VT_OK;
  *out = (vt_truth_scores){.level_count = tree->octree.level_count};
  for (int l = 0; l < tree->octree.level_count && !status; l++) {
    status = find_cells(context, &tree->octree, l, truth, is_phantom, &parents, &cells);
    if (!status) compare_cells(&tree->octree, l, &cells, &out->levels[l]);
    vt_progress(context, "truth", (l + 1.0) / tree->octree.level_count);
    free_cells(context, &parents);
    parents = cells, cells = (cell_set){0};
  }
  if (!status) status = compare_chords(context, &tree->octree, truth, &parents, out);
  free_cells(context, &parents);
  return status;
}

void vt_report_truth(vt_json_writer *json, const vt_truth_scores *scores) {
  vt_json_open_object(json, "truth");
  vt_json_open_array(json, "levels");
  for (int l = 0; l < scores->level_count; l++) {
    const vt_truth_level *level = &scores->levels[l];
    vt_json_open_object(json, NULL);
    vt_json_put_integer(json, "level", level->level);
    vt_json_put_integer(json, "cells", (long long)level->cell_count);
    vt_json_put_integer(json, "tree_cells", (long long)level->tree_count);
    vt_json_put_integer(json, "true_cells", (long long)level->true_count);
    vt_json_put_number(json, "extinction_relative_rms", level->relative_rms);
    vt_json_put_number(json, "extinction_correlation", level->correlation);
    vt_json_put_number(json, "mass_ratio", level->mass_ratio);
    vt_json_close_object(json);
  }
  vt_json_close_array(json);
  vt_json_put_integer(json, "chords", scores->chord_count);
  vt_json_put_number(json, "transmittance_rmse", scores->transmittance_rmse);
  vt_json_put_number(json, "depth_rmse", scores->depth_rmse);
  vt_json_close_object(json);
}

void vt_say_truth(vt_session *session, const vt_truth_scores *scores) {
  vt_say(session, "\nagainst the truth %10s %10s %10s %12s %12s %10s\n", "cells", "tree's", "true", "relative RMS",
         "correlation", "mass");
  for (int l = 0; l < scores->level_count; l++) {
    const vt_truth_level *level = &scores->levels[l];
    vt_say(session, "  level %-9d %10zu %10zu %10zu %12.4f %12.4f %10.4f\n", level->level, level->cell_count,
           level->tree_count, level->true_count, level->relative_rms, level->correlation, level->mass_ratio);
  }
  vt_say(session, "  %d chords: RMSE of transmittance %.4f, of optical depth (clipped at 4) %.4f\n",
         scores->chord_count, scores->transmittance_rmse, scores->depth_rmse);
}
