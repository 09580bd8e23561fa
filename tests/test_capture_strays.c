// test_capture_strays.c - what one photograph's matte shows and the others do not is cleared, and nothing of the tree
// SPDX-License-Identifier: BSD-3-Clause
#include "base/hash.h"
#include "capture/strays.h"
#include "tests/mended_views.h"

static const vt_landmarks none = {0};

static void paint(vt_image *p, double x0, double y0, double x1, double y1, double half_width) {
  for (int y = 0; y < p->height; y++)
    for (int x = 0; x < p->width; x++) {
      double dx = x1 - x0, dy = y1 - y0, t = ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy);
      t = fmin(fmax(t, 0), 1);
      if (hypot(x - x0 - t * dx, y - y0 - t * dy) < half_width) p->pixels[4 * (y * p->width + x) + 3] = 255;
    }
}

// A cable across the tree in each fourth photograph, a rail at the side in each fifth, and something at the upper edge in
// each sixth.
static void add_equipment(vt_views *views) {
  for (int i = 0; i < views->count; i++) {
    vt_image *p = &views->items[i].picture;
    double w = p->width, h = p->height;
    if (i % 4 == 1) paint(p, 0.1 * w, 0.5 * h, 0.9 * w, (0.4 + 0.01 * i) * h, 1);
    if (i % 5 == 2) paint(p, 0.06 * w, 0.1 * h, 0.06 * w, 0.4 * h, 3);
    if (i % 6 == 3) paint(p, 0.2 * w, 0, 0.8 * w, 0.01 * h, 2);
  }
}

static double alpha_of(const vt_image *p) {
  double sum = 0;
  for (int i = 0; i < p->width * p->height; i++) sum += p->pixels[4 * i + 3] / 255.0;
  return sum;
}

// All alphas one behind the other; free with vt_free.
static uint8_t *take_alphas(vt_context *context, const vt_views *views) {
  int count = views->items[0].picture.width * views->items[0].picture.height;
  uint8_t *out = VT_NEW(context, uint8_t, (size_t)count * (size_t)views->count);
  for (int i = 0; i < views->count; i++)
    for (int k = 0; k < count; k++) out[i * count + k] = views->items[i].picture.pixels[4 * k + 3];
  return out;
}

static void cables_and_rails_of_some_photographs_go_and_no_twig_does(void **state) {
  (void)state;
  static const vt_synthetic_kind kinds[] = {VT_SYNTHETIC_TREE, VT_SYNTHETIC_BIRCH};
  vt_context *context = open_mending(2);
  for (int k = 0; k < 2; k++) {
    vt_views views = photograph_tree(context, kinds[k], 1, 16, 0, 128);
    uint8_t *truth = take_alphas(context, &views);
    add_equipment(&views);
    uint8_t *before = take_alphas(context, &views);
    vt_strays report;
    fails_never(context, vt_clear_strays(context, &none, &views, &report));
    uint8_t *now = take_alphas(context, &views);
    double added = 0, gone = 0, all = 0, lost = 0;
    for (int i = 0; i < 16 * 128 * 128; i++) {
      added += before[i] - truth[i], gone += before[i] > truth[i] ? fmin(before[i] - now[i], before[i] - truth[i]) : 0;
      all += truth[i], lost += fmax(truth[i] - now[i], 0);
    }
    printf("%s: %.1f %% of the equipment and %.3f %% of the tree cleared, in %d photographs\n", vt_synthetic_name(kinds[k]),
           100 * gone / added, 100 * lost / all, report.photographs);
    assert_true(report.tried && !report.refused);
    assert_true(gone > 0.75 * added);
    assert_true(lost < 2e-4 * all);
    vt_free(context, truth), vt_free(context, before), vt_free(context, now);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

// The lower end of a tree that most frames cut off, and that hangs on the rest, stays in the few that show it.
static void what_few_photographs_frame_stays_where_it_hangs_on_the_tree(void **state) {
  (void)state;
  vt_context *context = open_mending(2);
  vt_views views = photograph_tree(context, VT_SYNTHETIC_TREE, 1, 16, 0, 120);
  double before = 0, after = 0;
  for (int i = 0; i < views.count; i++)
    if (i % 3 || i == 15) { // the lower third is not in the frame
      views.items[i].picture.height = views.items[i].camera.height = 80;
    }
  for (int i = 0; i < views.count; i++) before += alpha_of(&views.items[i].picture);
  vt_strays report;
  fails_never(context, vt_clear_strays(context, &none, &views, &report));
  for (int i = 0; i < views.count; i++) after += alpha_of(&views.items[i].picture);
  printf("%.4f of the tree left\n", after / before);
  assert_true(report.tried);
  assert_true(after > 0.9995 * before);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void mattes_of_which_each_contradicts_the_others_are_not_touched(void **state) {
  (void)state;
  vt_context *context = open_mending(2);
  vt_views views = photograph_tree(context, VT_SYNTHETIC_TREE, 1, 16, 0, 120);
  for (int i = 0; i < views.count; i++) { // each shifted to another side
    vt_image *p = &views.items[i].picture;
    size_t size = (size_t)p->width * (size_t)p->height * 4, by = size / 5 + size / 12 * (size_t)(i % 7);
    uint8_t *turned = VT_NEW(context, uint8_t, size);
    memcpy(turned, p->pixels + by % size, size - by % size), memcpy(turned + size - by % size, p->pixels, by % size);
    memcpy(p->pixels, turned, size);
    vt_free(context, turned);
  }
  uint64_t hash = vt_hash(views.items[3].picture.pixels, 4 * 120 * 120, 0);
  vt_strays report;
  fails_never(context, vt_clear_strays(context, &none, &views, &report));
  printf("%.0f %% would have gone\n", 100 * report.share);
  assert_true(report.tried && report.refused);
  assert_true(hash == vt_hash(views.items[3].picture.pixels, 4 * 120 * 120, 0));
  views.count = 7; // too few to say anything
  fails_never(context, vt_clear_strays(context, &none, &views, &report));
  assert_false(report.tried);
  views.count = 16;
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void any_number_of_threads_clears_the_same(void **state) {
  (void)state;
  uint64_t hashes[3] = {0};
  static const int thread_counts[] = {1, 2, 7};
  for (int t = 0; t < 3; t++) {
    vt_context *context = open_mending(thread_counts[t]);
    vt_views views = photograph_tree(context, VT_SYNTHETIC_TREE, 1, 12, 0, 96);
    add_equipment(&views);
    vt_strays report;
    fails_never(context, vt_clear_strays(context, &none, &views, &report));
    assert_true(report.photographs > 0);
    for (int i = 0; i < views.count; i++) hashes[t] = vt_hash(views.items[i].picture.pixels, 4 * 96 * 96, hashes[t]);
    vt_free_views(context, &views);
    vt_destroy_context(context);
  }
  assert_true(hashes[0] == hashes[1] && hashes[0] == hashes[2]);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(cables_and_rails_of_some_photographs_go_and_no_twig_does),
                                     cmocka_unit_test(what_few_photographs_frame_stays_where_it_hangs_on_the_tree),
                                     cmocka_unit_test(mattes_of_which_each_contradicts_the_others_are_not_touched),
                                     cmocka_unit_test(any_number_of_threads_clears_the_same)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
