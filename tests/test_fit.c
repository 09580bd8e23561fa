// test_fit.c - the field's gradients, and captures on which a fit might go astray
// SPDX-License-Identifier: BSD-3-Clause
//
// Gradients against finite differences, along a ray and through interpolation and ratios down to the corners. Then
// captures that say too little, or what cannot be true: their trees hold no NaN, no black speckles, and show what the
// photographs show.
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/fit.h"
#include "reconstruct/reconstruct.h"
#include "tests/field_checks.h"
#include "tests/field_scenes.h"

// ---- gradients

static void the_gradient_of_a_ray_agrees_with_finite_differences(void **state) {
  (void)state;
  vt_rng rng = vt_seed_rng(4, 2);
  for (int trial = 0; trial < 50; trial++) {
    float depth[6], value[6][4] = {{0}}, target[4], gradient[6][4], unused[6][4];
    target[3] = (float)vt_random_unit(&rng);
    for (int i = 0; i < 3; i++) target[i] = target[3] * (float)vt_random_unit(&rng);
    for (int i = 0; i < 6; i++) {
      depth[i] = (float)vt_random_between(&rng, 0.02, 1.5);
      for (int c = 0; c < 3; c++) value[i][c + 1] = (float)vt_random_unit(&rng);
    }
    vt_ray_gradient(depth, value, 6, target, gradient);
    for (int i = 0; i < 6; i++)
      for (int p = 0; p < 4; p++) {
        float *x = p ? &value[i][p] : &depth[i], keep = *x, h = 1e-2f;
        *x = keep + h;
        double up = vt_ray_gradient(depth, value, 6, target, unused);
        *x = keep - h;
        double down = vt_ray_gradient(depth, value, 6, target, unused);
        *x = keep;
        assert_close(gradient[i][p], (up - down) / (2 * (double)h), 3e-4);
      }
  }
}

// A random field and its random textures, three of which stand in for a fourth; rays from everywhere.
static void the_gradient_of_corners_agrees_with_finite_differences(void **state) {
  (void)state;
  enum { LEVEL = 2, MOST = 64, VIEWS = 3 };
  vt_context *context = scene_context(1);
  vt_tree tree = scene_random_field(context, LEVEL, 0.7, 5, 3, true, true);
  vt_level *cells = &tree.octree.levels[LEVEL];
  vt_rng rng = vt_seed_rng(9, 2);
  vt_field_view views[VIEWS];
  for (int v = 0; v < VIEWS; v++)
    views[v] = vt_aim_field_view(&tree.octree, LEVEL, &tree.cameras[v + 1], tree.view_textures[LEVEL].factor,
                                 &tree.view_textures[LEVEL].views[v + 1], 0.2f + 0.1f * v);
  float along[MOST], inside[MOST][4], value[MOST][4], log_ratio[MOST], depth[MOST], gradient[MOST][4];
  uint8_t touched[64];
  vt_fit_scratch scratch = {{along, inside, value, log_ratio}, depth, gradient};
  assert_true(vt_max_segments(cells) <= MOST);
  float *sums = VT_NEW(context, float, 4 * cells->corner_count), *unused = VT_NEW(context, float, 4 * cells->corner_count);
  int checked = 0;
  double largest = 0;
  for (int trial = 0; trial < 150; trial++) {
    vt_chord chords[MOST];
    uint32_t count;
    vt_ray ray = scene_random_ray(&rng);
    int view_count = trial % 3 ? VIEWS : 0;
    float target[4] = {0.2f, 0.4f, 0.1f, 0.6f};
    vt_walk_rays(&tree.octree, LEVEL, VT_WALK_PLAIN, &ray, 1, chords, MOST, &count);
    if (!count) continue;
    memset(sums, 0, 4 * cells->corner_count * sizeof(float));
    memset(touched, 0, sizeof touched);
    assert_true(cells->corner_count <= sizeof touched * VT_FIT_BLOCK);
    vt_field_gradient(&tree.octree, LEVEL, &ray, chords, count, views, view_count, target, &scratch, sums, touched);
    for (size_t i = 0; i < 4 * (size_t)cells->corner_count; i++) {
      assert_true(sums[i] == 0 || touched[i / 4 / VT_FIT_BLOCK]);
      if (sums[i] == 0 && trial > 5) continue; // a corner that the ray has nothing to do with
      float *x = &cells->corner_values[i], keep = *x, h = 1e-2f;
      *x = keep + h;
      double up = vt_field_gradient(&tree.octree, LEVEL, &ray, chords, count, views, view_count, target, &scratch, unused, touched);
      *x = keep - h;
      double down = vt_field_gradient(&tree.octree, LEVEL, &ray, chords, count, views, view_count, target, &scratch, unused, touched);
      *x = keep;
      assert_close(sums[i], (up - down) / (2 * (double)h), 5e-4);
      largest = fmax(largest, fabs((double)sums[i]));
      checked++;
    }
  }
  printf("%d derivatives, the largest %.3f\n", checked, largest);
  assert_true(checked > 1000 && largest > 0.1);
  vt_free(context, sums);
  vt_free(context, unused);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

// ---- captures

typedef struct work {
  vt_context *context;
  vt_views views;
  vt_tree tree;
} work;

static vt_synthetic_desc small_tree(int views, int size) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = VT_SYNTHETIC_TREE;
  desc.leaf_count = 300;
  desc.train_count = views, desc.test_count = 3;
  desc.width = desc.height = size;
  desc.supersample = 2;
  return desc;
}

