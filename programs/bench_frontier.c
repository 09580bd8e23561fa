// bench_frontier.c - what the suite frontier has measured on one capture as tables, plots and pictures
// SPDX-License-Identifier: BSD-3-Clause
//
// One row is one method at one price. Rows of a series make a curve over seconds and over megabytes. A peer that draws
// opaque pictures, or not all views, cannot stand in the same rows: it gets a table of its own in which our pictures
// are judged again, over its background and on the views that it drew.
#include "programs/bench_frontier.h"

#include "programs/bench_data.h"
#include "programs/contact_sheet.h"

#include <math.h>
#include <string.h>

#define TIME_NOISE 0.3   // share; the repetitions' ranges must be apart as well
#define CPU_NOISE 0.25   // processor time is disturbed less by what else runs
#define BUDGET_NOISE 5.0 // times as much where a time budget decides how far a run comes
#define MOST_COLUMNS (VT_MAX_METRIC_COLUMNS + 5)
#define THUMBNAIL 240 // pixels of the longer side

static const float white[3] = {1, 1, 1};

static vt_spread spread_of(const double *values, int count) {
  double sorted[VT_MAX_REPETITIONS];
  if (!count) return (vt_spread){NAN, NAN, NAN};
  memcpy(sorted, values, (size_t)count * sizeof *sorted);
  return vt_spread_of(sorted, count);
}

static vt_spread once(double value) {
  return (vt_spread){value, value, value};
}

static int list_columns(vt_bench_column out[MOST_COLUMNS]) {
  int count = 0;
  out[count++] = (vt_bench_column){"time", "s", VT_LESS_BETTER, TIME_NOISE, 0.02};
  out[count++] = (vt_bench_column){"CPU time", "CPU s", VT_LESS_BETTER, CPU_NOISE, 0.03};
  count += vt_metric_columns(out + count);
  out[count++] = (vt_bench_column){"textures", "bytes", VT_LESS_BETTER, 0.01, 0};
  out[count++] = (vt_bench_column){"file", "bytes", VT_LESS_BETTER, 0.01, 0};
  out[count++] = (vt_bench_column){"peak memory", "bytes", VT_LESS_BETTER, 0.05, 1e6};
  return count;
}

static void put_plots(vt_frontier *f, const vt_bench_table *table, bool with_bytes, bool with_alpha) {
  static const char *const metrics[] = {"PSNR", "SSIM", "alpha RMSE"};
  static const struct {
    const char *column, *over;
  } prices[] = {{"time", "seconds"}, {"textures", "megabytes of textures"}};
  for (int p = 0; p < (with_bytes ? 2 : 1); p++)
    for (int m = 0; m < (with_alpha ? 3 : 2); m++) {
      char name[200], caption[300];
      snprintf(name, sizeof name, "%s_%s_over_%s", f->name, metrics[m], prices[p].column);
      snprintf(caption, sizeof caption, "%s: %s over %s", f->name, metrics[m], prices[p].over);
      vt_add_plot(f->bench, table, &(vt_plot){name, caption, prices[p].column, metrics[m], true, false, true});
    }
}

// ---- the main table

static void put_run(vt_bench_table *table, const vt_frontier_run *run, bool packed) {
  char label[100];
  snprintf(label, sizeof label, "%s/%s", run->series, run->point);
  vt_add_row(table, label);
  if (run->budget > 0) vt_set_row_noise(table, BUDGET_NOISE);
  vt_put_spread(table, spread_of(run->seconds[packed ? VT_RUN_TOTAL : VT_RUN_RECONSTRUCT], run->repetitions));
  vt_put_spread(table, spread_of(run->seconds[packed ? VT_RUN_TOTAL_CPU : VT_RUN_RECONSTRUCT_CPU], run->repetitions));
  vt_put_metrics(table, packed ? run->packed : run->raw, run->repetitions);
  vt_put_spread(table, spread_of(run->textures[packed], run->repetitions));
  vt_put_spread(table, spread_of(run->file[packed], run->repetitions));
  if (packed) vt_put_spread(table, spread_of(run->peak_bytes, run->repetitions));
}

static void put_unpacked(vt_frontier *f) {
  vt_bench_column columns[MOST_COLUMNS];
  char name[140], caption[200];
  int count = list_columns(columns) - 1; // the peak is that of both
  snprintf(name, sizeof name, "%s_unpacked", f->name);
  snprintf(caption, sizeof caption, "%s: the same before packing", f->name);
  vt_bench_table *table = vt_add_table(f->bench, name, caption, columns, count);
  for (int i = 0; i < f->run_count; i++)
    if (f->runs[i].repetitions) put_run(table, &f->runs[i], false);
}

static const char *predictor_label(vt_predictor predictor) {
  return predictor == VT_PREDICT_NEAREST ? "nearest photograph" : "visual hull";
}

