// total_variation.c - Huber total variation over the faces between the cells of a level
// SPDX-License-Identifier: BSD-3-Clause
//
// R(s) = lambda sum_{i ~ j} (sqrt((s_i - s_j)^2 + delta^2) - delta): a smooth stand-in for lambda |s_i - s_j| that lets edges
// stand [Rudin, Osher, Fatemi 1992]. Only faces between two cells count: beyond the hull there is nothing to agree with, and
// pulling the crown's skin towards zero would thin it. Each face acts on both of its cells, so a cell's own part is
// the sum over its faces, without any order of writing. Majoriser: with w = lambda / sqrt(d^2 + delta^2), both cells moving, the
// curvature of a face is at most 2 w on its diagonal.

#include "reconstruct/total_variation.h"

#include <math.h>

typedef struct neighbour_job {
  const vt_level *level;
  int branching;
  uint32_t (*out)[6];
} neighbour_job;

static void find_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  neighbour_job *job = user;
  for (size_t i = begin; i < end; i++) vt_face_neighbours(job->level, job->branching, (uint32_t)i, job->out[i]);
}

vt_status vt_begin_variation(vt_context *context, const vt_level *level, int branching, float weight, float width,
                             vt_variation *out) {
  VT_ASSERT(weight >= 0 && width > 0);
  *out = (vt_variation){.cells = level->cell_count, .weight = weight, .width = width};
  out->neighbours = vt_alloc(context, out->cells, sizeof *out->neighbours);
  if (!out->neighbours) return VT_OUT_OF_MEMORY;
  return vt_parallel(context, out->cells, 4096, find_some, &(neighbour_job){level, branching, out->neighbours});
}

void vt_end_variation(vt_context *context, vt_variation *variation) {
  vt_free(context, variation->neighbours);
  *variation = (vt_variation){0};
}

typedef struct pull_job {
  const vt_variation *variation;
  const float *s;
  float weight, *total;
  int stride;
} pull_job;

static void pull_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  pull_job *job = user;
  float square = job->variation->width * job->variation->width;
  for (size_t i = begin; i < end; i++) {
    float pull = 0, curvature = 0;
    for (int k = 0; k < 6; k++) {
      uint32_t j = job->variation->neighbours[i][k];
      if (j == VT_NO_CELL) continue;
      float d = job->s[j] - job->s[i], w = 1 / sqrtf(d * d + square);
      pull += w * d;
      curvature += 2 * w;
    }
    float *total = job->total + (size_t)job->stride * i;
    total[0] += job->weight * pull;
    if (job->stride == 2) total[1] += job->weight * curvature;
  }
}

vt_status vt_pull_by_variation(vt_context *context, const vt_variation *variation, const float *s, float share, int stride,
                               float *total) {
  pull_job job = {variation, s, share * variation->weight, total, stride};
  return vt_parallel(context, variation->cells, 4096, pull_some, &job);
}

double vt_variation_of(const vt_variation *variation, const float *s) {
  double sum = 0, width = (double)variation->width;
  for (size_t i = 0; i < variation->cells; i++)
    for (int k = 1; k < 6; k += 2) { // +x, +y, +z: each face once
      uint32_t j = variation->neighbours[i][k];
      if (j == VT_NO_CELL) continue;
      double d = (double)s[j] - (double)s[i];
      sum += sqrt(d * d + width * width) - width;
    }
  return (double)variation->weight * sum;
}
