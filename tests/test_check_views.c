// test_check_views.c - mattes that contradict the others are found, and exposure is balanced, without touching what is right
// SPDX-License-Identifier: BSD-3-Clause
#include "base/image_metrics.h"
#include "tests/mended_views.h"

static void cut_hole(vt_image *p) { // a fifth of the picture's width, around its middle
  for (int y = 0; y < p->height; y++)
    for (int x = 0; x < p->width; x++)
      if (hypot(x - 0.5 * p->width, y - 0.45 * p->height) < 0.2 * p->width) p->pixels[4 * (y * p->width + x) + 3] = 0;
}

static void shift_matte(vt_image *p, int by) {
  for (int y = 0; y < p->height; y++)
    for (int x = p->width - 1; x >= 0; x--) p->pixels[4 * (y * p->width + x) + 3] = x >= by ? p->pixels[4 * (y * p->width + x - by) + 3] : 0;
}

// Photographs 4, 13 and 22 get a matte with a hole, that of another tree, and their own a sixteenth of the width off.
static void damage_three(vt_context *context, vt_views *views) {
  vt_views other = photograph_tree(context, VT_SYNTHETIC_TREE, 77, views->count, 0, views->items[0].picture.width);
  cut_hole(&views->items[4].picture);
  vt_image *to = &views->items[13].picture, *from = &other.items[13].picture;
  for (int i = 0; i < to->width * to->height; i++) to->pixels[4 * i + 3] = from->pixels[4 * i + 3];
  shift_matte(&views->items[22].picture, views->items[22].picture.width / 16);
  vt_free_views(context, &other);
}

static double held_out_error(vt_context *context, const vt_views *views) {
  static const float white[3] = {1, 1, 1};
  vt_tree tree;
  double sum = 0;
  int count = 0;
  fails_never(context, vt_reconstruct_opacity(context, views, VT_SOLVER_ADAM, 0, 5, &tree, NULL));
  for (int i = 0; i < views->count; i++) {
    const vt_view *view = &views->items[i];
    vt_fimage picture;
    vt_metrics m;
    if (view->role != VT_TEST) continue;
    fails_never(context, vt_composite(context, &tree, 5, NULL, VT_BLEND_SUM, true, &view->camera, &picture));
    fails_never(context, vt_measure(context, &picture, &view->picture, white, &m));
    sum += m.alpha_rmse, count++;
    vt_free_fimage(context, &picture);
  }
  vt_free_tree(context, &tree);
  return sum / count;
}

