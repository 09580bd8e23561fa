// test_refine_cameras.c - wrong cameras are brought nearer to the truth by mattes, right ones stay as they are
// SPDX-License-Identifier: BSD-3-Clause
#include "base/least_squares.h"
#include "base/rng.h"
#include "reconstruct/refine_cameras.h"
#include "tests/mended_views.h"

static void copy_cameras(const vt_views *views, vt_camera *out) {
  for (int i = 0; i < views->count; i++) out[i] = views->items[i].camera;
}

static bool same_cameras(const vt_views *views, const vt_camera *cameras) {
  for (int i = 0; i < views->count; i++)
    if (memcmp(&views->items[i].camera, &cameras[i], sizeof *cameras)) return false;
  return true;
}

// Root mean square distance in pixels of where points of the tree fall, after the best similarity.
static double pixels_apart(const vt_views *views, const vt_camera *truth) {
  vt_camera now[64];
  double sum = 0;
  copy_cameras(views, now);
  vt_similarity laid = vt_align_cameras(views->count, now, truth, vt_v3(0, 0, 0));
  for (int i = 0; i < views->count; i++)
    for (int k = 0; k < 8; k++) {
      vt_camera c = vt_move_camera_by(&laid, &now[i]);
      double p[2], q[2];
      vt_vec3 corner = vt_v3(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
      assert_true(vt_project(&c, corner, p) && vt_project(&truth[i], corner, q));
      sum += (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]);
    }
  return sqrt(sum / (8 * views->count));
}

static void a_similarity_of_all_cameras_is_found_exactly(void **state) {
  (void)state;
  vt_rng rng = vt_seed_rng(5, 1);
  for (int trial = 0; trial < 20; trial++) {
    vt_camera from[9], to[9];
    int count = 1 + trial % 9;
    double turn[6] = {0};
    for (int k = 0; k < 3; k++) turn[k] = vt_random_between(&rng, -0.5, 0.5);
    vt_camera turned = vt_adjust_camera(&(vt_camera){.rotation = {{1, 0, 0, 0, 1, 0, 0, 0, 1}}}, turn, 0, 1);
    vt_similarity true_one = {count > 1 ? vt_random_between(&rng, 0.5, 2) : 1, turned.rotation, vt_v3(3, -1, 2)};
    for (int i = 0; i < count; i++) {
      vt_vec3 eye = vt_v3(4 * cos(i), trial % 2 ? 0 : 4 * sin(i), trial % 2 ? 0 : 0.3 * i + 1); // also on a line
      from[i] = vt_look_at(eye, vt_v3(0, 0.1, 0), vt_v3(0, 0, 1), 0.7, 100, 80);
      to[i] = vt_move_camera_by(&true_one, &from[i]);
    }
    vt_similarity found = vt_align_cameras(count, from, to, vt_v3(3, -1, 2));
    for (int i = 0; i < count; i++) {
      vt_camera laid = vt_move_camera_by(&found, &from[i]);
      for (int k = 0; k < 9; k++) assert_close(laid.rotation.m[k], to[i].rotation.m[k], 1e-9);
      assert_true(vt_length(vt_sub(vt_camera_centre(&laid), vt_camera_centre(&to[i]))) < 1e-8);
    }
  }
}

// A smooth blob that can be differentiated, in a grid of its own.
static vt_soft_volume make_blob(vt_context *context, int cells) {
  vt_soft_volume v = {.cells = cells, .edge = 2.0 / (cells - 1), .origin = {-1, -1, -1}, .blocks = (cells + VT_SOFT_BLOCK - 1) / VT_SOFT_BLOCK};
  size_t n = (size_t)cells, b = (size_t)v.blocks;
  v.depth = VT_NEW(context, float, n * n * n), v.filled = VT_NEW(context, uint8_t, b * b * b);
  assert_true(v.depth && v.filled);
  memset(v.filled, 1, b * b * b);
  for (size_t i = 0; i < n * n * n; i++) {
    double x = v.edge * (i % n) - 1, y = v.edge * (i / n % n) - 1, z = v.edge * (i / n / n) - 1;
    v.depth[i] = (float)(0.1 * exp(-6 * ((x - 0.1) * (x - 0.1) + 2 * y * y + (z + 0.2) * (z + 0.2))));
  }
  return v;
}

