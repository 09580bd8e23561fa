// opacity.c - extinction of the cells of one level from mattes
// SPDX-License-Identifier: BSD-3-Clause
//
// Unknown: s_i >= 0, the optical depth across an edge of cell i. Ray r has chords l_ri (in edges), tau_r = sum l_ri s_i,
// L_r = sum l_ri, and the matte says alpha a_r; t = 1 - a, T = exp(-tau), b = -ln t. Wanted is the least of
//
//   F(s) = 1/2 sum_r w_r (T_r - t_r)^2 + lambda sum_faces (sqrt((s_i - s_j)^2 + delta^2) - delta)
//
// The transmittance domain takes no logarithm of a dense pixel, whose noise would shout down the rest, and a saturated
// pixel says only "at least this much" (METHODS 2.1). Its gradient -T (T - t) l vanishes on rays that are too dense, so
// with steps bounded by a majoriser (diagonal w T^2 l L: a cell may move by what all L cells of the ray together may)
// fog stays in the crown for hundreds of sweeps. Adam divides each cell's gradient by its own running size: a cell that
// all its few gap rays want thinner gets thinner at full speed, however small their gradients are. On a dense crown the
// alpha error falls from 0.129 to 0.114 in the same four sweeps (docs/results.md). The majoriser's steps remain for the
// papers' methods, Nesterov's for problems so small or smooth that an exact minimum is wanted.
//
//   majoriser   log domain            s += relax [sum_r w l (b - tau) / L] / [sum_r w l]                    (2004, SART)
//               transmittance domain  s += relax [sum_r w v l (b - tau)] / [sum_r w v l L], v = T (T - t) / (b - tau)
//   Nesterov    y = s + momentum; s = y + [sum_r w l g] / [sum_r w l L h]; g = T (T - t), h = T^2 + 0.001, or b - tau, 1
//   Adam        s -= rate * m / (sqrt(q) + 1e-6), m and q running means (.9, .99) of the gradient and its square
//
// Sums over rays go to lanes and are added in their order: the same bits for any number of threads. A lane's sum has at
// most some 10^5 terms of float, since the photographs are reduced to a few pixels a cell and taken in subsets.

#include "reconstruct/opacity.h"
#include "base/fast_exp.h"
#include "reconstruct/total_variation.h"
#include "reconstruct/solid_angle.h"

#include <string.h>

#define LEAST_TRANSMITTANCE 0.001f
#define LEAST_WEIGHT 1e-4f
#define LEAST_CURVATURE 1e-3f
#define LEAST_RATE 0.002f

vt_opacity_desc vt_default_opacity_desc(void) {
  return (vt_opacity_desc){.cookie = VT_COOKIE,
                           .domain = VT_TRANSMITTANCE_DOMAIN,
                           .step = VT_STEP_ADAM,
                           .iterations = 4,
                           .least_updates = 48,
                           .subset_count = 24,
                           .relaxation = 0.7f,
                           .learning_rate = 0.25f,
                           .last_rate = 0.1f,
                           .largest = 30,
                           .total_variation = 0.05f,
                           .variation_width = 0.03f,
                           .weigh_views = true,
                           .held_out_share = 0.02f,
                           .stop_gain = -1};
}

vt_opacity_desc vt_sart_opacity_desc(void) {
  return (vt_opacity_desc){.cookie = VT_COOKIE,
                           .domain = VT_LOG_DOMAIN,
                           .step = VT_STEP_MAJORISER,
                           .iterations = 3,
                           .subset_count = 12,
                           .relaxation = 0.7f,
                           .largest = 30,
                           .variation_width = 0.03f,
                           .stop_gain = -1};
}

typedef struct lane_sums {
  double squared_error, held_out_error;
  uint64_t rays, saturated, fitted, held_out;
  char other_lanes_stay_off[16]; // fill a cache line
} lane_sums;

