// fit.c - the field of a level, opacity and colour together, improved through the compositor
// SPDX-License-Identifier: BSD-3-Clause
//
// Alpha alone leaves fog where mattes saturate: inside a dense crown every arrangement of leaves is as good as another.
// Colour tells them apart. Per ray, with depths d_k = s_k R_k l_k of its chords, w_k = T_k (1 - exp(-d_k)), C = sum w_k
// c_k, A = 1 - T_end and the photograph's premultiplied (C*, A*), the loss looks at the picture over black and over
// white alike (METHODS 9):
//   1/2 |e_C|^2 + 1/2 |e_C - e_A|^2 + 1/2 e_A^2,       e_C = C - C*, e_A = A - A*
//   g_C = 2 e_C - e_A (per channel),  g_A = e_A - sum_c (e_C - e_A)
//   dL/dc_k = w_k g_C
//   dL/dd_k = T_{k+1} c_k.g_C - sum_{j>k} w_j c_j.g_C + g_A T_end
// s_k and c_k are interpolated between eight corners, which take the gradient by the same shares.
//
// Left out: what a tree is for is a picture between its photographs, where the view textures R of the nearest ones
// stand in for what the cells are too coarse for. So in the second half each photograph is predicted from the textures
// of the others nearest to it, and the field learns what makes that prediction right. The textures follow from the
// field; they are made anew before each epoch and held still within it.
//
// The field has seen the photograph that is left out, though: in other epochs, and on coarser levels. What it remembers
// makes the prediction look better than it is. So a share of the photograph's own texture is taken off what the others
// say: where the field is right by itself the own texture says nothing (R = 1), and where it relies on it the error
// grows (own_share; on maple 0.18 dB at level 7 and 0.17 at level 8 on views never seen, where half as much of the own
// texture added would cost as much).
//
// Steps by Adam [Kingma & Ba 2015] with (.9, .99); corners without any gradient yet are left alone.

#include "reconstruct/fit.h"
#include "base/fast_exp.h"
#include "reconstruct/view_textures.h"

#include <string.h>

vt_fit_desc vt_default_fit_desc(void) {
  return (vt_fit_desc){.cookie = VT_COOKIE,
                       .epochs = 1,
                       .batch_count = 48,
                       .parts = 4,
                       .opacity_step = 0.05f,
                       .opacity_share = 0.25f,
                       .colour_step = 0.01f,
                       .last_step_share = 0.2f,
                       .largest = 30,
                       .ratio_limit = 50,
                       .neighbours = 4,
                       .own_share = -0.2f};
}

float vt_ray_gradient(const float *depth, float (*value)[4], size_t count, const float target[4],
                      float (*gradient)[4]) {
  float shown[3] = {0, 0, 0}, t = 1;
  for (size_t k = 0; k < count; k++) { // gradient[k] holds w_k and T_{k+1} for the way back
    float left = t * vt_exp_of_negative(-depth[k]), w = t - left;
    for (int c = 0; c < 3; c++) shown[c] += w * value[k][c + 1];
    gradient[k][0] = w;
    gradient[k][1] = left;
    t = left;
  }
  float error_a = 1 - t - target[3], g[3], g_a = error_a, loss = 0.5f * error_a * error_a;
  for (int c = 0; c < 3; c++) {
    float e = shown[c] - target[c], e_white = e - error_a;
    g[c] = e + e_white;
    g_a -= e_white;
    loss += 0.5f * (e * e + e_white * e_white);
  }
  float behind = 0; // sum over cells behind of w_j c_j.g_C
  for (size_t k = count; k-- > 0;) {
    float w = gradient[k][0], left = gradient[k][1];
    float cg = value[k][1] * g[0] + value[k][2] * g[1] + value[k][3] * g[2];
    gradient[k][0] = left * cg - behind + g_a * t;
    for (int i = 0; i < 3; i++) gradient[k][i + 1] = w * g[i];
    behind += w * cg;
  }
  return loss;
}

typedef float float4 __attribute__((vector_size(16), aligned(4)));

#define CHORDS_AHEAD 6   // what a chord will want of memory is asked for so many chords before

typedef struct fit_job {
  const vt_fit_desc *desc;
  const vt_rays *rays;
  const vt_tree *tree;
  const vt_level *cells;
  const vt_view_textures *textures;           // NULL: bare
  vt_field_view (*views)[VT_MAX_BLEND_VIEWS]; // [photographs] the others that predict it
  int *view_count;                            // [photographs]
  float *sums;                                // [VT_LANES][corners][4]
  uint8_t *touched;                           // [VT_LANES][blocks]
  size_t blocks;
  float *along, *log_ratio, *depth;           // [VT_LANES][capacity]
  float (*inside)[4], (*value)[4], (*gradient)[4];
  size_t capacity;
  float opacity_step; // the first
  double loss[VT_LANES];
} fit_job;

