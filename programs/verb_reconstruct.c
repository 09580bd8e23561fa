// verb_reconstruct.c - voltree reconstruct: from raw photographs to a .vtree
// SPDX-License-Identifier: BSD-3-Clause
//
// load -> hold out -> mend (prepare_views.c) -> reconstruct -> compress -> judge -> write. What goes into the file's metadata
// must not depend on the clock or the number of threads: the same input and options give the same bytes. So times stand in the report
// only, and held-out photographs are judged by the CPU renderer, the same on every machine.
#include "programs/keep_tree.h"
#include "programs/level_sheet.h"
#include "programs/metadata.h"
#include "programs/plan.h"
#include "programs/prepare_views.h"
#include "programs/report.h"
#include "programs/scores.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"
#include "programs/world.h"
#include "reconstruct/reconstruct.h"

#include "base/file.h"

#include <string.h>

// The words stand in the order of vt_method and vt_preset.
static const vt_option options[] = {
    {"output", 'o', VT_OPTION_TEXT, "TREE.vtree", 0, 0, true, "the file to write"},
    {"method", 0, VT_OPTION_CHOICE, "2004|2006|best", 0, 0, false,
     "the method of the two papers, or ours (best, the default)"},
    {"preset", 0, VT_OPTION_CHOICE, "draft|normal|high", 0, 0, false, "how long it works; default: normal"},
    {"time-budget", 0, VT_OPTION_NUMBER, "S", 0.1, 1e7, false,
     "seconds for opacity and textures; fewer iterations and levels are done"},
    {"levels", 0, VT_OPTION_INTEGER, "L", 1, VT_MAX_LEVEL, false,
     "the finest level; default: where a texel is about a pixel of the photographs"},
    {"holdout", 0, VT_OPTION_INTEGER, "N", 2, 1000, false,
     "leave out every N-th photograph and judge the tree on these"},
    {"raw", 0, VT_OPTION_FLAG, "", 0, 0, false, "leave the textures unpacked"},
    {"dry-run", 0, VT_OPTION_FLAG, "", 0, 0, false,
     "print what would be done, what the cache has of it, and about how long it takes; write nothing"},
    {0}};

static const char *const method_names[] = {"2004", "2006", "best"};
static const char *const preset_names[] = {"draft", "normal", "high"};

typedef struct work {
  const char *source, *output;
  vt_reconstruct_desc desc;
  vt_compress_desc packing;
  bool raw, kept; // kept: the raw tree came from the cache
  vt_views views, judged; // judged: borrowed from views
  vt_tree tree;           // what is written
  vt_capture_report capture;
  vt_preparation preparation;
  vt_reconstruct_report reconstruction;
  vt_compress_report compression;
  vt_file_report file;
  uint64_t raw_texture_bytes, texture_bytes;
  vt_scores scores; // count 0: not judged
} work;

// ---- the stages

static vt_status load(vt_session *session, work *job) {
  vt_context *context = session->context;
  vt_status status = vt_load_source(session, job->source, &job->views, &job->capture);
  if (status) return status;
  if (vt_count_views(&job->views, VT_TRAIN) == 0)
    return vt_fail(context, VT_TOO_FEW_VIEWS,
                   "%s: holds no photograph to reconstruct from, only such to judge on; give the folder or "
                   "transforms_train.json",
                   job->source);
  int count = job->views.count;
  job->judged.items = VT_NEW(context, vt_view, (size_t)count);
  vt_role *before = VT_NEW(context, vt_role, (size_t)count);
  if (!before || !job->judged.items) {
    vt_free(context, before);
    return VT_OUT_OF_MEMORY;
  }
  for (int i = 0; i < count; i++) before[i] = job->views.items[i].role;
  vt_hold_out(&job->views, vt_integer_of(&session->arguments, "holdout", 0));
  for (int i = 0; i < count; i++)
    if (before[i] != job->views.items[i].role) job->judged.items[job->judged.count++] = job->views.items[i];
  vt_free(context, before);
  vt_say_source(session, job->source, &job->views, &job->capture);
  return VT_OK;
}

