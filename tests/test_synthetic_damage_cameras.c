// test_synthetic_damage_cameras.c - mattes and cameras are wrong by the amounts that were asked for
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/damage_bench.h"

// ---- matte

static void erosion_moves_the_edge_by_fractions_of_pixels(void **state) {
  (void)state;
  const double amounts[] = {0.3, 1, 2.6, -0.4, -3};
  vt_context *context = open_context(1);
  for (int k = 0; k < 5; k++) {
    vt_damage_desc d = vt_default_damage_desc();
    d.matte_erosion = amounts[k];
    vt_views views = make_views(context, 1, 100, 100);
    draw_disc(&views.items[0].picture, 30);
    damage(context, &d, &views);
    double radius = sqrt(covered(&views.items[0].picture) / VT_PI);
    printf("erosion %g: the disc's radius went from 30 to %.3f\n", amounts[k], radius);
    assert_close(radius, 30 - amounts[k], 0.1);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

static void blur_of_the_matte_keeps_its_area_and_leaves_colours(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  vt_damage_desc d = vt_default_damage_desc();
  d.matte_blur = 2;
  vt_views views = make_views(context, 1, 100, 100);
  draw_disc(&views.items[0].picture, 30);
  double before = covered(&views.items[0].picture);
  damage(context, &d, &views);
  assert_close(covered(&views.items[0].picture), before, 0.002 * before);
  const uint8_t *row = views.items[0].picture.pixels + 4 * 50 * 100;
  double sum = 0, first = 0, second = 0;
  for (int x = 1; x < 50; x++) {
    double rise = row[4 * x + 3] - row[4 * x - 1];
    sum += rise, first += rise * x, second += rise * x * x;
  }
  assert_close(sqrt(second / sum - first / sum * (first / sum)), sqrt(4 + 1 / 6.0),
               0.1); // the disc's own edge: a pixel
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void holes_take_their_share_of_the_area(void **state) {
  (void)state;
  const double shares[] = {0.02, 0.1, 0.5};
  vt_context *context = open_context(1);
  for (int k = 0; k < 3; k++) {
    vt_damage_desc d = vt_default_damage_desc();
    d.matte_holes = shares[k];
    vt_views views = make_views(context, 1, 120, 120);
    vt_image *picture = &views.items[0].picture;
    draw_disc(picture, 45);
    double before = covered(picture);
    damage(context, &d, &views);
    double lost = 1 - covered(picture) / before;
    printf("holes %g: lost %.4f\n", shares[k], lost);
    assert_close(lost, shares[k], 14 / before + 0.001); // the last hole is whole
    int clear = 0;
    for (int y = 50; y < 70; y++)
      for (int x = 50; x < 70; x++) clear += picture->pixels[4 * (y * 120 + x) + 3] < 10;
    assert_true(k == 0 || clear > 4); // inside it, not at its rim
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

static void noise_of_the_matte_has_its_deviation(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  vt_damage_desc d = vt_default_damage_desc();
  d.matte_noise = 0.05;
  vt_views views = make_views(context, 1, 100, 100);
  vt_image *picture = &views.items[0].picture;
  fill(picture, 9, 99, 199, 128);
  damage(context, &d, &views);
  double sum = 0, squares = 0;
  for (int i = 0; i < 10000; i++) {
    double a = picture->pixels[4 * i + 3] / 255.0;
    sum += a / 10000, squares += a * a / 10000;
    assert_int_equal(picture->pixels[4 * i + 2], 199);
  }
  assert_close(sum, 128 / 255.0, 0.003);
  assert_close(sqrt(squares - sum * sum), 0.05, 0.002);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void opaque_photographs_have_no_matte_to_damage(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  vt_damage_desc d = vt_default_damage_desc();
  d.matte_noise = 0.1, d.matte_holes = 0.2, d.matte_erosion = 2;
  vt_views views = make_views(context, 1, 30, 30);
  fill(&views.items[0].picture, 1, 2, 3, 255);
  damage(context, &d, &views);
  assert_close(covered(&views.items[0].picture), 900, 0);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

// ---- cameras

static double angle_between(const vt_mat3 *a, const vt_mat3 *b) { // from |a - b|^2 = 8 sin^2(angle / 2)
  double sum = 0;
  for (int i = 0; i < 9; i++) sum += (a->m[i] - b->m[i]) * (a->m[i] - b->m[i]);
  return 2 * asin(fmin(1, sqrt(sum / 8)));
}

static void poses_are_wrong_by_the_angles_and_distances_drawn(void **state) {
  (void)state;
  enum { VIEWS = 400 };
  vt_context *context = open_context(2);
  vt_damage_desc d = vt_default_damage_desc();
  d.pose_degrees = 0.7, d.pose_share = 0.02, d.seed = 8;
  vt_views views = make_views(context, VIEWS, 2, 2), before = make_views(context, VIEWS, 2, 2);
  damage(context, &d, &views);
  double angles = 0, distances = 0;
  vt_vec3 mean = {0, 0, 0};
  for (int i = 0; i < VIEWS; i++) {
    const vt_camera *a = &before.items[i].camera, *b = &views.items[i].camera;
    assert_int_equal(vt_check_camera(context, b, "damaged"), VT_OK);
    double angle = angle_between(&a->rotation, &b->rotation) * 180 / VT_PI;
    vt_vec3 moved = vt_sub(vt_camera_centre(b), vt_camera_centre(a));
    angles += angle * angle / VIEWS;
    distances += vt_dot(moved, moved) / vt_dot(vt_camera_centre(a), vt_camera_centre(a)) / VIEWS;
    mean = vt_add(mean, vt_scale(moved, 1.0 / VIEWS));
  }
  printf("pose: %.4f degrees, %.5f of the distance\n", sqrt(angles), sqrt(distances));
  assert_close(sqrt(angles), 0.7, 0.08); // 400 draws: 3.5 % one deviation
  assert_close(sqrt(distances), 0.02, 0.0025);
  assert_true(vt_length(mean) < 0.012); // towards nowhere in particular: 0.063 / 20 one deviation
  vt_free_views(context, &views);
  vt_free_views(context, &before);
  vt_destroy_context(context);
}

static void focal_error_is_common_and_exact(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  vt_damage_desc d = vt_default_damage_desc();
  d.focal_share = -0.03;
  vt_views views = make_views(context, 3, 8, 8), before = make_views(context, 3, 8, 8);
  damage(context, &d, &views);
  for (int i = 0; i < 3; i++) {
    assert_close(views.items[i].camera.fx / before.items[i].camera.fx, 0.97, 1e-12);
    assert_close(views.items[i].camera.fy / before.items[i].camera.fy, 0.97, 1e-12);
    assert_memory_equal(&views.items[i].camera.rotation, &before.items[i].camera.rotation, sizeof(vt_mat3));
  }
  vt_free_views(context, &views);
  vt_free_views(context, &before);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(erosion_moves_the_edge_by_fractions_of_pixels),
      cmocka_unit_test(blur_of_the_matte_keeps_its_area_and_leaves_colours),
      cmocka_unit_test(holes_take_their_share_of_the_area),
      cmocka_unit_test(noise_of_the_matte_has_its_deviation),
      cmocka_unit_test(opaque_photographs_have_no_matte_to_damage),
      cmocka_unit_test(poses_are_wrong_by_the_angles_and_distances_drawn),
      cmocka_unit_test(focal_error_is_common_and_exact),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
