// view_textures.c - each photograph's matte against the field's, as a texture in the photograph's own plane
// SPDX-License-Identifier: BSD-3-Clause
//
// A pixel's matte says how deep the cells on its ray are together, the field says how deep they are by themselves; the
// factor between, R = -ln(1 - a) / tau, holds what is finer than a cell: the edges of leaves, and gaps (DESIGN 5; METHODS 9
// "matte-consistent ratio", 10). At the photograph's own camera the tree then shows the photograph's matte.
// Where the matte is saturated it only says "at least this much", and so does a dense field: both are cut at the same depth, and
// where the matte begins to saturate, a growing part of the field's excess is.
// What is kept of a picture is the rectangle of pixels that are not empty and a rim of empty ones around them.

#include "reconstruct/view_textures.h"

#include <string.h>

#define LEAST_LEFT 0.007f // transmittance below which a matte says no more
#define SATURATING 3.0f   // optical depth from which on it begins to say less
#define LEAST_DEPTH 0.003f

typedef struct texture_job {
  vt_context *context;
  const vt_rays *rays;
  float ratio_limit;
  uint8_t **codes;          // [views] whole pictures
  float *along, *log_ratio; // [VT_LANES][capacity]
  float (*inside)[4], (*value)[4];
  size_t capacity;
  vt_view_textures *out;
  vt_status *status; // [views]
} texture_job;

static uint8_t code_of(float alpha, float tau, float limit) {
  if (alpha < 0.004f) return 0;
  float log_ratio = 0;
  if (tau >= 1e-6f) {
    float most = -logf(LEAST_LEFT), wanted = fminf(-logf(fmaxf(1 - alpha, 1e-6f)), most);
    float shown = logf(fmaxf(LEAST_DEPTH, tau)), cut = fminf(shown, logf(most));
    float saturated = fmaxf(0, (wanted - SATURATING) / (most - SATURATING));
    log_ratio = fminf(logf(wanted) - shown - saturated * (cut - shown), logf(limit));
  }
  float code = (log_ratio - VT_LEAST_LOG_RATIO) / VT_LOG_RATIO_STEP + 0.5f;
  return code < 0 ? 0 : code > 255 ? 255 : (uint8_t)code;
}

static void visit(void *user, const vt_swept_ray *ray) {
  texture_job *job = user;
  size_t first = job->capacity * (size_t)ray->lane;
  vt_field_samples samples = {job->along + first, job->inside + first, job->value + first, job->log_ratio + first};
  vt_ray world = vt_camera_ray(&job->rays->views->cameras[ray->view], ray->x + 0.5, ray->y + 0.5);
  vt_sample_field(job->rays->octree, job->rays->level, &world, ray->chords, ray->chord_count, &samples);
  float tau = 0;
  for (size_t k = 0; k < ray->chord_count; k++) tau += samples.value[k][0] * ray->chords[k].length;
  size_t width = (size_t)job->rays->views->pictures[ray->view].width;
  job->codes[ray->view][(size_t)ray->y * width + (size_t)ray->x] = code_of((float)ray->pixel[3] / 255.0f, tau, job->ratio_limit);
}

// Where no cell stands there is nothing to thicken: R = 1, or nothing where the matte is empty. Where the photograph says
// nothing the field stands as it is.
static void fill_without_cells(const vt_image *picture, const uint8_t *ignored, uint8_t *codes) {
  for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; i++)
    codes[i] = code_of(ignored && ignored[i] ? 1 : (float)picture->pixels[4 * i + 3] / 255.0f, 0, 1);
}

static vt_status cut_texture(vt_context *context, const vt_image *picture, const uint8_t *codes, vt_view_texture *out) {
  int w = picture->width, h = picture->height, left = w, right = -1, top = h, bottom = -1;
  for (int y = 0; y < h; y++)
    for (int x = 0; x < w; x++) {
      if (!codes[(size_t)y * (size_t)w + (size_t)x]) continue;
      left = x < left ? x : left, right = x > right ? x : right;
      top = y < top ? y : top, bottom = y > bottom ? y : bottom;
    }
  if (right < 0) left = right = top = bottom = 0; // one empty pixel
  left -= left > 0, top -= top > 0, right += right < w - 1, bottom += bottom < h - 1;
  *out = (vt_view_texture){w, h, left, top, right - left + 1, bottom - top + 1, NULL, false};
  out->codes = VT_NEW(context, uint8_t, (size_t)out->columns * (size_t)out->rows);
  if (!out->codes) return VT_OUT_OF_MEMORY;
  for (int y = 0; y < out->rows; y++)
    memcpy(out->codes + (size_t)y * (size_t)out->columns, codes + (size_t)(y + top) * (size_t)w + (size_t)left,
           (size_t)out->columns);
  return VT_OK;
}

static vt_status begin_job(texture_job *job, const vt_rays *rays, vt_view_textures *out) {
  vt_context *context = job->context;
  size_t views = (size_t)rays->views->count, samples = job->capacity * VT_LANES;
  job->codes = VT_NEW(context, uint8_t *, views);
  job->along = VT_NEW(context, float, samples);
  job->log_ratio = VT_NEW(context, float, samples);
  job->inside = vt_alloc(context, samples, sizeof(float[4]));
  job->value = vt_alloc(context, samples, sizeof(float[4]));
  out->views = VT_NEW(context, vt_view_texture, views);
  if (!job->codes || !job->along || !job->log_ratio || !job->inside || !job->value || !out->views) return VT_OUT_OF_MEMORY;
  for (size_t v = 0; v < views; v++) {
    const vt_image *picture = &rays->views->pictures[v];
    job->codes[v] = VT_NEW(context, uint8_t, (size_t)picture->width * (size_t)picture->height);
    if (!job->codes[v]) return VT_OUT_OF_MEMORY;
    fill_without_cells(picture, rays->views->ignored[v].pixels, job->codes[v]);
  }
  return VT_OK;
}

vt_status vt_make_view_textures(vt_context *context, const vt_rays *rays, float ratio_limit, bool linear,
                                vt_view_textures *out) {
  VT_ASSERT(ratio_limit >= 1);
  *out = (vt_view_textures){.view_count = rays->views->count, .factor = rays->views->factor};
  texture_job job = {.context = context, .rays = rays, .ratio_limit = ratio_limit, .out = out};
  job.capacity = vt_max_segments(&rays->octree->levels[rays->level]);
  vt_status status = begin_job(&job, rays, out);
  if (!status) status = vt_sweep_rays(context, rays, NULL, 0, visit, &job);
  for (int v = 0; v < rays->views->count && !status; v++)
    status = cut_texture(context, &rays->views->pictures[v], job.codes[v], &out->views[v]);
  for (int v = 0; v < rays->views->count && !status; v++) out->views[v].linear = linear;
  for (int v = 0; v < rays->views->count && job.codes; v++) vt_free(context, job.codes[v]);
  vt_free(context, job.codes);
  vt_free(context, job.along);
  vt_free(context, job.log_ratio);
  vt_free(context, job.inside);
  vt_free(context, job.value);
  if (status) {
    if (!out->views) out->view_count = 0;
    vt_free_view_textures(context, out);
  }
  return status;
}
