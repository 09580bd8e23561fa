// suite_scaling.c - how time and memory grow with everything that can be made larger
// SPDX-License-Identifier: BSD-3-Clause
//
// One quantity at a time is doubled, everything else stays. Each run is timed in turn with the others of its sweep; its
// peak is what vt_alloc handed out above what was there before it began. Exponents are fitted to ln y over ln x; for
// orientation: foliage behaves as a set of dimension 2.3 to 2.4 (METHODS, section 0), so cells grow by 2^2.4 a level and
// with the pixels of a photograph's edge; time per ray and cell should not grow at all.
#include "programs/suite_tools.h"

#include "programs/forest.h"
#include "programs/stage_options.h"

#include <string.h>

#define MOST 8

typedef struct work {
  vt_bench *bench;
  vt_context *context;
  vt_bench_table *exponents;
  int done, total;
} work;

static void step(work *w) { vt_bench_step(w->bench, ++w->done, w->total); }
static int repetitions(const work *w) { return vt_repetitions_of(w->bench, vt_is_quick(w->bench) ? 1 : 3); }

static vt_synthetic_desc scene_of(const work *w) {
  vt_synthetic_desc desc;
  VT_ASSERT(vt_find_scene("tree_96", &desc));
  desc.test_count = 0;
  if (!vt_is_quick(w->bench)) desc.leaf_count = 6000;
  return desc;
}

// ---- exponents

static const vt_bench_column exponent_columns[] = {{"exponent", "", VT_LESS_BETTER, 0.1, 0.15},
                                                   {"standard error", "", VT_NEITHER_BETTER, 0, 0},
                                                   {"points", "", VT_NEITHER_BETTER, 0, 0}};

static void put_exponent(work *w, const char *label, const double *x, const double *y, int count) {
  vt_power_fit fit = vt_fit_power(x, y, count);
  const double row[] = {fit.exponent, fit.error, fit.count};
  vt_put_values(w->exponents, label, row, 3);
}

// ---- reconstruction over one of its inputs

typedef struct growth {
  const char *name, *x, *caption;
  void (*set)(vt_synthetic_desc *, vt_reconstruct_desc *, double x);
  double values[MOST];
  int count, quick_count;
} growth;

static void set_photographs(vt_synthetic_desc *scene, vt_reconstruct_desc *how, double x) {
  scene->train_count = (int)x;
  how->leaf_level = 5;
}
static void set_pixels(vt_synthetic_desc *scene, vt_reconstruct_desc *how, double x) { // levels follow
  (void)how;
  scene->width = scene->height = (int)x;
}
static void set_level(vt_synthetic_desc *scene, vt_reconstruct_desc *how, double x) {
  scene->width = scene->height = 256;
  how->leaf_level = (int)x;
}

static const growth growths[] = {
    {"photographs", "photographs", "More photographs, leaf level 5", set_photographs, {8, 16, 32, 64, 128}, 5, 4},
    {"pixels",
     "pixels",
     "Larger photographs, the leaf level following: pixels along an edge",
     set_pixels,
     {48, 96, 192, 384},
     4,
     3},
    {"levels", "level", "Deeper trees of the same photographs", set_level, {3, 4, 5, 6, 7}, 5, 4}};
#define GROWTH_COUNT ((int)(sizeof growths / sizeof *growths))

static const vt_bench_column growth_columns[] = {
    {"x", "", VT_NEITHER_BETTER, 0, 0},
    {"seconds", "s", VT_LESS_BETTER, 0.2, 0.02},
    {"peak", "bytes", VT_LESS_BETTER, 0.05, 1e5},
    {"textures", "bytes", VT_LESS_BETTER, 0.02, 0},
    {"cells", "", VT_NEITHER_BETTER, 0, 0},
    {"billboards, or pixels of view textures", "", VT_NEITHER_BETTER, 0, 0},
    {"rays", "", VT_NEITHER_BETTER, 0, 0},
    {"hull", "s", VT_LESS_BETTER, 0.25, 0.02},
    {"rays walked", "s", VT_LESS_BETTER, 0.25, 0.02},
    {"opacity", "s", VT_LESS_BETTER, 0.25, 0.02},
    {"colour", "s", VT_LESS_BETTER, 0.25, 0.02},
    {"refinement", "s", VT_LESS_BETTER, 0.25, 0.02},
    {"textures made", "s", VT_LESS_BETTER, 0.25, 0.02},
    {"walk, per ray", "us", VT_LESS_BETTER, 0.25, 0.02},
    {"opacity, per ray", "us", VT_LESS_BETTER, 0.25, 0.02},
    {"refinement, per ray of the leaf level", "us", VT_LESS_BETTER, 0.25, 0.02},
    {"hull, per cell", "us", VT_LESS_BETTER, 0.25, 0.02},
    {"textures made, per billboard or pixel", "us", VT_LESS_BETTER, 0.25, 0.02}};
