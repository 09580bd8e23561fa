// suite_skips.c - each thing that is skipped, done and not done: time saved, error added
// SPDX-License-Identifier: BSD-3-Clause
//
// DESIGN.md, section 12. A skip is a switch of a desc. Both ways are timed in turn, and their results compared: PSNR and
// alpha RMSE on photographs that were left out where the tree changes, the pictures themselves where it does not. "time
// saved" is the median without the skip over the median with it: 1 is nothing, 2 is half the time. A skip that adds error
// has to save much; one that saves nothing should go.
#include "programs/suite_tools.h"

#include "base/file.h"
#include "capture/capture.h"
#include "programs/contact_sheet.h"
#include "programs/orbit.h"
#include "programs/stage_options.h"

#include <string.h>

typedef struct work {
  vt_bench *bench;
  vt_context *context;
  vt_captured scene;
  vt_tree tree; // everything skipped that can be
  vt_bench_table *table;
  int done, total;
} work;

static const vt_bench_column columns[] = {{"with", "s", VT_LESS_BETTER, 0.25, 0.005},
                                          {"without", "s", VT_NEITHER_BETTER, 0, 0},
                                          {"time saved", "times", VT_MORE_BETTER, 0.2, 0.05},
                                          {"PSNR with", "dB", VT_MORE_BETTER, 0, 0.1},
                                          {"PSNR lost", "dB", VT_LESS_BETTER, 0, 0.05},
                                          {"alpha RMSE added", "", VT_LESS_BETTER, 0, 0.001},
                                          {"pictures differ", "of 255", VT_LESS_BETTER, 0.05, 0.01},
                                          {"memory saved", "times", VT_MORE_BETTER, 0.05, 0}};
enum { COLUMN_COUNT = 8 };

typedef struct result { // of one skip; index 0: with, 1: without
  vt_spread seconds[2];
  double psnr[2], alpha[2], bytes[2], rms;
} result;

static result no_result(void) { return (result){.psnr = {NAN, NAN}, .alpha = {NAN, NAN}, .bytes = {NAN, NAN}, .rms = NAN}; }

static void put_result(work *w, const char *label, const result *r) {
  vt_add_row(w->table, label);
  vt_put_spread(w->table, r->seconds[0]);
  vt_put_spread(w->table, r->seconds[1]);
  vt_put_value(w->table, r->seconds[1].median / r->seconds[0].median);
  vt_put_value(w->table, r->psnr[0]);
  vt_put_value(w->table, r->psnr[1] - r->psnr[0]);
  vt_put_value(w->table, r->alpha[0] - r->alpha[1]);
  vt_put_value(w->table, r->rms);
  vt_put_value(w->table, r->bytes[1] / r->bytes[0]);
  vt_bench_step(w->bench, ++w->done, w->total);
}

static int repetitions(const work *w) { return vt_repetitions_of(w->bench, vt_is_quick(w->bench) ? 2 : 5); }

// ---- skips of the reconstruction

typedef struct rebuild_skip {
  const char *label;
  vt_method method;
  void (*leave_out)(vt_reconstruct_desc *); // switches the skip off
  bool counts_textures;                     // memory is that of the textures, not the peak
} rebuild_skip;

static void look_at_empty_pixels(vt_reconstruct_desc *d) { d->skip_empty_pixels = false; }
static void walk_anew(vt_reconstruct_desc *d) { d->keep_chords = false; }
static void keep_hidden(vt_reconstruct_desc *d) { d->prune_hidden = false; }
static void keep_thin(vt_reconstruct_desc *d) { d->prune_thin = false; }
static void split_all(vt_reconstruct_desc *d) { d->split_where_needed = false; }
static void refine_on(vt_reconstruct_desc *d) { d->refine_epochs = 12; }

