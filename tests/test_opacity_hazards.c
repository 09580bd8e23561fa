// test_opacity_hazards.c - inputs and arithmetic that break a naive solver of opacity (METHODS 2.3)
// SPDX-License-Identifier: BSD-3-Clause
//
// Each test says what goes wrong where nobody takes care, and where that is cheap does it wrong beside and shows it. Scenes
// are small phantoms; a context of one thread where not told otherwise.
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/opacity.h"
#include "reconstruct/reconstruct.h"
#include "reconstruct/solid_angle.h"
#include "tests/unit.h"

enum { LEVEL = 3, AXIS = 1 << LEVEL, CELLS = AXIS * AXIS * AXIS };

typedef struct grid { // cells without a hull, and the rays of some photographs
  vt_context *context;
  vt_views views;
  vt_reduced_views reduced;
  vt_octree octree;
  vt_rays rays;
  int level;
} grid;

static vt_context *open_context(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET, desc.thread_count = threads;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

static vt_synthetic_desc scene_of(vt_synthetic_kind kind, int views, int size) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = kind, desc.train_count = views, desc.test_count = 0;
  desc.width = desc.height = size, desc.supersample = 1, desc.peak_extinction = 2;
  return desc;
}

static void open_grid(grid *g, int threads, int views, int size, int level, uint64_t memory) {
  vt_synthetic_desc scene = scene_of(VT_SYNTHETIC_BLOBS, views, size);
  *g = (grid){.context = open_context(threads), .level = level};
  assert_int_equal(vt_make_synthetic_views(g->context, &scene, &g->views), VT_OK);
  assert_int_equal(vt_reduce_views(g->context, &g->views, 1, &g->reduced), VT_OK);
  g->octree = (vt_octree){.origin = {-1.1, -1.1, -1.1}, .edge = 2.2, .branching = 2, .level_count = level + 1};
  int axis = 1 << level;
  uint16_t xyz[CELLS][3];
  for (int i = 0; i < axis * axis * axis; i++)
    xyz[i][0] = (uint16_t)(i % axis), xyz[i][1] = (uint16_t)(i / axis % axis), xyz[i][2] = (uint16_t)(i / axis / axis);
  assert_int_equal(vt_make_level(g->context, 2, level, (size_t)(axis * axis * axis), xyz, &g->octree.levels[level]), VT_OK);
  assert_int_equal(vt_collect_rays(g->context, &g->octree, level, level, &g->reduced, memory, &g->rays), VT_OK);
}

static void close_grid(grid *g) {
  vt_free_rays(g->context, &g->rays);
  vt_free_octree(g->context, &g->octree);
  vt_free_reduced_views(g->context, &g->reduced);
  vt_free_views(g->context, &g->views);
  vt_destroy_context(g->context);
}

static float *solve(grid *g, const vt_opacity_desc *desc, float start) {
  vt_level *cells = &g->octree.levels[g->level];
  for (uint32_t i = 0; i < cells->cell_count; i++) cells->optical_depth[i] = start;
  assert_int_equal(vt_estimate_opacity(g->context, desc, &g->rays, cells, NULL), VT_OK);
  for (uint32_t i = 0; i < cells->cell_count; i++) assert_true(cells->optical_depth[i] >= 0 && cells->optical_depth[i] <= desc->largest);
  return cells->optical_depth;
}

static void set_alpha(const vt_views *views, int view, int alpha) {
  const vt_image *p = &views->items[view].picture;
  for (size_t i = 0; i < (size_t)p->width * (size_t)p->height; i++) p->pixels[4 * i + 3] = (uint8_t)alpha;
}

static const vt_opacity_step every_step[] = {VT_STEP_MAJORISER, VT_STEP_NESTEROV, VT_STEP_ADAM};

// ---- arithmetic