static void begin(work *w, const vt_synthetic_desc *desc) {
  *w = (work){.context = scene_context(2)};
  assert_int_equal(vt_make_synthetic_views(w->context, desc, &w->views), VT_OK);
}

static void end(work *w) {
  vt_free_tree(w->context, &w->tree);
  vt_free_views(w->context, &w->views);
  vt_destroy_context(w->context);
}

static void reconstruct(work *w, int votes) {
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
  desc.hull_votes = votes;
  if (vt_reconstruct(w->context, &desc, &w->views, &w->tree, NULL)) fail_msg("%s\n", vt_last_error(w->context));
  check_field(&w->tree);
}

// Every photograph's camera sees a sane picture, blended of 1, 4 and of as many views as there may be. Training views within
// `own` of their mattes, the others within `other`.
static void check_pictures(const work *w, const char *what, double own, double other) {
  double darkest = darkest_luma(&w->views), worst[2] = {0, 0};
  int speckles = 0;
  static const int ks[] = {1, 4, VT_MAX_BLEND_VIEWS};
  for (int v = 0; v < w->views.count; v++)
    for (int i = 0; i < 3; i++) {
      const vt_view *view = &w->views.items[v];
      vt_fimage picture = draw_level(w->context, &w->tree, w->tree.octree.level_count - 1, ks[i], &view->camera);
      double *most = &worst[view->role == VT_TEST];
      speckles += count_speckles(&picture, darkest);
      *most = fmax(*most, alpha_error(&picture, &view->picture));
      vt_free_fimage(w->context, &picture);
    }
  printf("%s: alpha RMSE of own photographs %.4f, of others %.4f at worst; %d speckles\n", what, worst[0], worst[1], speckles);
  assert_int_equal(speckles, 0);
  assert_true(worst[0] <= own && worst[1] <= other);
}

static void one_photograph_is_shown_as_it_is(void **state) {
  (void)state;
  work w;
  vt_synthetic_desc desc = small_tree(1, 48);
  begin(&w, &desc);
  reconstruct(&w, 1);
  check_pictures(&w, "one photograph", 0.01, 1);
  end(&w);
}

static void two_identical_photographs_are_one(void **state) {
  (void)state;
  work w;
  vt_synthetic_desc desc = small_tree(2, 48);
  begin(&w, &desc);
  size_t bytes = 4 * (size_t)w.views.items[0].picture.width * (size_t)w.views.items[0].picture.height;
  w.views.items[1].camera = w.views.items[0].camera;
  memcpy(w.views.items[1].picture.pixels, w.views.items[0].picture.pixels, bytes);
  reconstruct(&w, 1);
  check_pictures(&w, "two identical photographs", 0.01, 1);
  end(&w);
}

static void fewer_photographs_than_are_blended(void **state) {
  (void)state;
  work w;
  vt_synthetic_desc desc = small_tree(3, 48);
  begin(&w, &desc);
  reconstruct(&w, 1);
  check_pictures(&w, "three photographs", 0.01, 0.3);
  end(&w);
}

static void photographs_of_other_exposure_and_wind(void **state) {
  (void)state;
  work w;
  vt_synthetic_desc desc = small_tree(10, 48);
  desc.wind = 0.05;
  begin(&w, &desc);
  vt_damage_desc damage = vt_default_damage_desc();
  damage.exposure = 0.7;
  damage.white_balance = 0.1;
  assert_int_equal(vt_damage_views(w.context, &damage, &w.views), VT_OK);
  reconstruct(&w, 2);
  check_pictures(&w, "exposure and wind", 0.02, 0.2);
  end(&w);
}