static const rebuild_skip rebuild_skips[] = {{"reconstruct/pixels that meet no coarse cell", VT_METHOD_BEST, look_at_empty_pixels, false},
                                             {"reconstruct/chords kept, not walked anew", VT_METHOD_BEST, walk_anew, false},
                                             {"reconstruct/hidden billboards", VT_METHOD_BEST, keep_hidden, true},
    {"reconstruct/hidden billboards, method 2006", VT_METHOD_2006, keep_hidden, true},
                                             {"reconstruct/cells all but empty", VT_METHOD_BEST, keep_thin, true},
                                             {"reconstruct/cells split where needed", VT_METHOD_BEST, split_all, false},
                                             {"reconstruct/refinement beyond 4 epochs (12)", VT_METHOD_BEST, refine_on, false}};
#define REBUILD_COUNT ((int)(sizeof rebuild_skips / sizeof *rebuild_skips))

typedef struct rebuild_job {
  work *w;
  vt_reconstruct_desc desc[2];
  vt_tree tree[2];
  uint64_t peak[2];
} rebuild_job;

static vt_status rebuild(void *user, int variant) {
  rebuild_job *job = user;
  vt_context *context = job->w->context;
  vt_free_tree(context, &job->tree[variant]);
  uint64_t before = vt_bytes_in_use(context);
  vt_status status = vt_reconstruct(context, &job->desc[variant], &job->w->scene.views, &job->tree[variant], NULL);
  job->peak[variant] = vt_peak_bytes(context) - before;
  return status;
}

static vt_reconstruct_desc usual_desc(void) {
    return vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
}

// Both trees judged and their pictures compared.
static vt_status compare_trees(work *w, const vt_tree *with, const vt_tree *without, result *r) {
  const vt_tree *trees[2] = {with, without};
  vt_drawing drawings[2];
  vt_camera cameras[3];
  vt_difference difference;
  vt_status status = VT_OK;
  for (int i = 0; i < 2 && !status; i++) {
    vt_judgement judgement;
    status = vt_judge_tree(w->context, trees[i], &w->scene.judged, &judgement);
    r->psnr[i] = judgement.psnr, r->alpha[i] = judgement.alpha_textured;
    drawings[i] = (vt_drawing){trees[i], vt_default_render_desc()};
    drawings[i].desc.level = vt_finest_level(trees[i]);
  }
  vt_circle_cameras(with, 0, w->scene.views.items[0].camera.width, 3, cameras);
  if (!status) status = vt_compare_drawings(w->context, &drawings[0], &drawings[1], cameras, 3, &difference);
  if (!status) r->rms = vt_whole_rms(&difference);
  return status;
}

static vt_status measure_rebuild(work *w, const rebuild_skip *skip) {
  rebuild_job job = {.w = w, .desc = {usual_desc(), usual_desc()}};
  result r = no_result();
  job.desc[0].method = job.desc[1].method = skip->method;
  skip->leave_out(&job.desc[1]);
  vt_status status = vt_time_in_turn(w->bench, 2, repetitions(w), rebuild, &job, r.seconds);
  if (!status) status = compare_trees(w, &job.tree[0], &job.tree[1], &r);
  for (int i = 0; i < 2; i++) {
    r.bytes[i] = (double)(skip->counts_textures ? vt_texture_bytes(&job.tree[i]) : job.peak[i]);
    vt_free_tree(w->context, &job.tree[i]);
  }
  if (!status) put_result(w, skip->label, &r);
  return status;
}

// ---- skips of compression

typedef struct pack_job {
  work *w;
  vt_compress_desc desc[2];
  vt_tree raw, tree[2];
} pack_job;

static vt_status pack(void *user, int variant) {
  pack_job *job = user;
  vt_free_tree(job->w->context, &job->tree[variant]);
  return vt_compress_tree(job->w->context, &job->desc[variant], &job->raw, &job->tree[variant], NULL);
}

