// suite_stability.c - error curves over everything that may disturb a reconstruction
// SPDX-License-Identifier: BSD-3-Clause
//
// DESIGN.md, section 11. One scene is reconstructed again and again, each time with one disturbance of a known amount, and
// judged on photographs that were left out and are undamaged: alpha RMSE of the cells alone (flat) and with their textures,
// and PSNR. Two kinds of curves come out. Units, places, order of photographs and threads must change nothing (or, for the
// order, little, since subsets of photographs take their turns): their curves are flat, and "change" holds the RMS by
// which the pictures differ from those of the undisturbed run. Noise, poses and focal lengths must cost error gracefully.
// Clustered cameras and saturated rays are measured on phantoms, whose mattes are exact line integrals from anywhere.
#include "programs/suite_tools.h"

#include "base/hash.h"
#include "base/rng.h"
#include "programs/orbit.h"
#include "programs/stage_options.h"

#include <string.h>

#define MOST_AMOUNTS 8
#define DEGREE (VT_PI / 180)

typedef struct work work;

typedef struct sweep { // one curve
  const char *name, *caption, *x;
  vt_status (*disturb)(work *, double amount, vt_views *);
  double amounts[MOST_AMOUNTS]; // the first is none at all; ends with the count
  int count, quick_count;       // quick: so many, evenly from the first to the last
  bool log_x;
} sweep;

struct work {
  vt_bench *bench;
  vt_context *context;
  vt_captured scene;
  vt_reconstruct_desc desc;
  vt_fimage *undisturbed; // [judged] pictures of the first amount
  int done, total;
};

static const vt_bench_column columns[] = {{"amount", "", VT_NEITHER_BETTER, 0, 0},
                                          {"PSNR", "dB", VT_MORE_BETTER, 0, 0.1},
                                          {"alpha RMSE, flat", "", VT_LESS_BETTER, 0.02, 0.001},
                                          {"alpha RMSE, textured", "", VT_LESS_BETTER, 0.02, 0.001},
                                          {"change", "of 255", VT_NEITHER_BETTER, 0, 0},
                                          {"cells", "", VT_NEITHER_BETTER, 0, 0},
                                          {"saturated rays", "share", VT_NEITHER_BETTER, 0, 0}};
enum { AMOUNT, PSNR, FLAT, TEXTURED, CHANGE, CELLS, SATURATED, COLUMN_COUNT };

// ---- disturbances

static vt_status scale_world(work *w, double factor, vt_views *views) {
  (void)w;
  for (int i = 0; i < views->count; i++)
    views->items[i].camera.translation = vt_scale(views->items[i].camera.translation, factor);
  return VT_OK;
}

static vt_status shift_world(work *w, double heights, vt_views *views) { // the object is about 2 units high
  (void)w;
  vt_vec3 way = vt_scale(vt_v3(1, -1, 0.5), 2 * heights);
  for (int i = 0; i < views->count; i++) {
    vt_camera *camera = &views->items[i].camera;
    camera->translation = vt_sub(camera->translation, vt_mul(&camera->rotation, way));
  }
  return VT_OK;
}

// Damages the photographs to reconstruct from; those to judge against stay as they are.
static vt_status damage(work *w, vt_damage_desc desc, vt_views *views) {
  vt_views train;
  vt_status status = vt_select_views(w->context, views, VT_TRAIN, &train);
  if (status) return status;
  status = vt_damage_views(w->context, &desc, &train);
  for (int i = 0, k = 0; i < views->count; i++) // what was damaged in place goes back: cameras and, if made anew, pictures
    if (views->items[i].role == VT_TRAIN) views->items[i] = train.items[k++];
  vt_free(w->context, train.items);
  return status;
}

#define DAMAGE(name, field)                                                                                                \
  static vt_status name(work *w, double amount, vt_views *views) {                                                         \
    vt_damage_desc desc = vt_default_damage_desc();                                                                        \
    desc.field = amount;                                                                                                   \
    return damage(w, desc, views);                                                                                         \
  }
DAMAGE(add_matte_noise, matte_noise)
DAMAGE(add_sensor_noise, noise)
DAMAGE(turn_cameras, pose_degrees)
DAMAGE(change_focal_length, focal_share)

// 0: as they are; 1: backwards; others: shuffled. Photographs to judge against keep their places.
static vt_status reorder(work *w, double amount, vt_views *views) {
  (void)w;
  vt_rng rng = vt_seed_rng((uint64_t)amount, 0x6f72646572);
  int count = vt_count_views(views, VT_TRAIN); // stand first in a synthetic capture
  for (int i = 0; i < count && amount > 0; i++) {
    int other = amount == 1 ? (i < count / 2 ? count - 1 - i : i) : i + (int)(vt_random_unit(&rng) * (count - i));
    vt_view view = views->items[i];
    VT_ASSERT(views->items[other].role == VT_TRAIN);
    views->items[i] = views->items[other];
    views->items[other] = view;
  }
  return VT_OK;
}