static void derivatives_agree_with_differences(void **state) {
  (void)state;
  vt_context *context = open_mending(1);
  vt_soft_volume blob = make_blob(context, 49);
  vt_camera camera = vt_look_at(vt_v3(2.5, 1.5, 0.8), vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.8, 40, 32);
  vt_silhouette_pixel pixels[200];
  for (int i = 0; i < 200; i++) pixels[i] = (vt_silhouette_pixel){(uint16_t)(6 + i % 20), (uint16_t)(4 + i / 10), 0.3f};
  vt_silhouette silhouette = {camera, 200, pixels};
  vt_response response = vt_no_response();
  double distance = 3, smooth[VT_SMOOTH_TERMS] = {0.1, -0.2, 0.1, 0, 0.1, 0};
  static float at[200], high[200], low[200], by[200][VT_SILHOUETTE_COLUMNS];
  fails_never(context, vt_compare_silhouette(context, &silhouette, &blob, &response, smooth, &camera, distance, at, by));
  for (int k = 0; k < VT_SILHOUETTE_COLUMNS; k++) {
    double largest = 0, worst = 0;
    for (int sign = -1; sign <= 1; sign += 2) {
      double pose[6] = {0}, other[VT_SMOOTH_TERMS], step = 2e-3 * sign;
      memcpy(other, smooth, sizeof other);
      if (k < 6) pose[k] = step;
      if (k > 6) other[k - 7] += step;
      vt_camera moved = vt_adjust_camera(&camera, pose, k == 6 ? step : 0, distance);
      fails_never(context, vt_compare_silhouette(context, &silhouette, &blob, &response, other, &moved, distance, sign > 0 ? high : low, NULL));
    }
    for (int i = 0; i < 200; i++) {
      double slope = (high[i] - low[i]) / 4e-3;
      largest = fmax(largest, fabs(slope)), worst = fmax(worst, fabs(slope - by[i][k]));
    }
    assert_true(largest > 1e-3);
    if (worst > 0.05 * largest) fail_msg("column %d: off by %g of %g", k, worst, largest);
  }
  vt_free_soft_volume(context, &blob);
  vt_destroy_context(context);
}

static void need_ceres(void) {
  if (!vt_can_solve_least_squares()) skip();
}

