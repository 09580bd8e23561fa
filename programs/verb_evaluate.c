// verb_evaluate.c - voltree evaluate: a tree against photographs, beside trivial predictors
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/metadata.h"
#include "programs/report.h"
#include "programs/scores.h"
#include "programs/stage_options.h"
#include "programs/truth_file.h"
#include "programs/truth_scores.h"
#include "programs/verbs.h"

#include <string.h>

typedef enum split { SPLIT_TRAIN, SPLIT_TEST, SPLIT_HOLDOUT } split;
static const char *const split_names[] = {"train", "test", "holdout"};

static const vt_option options[] = {
    {"split", 0, VT_OPTION_CHOICE, "train|test|holdout", 0, 0, false,
     "the photographs to judge on: those it was made from, those of transforms_test.json, or those that reconstruct "
     "--holdout "
     "left out; default: test if there are any, else holdout"},
    {"background", 0, VT_OPTION_BACKGROUND, "white|black|R,G,B", 0, 0, false,
     "behind tree and photograph; default: white"},
    {"no-predictors", 0, VT_OPTION_FLAG, "", 0, 0, false, "skip the trivial predictors"},
    {"truth", 0, VT_OPTION_FLAG, "", 0, 0, false,
     "compare with the object itself, for captures of voltree synth: extinction by level, and line integrals on rays "
     "that "
     "no photograph took"},
    {"min-psnr", 0, VT_OPTION_NUMBER, "X", 0, 99, false, "exit 7 if the mean PSNR is below X dB"},
    {0}};

typedef struct work {
  const char *file, *source;
  vt_tree tree;
  vt_views views, judged, training; // judged and training: borrowed from views
  vt_capture_report capture;
  vt_names held_out;
  split split;
  float background[3];
  vt_scores scores;
  bool predicted, knows_truth;
  vt_truth_scores truth;
  vt_metrics predictors[VT_PREDICTOR_COUNT];
} work;

static vt_status choose_views(vt_session *session, work *job) {
  vt_context *context = session->context;
  vt_status status = vt_metadata_names(context, &job->tree, job->file, "held_out", &job->held_out);
  if (status) return status;
  bool any_test = vt_count_views(&job->views, VT_TEST) > 0;
  job->split =
      (split)vt_choice_of(&session->arguments, "split", any_test || !job->held_out.count ? SPLIT_TEST : SPLIT_HOLDOUT);
  job->judged.items = VT_NEW(context, vt_view, (size_t)job->views.count);
  job->training.items = VT_NEW(context, vt_view, (size_t)job->views.count);
  if (!job->judged.items || !job->training.items) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < job->views.count; i++) {
    const vt_view *view = &job->views.items[i];
    bool held_out = vt_has_name(&job->held_out, view->name), training = view->role == VT_TRAIN && !held_out;
    bool wanted = job->split == SPLIT_TRAIN ? training : job->split == SPLIT_HOLDOUT ? held_out : view->role == VT_TEST;
    if (wanted) job->judged.items[job->judged.count++] = *view;
    if (training) job->training.items[job->training.count++] = *view;
  }
  for (int i = 0; i < job->training.count; i++) job->training.items[i].role = VT_TRAIN;
  if (job->judged.count) return VT_OK;
  if (job->split == SPLIT_HOLDOUT && !job->held_out.count)
    return vt_fail(context, VT_BAD_INPUT,
                   "%s: no photographs were left out when it was made; make it with voltree reconstruct "
                   "--holdout 8, or give another --split",
                   job->file);
  return vt_fail(context, VT_BAD_INPUT, "%s: holds no photographs of --split %s; give another --split%s", job->source,
                 split_names[job->split],
                 job->split == SPLIT_HOLDOUT ? " or the photographs that the tree was made from" : "");
}

static void say_scores(vt_session *session, const work *job) {
  vt_say(session, "%s on %d photographs (%s) of %s, level %d, %s, %.4f s a frame\n", job->file, job->scores.count,
         split_names[job->split], job->source, job->scores.level, job->scores.renderer, job->scores.seconds_per_frame);
  vt_say_metrics_head(session);
  for (int i = 0; i < job->scores.count; i++)
    vt_say_metrics(session, job->judged.items[i].name, &job->scores.of_view[i]);
  vt_say_metrics(session, "mean", &job->scores.mean);
  for (int p = 0; p < VT_PREDICTOR_COUNT && job->predicted; p++)
    vt_say_metrics(session, vt_predictor_name((vt_predictor)p), &job->predictors[p]);
  vt_say_outline(session, &job->scores);
  if (job->knows_truth) vt_say_truth(session, &job->truth);
}

static vt_status write_report(vt_session *session, const work *job) {
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_string(&json, "tree", job->file);
  vt_json_put_string(&json, "capture", job->source);
  vt_json_put_string(&json, "split", split_names[job->split]);
  vt_json_open_array(&json, "background");
  for (int c = 0; c < 3; c++) vt_json_put_number(&json, NULL, (double)job->background[c]);
  vt_json_close_array(&json);
  vt_report_scores(&json, &job->scores, &job->judged);
  if (job->predicted) vt_report_predictors(&json, job->predictors);
  if (job->knows_truth) vt_report_truth(&json, &job->truth);
  return vt_end_report(session, &json);
}