static void three_wrong_mattes_of_32_are_found_and_nothing_else(void **state) {
  (void)state;
  vt_context *context = open_mending(2);
  vt_views views = photograph_tree(context, VT_SYNTHETIC_TREE, 1, 32, 4, 128);
  damage_three(context, &views);
  double before = held_out_error(context, &views);
  vt_matte_report report;
  fails_never(context, vt_check_mattes(context, &views, &report));
  assert_true(report.tried);
  for (int i = 0, k = 0; i < views.count; i++) {
    bool bad = k == 4 || k == 13 || k == 22;
    if (views.items[i].role == VT_TEST) {
      assert_true(report.disagreement[i] == -1);
      continue;
    }
    if (bad != (views.items[i].role == VT_DOUBTFUL) || bad)
      printf("view %d: disagreement %.3f, usual %.3f\n", k, report.disagreement[i], report.usual);
    assert_int_equal(views.items[i].role, bad ? VT_DOUBTFUL : VT_TRAIN);
    k++;
  }
  assert_int_equal(report.doubtful_count, 3);
  double after = held_out_error(context, &views);
  printf("held-out alpha RMSE %.4f, without the doubtful %.4f\n", before, after);
  assert_true(after < 0.9 * before);
  vt_free_matte_report(context, &report);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void good_mattes_are_left_alone(void **state) {
  (void)state;
  static const vt_synthetic_kind kinds[] = {VT_SYNTHETIC_TREE, VT_SYNTHETIC_BIRCH, VT_SYNTHETIC_BLOBS};
  vt_context *context = open_mending(2);
  for (int k = 0; k < 3; k++)
    for (int rough = k > 0; rough < 2; rough += 1 + (k == 0)) { // the tree as it is, the others with small faults everywhere
      vt_views views = photograph_tree(context, kinds[k], 3, 16, 0, 72);
      vt_damage_desc damage = vt_default_damage_desc();
      damage.matte_noise = 0.02, damage.matte_erosion = 0.5, damage.pose_degrees = 0.2, damage.pose_share = 0.002;
      if (rough) fails_never(context, vt_damage_views(context, &damage, &views));
      vt_matte_report report;
      fails_never(context, vt_check_mattes(context, &views, &report));
      assert_true(report.tried);
      double worst = 0;
      for (int i = 0; i < views.count; i++) worst = fmax(worst, report.disagreement[i]);
      printf("%s %d: usual %.4f, worst %.4f\n", vt_synthetic_name(kinds[k]), rough, report.usual, worst);
      assert_int_equal(report.doubtful_count, 0);
      assert_int_equal(vt_count_views(&views, VT_TRAIN), 16);
      vt_free_matte_report(context, &report);
      vt_free_views(context, &views);
    }
  vt_destroy_context(context);
}

static void few_or_empty_photographs_are_not_judged(void **state) {
  (void)state;
  vt_context *context = open_mending(1);
  for (int empty = 0; empty < 2; empty++) {
    vt_views views = photograph_tree(context, VT_SYNTHETIC_BALL, 1, empty ? 9 : 5, 0, 32);
    for (int i = 0; i < views.count && empty; i++) memset(views.items[i].picture.pixels, 0, 4 * 32 * 32);
    vt_matte_report mattes;
    vt_balance_report colours;
    fails_never(context, vt_check_mattes(context, &views, &mattes));
    fails_never(context, vt_balance_views(context, &views, &colours));
    assert_false(mattes.tried);
    assert_false(colours.changed);
    assert_int_equal(vt_count_views(&views, VT_TRAIN), views.count);
    vt_free_matte_report(context, &mattes);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

// ln of mean light of each photograph over that of the undamaged one, its deviation over the photographs.
static double exposure_left(const vt_views *views, const vt_views *clean) {
  double sum = 0, squares = 0, count = 0;
  for (int i = 0; i < views->count; i++) {
    double own = 0, right = 0;
    const vt_image *a = &views->items[i].picture, *b = &clean->items[i].picture;
    if (views->items[i].role != VT_TRAIN) continue;
    for (int k = 0; k < a->width * a->height; k++)
      if (a->pixels[4 * k + 3] > 200) own += pow(a->pixels[4 * k + 1] / 255.0, 2.2), right += pow(b->pixels[4 * k + 1] / 255.0, 2.2);
    double e = log(own / right);
    sum += e, squares += e * e, count++;
  }
  return sqrt(squares / count - sum / count * (sum / count));
}

static void exposure_jumps_are_balanced_and_one_exposure_is_not_touched(void **state) {
  (void)state;
  vt_context *context = open_mending(2);
  vt_views clean = photograph_tree(context, VT_SYNTHETIC_TREE, 2, 24, 2, 96), views = photograph_tree(context, VT_SYNTHETIC_TREE, 2, 24, 2, 96);
  vt_balance_report report;
  fails_never(context, vt_balance_views(context, &views, &report));
  printf("one exposure: deviation %.3f\n", report.deviation);
  assert_false(report.changed);
  for (int i = 0; i < views.count; i++)
    assert_memory_equal(views.items[i].picture.pixels, clean.items[i].picture.pixels, 4 * 96 * 96);
  vt_damage_desc damage = vt_default_damage_desc();
  damage.exposure = 0.4, damage.white_balance = 0.1;
  fails_never(context, vt_damage_views(context, &damage, &views));
  double before = exposure_left(&views, &clean);
  fails_never(context, vt_balance_views(context, &views, &report));
  double after = exposure_left(&views, &clean);
  printf("exposure: deviation %.3f found, true %.3f, left %.3f\n", report.deviation, before, after);
  assert_true(report.changed);
  assert_true(after < 0.6 * before);
  vt_free_views(context, &views);
  vt_free_views(context, &clean);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(three_wrong_mattes_of_32_are_found_and_nothing_else),
                                     cmocka_unit_test(good_mattes_are_left_alone),
                                     cmocka_unit_test(few_or_empty_photographs_are_not_judged),
                                     cmocka_unit_test(exposure_jumps_are_balanced_and_one_exposure_is_not_touched)};
  only_threads_for_the_thread_sanitizer();
  return cmocka_run_group_tests(tests, NULL, NULL);
}