static vt_status measure_pack(work *w) {
  pack_job job = {.w = w, .desc = {vt_default_compress_desc(), vt_default_compress_desc()}};
  result r = no_result();
  if (vt_is_quick(w->bench))
    for (int i = 0; i < 2; i++) job.desc[i].alpha_codewords = job.desc[i].colour_codewords = 128;
  job.desc[1].set_flat_aside = false;
  vt_reconstruct_desc how = usual_desc();
  how.method = VT_METHOD_2006; // whose trees have tiles
  vt_status status = vt_reconstruct(w->context, &how, &w->scene.views, &job.raw, NULL);
  if (!status) status = vt_time_in_turn(w->bench, 2, repetitions(w), pack, &job, r.seconds);
  if (!status) status = compare_trees(w, &job.tree[0], &job.tree[1], &r);
  for (int i = 0; i < 2; i++) vt_free_tree(w->context, &job.tree[i]);
  vt_free_tree(w->context, &job.raw);
  if (!status) put_result(w, "compress/all-transparent and all-opaque tiles set aside", &r);
  return status;
}

// ---- skips of drawing

typedef struct draw_job {
  work *w;
  vt_drawing drawing[2];
  vt_renderer *renderer[2];
  const vt_camera *cameras;
  int camera_count;
} draw_job;

static vt_status draw(void *user, int variant) {
  draw_job *job = user;
  vt_context *context = job->w->context;
  vt_status status = VT_OK;
  for (int i = 0; i < job->camera_count && !status; i++) {
    vt_fimage picture;
    status = vt_render(context, job->renderer[variant], &job->drawing[variant].desc, &job->cameras[i], &picture, NULL);
    vt_free_fimage(context, &picture);
  }
  return status;
}

static vt_status measure_draw(work *w, const char *label, draw_job *job) {
  result r = no_result();
  vt_difference difference;
  vt_status status = VT_OK;
  for (int i = 0; i < 2 && !status; i++)
    status = vt_create_renderer(w->context, job->drawing[i].tree, VT_BACKEND_CPU, &job->renderer[i]);
  if (!status) status = vt_time_in_turn(w->bench, 2, 2 * repetitions(w) - 1, draw, job, r.seconds);
  if (!status)
    status =
        vt_compare_drawings(w->context, &job->drawing[0], &job->drawing[1], job->cameras, job->camera_count, &difference);
  for (int i = 0; i < 2; i++) vt_destroy_renderer(w->context, job->renderer[i]);
  if (status) return status;
  r.rms = vt_whole_rms(&difference);
  put_result(w, label, &r);
  return VT_OK;
}

static vt_drawing usual_drawing(const work *w) {
  vt_drawing drawing = {&w->tree, vt_default_render_desc()};
  drawing.desc.level = vt_finest_level(&w->tree);
  return drawing;
}

// Empty space knows how far it goes on. The same tree, whose empty space only knows that it is here: rays go brick by
// brick. Borrows everything but the map of the bricks.
static vt_status forget_distances(work *w, vt_tree *out) {
  *out = w->tree;
  vt_brick_map *map = &out->octree.levels[vt_finest_level(&w->tree)].map;
  const int32_t *from = map->entries;
  map->entries = VT_NEW(w->context, int32_t, map->entry_count);
  if (!map->entries) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < map->entry_count; i++) map->entries[i] = from[i] < 0 ? -1 : from[i];
  return VT_OK;
}

#define VIEW_COUNT 4

