// verb_bench.c - voltree bench: time against error, from the fastest preset to the slowest, beside trivial predictors
// SPDX-License-Identifier: BSD-3-Clause
//
// Error without time, or time without error, can be bought at any price. The suite frontier runs the presets one after
// another in one process on one capture and shows both, with the bytes that they cost.
#include "datasets-synthetic/synthetic.h"
#include "programs/contact_sheet.h"
#include "programs/report.h"
#include "programs/scores.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"
#include "reconstruct/reconstruct.h"

#include <string.h>

static const vt_option options[] = {
    {"quick", 0, VT_OPTION_FLAG, "", 0, 0, false, "the preset draft on a small synthetic tree"},
    {"capture", 0, VT_OPTION_TEXT, "DIR", 0, 0, false, "photographs or a capture to run on; default: a synthetic tree"},
    {"method", 0, VT_OPTION_CHOICE, "2004|2006|best", 0, 0, false, "as in reconstruct; default: best"},
    {0}};

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

static void say_table(vt_session *session, const work *job) {
  char a[32], b[32], c[32];
  vt_say(session, "%-20s %8s %7s %10s %7s %10s %11s %11s %11s\n", "", "seconds", "PSNR", "foreground", "SSIM",
         "alpha RMSE", "textures", "packed", "peak");
  for (int i = 0; i < job->row_count; i++) {
    const table_row *row = &job->rows[i];
    vt_say(session, "%-20s %8.2f %7.2f %10.2f %7.4f %10.4f %11s\n", row->preset, row->seconds, row->raw.psnr,
           row->raw.psnr_foreground, row->raw.ssim, row->raw.alpha_rmse, vt_show_bytes(row->raw_bytes, a));
    const vt_metrics *packed = &row->scores.mean;
    vt_say(session, "%-20s %8.2f %7.2f %10.2f %7.4f %10.4f %11s %11s %11s\n", "  packed",
           row->seconds + row->seconds_compress, packed->psnr, packed->psnr_foreground, packed->ssim,
           packed->alpha_rmse, "", vt_show_bytes(row->packed_bytes, b), vt_show_bytes(row->peak_bytes, c));
  }
  for (int p = 0; p < VT_PREDICTOR_COUNT; p++) {
    const vt_metrics *metrics = &job->predictors[p];
    vt_say(session, "%-20s %8s %7.2f %10.2f %7.4f %10.4f\n", vt_predictor_name((vt_predictor)p), "", metrics->psnr,
           metrics->psnr_foreground, metrics->ssim, metrics->alpha_rmse);
  }
}

static vt_status write_report(vt_session *session, const work *job) {
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_string(&json, "suite", "frontier");
  vt_json_put_integer(&json, "views", job->training.count);
  vt_json_put_integer(&json, "judged", job->judged.count);
  vt_json_open_array(&json, "runs");
  for (int i = 0; i < job->row_count; i++) {
    const table_row *row = &job->rows[i];
    vt_json_open_object(&json, NULL);
    vt_json_put_string(&json, "preset", row->preset);
    vt_json_put_number(&json, "seconds_reconstruct", row->seconds);
    vt_json_put_number(&json, "seconds_compress", row->seconds_compress);
    vt_report_scores(&json, &row->scores, &job->judged);
    vt_json_open_object(&json, "raw");
    vt_report_metrics(&json, &row->raw);
    vt_json_close_object(&json);
    vt_json_put_integer(&json, "texture_bytes_raw", (long long)row->raw_bytes);
    vt_json_put_integer(&json, "texture_bytes", (long long)row->packed_bytes);
    vt_json_put_integer(&json, "peak_bytes", (long long)row->peak_bytes);
    vt_json_put_integer(&json, "leaf_level", row->leaf_level);
    vt_json_close_object(&json);
  }
  vt_json_close_array(&json);
  vt_report_predictors(&json, job->predictors);
  return vt_end_report(session, &json);
}

static vt_status write_sheet(vt_session *session, const work *job) {
  char *path = vt_print_text(session->context, "%s/frontier.%s", session->report, vt_picture_ending());
  vt_status status = path ? vt_write_sheet(session->context, &job->sheet, path) : VT_OUT_OF_MEMORY;
  vt_free(session->context, path);
  return status;
}

static vt_status run_frontier(vt_session *session, work *job) {
  vt_context *context = session->context;
  int presets = vt_given(&session->arguments, "quick") ? 1 : PRESET_COUNT;
  vt_status status = prepare(session, job);
  if (!status && session->report) { // truth, then each preset
    vt_fimage truth = {0};
    status = vt_begin_sheet(context, presets + 1, presets + 1, 400, 400, white, &job->sheet);
    if (!status) status = vt_fimage_from_image(context, &job->judged.items[0].picture, &truth);
    if (!status) status = vt_put_on_sheet(context, &job->sheet, &truth, "");
    vt_free_fimage(context, &truth);
  }
  for (int i = 0; i < presets && !status; i++) {
    status = run_preset(session, job, (vt_preset)i, &job->rows[i]);
    job->row_count = i + 1;
  }
  vt_begin_stage(session);
  if (!status) status = vt_score_predictors(session, &job->training, &job->judged, job->centre, white, job->predictors);
  if (status) return status;
  vt_end_stage(session, "predictors");
  say_table(session, job);
  if (session->report) status = write_sheet(session, job);
  return status ? status : write_report(session, job);
}

static vt_status run(vt_session *session) {
  vt_context *context = session->context;
  const char *suite = session->arguments.operands[0];
  if (strcmp(suite, "frontier")) return vt_fail(context, VT_BAD_USAGE, "%s: no such suite; there is frontier", suite);
  work job = {0};
  vt_status status = run_frontier(session, &job);
  for (int i = 0; i < job.row_count; i++) vt_free_scores(context, &job.rows[i].scores);
  vt_free_sheet(context, &job.sheet);
  vt_free(context, job.judged.items);
  vt_free(context, job.training.items);
  vt_free_views(context, &job.views);
  return status;
}

const vt_verb vt_verb_bench = {.name = "bench",
                               .operands = "SUITE",
                               .summary = "measure time against error",
                               .notes =
                                   "SUITE frontier reconstructs one capture with the presets draft, normal and high, "
                                   "judges each on photographs that "
                                   "were left out, and shows seconds, error and bytes beside three trivial predictors.",
                               .example = "voltree bench frontier --quick --json -",
                               .operand_count = 1,
                               .tables = {options, vt_source_options, vt_codebook_options, vt_common_options},
                               .run = run};
