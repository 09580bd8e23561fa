// test_redundant.c - photographs that say nothing new: seen, and dropped without anything lost
// SPDX-License-Identifier: BSD-3-Clause
//
// The same capture with all its photographs once and twice, and in bursts from next to the same place.
#include "base/image_metrics.h"
#include "base/rng.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/reconstruct.h"
#include "tests/unit.h"

#include <string.h>

typedef struct outcome {
  vt_tree tree;
  vt_reconstruct_report report;
  uint64_t pixels; // of view textures on all levels
  double held_out, own; // PSNR over white of views never seen, and of the photographs, means
} outcome;

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

static double psnr_of(vt_context *context, const vt_tree *tree, const vt_view *view) {
  const float white[3] = {1, 1, 1};
  vt_view_weights weights = vt_choose_views(tree, vt_camera_centre(&view->camera), 4);
  vt_fimage picture;
  vt_metrics m;
  int leaf = tree->octree.level_count - 1;
  assert_int_equal(vt_composite(context, tree, leaf, &weights, VT_BLEND_GEOMETRIC, false, &view->camera, &picture), VT_OK);
  assert_int_equal(vt_measure(context, &picture, &view->picture, white, &m), VT_OK);
  vt_free_fimage(context, &picture);
  return m.psnr;
}

static outcome reconstruct(vt_context *context, const vt_views *views, bool drop) {
  outcome out = {.pixels = 0};
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_DRAFT);
  desc.drop_redundant = drop;
  assert_int_equal(vt_reconstruct(context, &desc, views, &out.tree, &out.report), VT_OK);
  for (int l = 0; l < out.tree.octree.level_count; l++) out.pixels += vt_count_view_pixels(&out.tree.view_textures[l]);
  for (int v = 0; v < views->count; v++) {
    bool test = views->items[v].role == VT_TEST;
    double psnr = psnr_of(context, &out.tree, &views->items[v]);
    *(test ? &out.held_out : &out.own) += psnr / vt_count_views(views, views->items[v].role);
  }
  return out;
}

// All photographs of `views`, and those that are no tests so many times more; the pictures belong to `views`.
static vt_views with_copies(vt_context *context, const vt_views *views, int copies) {
  int train = vt_count_views(views, VT_TRAIN);
  vt_views out = {.count = views->count + copies * train};
  out.items = VT_NEW(context, vt_view, (size_t)out.count);
  assert_non_null(out.items);
  int n = 0;
  for (int i = 0; i < views->count; i++) out.items[n++] = views->items[i];
  for (int c = 0; c < copies; c++)
    for (int i = 0; i < views->count; i++)
      if (views->items[i].role == VT_TRAIN) out.items[n++] = views->items[i];
  assert_int_equal(n, out.count);
  return out;
}

static void every_photograph_twice_is_half_the_textures_and_the_same_picture(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_synthetic_desc desc;
  vt_views views;
  assert_true(vt_find_scene("tree_96", &desc));
  assert_int_equal(vt_make_synthetic_views(context, &desc, &views), VT_OK);
  vt_views twice = with_copies(context, &views, 1);
  outcome one = reconstruct(context, &views, true), two = reconstruct(context, &twice, true);
  printf("once: %llu pixels of textures, held out %.2f dB, own %.2f dB; twice: %d of %d dropped, %llu pixels, %.2f dB, %.2f dB\n",
         (unsigned long long)one.pixels, one.held_out, one.own, two.report.redundant_views, two.tree.view_count,
         (unsigned long long)two.pixels, two.held_out, two.own);
  assert_int_equal(one.report.redundant_views, 0);
  assert_int_equal(two.report.redundant_views, one.tree.view_count);
  assert_close((double)two.pixels / (double)one.pixels, 1, 0.02);
  assert_true(two.held_out >= one.held_out - 0.05);
  assert_true(two.own >= one.own - 0.3);
  for (int v = 0; v < one.tree.view_count; v++) { // of two, the first is kept
    const vt_view_textures *finest = &two.tree.view_textures[two.tree.octree.level_count - 1];
    assert_true(finest->views[v].columns > 0);
    assert_int_equal(finest->views[v + one.tree.view_count].columns, 0);
  }
  vt_free_tree(context, &one.tree);
  vt_free_tree(context, &two.tree);
  vt_free(context, twice.items);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

// The next photograph of a burst: the camera turned about the upright axis by a tenth of a degree (a seventh of a pixel at the
// rim of the tree), with the same picture but for noise of its own, as an error of calibration would have it.
static void step_aside(vt_context *context, vt_view *view, vt_rng *rng) {
  double turn = 0.1 / 180 * VT_PI, c = cos(turn), s = sin(turn);
  vt_image picture;
  for (int row = 0; row < 3; row++) { // R Rz^T; t = -R C stays as it is for a turned C
    double *r = view->camera.rotation.m + 3 * row, x = r[0], y = r[1];
    r[0] = c * x - s * y, r[1] = s * x + c * y;
  }
  assert_int_equal(vt_make_image(context, view->picture.width, view->picture.height, 4, &picture), VT_OK);
  for (int i = 0; i < 4 * picture.width * picture.height; i++) {
    int value = view->picture.pixels[i] + (i % 4 < 3 ? (int)(vt_random(rng) % 5) - 2 : 0);
    picture.pixels[i] = (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
  }
  view->picture = picture;
}

static void of_bursts_one_photograph_each_stays_and_the_views_between_are_as_good(void **state) {
  (void)state;
  enum { BURST = 3 };
  vt_context *context = make_context();
  vt_synthetic_desc desc;
  vt_views views;
  vt_rng rng = vt_seed_rng(3, 1);
  assert_true(vt_find_scene("tree_96", &desc));
  assert_int_equal(vt_make_synthetic_views(context, &desc, &views), VT_OK);
  vt_views bursts = with_copies(context, &views, BURST - 1);
  for (int i = views.count; i < bursts.count; i++)
    for (int n = 0; n <= (i - views.count) / desc.train_count; n++) {
      vt_image before = bursts.items[i].picture;
      step_aside(context, &bursts.items[i], &rng);
      if (n) vt_free_image(context, &before);
    }
  outcome all = reconstruct(context, &bursts, false), some = reconstruct(context, &bursts, true);
  printf("bursts of %d, all: %llu pixels, held out %.2f dB, own %.2f dB; %d of %d dropped: %llu pixels, %.2f dB, %.2f dB\n",
         BURST, (unsigned long long)all.pixels, all.held_out, all.own, some.report.redundant_views, some.tree.view_count,
         (unsigned long long)some.pixels, some.held_out, some.own);
  assert_int_equal(all.report.redundant_views, 0);
  assert_true(some.report.redundant_views >= (BURST - 1) * desc.train_count * 9 / 10);
  assert_true(some.report.redundant_views <= (BURST - 1) * desc.train_count); // one of each stays
  assert_true((double)some.pixels < 0.45 * (double)all.pixels);
  assert_true(some.held_out >= all.held_out - 0.05);
  vt_free_tree(context, &all.tree);
  vt_free_tree(context, &some.tree);
  for (int i = views.count; i < bursts.count; i++) vt_free_image(context, &bursts.items[i].picture);
  vt_free(context, bursts.items);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(every_photograph_twice_is_half_the_textures_and_the_same_picture),
                                     cmocka_unit_test(of_bursts_one_photograph_each_stays_and_the_views_between_are_as_good)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