static vt_status measure_drawing(work *w) {
  int size = vt_is_quick(w->bench) ? 200 : 500;
  vt_camera around[VIEW_COUNT], close[VIEW_COUNT], far[VIEW_COUNT];
  vt_circle_cameras(&w->tree, 0, size, VIEW_COUNT, around);
  vt_circle_cameras(&w->tree, 3, size, VIEW_COUNT, far);
  for (int i = 0; i < VIEW_COUNT; i++) { // an eighth of the picture's width, from the same place: part of the crown
    close[i] = around[i];
    close[i].fx *= 8, close[i].fy *= 8;
  }
  vt_tree plain;
  draw_job hidden = {
      .w = w, .drawing = {usual_drawing(w), usual_drawing(w)}, .cameras = around, .camera_count = VIEW_COUNT};
  draw_job outside = hidden, jumps = hidden;
  hidden.drawing[1].desc.skips &= ~(unsigned)VT_SKIP_HIDDEN;
  outside.drawing[1].desc.skips &= ~(unsigned)VT_SKIP_OUTSIDE;
  outside.cameras = close;
  vt_status status = forget_distances(w, &plain);
  if (status) return status;
  jumps.drawing[1].tree = &plain;
  status = measure_draw(w, "draw/what an opaque ray cannot see", &hidden);
  if (!status) status = measure_draw(w, "draw/cells outside the picture, an eighth of the tree", &outside);
  if (!status) status = measure_draw(w, "draw/empty space jumped over", &jumps);
  jumps.cameras = far;
  if (!status) status = measure_draw(w, "draw/empty space jumped over, tree far away", &jumps);
  vt_free(w->context, plain.octree.levels[vt_finest_level(&plain)].map.entries);
  return status;
}

// ---- levels too fine for the screen

#define OVERSAMPLING 4

// Error of both drawings against the finest level seen through OVERSAMPLING^2 rays a pixel.
static vt_status judge_levels(work *w, draw_job *job, result *r) {
  vt_context *context = w->context;
  vt_difference difference[2] = {{0}};
  vt_status status = VT_OK;
  for (int i = 0; i < job->camera_count && !status; i++) {
    const vt_camera *camera = &job->cameras[i];
    vt_camera large = vt_resize_camera(camera, camera->width * OVERSAMPLING, camera->height * OVERSAMPLING);
    vt_fimage fine = {0}, truth = {0};
    status = vt_render(context, job->renderer[1], &job->drawing[1].desc, &large, &fine, NULL);
    if (!status) status = vt_resample_fimage(context, &fine, camera->width, camera->height, &truth);
    for (int v = 0; v < 2 && !status; v++) {
      vt_fimage picture = {0};
      status = vt_render(context, job->renderer[v], &job->drawing[v].desc, camera, &picture, NULL);
      if (!status) vt_add_difference(&difference[v], &picture, &truth);
      vt_free_fimage(context, &picture);
    }
    vt_free_fimage(context, &fine);
    vt_free_fimage(context, &truth);
  }
  for (int v = 0; v < 2; v++) r->psnr[v] = 20 * log10(255 / vt_tree_rms(&difference[v]));
  return status;
}

static vt_status measure_levels(work *w) {
  static const double distances[] = {1.5, 3, 6, 12, 24, 48};
  int size = vt_is_quick(w->bench) ? 160 : 400;
  vt_status status = VT_OK;
  for (int d = 0; d < 6 && !status; d++) {
    vt_camera cameras[VIEW_COUNT];
    result r = no_result();
    char label[80];
    draw_job job = {
        .w = w, .drawing = {usual_drawing(w), usual_drawing(w)}, .cameras = cameras, .camera_count = VIEW_COUNT};
    job.drawing[0].desc.level = -1;
    vt_circle_cameras(&w->tree, distances[d], size, VIEW_COUNT, cameras);
    for (int i = 0; i < 2 && !status; i++)
      status = vt_create_renderer(w->context, &w->tree, VT_BACKEND_CPU, &job.renderer[i]);
    if (!status) status = vt_time_in_turn(w->bench, 2, 2 * repetitions(w) - 1, draw, &job, r.seconds);
    if (!status) status = judge_levels(w, &job, &r);
    for (int i = 0; i < 2; i++) vt_destroy_renderer(w->context, job.renderer[i]);
    snprintf(label, sizeof label, "draw/levels too fine at %g tree sizes", distances[d]);
    if (!status) put_result(w, label, &r);
  }
  return status;
}

// ---- work whose result is there already