// -log(1 - 1) is infinite, and infinite minus infinite NaN: one opaque pixel poisons all cells of its ray, then all cells.
static void opaque_mattes_give_dense_and_finite_cells(void **state) {
  (void)state;
  grid g;
  assert_true(isnan(-logf(1 - 255 / 255.0f) - -logf(0)));
  open_grid(&g, 1, 6, 16, LEVEL, 1 << 28);
  for (int v = 0; v < 6; v++) set_alpha(&g.views, v, 255);
  for (int k = 0; k < 4; k++) {
    vt_opacity_desc desc = k == 3 ? vt_sart_opacity_desc() : vt_default_opacity_desc();
    if (k < 3) desc.step = every_step[k], desc.iterations = 60;
    const float *depth = solve(&g, &desc, 0.1f);
    double tau = 0;
    for (int i = 0; i < AXIS; i++) tau += depth[vt_find_cell(&g.octree.levels[LEVEL], 2, i, AXIS / 2, AXIS / 2)];
    assert_true(tau > 3); // 0.95 across the middle
  }
  close_grid(&g);
}

// A product of transmittances in float is 0 after some cells of depth 30, and 0 / 0 the share of a cell in it; a gradient that
// divides by it is NaN. exp(-tau) of the sum is a small number, or 0, that is never divided by.
static void transmittance_that_underflows_does_no_harm(void **state) {
  (void)state;
  float product = 1;
  for (int i = 0; i < 2000; i++) product *= expf(-30);
  assert_true(isnan(product / product));
  grid g;
  open_grid(&g, 1, 6, 16, LEVEL, 1 << 28);
  for (int k = 0; k < 3; k++) {
    vt_opacity_desc desc = vt_default_opacity_desc();
    desc.step = every_step[k], desc.held_out_share = 0;
    const float *depth = solve(&g, &desc, 30); // 8 cells of 30: exp(-240) is 0 in float
    for (int i = 0; i < CELLS; i++) assert_true(isfinite(depth[i]));
  }
  close_grid(&g);
}

typedef struct sums_of_root { double correction[VT_LANES], weight[VT_LANES]; float naive; double exact; uint64_t rays; float s; } sums_of_root;

static void add_root(void *user, const vt_swept_ray *ray) {
  sums_of_root *sum = user;
  double l = (double)ray->chords[0].length, T = exp(-l * (double)sum->s), t = 1 - ray->pixel[3] / 255.0;
  sum->correction[ray->lane] += l * T * (T - t);
  sum->weight[ray->lane] += l * l * (T * T + 0.001);
  sum->naive += (float)(l * l * (T * T + 0.001));
  sum->exact += l * l * (T * T + 0.001);
  sum->rays++;
}

// Ten million terms in one float: when the sum is 10^7 times a term, what is added is rounded to a few bits.
static void root_cell_under_ten_million_rays_gets_its_step(void **state) {
  (void)state;
  if (VT_UNIT_SANITIZED) skip(); // minutes
  grid g;
  open_grid(&g, 1, 1, 3600, 0, 0); // no memory: walked anew
  vt_opacity_desc desc = vt_default_opacity_desc();
  desc.step = VT_STEP_NESTEROV, desc.iterations = 1, desc.least_updates = 0;
  desc.total_variation = 0, desc.held_out_share = 0;
  sums_of_root sum = {.s = 0.05f};
  assert_int_equal(vt_sweep_rays(g.context, &g.rays, NULL, 0, add_root, &sum), VT_OK);
  double correction = 0, weight = 0;
  for (int lane = 0; lane < VT_LANES; lane++) correction += sum.correction[lane], weight += sum.weight[lane];
  double wanted = fmax(0, 0.05 + correction / weight), got = (double)solve(&g, &desc, 0.05f)[0];
  printf("%.1f million rays: step %.7f, wanted %.7f; one float for all is off by %.2e\n", sum.rays * 1e-6, got - 0.05, wanted - 0.05,
         fabs(sum.naive / sum.exact - 1));
  assert_true(sum.rays > 4000000);
  assert_true(fabs(sum.naive / sum.exact - 1) > 1e-3);
  assert_close((got - 0.05) / (wanted - 0.05), 1, 1e-3);
  close_grid(&g);
}

// ---- what must not matter

static uint64_t bits_of(int threads, vt_walk_path path, vt_opacity_step step, uint64_t memory, float *out) {
  grid g;
  open_grid(&g, threads, 7, 20, LEVEL, memory);
  g.rays.path = path;
  vt_opacity_desc desc = vt_default_opacity_desc();
  desc.step = step;
  memcpy(out, solve(&g, &desc, 0.2f), CELLS * sizeof *out);
  close_grid(&g);
  return CELLS * sizeof *out;
}