typedef struct opacity_job {
  const vt_opacity_desc *desc;
  const float *s;           // where the gradient is taken
  const float *view_weight; // [views]
  size_t cells;
  uint32_t held_out_below; // hashes of blocks below this are held out
  int width;               // numbers per cell: correction, and (not for Adam) its weight
  float *sums;             // [VT_LANES][width * cells]
  lane_sums lanes[VT_LANES];
} opacity_job;

// A block's number between 0 and 2^32 - 1 that has nothing to do with its place [Wang's integer hash].
static uint32_t hash_block(int view, int x, int y) {
  uint32_t h = (uint32_t)view * 0x9e3779b1u ^ (uint32_t)(y >> 3) * 0x85ebca6bu ^ (uint32_t)(x >> 3) * 0xc2b2ae35u;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h = (h ^ (h >> 15)) * 0x846ca68bu;
  return h ^ (h >> 16);
}

// What a ray asks of its cells: each gets l * correction, and l * weight below it.
typedef struct pull { float correction, weight; } pull;

static pull pull_of_majoriser(const opacity_job *job, float tau, float transmittance, float t, float length) {
  bool saturated = t < LEAST_TRANSMITTANCE;
  if (saturated) t = LEAST_TRANSMITTANCE;
  float difference = -logf(t) - tau;
  if (saturated && difference < 0) return (pull){0, 0}; // it already says enough
  if (job->desc->domain == VT_LOG_DOMAIN) return (pull){difference / length, 1};
  float weight = fabsf(difference) > 1e-3f ? transmittance * (transmittance - t) / difference : transmittance * t;
  if (weight < LEAST_WEIGHT) weight = LEAST_WEIGHT;
  return (pull){weight * difference, weight * length};
}

static pull pull_of(const opacity_job *job, float tau, float transmittance, float t, float length) {
  if (job->desc->step == VT_STEP_MAJORISER) return pull_of_majoriser(job, tau, transmittance, t, length);
  if (job->desc->domain == VT_TRANSMITTANCE_DOMAIN)
    return (pull){(transmittance - t) * transmittance, (transmittance * transmittance + LEAST_CURVATURE) * length};
  float difference = -logf(t < LEAST_TRANSMITTANCE ? LEAST_TRANSMITTANCE : t) - tau;
  if (t < LEAST_TRANSMITTANCE && difference < 0) return (pull){0, 0};
  return (pull){difference, length};
}

static float weight_of_pixel(const opacity_job *job, const vt_swept_ray *ray) {
  float weight = job->view_weight[ray->view];
  if (!job->desc->confidence) return weight;
  const vt_image *confidence = &job->desc->confidence[ray->view];
  return weight * (float)confidence->pixels[(size_t)ray->y * (size_t)confidence->width + (size_t)ray->x] / 255.0f;
}

static void visit(void *user, const vt_swept_ray *ray) {
  opacity_job *job = user;
  float tau = 0, length = 0;
  for (size_t k = 0; k < ray->chord_count; k++) {
    tau += ray->chords[k].length * job->s[ray->chords[k].cell];
    length += ray->chords[k].length;
  }
  float alpha = (float)ray->pixel[3] / 255.0f, t = 1 - alpha, transmittance = vt_exp_of_negative(-tau);
  lane_sums *lane = &job->lanes[ray->lane];
  double error = (double)(transmittance - t);
  lane->rays++;
  lane->saturated += alpha > 0.99f;
  if (hash_block(ray->view, ray->x, ray->y) < job->held_out_below) {
    lane->held_out++;
    lane->held_out_error += error * error;
    return;
  }
  lane->fitted++;
  lane->squared_error += error * error;
  float weight = weight_of_pixel(job, ray);
  pull p = pull_of(job, tau, transmittance, t, length);
  p.correction *= weight, p.weight *= weight;
  float *sums = job->sums + (size_t)job->width * job->cells * (size_t)ray->lane;
  if (job->width == 1) {
    for (size_t k = 0; k < ray->chord_count; k++) sums[ray->chords[k].cell] += ray->chords[k].length * p.correction;
    return;
  }
  for (size_t k = 0; k < ray->chord_count; k++) {
    float *sum = sums + 2 * (size_t)ray->chords[k].cell, l = ray->chords[k].length;
    sum[0] += l * p.correction;
    sum[1] += l * p.weight;
  }
}