static vt_status judge(vt_session *session, work *job) {
  const vt_arguments *arguments = &session->arguments;
  vt_render_desc desc = vt_render_desc_of(arguments);
  vt_status status = vt_check_level(session, &job->tree, job->file, desc.level);
  if (status) return status;
  if (desc.level < 0) desc.level = vt_finest_level(&job->tree);
  vt_begin_stage(session);
  status = vt_score_tree(session, &job->tree, &desc, vt_backend_of(arguments), job->background, &job->judged,
                         session->report, &job->scores);
  if (status) return status;
  vt_end_stage(session, "judge");
  if (vt_given(arguments, "no-predictors") || !job->training.count) return VT_OK;
  vt_begin_stage(session);
  status = vt_score_predictors(session, &job->training, &job->judged, vt_tree_centre(&job->tree), job->background,
                               job->predictors);
  if (!status) vt_end_stage(session, "predictors");
  job->predicted = !status;
  return status;
}

// The desc is read before the work begins, so that a capture without truth is refused at once.
static vt_status compare_with_truth(vt_session *session, const vt_synthetic_desc *desc, work *job) {
  vt_context *context = session->context;
  vt_truth *truth = NULL;
  vt_begin_stage(session);
  vt_status status = vt_create_truth(context, desc, &truth);
  if (!status) status = vt_score_truth(session, &job->tree, truth, vt_is_phantom(desc->kind), &job->truth);
  if (!status) vt_end_stage(session, "truth");
  job->knows_truth = !status;
  vt_destroy_truth(context, truth);
  return status;
}

static vt_status run(vt_session *session) {
  vt_context *context = session->context;
  const vt_arguments *arguments = &session->arguments;
  bool none = false;
  work job = {.file = arguments->operands[0], .source = arguments->operands[1], .background = {1, 1, 1}};
  vt_background_of(arguments, "background", job.background, &none);
  if (none)
    return vt_fail(context, VT_BAD_USAGE,
                   "--background none: photographs are compared over a colour; give white, black or R,G,B");
  vt_synthetic_desc desc;
  char *mesh_text = NULL;
  bool truth = vt_given(arguments, "truth");
  vt_status status = truth ? vt_read_truth_file(context, job.source, &desc, &mesh_text) : VT_OK;
  vt_begin_stage(session);
  if (!status) status = vt_read_tree(context, job.file, &job.tree, NULL);
  if (!status) vt_end_stage(session, "read");
  if (!status) status = vt_load_source(session, job.source, &job.views, &job.capture);
  if (!status) status = choose_views(session, &job);
  if (!status) status = vt_check_same_cameras(context, &job.tree, job.file, &job.views, job.source);
  if (!status) status = judge(session, &job);
  if (!status && truth) status = compare_with_truth(session, &desc, &job);
  if (!status) {
    say_scores(session, &job);
    status = write_report(session, &job);
  }
  double least = vt_number_of(arguments, "min-psnr", 0);
  if (!status && !(job.scores.mean.psnr >= least))
    status = vt_fail(context, VT_BELOW_QUALITY,
                     "%s: its mean PSNR is %.2f dB and --min-psnr is %g; reconstruct it with a higher "
                     "--preset or more photographs",
                     job.file, job.scores.mean.psnr, least);
  vt_free(context, mesh_text);
  vt_free_scores(context, &job.scores);
  vt_free_names(context, &job.held_out);
  vt_free(context, job.judged.items);
  vt_free(context, job.training.items);
  vt_free_capture_report(context, &job.capture);
  vt_free_tree(context, &job.tree);
  vt_free_views(context, &job.views);
  return status;
}

const vt_verb vt_verb_evaluate = {
    .name = "evaluate",
    .operands = "TREE CAPTURE",
    .summary = "measure how well a tree shows photographs",
    .notes = "PSNR and SSIM over the background, PSNR where the photograph has any tree, the "
             "error of opacity, colour difference (CIEDE2000) and sharpness (gradient energy over "
             "the photograph's: below 1 is blurred, above 1 noisy) where it has any tree; means over "
             "the photographs. Beside them what three trivial predictors reach: nothing but white, the nearest "
             "photograph as it is, and the visual hull. Last the PSNR inside the mattes, the share of the tree that "
             "keeps to within 3 pixels of them, and how long its largest connected piece is beside theirs: fog and "
             "broken stems show there. CAPTURE is read with the same flags as in "
             "reconstruct. --report DIR gets truth and "
             "result side by side. The finest level is drawn unless --level says another.",
    .example = "voltree evaluate tree.vtree capture --split test --json scores.json",
    .operand_count = 2,
    .tables = {options, vt_picture_options, vt_source_options, vt_common_options},
    .run = run};