// Sums in the order in which threads happen to end differ in their last bits from run to run.
static void threads_walk_paths_and_kept_rays_change_no_bit(void **state) {
  (void)state;
  for (int k = 0; k < 3; k++) {
    float first[CELLS], other[CELLS];
    uint64_t size = bits_of(1, VT_WALK_PLAIN, every_step[k], 1 << 28, first);
    static const int threads[] = {2, 7};
    for (int i = 0; i < 2; i++) bits_of(threads[i], vt_best_walk_path(), every_step[k], 1 << 28, other), assert_memory_equal(first, other, size);
    for (int path = 0; path <= (int)vt_best_walk_path(); path++) { // without memory each sweep walks again, on this path
      bits_of(2, (vt_walk_path)path, every_step[k], 0, other);
      assert_memory_equal(first, other, size);
    }
  }
}

static void pixels_of_no_confidence_have_no_influence(void **state) {
  (void)state;
  grid g;
  open_grid(&g, 1, 5, 16, LEVEL, 1 << 28);
  vt_image confidence[5];
  uint8_t bytes[5][256];
  for (int v = 0; v < 5; v++) {
    for (int i = 0; i < 256; i++) bytes[v][i] = (uint8_t)(i % 3 ? 255 : 0);
    confidence[v] = (vt_image){.width = 16, .height = 16, .channels = 1, .pixels = bytes[v]};
  }
  for (int k = 0; k < 3; k++) {
    vt_opacity_desc desc = vt_default_opacity_desc();
    desc.step = every_step[k], desc.confidence = confidence;
    float before[CELLS];
    memcpy(before, solve(&g, &desc, 0.2f), sizeof before);
    for (int v = 0; v < 5; v++)
      for (int i = 0; i < 256; i++)
        if (!bytes[v][i]) g.views.items[v].picture.pixels[4 * i + 3] ^= 255;
    assert_memory_equal(before, solve(&g, &desc, 0.2f), sizeof before);
    desc.confidence = NULL; // and they had some before
    assert_memory_not_equal(before, solve(&g, &desc, 0.2f), sizeof before);
  }
  close_grid(&g);
}

// A block of 8 x 8 pixels that changes nothing when it is changed is held out; others must change the cells.
static void held_out_blocks_are_not_looked_at(void **state) {
  (void)state;
  grid g;
  open_grid(&g, 1, 4, 32, LEVEL, 1 << 28);
  vt_opacity_desc desc = vt_default_opacity_desc();
  desc.held_out_share = 0.4f, desc.iterations = 2, desc.least_updates = 0;
  float before[CELLS];
  memcpy(before, solve(&g, &desc, 0.2f), sizeof before);
  vt_opacity_report report, changed;
  int idle = 0, middle = 0;
  vt_level *cells = &g.octree.levels[LEVEL];
  for (int v = 0; v < 4; v++)
    for (int b = 0; b < 16; b++) {
      if (b % 4 % 3 == 0 || b / 4 % 3 == 0) continue; // blocks at the rim may meet no cell
      for (int turn = 0; turn < 2; turn++) {
        for (int i = 0; i < 64; i++)
          g.views.items[v].picture.pixels[4 * ((b / 4 * 8 + i / 8) * 32 + b % 4 * 8 + i % 8) + 3] ^= 255;
        if (turn) break; // and back
        for (int i = 0; i < CELLS; i++) cells->optical_depth[i] = 0.2f;
        assert_int_equal(vt_estimate_opacity(g.context, &desc, &g.rays, cells, &changed), VT_OK);
        idle += !memcmp(before, cells->optical_depth, sizeof before), middle++;
      }
    }
  solve(&g, &desc, 0.2f);
  assert_int_equal(vt_estimate_opacity(g.context, &desc, &g.rays, cells, &report), VT_OK);
  printf("%d of %d blocks in the middle are held out\n", idle, middle);
  assert_true(idle >= 1 && idle < middle && isfinite(report.held_out_rmse));
  close_grid(&g);
}

// ---- weights of views

