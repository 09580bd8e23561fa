// refine.c - opacity and colour improved together through the compositor
// SPDX-License-Identifier: BSD-3-Clause
//
// Alpha alone leaves fog where mattes saturate: inside a dense crown every arrangement of leaves is as good as another.
// Colour tells them apart. Per ray, with w_k = T_k (1 - exp(-s_k l_k)), C = sum w_k c_k, A = 1 - T_end and the
// photograph's premultiplied (C*, A*), the loss looks at the picture over black and over white alike (METHODS 9):
//   1/2 |e_C|^2 + 1/2 |e_C - e_A|^2 + 1/2 e_A^2,       e_C = C - C*, e_A = A - A*
//   g_C = 2 e_C - e_A (per channel),  g_A = e_A - sum_c (e_C - e_A)
//   dL/dc_k = w_k g_C
//   dL/ds_k = l_k [T_{k+1} c_k.g_C - sum_{j>k} w_j c_j.g_C + g_A T_end]
// Steps by Adam [Kingma & Ba 2015] with (.9, .99); cells without any gradient yet are left alone.

#include "reconstruct/refine.h"
#include "base/fast_exp.h"

vt_refine_desc vt_default_refine_desc(void) { return (vt_refine_desc){VT_COOKIE, 4, 48, 0.02f, 0.005f, 0.2f, 30, 0}; }

float vt_ray_gradient(const float *s, const float *colour, const vt_chord *chords, size_t count, const float target[4],
                      float (*gradient)[4]) {
  float shown[3] = {0, 0, 0}, t = 1;
  for (size_t k = 0; k < count; k++) { // gradient[k] holds w_k and T_{k+1} for the way back
    size_t cell = chords[k].cell;
    float left = t * vt_exp_of_negative(-s[cell] * chords[k].length), w = t - left;
    for (int c = 0; c < 3; c++) shown[c] += w * colour[3 * cell + (size_t)c];
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
    const float *c = colour + 3 * (size_t)chords[k].cell;
    float w = gradient[k][0], left = gradient[k][1], cg = c[0] * g[0] + c[1] * g[1] + c[2] * g[2];
    gradient[k][0] = chords[k].length * (left * cg - behind + g_a * t);
    for (int i = 0; i < 3; i++) gradient[k][i + 1] = w * g[i];
    behind += w * cg;
  }
  return loss;
}

typedef struct refine_job {
  const float *s, *colour;
  size_t cells;
  float *sums;         // [VT_LANES][cells][4]
  float (*scratch)[4]; // [VT_LANES][max segments]
  size_t max_segments;
} refine_job;

static void visit(void *user, const vt_swept_ray *ray) {
  refine_job *job = user;
  float a = (float)ray->pixel[3] / 255.0f, target[4] = {0, 0, 0, a};
  for (int c = 0; c < 3; c++) target[c] = a * (float)ray->pixel[c] / 255.0f;
  float(*gradient)[4] = job->scratch + job->max_segments * (size_t)ray->lane;
  float *sums = job->sums + 4 * job->cells * (size_t)ray->lane;
  vt_ray_gradient(job->s, job->colour, ray->chords, ray->chord_count, target, gradient);
  for (size_t k = 0; k < ray->chord_count; k++) {
    float *sum = sums + 4 * (size_t)ray->chords[k].cell;
    for (int i = 0; i < 4; i++) sum[i] += gradient[k][i];
  }
}

typedef struct adam_job {
  float *s, *colour, *lanes;
  size_t cells;
  float (*first)[4], (*second)[4]; // moments [cells][4]
  float bias_first, bias_second, opacity_step, colour_step, largest;
} adam_job;

static void step_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  adam_job *job = user;
  for (size_t cell = begin; cell < end; cell++) {
    float g[4] = {0, 0, 0, 0};
    for (size_t lane = 0; lane < VT_LANES; lane++) {
      float *from = job->lanes + 4 * (lane * job->cells + cell);
      for (int i = 0; i < 4; i++) g[i] += from[i], from[i] = 0;
    }
    for (int i = 0; i < 4; i++) {
      float *m = &job->first[cell][i], *v = &job->second[cell][i];
      *m = 0.9f * *m + 0.1f * g[i];
      *v = 0.99f * *v + 0.01f * g[i] * g[i];
      if (!(*v > 1e-20f)) continue;
      float move = *m * job->bias_first / (sqrtf(*v * job->bias_second) + 1e-8f);
      float *x = i ? &job->colour[3 * cell + (size_t)i - 1] : &job->s[cell];
      float moved = *x - (i ? job->colour_step : job->opacity_step) * move, top = i ? 1 : job->largest;
      *x = moved < 0 ? 0 : moved > top ? top : moved;
    }
  }
}

static vt_status run_epochs(vt_context *context, const vt_refine_desc *desc, const vt_rays *rays, refine_job *job,
                            adam_job *adam, int *chosen) {
  int views = rays->views->count, batches = desc->batch_count < views ? desc->batch_count : views, step = 0;
  double power_first = 1, power_second = 1;
  vt_status status = VT_OK;
  for (int epoch = 0; epoch < desc->epochs && !status; epoch++) {
    if (desc->deadline > 0 && vt_seconds() > desc->deadline) break;
    for (int batch = 0; batch < batches && !status; batch++, step++) {
      int count = 0, jump = batches > 4 && batches % 7 ? 7 : 1; // views that follow each other in the list are often neighbours
      for (int v = batch * jump % batches; v < views; v += batches) chosen[count++] = v;
      status = vt_sweep_rays(context, rays, chosen, count, visit, job);
      power_first *= 0.9;
      power_second *= 0.99;
      float decay = powf(desc->last_step_share, (float)step / (float)(batches * desc->epochs));
      adam->opacity_step = desc->opacity_step * decay;
      adam->colour_step = desc->colour_step * decay;
      adam->bias_first = (float)(1 / (1 - power_first));
      adam->bias_second = (float)(1 / (1 - power_second));
      if (!status) status = vt_parallel(context, job->cells, 4096, step_some, adam);
      vt_progress(context, "refinement", (step + 1.0) / (batches * desc->epochs));
    }
  }
  return status;
}

vt_status vt_refine(vt_context *context, const vt_refine_desc *desc, const vt_rays *rays, vt_level *cells) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->epochs >= 0 && desc->batch_count >= 1);
  size_t count = cells->cell_count, max = vt_max_segments(cells);
  if (!count || !desc->epochs) return VT_OK;
  refine_job job = {cells->optical_depth, cells->colour, count, VT_NEW(context, float, 4 * count * VT_LANES),
                    vt_alloc(context, VT_LANES * max, sizeof(float[4])), max};
  adam_job adam = {.s = cells->optical_depth, .colour = cells->colour, .lanes = job.sums, .cells = count,
                   .first = vt_alloc(context, count, sizeof(float[4])),
                   .second = vt_alloc(context, count, sizeof(float[4])), .largest = desc->largest};
  int *chosen = VT_NEW(context, int, (size_t)rays->views->count);
  vt_status status = VT_OUT_OF_MEMORY;
  if (job.sums && job.scratch && adam.first && adam.second && chosen)
    status = run_epochs(context, desc, rays, &job, &adam, chosen);
  vt_free(context, chosen);
  vt_free(context, adam.second);
  vt_free(context, adam.first);
  vt_free(context, job.scratch);
  vt_free(context, job.sums);
  return status;
}