static void note_stages(vt_session *session, const vt_reconstruct_report *report) {
  vt_note_stage(session, "bounds", report->seconds_bounds, 0);
  vt_note_stage(session, "hull", report->seconds_hull, 0);
  vt_note_stage(session, "rays", report->seconds_rays, 0);
  vt_note_stage(session, "opacity", report->seconds_opacity, report->peak_bytes_opacity);
  vt_note_stage(session, "colour", report->seconds_colour, 0);
  vt_note_stage(session, "refinement", report->seconds_refinement, 0);
  vt_note_stage(session, "tiles", report->seconds_tiles, report->peak_bytes_tiles);
}

// The raw tree, from the cache or made.
static vt_status make_raw(vt_session *session, work *job, vt_tree *raw) {
  vt_begin_stage(session);
  char *entry = vt_kept_tree_path(session, &job->desc, &job->views);
  vt_status status = vt_take_kept_tree(session, entry, raw, &job->reconstruction, &job->kept);
  if (!status && !job->kept) {
    status = vt_reconstruct(session->context, &job->desc, &job->views, raw, &job->reconstruction);
    if (!status) vt_end_stage(session, "reconstruct");
    if (!status) note_stages(session, &job->reconstruction);
    if (!status) vt_keep_raw_tree(session, entry, raw, &job->reconstruction);
    if (!status) vt_trim_kept(session);
  } else if (!status) {
    vt_end_stage(session, "reconstruct");
    vt_log(session->context, VT_LOG_NORMAL, "reconstruct: the raw tree is kept from before");
  }
  vt_free(session->context, entry);
  return status;
}

// exact mattes carve alone; estimated ones miss a thin twig now and then, so where there are many, two must agree
static void choose_votes(work *job) {
  bool estimated = job->capture.matte != VT_MATTE_ALPHA && vt_count_views(&job->views, VT_TRAIN) >= 24;
  job->desc.hull_votes = estimated ? 2 : 1;
}

static vt_status build(vt_session *session, work *job) {
  vt_context *context = session->context;
  vt_tree raw = {0};
  choose_votes(job);
  vt_status status = make_raw(session, job, &raw);
  if (status) goto done;
  vt_find_scale(context, &raw, &job->views.world);
  job->raw_texture_bytes = job->texture_bytes = vt_texture_bytes(&raw);
  if (job->raw) {
    job->tree = raw;
    return VT_OK;
  }
  vt_begin_stage(session);
  status = vt_compress_tree(context, &job->packing, &raw, &job->tree, &job->compression);
  if (status) goto done;
  vt_end_stage(session, "compress");
  job->texture_bytes = vt_texture_bytes(&job->tree);
done:
  vt_free_tree(context, &raw);
  return status;
}

static vt_status judge(vt_session *session, work *job) {
  static const float white[3] = {1, 1, 1};
  vt_render_desc desc = vt_default_render_desc();
  desc.level = vt_finest_level(&job->tree);
  if (job->judged.count == 0 || desc.level < 0) return VT_OK;
  vt_begin_stage(session);
  vt_status status =
      vt_score_tree(session, &job->tree, &desc, VT_BACKEND_CPU, white, &job->judged, session->report, &job->scores);
  vt_end_stage(session, "judge");
  return status;
}

// ---- what is known about the tree

