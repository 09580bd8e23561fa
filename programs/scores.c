// scores.c - metrics of a tree on photographs, and of the trivial predictors on the same ones
// SPDX-License-Identifier: BSD-3-Clause
//
// A number alone says little: white paper reaches 15 dB on a slender tree. So each table shows what three predictors
// without any method reach on the same photographs in the same run. The first frame of a renderer is drawn twice and
// only timed the second time, since it carries the upload.
#include "programs/scores.h"

#include "programs/contact_sheet.h"
#include "programs/report.h"
#include "reconstruct/reconstruct.h"

#include <string.h>

#define HULL_LEVEL 6

void vt_free_scores(vt_context *context, vt_scores *scores) {
  vt_free(context, scores->of_view);
  vt_free(context, scores->outlines);
  *scores = (vt_scores){0};
}

typedef struct defined_mean { // over the views where there is a number
  double sum;
  int count;
} defined_mean;

static void add_defined(defined_mean *mean, double value) {
  if (!isnan(value)) mean->sum += value, mean->count++;
}

static double take_mean(const defined_mean *mean) {
  return mean->count ? mean->sum / mean->count : (double)NAN;
}

static vt_metrics mean_metrics(const vt_metrics *metrics, int count) {
  vt_metrics mean = {0};
  defined_mean foreground = {0}, delta_e = {0}, sharpness = {0};
  for (int i = 0; i < count; i++) {
    mean.psnr += metrics[i].psnr / count;
    mean.ssim += metrics[i].ssim / count;
    mean.alpha_rmse += metrics[i].alpha_rmse / count;
    add_defined(&foreground, metrics[i].psnr_foreground);
    add_defined(&delta_e, metrics[i].delta_e);
    add_defined(&sharpness, metrics[i].sharpness);
  }
  mean.psnr_foreground = take_mean(&foreground);
  mean.delta_e = take_mean(&delta_e), mean.sharpness = take_mean(&sharpness);
  return mean;
}

static void mean_outline(vt_scores *scores) {
  defined_mean inside = {0}, near = {0}, reach = {0};
  scores->least_reach = (double)NAN;
  for (int i = 0; i < scores->count; i++) {
    const vt_outline *o = &scores->outlines[i];
    add_defined(&inside, o->psnr_inside), add_defined(&near, o->near), add_defined(&reach, o->reach);
    scores->least_reach = fmin(scores->least_reach, o->reach); // NAN only where both are
  }
  scores->outline =
      (vt_outline){.psnr_inside = take_mean(&inside), .near = take_mean(&near), .reach = take_mean(&reach)};
}

// ---- the tree

static vt_status write_pair(vt_session *session, const vt_view *view, const vt_fimage *result,
                            const float background[3], const char *folder, double psnr, vt_sheet *sheet) {
  vt_context *context = session->context;
  char plain[200], label[32];
  vt_fimage truth = {0};
  vt_plain_name(view->name, plain, sizeof plain);
  char *path = vt_print_text(context, "%s/%s_truth_result.%s", folder, plain, vt_picture_ending());
  vt_status status = path ? vt_fimage_from_image(context, &view->picture, &truth) : VT_OUT_OF_MEMORY;
  const vt_fimage *pair[] = {&truth, result};
  if (!status) status = vt_write_row(context, pair, 2, background, path);
  snprintf(label, sizeof label, "%.2f", psnr);
  if (!status) status = vt_put_on_sheet(context, sheet, &truth, "");
  if (!status) status = vt_put_on_sheet(context, sheet, result, label);
  vt_free_fimage(context, &truth);
  vt_free(context, path);
  return status;
}

// Nothing is judged where the photograph says nothing: there both are empty.
static void hide_ignored(const vt_view *view, vt_fimage *shown) {
  if (!view->ignored.pixels) return;
  size_t channels = (size_t)shown->channels;
  for (size_t i = 0; i < (size_t)shown->width * (size_t)shown->height; i++)
    for (size_t c = 0; c < channels && view->ignored.pixels[i]; c++) shown->pixels[channels * i + c] = 0;
}