// The order of OpenGL's draw list: kept while the eye stays in its cell, made anew where it left it.
static vt_status measure_order(work *w) {
  vt_renderer *renderer = NULL;
  vt_context *context = w->context;
  vt_drawing drawing = usual_drawing(w);
  vt_camera cameras[9];
  int size = 64; // small: it is the order that is looked at
  vt_status status = vt_create_renderer(context, &w->tree, VT_BACKEND_GL, &renderer);
  if (status == VT_MISSING_PROGRAM) {
    vt_add_sentence(w->bench, "The order of the draw list was not measured: %s", vt_last_error(context));
    vt_clear_error(context);
    vt_bench_step(w->bench, ++w->done, w->total);
    return VT_OK;
  }
  double seconds[2][8];
  vt_circle_cameras(&w->tree, 0.45, size, 9, cameras); // close: another cell each time
  vt_fimage picture = {0};
  if (!status) status = vt_render(context, renderer, &drawing.desc, &cameras[8], &picture, NULL);
  vt_free_fimage(context, &picture);
  for (int i = 0; i < 8 && !status; i++)
    for (int again = 1; again >= 0 && !status; again--) { // first with a new order, then from the same place
      vt_render_report report;
      status = vt_render(context, renderer, &drawing.desc, &cameras[i], &picture, &report);
      seconds[1 - again ? 0 : 1][i] = report.seconds_order;
      vt_free_fimage(context, &picture);
    }
  vt_destroy_renderer(context, renderer);
  if (status) return status;
  result r = no_result();
  r.seconds[0] = vt_spread_of(seconds[0], 8), r.seconds[1] = vt_spread_of(seconds[1], 8);
  put_result(w, "OpenGL/order of an eye that stays in its cell", &r);
  return VT_OK;
}

typedef struct load_job {
  vt_context *context; // a silent one: each reading would be announced
  vt_capture_desc desc[2];
  vt_views views[2];
} load_job;

static vt_status load(void *user, int variant) {
  load_job *job = user;
  vt_free_views(job->context, &job->views[variant]);
  return vt_load_views(job->context, &job->desc[variant], &job->views[variant], NULL);
}

// The same photographs before a plain grey cloth, without their mattes.
static void put_before_cloth(vt_views *views) {
  for (int i = 0; i < views->count; i++) {
    vt_image *picture = &views->items[i].picture;
    size_t count = (size_t)picture->width * (size_t)picture->height;
    for (uint8_t *p = picture->pixels; p < picture->pixels + 4 * count; p += 4) {
      for (int c = 0; c < 3; c++) p[c] = (uint8_t)((p[c] * p[3] + 30 * (255 - p[3])) / 255);
      p[3] = 255;
    }
  }
}

// A tree from each set of views; both judged on the true mattes.
static vt_status compare_mattes(work *w, load_job *job, result *r) {
  vt_tree trees[2] = {{.texel_edge = 0}};
  vt_reconstruct_desc desc = usual_desc();
  vt_status status = VT_OK;
  for (int i = 0; i < 2 && !status; i++) status = vt_reconstruct(w->context, &desc, &job->views[i], &trees[i], NULL);
  if (!status) status = compare_trees(w, &trees[0], &trees[1], r);
  for (int i = 0; i < 2; i++) vt_free_tree(w->context, &trees[i]);
  return status;
}

static vt_status write_both(work *w, char *const folders[2]) {
  vt_views cloth = {0};
  vt_status status = vt_write_capture(w->context, &w->scene.views, folders[0]);
  if (!status) status = vt_copy_views(w->context, &w->scene.views, &cloth);
  if (!status) put_before_cloth(&cloth);
  if (!status) status = vt_write_capture(w->context, &cloth, folders[1]);
  vt_free_views(w->context, &cloth);
  return status;
}