static const sweep sweeps[] = {
    {"scale", "World units: all cameras scaled; nothing may change", "factor", scale_world, {1, 1e-6, 1e-3, 1e3, 1e6}, 5, 5, true},
    {"shift", "World's origin: all cameras shifted, in heights of the tree; nothing may change", "heights", shift_world,
     {0, 1, 1e2, 1e4, 1e5, 1e6}, 6, 4, true},
    {"order", "Photographs in another order: 1 backwards, 2 and more shuffled", "order", reorder, {0, 1, 2, 3, 4}, 5, 3, false},
    {"matte_noise", "Noise of mattes, deviation of alpha 0..1", "deviation", add_matte_noise,
     {0, 0.01, 0.02, 0.05, 0.1, 0.2}, 6, 4, false},
    {"sensor_noise", "Noise of the sensor at mid grey, deviation 0..1", "deviation", add_sensor_noise,
     {0, 0.01, 0.02, 0.05, 0.1, 0.2}, 6, 3, false},
    {"pose", "Each camera turned about its centre by a normally distributed angle", "degrees", turn_cameras,
     {0, 0.05, 0.1, 0.2, 0.5, 1}, 6, 4, false},
    {"focal", "A common error of the focal length", "share", change_focal_length,
     {0, 0.002, 0.005, 0.01, 0.02, 0.05}, 6, 3, false}};
#define SWEEP_COUNT ((int)(sizeof sweeps / sizeof *sweeps))

// ---- one amount

static void step(work *w) { vt_bench_step(w->bench, ++w->done, w->total); }

static void free_undisturbed(work *w, int count) {
  for (int i = 0; i < count && w->undisturbed; i++) vt_free_fimage(w->context, &w->undisturbed[i]);
  vt_free(w->context, w->undisturbed);
  w->undisturbed = NULL;
}

// RMS 0..255 between this tree's pictures and those of the first amount, which are kept where there are none yet.
static vt_status measure_change(work *w, const vt_tree *tree, const vt_views *judged, double *change) {
  vt_renderer *renderer = NULL;
  vt_render_desc desc = vt_default_render_desc();
  vt_difference difference = {0};
  bool first = !w->undisturbed;
  if (first) w->undisturbed = VT_NEW(w->context, vt_fimage, (size_t)judged->count);
  vt_status status = w->undisturbed ? vt_create_renderer(w->context, tree, VT_BACKEND_CPU, &renderer) : VT_OUT_OF_MEMORY;
  desc.level = vt_finest_level(tree);
  for (int i = 0; i < judged->count && !status; i++) {
    vt_fimage picture = {0};
    status = vt_render(w->context, renderer, &desc, &judged->items[i].camera, &picture, NULL);
    if (status) break;
    if (first) w->undisturbed[i] = picture;
    vt_add_difference(&difference, &w->undisturbed[i], &picture);
    if (!first) vt_free_fimage(w->context, &picture);
  }
  vt_destroy_renderer(w->context, renderer);
  *change = vt_whole_rms(&difference);
  return status;
}

static void put_judgement(double *row, const vt_judgement *judgement, const vt_tree *tree,
                          const vt_reconstruct_report *report) {
  const vt_level_report *leaf = &report->levels[report->leaf_level];
  row[PSNR] = judgement->psnr;
  row[FLAT] = judgement->alpha_flat;
  row[TEXTURED] = judgement->alpha_textured;
  row[CELLS] = tree->octree.levels[report->leaf_level].cell_count;
  row[SATURATED] = leaf->saturated_share;
}

static vt_status measure(work *w, const vt_views *views, double *row) {
  vt_context *context = w->context;
  vt_tree tree = {0};
  vt_views judged = {0};
  vt_reconstruct_report report;
  vt_judgement judgement;
  vt_status status = vt_select_views(context, views, VT_TEST, &judged);
  if (!status) status = vt_reconstruct(context, &w->desc, views, &tree, &report);
  if (!status) status = vt_judge_tree(context, &tree, &judged, &judgement);
  if (!status) status = measure_change(w, &tree, &judged, &row[CHANGE]);
  if (!status) put_judgement(row, &judgement, &tree, &report);
  vt_free(context, judged.items);
  vt_free_tree(context, &tree);
  return status;
}

