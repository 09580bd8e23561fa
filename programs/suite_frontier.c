// suite_frontier.c - time against error, from the fastest preset to the slowest, beside trivial predictors
// SPDX-License-Identifier: BSD-3-Clause
//
// Error without time, or time without error, can be bought at any price. The suite frontier runs the presets one after
// another in one process on one capture and shows both, with the bytes that they cost.
#include "datasets-synthetic/synthetic.h"
#include "programs/contact_sheet.h"
#include "programs/bench.h"
#include "programs/scores.h"
#include "programs/stage_options.h"
#include "reconstruct/reconstruct.h"

#include <string.h>

static const char *const preset_names[] = {"draft", "normal", "high"};
#define PRESET_COUNT 3

typedef struct table_row {
  const char *preset;
  double seconds, seconds_compress;
  vt_scores scores; // of the packed tree
  vt_metrics raw;   // of the tree before packing
  uint64_t raw_bytes, packed_bytes, peak_bytes;
  int leaf_level;
} table_row;

typedef struct work {
  vt_views views, judged, training; // judged and training: free their items only
  int row_count;
  table_row rows[PRESET_COUNT];
  vt_metrics predictors[VT_PREDICTOR_COUNT];
  vt_vec3 centre;
  vt_sheet sheet;
} work;

static const float white[3] = {1, 1, 1};

static vt_status prepare(vt_session *session, work *job) {
  vt_context *context = session->context;
  const char *source = vt_text_of(&session->arguments, "capture", NULL);
  vt_status status;
  if (source) {
    vt_capture_report report = {0};
    status = vt_load_source(session, source, &job->views, &report);
    if (!status) vt_say_source(session, source, &job->views, &report);
    vt_free_capture_report(context, &report);
  } else {
    vt_synthetic_desc desc = vt_default_synthetic_desc();
    bool quick = vt_given(&session->arguments, "quick");
    desc.train_count = quick ? 16 : 40;
    desc.test_count = quick ? 4 : 8;
    desc.width = desc.height = quick ? 96 : 320;
    if (quick) desc.leaf_count = 1500;
    vt_begin_stage(session);
    status = vt_make_synthetic_views(context, &desc, &job->views);
    vt_end_stage(session, "synth");
  }
  if (status) return status;
  if (vt_count_views(&job->views, VT_TEST) == 0) vt_hold_out(&job->views, 8);
  if (vt_count_views(&job->views, VT_TEST) == 0)
    return vt_fail(context, VT_TOO_FEW_VIEWS, "%s: holds fewer than 8 photographs, none to judge on; add some", source);
  status = vt_select_views(context, &job->views, VT_TRAIN, &job->training);
  return status ? status : vt_select_views(context, &job->views, VT_TEST, &job->judged);
}

// The first judged photograph as this tree shows it.
static vt_status put_example(vt_session *session, work *job, const vt_tree *tree, const vt_render_desc *desc,
                             double psnr) {
  vt_context *context = session->context;
  vt_renderer *renderer = NULL;
  vt_fimage picture = {0};
  char label[32];
  snprintf(label, sizeof label, "%.2f", psnr);
  vt_status status = vt_create_renderer(context, tree, VT_BACKEND_AUTO, &renderer);
  if (!status) status = vt_render(context, renderer, desc, &job->judged.items[0].camera, &picture, NULL);
  if (!status) status = vt_put_on_sheet(context, &job->sheet, &picture, label);
  vt_free_fimage(context, &picture);
  if (renderer) vt_destroy_renderer(context, renderer);
  return status;
}

static vt_status run_preset(vt_session *session, work *job, vt_preset preset, table_row *row) {
  vt_context *context = session->context;
  vt_tree raw = {0}, packed = {0};
  vt_scores raw_scores = {0};
  vt_reconstruct_report report;
  vt_render_desc drawing = vt_default_render_desc();
  vt_compress_desc packing = vt_compress_desc_of(&session->arguments);
  vt_reconstruct_desc desc =
      vt_default_reconstruct_desc((vt_method)vt_choice_of(&session->arguments, "method", VT_METHOD_BEST), preset);
  row->preset = preset_names[preset];
  vt_begin_stage(session);
  vt_status status = vt_reconstruct(context, &desc, &job->views, &raw, &report);
  if (status) goto done;
  row->seconds = vt_seconds() - session->stage_start;
  vt_end_stage(session, row->preset);
  vt_begin_stage(session);
  status = vt_compress_tree(context, &packing, &raw, &packed, NULL);
  if (status) goto done;
  row->seconds_compress = vt_seconds() - session->stage_start;
  row->peak_bytes = vt_peak_bytes(context);
  if (session->stages[session->stage_count - 1].peak_bytes > row->peak_bytes)
    row->peak_bytes = session->stages[session->stage_count - 1].peak_bytes;
  row->raw_bytes = vt_texture_bytes(&raw);
  row->packed_bytes = vt_texture_bytes(&packed);
  row->leaf_level = report.leaf_level;
  drawing.level = vt_finest_level(&packed);
  job->centre = vt_tree_centre(&packed);
  status = vt_score_tree(session, &raw, &drawing, VT_BACKEND_AUTO, white, &job->judged, NULL, &raw_scores);
  if (!status) row->raw = raw_scores.mean;
  if (!status)
    status = vt_score_tree(session, &packed, &drawing, VT_BACKEND_AUTO, white, &job->judged, NULL, &row->scores);
  if (!status && session->report) status = put_example(session, job, &packed, &drawing, row->scores.of_view[0].psnr);
done:
  vt_free_scores(context, &raw_scores);
  vt_free_tree(context, &raw);
  vt_free_tree(context, &packed);
  return status;
}

