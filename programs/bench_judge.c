// bench_judge.c - pictures of held-out views, however they were made, and how far they are from the photographs
// SPDX-License-Identifier: BSD-3-Clause
//
// A tree, a trivial predictor and a foreign program meet in one thing: 8-bit pictures of the held-out views. All are
// judged by this file alone, so that no method is measured more kindly than another. Foreign programs may know no
// transparency; then truth and result are compared over the background that they say, and opacity is not judged.
#include "programs/bench_judge.h"

#include "programs/stage_options.h"
#include "reconstruct/reconstruct.h"

#include <math.h>
#include <string.h>

#define HULL_LEVEL 6

vt_status vt_make_pictures(vt_context *context, int count, vt_pictures *out) {
  *out = (vt_pictures){.items = VT_NEW(context, vt_image, (size_t)count)};
  if (!out->items) return VT_OUT_OF_MEMORY;
  out->count = count;
  return VT_OK;
}

void vt_free_pictures(vt_context *context, vt_pictures *pictures) {
  for (int i = 0; i < pictures->count; i++) vt_free_image(context, &pictures->items[i]);
  vt_free(context, pictures->items);
  *pictures = (vt_pictures){0};
}

// ---- making them

// One pass of a separable Gaussian along the rows, the result transposed: two passes are the whole.
static void blur_rows(const vt_fimage *in, double sigma, vt_fimage *out) {
  int reach = (int)ceil(3 * sigma);
  for (int y = 0; y < in->height; y++)
    for (int x = 0; x < in->width; x++) {
      double sum[4] = {0}, weight = 0;
      for (int d = -reach; d <= reach; d++) {
        if (x + d < 0 || x + d >= in->width) continue;
        double w = exp(-0.5 * d * d / (sigma * sigma));
        const float *p = in->pixels + 4 * ((size_t)y * (size_t)in->width + (size_t)(x + d));
        for (int c = 0; c < 4; c++) sum[c] += w * (double)p[c];
        weight += w;
      }
      float *q = out->pixels + 4 * ((size_t)x * (size_t)out->width + (size_t)y);
      for (int c = 0; c < 4; c++) q[c] = (float)(sum[c] / weight);
    }
}

static vt_status blur_picture(vt_context *context, double sigma, vt_fimage *picture) {
  if (!(sigma > 0)) return VT_OK;
  vt_fimage turned = {0};
  vt_status status = vt_make_fimage(context, picture->height, picture->width, 4, &turned);
  if (status) return status;
  blur_rows(picture, sigma, &turned);
  blur_rows(&turned, sigma, picture);
  vt_free_fimage(context, &turned);
  return VT_OK;
}

vt_status vt_draw_pictures(vt_session *session, const vt_tree *tree, vt_blend blend, double blur,
                           const vt_views *judged, vt_pictures *out, double *seconds_per_frame) {
  vt_context *context = session->context;
  vt_renderer *renderer = NULL;
  vt_fimage picture = {0};
  vt_render_desc desc = vt_default_render_desc();
  desc.level = vt_finest_level(tree);
  desc.blend = blend;
  double seconds = 0;
  vt_status status = vt_make_pictures(context, judged->count, out);
  if (!status) status = vt_create_renderer(context, tree, VT_BACKEND_AUTO, &renderer);
  if (!status) status = vt_render(context, renderer, &desc, &judged->items[0].camera, &picture, NULL); // upload
  for (int i = 0; i < judged->count && !status; i++) {
    vt_free_fimage(context, &picture);
    double start = vt_seconds();
    status = vt_render(context, renderer, &desc, &judged->items[i].camera, &picture, NULL);
    seconds += (vt_seconds() - start) / judged->count;
    if (!status) status = blur_picture(context, blur, &picture);
    if (!status) status = vt_image_from_fimage(context, &picture, &out->items[i]);
    if (!status && vt_cancelled(context)) status = vt_fail(context, VT_CANCELLED, "interrupted: run it again");
  }
  if (renderer) vt_destroy_renderer(context, renderer);
  vt_free_fimage(context, &picture);
  if (status) vt_free_pictures(context, out);
  if (seconds_per_frame) *seconds_per_frame = seconds;
  return status;
}

