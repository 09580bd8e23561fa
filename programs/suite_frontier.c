// suite_frontier.c - time against error: presets, time budgets and peers on held-out photographs
// SPDX-License-Identifier: BSD-3-Clause
//
// Error without time, or time without error, can be bought at any price. What counts is the frontier: no method to the
// left of it is as good, none above it as fast. For each capture the presets and a row of time budgets are
// reconstructed, packed and drawn from the held-out views, beside what is reached without any method (the nearest
// photograph, the visual hull with mean colours), by the methods of 2004 and 2006, and by foreign programs
// (bench_peers.h). Everything runs in rounds, one repetition of each thing after the other; the long ones run once.
// Presets give the same bits each time; what a time budget reaches depends on the machine's mood, so a wider noise is
// allowed there.
#include "base/file.h"
#include "base/folders.h"
#include "datasets-synthetic/synthetic.h"
#include "programs/bench_frontier.h"
#include "programs/stage_options.h"
#include "reconstruct/reconstruct.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

static const float white[3] = {1, 1, 1};

// ---- what is run

static vt_frontier_run *add_run(vt_frontier *f, vt_method method, vt_preset preset, double budget) {
  static const char *const methods[] = {"tri-grid 2004", "octree 2006", "voltree"}, *const presets[] = {
                                                                                        "draft", "normal", "high"};
  VT_ASSERT(f->run_count < VT_MAX_FRONTIER_RUNS);
  vt_frontier_run *run = &f->runs[f->run_count++];
  *run = (vt_frontier_run){.method = method, .preset = preset, .budget = budget};
  snprintf(run->series, sizeof run->series, "%s%s", methods[method], budget > 0 ? " in budget" : "");
  if (budget > 0)
    snprintf(run->point, sizeof run->point, "%g s", budget);
  else
    snprintf(run->point, sizeof run->point, "%s", presets[preset]);
  return run;
}

// Presets first: budgets beyond the time that the best of them needs without one would only repeat it.
static void list_runs(vt_frontier *f, bool quick) {
  static const double budgets[] = {2, 5, 10, 20, 45, 90, 180, 300};
  vt_method method = (vt_method)vt_choice_of(&f->session->arguments, "method", VT_METHOD_BEST);
  vt_preset last = quick ? VT_PRESET_DRAFT : VT_PRESET_HIGH, usual = quick ? VT_PRESET_DRAFT : VT_PRESET_NORMAL;
  f->run_count = 0;
  for (int preset = 0; preset <= (int)last; preset++) add_run(f, method, (vt_preset)preset, 0);
  if (method == VT_METHOD_BEST) {
    add_run(f, VT_METHOD_2004, usual, 0);
    add_run(f, VT_METHOD_2006, usual, 0);
  }
  if (quick) add_run(f, method, VT_PRESET_NORMAL, 1);
  for (size_t i = 0; !quick && i < sizeof budgets / sizeof *budgets; i++)
    add_run(f, method, VT_PRESET_HIGH, budgets[i]);
}

static double expected_seconds(const vt_frontier_run *run) {
  return run->budget > 0 ? run->budget + 5 : 20;
}

// ---- one run

// What --sabotage solver breaks: half the optical depth, in cells, corners and texels, as if the solver had stopped half way.
static void thin_tree(vt_tree *tree) {
  size_t texels_of_tile = (size_t)tree->texel_edge * (size_t)tree->texel_edge;
  for (int l = 0; l < tree->octree.level_count; l++) {
    vt_level *level = &tree->octree.levels[l];
    for (uint32_t i = 0; i < level->cell_count; i++) level->optical_depth[i] /= 2;
    for (size_t i = 0; i < level->corner_count; i++) level->corner_values[4 * i] /= 2;
    const vt_tiles *tiles = &tree->tiles[l];
    for (size_t t = 0; tiles->texels && t < tiles->tile_count * texels_of_tile; t++) {
      uint8_t *alpha = &tiles->texels[4 * t + 3];
      *alpha = (uint8_t)(255 * (1 - sqrt(1 - *alpha / 255.0)) + 0.5);
    }
  }
}

// Both clocks go on by half of what they did since the start: what --sabotage slow breaks.
static void waste_time(double start, double start_cpu) {
  double end = 1.5 * vt_seconds() - 0.5 * start, end_cpu = 1.5 * vt_cpu_seconds() - 0.5 * start_cpu;
  while (vt_seconds() < end || vt_cpu_seconds() < end_cpu) continue;
}