static void clear_row(double *row, double amount) {
  for (int c = 0; c < COLUMN_COUNT; c++) row[c] = NAN;
  row[AMOUNT] = amount;
}

static void add_curve(work *w, const vt_bench_table *table, const char *name, const char *caption, bool log_x) {
  vt_add_plot(w->bench, table, &(vt_plot){name, caption, "amount", "alpha RMSE, textured", log_x, false, false});
}

static vt_status run_sweep(work *w, const sweep *s) {
  vt_status status = VT_OK;
  int count = vt_is_quick(w->bench) ? s->quick_count : s->count;
  vt_bench_table *table = vt_add_table(w->bench, s->name, s->caption, columns, COLUMN_COUNT);
  for (int i = 0; i < count && !status; i++) {
    vt_views views = {0};
    double row[COLUMN_COUNT];
    char label[80], text[32];
    double amount = s->amounts[i * (s->count - 1) / (count - 1)];
    clear_row(row, amount);
    status = vt_copy_views(w->context, &w->scene.views, &views);
    if (!status) status = s->disturb(w, amount, &views);
    if (!status) status = measure(w, &views, row);
    vt_free_views(w->context, &views);
    snprintf(label, sizeof label, "%s %s", s->x, vt_show_amount(amount, text));
    if (!status) vt_put_values(table, label, row, COLUMN_COUNT);
    step(w);
  }
  free_undisturbed(w, w->scene.judged.count);
  if (!status) add_curve(w, table, s->name, s->caption, s->log_x);
  return status;
}

// ---- threads: contexts of their own

static vt_status measure_threads(work *w, int threads, uint64_t *hash) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads;
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  if (!context) return vt_fail(w->context, VT_FAILED, "threads: %d could not be started; close other programs", threads);
  vt_tree raw = {0}, packed = {0};
  vt_compress_desc packing = vt_default_compress_desc();
  vt_fimage picture = {0};
  vt_renderer *renderer = NULL;
  vt_render_desc drawing = vt_default_render_desc();
  vt_status status = vt_reconstruct(context, &w->desc, &w->scene.views, &raw, NULL);
  if (!status) status = vt_compress_tree(context, &packing, &raw, &packed, NULL);
  if (!status) status = vt_create_renderer(context, &packed, VT_BACKEND_CPU, &renderer);
  if (!status) status = vt_render(context, renderer, &drawing, &w->scene.judged.items[0].camera, &picture, NULL);
  if (status)
    vt_fail(w->context, status, "%s", vt_last_error(context));
  else {
    size_t floats = 4 * (size_t)picture.width * (size_t)picture.height;
    hash[0] = vt_hash_tree(&raw), hash[1] = vt_hash_tree(&packed);
    hash[2] = vt_hash(picture.pixels, floats * sizeof *picture.pixels, 0);
  }
  vt_destroy_renderer(context, renderer);
  vt_free_fimage(context, &picture);
  vt_free_tree(context, &raw);
  vt_free_tree(context, &packed);
  vt_destroy_context(context);
  return status;
}

static const vt_bench_column thread_columns[] = {{"threads", "", VT_NEITHER_BETTER, 0, 0},
                                                 {"same raw tree", "", VT_MORE_BETTER, 0, 0},
                                                 {"same packed tree", "", VT_MORE_BETTER, 0, 0},
                                                 {"same picture", "", VT_MORE_BETTER, 0, 0}};

static vt_status run_threads(work *w) {
  vt_bench_table *table =
      vt_add_table(w->bench, "threads", "Threads: 1 where every bit is that of one thread", thread_columns, 4);
  uint64_t first[3] = {0};
  vt_status status = VT_OK;
  for (int threads = 1; threads <= 3 && !status; threads++) {
    uint64_t hash[3] = {0};
    char label[32];
    status = measure_threads(w, threads, hash);
    if (threads == 1) memcpy(first, hash, sizeof first);
    double row[] = {threads, hash[0] == first[0], hash[1] == first[1], hash[2] == first[2]};
    snprintf(label, sizeof label, "%d thread%s", threads, threads > 1 ? "s" : "");
    if (!status) vt_put_values(table, label, row, 4);
    step(w);
  }
  return status;
}

// ---- phantoms seen from cameras of our choice

typedef struct phantom_scene {
  const vt_truth *truth;
  int size;
  vt_views *views;
} phantom_scene;