static void weigh(grid *g, double scale, double shift, float *weight) {
  vt_octree moved = g->octree;
  moved.edge *= scale;
  moved.origin = vt_add(vt_scale(moved.origin, scale), vt_v3(shift, -shift, shift));
  vt_reduced_views views = g->reduced;
  vt_camera cameras[16];
  for (int v = 0; v < views.count; v++) {
    cameras[v] = views.cameras[v];
    cameras[v].translation = vt_sub(vt_scale(cameras[v].translation, scale), vt_mul(&cameras[v].rotation, vt_v3(shift, -shift, shift)));
  }
  views.cameras = cameras;
  vt_weigh_views(&moved, &views, true, weight);
}

static void coincident_views_share_one_weight_and_units_do_not_matter(void **state) {
  (void)state;
  grid g;
  float w[10], other[10];
  open_grid(&g, 1, 10, 8, LEVEL, 1 << 28);
  g.reduced.cameras[4] = g.reduced.cameras[3]; // twice the same photograph
  weigh(&g, 1, 0, w);
  double sum = 0, alone;
  for (int v = 0; v < 10; v++) sum += (double)w[v];
  assert_close(sum / 10, 1, 1e-5);
  assert_close(w[3], w[4], 0.02);
  g.reduced.cameras[4] = g.reduced.cameras[5];
  weigh(&g, 1, 0, other);
  alone = (double)other[3];
  assert_true((double)(w[3] + w[4]) < 1.5 * alone); // counted by pixels it would be twice as much
  weigh(&g, 1, 0, w);
  for (int k = 0; k < 3; k++) {
    weigh(&g, k == 0 ? 1e-6 : k == 1 ? 1e6 : 1, k == 2 ? 2.2e6 : 0, other);
    for (int v = 0; v < 10; v++) assert_close(w[v], other[v], 1e-2);
  }
  close_grid(&g);
}

// ---- whole captures

typedef struct capture {
  vt_context *context;
  vt_views views;
  vt_tree tree;
  vt_status status;
} capture;

static void open_capture(capture *c, vt_synthetic_kind kind, int views, int size) {
  vt_synthetic_desc scene = scene_of(kind, views, size);
  *c = (capture){.context = open_context(2)};
  assert_int_equal(vt_make_synthetic_views(c->context, &scene, &c->views), VT_OK);
}

static void reconstruct(capture *c, int level) {
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
  desc.leaf_level = level, desc.refine_epochs = 0;
  vt_free_tree(c->context, &c->tree);
  vt_clear_error(c->context);
  c->status = vt_reconstruct(c->context, &desc, &c->views, &c->tree, NULL);
  for (int l = 0; l < c->tree.octree.level_count && !c->status; l++)
    for (uint32_t i = 0; i < c->tree.octree.levels[l].cell_count; i++)
      assert_true(c->tree.octree.levels[l].optical_depth[i] >= 0 && c->tree.octree.levels[l].optical_depth[i] <= 30);
}

static void close_capture(capture *c) {
  vt_free_tree(c->context, &c->tree);
  vt_free_views(c->context, &c->views);
  vt_destroy_context(c->context);
}

static void look_at_origin(vt_camera *camera, double azimuth) {
  *camera = vt_look_at(vt_v3(4 * cos(azimuth), 4 * sin(azimuth), 0.5), vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.7, camera->width, camera->height);
}

// All within 5 degrees (depth is all but unknown), one view (a division by how much views spread), twice the same one (a
// singular spread), and one that looks away (a mean over no ray is 0 / 0): a tree, and finite.
static void poor_captures_give_finite_trees(void **state) {
  (void)state;
  for (int kind = 0; kind < 4; kind++) {
    capture c;
    open_capture(&c, VT_SYNTHETIC_BALL, 6, 32);
    for (int v = 0; v < c.views.count; v++) {
      vt_camera *camera = &c.views.items[v].camera;
      if (kind == 0) look_at_origin(camera, v * VT_PI / 180);
      if (kind == 1) c.views.items[v].role = v ? VT_TEST : VT_TRAIN;
      if (kind == 2 && v == 1) *camera = c.views.items[0].camera;
      if (kind == 3 && v == 2) {
        *camera = vt_look_at(vt_v3(4, 0, 0), vt_v3(9, 0, 0), vt_v3(0, 0, 1), 0.7, camera->width, camera->height);
        set_alpha(&c.views, v, 0);
      }
    }
    reconstruct(&c, 4);
    assert_int_equal(c.status, VT_OK);
    close_capture(&c);
  }
}