// ---- steps

typedef struct stepper {
  vt_context *context;
  const vt_opacity_desc *desc;
  float *s, *total;              // [cells], [width * cells]
  float *first, *second;         // Adam: running means; Nesterov: second is y, first the last s
  float first_rate, rate, first_bias, second_bias; // Adam
  size_t cells;
  double power_first, power_second;
  double t;                      // Nesterov's
  const vt_variation *variation; // NULL: none
  float variation_share;         // of the regulariser that belongs to one update
  int update, update_count;
} stepper;

static float clamp_depth(float v, float largest) {
  return v > 0 ? (v < largest ? v : largest) : 0; // NaN is 0
}

static void step_majoriser(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  stepper *st = user;
  for (size_t i = begin; i < end; i++)
    if (st->total[2 * i + 1] > 1e-12f)
      st->s[i] = clamp_depth(st->s[i] + st->desc->relaxation * st->total[2 * i] / st->total[2 * i + 1], st->desc->largest);
}

static void step_nesterov(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  stepper *st = user;
  for (size_t i = begin; i < end; i++) {
    float y = st->second[i], last = st->s[i];
    st->first[i] = last;
    st->s[i] = st->total[2 * i + 1] > 1e-12f ? clamp_depth(y + st->total[2 * i] / st->total[2 * i + 1], st->desc->largest) : y;
  }
}

static void step_adam(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  stepper *st = user;
  for (size_t i = begin; i < end; i++) {
    float g = st->total[i];
    if (g == 0 && st->second[i] == 0) continue; // no ray has asked for anything yet
    st->first[i] = 0.9f * st->first[i] + 0.1f * g;
    st->second[i] = 0.99f * st->second[i] + 0.01f * g * g;
    float size = sqrtf(st->second[i] * st->second_bias) + 1e-6f;
    st->s[i] = clamp_depth(st->s[i] + st->rate * st->first[i] * st->first_bias / size, st->desc->largest);
  }
}

// y = s + momentum (s - last s); momentum starts anew where it leads uphill (the pull at y against the way just gone).
static void carry_momentum(stepper *st) {
  double along = 0;
  for (size_t i = 0; i < st->cells; i++) along += (double)st->total[2 * i] * (double)(st->s[i] - st->first[i]);
  if (along < 0) st->t = 1;
  double next = (1 + sqrt(1 + 4 * st->t * st->t)) / 2;
  float momentum = (float)((st->t - 1) / next);
  st->t = next;
  for (size_t i = 0; i < st->cells; i++)
    st->second[i] = clamp_depth(st->s[i] + momentum * (st->s[i] - st->first[i]), st->desc->largest);
}

static vt_status make_step(stepper *st, int width) {
  const vt_opacity_desc *desc = st->desc;
  const float *at = desc->step == VT_STEP_NESTEROV ? st->second : st->s;
  vt_status status = VT_OK;
  if (st->variation)
    status = vt_pull_by_variation(st->context, st->variation, at, st->variation_share, width, st->total);
  if (status) return status;
  st->update++;
  if (desc->step == VT_STEP_ADAM) {
    st->power_first *= 0.9, st->power_second *= 0.99;
    st->first_bias = (float)(1 / (1 - st->power_first));
    st->second_bias = (float)(1 / (1 - st->power_second));
    st->rate = st->first_rate * powf(desc->last_rate, (float)st->update / (float)st->update_count);
  }
  vt_block_function step = desc->step == VT_STEP_ADAM       ? step_adam
                           : desc->step == VT_STEP_NESTEROV ? step_nesterov
                                                            : step_majoriser;
  status = vt_parallel(st->context, st->cells, 4096, step, st);
  if (!status && desc->step == VT_STEP_NESTEROV) carry_momentum(st);
  return status;
}

// ---- sweeps