static vt_status judge_tree(vt_frontier *f, vt_frontier_run *run, const vt_tree *tree, vt_pictures *keep,
                            vt_metrics *out, double *frame) {
  vt_pictures pictures = {0};
  vt_blend blend = run->method == VT_METHOD_BEST ? VT_BLEND_GEOMETRIC : VT_BLEND_SUM;
  double blur = vt_sabotage_of(f->bench) == VT_SABOTAGE_BLUR ? 1.5 : 0;
  vt_status status = vt_draw_pictures(f->session, tree, blend, blur, &f->judged, &pictures, frame);
  if (!status) status = vt_judge_pictures(f->context, &pictures, &f->judged, white, out);
  if (!status && keep && !keep->count) {
    *keep = pictures;
    for (int i = 1; i < keep->count && !f->peers.count; i++)
      vt_free_image(f->context, &keep->items[i]); // the first is shown
    return VT_OK;
  }
  vt_free_pictures(f->context, &pictures);
  return status;
}

static vt_status weigh_file(vt_frontier *f, const vt_tree *tree, double *bytes) {
  char *path = vt_join(f->context, f->scratch, "weighed.vtree");
  vt_file_report report = {0};
  vt_status status = path ? vt_write_tree(f->context, tree, path, &report) : VT_OUT_OF_MEMORY;
  if (path) unlink(path);
  vt_free(f->context, path);
  *bytes = (double)report.file_bytes;
  return status;
}

static void note_stages(vt_frontier_run *run, const vt_reconstruct_report *r) {
  const double seconds[] = {r->seconds_bounds, r->seconds_hull,       r->seconds_rays, r->seconds_opacity,
                            r->seconds_colour, r->seconds_refinement, r->seconds_tiles};
  for (int i = 0; i < 7; i++) // stages that a method has not take the time of asking
    run->seconds[VT_RUN_BOUNDS + i][run->repetitions] = seconds[i] > 1e-5 ? seconds[i] : 0;
}

static vt_status reconstruct_and_pack(vt_frontier *f, vt_frontier_run *run, vt_tree *raw, vt_tree *packed) {
  vt_context *context = f->context;
  vt_reconstruct_report report;
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(run->method, run->preset);
  vt_compress_desc packing = vt_compress_desc_of(&f->session->arguments);
  desc.time_budget = run->budget;
  int r = run->repetitions;
  uint64_t held = vt_bytes_in_use(context);
  if (vt_peak_bytes(context) > f->session->peak_bytes) f->session->peak_bytes = vt_peak_bytes(context);
  vt_reset_peak(context);
  double start = vt_seconds(), start_cpu = vt_cpu_seconds();
  vt_status status = vt_reconstruct(context, &desc, &f->views, raw, &report);
  if (status) return status;
  if (vt_sabotage_of(f->bench) == VT_SABOTAGE_SLOW) waste_time(start, start_cpu);
  run->seconds[VT_RUN_RECONSTRUCT][r] = vt_seconds() - start;
  run->seconds[VT_RUN_RECONSTRUCT_CPU][r] = vt_cpu_seconds() - start_cpu;
  note_stages(run, &report);
  if (vt_sabotage_of(f->bench) == VT_SABOTAGE_SOLVER) thin_tree(raw);
  double middle = vt_seconds();
  status = vt_compress_tree(context, &packing, raw, packed, NULL);
  run->seconds[VT_RUN_COMPRESS][r] = vt_seconds() - middle;
  run->seconds[VT_RUN_TOTAL][r] = run->seconds[VT_RUN_RECONSTRUCT][r] + run->seconds[VT_RUN_COMPRESS][r];
  run->seconds[VT_RUN_TOTAL_CPU][r] = vt_cpu_seconds() - start_cpu;
  run->peak_bytes[r] = (double)(vt_peak_bytes(context) - held);
  run->leaf_level = report.leaf_level;
  return status;
}