static void empty_mattes_are_said_to_be_empty_and_full_ones_give_a_tree_or_a_sentence(void **state) {
  (void)state;
  capture c;
  open_capture(&c, VT_SYNTHETIC_BALL, 6, 24);
  for (int v = 0; v < 6; v++) set_alpha(&c.views, v, 0);
  reconstruct(&c, 4);
  assert_int_equal(c.status, VT_BAD_INPUT);
  printf("alpha 0: %s\n", vt_last_error(c.context));
  assert_true(strlen(vt_last_error(c.context)) > 30);
  for (int v = 0; v < 6; v++) set_alpha(&c.views, v, 255);
  reconstruct(&c, 4);
  printf("alpha 1: status %d %s\n", (int)c.status, vt_last_error(c.context));
  assert_true(c.status == VT_OK || (c.status == VT_BAD_INPUT && strlen(vt_last_error(c.context)) > 30));
  close_capture(&c);
}

// Pixels of 6 x 6 pictures are larger than cells of level 5: steps by whole pixels would leave cells between rays.
// A camera in the middle of the ball sees the root cell larger than its picture.
static void large_pixels_and_large_cells_are_both_taken(void **state) {
  (void)state;
  capture c;
  open_capture(&c, VT_SYNTHETIC_BALL, 8, 6);
  reconstruct(&c, 5);
  assert_int_equal(c.status, VT_OK);
  close_capture(&c);
  open_capture(&c, VT_SYNTHETIC_BALL, 8, 32);
  vt_camera *inside = &c.views.items[3].camera;
  *inside = vt_look_at(vt_v3(0, 0, 0), vt_v3(1, 0, 0), vt_v3(0, 0, 1), 0.1, inside->width, inside->height);
  set_alpha(&c.views, 3, 255);
  reconstruct(&c, 4);
  assert_int_equal(c.status, VT_OK);
  close_capture(&c);
}

// NaN passes every comparison that a check forgets to turn around: no cell is ever outside, no error ever too large.
static void impossible_cameras_are_refused_by_the_photographs_name(void **state) {
  (void)state;
  capture c;
  open_capture(&c, VT_SYNTHETIC_BALL, 5, 16);
  const vt_camera good = c.views.items[2].camera;
  for (int kind = 0; kind < 8; kind++) {
    vt_camera *bad = &c.views.items[2].camera;
    *bad = good;
    if (kind == 0) bad->fx = NAN;
    if (kind == 1) bad->translation.y = INFINITY;
    if (kind == 2) bad->rotation.m[4] = NAN;
    if (kind == 3) bad->fy = 0;
    if (kind == 4) bad->fx = -bad->fx;
    if (kind == 5) bad->cx = -INFINITY;
    for (int i = 0; i < 3 && kind == 6; i++) bad->rotation.m[i] = -bad->rotation.m[i]; // mirrored
    for (int i = 0; i < 9 && kind == 7; i++) bad->rotation.m[i] = 0;
    reconstruct(&c, 3);
    assert_int_equal(c.status, VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(c.context), c.views.items[2].name));
  }
  close_capture(&c);
}

// ---- the same capture told otherwise

enum { TEST_RAYS = 400 };

static void alphas_of(capture *c, double scale, vt_vec3 shift, double alpha[TEST_RAYS]) {
  const vt_octree *octree = &c->tree.octree;
  int leaf = octree->level_count - 1;
  vt_segment *segments = VT_NEW(c->context, vt_segment, vt_max_segments(&octree->levels[leaf]));
  assert_non_null(segments);
  for (int i = 0; i < TEST_RAYS; i++) {
    vt_vec3 eye = vt_v3(4 * cos(0.7 * i), 4 * sin(0.7 * i), 0.01 * (i % 100)), aim = vt_v3(0.8 * sin(i), 0.8 * cos(1.3 * i), 0.8 * sin(2.1 * i));
    vt_ray ray = {vt_add(vt_scale(eye, scale), shift), vt_normalise(vt_sub(aim, eye))};
    double tau = 0;
    size_t count = vt_walk_ray(octree, leaf, &ray, segments);
    for (size_t k = 0; k < count; k++) tau += (double)segments[k].length * (double)octree->levels[leaf].optical_depth[segments[k].cell];
    alpha[i] = -expm1(-tau);
  }
  vt_free(c->context, segments);
}

