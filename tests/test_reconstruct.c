// test_reconstruct.c - bounds, hull, opacity, field and textures against phantoms with known truth
// SPDX-License-Identifier: BSD-3-Clause
#include "base/image_metrics.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/reconstruct.h"
#include "render/render.h"
#include "tests/field_checks.h"
#include "tests/unit.h"

static vt_context *make_context(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads;
  desc.log_level = VT_LOG_QUIET;
  return vt_create_context(&desc);
}

static vt_synthetic_desc phantom(vt_synthetic_kind kind, int views, int size) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = kind;
  desc.train_count = views;
  desc.test_count = 4;
  desc.width = desc.height = size;
  desc.supersample = 2;
  desc.peak_extinction = 2;
  return desc;
}

// Mean alpha RMSE of the test views, drawn without textures.
static double held_out_alpha(vt_context *context, const vt_tree *tree, const vt_views *views, bool flat) {
  double sum = 0;
  int count = 0;
  const float white[3] = {1, 1, 1};
  for (int i = 0; i < views->count; i++) {
    if (views->items[i].role != VT_TEST) continue;
    vt_fimage picture;
    vt_metrics metrics;
    vt_view_weights weights = vt_choose_views(tree, vt_camera_centre(&views->items[i].camera), 2);
    assert_int_equal(vt_composite(context, tree, tree->octree.level_count - 1, &weights, VT_BLEND_SUM, flat,
                                  &views->items[i].camera, &picture), VT_OK);
    assert_int_equal(vt_measure(context, &picture, &views->items[i].picture, white, &metrics), VT_OK);
    sum += metrics.alpha_rmse;
    count++;
    vt_free_fimage(context, &picture);
  }
  return sum / count;
}

