// thinness.c - how much of the tree is thinner than a few pixels
// SPDX-License-Identifier: BSD-3-Clause
//
// A stem a pixel wide stands in cells of two pixels or more. Its own photographs show it whole, for their textures R draw it
// into those cells as finely as they saw it. Between photographs several R meet in the middle of a chord, each between the
// centres of its pixels, and there ln R is interpolated: from a line to the emptiness beside it the geometric mean is nearer
// to nothing, and the stem grows pale (virtual-plant, cells of 2 pixels: 76 % of its alpha are left, 94 % if R itself is
// interpolated). In a crown that would be wrong: where rays are deep, the mean of R shows too much of it (small oak loses half
// a decibel). So a tree that is thin as a whole has its R interpolated, and takes smaller cells, which hold more of a stem by
// themselves and are few where little is thick; other trees are left as they are.
//
//   share = 1 - sum_p opening(a)_p / sum_p a_p
//
// with the grey opening by a square of VT_THIN_WIDTH pixels [Serra 1982], the maximum around p of the minima around its
// neighbours: what is too thin for the square to enter is gone. Beyond the frame, and where a picture is ignored, anything may
// be, and it counts as tree.

#include "reconstruct/thinness.h"

#include <string.h>

#define MOST_VIEWS 16
#define REACH (VT_THIN_WIDTH / 2)

typedef struct thinness_job {
  const vt_views *views;
  int stride;
  size_t capacity;           // of a plane, pixels
  uint8_t *planes;           // [threads][2][capacity]
  uint64_t (*sums)[2];       // [views looked at] of alpha, of its opening
} thinness_job;

static inline void take_extremes(uint8_t *restrict to, const uint8_t *restrict from, size_t count, bool most) {
  if (most)
    for (size_t i = 0; i < count; i++) to[i] = to[i] > from[i] ? to[i] : from[i];
  else
    for (size_t i = 0; i < count; i++) to[i] = to[i] < from[i] ? to[i] : from[i];
}

// Least or most of the pixels up to REACH away along rows, then along columns, of those within the frame.
static void sweep_square(uint8_t *plane, uint8_t *spare, size_t width, size_t height, bool most) {
  memcpy(spare, plane, width * height);
  for (size_t y = 0; y < height; y++)
    for (size_t d = 1; d <= REACH && d < width; d++) {
      take_extremes(spare + y * width, plane + y * width + d, width - d, most);
      take_extremes(spare + y * width + d, plane + y * width, width - d, most);
    }
  memcpy(plane, spare, width * height);
  for (size_t d = 1; d <= REACH && d < height; d++) {
    take_extremes(plane, spare + d * width, (height - d) * width, most);
    take_extremes(plane + d * width, spare, (height - d) * width, most);
  }
}

static void open_views(void *user, size_t begin, size_t end, int worker) {
  thinness_job *job = user;
  uint8_t *plane = job->planes + 2 * job->capacity * (size_t)worker, *spare = plane + job->capacity;
  for (size_t i = begin; i < end; i++) {
    const vt_view *view = &job->views->items[i * (size_t)job->stride];
    const vt_image *picture = &view->picture;
    const uint8_t *ignored = view->ignored.pixels;
    size_t count = (size_t)picture->width * (size_t)picture->height;
    for (size_t p = 0; p < count; p++) plane[p] = ignored && ignored[p] ? 255 : picture->pixels[4 * p + 3];
    for (int most = 0; most < 2; most++) sweep_square(plane, spare, (size_t)picture->width, (size_t)picture->height, most);
    for (size_t p = 0; p < count; p++) {
      if (ignored && ignored[p]) continue;
      job->sums[i][0] += picture->pixels[4 * p + 3];
      job->sums[i][1] += plane[p];
    }
  }
}

vt_status vt_measure_thinness(vt_context *context, const vt_views *views, double *share) {
  thinness_job job = {.views = views, .stride = (views->count + MOST_VIEWS - 1) / MOST_VIEWS};
  *share = 0;
  if (views->count < 1) return VT_OK;
  size_t looked_at = (size_t)((views->count + job.stride - 1) / job.stride);
  for (int i = 0; i < views->count; i += job.stride) {
    size_t pixels = (size_t)views->items[i].picture.width * (size_t)views->items[i].picture.height;
    job.capacity = pixels > job.capacity ? pixels : job.capacity;
  }
  job.planes = VT_NEW(context, uint8_t, 2 * job.capacity * (size_t)vt_thread_count(context));
  job.sums = vt_alloc(context, looked_at, sizeof *job.sums);
  vt_status status = job.planes && job.sums ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) status = vt_parallel(context, looked_at, 1, open_views, &job);
  uint64_t all = 0, thick = 0;
  for (size_t i = 0; i < looked_at && !status; i++) all += job.sums[i][0], thick += job.sums[i][1];
  if (all) *share = 1 - (double)thick / (double)all;
  vt_free(context, job.sums);
  vt_free(context, job.planes);
  return status;
}