static void report_sweep(const opacity_job *job, int iterations, vt_opacity_report *report) {
  lane_sums sum = {0};
  for (int lane = 0; lane < VT_LANES; lane++) {
    const lane_sums *l = &job->lanes[lane];
    sum.squared_error += l->squared_error, sum.held_out_error += l->held_out_error;
    sum.rays += l->rays, sum.saturated += l->saturated, sum.fitted += l->fitted, sum.held_out += l->held_out;
  }
  *report = (vt_opacity_report){.rays = sum.rays, .iterations = iterations, .held_out_rmse = (double)NAN};
  report->saturated_share = sum.rays ? (double)sum.saturated / (double)sum.rays : 0;
  report->alpha_rmse = sum.fitted ? sqrt(sum.squared_error / (double)sum.fitted) : 0;
  if (sum.held_out) report->held_out_rmse = sqrt(sum.held_out_error / (double)sum.held_out);
}

// Subsets that follow each other look from different sides: every fifth, or every seventh where five divides them.
static int choose_subset(int q, int subsets, int views, int *chosen) {
  int count = 0;
  for (int v = (int)((long long)q * (subsets % 5 ? 5 : 7) % subsets); v < views; v += subsets) chosen[count++] = v;
  return count;
}

static vt_status sweep_once(vt_context *context, const vt_rays *rays, opacity_job *job, stepper *st, int subsets, int *chosen) {
  vt_status status = VT_OK;
  for (int lane = 0; lane < VT_LANES; lane++) job->lanes[lane] = (lane_sums){0};
  for (int q = 0; q < subsets && !status; q++) {
    int count = choose_subset(q, subsets, rays->views->count, chosen);
    status = vt_sweep_rays(context, rays, chosen, count, visit, job);
    if (!status) status = vt_add_lanes(context, job->sums, (size_t)job->width * job->cells, st->total);
    if (!status) status = make_step(st, job->width);
  }
  return status;
}

static vt_status run_sweeps(vt_context *context, const vt_opacity_desc *desc, const vt_rays *rays, opacity_job *job,
                            stepper *st, int *chosen, vt_opacity_report *report) {
  int views = rays->views->count, subsets = desc->subset_count < views ? desc->subset_count : views;
  if (desc->step == VT_STEP_NESTEROV) subsets = 1;
  int iterations = desc->iterations, least = (desc->least_updates + subsets - 1) / subsets;
  if (iterations && iterations < least) iterations = least;
  st->update_count = iterations * subsets;
  st->variation_share = 1 / (float)subsets;
  vt_status status = VT_OK;
  for (int i = 0; i < iterations && !status; i++) {
    double before = report->held_out_rmse;
    status = sweep_once(context, rays, job, st, subsets, chosen);
    report_sweep(job, i + 1, report);
    if (i && report->held_out_rmse > before * (1 - (double)desc->stop_gain)) break;
  }
  return status;
}

// The optical depth that a usual cell of some depth has: the mean weighted by itself.
static float usual_depth(const float *s, size_t count) {
  double sum = 0, squares = 0;
  for (size_t i = 0; i < count; i++) sum += (double)s[i], squares += (double)s[i] * (double)s[i];
  return sum > 0 ? (float)(squares / sum) : 0;
}

static vt_status begin_step(vt_context *context, const vt_opacity_desc *desc, const vt_level *cells, int width, stepper *st) {
  size_t count = cells->cell_count;
  *st = (stepper){.context = context, .desc = desc, .s = cells->optical_depth, .cells = count, .t = 1};
  st->power_first = st->power_second = 1;
  st->first_rate = fmaxf(desc->learning_rate * usual_depth(st->s, count), LEAST_RATE);
  st->total = VT_NEW(context, float, (size_t)width * count);
  bool remembers = desc->step != VT_STEP_MAJORISER;
  if (remembers) st->first = VT_NEW(context, float, count), st->second = VT_NEW(context, float, count);
  if (!st->total || (remembers && (!st->first || !st->second))) return VT_OUT_OF_MEMORY;
  if (desc->step == VT_STEP_NESTEROV) memcpy(st->second, st->s, count * sizeof *st->s);
  return VT_OK;
}