static void put_statistics(vt_json_writer *json, const work *job) {
  const vt_octree *octree = &job->tree.octree;
  vt_json_open_array(json, "levels");
  for (int l = 0; l < octree->level_count; l++) {
    const vt_level_report *level = &job->reconstruction.levels[l];
    vt_json_open_object(json, NULL);
    vt_json_put_integer(json, "level", l);
    vt_json_put_integer(json, "cells_before_pruning", level->hull_cells);
    vt_json_put_integer(json, "cells", octree->levels[l].cell_count);
    if (level->billboards) {
      vt_json_put_integer(json, "billboards_of_a_view_least", level->view_least);
      vt_json_put_integer(json, "billboards_of_a_view_median", level->view_median);
      vt_json_put_integer(json, "billboards_of_a_view_most", level->view_most);
      vt_json_put_number(json, "pruned_energy", level->pruned_energy);
      vt_json_put_number(json, "own_alpha_rmse", level->own_alpha_rmse);
    }
    vt_json_put_integer(json, "unsplit_empty", level->unsplit_empty);
    vt_json_put_integer(json, "unsplit_hidden", level->unsplit_hidden);
    vt_json_put_integer(json, "unsplit_for_memory", level->unsplit_for_memory);
    vt_json_put_integer(json, "billboards_before_pruning", (long long)level->billboards_before);
    vt_json_put_integer(json, "billboards", (long long)level->billboards);
    vt_json_put_integer(json, "corners", octree->levels[l].corner_count);
    if (level->mass_factor > 0) vt_json_put_number(json, "mass_factor", level->mass_factor);
    vt_json_put_integer(json, "view_pixels", (long long)vt_count_view_pixels(&job->tree.view_textures[l]));
    vt_json_put_integer(json, "rays", (long long)level->rays);
    vt_json_put_number(json, "saturated_share", level->saturated_share);
    vt_json_put_number(json, "train_alpha_rmse", level->alpha_rmse);
    vt_json_close_object(json);
  }
  vt_json_close_array(json);
  vt_json_put_integer(json, "redundant_views", job->reconstruction.redundant_views);
  vt_json_put_integer(json, "texture_bytes_raw", (long long)job->raw_texture_bytes);
  vt_json_put_integer(json, "texture_bytes", (long long)job->texture_bytes);
  if (!job->raw) vt_report_compression(json, "compression", &job->packing, &job->compression);
  if (job->scores.count) {
    vt_json_open_object(json, "holdout");
    vt_json_put_integer(json, "views", job->scores.count);
    vt_report_metrics(json, &job->scores.mean);
    vt_json_close_object(json);
  }
}

static void put_options(vt_json_writer *json, const vt_session *session, const work *job) {
  const vt_arguments *arguments = &session->arguments;
  vt_json_open_object(json, "options");
  vt_json_put_string(json, "method", method_names[job->desc.method]);
  vt_json_put_string(json, "preset", preset_names[job->desc.preset]);
  vt_json_put_integer(json, "leaf_level", job->reconstruction.leaf_level);
  vt_json_put_number(json, "time_budget", job->desc.time_budget);
  vt_json_put_integer(json, "holdout", vt_integer_of(arguments, "holdout", 0));
  vt_json_put_integer(json, "max_image_size", vt_integer_of(arguments, "max-image-size", 0));
  vt_json_put_bool(json, "raw", job->raw);
  vt_json_close_object(json);
}

static void put_names(vt_json_writer *json, const char *key, const vt_views *views, vt_role role) {
  vt_json_open_array(json, key);
  for (int i = 0; i < views->count; i++)
    if (views->items[i].role == role) vt_json_put_string(json, NULL, views->items[i].name);
  vt_json_close_array(json);
}

static vt_status set_metadata(vt_session *session, work *job) {
  vt_context *context = session->context;
  vt_json_writer json = vt_begin_json(context);
  vt_json_open_object(&json, NULL);
  vt_json_open_object(&json, "asset");
  vt_json_put_string(&json, "generator", "voltree " VT_VERSION);
  vt_json_close_object(&json);
  vt_json_put_string(&json, "source", job->source);
  put_options(&json, session, job);
  vt_json_open_object(&json, "statistics");
  put_statistics(&json, job);
  vt_json_close_object(&json);
  vt_report_preparation(&json, &job->views, &job->preparation, false);
  vt_put_world(&json, &job->tree, &job->views.world);
  put_names(&json, "held_out", &job->judged, VT_TEST);
  put_names(&json, "views", &job->views, VT_TRAIN);
  vt_json_close_object(&json);
  char *text;
  size_t size;
  vt_status status = vt_end_json(&json, &text, &size);
  if (status) return status;
  vt_free(context, job->tree.metadata);
  job->tree.metadata = text;
  return VT_OK;
}