static vt_status repeat_run(vt_frontier *f, vt_frontier_run *run) {
  vt_tree raw = {0}, packed = {0};
  vt_status status = reconstruct_and_pack(f, run, &raw, &packed);
  int r = run->repetitions;
  if (!status) status = judge_tree(f, run, &raw, NULL, &run->raw[r], NULL);
  if (!status) status = judge_tree(f, run, &packed, &run->pictures, &run->packed[r], &run->seconds[VT_RUN_FRAME][r]);
  const vt_tree *const trees[] = {&raw, &packed};
  for (int t = 0; t < 2 && !status; t++) {
    run->textures[t][r] = (double)vt_texture_bytes(trees[t]);
    status = weigh_file(f, trees[t], &run->file[t][r]);
  }
  if (!status) f->centre = vt_tree_centre(&packed);
  run->repetitions++;
  vt_free_tree(f->context, &raw);
  vt_free_tree(f->context, &packed);
  return status;
}

// A budget beyond what the last preset took without one.
static bool is_pointless(const vt_frontier *f, const vt_frontier_run *run) {
  double longest = 0;
  for (int i = 0; i < f->run_count; i++)
    if (f->runs[i].budget == 0 && f->runs[i].method == run->method && f->runs[i].preset == run->preset)
      longest = f->runs[i].seconds[VT_RUN_RECONSTRUCT][0];
  return run->budget > 0 && longest > 0 && run->budget > longest;
}

static vt_status run_rounds(vt_frontier *f) {
  bool asked = vt_given(&f->session->arguments, "repetitions");
  int rounds = vt_repetitions_of(f->bench, vt_is_quick(f->bench) ? 5 : 3);
  vt_status status = VT_OK;
  for (int round = 0; round < rounds && !status; round++)
    for (int i = 0; i < f->run_count && !status; i++) {
      vt_frontier_run *run = &f->runs[i];
      bool long_one = round > 0 && !asked && run->seconds[VT_RUN_TOTAL][0] > 20;
      if (!long_one && !is_pointless(f, run)) status = repeat_run(f, run);
      f->steps_done += round == 0 ? expected_seconds(run) : 1;
      vt_bench_step(f->bench, (int)f->steps_done, (int)fmax(f->steps_done, f->steps_total));
    }
  return status;
}

// ---- one capture

static vt_status run_predictors(vt_frontier *f) {
  for (int p = 0; p < VT_FRONTIER_PREDICTORS; p++) {
    vt_frontier_predictor *out = &f->predictors[p];
    out->predictor = p == 0 ? VT_PREDICT_NEAREST : VT_PREDICT_HULL;
    vt_status status = vt_predict_pictures(f->session, out->predictor, &f->training, &f->judged, f->centre,
                                           &out->pictures, &out->seconds);
    if (!status) status = vt_judge_pictures(f->context, &out->pictures, &f->judged, white, &out->metrics);
    if (status) return status;
  }
  return VT_OK;
}

static vt_status run_peers(vt_frontier *f) {
  vt_context *context = f->context;
  static const double budgets[] = {45, 180};
  if (!f->peers.count) return VT_OK;
  int given = vt_integer_of(&f->session->arguments, "peer-seconds", 0);
  int budget_count = vt_is_quick(f->bench) || given ? 1 : 2;
  char *capture = vt_join(context, f->scratch, "capture");
  f->peer_runs = VT_NEW(context, vt_frontier_peer, (size_t)(f->peers.count * budget_count));
  vt_status status = capture && f->peer_runs ? vt_write_peer_capture(context, &f->views, capture) : VT_OUT_OF_MEMORY;
  for (int p = 0; p < f->peers.count && !status; p++)
    for (int b = 0; b < budget_count && !status; b++) {
      vt_frontier_peer *run = &f->peer_runs[f->peer_run_count++];
      run->peer = &f->peers.items[p];
      run->budget = given ? given : vt_is_quick(f->bench) ? 5 : budgets[b];
      char *out = vt_print_text(context, "%s/out_%d", f->scratch, f->peer_run_count);
      status =
          out ? vt_run_peer(context, run->peer, capture, run->budget, out, &f->judged, &run->result) : VT_OUT_OF_MEMORY;
      if (out) vt_remove_folder(context, out);
      vt_free(context, out);
      f->steps_done += run->budget;
      vt_bench_step(f->bench, (int)f->steps_done, (int)fmax(f->steps_done, f->steps_total));
    }
  if (capture) vt_remove_folder(context, capture);
  vt_free(context, capture);
  return status;
}