static void check_desc(const vt_opacity_desc *desc) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->iterations >= 0 && desc->subset_count >= 1);
  VT_ASSERT(desc->held_out_share >= 0 && desc->held_out_share <= 0.5f && desc->total_variation >= 0);
  VT_ASSERT(desc->step != VT_STEP_ADAM || desc->domain == VT_TRANSMITTANCE_DOMAIN);
}

vt_status vt_estimate_opacity(vt_context *context, const vt_opacity_desc *desc, const vt_rays *rays, vt_level *cells,
                              vt_opacity_report *or_null) {
  check_desc(desc);
  int views = rays->views->count, width = desc->step == VT_STEP_ADAM ? 1 : 2;
  opacity_job job = {.desc = desc, .cells = cells->cell_count, .width = width};
  job.held_out_below = (uint32_t)((double)desc->held_out_share * 4294967295.0);
  vt_opacity_report report = {.held_out_rmse = (double)NAN};
  vt_variation variation = {0};
  stepper st;
  vt_status status = begin_step(context, desc, cells, width, &st);
  job.s = desc->step == VT_STEP_NESTEROV ? st.second : st.s;
  job.sums = VT_NEW(context, float, (size_t)width * job.cells * VT_LANES);
  float *view_weight = VT_NEW(context, float, (size_t)views);
  int *chosen = VT_NEW(context, int, (size_t)views);
  if (!job.sums || !view_weight || !chosen) status = VT_OUT_OF_MEMORY;
  if (!status) {
    vt_weigh_views(rays->octree, rays->views, desc->weigh_views, view_weight);
    job.view_weight = view_weight;
  }
  if (!status && desc->total_variation > 0) {
    status = vt_begin_variation(context, cells, rays->octree->branching, desc->total_variation, desc->variation_width, &variation);
    st.variation = &variation;
  }
  if (!status) status = run_sweeps(context, desc, rays, &job, &st, chosen, &report);
  if (or_null) *or_null = report;
  vt_end_variation(context, &variation);
  vt_free(context, chosen);
  vt_free(context, view_weight);
  vt_free(context, job.sums);
  vt_free(context, st.total);
  vt_free(context, st.first);
  vt_free(context, st.second);
  return status;
}

// ---- the objective

typedef struct objective_job {
  const opacity_job *opacity;
  double sums[VT_LANES];
} objective_job;

static void add_objective(void *user, const vt_swept_ray *ray) {
  objective_job *job = user;
  double tau = 0;
  for (size_t k = 0; k < ray->chord_count; k++)
    tau += (double)ray->chords[k].length * (double)job->opacity->s[ray->chords[k].cell];
  double error = exp(-tau) - (1 - ray->pixel[3] / 255.0);
  job->sums[ray->lane] += 0.5 * (double)weight_of_pixel(job->opacity, ray) * error * error;
}

vt_status vt_opacity_objective(vt_context *context, const vt_opacity_desc *desc, const vt_rays *rays, const vt_level *cells,
                               double *objective) {
  check_desc(desc);
  float *view_weight = VT_NEW(context, float, (size_t)rays->views->count);
  if (!view_weight) return VT_OUT_OF_MEMORY;
  vt_weigh_views(rays->octree, rays->views, desc->weigh_views, view_weight);
  opacity_job opacity = {.desc = desc, .s = cells->optical_depth, .view_weight = view_weight};
  objective_job job = {.opacity = &opacity};
  vt_status status = vt_sweep_rays(context, rays, NULL, 0, add_objective, &job);
  *objective = 0;
  for (int lane = 0; lane < VT_LANES; lane++) *objective += job.sums[lane];
  vt_variation variation = {0};
  if (!status && desc->total_variation > 0) {
    status = vt_begin_variation(context, cells, rays->octree->branching, desc->total_variation, desc->variation_width, &variation);
    if (!status) *objective += vt_variation_of(&variation, cells->optical_depth);
  }
  vt_end_variation(context, &variation);
  vt_free(context, view_weight);
  return status;
}