static vt_status measure_mattes(work *w, const char *folder) {
  vt_context *context = w->context;
  vt_context_desc silent = vt_default_context_desc();
  silent.thread_count = vt_thread_count(context);
  silent.log_level = VT_LOG_QUIET;
  char *folders[2] = {vt_join(context, folder, "given"), vt_join(context, folder, "cloth")};
  load_job job = {.context = vt_create_context(&silent), .desc = {vt_default_capture_desc(), vt_default_capture_desc()}};
  result r = no_result();
  vt_status status = folders[0] && folders[1] && job.context ? write_both(w, folders) : VT_OUT_OF_MEMORY;
  for (int i = 0; i < 2; i++) job.desc[i].source = folders[i], job.desc[i].matte = i ? VT_MATTE_BACKDROP : VT_MATTE_ALPHA;
  if (!status) status = vt_time_in_turn(w->bench, 2, repetitions(w), load, &job, r.seconds);
  if (status && job.context) vt_fail(context, status, "%s", vt_last_error(job.context));
  if (!status) status = compare_mattes(w, &job, &r);
  for (int i = 0; i < 2; i++) {
    if (job.context) vt_free_views(job.context, &job.views[i]);
    vt_free(context, folders[i]);
  }
  vt_destroy_context(job.context);
  if (!status) put_result(w, "capture/mattes that are given", &r);
  return status;
}

static vt_status measure_given(work *w) {
  char folder[256];
  vt_status status = vt_make_scratch(w->context, folder);
  if (status) return status;
  status = measure_mattes(w, folder);
  vt_remove_scratch(w->context, folder);
  if (status != VT_MISSING_PROGRAM) return status;
  vt_add_sentence(w->bench, "Given mattes were not measured: %s", vt_last_error(w->context));
  vt_clear_error(w->context);
  vt_bench_step(w->bench, ++w->done, w->total);
  return VT_OK;
}

// ---- the suite

static vt_status take_scene(work *w) {
  vt_synthetic_desc desc;
  VT_ASSERT(vt_find_scene("tree_96", &desc));
  desc.kind = VT_SYNTHETIC_OAK; // a dense crown: much of it is hidden
  desc.width = desc.height = vt_is_quick(w->bench) ? 96 : 256;
  if (vt_is_quick(w->bench))
    desc.leaf_count = 4000;
  else
    desc.train_count = 32, desc.leaf_count = 40000;
  vt_reconstruct_desc how = usual_desc();
  vt_status status = vt_take_photographs(w->context, &desc, &w->scene);
  if (!status) status = vt_reconstruct(w->context, &how, &w->scene.views, &w->tree, NULL);
  if (!status)
    vt_add_sentence(w->bench, "%d photographs of %d x %d pixels; finest level %d with %u cells.", desc.train_count,
                    desc.width, desc.height, vt_finest_level(&w->tree),
                    w->tree.octree.levels[vt_finest_level(&w->tree)].cell_count);
  return status;
}

static vt_status run(vt_bench *bench) {
  work w = {.bench = bench, .context = vt_session_of(bench)->context, .total = REBUILD_COUNT + 1 + 4 + 6 + 1 + 1};
  vt_status status = take_scene(&w);
  w.table = vt_add_table(bench, "skips",
                         "Each skip and the same without it; PSNR of the levels is on the tree, against 16 rays a pixel",
                         columns, COLUMN_COUNT);
  for (int i = 0; i < REBUILD_COUNT && !status; i++) status = measure_rebuild(&w, &rebuild_skips[i]);
  if (!status) status = measure_pack(&w);
  if (!status) status = measure_drawing(&w);
  if (!status) status = measure_levels(&w);
  if (!status) status = measure_order(&w);
  if (!status) status = measure_given(&w);
  vt_add_sentence(bench,
                  "Not here, since nothing in the program does it yet: leaving out photographs that their neighbours "
                  "predict, flat textures, culling whole subtrees. A calibration that is given or kept saves the "
                  "whole of colmap; docs/results.md has its seconds on real photographs.");
  vt_free_tree(w.context, &w.tree);
  vt_free_captured(w.context, &w.scene);
  return status;
}

const vt_suite vt_suite_skips = {"skips", "each skip on and off: time saved, error added", run};