// What has neither processor time of ours nor bytes; cells that are not put are empty.
static void put_row(vt_bench_table *table, const char *label, vt_spread seconds, bool with_cpu,
                    const vt_metrics *metrics) {
  vt_add_row(table, label);
  vt_put_spread(table, seconds);
  if (with_cpu) vt_put_value(table, NAN);
  vt_put_metrics(table, metrics, metrics ? 1 : 0);
}

// May its pictures stand beside ours over white?
static bool is_like_ours(const vt_frontier *f, const vt_peer_result *result) {
  bool like = result->drawn == f->judged.count;
  for (int i = 0; i < result->pictures.count; i++)
    if (result->pictures.items[i].pixels) like &= result->pictures.items[i].channels == 4;
  return like;
}

static void peer_label(const vt_frontier_peer *run, char label[140]) {
  snprintf(label, 140, "%.100s/%g s", run->peer->name, run->budget);
}

static vt_status put_table(vt_frontier *f) {
  vt_bench_column columns[MOST_COLUMNS];
  char caption[300], label[140];
  int count = list_columns(columns);
  snprintf(caption, sizeof caption, "%s: %d photographs, judged on %d held-out views of %d x %d over white", f->name,
           f->training.count, f->judged.count, f->judged.items[0].camera.width, f->judged.items[0].camera.height);
  vt_bench_table *table = vt_add_table(f->bench, f->name, caption, columns, count);
  for (int i = 0; i < f->run_count; i++)
    if (f->runs[i].repetitions) put_run(table, &f->runs[i], true);
  for (int p = 0; p < VT_FRONTIER_PREDICTORS; p++)
    put_row(table, predictor_label(f->predictors[p].predictor), f->predictors[p].seconds, true,
            &f->predictors[p].metrics);
  vt_status status = VT_OK;
  for (int i = 0; i < f->peer_run_count && !status; i++) {
    vt_frontier_peer *run = &f->peer_runs[i];
    vt_metrics metrics;
    peer_label(run, label);
    if (*run->result.trouble) vt_add_sentence(f->bench, "%s: %s", f->name, run->result.trouble);
    if (run->result.drawn && !is_like_ours(f, &run->result)) continue; // in its own table
    if (run->result.drawn) status = vt_judge_pictures(f->context, &run->result.pictures, &f->judged, white, &metrics);
    if (!status) put_row(table, label, once(run->result.seconds), true, run->result.drawn ? &metrics : NULL);
  }
  put_plots(f, table, true, true);
  return status;
}

// ---- stages

static void put_stages(vt_frontier *f) {
  static const char *const names[] = {"bounds",     "hull",  "rays",     "opacity", "colour",
                                      "refinement", "tiles", "compress", "frame"};
  enum { COLUMNS = 2 + (int)(sizeof names / sizeof *names) };
  vt_bench_column columns[COLUMNS] = {{"reconstruct", "s", VT_LESS_BETTER, TIME_NOISE, 0.02},
                                      {"reconstruct", "CPU s", VT_LESS_BETTER, CPU_NOISE, 0.02}};
  char name[140], caption[200], label[100];
  for (int i = 2; i < COLUMNS; i++)
    columns[i] = (vt_bench_column){names[i - 2], "s", VT_LESS_BETTER, TIME_NOISE + 0.2, i == COLUMNS - 1 ? 0.01 : 0.05};
  snprintf(name, sizeof name, "%s_stages", f->name);
  snprintf(caption, sizeof caption, "%s: seconds of the stages, of packing, and of drawing one frame", f->name);
  vt_bench_table *table = vt_add_table(f->bench, name, caption, columns, COLUMNS);
  for (int i = 0; i < f->run_count; i++) {
    const vt_frontier_run *run = &f->runs[i];
    if (!run->repetitions) continue;
    snprintf(label, sizeof label, "%s/%s", run->series, run->point);
    vt_add_row(table, label);
    if (run->budget > 0) vt_set_row_noise(table, BUDGET_NOISE);
    for (int s = VT_RUN_RECONSTRUCT; s <= VT_RUN_FRAME; s++)
      vt_put_spread(table, spread_of(run->seconds[s], run->repetitions));
  }
}

// ---- a table for a peer that draws otherwise

// Our pictures, over the peer's background, on the views that it drew.
static vt_status judge_alike(vt_frontier *f, const vt_peer_result *peer, const vt_pictures *ours, vt_metrics *out) {
  vt_pictures seen = {0};
  vt_status status = vt_make_pictures(f->context, ours->count, &seen);
  for (int i = 0; i < ours->count && !status; i++)
    if (peer->pictures.items[i].pixels) seen.items[i] = ours->items[i]; // borrowed
  const float *background = peer->has_background ? peer->background : white;
  if (!status) status = vt_judge_pictures(f->context, &seen, &f->judged, background, out);
  vt_free(f->context, seen.items);
  return status;
}