static void cameras_within_the_crown_and_cells_wider_than_their_photographs(void **state) {
  (void)state;
  work w;
  vt_synthetic_desc desc = small_tree(10, 48);
  desc.kind = VT_SYNTHETIC_BLOBS, desc.peak_extinction = 2;
  begin(&w, &desc);
  vt_truth *truth;
  assert_int_equal(vt_create_truth(w.context, &desc, &truth), VT_OK);
  for (int i = 0; i < 2; i++) { // a wide one from within, a narrow one from close by
    vt_view *view = &w.views.items[4 * i + 1];
    vt_vec3 eye = i ? vt_v3(0.9, 0.2, 0.1) : vt_v3(0.1, 0, 0.05);
    view->camera = vt_look_at(eye, vt_v3(-0.3, 0.1, 0), vt_v3(0, 0, 1), i ? 0.03 : 1.2, 48, 48);
    for (int p = 0; p < 48 * 48; p++) {
      vt_ray ray = vt_camera_ray(&view->camera, p % 48 + 0.5, p / 48 + 0.5);
      uint8_t *pixel = view->picture.pixels + 4 * p;
      pixel[0] = 120, pixel[1] = 140, pixel[2] = 90;
      pixel[3] = (uint8_t)(255.5 * -expm1(-vt_true_optical_depth(truth, &ray, 0, INFINITY, 0)));
    }
  }
  vt_destroy_truth(w.context, truth);
  reconstruct(&w, 1);
  check_pictures(&w, "cameras in the crown", 0.02, 0.05);
  end(&w);
}

static void one_empty_matte_of_many_takes_nothing_away(void **state) {
  (void)state;
  work w;
  vt_synthetic_desc desc = small_tree(10, 48);
  begin(&w, &desc);
  for (int p = 0; p < 48 * 48; p++) w.views.items[3].picture.pixels[4 * p + 3] = 0;
  reconstruct(&w, 2); // two photographs must agree that there is nothing
  check_pictures(&w, "an empty matte", 0.05, 0.3);
  end(&w);
}

static void mattes_of_ones_make_one_solid(void **state) {
  (void)state;
  work w;
  vt_synthetic_desc desc = small_tree(8, 32);
  begin(&w, &desc);
  for (int v = 0; v < w.views.count; v++)
    for (int p = 0; p < 32 * 32; p++) {
      uint8_t *pixel = w.views.items[v].picture.pixels + 4 * p;
      for (int c = 0; c < 3; c++) pixel[c] = (uint8_t)(pixel[3] ? pixel[c] / 2 + 100 : 200);
      pixel[3] = 255;
    }
  reconstruct(&w, 1);
  check_pictures(&w, "mattes of ones", 0.01, 0.05);
  end(&w);
}

// What a matte hides has no colour: black, the backdrop's or any other, the tree is the same to the bit.
static void transparent_pixels_have_no_colour(void **state) {
  (void)state;
  static const uint8_t hidden[3][3] = {{0, 0, 0}, {255, 0, 255}, {255, 255, 255}};
  uint64_t hash[3];
  for (int i = 0; i < 3; i++) {
    work w;
    vt_synthetic_desc desc = small_tree(8, 50); // no whole number of reduced pixels
    begin(&w, &desc);
    for (int v = 0; v < w.views.count; v++)
      for (int p = 0; p < 50 * 50; p++) {
        uint8_t *pixel = w.views.items[v].picture.pixels + 4 * p;
        if (!pixel[3]) memcpy(pixel, hidden[i], 3);
      }
    reconstruct(&w, 1);
    hash[i] = hash_of_field_tree(&w.tree);
    end(&w);
  }
  assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_gradient_of_a_ray_agrees_with_finite_differences),
      cmocka_unit_test(the_gradient_of_corners_agrees_with_finite_differences),
      cmocka_unit_test(one_photograph_is_shown_as_it_is),
      cmocka_unit_test(two_identical_photographs_are_one),
      cmocka_unit_test(fewer_photographs_than_are_blended),
      cmocka_unit_test(photographs_of_other_exposure_and_wind),
      cmocka_unit_test(cameras_within_the_crown_and_cells_wider_than_their_photographs),
      cmocka_unit_test(one_empty_matte_of_many_takes_nothing_away),
      cmocka_unit_test(mattes_of_ones_make_one_solid),
      cmocka_unit_test(transparent_pixels_have_no_colour)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
