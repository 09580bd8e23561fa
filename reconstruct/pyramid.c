// pyramid.c - the photographs at the resolution of a level
// SPDX-License-Identifier: BSD-3-Clause
//
// A coarse cell covers many pixels, and a ray a pixel would waste both time and what the level can say: pictures are
// reduced by a box filter until a cell covers a few pixels. Alpha is averaged, not optical depth, since alpha is what
// the reduced ray would have seen.

#include "reconstruct/pyramid.h"

typedef struct reduce_job {
  vt_context *context;
  const vt_views *views;
  vt_reduced_views *out;
  vt_status *status;
} reduce_job;

static void reduce_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  reduce_job *job = user;
  for (size_t i = begin; i < end; i++) {
    const vt_view *view = &job->views->items[i];
    job->status[i] = vt_reduce_image(job->context, &view->picture, job->out->factor, &job->out->pictures[i]);
    if (!job->status[i] && view->ignored.pixels)
      job->status[i] = vt_pool_image(job->context, &view->ignored, job->out->factor, &job->out->ignored[i]);
  }
}

vt_status vt_reduce_views(vt_context *context, const vt_views *views, int factor, vt_reduced_views *out) {
  size_t count = (size_t)views->count;
  *out = (vt_reduced_views){.count = views->count, .factor = factor};
  out->cameras = VT_NEW(context, vt_camera, count);
  out->pictures = VT_NEW(context, vt_image, count);
  out->ignored = VT_NEW(context, vt_image, count);
  vt_status status = out->cameras && out->pictures && out->ignored ? VT_OK : VT_OUT_OF_MEMORY, *each = NULL;
  if (status) goto done;
  for (size_t i = 0; i < count; i++) {
    vt_camera camera = views->items[i].camera;
    camera.fx /= factor, camera.fy /= factor, camera.cx /= factor, camera.cy /= factor;
    camera.width = (camera.width + factor - 1) / factor;
    camera.height = (camera.height + factor - 1) / factor;
    out->cameras[i] = camera;
    if (factor > 1) continue;
    out->pictures[i] = views->items[i].picture;
    out->ignored[i] = views->items[i].ignored;
  }
  if (factor == 1) goto done;
  each = VT_NEW(context, vt_status, count);
  status = each ? vt_parallel(context, count, 1, reduce_some, &(reduce_job){context, views, out, each})
                : VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && !status; i++) status = each[i];
done:
  vt_free(context, each);
  if (status) vt_free_reduced_views(context, out);
  return status;
}

void vt_free_reduced_views(vt_context *context, vt_reduced_views *views) {
  for (int i = 0; i < views->count && views->factor > 1; i++) {
    if (views->pictures) vt_free_image(context, &views->pictures[i]);
    if (views->ignored) vt_free_image(context, &views->ignored[i]);
  }
  vt_free(context, views->ignored);
  vt_free(context, views->pictures);
  vt_free(context, views->cameras);
  *views = (vt_reduced_views){0};
}

static int compare_doubles(const void *a, const void *b) {
  double p = *(const double *)a, q = *(const double *)b;
  return p < q ? -1 : p > q;
}

vt_status vt_projected_size(vt_context *context, const vt_views *views, vt_vec3 point, double edge, double *pixels) {
  double *sizes = VT_NEW(context, double, (size_t)views->count);
  if (!sizes) return VT_OUT_OF_MEMORY;
  size_t count = 0;
  for (int i = 0; i < views->count; i++) {
    const vt_camera *camera = &views->items[i].camera;
    double depth = vt_to_camera(camera, point).z;
    if (depth > 0) sizes[count++] = 0.5 * (camera->fx + camera->fy) * edge / depth;
  }
  qsort(sizes, count, sizeof *sizes, compare_doubles);
  *pixels = count ? sizes[count / 2] : 0;
  vt_free(context, sizes);
  return VT_OK;
}