enum { X, SECONDS, PEAK, TEXTURES, CELLS, BILLBOARDS, RAYS, STAGES, PER_RAY = STAGES + 6, COLUMN_COUNT = PER_RAY + 5 };

typedef struct growth_job {
  work *w;
  int count;
  vt_captured scenes[MOST];
  vt_reconstruct_desc how[MOST];
  double rows[MOST][COLUMN_COUNT];
} growth_job;

static void note_run(const vt_tree *tree, const vt_reconstruct_report *r, double *row) {
  double rays = 0, tiles = 0, hull_cells = 0, leaf_rays = (double)r->levels[r->leaf_level].rays;
  for (int l = 0; l <= r->leaf_level; l++) {
    rays += (double)r->levels[l].rays;
    tiles += (double)r->levels[l].billboards + (double)vt_count_view_pixels(&tree->view_textures[l]);
    hull_cells += r->levels[l].hull_cells;
  }
  row[TEXTURES] = (double)vt_texture_bytes(tree);
  row[CELLS] = tree->octree.levels[r->leaf_level].cell_count;
  row[BILLBOARDS] = tiles;
  row[RAYS] = rays;
  const double stages[] = {r->seconds_hull,   r->seconds_rays,       r->seconds_opacity,
                           r->seconds_colour, r->seconds_refinement, r->seconds_tiles};
  memcpy(row + STAGES, stages, sizeof stages);
  const double per[] = {r->seconds_rays / rays, r->seconds_opacity / rays, r->seconds_refinement / leaf_rays,
                        r->seconds_hull / hull_cells, r->seconds_tiles / tiles};
  for (int i = 0; i < 5; i++) row[PER_RAY + i] = 1e6 * per[i];
}

static vt_status reconstruct_one(void *user, int variant) {
  growth_job *job = user;
  vt_context *context = job->w->context;
  vt_tree tree = {0};
  vt_reconstruct_report report;
  uint64_t before = vt_bytes_in_use(context);
  vt_status status = vt_reconstruct(context, &job->how[variant], &job->scenes[variant].views, &tree, &report);
  job->rows[variant][PEAK] = (double)(vt_peak_bytes(context) - before);
  if (!status) note_run(&tree, &report, job->rows[variant]);
  vt_free_tree(context, &tree);
  step(job->w);
  return status;
}

static void put_growth_exponents(work *w, const growth *g, const growth_job *job) {
  static const struct {
    int column;
    const char *name;
  } fitted[] = {{SECONDS, "seconds"}, {PEAK, "peak"},         {CELLS, "cells"},
                {RAYS, "rays"},       {TEXTURES, "textures"}, {PER_RAY, "walk, per ray"}};
  bool levels = g->set == set_level;
  double x[MOST], y[MOST], cells[MOST];
  char label[80];
  for (int i = 0; i < job->count; i++) {
    x[i] = levels ? pow(2, job->rows[i][X]) : job->rows[i][X];
    cells[i] = job->rows[i][CELLS];
  }
  for (size_t f = 0; f < sizeof fitted / sizeof *fitted; f++) {
    for (int i = 0; i < job->count; i++) y[i] = job->rows[i][fitted[f].column];
    snprintf(label, sizeof label, "%s over %s", fitted[f].name, levels ? "cells along an edge" : g->x);
    put_exponent(w, label, x, y, job->count);
    if (!levels || fitted[f].column == CELLS) continue;
    snprintf(label, sizeof label, "%s over cells", fitted[f].name);
    put_exponent(w, label, cells, y, job->count);
  }
}