// ---- showing it

static void say_levels(vt_session *session, const work *job) {
  const vt_tree *tree = &job->tree;
  bool tiles = false;
  for (int l = 0; l < tree->octree.level_count; l++) tiles = tiles || tree->tiles[l].view_count;
  vt_say(session, "  level  hull cells       cells     unsplit  %s  alpha RMSE\n",
         tiles ? "billboards      pruned" : "   corners view pixels");
  for (int l = 0; l < tree->octree.level_count; l++) {
    const vt_level_report *level = &job->reconstruction.levels[l];
    unsigned long long made = tiles ? level->billboards : tree->octree.levels[l].corner_count;
    unsigned long long more = tiles ? level->billboards_before - level->billboards
                                    : vt_count_view_pixels(&tree->view_textures[l]);
    vt_say(session, "  %5d %11u %11u %11u %11llu %11llu %11.4f\n", l, (unsigned)level->hull_cells,
           (unsigned)tree->octree.levels[l].cell_count,
           (unsigned)(level->unsplit_empty + level->unsplit_hidden + level->unsplit_for_memory), made, more, level->alpha_rmse);
  }
}

static void say_summary(vt_session *session, const work *job) {
  char a[32], b[32], c[32];
  vt_say(session, "%s: method %s, preset %s, levels 0 to %d, %d photographs\n", job->output,
         method_names[job->desc.method], preset_names[job->desc.preset], job->tree.octree.level_count - 1,
         job->tree.view_count);
  say_levels(session, job);
  vt_say(session, "  textures %s, %s %s; file %s\n", vt_show_bytes(job->raw_texture_bytes, a),
         job->raw ? "unpacked" : "packed", vt_show_bytes(job->texture_bytes, b),
         vt_show_bytes(job->file.file_bytes, c));
  if (!job->raw) vt_say_compression(session, &job->compression);
  vt_say_world(session, &job->tree);
  vt_say(session, "  seconds:");
  for (int i = 0; i < session->stage_count; i++)
    vt_say(session, "%s %s %.1f", i ? "," : "", session->stages[i].name, session->stages[i].seconds);
  vt_say(session, "; in all %.1f; at most %s of memory\n", vt_seconds() - session->start,
         vt_show_bytes(session->peak_bytes, a));
  if (!job->scores.count) return;
  vt_say(session, "  judged on %d photographs that were left out:\n", job->scores.count);
  vt_say_metrics_head(session);
  vt_say_metrics(session, "held out", &job->scores.mean);
}

static vt_status write_report(vt_session *session, work *job) {
  vt_json_writer json = vt_begin_report(session);
  vt_report_source(&json, job->source, &job->views, &job->capture);
  vt_json_put_string(&json, "output", job->output);
  put_options(&json, session, job);
  vt_report_preparation(&json, &job->views, &job->preparation, true);
  put_names(&json, "views_used", &job->views, VT_TRAIN);
  put_names(&json, "held_out", &job->judged, VT_TEST);
  put_statistics(&json, job);
  vt_put_world(&json, &job->tree, &job->views.world);
  vt_json_put_integer(&json, "estimated_bytes", (long long)job->reconstruction.estimated_bytes);
  vt_json_put_integer(&json, "file_bytes", (long long)job->file.file_bytes);
  vt_json_put_bool(&json, "tree_from_cache", job->kept);
  if (job->scores.count) {
    vt_json_open_object(&json, "holdout_scores");
    vt_report_scores(&json, &job->scores, &job->judged);
    vt_json_close_object(&json);
  }
  return vt_end_report(session, &json);
}

