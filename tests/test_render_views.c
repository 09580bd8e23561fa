// test_render_views.c - the choice of views, weights and level
// SPDX-License-Identifier: BSD-3-Clause

#include "render/draw_list.h"
#include "render/render.h"
#include "tests/field_scenes.h"

static double weight_of(const vt_view_weights *w, int view) {
  for (int i = 0; i < w->count; i++)
    if (w->view[i] == view) return w->weight[i];
  return 0;
}

static double sum_of(const vt_view_weights *w) {
  double sum = 0;
  for (int i = 0; i < w->count; i++) {
    assert_true(w->weight[i] > 0);
    sum += w->weight[i];
  }
  return sum;
}

static vt_tree views_only(int count, vt_camera *cameras) {
  return (vt_tree){.octree = {.origin = {-1, -1, -1}, .edge = 2, .branching = 2, .level_count = 1}, .texel_edge = 4,
                   .tile_side = 1.5f, .view_count = count, .cameras = cameras};
}

static void eye_in_a_cameras_direction_sees_that_view_alone(void **state) {
  (void)state;
  vt_camera cameras[7];
  scene_ring(7, cameras);
  vt_tree tree = views_only(7, cameras);
  for (int v = 0; v < 7; v++)
    for (int k = 1; k <= 4; k++) {
      vt_vec3 eye = vt_scale(vt_camera_centre(&cameras[v]), k == 2 ? 1 : 2); // the root's centre is the world's
      vt_view_weights w = vt_choose_views(&tree, eye, k);
      assert_int_equal(w.view[0], v);
      assert_close(w.weight[0], 1, 1e-6);
      assert_close(sum_of(&w), 1, 1e-6);
    }
}

static void closest_views_weigh_most_and_follow_the_formula(void **state) {
  (void)state;
  vt_camera cameras[5];
  double angles[5] = {0.9, -0.1, 0.3, 2.0, -0.45}; // of the cameras on a circle; the eye is at 0
  for (int i = 0; i < 5; i++) cameras[i] = scene_camera(3 * cos(angles[i]), 3 * sin(angles[i]), 0, 64);
  vt_tree tree = views_only(5, cameras);
  vt_view_weights w = vt_choose_views(&tree, vt_v3(5, 0, 0), 2);
  double a = 1 / 0.1 * (1 - 0.1 / 0.45), b = 1 / 0.3 * (1 - 0.3 / 0.45);
  assert_int_equal(w.count, 2);
  assert_int_equal(w.view[0], 1);
  assert_int_equal(w.view[1], 2);
  assert_close(w.weight[0], a / (a + b), 1e-5);
  assert_close(w.weight[1], b / (a + b), 1e-5);
  w = vt_choose_views(&tree, vt_v3(5, 0, 0), 5); // no sixth view: by the angles alone
  double sum = 1 / 0.1 + 1 / 0.3 + 1 / 0.45 + 1 / 0.9 + 1 / 2.0;
  assert_int_equal(w.count, 5);
  assert_close(weight_of(&w, 3), 1 / 2.0 / sum, 1e-6);
  assert_close(weight_of(&w, 4), 1 / 0.45 / sum, 1e-6);
}

static void fewer_cameras_than_wanted_are_all_used(void **state) {
  (void)state;
  vt_camera cameras[2];
  scene_ring(2, cameras);
  vt_tree tree = views_only(2, cameras);
  vt_view_weights w = vt_choose_views(&tree, vt_v3(1, 2, 3), 8);
  assert_int_equal(w.count, 2);
  assert_close(sum_of(&w), 1, 1e-6);
  tree.view_count = 1;
  w = vt_choose_views(&tree, vt_v3(-1, 2, -3), 3);
  assert_int_equal(w.count, 1);
  assert_true(w.weight[0] == 1);
  tree.view_count = 0;
  assert_int_equal(vt_choose_views(&tree, vt_v3(1, 2, 3), 2).count, 0);
}

static void equal_angles_and_degenerate_eyes_give_finite_weights(void **state) {
  (void)state;
  vt_camera cameras[6];
  for (int i = 0; i < 6; i++) cameras[i] = scene_camera(i & 1 ? 2 : -2, i & 2 ? 2 : -2, i & 4 ? 2 : -2, 64);
  cameras[5] = cameras[4]; // identical photographs
  vt_tree tree = views_only(6, cameras);
  vt_vec3 eyes[] = {{0, 0, 0}, {0, 0, 5}, {0, 0, -5}, {2, 0, 0}, {-2, -2, 2}};
  for (int e = 0; e < 5; e++)
    for (int k = 1; k <= 6; k++) {
      vt_view_weights w = vt_choose_views(&tree, eyes[e], k);
      assert_close(sum_of(&w), 1, 1e-5);
    }
  vt_view_weights w = vt_choose_views(&tree, vt_v3(0, 0, -5), 2); // four at the same angle: the first two, equally
  assert_int_equal(w.view[0], 0);
  assert_int_equal(w.view[1], 1);
  assert_close(w.weight[0], 0.5, 1e-6);
  w = vt_choose_views(&tree, vt_v3(-2, -2, 2), 2);
  assert_int_equal(w.view[0], 4);
  assert_true(w.weight[0] == 1);
}