static void put_growth(work *w, const growth *g, const growth_job *job, const vt_spread *seconds) {
  vt_bench_table *table = vt_add_table(w->bench, g->name, g->caption, growth_columns, COLUMN_COUNT);
  char label[48], name[48];
  for (int i = 0; i < job->count; i++) {
    snprintf(label, sizeof label, "%s %g", g->x, g->values[i]);
    vt_add_row(table, label);
    for (int c = 0; c < COLUMN_COUNT; c++)
      vt_put_spread(table, c == SECONDS ? seconds[i] : (vt_spread){job->rows[i][c], job->rows[i][c], job->rows[i][c]});
  }
  bool levels = g->set == set_level;
  snprintf(name, sizeof name, "%s_seconds", g->name);
  vt_add_plot(w->bench, table, &(vt_plot){name, "Seconds", "x", "seconds", !levels, true, false});
  snprintf(name, sizeof name, "%s_peak", g->name);
  vt_add_plot(w->bench, table, &(vt_plot){name, "Peak memory", "x", "peak", !levels, true, false});
  if (levels)
    vt_add_plot(w->bench, table, &(vt_plot){"cells_seconds", "Seconds over cells", "cells", "seconds", true, true, false});
  if (levels)
    vt_add_plot(w->bench, table, &(vt_plot){"cells_peak", "Peak memory over cells", "cells", "peak", true, true, false});
}

static vt_status run_growth(work *w, const growth *g) {
  growth_job job = {.w = w, .count = vt_is_quick(w->bench) ? g->quick_count : g->count};
  vt_spread seconds[MOST];
  vt_status status = VT_OK;
  for (int i = 0; i < job.count && !status; i++) {
    vt_synthetic_desc scene = scene_of(w);
    job.how[i] = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
    g->set(&scene, &job.how[i], g->values[i]);
    job.rows[i][X] = g->values[i];
    status = vt_take_photographs(w->context, &scene, &job.scenes[i]);
  }
  if (!status) status = vt_time_in_turn(w->bench, job.count, repetitions(w), reconstruct_one, &job, seconds);
  for (int i = 0; i < job.count; i++) {
    if (!status) job.rows[i][SECONDS] = seconds[i].median;
    vt_free_captured(w->context, &job.scenes[i]);
  }
  if (status) return status;
  put_growth(w, g, &job, seconds);
  put_growth_exponents(w, g, &job);
  return VT_OK;
}

// ---- compression over the size of the codebook

static const vt_bench_column codebook_columns[] = {
    {"codewords", "", VT_NEITHER_BETTER, 0, 0},     {"seconds", "s", VT_LESS_BETTER, 0.2, 0.02},
    {"training", "s", VT_LESS_BETTER, 0.25, 0.02},  {"encoding", "s", VT_LESS_BETTER, 0.25, 0.02},
    {"peak", "bytes", VT_LESS_BETTER, 0.05, 1e5},   {"packed", "bytes", VT_LESS_BETTER, 0.02, 0},
    {"colour PSNR", "dB", VT_MORE_BETTER, 0, 0.05}, {"alpha RMSE", "", VT_LESS_BETTER, 0.02, 0}};

typedef struct codebook_job {
  work *w;
  const vt_tree *raw;
  vt_compress_report reports[MOST];
  double peak[MOST];
} codebook_job;

static vt_status compress_one(void *user, int variant) {
  codebook_job *job = user;
  vt_context *context = job->w->context;
  vt_compress_desc desc = vt_default_compress_desc();
  vt_tree packed = {0};
  desc.alpha_codewords = desc.colour_codewords = 64 << variant;
  vt_reset_peak(context);
  uint64_t before = vt_bytes_in_use(context);
  vt_status status = vt_compress_tree(context, &desc, job->raw, &packed, &job->reports[variant]);
  job->peak[variant] = (double)(vt_peak_bytes(context) - before);
  vt_free_tree(context, &packed);
  step(job->w);
  return status;
}

// Of method 2006, whose tiles are what these codebooks are for.
static vt_status run_codebooks(work *w, const vt_views *views) {
  int count = vt_is_quick(w->bench) ? 4 : 7;
  vt_tree raw = {0};
  vt_reconstruct_desc how = vt_default_reconstruct_desc(VT_METHOD_2006, VT_PRESET_NORMAL);
  codebook_job job = {.w = w, .raw = &raw};
  vt_spread seconds[MOST];
  double x[MOST], y[3][MOST];
  vt_status status = vt_reconstruct(w->context, &how, views, &raw, NULL);
  if (!status) status = vt_time_in_turn(w->bench, count, repetitions(w), compress_one, &job, seconds);
  vt_free_tree(w->context, &raw);
  if (status) return status;
  vt_bench_table *table =
      vt_add_table(w->bench, "codebooks", "Method 2006: larger codebooks, of alpha and of colour alike", codebook_columns, 8);
  for (int i = 0; i < count; i++) {
    const vt_compress_report *r = &job.reports[i];
    char label[32];
    x[i] = 64 << i, y[0][i] = seconds[i].median, y[1][i] = r->seconds_training, y[2][i] = r->seconds_encoding;
    snprintf(label, sizeof label, "codewords %d", 64 << i);
    vt_add_row(table, label);
    vt_put_value(table, x[i]);
    vt_put_spread(table, seconds[i]);
    const double rest[] = {r->seconds_training,     r->seconds_encoding, job.peak[i],
                           (double)r->packed_bytes, r->colour_psnr,      r->alpha_rmse};
    for (int c = 0; c < 6; c++) vt_put_value(table, rest[c]);
  }
  put_exponent(w, "compression: seconds over codewords", x, y[0], count);
  put_exponent(w, "compression: training over codewords", x, y[1], count);
  put_exponent(w, "compression: encoding over codewords", x, y[2], count);
  vt_add_plot(w->bench, table,
              &(vt_plot){"codebooks", "Seconds over codewords", "codewords", "seconds", true, true, false});
  return VT_OK;
}