static vt_status score_views(vt_session *session, vt_renderer *renderer, const vt_render_desc *desc,
                             const float background[3], const vt_views *judged, const char *pictures, vt_sheet *sheet,
                             vt_scores *out) {
  vt_context *context = session->context;
  vt_render_report report;
  vt_fimage result = {0};
  vt_status status = vt_render(context, renderer, desc, &judged->items[0].camera, &result, &report); // upload
  for (int i = 0; i < judged->count && !status; i++) {
    const vt_view *view = &judged->items[i];
    vt_free_fimage(context, &result);
    double start = vt_seconds();
    status = vt_render(context, renderer, desc, &view->camera, &result, &report);
    out->seconds_per_frame += (vt_seconds() - start) / judged->count;
    if (!status) hide_ignored(view, &result);
    if (!status) status = vt_measure(context, &result, &view->picture, background, &out->of_view[i]);
    if (!status) status = vt_measure_outline(context, &result, &view->picture, background, &out->outlines[i]);
    if (!status && pictures)
      status = write_pair(session, view, &result, background, pictures, out->of_view[i].psnr, sheet);
    if (!status && vt_cancelled(context))
      status = vt_fail(context, VT_CANCELLED, "interrupted: nothing was written; run it again");
    vt_progress(context, "judging", (i + 1.0) / judged->count);
  }
  vt_free_fimage(context, &result);
  return status;
}

vt_status vt_score_tree(vt_session *session, const vt_tree *tree, const vt_render_desc *desc, vt_backend backend,
                        const float background[3], const vt_views *judged, const char *pictures, vt_scores *out) {
  VT_ASSERT(desc->level >= 0 && judged->count > 0);
  vt_context *context = session->context;
  vt_renderer *renderer = NULL;
  vt_sheet sheet = {0};
  *out = (vt_scores){.count = judged->count, .level = desc->level};
  out->of_view = VT_NEW(context, vt_metrics, (size_t)judged->count);
  out->outlines = VT_NEW(context, vt_outline, (size_t)judged->count);
  vt_status status =
      out->of_view && out->outlines ? vt_create_renderer(context, tree, backend, &renderer) : VT_OUT_OF_MEMORY;
  if (!status && pictures) status = vt_begin_sheet(context, 2 * judged->count, 8, 200, 200, background, &sheet);
  if (!status) {
    snprintf(out->renderer, sizeof out->renderer, "%s", vt_renderer_name(renderer));
    status = score_views(session, renderer, desc, background, judged, pictures, &sheet, out);
  }
  if (!status && pictures) {
    char *path = vt_print_text(context, "%s/contact_sheet.%s", pictures, vt_picture_ending());
    status = path ? vt_write_sheet(context, &sheet, path) : VT_OUT_OF_MEMORY;
    vt_free(context, path);
  }
  if (!status) out->mean = mean_metrics(out->of_view, out->count), mean_outline(out);
  if (renderer) vt_destroy_renderer(context, renderer);
  vt_free_sheet(context, &sheet);
  if (status) vt_free_scores(context, out);
  return status;
}

// ---- predictors

vt_vec3 vt_tree_centre(const vt_tree *tree) {
  double half = tree->octree.edge / 2;
  return vt_add(tree->octree.origin, vt_v3(half, half, half));
}

static int find_nearest(const vt_views *training, const vt_view *view, vt_vec3 centre) {
  vt_vec3 direction = vt_normalise(vt_sub(vt_camera_centre(&view->camera), centre));
  int best = -1;
  double best_cosine = -2;
  for (int i = 0; i < training->count; i++) {
    if (!strcmp(training->items[i].name, view->name)) continue;
    double cosine = vt_dot(direction, vt_normalise(vt_sub(vt_camera_centre(&training->items[i].camera), centre)));
    if (cosine > best_cosine) best_cosine = cosine, best = i;
  }
  return best;
}

vt_status vt_predict_view(vt_context *context, vt_predictor predictor, const vt_views *training, const vt_view *view,
                          vt_vec3 centre, const vt_tree *hull, vt_fimage *out) {
  int width = view->camera.width, height = view->camera.height;
  if (predictor == VT_PREDICT_HULL)
    return vt_composite(context, hull, hull->octree.level_count - 1, NULL, VT_BLEND_SUM, true, &view->camera, out);
  int nearest = predictor == VT_PREDICT_NEAREST ? find_nearest(training, view, centre) : -1;
  if (nearest < 0) return vt_make_fimage(context, width, height, 4, out);
  vt_fimage photograph = {0};
  vt_status status = vt_fimage_from_image(context, &training->items[nearest].picture, &photograph);
  if (!status && (photograph.width != width || photograph.height != height)) {
    status = vt_resample_fimage(context, &photograph, width, height, out);
    vt_free_fimage(context, &photograph);
    return status;
  }
  *out = photograph;
  return status;
}