static vt_view_weights weights_on_path(const vt_tree *tree, double t, int k) {
  return vt_choose_views(tree, vt_v3(4 * cos(t), 4 * sin(t), 1 + sin(3 * t)), k);
}

static double change(const vt_view_weights *a, const vt_view_weights *b) {
  double worst = 0;
  for (int v = 0; v < 24; v++) worst = fmax(worst, fabs(weight_of(a, v) - weight_of(b, v)));
  return worst;
}

// Wherever the weights change by more than 1 % in a step, the step is halved towards the greater change: a jump stays,
// a slope vanishes.
static void weights_change_without_jumps_along_a_path(void **state) {
  (void)state;
  for (uint64_t seed = 1; seed <= 4; seed++) {
    vt_camera cameras[24];
    vt_rng rng = vt_seed_rng(seed, 3);
    for (int i = 0; i < 24; i++)
      cameras[i] = scene_camera(vt_random_between(&rng, -3, 3), vt_random_between(&rng, -3, 3),
                                vt_random_between(&rng, -1, 3), 64);
    vt_tree tree = views_only(24, cameras);
    for (int k = 2; k <= 4; k++) {
      int changes = 0;
      vt_view_weights before = weights_on_path(&tree, 0, k);
      for (int i = 1; i <= 5000; i++) {
        double t0 = 2 * VT_PI * (i - 1) / 5000, t1 = 2 * VT_PI * i / 5000;
        vt_view_weights now = weights_on_path(&tree, t1, k), a = before, b = now;
        for (int half = 0; half < 40 && change(&a, &b) > 0.01; half++) {
          double t = 0.5 * (t0 + t1);
          vt_view_weights middle = weights_on_path(&tree, t, k);
          if (change(&a, &middle) > change(&middle, &b)) t1 = t, b = middle;
          else t0 = t, a = middle;
        }
        assert_true(change(&a, &b) <= 0.01);
        changes += before.view[k - 1] != now.view[k - 1];
        before = now;
      }
      assert_true(changes > 10);
    }
  }
}

static void shifted_and_scaled_scenes_choose_the_same_views(void **state) {
  (void)state;
  vt_camera cameras[9];
  scene_ring(9, cameras);
  vt_tree tree = views_only(9, cameras);
  vt_view_weights w = vt_choose_views(&tree, vt_v3(2, 1, 0.7), 3);
  vt_vec3 shift = {2e6, -1e6, 3e6};
  for (int i = 0; i < 9; i++)
    cameras[i].translation = vt_scale(vt_mul(&cameras[i].rotation, vt_add(vt_camera_centre(&cameras[i]), shift)), -1);
  tree.octree.origin = vt_add(tree.octree.origin, shift);
  vt_view_weights moved = vt_choose_views(&tree, vt_add(vt_v3(2, 1, 0.7), shift), 3);
  for (int i = 0; i < 3; i++) {
    assert_int_equal(w.view[i], moved.view[i]);
    assert_close(w.weight[i], moved.weight[i], 1e-6);
  }
}

// A tree with cells on levels 0..4 and textures on 1..4.
static vt_tree level_tree(vt_context *context) {
  vt_tree tree = {.octree = {.origin = {-1, -1, -1}, .edge = 2, .branching = 2, .level_count = 5}, .texel_edge = 4,
                  .tile_side = 1.6f};
  for (int l = 0; l < 5; l++) {
    const uint16_t low[][3] = {{0, 0, 0}};
    assert_int_equal(vt_make_level(context, 2, l, 1, low, &tree.octree.levels[l]), VT_OK);
    tree.tiles[l].view_count = l > 0;
  }
  return tree;
}