static void wrong_cameras_come_nearer_and_the_mattes_say_so(void **state) {
  (void)state;
  need_ceres();
  vt_context *context = open_mending(2);
  vt_views views = photograph_tree(context, VT_SYNTHETIC_TREE, 1, 20, 0, 128);
  vt_camera truth[64];
  copy_cameras(&views, truth);
  vt_damage_desc damage = vt_default_damage_desc();
  damage.seed = 3, damage.pose_degrees = 0.4, damage.pose_share = 0.004;
  fails_never(context, vt_damage_views(context, &damage, &views));
  double before = pixels_apart(&views, truth);
  vt_refine_desc desc = vt_default_refine_desc();
  vt_refine_report report;
  desc.rounds[0] = 1, desc.rounds[1] = 2, desc.turn_deviation = 0.4, desc.shift_deviation = 0.004;
  fails_never(context, vt_refine_views(context, &desc, &views, &report));
  double after = pixels_apart(&views, truth);
  printf("pixels %.3f -> %.3f, first look %.3f, alpha %.4f -> %.4f\n", before, after, report.first_gain, report.alpha_before, report.alpha_after);
  assert_true(report.tried && report.kept);
  assert_true(after < 0.5 * before);
  assert_true(report.alpha_after < report.alpha_before && report.mean_pixels > 0.3 && report.most_pixels >= report.mean_pixels);
  for (int i = 0; i < views.count; i++) fails_never(context, vt_check_camera(context, &views.items[i].camera, "refined"));
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void exact_cameras_stay_bit_for_bit(void **state) {
  (void)state;
  need_ceres();
  vt_context *context = open_mending(2);
  vt_views views = photograph_tree(context, VT_SYNTHETIC_TREE, 2, 16, 2, 128);
  vt_camera came[64];
  vt_refine_desc desc = vt_default_refine_desc();
  vt_refine_report report;
  copy_cameras(&views, came);
  fails_never(context, vt_refine_views(context, &desc, &views, &report));
  printf("first look %.4f: %s\n", report.first_gain, report.why);
  assert_false(report.kept);
  assert_true(same_cameras(&views, came));
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void any_number_of_threads_gives_the_same_cameras(void **state) {
  (void)state;
  need_ceres();
  static const int thread_counts[] = {1, 2, 7};
  vt_camera first[64];
  for (int t = 0; t < 3; t++) {
    vt_context *context = open_mending(thread_counts[t]);
    vt_views views = photograph_tree(context, VT_SYNTHETIC_BLOBS, 1, 8, 0, 48);
    vt_refine_report report;
    damage_and_refine(context, &views, &report);
    assert_true(report.kept);
    if (!t) copy_cameras(&views, first);
    assert_true(same_cameras(&views, first));
    vt_free_views(context, &views);
    vt_destroy_context(context);
  }
}

typedef enum hazard { ONE_VIEW, EQUAL_VIEWS, EMPTY_MATTES, ONE_EMPTY, FULL_MATTES, APART, INSIDE, HAZARDS } hazard;

static void bring_about(hazard what, vt_views *views) {
  for (int i = 0; i < views->count; i++) {
    vt_view *view = &views->items[i];
    vt_image *p = &view->picture;
    if (what == EQUAL_VIEWS && i) {
      view->camera = views->items[0].camera;
      memcpy(p->pixels, views->items[0].picture.pixels, (size_t)(4 * p->width * p->height));
    }
    if (what == EMPTY_MATTES || (what == ONE_EMPTY && i == 3)) memset(p->pixels, 0, (size_t)(4 * p->width * p->height));
    if (what == FULL_MATTES) memset(p->pixels, 255, (size_t)(4 * p->width * p->height));
    vt_vec3 eye = vt_scale(vt_camera_centre(&view->camera), 0.1);
    if (what == APART) view->camera = vt_look_at(vt_v3(100.0 * i, 0, 0), vt_v3(100.0 * i, 10, i), vt_v3(0, 0, 1), 0.6, p->width, p->height);
    if (what == INSIDE && i % 2) view->camera = vt_look_at(eye, vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.6, p->width, p->height);
  }
}

static void hazards_harm_nothing(void **state) {
  (void)state;
  vt_context *context = open_mending(2);
  for (int what = 0; what < HAZARDS; what++) {
    vt_views views = photograph_tree(context, VT_SYNTHETIC_BALL, 1, what == ONE_VIEW ? 1 : 8, 1, 32);
    bring_about((hazard)what, &views);
    vt_refine_desc desc = vt_default_refine_desc();
    vt_refine_report report;
    vt_camera came[64];
    copy_cameras(&views, came);
    desc.rounds[1] = 0;
    if (vt_can_solve_least_squares()) desc.mode = VT_REFINE_ON;
    fails_never(context, vt_refine_views(context, &desc, &views, &report));
    for (int i = 0; i < views.count; i++) fails_never(context, vt_check_camera(context, &views.items[i].camera, "refined"));
    assert_non_null(report.why);
    if (!report.kept) assert_true(same_cameras(&views, came));
    assert_true(report.most_degrees < 3 && report.most_share < 0.03);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(a_similarity_of_all_cameras_is_found_exactly),
                                     cmocka_unit_test(derivatives_agree_with_differences),
                                     cmocka_unit_test(wrong_cameras_come_nearer_and_the_mattes_say_so),
                                     cmocka_unit_test(exact_cameras_stay_bit_for_bit),
                                     cmocka_unit_test(any_number_of_threads_gives_the_same_cameras),
                                     cmocka_unit_test(hazards_harm_nothing)};
  only_threads_for_the_thread_sanitizer();
  return cmocka_run_group_tests(tests, NULL, NULL);
}
