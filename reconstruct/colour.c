// colour.c - each cell's own colour
// SPDX-License-Identifier: BSD-3-Clause
//
// A ray shows C = sum_k w_k c_k, w_k = T_k (1 - exp(-s_k l_k)): linear in the colours once opacity is known. Start: the
// mean of the photographs' colours F with weights a w_k. Then simultaneous algebraic steps on C - A F (A = sum_k w_k, so
// that an error of opacity does not become an error of colour):
//   c_k += [sum_r a w_rk (A_r F_r - C_r)] / [sum_r a w_rk A_r].

#include "reconstruct/colour.h"
#include "base/fast_exp.h"

typedef struct colour_job {
  const float *s, *colour;
  size_t cells;
  bool mean;   // the first sweep
  float *sums; // [VT_LANES][cells][4]: RGB and weight
} colour_job;

static void visit(void *user, const vt_swept_ray *ray) {
  colour_job *job = user;
  float a = (float)ray->pixel[3] / 255.0f;
  if (a < 0.004f) return;
  float f[3] = {(float)ray->pixel[0] / 255.0f, (float)ray->pixel[1] / 255.0f, (float)ray->pixel[2] / 255.0f};
  float shown[3] = {0, 0, 0}, alpha = 0, t = 1;
  for (size_t k = 0; k < ray->chord_count && t > 1e-4f && !job->mean; k++) {
    size_t cell = ray->chords[k].cell;
    float left = t * vt_exp_of_negative(-job->s[cell] * ray->chords[k].length), w = t - left;
    for (int c = 0; c < 3; c++) shown[c] += w * job->colour[3 * cell + (size_t)c];
    alpha += w;
    t = left;
  }
  float target[3], norm = job->mean ? 1 : alpha;
  for (int c = 0; c < 3; c++) target[c] = job->mean ? f[c] : alpha * f[c] - shown[c];
  float *sums = job->sums + 4 * job->cells * (size_t)ray->lane;
  t = 1;
  for (size_t k = 0; k < ray->chord_count && t > 1e-4f; k++) {
    size_t cell = ray->chords[k].cell;
    float left = t * vt_exp_of_negative(-job->s[cell] * ray->chords[k].length), w = a * (t - left), *sum = sums + 4 * cell;
    for (int c = 0; c < 3; c++) sum[c] += w * target[c];
    sum[3] += w * norm;
    t = left;
  }
}

vt_status vt_estimate_colour(vt_context *context, const vt_rays *rays, vt_level *cells, int iterations) {
  colour_job job = {.s = cells->optical_depth, .colour = cells->colour, .cells = cells->cell_count};
  job.sums = VT_NEW(context, float, 4 * job.cells * VT_LANES);
  float *total = VT_NEW(context, float, 4 * job.cells);
  vt_status status = job.sums && total ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i <= iterations && !status; i++) {
    job.mean = i == 0;
    status = vt_sweep_rays(context, rays, NULL, 0, visit, &job);
    if (!status) status = vt_add_lanes(context, job.sums, 4 * job.cells, total);
    for (size_t cell = 0; cell < job.cells && !status; cell++) {
      if (!(total[4 * cell + 3] > 1e-9f)) continue;
      for (size_t c = 0; c < 3; c++) {
        float step = total[4 * cell + c] / total[4 * cell + 3];
        float v = job.mean ? step : cells->colour[3 * cell + c] + step;
        cells->colour[3 * cell + c] = v < 0 ? 0 : v > 1 ? 1 : v;
      }
    }
  }
  vt_free(context, total);
  vt_free(context, job.sums);
  return status;
}