// Returns the edge of the root cube.
static double solve_moved(double scale, double edges, bool reversed, double alpha[TEST_RAYS]) {
  capture c;
  open_capture(&c, VT_SYNTHETIC_BLOBS, 10, 32);
  vt_vec3 shift = vt_v3(2.2 * edges, -2.2 * edges, 2.2 * edges);
  for (int v = 0; v < c.views.count; v++) {
    vt_camera *camera = &c.views.items[v].camera;
    camera->translation = vt_sub(vt_scale(camera->translation, scale), vt_mul(&camera->rotation, shift));
  }
  for (int v = 0; v < c.views.count / 2 && reversed; v++) {
    vt_view kept = c.views.items[v];
    c.views.items[v] = c.views.items[c.views.count - 1 - v], c.views.items[c.views.count - 1 - v] = kept;
  }
  reconstruct(&c, 4);
  assert_int_equal(c.status, VT_OK);
  alphas_of(&c, scale, shift, alpha);
  double edge = c.tree.octree.edge;
  close_capture(&c);
  return edge;
}

static double worst_difference(const double *a, const double *b) {
  double worst = 0;
  for (int i = 0; i < TEST_RAYS; i++) worst = fmax(worst, fabs(a[i] - b[i]));
  return worst;
}

// Absolute thresholds (1e-6 metres) and differences of large floats make alpha depend on units and on where north is.
static void scale_and_shift_change_alpha_by_less_than_a_ten_thousandth(void **state) {
  (void)state;
  double first[TEST_RAYS], other[TEST_RAYS];
  static const double cases[][2] = {{1e-6, 0}, {1e6, 0}, {1, 1e6}};
  double edge = solve_moved(1, 0, false, first), opaque = 0;
  for (int i = 0; i < TEST_RAYS; i++) opaque = fmax(opaque, first[i]);
  assert_true(opaque > 0.3); // these rays meet something
  for (int i = 0; i < 3; i++) {
    double moved = solve_moved(cases[i][0], cases[i][1], false, other);
    assert_close(moved / (edge * cases[i][0]), 1, 1e-6);
    printf("scale %g, shift by %g edges: worst difference of alpha %.2e\n", cases[i][0], cases[i][1], worst_difference(first, other));
    assert_true(worst_difference(first, other) < 1e-4);
  }
}

// Subsets and held-out blocks are drawn from the photographs' places in the list, so the bits differ; the tree may not.
static void order_of_photographs_hardly_matters(void **state) {
  (void)state;
  double first[TEST_RAYS], other[TEST_RAYS], squares = 0;
  solve_moved(1, 0, false, first);
  solve_moved(1, 0, true, other);
  for (int i = 0; i < TEST_RAYS; i++) squares += (first[i] - other[i]) * (first[i] - other[i]) / TEST_RAYS;
  printf("photographs in reverse: RMS difference of alpha %.4f, worst %.4f\n", sqrt(squares), worst_difference(first, other));
  assert_true(sqrt(squares) < 0.03);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(opaque_mattes_give_dense_and_finite_cells),
      cmocka_unit_test(transmittance_that_underflows_does_no_harm),
      cmocka_unit_test(root_cell_under_ten_million_rays_gets_its_step),
      cmocka_unit_test(threads_walk_paths_and_kept_rays_change_no_bit),
      cmocka_unit_test(pixels_of_no_confidence_have_no_influence),
      cmocka_unit_test(held_out_blocks_are_not_looked_at),
      cmocka_unit_test(coincident_views_share_one_weight_and_units_do_not_matter),
      cmocka_unit_test(poor_captures_give_finite_trees),
      cmocka_unit_test(empty_mattes_are_said_to_be_empty_and_full_ones_give_a_tree_or_a_sentence),
      cmocka_unit_test(large_pixels_and_large_cells_are_both_taken),
      cmocka_unit_test(impossible_cameras_are_refused_by_the_photographs_name),
      cmocka_unit_test(scale_and_shift_change_alpha_by_less_than_a_ten_thousandth),
      cmocka_unit_test(order_of_photographs_hardly_matters)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
