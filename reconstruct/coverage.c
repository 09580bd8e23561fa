// coverage.c - how well the photographs determine each cell
// SPDX-License-Identifier: BSD-3-Clause
//
// Tomography from a narrow range of directions cannot tell depth: what it puts into a cell may as well stand before or
// behind it. So each cell keeps which of 64 bundles of directions have a ray that says something about it, one bit each, and the
// widest angle between two of its bundles is its coverage. Up to 64 photographs are a bundle each; more share the one whose
// first photograph is nearest. Lines are the same from both ends: 90 degrees is the most.

#include "reconstruct/coverage.h"
#include "base/fast_exp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BUNDLES = 64 };

typedef struct coverage_job {
  const float *s;
  size_t cells;
  const uint8_t *bundle_of; // [views]
  uint64_t *seen;           // [VT_LANES][cells]
} coverage_job;

static void visit(void *user, const vt_swept_ray *ray) {
  coverage_job *job = user;
  float tau = 0;
  for (size_t k = 0; k < ray->chord_count; k++) tau += ray->chords[k].length * job->s[ray->chords[k].cell];
  if (ray->pixel[3] > 252 && vt_exp_of_negative(-tau) < 0.01f) return;
  uint64_t bit = 1ull << job->bundle_of[ray->view], *seen = job->seen + job->cells * (size_t)ray->lane;
  for (size_t k = 0; k < ray->chord_count; k++) seen[ray->chords[k].cell] |= bit;
}

// Directions of the bundles, and which one each view belongs to.
static int bundle_views(const vt_octree *octree, const vt_reduced_views *views, vt_vec3 *bundles, uint8_t *bundle_of) {
  vt_vec3 middle = vt_add(octree->origin, vt_v3(octree->edge / 2, octree->edge / 2, octree->edge / 2));
  int count = 0, step = (views->count + BUNDLES - 1) / BUNDLES;
  for (int v = 0; v < views->count; v += step)
    bundles[count++] = vt_normalise(vt_sub(vt_camera_centre(&views->cameras[v]), middle));
  for (int v = 0; v < views->count; v++) {
    vt_vec3 direction = vt_normalise(vt_sub(vt_camera_centre(&views->cameras[v]), middle));
    double most = -1;
    for (int b = 0; b < count; b++) {
      double cosine = fabs(vt_dot(direction, bundles[b]));
      if (cosine > most) most = cosine, bundle_of[v] = (uint8_t)b;
    }
  }
  return count;
}

static float widest_angle(uint64_t seen, float (*angle)[BUNDLES]) {
  float widest = 0;
  for (uint64_t left = seen; left && widest < 89; left &= left - 1) {
    const float *row = angle[__builtin_ctzll(left)];
    for (uint64_t other = left & (left - 1); other; other &= other - 1) widest = fmaxf(widest, row[__builtin_ctzll(other)]);
  }
  return widest;
}

static int compare_floats(const void *a, const void *b) {
  float p = *(const float *)a, q = *(const float *)b;
  return (p > q) - (p < q);
}

static void sum_up(float *degrees, size_t cells, vt_coverage *out) {
  size_t narrow = 0, known = 0;
  for (size_t i = 0; i < cells; i++) {
    if (degrees[i] < 0) continue;
    narrow += degrees[i] < 30;
    degrees[known++] = degrees[i];
  }
  *out = (vt_coverage){.unconstrained = (uint32_t)(cells - known)};
  if (!known) return;
  qsort(degrees, known, sizeof *degrees, compare_floats);
  out->median_degrees = (double)degrees[known / 2];
  out->narrow_share = (double)narrow / (double)known;
}

vt_status vt_measure_coverage(vt_context *context, const vt_rays *rays, const vt_level *cells, float *degrees_or_null,
                              vt_coverage *out) {
  vt_vec3 bundles[BUNDLES];
  float angle[BUNDLES][BUNDLES];
  size_t count = cells->cell_count;
  coverage_job job = {.s = cells->optical_depth, .cells = count};
  job.seen = VT_NEW(context, uint64_t, count * VT_LANES);
  float *degrees = VT_NEW(context, float, count);
  uint8_t *bundle_of = VT_NEW(context, uint8_t, (size_t)rays->views->count);
  vt_status status = job.seen && degrees && bundle_of ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) {
    int bundle_count = bundle_views(rays->octree, rays->views, bundles, bundle_of);
    for (int a = 0; a < bundle_count; a++)
      for (int b = 0; b < bundle_count; b++)
        angle[a][b] = (float)(acos(fmin(fabs(vt_dot(bundles[a], bundles[b])), 1)) * 180 / VT_PI);
    job.bundle_of = bundle_of;
    status = vt_sweep_rays(context, rays, NULL, 0, visit, &job);
  }
  for (size_t i = 0; i < count && !status; i++) {
    uint64_t seen = 0;
    for (size_t lane = 0; lane < VT_LANES; lane++) seen |= job.seen[lane * count + i];
    degrees[i] = seen ? widest_angle(seen, angle) : -1;
  }
  if (!status && degrees_or_null) memcpy(degrees_or_null, degrees, count * sizeof *degrees);
  if (!status) sum_up(degrees, count, out);
  vt_free(context, bundle_of);
  vt_free(context, degrees);
  vt_free(context, job.seen);
  return status;
}
