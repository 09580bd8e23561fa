// test_synthetic_rigs.c - where the cameras of each rig stand, and what they have in their frames
// SPDX-License-Identifier: BSD-3-Clause
#include "datasets-synthetic/synthetic.h"
#include "tests/unit.h"

enum { RIG_COUNT = VT_RIG_HANDHELD + 1 };
static const char *const rig_names[RIG_COUNT] = {"spiral", "ring", "hemisphere", "arc", "drone", "handheld"};

static vt_context *open_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

static vt_views make_views(vt_context *context, vt_synthetic_kind kind, vt_rig rig, int train, int test, int width,
                           int height) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  vt_views views;
  desc.kind = kind, desc.rig = rig, desc.train_count = train, desc.test_count = test;
  desc.width = width, desc.height = height, desc.supersample = 1, desc.leaf_count = 800;
  if (vt_make_synthetic_views(context, &desc, &views)) fail_msg("%s", vt_last_error(context));
  return views;
}

static vt_vec3 direction_of(const vt_view *view) {
  return vt_normalise(vt_camera_centre(&view->camera));
}
static double elevation_of(const vt_view *view) {
  return asin(direction_of(view).z) * 180 / VT_PI;
}
static double azimuth_of(const vt_view *view) {
  vt_vec3 d = direction_of(view);
  return atan2(d.y, d.x) * 180 / VT_PI;
}

static void every_rig_keeps_the_object_in_the_frame(void **state) {
  (void)state;
  vt_context *context = open_context();
  const int sizes[][2] = {{96, 96}, {120, 60}, {60, 110}};
  for (int rig = 0; rig < RIG_COUNT; rig++)
    for (int k = 0; k < 4; k++) {
      int width = sizes[k % 3][0], height = sizes[k % 3][1];
      vt_synthetic_kind kind = k == (int)rig % 3 ? VT_SYNTHETIC_TREE : VT_SYNTHETIC_BALL;
      vt_views views = make_views(context, kind, (vt_rig)rig, 7, 3, width, height);
      double reach = 0;
      for (int i = 0; i < views.count; i++)
        for (int p = 0; p < width * height; p++)
          if (views.items[i].picture.pixels[4 * p + 3]) {
            reach = fmax(reach, fabs(p % width + 0.5 - width / 2.0) / (width / 2.0));
            reach = fmax(reach, fabs(p / width + 0.5 - height / 2.0) / (height / 2.0));
          }
      if (kind == VT_SYNTHETIC_TREE) printf("%s: reaches %.3f of the half frame\n", rig_names[rig], reach);
      assert_true(reach > (rig == VT_RIG_HANDHELD ? 0.68 : 0.76) && reach < 0.86);
      vt_free_views(context, &views);
    }
  vt_destroy_context(context);
}

static void test_views_stand_between_training_views(void **state) {
  (void)state;
  vt_context *context = open_context();
  const int counts[][2] = {{24, 6}, {12, 12}, {5, 11}, {2, 3}, {1, 2}, {1, 1}, {40, 7}};
  for (int rig = 0; rig < RIG_COUNT; rig++)
    for (int k = 0; k < 7; k++) {
      vt_views views = make_views(context, VT_SYNTHETIC_BALL, (vt_rig)rig, counts[k][0], counts[k][1], 4, 4);
      double least = 180;
      assert_int_equal(vt_count_views(&views, VT_TRAIN), counts[k][0]);
      assert_int_equal(vt_count_views(&views, VT_TEST), counts[k][1]);
      for (int i = 0; i < views.count; i++) {
        assert_int_equal(vt_check_camera(context, &views.items[i].camera, "rig"), VT_OK);
        for (int j = 0; j < i; j++) {
          double cosine = vt_dot(direction_of(&views.items[i]), direction_of(&views.items[j]));
          least = fmin(least, acos(fmin(1, cosine)) * 180 / VT_PI);
        }
      }
      if (k == 0) printf("%s: 24 and 6 views at least %.2f degrees apart\n", rig_names[rig], least);
      assert_true(least > 0.8);
      vt_free_views(context, &views);
    }
  vt_destroy_context(context);
}

static void rigs_have_the_shapes_that_the_face_says(void **state) {
  (void)state;
  vt_context *context = open_context();
  const double lowest[RIG_COUNT] = {-5, 10, 0, 5, 15, -9}, highest[RIG_COUNT] = {60, 10, 90, 25, 65, -4};
  for (int rig = 0; rig < RIG_COUNT; rig++) {
    vt_views views = make_views(context, VT_SYNTHETIC_BALL, (vt_rig)rig, 30, 5, 4, 4);
    double low = 90, high = -90, widest = 0, gap = 0;
    for (int i = 0; i < views.count; i++) {
      low = fmin(low, elevation_of(&views.items[i])), high = fmax(high, elevation_of(&views.items[i]));
      widest = fmax(widest, fabs(azimuth_of(&views.items[i])));
    }
    assert_true(low >= lowest[rig] - 1e-9 && high <= highest[rig] + 1e-9);
    assert_true(low < lowest[rig] + 3 && high > highest[rig] - 11);
    if (rig == VT_RIG_ARC) assert_close(widest, 50, 1e-9);
    if (rig == VT_RIG_DRONE)
      for (int i = 1; i < 30; i++) assert_true(elevation_of(&views.items[i]) > elevation_of(&views.items[i - 1]));
    for (int i = 0; i < 30 && rig == VT_RIG_RING; i++) { // all round
      double step = fabs(remainder(azimuth_of(&views.items[(i + 1) % 30]) - azimuth_of(&views.items[i]), 360));
      gap = fmax(gap, step);
    }
    assert_true(rig != VT_RIG_RING || fabs(gap - 12) < 1e-6);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

static void a_walk_by_hand_is_unsteady_and_repeats(void **state) {
  (void)state;
  vt_context *context = open_context();
  vt_views a = make_views(context, VT_SYNTHETIC_BALL, VT_RIG_HANDHELD, 20, 4, 100, 100);
  vt_views b = make_views(context, VT_SYNTHETIC_BALL, VT_RIG_HANDHELD, 20, 4, 100, 100);
  double most_aim = 0, most_roll = 0, nearest = 1e9, farthest = 0;
  for (int i = 0; i < a.count; i++) {
    const vt_camera *camera = &a.items[i].camera;
    assert_memory_equal(camera, &b.items[i].camera, sizeof *camera);
    double pixel[2], distance = vt_length(vt_camera_centre(camera));
    assert_true(vt_project(camera, vt_v3(0, 0, 0), pixel));
    most_aim = fmax(most_aim, hypot(pixel[0] - 50, pixel[1] - 50));
    most_roll = fmax(most_roll, fabs(asin(camera->rotation.m[2]))); // how far its right is from level
    nearest = fmin(nearest, distance), farthest = fmax(farthest, distance);
  }
  printf("handheld: aim off by %.1f pixels of 100, roll %.1f degrees, distances %.3f to %.3f\n", most_aim,
         most_roll * 180 / VT_PI, nearest, farthest);
  assert_true(most_aim > 2 && most_aim < 9);
  assert_true(most_roll > 2 * VT_PI / 180 && most_roll < 6 * VT_PI / 180);
  assert_true(farthest / nearest > 1.03 && farthest / nearest < 1.081);
  vt_free_views(context, &a);
  vt_free_views(context, &b);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(every_rig_keeps_the_object_in_the_frame),
                                     cmocka_unit_test(test_views_stand_between_training_views),
                                     cmocka_unit_test(rigs_have_the_shapes_that_the_face_says),
                                     cmocka_unit_test(a_walk_by_hand_is_unsteady_and_repeats)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