vt_status vt_score_predictors(vt_session *session, const vt_views *training, const vt_views *judged, vt_vec3 centre,
                              const float background[3], vt_metrics out[VT_PREDICTOR_COUNT]) {
  vt_context *context = session->context;
  vt_tree hull = {0};
  vt_metrics *metrics = VT_NEW(context, vt_metrics, (size_t)judged->count);
  vt_status status = metrics ? vt_reconstruct_hull(context, training, HULL_LEVEL, &hull) : VT_OUT_OF_MEMORY;
  for (int p = 0; p < VT_PREDICTOR_COUNT && !status; p++) {
    for (int i = 0; i < judged->count && !status; i++) {
      vt_fimage guess = {0};
      status = vt_predict_view(context, (vt_predictor)p, training, &judged->items[i], centre, &hull, &guess);
      if (!status) hide_ignored(&judged->items[i], &guess);
      if (!status) status = vt_measure(context, &guess, &judged->items[i].picture, background, &metrics[i]);
      vt_free_fimage(context, &guess);
    }
    out[p] = mean_metrics(metrics, judged->count);
  }
  vt_free(context, metrics);
  vt_free_tree(context, &hull);
  return status;
}

// ---- showing them

const char *vt_predictor_name(vt_predictor predictor) {
  return predictor == VT_PREDICT_WHITE ? "white" : predictor == VT_PREDICT_NEAREST ? "nearest_photograph" : "hull";
}

static void put_column(vt_json_writer *json, const vt_scores *scores, const char *key, const void *first, size_t size,
                       size_t offset) {
  vt_json_open_array(json, key);
  for (int i = 0; i < scores->count; i++) {
    double value;
    memcpy(&value, (const char *)first + (size_t)i * size + offset, sizeof value);
    vt_json_put_number(json, NULL, value);
  }
  vt_json_close_array(json);
}

void vt_report_scores(vt_json_writer *json, const vt_scores *scores, const vt_views *judged) {
  vt_json_put_integer(json, "views", scores->count);
  vt_report_metrics(json, &scores->mean);
  vt_json_open_object(json, "outline");
  vt_json_put_number(json, "psnr_inside", scores->outline.psnr_inside);
  vt_json_put_number(json, "near", scores->outline.near);
  vt_json_put_number(json, "reach", scores->outline.reach);
  vt_json_put_number(json, "least_reach", scores->least_reach);
  vt_json_close_object(json);
  vt_json_put_integer(json, "level", scores->level);
  vt_json_put_number(json, "seconds_per_frame", scores->seconds_per_frame);
  vt_json_put_string(json, "renderer", scores->renderer);
  vt_json_open_object(json, "per_view");
  vt_json_open_array(json, "name");
  for (int i = 0; i < judged->count; i++) vt_json_put_string(json, NULL, judged->items[i].name);
  vt_json_close_array(json);
#define METRIC(member)                                                                                                 \
  put_column(json, scores, #member, scores->of_view, sizeof(vt_metrics), offsetof(vt_metrics, member))
  METRIC(psnr), METRIC(psnr_foreground), METRIC(ssim), METRIC(alpha_rmse), METRIC(delta_e), METRIC(sharpness);
#undef METRIC
#define OUTLINE(member)                                                                                                \
  put_column(json, scores, #member, scores->outlines, sizeof(vt_outline), offsetof(vt_outline, member))
  OUTLINE(psnr_inside), OUTLINE(near), OUTLINE(reach);
#undef OUTLINE
  vt_json_close_object(json);
}

void vt_report_predictors(vt_json_writer *json, const vt_metrics metrics[VT_PREDICTOR_COUNT]) {
  vt_json_open_object(json, "predictors"); // PSNR
  for (int p = 0; p < VT_PREDICTOR_COUNT; p++)
    vt_json_put_number(json, vt_predictor_name((vt_predictor)p), metrics[p].psnr);
  vt_json_close_object(json);
  vt_json_open_object(json, "predictor_metrics");
  for (int p = 0; p < VT_PREDICTOR_COUNT; p++) {
    vt_json_open_object(json, vt_predictor_name((vt_predictor)p));
    vt_report_metrics(json, &metrics[p]);
    vt_json_close_object(json);
  }
  vt_json_close_object(json);
}

void vt_say_metrics_head(vt_session *session) {
  vt_say(session, "%-28s %8s %10s %7s %10s %8s %9s\n", "", "PSNR", "foreground", "SSIM", "alpha RMSE", "delta E",
         "sharpness");
}

void vt_say_metrics(vt_session *session, const char *name, const vt_metrics *metrics) {
  vt_say(session, "%-28s %8.2f %10.2f %7.4f %10.4f %8.2f %9.3f\n", name, metrics->psnr, metrics->psnr_foreground,
         metrics->ssim, metrics->alpha_rmse, metrics->delta_e, metrics->sharpness);
}

void vt_say_outline(vt_session *session, const vt_scores *scores) {
  vt_say(session,
         "inside the mattes %.2f dB; %.2f %% of the tree within 3 pixels of them; its largest piece is %.1f %% as long "
         "as theirs, %.1f %% where it is shortest\n",
         scores->outline.psnr_inside, 100 * scores->outline.near, 100 * scores->outline.reach,
         100 * scores->least_reach);
}
