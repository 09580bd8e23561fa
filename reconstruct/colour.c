// colour.c - each cell's own colour
// SPDX-License-Identifier: BSD-3-Clause
//
// A ray shows C = sum_k w_k c_k, w_k = T_k (1 - exp(-s_k l_k)). A cell's colour is the mean of the photographs' colours F with
// weights a w_k: what it adds to each pixel. Method `best` goes on from there with the fit (fit.c), the papers' methods do not.

#include "reconstruct/colour.h"
#include "base/fast_exp.h"

typedef struct colour_job {
  const float *s;
  size_t cells;
  float *sums; // [VT_LANES][cells][4]: RGB and weight
} colour_job;

static void visit(void *user, const vt_swept_ray *ray) {
  colour_job *job = user;
  float a = (float)ray->pixel[3] / 255.0f, t = 1;
  if (a < 0.004f) return;
  float f[3] = {(float)ray->pixel[0] / 255.0f, (float)ray->pixel[1] / 255.0f, (float)ray->pixel[2] / 255.0f};
  float *sums = job->sums + 4 * job->cells * (size_t)ray->lane;
  for (size_t k = 0; k < ray->chord_count && t > 1e-4f; k++) {
    size_t cell = ray->chords[k].cell;
    float left = t * vt_exp_of_negative(-job->s[cell] * ray->chords[k].length), w = a * (t - left), *sum = sums + 4 * cell;
    for (int c = 0; c < 3; c++) sum[c] += w * f[c];
    sum[3] += w;
    t = left;
  }
}

vt_status vt_estimate_colour(vt_context *context, const vt_rays *rays, vt_level *cells) {
  colour_job job = {.s = cells->optical_depth, .cells = cells->cell_count};
  job.sums = VT_NEW(context, float, 4 * job.cells * VT_LANES);
  float *total = VT_NEW(context, float, 4 * job.cells);
  vt_status status = job.sums && total ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) status = vt_sweep_rays(context, rays, NULL, 0, visit, &job);
  if (!status) status = vt_add_lanes(context, job.sums, 4 * job.cells, total);
  for (size_t cell = 0; cell < job.cells && !status; cell++) {
    if (!(total[4 * cell + 3] > 1e-9f)) continue;
    for (size_t c = 0; c < 3; c++) {
      float v = total[4 * cell + c] / total[4 * cell + 3];
      cells->colour[3 * cell + c] = v < 0 ? 0 : v > 1 ? 1 : v;
    }
  }
  vt_free(context, total);
  vt_free(context, job.sums);
  return status;
}
