// split.c - which cells of a solved level have children on the next
// SPDX-License-Identifier: BSD-3-Clause
//
// The mattes' hull is much larger than the tree: most of its cells turn out empty, and what stands in the middle of a dense
// crown no photograph sees. Both would have eight children each. One sweep over the rays tells them apart, with T = exp(-tau)
// and t = 1 - alpha of ray r, l its chord:
//
//   asked of a cell = sum_r l T (T - t) / sum_r l (T^2 + 0.001)     the gradient, as a depth that its rays would have added
//   seen            = some ray comes to it with a transmittance above 1 - hidden_threshold
//
//   empty    thin, and its rays ask for even less: asked < -0.1. Thinness alone does not do (on maple to level 7 it costs a
//            decibel): a thin cell may hold the tip of a twig, or lie where the coarse cells of a ray have not found yet which
//            of them is opaque, and then it is asked for no less than it has. The mean of what its rays miss, max(T - t, 0), tells
//            nothing, since on a coarse level every cell has rays that miss something. Coarse levels split all their
//            cells: they are few, and what they lose is lost to all that follow.
//            Where the level was fitted with its colours, the fog of opacity alone is gone, and the field itself says it: a
//            cell all of whose corners are thinner than least_fitted is empty.
//   hidden   neither it nor any of the cells all around it is seen. The ring around what goes is not seen either, so that the
//            shell that stays is opaque without what stood behind it, however its cells change later.
//
// Where memory is short, the others are ranked by (1 - exp(-s)) (mean |T - t| + 0.01), the mean over rays that the cell can
// still change, weights l (T^2 + 0.001), ties by their index. The first so many are split: where there is opacity, and the
// photographs do not agree with how it is spread.

#include "reconstruct/split.h"
#include "base/fast_exp.h"

#include <math.h>
#include <stdlib.h>

#define LEAST_DISAGREEMENT 0.01f
#define LEAST_CURVATURE 1e-3f

vt_split_desc vt_default_split_desc(void) {
  return (vt_split_desc){.cookie = VT_COOKIE,
                         .least_depth = 0.001f,
                         .least_unasked = 0.1f,
                         .least_fitted = 0.03f,
                         .least_axis_cells = 64,
                         .hidden_threshold = 0.99f,
                         .most_cells = UINT32_MAX};
}

enum { CURVATURE, ASKED, DISAGREEMENT, SUM_COUNT }; // sum of l (T^2 + 0.001), of l T (T - t), of l (T^2 + 0.001) |T - t|

typedef struct split_job {
  const vt_split_desc *desc;
  const vt_level *level;
  const vt_rays *rays;
  size_t cells;
  float least_hiding;   // optical depth in front of a cell that hides it
  float *lanes, *total; // [VT_LANES][cells][SUM_COUNT], [cells][SUM_COUNT]
  uint8_t *seen;        // [VT_LANES][cells]; then the first lane's are those of all
  uint8_t *kind;        // [cells]
} split_job;

enum { UNSPLIT = 0, SPLIT, EMPTY, HIDDEN };

static void visit(void *user, const vt_swept_ray *ray) {
  split_job *job = user;
  const float *s = job->level->optical_depth;
  float *sums = job->lanes + SUM_COUNT * job->cells * (size_t)ray->lane, tau = 0;
  uint8_t *seen = job->seen + job->cells * (size_t)ray->lane;
  for (size_t k = 0; k < ray->chord_count; k++) {
    const vt_chord *chord = &ray->chords[k];
    if (tau < job->least_hiding) seen[chord->cell] = 1;
    tau += chord->length * s[chord->cell];
  }
  float through = vt_exp_of_negative(-tau), missing = through - (1 - (float)ray->pixel[3] / 255.0f);
  float curvature = through * through + LEAST_CURVATURE;
  for (size_t k = 0; k < ray->chord_count; k++) {
    float *sum = sums + SUM_COUNT * (size_t)ray->chords[k].cell, l = ray->chords[k].length;
    sum[CURVATURE] += l * curvature;
    sum[ASKED] += l * through * missing;
    sum[DISAGREEMENT] += l * curvature * fabsf(missing);
  }
}

static void join_lanes(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  split_job *job = user;
  for (size_t lane = 1; lane < VT_LANES; lane++)
    for (size_t i = begin; i < end; i++) job->seen[i] |= job->seen[lane * job->cells + i];
}