static void expose_rows(void *user, size_t begin, size_t end, int worker) { // rows of one view
  (void)worker;
  const phantom_scene *p = user;
  const vt_view *view = &p->views->items[p->views->count - 1];
  for (size_t y = begin; y < end; y++)
    for (int x = 0; x < p->size; x++) {
      double alpha = 0;
      for (int s = 0; s < 4; s++) {
        vt_ray ray = vt_camera_ray(&view->camera, x + 0.25 + 0.5 * (s & 1), (double)y + 0.25 + 0.5 * (s >> 1));
        alpha -= expm1(-vt_true_optical_depth(p->truth, &ray, 0, INFINITY, 1e-3)) / 4;
      }
      uint8_t *pixel = view->picture.pixels + 4 * (y * (size_t)p->size + (size_t)x);
      pixel[0] = 90, pixel[1] = 140, pixel[2] = 50;
      pixel[3] = (uint8_t)(255 * alpha + 0.5);
    }
}

// A photograph of the phantom from direction (azimuth, elevation), degrees, at the distance of the synthetic rigs.
static vt_status add_phantom_view(vt_context *context, phantom_scene *p, vt_role role, double azimuth, double elevation) {
  double a = azimuth * DEGREE, e = elevation * DEGREE;
  vt_vec3 eye = vt_scale(vt_v3(cos(a) * cos(e), sin(a) * cos(e), sin(e)), 4.2);
  vt_view *view = &p->views->items[p->views->count++];
  *view = (vt_view){.role = role, .camera = vt_look_at(eye, vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.6, p->size, p->size)};
  char name[32];
  snprintf(name, sizeof name, "v_%d.png", p->views->count);
  view->name = vt_strdup(context, name);
  vt_status status = view->name ? vt_make_image(context, p->size, p->size, 4, &view->picture) : VT_OUT_OF_MEMORY;
  return status ? status : vt_parallel(context, (size_t)p->size, 4, expose_rows, p);
}

#define PLACES 16
#define JUDGES 4

// PLACES cameras within `span` degrees of azimuth (and a third of it in height); then JUDGES between them, then JUDGES
// all around. pairs: every other camera stands where the one before it stands.
static vt_status make_cluster(vt_context *context, phantom_scene *p, double span, bool pairs, vt_views *out) {
  p->views = out;
  out->items = VT_NEW(context, vt_view, PLACES + 2 * JUDGES);
  vt_status status = out->items ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < PLACES && !status; i++) {
    int place = pairs ? i / 2 * 2 : i;
    status = add_phantom_view(context, p, VT_TRAIN, span * ((place + 0.5) / PLACES - 0.5),
                              fmin(span, 90) / 3 * sin(2.4 * place));
  }
  for (int i = 0; i < JUDGES && !status; i++)
    status =
        add_phantom_view(context, p, VT_TEST, span * ((i + 0.6) / JUDGES - 0.5), fmin(span, 90) / 4 * sin(1.7 * i + 0.5));
  for (int i = 0; i < JUDGES && !status; i++)
    status = add_phantom_view(context, p, VT_TEST, 360.0 * (i + 0.1) / JUDGES, 15);
  return status;
}

static const vt_bench_column cluster_columns[] = {{"amount", "degrees", VT_NEITHER_BETTER, 0, 0},
                                                  {"alpha RMSE, flat", "", VT_LESS_BETTER, 0.02, 0.001},
                                                  {"alpha RMSE, textured", "", VT_LESS_BETTER, 0.02, 0.001},
                                                  {"PSNR", "dB", VT_MORE_BETTER, 0, 0.1},
                                                  {"all around: alpha RMSE, flat", "", VT_NEITHER_BETTER, 0, 0},
                                                  {"all around: alpha RMSE, textured", "", VT_NEITHER_BETTER, 0, 0},
                                                  {"cells", "", VT_NEITHER_BETTER, 0, 0}};

static vt_status measure_cluster(work *w, phantom_scene *p, double span, bool pairs, double *row) {
  vt_context *context = w->context;
  vt_views views = {0};
  vt_tree tree = {0};
  vt_reconstruct_report report;
  vt_judgement near, around;
  vt_status status = make_cluster(context, p, span, pairs, &views);
  if (!status) status = vt_reconstruct(context, &w->desc, &views, &tree, &report);
  if (!status) status = vt_judge_tree(context, &tree, &(vt_views){.count = JUDGES, .items = views.items + PLACES}, &near);
  if (!status) status = vt_judge_tree(context, &tree, &(vt_views){.count = JUDGES, .items = views.items + PLACES + JUDGES}, &around);
  if (!status) {
    const double values[] = {span,
                             near.alpha_flat,
                             near.alpha_textured,
                             near.psnr,
                             around.alpha_flat,
                             around.alpha_textured,
                             tree.octree.levels[report.leaf_level].cell_count};
    memcpy(row, values, sizeof values);
  }
  vt_free_tree(context, &tree);
  vt_free_views(context, &views);
  return status;
}