vt_status vt_predict_pictures(vt_session *session, vt_predictor predictor, const vt_views *training,
                              const vt_views *judged, vt_vec3 centre, vt_pictures *out, vt_spread *seconds) {
  vt_context *context = session->context;
  vt_tree hull = {0};
  double times[3] = {NAN, NAN, NAN};
  vt_status status = VT_OK;
  for (int i = 0; i < 3 && predictor == VT_PREDICT_HULL && !status; i++) {
    double start = vt_seconds();
    vt_free_tree(context, &hull);
    status = vt_reconstruct_hull(context, training, HULL_LEVEL, &hull);
    times[i] = vt_seconds() - start;
  }
  *seconds = vt_spread_of(times, 3);
  if (!status) status = vt_make_pictures(context, judged->count, out);
  for (int i = 0; i < judged->count && !status; i++) {
    vt_fimage guess = {0};
    status = vt_predict_view(context, predictor, training, &judged->items[i], centre, &hull, &guess);
    if (!status) status = vt_image_from_fimage(context, &guess, &out->items[i]);
    vt_free_fimage(context, &guess);
  }
  vt_free_tree(context, &hull);
  if (status) vt_free_pictures(context, out);
  return status;
}

// ---- judging them

typedef struct metric {
  vt_bench_column column;
  size_t offset;
} metric;

// The noise of qualities: what another seed, or another order of a sum in a later version, may change without anyone
// caring.
#define METRIC(member) offsetof(vt_metrics, member)
static const metric metrics[] = {{{"PSNR", "dB", VT_MORE_BETTER, 0, 0.1}, METRIC(psnr)},
                                 {{"foreground PSNR", "dB", VT_MORE_BETTER, 0, 0.1}, METRIC(psnr_foreground)},
                                 {{"SSIM", "", VT_MORE_BETTER, 0, 0.003}, METRIC(ssim)},
                                 {{"delta E", "", VT_LESS_BETTER, 0.01, 0.1}, METRIC(delta_e)},
                                 {{"sharpness", "", VT_ONE_BETTER, 0, 0.02}, METRIC(sharpness)},
                                 {{"alpha RMSE", "", VT_LESS_BETTER, 0.01, 0.0005}, METRIC(alpha_rmse)}};
#define METRIC_COUNT ((int)(sizeof metrics / sizeof *metrics))

static double value_of(const vt_metrics *m, int i) {
  double value;
  memcpy(&value, (const char *)m + metrics[i].offset, sizeof value);
  return value;
}

static void set_value(vt_metrics *m, int i, double value) {
  memcpy((char *)m + metrics[i].offset, &value, sizeof value);
}

int vt_metric_columns(vt_bench_column out[VT_MAX_METRIC_COLUMNS]) {
  VT_ASSERT(METRIC_COUNT <= VT_MAX_METRIC_COLUMNS);
  for (int i = 0; i < METRIC_COUNT; i++) out[i] = metrics[i].column;
  return METRIC_COUNT;
}

void vt_put_metrics(vt_bench_table *table, const vt_metrics *repetitions, int count) {
  VT_ASSERT(count <= VT_MAX_REPETITIONS);
  for (int i = 0; i < METRIC_COUNT; i++) {
    double values[VT_MAX_REPETITIONS];
    for (int r = 0; r < count; r++) values[r] = value_of(&repetitions[r], i);
    if (count)
      vt_put_spread(table, vt_spread_of(values, count));
    else
      vt_put_value(table, NAN);
  }
}

// The picture as premultiplied RGBA, opaque where it has no alpha.
static vt_status as_result(vt_context *context, const vt_image *picture, vt_fimage *out) {
  if (picture->channels == 4) return vt_fimage_from_image(context, picture, out);
  vt_status status = vt_make_fimage(context, picture->width, picture->height, 4, out);
  size_t pixels = (size_t)picture->width * (size_t)picture->height, channels = (size_t)picture->channels;
  for (size_t i = 0; i < pixels && !status; i++) {
    for (size_t c = 0; c < 3; c++)
      out->pixels[4 * i + c] = (float)picture->pixels[channels * i + (channels < 3 ? 0 : c)] / 255;
    out->pixels[4 * i + 3] = 1;
  }
  return status;
}

vt_status vt_judge_pictures(vt_context *context, const vt_pictures *pictures, const vt_views *judged,
                            const float background[3], vt_metrics *out) {
  VT_ASSERT(pictures->count == judged->count);
  double sum[METRIC_COUNT] = {0};
  int with[METRIC_COUNT] = {0};
  vt_status status = VT_OK;
  for (int i = 0; i < judged->count && !status; i++) {
    const vt_image *picture = &pictures->items[i];
    vt_fimage result = {0};
    vt_metrics one;
    if (!picture->pixels) continue;
    status = as_result(context, picture, &result);
    if (!status) status = vt_measure(context, &result, &judged->items[i].picture, background, &one);
    if (!status && picture->channels != 4) one.alpha_rmse = NAN;
    for (int m = 0; m < METRIC_COUNT && !status; m++)
      if (!isnan(value_of(&one, m))) sum[m] += value_of(&one, m), with[m]++;
    vt_free_fimage(context, &result);
  }
  memset(out, 0, sizeof *out);
  for (int m = 0; m < METRIC_COUNT; m++) set_value(out, m, with[m] ? sum[m] / with[m] : NAN);
  return status;
}