static const vt_bench_column columns[] = {{"seconds", "s", VT_LESS_BETTER, 0.2, 0.02},
                                          {"PSNR", "dB", VT_MORE_BETTER, 0, 0.1},
                                          {"foreground PSNR", "dB", VT_MORE_BETTER, 0, 0.1},
                                          {"SSIM", "", VT_MORE_BETTER, 0, 0.003},
                                          {"alpha RMSE", "", VT_LESS_BETTER, 0.02, 0.001},
                                          {"textures", "bytes", VT_LESS_BETTER, 0.01, 0},
                                          {"peak", "bytes", VT_LESS_BETTER, 0.05, 0}};

static void put_metrics(vt_bench_table *table, const char *label, double seconds, const vt_metrics *m, double bytes, double peak) {
  vt_add_row(table, label);
  vt_put_value(table, seconds);
  vt_put_value(table, m->psnr);
  vt_put_value(table, m->psnr_foreground);
  vt_put_value(table, m->ssim);
  vt_put_value(table, m->alpha_rmse);
  vt_put_value(table, bytes);
  vt_put_value(table, peak);
}

static void put_rows(vt_bench *bench, const work *job) {
  vt_bench_table *table = vt_add_table(bench, "frontier", "Time against error", columns, 7);
  for (int i = 0; i < job->row_count; i++) {
    const table_row *row = &job->rows[i];
    char label[80];
    snprintf(label, sizeof label, "raw/%s", row->preset);
    put_metrics(table, label, row->seconds, &row->raw, (double)row->raw_bytes, NAN);
    snprintf(label, sizeof label, "packed/%s", row->preset);
    put_metrics(table, label, row->seconds + row->seconds_compress, &row->scores.mean, (double)row->packed_bytes,
                (double)row->peak_bytes);
  }
  for (int p = 0; p < VT_PREDICTOR_COUNT; p++)
    put_metrics(table, vt_predictor_name((vt_predictor)p), NAN, &job->predictors[p], NAN, NAN);
  vt_add_plot(bench, table, &(vt_plot){"psnr", "PSNR over seconds", "seconds", "PSNR", true, false, true});
}

static vt_status run_frontier(vt_bench *bench, work *job) {
  vt_session *session = vt_session_of(bench);
  vt_context *context = session->context;
  int presets = vt_is_quick(bench) ? 1 : PRESET_COUNT;
  vt_status status = prepare(session, job);
  if (!status && session->report) { // truth, then each preset
    vt_fimage truth = {0};
    status = vt_begin_sheet(context, presets + 1, presets + 1, 400, 400, white, &job->sheet);
    if (!status) status = vt_fimage_from_image(context, &job->judged.items[0].picture, &truth);
    if (!status) status = vt_put_on_sheet(context, &job->sheet, &truth, "");
    vt_free_fimage(context, &truth);
  }
  for (int i = 0; i < presets && !status; i++) {
    vt_bench_step(bench, i, presets);
    status = run_preset(session, job, (vt_preset)i, &job->rows[i]);
    job->row_count = i + 1;
  }
  vt_begin_stage(session);
  if (!status) status = vt_score_predictors(session, &job->training, &job->judged, job->centre, white, job->predictors);
  if (status) return status;
  vt_end_stage(session, "predictors");
  put_rows(bench, job);
  if (session->report) vt_add_picture(bench, "truth, then each preset", &job->sheet.image);
  return VT_OK;
}

static vt_status run(vt_bench *bench) {
  vt_context *context = vt_session_of(bench)->context;
  work job = {0};
  vt_status status = run_frontier(bench, &job);
  for (int i = 0; i < job.row_count; i++) vt_free_scores(context, &job.rows[i].scores);
  vt_free_sheet(context, &job.sheet);
  vt_free(context, job.judged.items);
  vt_free(context, job.training.items);
  vt_free_views(context, &job.views);
  return status;
}

const vt_suite vt_suite_frontier = {"frontier", "time against error: presets, budgets and peers on held-out photographs", run};