static inline void ask_for_sums(const vt_level *cells, uint32_t cell, const float *sums) {
  const uint32_t *corner = cells->corner_of + 8 * (size_t)cell;
  for (int i = 0; i < 8; i++) __builtin_prefetch(sums + 4 * (size_t)corner[i], 1);
}

// What a chord wants of its cell, to the cell's corners.
static void scatter(const vt_level *cells, const vt_chord *chords, size_t count, float (*inside)[4],
                    float (*gradient)[4], float *sums, uint8_t *touched) {
  for (size_t k = 0; k < count; k++) {
    const uint32_t *corner = cells->corner_of + 8 * (size_t)chords[k].cell;
    if (k + CHORDS_AHEAD < count) ask_for_sums(cells, chords[k + CHORDS_AHEAD].cell, sums);
    float4 g = *(const float4 *)(const void *)gradient[k];
    float x = inside[k][0], y = inside[k][1], z = inside[k][2];
    for (int i = 0; i < 8; i++) {
      float share = (i & 1 ? x : 1 - x) * (i & 2 ? y : 1 - y) * (i & 4 ? z : 1 - z);
      float4 *sum = (float4 *)(void *)(sums + 4 * (size_t)corner[i]);
      *sum += g * share;
      touched[corner[i] / VT_FIT_BLOCK] = 1;
    }
  }
}

float vt_field_gradient(const vt_octree *octree, int level, const vt_ray *ray, const vt_chord *chords, size_t count,
                        const vt_field_view *views, int view_count, const float target[4], vt_fit_scratch *scratch,
                        float *sums, uint8_t *touched) {
  vt_field_samples *s = &scratch->samples;
  vt_sample_field(octree, level, ray, chords, count, s);
  if (view_count) vt_sample_ratios(octree, level, ray, views, view_count, count, s);
  for (size_t k = 0; k < count; k++) {
    float factor = chords[k].length * (view_count ? vt_exp_of_any(s->log_ratio[k]) : 1);
    s->log_ratio[k] = factor;
    scratch->depth[k] = s->value[k][0] * factor;
  }
  float loss = vt_ray_gradient(scratch->depth, s->value, count, target, scratch->gradient);
  for (size_t k = 0; k < count; k++) scratch->gradient[k][0] *= s->log_ratio[k];
  scatter(&octree->levels[level], chords, count, s->inside, scratch->gradient, sums, touched);
  return loss;
}

static void visit(void *user, const vt_swept_ray *ray) {
  fit_job *job = user;
  size_t first = job->capacity * (size_t)ray->lane;
  vt_fit_scratch scratch = {{job->along + first, job->inside + first, job->value + first, job->log_ratio + first},
                            job->depth + first,
                            job->gradient + first};
  vt_ray world = vt_camera_ray(&job->rays->views->cameras[ray->view], ray->x + 0.5, ray->y + 0.5);
  float a = (float)ray->pixel[3] / 255.0f, target[4] = {0, 0, 0, a};
  for (int c = 0; c < 3; c++) target[c] = a * (float)ray->pixel[c] / 255.0f;
  float *sums = job->sums + 4 * (size_t)job->cells->corner_count * (size_t)ray->lane;
  job->loss[ray->lane] += (double)vt_field_gradient(
      job->rays->octree, job->rays->level, &world, ray->chords, ray->chord_count, job->views[ray->view],
      job->textures ? job->view_count[ray->view] : 0, target, &scratch, sums,
      job->touched + job->blocks * (size_t)ray->lane);
}

typedef struct adam_job {
  float *values, *lanes;
  uint8_t *touched; // [VT_LANES][blocks]
  size_t corners, blocks;
  float (*first)[4], (*second)[4]; // moments [corners][4]
  float bias_first, bias_second, opacity_step, colour_step, largest;
} adam_job;

// From those lanes alone that have something to say of the block: of a step's pixels most lanes meet an eighth of the tree.
static void take_gradient(adam_job *job, size_t block, size_t count, float *restrict g) {
  memset(g, 0, count * sizeof *g);
  for (size_t lane = 0; lane < VT_LANES; lane++) {
    if (!job->touched[lane * job->blocks + block]) continue;
    float *restrict from = job->lanes + 4 * (lane * job->corners + block * VT_FIT_BLOCK);
    for (size_t i = 0; i < count; i++) g[i] += from[i];
    memset(from, 0, count * sizeof *from);
    job->touched[lane * job->blocks + block] = 0;
  }
}