// ---- drawing over the number of trees

static const vt_bench_column forest_columns[] = {{"trees", "", VT_NEITHER_BETTER, 0, 0},
                                                 {"seconds a frame", "s", VT_LESS_BETTER, 0.2, 0.005},
                                                 {"drawn", "", VT_NEITHER_BETTER, 0, 0},
                                                 {"billboards", "", VT_NEITHER_BETTER, 0, 0},
                                                 {"per tree drawn", "ms", VT_LESS_BETTER, 0.25, 0.1}};

typedef struct forest_job {
  work *w;
  vt_forest forest;
  const int *sizes;
  bool walker;
  vt_forest_report reports[MOST];
} forest_job;

static vt_status draw_one(void *user, int variant) {
  forest_job *job = user;
  vt_context *context = job->w->context;
  vt_render_desc desc = vt_default_render_desc();
  vt_fimage picture = {0};
  vt_status status = vt_plant_forest(context, &job->forest, job->sizes[variant], 1);
  double reach = vt_forest_reach(&job->forest);
  vt_vec3 eye = job->walker ? vt_v3(-reach - 0.6, 0.1, 0.4) : vt_v3(-3.2 * reach, 0.3 * reach, 1.2 * reach);
  vt_camera camera = vt_look_at(eye, vt_v3(0, 0, job->walker ? 0.5 : 0.3), vt_v3(0, 0, 1), 0.7, 480, 320);
  if (!status) status = vt_draw_forest(context, &job->forest, &desc, &camera, &picture, &job->reports[variant]);
  vt_free_fimage(context, &picture);
  step(job->w);
  return status;
}

static void put_forests(work *w, vt_bench_table *table, const forest_job *job, const vt_spread *seconds, int count) {
  const char *series = job->walker ? "walker" : "overview";
  double x[MOST], y[MOST];
  char label[64];
  for (int i = 0; i < count; i++) {
    const vt_forest_report *r = &job->reports[i];
    x[i] = job->sizes[i], y[i] = seconds[i].median;
    snprintf(label, sizeof label, "%s/trees %d", series, job->sizes[i]);
    vt_add_row(table, label);
    vt_put_value(table, job->sizes[i]);
    vt_put_spread(table, seconds[i]);
    vt_put_value(table, r->drawn);
    vt_put_value(table, (double)r->billboards);
    vt_put_value(table, 1000 * seconds[i].median / r->drawn);
  }
  snprintf(label, sizeof label, "drawing: seconds over trees, %s", series);
  put_exponent(w, label, x, y, count);
}

static vt_status run_forests(work *w, const vt_tree *raw) {
  static const int sizes[] = {1, 4, 16, 64, 256, 1024};
  int count = vt_is_quick(w->bench) ? 5 : 6;
  forest_job job = {.w = w, .sizes = sizes};
  vt_spread seconds[MOST];
  vt_bench_table *table = vt_add_table(
      w->bench, "trees",
      "More trees in a picture of 480 x 320 pixels, levels by distance, on the processor: an overview shows them all, ever "
      "smaller; a walker before the first row sees new ones behind those that are there",
      forest_columns, 5);
  vt_status status = vt_begin_forest(w->context, &raw, 1, VT_BACKEND_CPU, &job.forest);
  for (int walker = 0; walker < 2 && !status; walker++) {
    job.walker = walker;
    status = vt_time_in_turn(w->bench, count, 3, draw_one, &job, seconds);
    if (!status) put_forests(w, table, &job, seconds, count);
  }
  vt_free_forest(w->context, &job.forest);
  if (status) return status;
  vt_add_plot(w->bench, table,
              &(vt_plot){"trees", "Seconds a frame over trees", "trees", "seconds a frame", true, true, true});
  return VT_OK;
}