// `source`: a folder, or the name of a synthetic scene.
static vt_status load_capture(vt_frontier *f, const char *source) {
  vt_context *context = f->context;
  vt_synthetic_desc desc;
  vt_status status;
  if (!vt_is_folder(source) && vt_find_scene(source, &desc)) {
    status = vt_make_synthetic_views(context, &desc, &f->views);
  } else {
    vt_capture_report report = {0};
    status = vt_load_source(f->session, source, &f->views, &report);
    vt_free_capture_report(context, &report);
  }
  if (status) return status;
  if (vt_count_views(&f->views, VT_TEST) == 0) vt_hold_out(&f->views, 8);
  if (vt_count_views(&f->views, VT_TEST) == 0)
    return vt_fail(context, VT_TOO_FEW_VIEWS, "%s: holds fewer than 8 photographs, none to judge on; add some", source);
  status = vt_select_views(context, &f->views, VT_TRAIN, &f->training);
  return status ? status : vt_select_views(context, &f->views, VT_TEST, &f->judged);
}

static void free_capture(vt_frontier *f) {
  vt_context *context = f->context;
  for (int i = 0; i < f->run_count; i++) vt_free_pictures(context, &f->runs[i].pictures);
  for (int p = 0; p < VT_FRONTIER_PREDICTORS; p++) vt_free_pictures(context, &f->predictors[p].pictures);
  for (int i = 0; i < f->peer_run_count; i++) vt_free_peer_result(context, &f->peer_runs[i].result);
  vt_free(context, f->peer_runs);
  f->peer_runs = NULL;
  f->peer_run_count = f->run_count = 0;
  memset(f->predictors, 0, sizeof f->predictors);
  vt_free(context, f->judged.items);
  vt_free(context, f->training.items);
  f->judged = f->training = (vt_views){0};
  vt_free_views(context, &f->views);
}

static vt_status run_capture(vt_frontier *f, const char *source) {
  vt_plain_name(vt_base_name(source), f->name, sizeof f->name);
  vt_status status = load_capture(f, source);
  if (!status) {
    list_runs(f, vt_is_quick(f->bench));
    status = run_rounds(f);
  }
  if (!status) status = run_predictors(f);
  if (!status) status = run_peers(f);
  if (!status) status = vt_put_frontier(f);
  if (!status) status = vt_put_solvers(f);
  free_capture(f);
  return status;
}

// ---- all of them

// Scenes that this version has, of those that the full suite wants.
static int list_sources(vt_bench *bench, const char *sources[VT_MAX_LISTED]) {
  static const char *const wanted[] = {"oak", "pine", "small_oak", "birch", "willow"};
  vt_session *session = vt_session_of(bench);
  vt_synthetic_desc desc;
  int count = 0;
  for (const char *given; (given = vt_listed_of(&session->arguments, "capture", count));) sources[count++] = given;
  if (count) return count;
  for (size_t i = 0; !vt_is_quick(bench) && i < sizeof wanted / sizeof *wanted; i++)
    if (vt_find_scene(wanted[i], &desc)) sources[count++] = wanted[i];
  if (!count) sources[count++] = "tree_96";
  return count;
}

static vt_status run(vt_bench *bench) {
  const char *sources[VT_MAX_LISTED];
  vt_session *session = vt_session_of(bench);
  vt_frontier *f = VT_NEW(session->context, vt_frontier, 1);
  if (!f) return VT_OUT_OF_MEMORY;
  f->bench = bench, f->session = session, f->context = session->context;
  int count = list_sources(bench, sources);
  vt_status status = vt_list_peers(session, &f->peers);
  if (!status) status = vt_make_scratch_folder(f->context, &f->scratch);
  list_runs(f, vt_is_quick(bench));
  for (int i = 0; i < f->run_count; i++) f->steps_total += expected_seconds(&f->runs[i]) * count;
  f->steps_total += count * f->peers.count * (vt_is_quick(bench) ? 5 : 225);
  for (int i = 0; i < count && !status; i++) status = run_capture(f, sources[i]);
  if (f->scratch) vt_remove_folder(f->context, f->scratch);
  vt_free(f->context, f->scratch);
  vt_free_peers(f->context, &f->peers);
  vt_free(session->context, f);
  return status;
}

const vt_suite vt_suite_frontier = {"frontier",
                                    "time against error: presets, budgets and peers on held-out photographs", run};