// Of `count` numbers side by side, so that a compiler takes them by registers.
static void step_block(const adam_job *job, size_t count, const float *restrict g, const float *restrict step,
                       const float *restrict top, float *restrict m, float *restrict v, float *restrict x) {
  float first = job->bias_first, second = job->bias_second;
  for (size_t i = 0; i < count; i++) {
    m[i] = 0.9f * m[i] + 0.1f * g[i];
    v[i] = 0.99f * v[i] + 0.01f * g[i] * g[i];
    float moved = x[i] - step[i] * (m[i] * first / (sqrtf(v[i] * second) + 1e-8f));
    moved = moved < 0 ? 0 : moved;
    moved = moved > top[i] ? top[i] : moved;
    x[i] = v[i] > 1e-20f ? moved : x[i];
  }
}

static void step_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  adam_job *job = user;
  float step[4 * VT_FIT_BLOCK], top[4 * VT_FIT_BLOCK], g[4 * VT_FIT_BLOCK];
  for (size_t i = 0; i < 4 * VT_FIT_BLOCK; i++) {
    step[i] = i % 4 ? job->colour_step : job->opacity_step;
    top[i] = i % 4 ? 1 : job->largest;
  }
  for (size_t block = begin; block < end; block++) {
    size_t corner = block * VT_FIT_BLOCK, left = job->corners - corner;
    size_t count = 4 * (left < VT_FIT_BLOCK ? left : VT_FIT_BLOCK);
    take_gradient(job, block, count, g);
    step_block(job, count, g, step, top, job->first[corner], job->second[corner], job->values + 4 * corner);
  }
}

// Those that stand in for a photograph: the nearest others, and itself with a share that is negative.
// VT_MAX_BLEND_VIEWS is room enough, since neighbours are fewer.
static int choose_stand_ins(const fit_job *job, const vt_view_textures *textures, int view, vt_field_view *out) {
  const vt_camera *cameras = job->tree->cameras;
  int left_out = job->desc->left_out ? job->desc->left_out[view] : view;
  vt_view_weights w = vt_choose_views_but(job->tree, vt_camera_centre(&cameras[view]), job->desc->neighbours, left_out);
  float own = job->desc->own_share;
  if (w.count && own != 0) {
    for (int i = 0; i < w.count; i++) w.weight[i] *= 1 - own;
    w.view[w.count] = view;
    w.weight[w.count++] = own;
  }
  for (int i = 0; i < w.count; i++)
    out[i] = vt_aim_field_view(job->rays->octree, job->rays->level, &cameras[w.view[i]], textures->factor,
                               &textures->views[w.view[i]], w.weight[i]);
  return w.count;
}

// The textures of this moment, and for each photograph those that stand in for it.
static vt_status renew_textures(vt_context *context, fit_job *job, vt_view_textures *textures) {
  vt_free_view_textures(context, textures);
  vt_status status = vt_make_view_textures(context, job->rays, job->desc->ratio_limit, job->desc->linear_ratios, textures);
  if (status) return status;
  job->textures = textures;
  for (int v = 0; v < job->tree->view_count; v++)
    job->view_count[v] = choose_stand_ins(job, textures, v, job->views[v]);
  return VT_OK;
}

// How much of the way to the last, smallest steps is behind: of the epochs, or of the time.
static float share_done(const vt_fit_desc *desc, int step, int step_count) {
  double done = (double)step / step_count;
  if (desc->deadline > 0) done = fmax(done, (vt_seconds() - desc->begun) / (desc->deadline - desc->begun));
  return (float)fmin(done, 1);
}

static bool is_late(const vt_fit_desc *desc) {
  return desc->deadline > 0 && vt_seconds() > desc->deadline;
}

static vt_status run_epoch(vt_context *context, fit_job *job, adam_job *adam, int *chosen, int epoch, int batches) {
  const vt_fit_desc *desc = job->desc;
  int views = job->rays->views->count, steps = batches * desc->parts;
  int jump = batches > 4 && batches % 7 ? 7 : 1; // views that follow each other in the list are often neighbours
  for (int i = 0; i < steps && !is_late(desc); i++) {
    int count = 0, step = epoch * steps + i, batch = i % batches;
    for (int v = batch * jump % batches; v < views; v += batches) chosen[count++] = v;
    vt_status status = vt_sweep_part(context, job->rays, chosen, count, desc->parts, i / batches, visit, job);
    if (status) return status;
    float decay = powf(desc->last_step_share, share_done(desc, step, steps * desc->epochs));
    adam->opacity_step = job->opacity_step * decay;
    adam->colour_step = desc->colour_step * decay;
    adam->bias_first = (float)(1 / (1 - pow(0.9, step + 1)));
    adam->bias_second = (float)(1 / (1 - pow(0.99, step + 1)));
    status = vt_parallel(context, adam->blocks, 128, step_some, adam);
    if (status) return status;
    vt_progress(context, "fit", (step + 1.0) / (steps * desc->epochs));
  }
  return VT_OK;
}