static vt_status put_peer_table(vt_frontier *f, const vt_frontier_peer *run) {
  const vt_peer_result *peer = &run->result;
  vt_bench_column columns[MOST_COLUMNS];
  char name[260], caption[500], label[140];
  columns[0] = (vt_bench_column){"time", "s", VT_LESS_BETTER, TIME_NOISE, 0.02};
  int count = 1 + vt_metric_columns(columns + 1);
  const float *background = peer->has_background ? peer->background : white;
  snprintf(name, sizeof name, "%s_beside_%.100s_%g", f->name, run->peer->name, run->budget);
  snprintf(caption, sizeof caption,
           "%s beside %.100s at %g s: the %d of %d views that it drew, over its background %g %g %g", f->name,
           run->peer->name, run->budget, peer->drawn, f->judged.count, (double)background[0], (double)background[1],
           (double)background[2]);
  vt_bench_table *table = vt_add_table(f->bench, name, caption, columns, count);
  vt_metrics metrics;
  peer_label(run, label);
  vt_status status = judge_alike(f, peer, &peer->pictures, &metrics);
  if (!status) put_row(table, label, once(peer->seconds), false, &metrics);
  for (int i = 0; i < f->run_count && !status; i++) {
    const vt_frontier_run *ours = &f->runs[i];
    if (!ours->repetitions) continue;
    status = judge_alike(f, peer, &ours->pictures, &metrics);
    snprintf(label, sizeof label, "%s/%s", ours->series, ours->point);
    if (!status) put_row(table, label, spread_of(ours->seconds[VT_RUN_TOTAL], ours->repetitions), false, &metrics);
    if (ours->budget > 0) vt_set_row_noise(table, BUDGET_NOISE);
  }
  for (int p = 0; p < VT_FRONTIER_PREDICTORS && !status; p++) {
    const vt_frontier_predictor *predictor = &f->predictors[p];
    status = judge_alike(f, peer, &predictor->pictures, &metrics);
    if (!status) put_row(table, predictor_label(predictor->predictor), predictor->seconds, false, &metrics);
  }
  if (!status) put_plots(f, table, false, false);
  return status;
}

// ---- pictures of the first held-out view

static vt_status put_picture(vt_frontier *f, const char *caption, const vt_image *picture) {
  if (!picture->pixels) return VT_OK;
  vt_context *context = f->context;
  vt_fimage whole = {0}, small = {0};
  vt_image flat = {0}, rgba = {0};
  int longer = picture->width > picture->height ? picture->width : picture->height,
      limit = longer > THUMBNAIL ? THUMBNAIL : longer;
  vt_status status = vt_make_image(context, picture->width, picture->height, 4, &rgba);
  if (status) return status;
  size_t pixels = (size_t)picture->width * (size_t)picture->height, channels = (size_t)picture->channels;
  for (size_t i = 0; i < pixels; i++)
    for (size_t c = 0; c < 4; c++)
      rgba.pixels[4 * i + c] = c == 3 && channels < 4 ? 255 : picture->pixels[channels * i + (channels < 3 ? 0 : c)];
  status = vt_fimage_from_image(context, &rgba, &whole);
  int width = picture->width * limit / longer, height = picture->height * limit / longer;
  if (!status) status = vt_resample_fimage(context, &whole, width > 1 ? width : 1, height > 1 ? height : 1, &small);
  if (!status) status = vt_flatten(context, &small, white, &flat);
  if (!status) vt_add_picture(f->bench, caption, &flat);
  vt_free_image(context, &rgba);
  vt_free_image(context, &flat);
  vt_free_fimage(context, &whole);
  vt_free_fimage(context, &small);
  return status;
}

static vt_status put_pictures(vt_frontier *f) {
  char caption[240];
  if (!f->session->report) return VT_OK;
  snprintf(caption, sizeof caption, "%s: the photograph", f->name);
  vt_status status = put_picture(f, caption, &f->judged.items[0].picture);
  for (int p = 0; p < VT_FRONTIER_PREDICTORS && !status; p++)
    status = put_picture(f, predictor_label(f->predictors[p].predictor), &f->predictors[p].pictures.items[0]);
  for (int i = 0; i < f->run_count && !status; i++) {
    const vt_frontier_run *run = &f->runs[i];
    if (!run->repetitions) continue;
    snprintf(caption, sizeof caption, "%s, %s: %.2f dB in %.3g s", run->series, run->point, run->packed[0].psnr,
             run->seconds[VT_RUN_TOTAL][0]);
    status = put_picture(f, caption, &run->pictures.items[0]);
  }
  for (int i = 0; i < f->peer_run_count && !status; i++) {
    const vt_frontier_peer *run = &f->peer_runs[i];
    snprintf(caption, sizeof caption, "%.100s in %.3g s", run->peer->name, run->result.seconds);
    status = put_picture(f, caption, &run->result.pictures.items[0]);
  }
  return status;
}

vt_status vt_put_frontier(vt_frontier *f) {
  vt_add_heading(f->bench, f->name);
  vt_status status = put_table(f);
  put_unpacked(f);
  put_stages(f);
  for (int i = 0; i < f->peer_run_count && !status; i++)
    if (f->peer_runs[i].result.drawn && !is_like_ours(f, &f->peer_runs[i].result))
      status = put_peer_table(f, &f->peer_runs[i]);
  return status ? status : put_pictures(f);
}