static vt_status run_clusters(work *w) {
  static const double spans[] = {360, 180, 90, 45, 20, 10, 5, 2, 1, 0};
  static const int quick[] = {0, 1, 2, 5, 8, 9};
  vt_synthetic_desc desc;
  vt_truth *truth = NULL;
  VT_ASSERT(vt_find_scene("blobs_64", &desc));
  vt_status status = vt_create_truth(w->context, &desc, &truth);
  phantom_scene p = {truth, vt_is_quick(w->bench) ? 64 : 128, NULL};
  vt_bench_table *table = vt_add_table(
      w->bench, "clustered",
      "16 photographs of a phantom from within some degrees, judged between them; all around, for what they cannot know",
      cluster_columns, 7);
  double row[7];
  int count = vt_is_quick(w->bench) ? 6 : 10;
  for (int i = 0; i < count && !status; i++) {
    char label[48];
    double span = spans[vt_is_quick(w->bench) ? quick[i] : i];
    status = measure_cluster(w, &p, span, false, row);
    snprintf(label, sizeof label, "within %g degrees", span);
    if (!status) vt_put_values(table, label, row, 7);
    step(w);
  }
  if (!status) add_curve(w, table, "clustered", "Cameras clustered", true);
  if (!status) status = measure_cluster(w, &p, 360, true, row);
  if (!status) vt_put_values(table, "within 360 degrees, in coincident pairs", row, 7);
  step(w);
  vt_destroy_truth(w->context, truth);
  return status;
}

static vt_status run_saturation(work *w) {
  static const double peaks[] = {2, 4, 16, 64, 256, 1024};
  vt_status status = VT_OK;
  vt_bench_table *table =
      vt_add_table(w->bench, "saturation",
                   "A phantom made denser: peak extinction per unit length, and the rays that say no more than \"opaque\"",
                   columns, COLUMN_COUNT);
  for (int i = 0; i < 6 && !status; i++) {
    vt_synthetic_desc desc;
    vt_captured scene = {0};
    double row[COLUMN_COUNT];
    char label[48];
    VT_ASSERT(vt_find_scene("blobs_64", &desc));
    if (!vt_is_quick(w->bench)) desc.width = desc.height = 128, desc.train_count = 24;
    desc.peak_extinction = peaks[i];
    clear_row(row, peaks[i]);
    status = vt_take_photographs(w->context, &desc, &scene);
    if (!status) status = measure(w, &scene.views, row);
    row[CHANGE] = NAN; // another object each time
    free_undisturbed(w, scene.judged.count);
    vt_free_captured(w->context, &scene);
    snprintf(label, sizeof label, "peak %g", peaks[i]);
    if (!status) vt_put_values(table, label, row, COLUMN_COUNT);
    step(w);
  }
  if (!status)
    vt_add_plot(w->bench, table,
                &(vt_plot){"saturation", "Error over the share of saturated rays", "saturated rays", "alpha RMSE, textured",
                           false, false, false});
  return status;
}

// ---- the suite

static vt_status take_scene(work *w) {
  vt_synthetic_desc desc;
  VT_ASSERT(vt_find_scene("tree_96", &desc));
  if (!vt_is_quick(w->bench)) {
    desc.width = desc.height = 192;
    desc.train_count = 32;
    desc.leaf_count = 4000;
  }
  vt_add_sentence(w->bench, "%d photographs of %d x %d pixels (a degree is %.1f pixels), %d to judge on, undamaged.",
                  desc.train_count, desc.width, desc.height, 0.5 * desc.height / tan(0.5 * desc.fov_y) * DEGREE,
                  desc.test_count);
  return vt_take_photographs(w->context, &desc, &w->scene);
}

static vt_status run(vt_bench *bench) {
  work w = {.bench = bench, .context = vt_session_of(bench)->context};
  w.desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
  w.total = 3 + (vt_is_quick(bench) ? 7 : 11) + 6;
  for (int i = 0; i < SWEEP_COUNT; i++) w.total += vt_is_quick(bench) ? sweeps[i].quick_count : sweeps[i].count;
  vt_status status = take_scene(&w);
  for (int i = 0; i < SWEEP_COUNT && !status; i++) status = run_sweep(&w, &sweeps[i]);
  if (!status) status = run_threads(&w);
  if (!status) status = run_clusters(&w);
  if (!status) status = run_saturation(&w);
  vt_free_captured(w.context, &w.scene);
  return status;
}

const vt_suite vt_suite_stability = {
    "stability", "error curves over units, places, order, threads, noise, poses, clustered cameras and saturation", run};