static bool is_empty(const split_job *job, size_t i) {
  const float *total = job->total + SUM_COUNT * i;
  const vt_level *level = job->level;
  if (level->axis_cells < job->desc->least_axis_cells) return false;
  if (level->corner_count) {
    float most = 0;
    for (size_t c = 0; c < 8; c++) most = fmaxf(most, level->corner_values[4 * (size_t)level->corner_of[8 * i + c]]);
    return most < job->desc->least_fitted;
  }
  if (!(level->optical_depth[i] < job->desc->least_depth)) return false;
  return total[ASKED] < -job->desc->least_unasked * total[CURVATURE];
}

// A cell that no ray meets is not hidden: nothing is known of what stands before it.
static bool is_hidden(const split_job *job, size_t i) {
  uint32_t around[27];
  if (job->seen[i] || !(job->desc->hidden_threshold < 1)) return false;
  vt_all_neighbours(job->level, job->rays->octree->branching, (uint32_t)i, around);
  for (int k = 0; k < 27; k++)
    if (around[k] == VT_NO_CELL || job->seen[around[k]] || !(job->total[SUM_COUNT * (size_t)around[k]] > 0)) return false;
  return true;
}

static void classify(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  split_job *job = user;
  for (size_t i = begin; i < end; i++) job->kind[i] = is_empty(job, i) ? EMPTY : is_hidden(job, i) ? HIDDEN : SPLIT;
}

typedef struct ranked {
  float score;
  uint32_t cell;
} ranked;

static int compare_ranked(const void *a, const void *b) {
  const ranked *p = a, *q = b;
  return p->score != q->score ? (p->score < q->score ? 1 : -1) : p->cell < q->cell ? -1 : p->cell > q->cell;
}

static float opacity_of(const split_job *job, size_t i) { return 1 - vt_exp_of_negative(-job->level->optical_depth[i]); }

// The first most_cells of the ranking stay; the others are left as they are.
static vt_status obey_bound(vt_context *context, split_job *job, uint32_t wanted) {
  ranked *order = VT_NEW(context, ranked, wanted);
  uint32_t n = 0;
  if (!order) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < job->cells; i++) {
    const float *total = job->total + SUM_COUNT * i;
    float disagreement = total[CURVATURE] > 0 ? total[DISAGREEMENT] / total[CURVATURE] : 0;
    if (job->kind[i] == SPLIT)
      order[n++] = (ranked){opacity_of(job, i) * (disagreement + LEAST_DISAGREEMENT), (uint32_t)i};
  }
  qsort(order, n, sizeof *order, compare_ranked);
  for (uint32_t k = job->desc->most_cells; k < n; k++) job->kind[order[k].cell] = UNSPLIT;
  vt_free(context, order);
  return VT_OK;
}

static vt_split_report count_kinds(const split_job *job) {
  uint32_t count[4] = {0};
  double all = 0, left = 0;
  for (size_t i = 0; i < job->cells; i++) {
    double opacity = (double)opacity_of(job, i);
    count[job->kind[i]]++;
    all += opacity;
    if (job->kind[i] == UNSPLIT) left += opacity;
  }
  return (vt_split_report){count[SPLIT], count[EMPTY], count[HIDDEN], count[UNSPLIT], all > 0 ? left / all : 0};
}

vt_status vt_choose_splits(vt_context *context, const vt_split_desc *desc, const vt_rays *rays, const vt_level *cells,
                           uint8_t *split, vt_split_report *out) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->least_unasked >= 0 && desc->hidden_threshold >= 0);
  size_t count = cells->cell_count;
  split_job job = {.desc = desc, .level = cells, .rays = rays, .cells = count, .kind = split};
  job.least_hiding = -logf(fmaxf(1 - desc->hidden_threshold, 1e-6f));
  job.lanes = VT_NEW(context, float, SUM_COUNT * count * VT_LANES);
  job.total = VT_NEW(context, float, SUM_COUNT * count);
  job.seen = VT_NEW(context, uint8_t, count * VT_LANES);
  vt_status status = job.lanes && job.total && job.seen ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) status = vt_sweep_rays(context, rays, NULL, 0, visit, &job);
  if (!status) status = vt_add_lanes(context, job.lanes, SUM_COUNT * count, job.total);
  if (!status) status = vt_parallel(context, count, 16384, join_lanes, &job);
  if (!status) status = vt_parallel(context, count, 4096, classify, &job);
  uint32_t wanted = 0;
  for (size_t i = 0; i < count && !status; i++) wanted += split[i] == SPLIT;
  if (!status && wanted > desc->most_cells) status = obey_bound(context, &job, wanted);
  if (!status) *out = count_kinds(&job);
  for (size_t i = 0; i < count && !status; i++) split[i] = split[i] == SPLIT;
  vt_free(context, job.seen);
  vt_free(context, job.total);
  vt_free(context, job.lanes);
  return status;
}