static vt_status run_epochs(vt_context *context, fit_job *job, adam_job *adam, vt_view_textures *textures,
                            int *chosen) {
  const vt_fit_desc *desc = job->desc;
  int views = job->rays->views->count, batches = desc->batch_count < views ? desc->batch_count : views;
  vt_status status = VT_OK;
  for (int epoch = 0; epoch < desc->epochs && !status; epoch++) {
    double loss = 0;
    if (is_late(desc)) break;
    if (desc->neighbours) status = renew_textures(context, job, textures);
    for (int lane = 0; lane < VT_LANES; lane++) job->loss[lane] = 0;
    if (!status) status = run_epoch(context, job, adam, chosen, epoch, batches);
    for (int lane = 0; lane < VT_LANES; lane++) loss += job->loss[lane];
    vt_log(context, VT_LOG_VERBOSE, "level %d, fit epoch %d: loss %.1f", job->rays->level, epoch, loss);
  }
  return status;
}

// No more than a share of the depth that a usual corner has, each counted by its own depth: in thin volumes, where all
// of a cell is 0.06 deep, steps of 0.05 leave noise behind (blobs_64, held-out photographs: 43.7 dB, and 48.2 dB with a
// quarter of it).
static float first_step(const vt_fit_desc *desc, const vt_level *cells) {
  double sum = 0, squares = 0;
  for (size_t i = 0; i < cells->corner_count; i++) {
    double s = (double)cells->corner_values[4 * i];
    sum += s, squares += s * s;
  }
  return sum > 0 ? (float)fmin((double)desc->opacity_step, (double)desc->opacity_share * squares / sum)
                 : desc->opacity_step;
}

vt_status vt_fit_field(vt_context *context, const vt_fit_desc *desc, const vt_rays *rays, const vt_tree *tree,
                       vt_level *cells) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->epochs >= 0 && desc->batch_count >= 1 && desc->ratio_limit >= 1 &&
            desc->parts >= 1);
  VT_ASSERT(desc->neighbours >= 0 && desc->neighbours < VT_MAX_BLEND_VIEWS && desc->own_share < 1 &&
            tree->view_count == rays->views->count);
  size_t corners = cells->corner_count, max = vt_max_segments(cells), views = (size_t)rays->views->count;
  if (!corners || !desc->epochs) return VT_OK;
  fit_job job = {.desc = desc,
                 .rays = rays,
                 .tree = tree,
                 .cells = cells,
                 .capacity = max,
                 .opacity_step = first_step(desc, cells)};
  job.sums = VT_NEW(context, float, 4 * corners * VT_LANES);
  job.blocks = (corners + VT_FIT_BLOCK - 1) / VT_FIT_BLOCK;
  job.touched = VT_NEW(context, uint8_t, job.blocks * VT_LANES);
  job.along = VT_NEW(context, float, max *VT_LANES);
  job.log_ratio = VT_NEW(context, float, max *VT_LANES);
  job.depth = VT_NEW(context, float, max *VT_LANES);
  job.inside = vt_alloc(context, max * VT_LANES, sizeof(float[4]));
  job.value = vt_alloc(context, max * VT_LANES, sizeof(float[4]));
  job.gradient = vt_alloc(context, max * VT_LANES, sizeof(float[4]));
  job.views = vt_alloc(context, views, sizeof *job.views);
  job.view_count = VT_NEW(context, int, views);
  adam_job adam = {.values = cells->corner_values,
                   .lanes = job.sums,
                   .touched = job.touched,
                   .corners = corners,
                   .blocks = job.blocks,
                   .largest = desc->largest,
                   .first = vt_alloc(context, corners, sizeof(float[4])),
                   .second = vt_alloc(context, corners, sizeof(float[4]))};
  int *chosen = VT_NEW(context, int, views);
  vt_view_textures textures = {0};
  vt_status status = VT_OUT_OF_MEMORY;
  if (job.sums && job.touched && job.along && job.log_ratio && job.depth && job.inside && job.value && job.gradient && job.views &&
      job.view_count && adam.first && adam.second && chosen)
    status = run_epochs(context, &job, &adam, &textures, chosen);
  vt_free_view_textures(context, &textures);
  void *blocks[] = {chosen,    adam.second, adam.first, job.view_count, job.views, job.gradient,
                    job.value, job.inside,  job.depth,  job.log_ratio,  job.along, job.touched, job.sums};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) vt_free(context, blocks[i]);
  return status;
}