static void opacity_of_phantoms_predicts_held_out_mattes(void **state) {
  (void)state;
  vt_context *context = make_context(2);
  vt_synthetic_kind kinds[] = {VT_SYNTHETIC_BALL, VT_SYNTHETIC_SHELL, VT_SYNTHETIC_BLOBS};
  for (int k = 0; k < 3; k++) {
    vt_synthetic_desc synthetic = phantom(kinds[k], 24, 64);
    vt_views views;
    vt_tree tree;
    vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
    desc.leaf_level = 5;
    assert_int_equal(vt_make_synthetic_views(context, &synthetic, &views), VT_OK);
    assert_int_equal(vt_reconstruct(context, &desc, &views, &tree, NULL), VT_OK);
    double alpha = held_out_alpha(context, &tree, &views, true);
    printf("phantom %d: held-out alpha RMSE %.4f\n", k, alpha);
    assert_true(alpha < 0.035); // 32 cells across: the hard edge of a ball is what is left
    vt_free_tree(context, &tree);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

static void every_method_makes_textures_that_predict_on_two_threads(void **state) {
  (void)state;
  vt_context *context = make_context(2);
  vt_synthetic_desc synthetic = phantom(VT_SYNTHETIC_BLOBS, 12, 48);
  vt_views views;
  assert_int_equal(vt_make_synthetic_views(context, &synthetic, &views), VT_OK);
  vt_method methods[] = {VT_METHOD_2004, VT_METHOD_2006, VT_METHOD_BEST};
  for (int m = 0; m < 3; m++) {
    vt_tree tree;
    vt_reconstruct_report report;
    vt_reconstruct_desc desc = vt_default_reconstruct_desc(methods[m], VT_PRESET_DRAFT);
    desc.leaf_level = m ? 4 : 3;
    assert_int_equal(vt_reconstruct(context, &desc, &views, &tree, &report), VT_OK);
    assert_int_equal(tree.octree.branching, m ? 2 : 3);
    assert_int_equal(tree.texel_edge, m ? 4 : 8);
    if (methods[m] == VT_METHOD_BEST) check_field(&tree);
    for (int level = 0; level < tree.octree.level_count && methods[m] != VT_METHOD_BEST; level++) {
      assert_int_equal(tree.tiles[level].tile_count, report.levels[level].billboards);
      assert_true(report.levels[level].billboards <= report.levels[level].billboards_before);
      assert_true(tree.tiles[level].tile_count > 0);
    }
    assert_true(held_out_alpha(context, &tree, &views, false) < 0.05);
    vt_free_tree(context, &tree);
  }
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void any_number_of_threads_gives_the_same_tree(void **state) {
  (void)state;
  uint64_t hash[3] = {0};
  int threads[3] = {1, 2, 7};
  for (int i = 0; i < 3; i++) {
    vt_context *context = make_context(threads[i]);
    vt_synthetic_desc synthetic = phantom(VT_SYNTHETIC_BLOBS, 9, 40);
    vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
    desc.leaf_level = 4;
    vt_views views;
    vt_tree tree;
    assert_int_equal(vt_make_synthetic_views(context, &synthetic, &views), VT_OK);
    assert_int_equal(vt_reconstruct(context, &desc, &views, &tree, NULL), VT_OK);
    hash[i] = hash_of_field_tree(&tree);
    vt_free_tree(context, &tree);
    vt_free_views(context, &views);
    vt_destroy_context(context);
  }
  for (int i = 1; i < 3; i++) assert_true(hash[i] == hash[0]);
}

// The same scene in other units and far from the origin: held-out alpha must not change.
static void scale_and_shift_change_nothing(void **state) {
  (void)state;
  double reference = 0;
  double scales[] = {1, 1e-6, 1e6, 1}, shifts[] = {0, 0, 0, 1e6};
  for (int i = 0; i < 4; i++) {
    vt_context *context = make_context(2);
    vt_synthetic_desc synthetic = phantom(VT_SYNTHETIC_BLOBS, 12, 40);
    vt_views views;
    vt_tree tree;
    assert_int_equal(vt_make_synthetic_views(context, &synthetic, &views), VT_OK);
    for (int v = 0; v < views.count; v++) { // x' = scale x + shift
      vt_camera *camera = &views.items[v].camera;
      vt_vec3 shift = vt_v3(shifts[i], -shifts[i], shifts[i]);
      camera->translation = vt_sub(vt_scale(camera->translation, scales[i]), vt_mul(&camera->rotation, shift));
    }
    vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
    desc.leaf_level = 4;
    assert_int_equal(vt_reconstruct(context, &desc, &views, &tree, NULL), VT_OK);
    double alpha = held_out_alpha(context, &tree, &views, true);
    printf("scale %g shift %g: alpha RMSE %.6f\n", scales[i], shifts[i], alpha);
    if (i == 0) reference = alpha;
    assert_close(alpha, reference, 1e-3);
    vt_free_tree(context, &tree);
    vt_free_views(context, &views);
    vt_destroy_context(context);
  }
}

static void empty_mattes_and_no_views_are_refused(void **state) {
  (void)state;
  vt_context *context = make_context(1);
  vt_synthetic_desc synthetic = phantom(VT_SYNTHETIC_BALL, 5, 24);
  vt_views views, none = {0};
  vt_tree tree;
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_DRAFT);
  assert_int_equal(vt_reconstruct(context, &desc, &none, &tree, NULL), VT_TOO_FEW_VIEWS);
  vt_clear_error(context);
  assert_int_equal(vt_make_synthetic_views(context, &synthetic, &views), VT_OK);
  for (int v = 0; v < views.count; v++)
    for (int i = 0; i < 24 * 24; i++) views.items[v].picture.pixels[4 * i + 3] = 0;
  assert_int_equal(vt_reconstruct(context, &desc, &views, &tree, NULL), VT_BAD_INPUT);
  assert_true(strlen(vt_last_error(context)) > 20);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

// One view, two identical ones, all cameras clustered, mattes of 0 and 255 only: no crash, finite values.
static void degenerate_captures_stay_finite(void **state) {
  (void)state;
  for (int kind = 0; kind < 4; kind++) {
    vt_context *context = make_context(2);
    vt_synthetic_desc synthetic = phantom(VT_SYNTHETIC_BALL, 6, 32);
    vt_views views;
    vt_tree tree;
    assert_int_equal(vt_make_synthetic_views(context, &synthetic, &views), VT_OK);
    for (int v = 0; v < views.count; v++) {
      if (kind == 0) views.items[v].role = v ? VT_TEST : VT_TRAIN;
      if (kind == 1) views.items[v].role = v > 1 ? VT_TEST : VT_TRAIN;
      if (kind == 1 || kind == 2) {
        views.items[v].camera = views.items[0].camera;
        views.items[v].camera.translation.x += kind == 2 ? 1e-3 * v : 0;
      }
      for (int i = 0; kind == 3 && i < 32 * 32; i++) {
        uint8_t *alpha = &views.items[v].picture.pixels[4 * i + 3];
        *alpha = *alpha > 100 ? 255 : 0;
      }
    }
    vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
    desc.leaf_level = 4;
    assert_int_equal(vt_reconstruct(context, &desc, &views, &tree, NULL), VT_OK);
    check_field(&tree);
    vt_free_tree(context, &tree);
    vt_free_views(context, &views);
    vt_destroy_context(context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(opacity_of_phantoms_predicts_held_out_mattes),
      cmocka_unit_test(every_method_makes_textures_that_predict_on_two_threads),
      cmocka_unit_test(any_number_of_threads_gives_the_same_tree),
      cmocka_unit_test(scale_and_shift_change_nothing),
      cmocka_unit_test(empty_mattes_and_no_views_are_refused),
      cmocka_unit_test(degenerate_captures_stay_finite)};
  only_threads_for_the_thread_sanitizer();
  return cmocka_run_group_tests(tests, NULL, NULL);
}