// ---- threads: contexts of their own

static const vt_bench_column thread_columns[] = {{"threads", "", VT_NEITHER_BETTER, 0, 0},
                                                 {"reconstruct", "s", VT_LESS_BETTER, 0.2, 0.02},
                                                 {"compress", "s", VT_LESS_BETTER, 0.2, 0.02},
                                                 {"reconstruct, times faster than one", "times", VT_MORE_BETTER, 0.15, 0},
                                                 {"compress, times faster than one", "times", VT_MORE_BETTER, 0.15, 0}};

typedef struct thread_job {
  work *w;
  vt_captured scene;
  vt_reconstruct_desc how;
  vt_tree raw; // to be compressed
  bool compress;
} thread_job;

static vt_status run_with_threads(void *user, int variant) {
  thread_job *job = user;
  vt_context_desc desc = vt_default_context_desc();
  vt_compress_desc packing = vt_default_compress_desc();
  desc.thread_count = variant + 1;
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  if (!context) return vt_fail(job->w->context, VT_FAILED, "threads: could not be started; close other programs");
  vt_tree tree = {0};
  packing.alpha_codewords = packing.colour_codewords = 256;
  vt_status status = job->compress ? vt_compress_tree(context, &packing, &job->raw, &tree, NULL)
                                   : vt_reconstruct(context, &job->how, &job->scene.views, &tree, NULL);
  if (status) vt_fail(job->w->context, status, "%s", vt_last_error(context));
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
  step(job->w);
  return status;
}

static vt_status run_threads(work *w, thread_job *job) {
  enum { COUNT = 4 };
  vt_spread seconds[2][COUNT];
  vt_status status = VT_OK;
  for (int stage = 0; stage < 2 && !status; stage++) {
    job->compress = stage;
    status = vt_time_in_turn(w->bench, COUNT, vt_is_quick(w->bench) ? 1 : 3, run_with_threads, job, seconds[stage]);
  }
  if (status) return status;
  vt_bench_table *table = vt_add_table(
      w->bench, "threads", "More threads; the machine's cores are named in the report's head", thread_columns, 5);
  for (int i = 0; i < COUNT; i++) {
    char label[32];
    snprintf(label, sizeof label, "threads %d", i + 1);
    vt_add_row(table, label);
    vt_put_value(table, i + 1);
    vt_put_spread(table, seconds[0][i]);
    vt_put_spread(table, seconds[1][i]);
    vt_put_value(table, seconds[0][0].median / seconds[0][i].median);
    vt_put_value(table, seconds[1][0].median / seconds[1][i].median);
  }
  vt_add_plot(w->bench, table, &(vt_plot){"threads", "Seconds over threads", "threads", "reconstruct", true, true, false});
  return VT_OK;
}

// ---- the suite

static vt_status run_on_one_tree(work *w) {
  thread_job job = {.w = w, .how = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL)};
  vt_synthetic_desc scene = scene_of(w);
  if (!vt_is_quick(w->bench)) scene.width = scene.height = 192;
  vt_status status = vt_take_photographs(w->context, &scene, &job.scene);
  if (!status) status = vt_reconstruct(w->context, &job.how, &job.scene.views, &job.raw, NULL);
  if (!status) status = run_codebooks(w, &job.scene.views);
  if (!status) status = run_forests(w, &job.raw);
  if (!status) status = run_threads(w, &job);
  vt_free_tree(w->context, &job.raw);
  vt_free_captured(w->context, &job.scene);
  return status;
}

static vt_status run(vt_bench *bench) {
  work w = {.bench = bench, .context = vt_session_of(bench)->context};
  bool quick = vt_is_quick(bench);
  int times = repetitions(&w), runs = quick ? 4 : 7;
  for (int i = 0; i < GROWTH_COUNT; i++) runs += quick ? growths[i].quick_count : growths[i].count;
  w.total = times * runs + 6 * (quick ? 5 : 6) + (quick ? 1 : 3) * 8;
  w.exponents =
      vt_add_table(bench, "exponents", "y grows as x to this power, everything else unchanged", exponent_columns, 3);
  vt_status status = VT_OK;
  for (int i = 0; i < GROWTH_COUNT && !status; i++) status = run_growth(&w, &growths[i]);
  return status ? status : run_on_one_tree(&w);
}

const vt_suite vt_suite_scaling = {
    "scaling", "how time and memory grow with photographs, pixels, levels, cells, codebooks, trees and threads", run};