static void level_is_the_coarsest_that_is_fine_enough(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_tree tree = level_tree(context);
  vt_camera camera = vt_look_at(vt_v3(-1, -1, -3), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 0.8, 400, 400);
  // the tree's only cell of level 3 starts at z = -1: distance 2; a texel of level l covers 0.8 / 2^l
  for (int l = 1; l <= 4; l++) {
    double texel = 1.6 / 4 * (2.0 / (1 << l)) * camera.fx / 2;
    assert_int_equal(vt_choose_level(&tree, &camera, texel * 1.001), l);
    assert_int_equal(vt_choose_level(&tree, &camera, texel * 0.999), l < 4 ? l + 1 : 4);
  }
  assert_int_equal(vt_choose_level(&tree, &camera, 1e9), 1); // level 0 has no textures
  camera = vt_look_at(vt_v3(-0.99, -0.99, -0.99), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 0.8, 400, 400);
  assert_int_equal(vt_choose_level(&tree, &camera, 1), 4); // within the tree
  for (int l = 0; l < 5; l++) tree.tiles[l].view_count = 0;
  camera = vt_look_at(vt_v3(-1, -1, -3), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 0.8, 400, 400);
  assert_int_equal(vt_choose_level(&tree, &camera, camera.fx * 1.001), 0); // flat: an edge of 2 at distance 2
  assert_int_equal(vt_choose_level(&tree, &camera, camera.fx * 0.999), 1);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

// Photographs are reduced to texel_edge pixels a cell, whatever the side of a tile; flat a cell is as coarse as a texel.
static void view_textures_and_flat_cells_have_levels_too(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_tree tree = level_tree(context);
  vt_camera camera = vt_look_at(vt_v3(-1, -1, -3), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 0.8, 400, 400);
  for (int l = 1; l < 5; l++) {
    tree.tiles[l].view_count = 0;
    tree.view_textures[l] = (vt_view_textures){.view_count = 1, .factor = 16 >> l, .views = VT_NEW(context, vt_view_texture, 1)};
  }
  for (int l = 1; l <= 4; l++) {
    double cell = 2.0 / (1 << l) * camera.fx / 2;
    assert_int_equal(vt_choose_level(&tree, &camera, cell / 4 * 1.001), l);
    assert_int_equal(vt_choose_level(&tree, &camera, cell / 4 * 0.999), l < 4 ? l + 1 : 4);
    vt_renderer *renderer = NULL;
    vt_render_desc desc = vt_default_render_desc();
    vt_render_report report;
    vt_fimage image;
    desc.flat = true;
    assert_int_equal(vt_create_renderer(context, &tree, VT_BACKEND_CPU, &renderer), VT_OK);
    for (int finer = 0; finer < 2; finer++) {
      desc.texel_pixels = cell * (finer ? 0.999 : 1.001);
      assert_int_equal(vt_render(context, renderer, &desc, &camera, &image, &report), VT_OK);
      assert_int_equal(report.level, finer && l < 4 ? l + 1 : l);
      vt_free_fimage(context, &image);
    }
    vt_destroy_renderer(context, renderer);
  }
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void cells_with_opacity_at_any_corner_are_drawn(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_tree tree = scene_random_field(context, 3, 0.5, 3, 50, true, true);
  vt_level *cells = &tree.octree.levels[3];
  vt_view_weights weights = {.count = 1, .view = {1}, .weight = {1}}, none = {.count = 0};
  uint32_t touching = 0, corner = cells->corner_of[8 * (cells->cell_count / 2) + 7];
  for (uint32_t i = 0; i < cells->corner_count; i++) cells->corner_values[4 * i] = i == corner ? 0.5f : 0;
  for (uint32_t i = 0; i < 8 * cells->cell_count; i++) touching += cells->corner_of[i] == corner;
  assert_true(touching > 1);
  assert_int_equal(vt_count_billboards(&tree, 3, NULL), touching);
  assert_int_equal(vt_count_billboards(&tree, 3, &weights), touching);
  assert_int_equal(vt_count_billboards(&tree, 3, &none), 0);
  vt_draw_list list = {0};
  bool changed;
  vt_vec3 eye = {2, 3, 1};
  assert_int_equal(vt_update_draw_list(context, &tree, 3, &weights, eye, &list, &changed), VT_OK);
  assert_true(changed && list.count == touching);
  weights.view[0] = 2; // the same cells whatever the views, and flat
  assert_int_equal(vt_update_draw_list(context, &tree, 3, &weights, eye, &list, &changed), VT_OK);
  assert_false(changed);
  assert_int_equal(vt_update_draw_list(context, &tree, 3, NULL, eye, &list, &changed), VT_OK);
  assert_false(changed);
  assert_int_equal(vt_update_draw_list(context, &tree, 3, &none, eye, &list, &changed), VT_OK);
  assert_true(changed && list.count == 0);
  vt_free_view_textures(context, &tree.view_textures[3]); // a field without textures is drawn flat only
  assert_int_equal(vt_count_billboards(&tree, 3, &weights), 0);
  assert_int_equal(vt_count_billboards(&tree, 3, NULL), touching);
  vt_free_draw_list(context, &list);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void turning_the_head_changes_no_level(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_tree tree = level_tree(context);
  int first = -1;
  for (int i = 0; i < 20; i++) {
    vt_camera camera = vt_look_at(vt_v3(3, 9, -8), vt_v3(i * 0.5 - 5, 0, 0), vt_v3(0, 0, 1), 0.8, 400, 400);
    int level = vt_choose_level(&tree, &camera, 5);
    if (first < 0) first = level;
    assert_int_equal(level, first);
  }
  assert_true(first > 1 && first < 4);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(eye_in_a_cameras_direction_sees_that_view_alone),
      cmocka_unit_test(closest_views_weigh_most_and_follow_the_formula),
      cmocka_unit_test(fewer_cameras_than_wanted_are_all_used),
      cmocka_unit_test(equal_angles_and_degenerate_eyes_give_finite_weights),
      cmocka_unit_test(weights_change_without_jumps_along_a_path),
      cmocka_unit_test(shifted_and_scaled_scenes_choose_the_same_views),
      cmocka_unit_test(level_is_the_coarsest_that_is_fine_enough),
      cmocka_unit_test(view_textures_and_flat_cells_have_levels_too),
      cmocka_unit_test(cells_with_opacity_at_any_corner_are_drawn),
      cmocka_unit_test(turning_the_head_changes_no_level),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