static vt_status write_pictures(vt_session *session, const work *job) {
  static const float white[3] = {1, 1, 1};
  if (!session->report || vt_finest_level(&job->tree) < 0 || job->tree.view_count == 0) return VT_OK;
  vt_render_desc desc = vt_default_render_desc();
  char *path = vt_print_text(session->context, "%s/levels.%s", session->report, vt_picture_ending());
  if (!path) return VT_OUT_OF_MEMORY;
  vt_status status =
      vt_write_level_sheet(session, &job->tree, &desc, VT_BACKEND_AUTO, &job->tree.cameras[0], white, path);
  vt_free(session->context, path);
  return status;
}

// Views that need only be read are, since the tree's key is made of them; nothing is written.
static vt_status plan(vt_session *session, work *job) {
  vt_plan p;
  vt_status status = vt_plan_source(session, job->source, &p);
  if (!status && (p.source.views_kept || p.source.views_cheap)) {
    status = load(session, job);
    choose_votes(job);
    char *entry = status ? NULL : vt_kept_tree_path(session, &job->desc, &job->views);
    p.tree_kept = entry && vt_is_folder(entry);
    vt_free(session->context, entry);
  }
  if (!status) status = vt_guess_tree(session, &job->desc, &p);
  if (!status) status = vt_show_plan(session, job->source, job->output, &p);
  vt_free(session->context, job->judged.items);
  vt_free_capture_report(session->context, &job->capture);
  vt_free_views(session->context, &job->views);
  return status;
}

static vt_status run(vt_session *session) {
  vt_context *context = session->context;
  const vt_arguments *arguments = &session->arguments;
  work job = {.source = arguments->operands[0],
              .output = vt_text_of(arguments, "output", ""),
              .packing = vt_compress_desc_of(arguments),
              .raw = vt_given(arguments, "raw")};
  job.desc = vt_default_reconstruct_desc((vt_method)vt_choice_of(arguments, "method", VT_METHOD_BEST),
                                         (vt_preset)vt_choice_of(arguments, "preset", VT_PRESET_NORMAL));
  job.desc.leaf_level = vt_integer_of(arguments, "levels", 0);
  job.desc.time_budget = vt_number_of(arguments, "time-budget", 0);
  if (vt_given(arguments, "dry-run")) return plan(session, &job);
  vt_status status = vt_check_output_file(session, job.output);
  if (!status) status = load(session, &job);
  if (!status) status = vt_prepare_views(session, &job.views, &job.preparation);
  if (!status) status = build(session, &job);
  if (!status) status = judge(session, &job);
  if (!status) status = set_metadata(session, &job);
  if (!status && vt_cancelled(context)) status = VT_CANCELLED;
  vt_begin_stage(session);
  if (!status) status = vt_write_tree(context, &job.tree, job.output, &job.file);
  if (!status) vt_end_stage(session, "write");
  if (!status) say_summary(session, &job);
  if (!status) status = write_pictures(session, &job);
  if (!status) status = write_report(session, &job);
  vt_free_scores(context, &job.scores);
  vt_free_preparation(context, &job.preparation);
  vt_free(context, job.judged.items);
  vt_free_capture_report(context, &job.capture);
  vt_free_tree(context, &job.tree);
  vt_free_views(context, &job.views);
  return status;
}

const vt_verb vt_verb_reconstruct = {.name = "reconstruct",
                                     .operands = "PHOTOS|CAPTURE",
                                     .summary = "make a .vtree from photographs, everything by default",
                                     .notes = "PHOTOS is a folder of photographs, a COLMAP workspace, or a folder with "
                                              "transforms.json; what is already there "
                                              "is used. Photographs of transforms_test.json are never looked at. At "
                                              "least 3 photographs must get a camera; 30 "
                                              "to 60 all around the tree are good.",
                                     .example = "voltree reconstruct photos/ -o tree.vtree --preset draft --holdout 8",
                                     .operand_count = 1,
                                     .tables = {options, vt_preparation_options, vt_source_options, vt_codebook_options,
                                                vt_common_options},
                                     .run = run};
