// test_synthetic_damage.c - lens, sensor and JPEG have the amounts that were asked for, and nothing else is touched
// SPDX-License-Identifier: BSD-3-Clause
#include "base/image_file.h"
#include "base/rng.h"
#include "tests/damage_bench.h"
#include "tests/picture_bench.h"
#include "tests/quality.h"

static void no_damage_changes_nothing(void **state) {
  (void)state;
  vt_context *context = open_context(2);
  vt_synthetic_desc scene;
  vt_views views, same;
  vt_damage_desc none = vt_default_damage_desc();
  none.seed = 5;
  assert_true(vt_find_scene("blobs_64", &scene));
  assert_int_equal(vt_make_synthetic_views(context, &scene, &views), VT_OK);
  assert_int_equal(vt_make_synthetic_views(context, &scene, &same), VT_OK);
  damage(context, &none, &views);
  for (int i = 0; i < views.count; i++) {
    assert_memory_equal(views.items[i].picture.pixels, same.items[i].picture.pixels, 64 * 64 * 4);
    assert_memory_equal(&views.items[i].camera, &same.items[i].camera, sizeof(vt_camera));
  }
  vt_free_views(context, &views);
  vt_free_views(context, &same);
  vt_destroy_context(context);
}

static vt_damage_desc everything(void) {
  vt_damage_desc d = vt_default_damage_desc();
  d.seed = 3, d.noise = 0.03, d.blur = 0.8, d.jpeg_quality = 80, d.exposure = 0.3, d.white_balance = 0.1,
  d.distortion = 0.1;
  d.pose_degrees = 0.5, d.pose_share = 0.01, d.focal_share = 0.02;
  d.matte_erosion = 0.7, d.matte_blur = 0.6, d.matte_holes = 0.05, d.matte_noise = 0.02;
  return d;
}

static void any_number_of_threads_gives_the_same_bits(void **state) {
  (void)state;
  vt_synthetic_desc scene;
  vt_damage_desc all = everything();
  assert_true(vt_find_scene("shell_64", &scene));
  vt_views expected = {0};
  vt_context *first = open_context(1);
  assert_int_equal(vt_make_synthetic_views(first, &scene, &expected), VT_OK);
  damage(first, &all, &expected);
  for (int threads = 2; threads <= 7; threads += 5) {
    vt_context *context = open_context(threads);
    vt_views views;
    assert_int_equal(vt_make_synthetic_views(context, &scene, &views), VT_OK);
    damage(context, &all, &views);
    for (int i = 0; i < views.count; i++) {
      assert_memory_equal(views.items[i].picture.pixels, expected.items[i].picture.pixels, 64 * 64 * 4);
      assert_memory_equal(&views.items[i].camera, &expected.items[i].camera, sizeof(vt_camera));
    }
    vt_free_views(context, &views);
    vt_destroy_context(context);
  }
  vt_free_views(first, &expected);
  vt_destroy_context(first);
}

static void another_amount_does_not_change_what_a_draw_gives(void **state) {
  (void)state;
  vt_context *context = open_context(2);
  vt_damage_desc pose = vt_default_damage_desc(), both = everything();
  pose.seed = both.seed, pose.pose_degrees = both.pose_degrees, pose.pose_share = both.pose_share;
  both.focal_share = 0;
  vt_views a = make_views(context, 5, 40, 30), b = make_views(context, 5, 40, 30);
  damage(context, &pose, &a);
  damage(context, &both, &b);
  for (int i = 0; i < 5; i++) assert_memory_equal(&a.items[i].camera, &b.items[i].camera, sizeof(vt_camera));
  vt_free_views(context, &a);
  vt_free_views(context, &b);
  vt_destroy_context(context);
}

// ---- sensor

static void noise_at_mid_grey_has_its_deviation_and_grows_with_the_light(void **state) {
  (void)state;
  const double amounts[] = {0.01, 0.04};
  const int greys[] = {60, 128, 200};
  vt_context *context = open_context(2);
  for (int k = 0; k < 2; k++) {
    double deviation_of_light[3];
    for (int g = 0; g < 3; g++) {
      vt_damage_desc d = vt_default_damage_desc();
      d.noise = amounts[k], d.seed = 11;
      vt_views views = make_views(context, 1, 200, 200);
      fill(&views.items[0].picture, greys[g], greys[g], greys[g], 255);
      damage(context, &d, &views);
      double sum = 0, squares = 0, light = 0, light_squares = 0, count = 3 * 200 * 200;
      for (int i = 0; i < 200 * 200 * 4; i++) {
        if (i % 4 == 3) continue;
        int v = views.items[0].picture.pixels[i];
        sum += v, squares += (double)v * v, light += linear(v), light_squares += linear(v) * linear(v);
      }
      double deviation = sqrt(squares / count - sum / count * (sum / count)) / 255;
      deviation_of_light[g] = sqrt(light_squares / count - light / count * (light / count));
      printf("noise %g on grey %d: deviation %.5f, light %.5f of %.5f\n", amounts[k], greys[g], deviation,
             light / count, linear(greys[g]));
      if (greys[g] == 128)
        assert_close(deviation, sqrt(amounts[k] * amounts[k] + 1 / (12 * 255.0 * 255)), 0.02 * amounts[k]);
      assert_close(light / count, linear(greys[g]), 0.01 * linear(greys[g])); // photons are not made
      vt_free_views(context, &views);
    }
    // variance in proportion to the light, a hundredth more for rounding to bytes
    double low = pow(deviation_of_light[0], 2) / linear(60), high = pow(deviation_of_light[2], 2) / linear(200);
    assert_close(high / low, 1, 0.05);
  }
  vt_destroy_context(context);
}

static void exposure_and_white_balance_are_gains_of_light_as_drawn(void **state) {
  (void)state;
  enum { VIEWS = 200 };
  vt_context *context = open_context(2);
  vt_damage_desc d = vt_default_damage_desc();
  d.exposure = 0.5, d.white_balance = 0.1, d.seed = 4;
  vt_views views = make_views(context, VIEWS, 4, 4);
  for (int i = 0; i < VIEWS; i++) fill(&views.items[i].picture, 100, 100, 100, 255);
  damage(context, &d, &views);
  double stops = 0, red = 0, blue = 0, mean = 0;
  for (int i = 0; i < VIEWS; i++) {
    const uint8_t *p = views.items[i].picture.pixels;
    double gain = log2(linear(p[1]) / linear(100)), r = log(linear(p[0]) / linear(p[1])),
           b = log(linear(p[2]) / linear(p[1]));
    stops += gain * gain / VIEWS, red += r * r / VIEWS, blue += b * b / VIEWS, mean += gain / VIEWS;
    assert_memory_equal(p, p + 4 * 15, 4); // one gain for a photograph
  }
  printf("exposure 0.5: deviation %.3f stops, mean %.3f; balance 0.1: %.4f %.4f\n", sqrt(stops), mean, sqrt(red),
         sqrt(blue));
  assert_close(sqrt(stops), 0.5, 0.08); // 200 draws: 5 % one deviation
  assert_close(mean, 0, 0.12);
  assert_close(sqrt(red), 0.1, 0.016);
  assert_close(sqrt(blue), 0.1, 0.016);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

// ---- lens

static void a_blurred_edge_is_as_wide_as_asked(void **state) {
  (void)state;
  const double amounts[] = {0.4, 1, 3.5};
  vt_context *context = open_context(1);
  for (int k = 0; k < 3; k++) {
    vt_damage_desc d = vt_default_damage_desc();
    d.blur = amounts[k];
    vt_views views = make_views(context, 1, 64, 8);
    vt_image *picture = &views.items[0].picture;
    fill(picture, 0, 0, 0, 255);
    for (int i = 0; i < 64 * 8; i++)
      if (i % 64 >= 32) picture->pixels[4 * i] = picture->pixels[4 * i + 1] = picture->pixels[4 * i + 2] = 255;
    damage(context, &d, &views);
    double sum = 0, first = 0, second = 0; // moments of the edge's derivative in linear light
    for (int x = 1; x < 64; x++) {
      double rise = linear(picture->pixels[4 * (3 * 64 + x)]) - linear(picture->pixels[4 * (3 * 64 + x - 1)]);
      sum += rise, first += rise * x, second += rise * x * x;
    }
    double deviation = sqrt(second / sum - first / sum * (first / sum));
    printf("blur %g: edge of deviation %.4f\n", amounts[k], deviation);
    assert_close(deviation, amounts[k], 0.02 + 0.02 * amounts[k]); // what is below half a byte is lost
    assert_close(first / sum, 32, 0.02);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

static void transparent_pixels_pull_no_colour(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  for (int what = 0; what < 5; what++) {
    vt_damage_desc d = vt_default_damage_desc();
    if (what == 0) d.blur = 2;
    if (what == 1) d.jpeg_quality = 90;
    if (what == 2) d.matte_erosion = -2.5;
    if (what == 3) d.matte_blur = 1.5;
    if (what == 4) d.distortion = 0.3;
    vt_views views = make_views(context, 1, 70, 60);
    vt_image *picture = &views.items[0].picture;
    draw_disc(picture, 17.3);
    damage(context, &d, &views);
    int changed = 0, tolerance = what == 1 ? 3 : 1;
    for (int i = 0; i < 70 * 60; i++) {
      const uint8_t *p = picture->pixels + 4 * i;
      if (!p[3]) assert_true(!p[0] && !p[1] && !p[2]);
      // blurred alphas of a few 255ths round their colour
      if (p[3] > 8)
        assert_true(abs(p[0] - 200) <= tolerance && abs(p[1] - 120) <= tolerance && abs(p[2] - 40) <= tolerance + 2);
      changed += p[3] > 0 && p[3] < 255;
    }
    assert_true(changed > 50);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

static void distortion_bends_points_and_mattes_by_the_model(void **state) {
  (void)state;
  const double k1s[] = {0.25, -0.25};
  vt_context *context = open_context(1);
  for (int k = 0; k < 2; k++) {
    vt_damage_desc d = vt_default_damage_desc();
    d.distortion = k1s[k];
    vt_views views = make_views(context, 1, 200, 160);
    vt_view *view = &views.items[0];
    vt_camera before = view->camera;
    const double dots[][2] = {{150, 120}, {60, 30}, {100, 80}, {40, 100}};
    for (int i = 0; i < 4; i++)
      for (int y = 0; y < 160; y++)
        for (int x = 0; x < 200; x++) {
          double a = exp(-(pow(x + 0.5 - dots[i][0], 2) + pow(y + 0.5 - dots[i][1], 2)) / 8);
          uint8_t *p = view->picture.pixels + 4 * (y * 200 + x);
          if (a > 0.01) p[0] = p[1] = p[2] = 255, p[3] = (uint8_t)(255 * a);
        }
    damage(context, &d, &views);
    assert_memory_equal(&before, &view->camera, sizeof before);
    for (int i = 0; i < 4; i++) {
      double u = (dots[i][0] - before.cx) / before.fx, v = (dots[i][1] - before.cy) / before.fy,
             scale = 1 + k1s[k] * (u * u + v * v);
      double want_x = before.cx + before.fx * u * scale, want_y = before.cy + before.fy * v * scale, sum = 0, sx = 0,
             sy = 0;
      for (int y = 0; y < 160; y++)
        for (int x = 0; x < 200; x++) {
          double a = view->picture.pixels[4 * (y * 200 + x) + 3];
          if (hypot(x + 0.5 - want_x, y + 0.5 - want_y) < 9) sum += a, sx += a * (x + 0.5), sy += a * (y + 0.5);
        }
      assert_close(sx / sum, want_x, 0.08);
      assert_close(sy / sum, want_y, 0.08);
      assert_true(i == 2 || hypot(want_x - dots[i][0], want_y - dots[i][1]) > 0.8);
    }
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

// ---- JPEG

// Leaves and sky: colours that change fast and slowly.
static void draw_leaves(vt_image *picture) {
  vt_rng rng = vt_seed_rng(3, 3);
  for (int y = 0; y < picture->height; y++)
    for (int x = 0; x < picture->width; x++) {
      uint8_t *p = picture->pixels + 4 * (y * picture->width + x);
      p[0] = (uint8_t)(120 + x / 4), p[1] = (uint8_t)(150 + y / 5), p[2] = 220, p[3] = 255;
    }
  for (int k = 0; k < 220; k++) {
    double cx = vt_random_between(&rng, 0, picture->width), cy = vt_random_between(&rng, 0, picture->height);
    double r = vt_random_between(&rng, 2, 7), light = vt_random_between(&rng, 0.4, 1.3);
    for (int y = 0; y < picture->height; y++)
      for (int x = 0; x < picture->width; x++) {
        uint8_t *p = picture->pixels + 4 * (y * picture->width + x);
        if (hypot(x - cx, 2 * (y - cy)) < r)
          p[0] = (uint8_t)(80 * light), p[1] = (uint8_t)(130 * light), p[2] = (uint8_t)(40 * light);
      }
  }
}

static double decibels_between(const uint8_t *a, int a_step, const uint8_t *b, int b_step, int count) {
  double sum = 0;
  for (int i = 0; i < count; i++)
    for (int c = 0; c < 3; c++) sum += pow((a[a_step * i + c] - b[b_step * i + c]) / 255.0, 2);
  return -10 * log10(sum / (3.0 * count));
}

static void make_grey(vt_image *picture) {
  for (int i = 0; i < picture->width * picture->height; i++)
    picture->pixels[4 * i] = picture->pixels[4 * i + 2] = picture->pixels[4 * i + 1];
}

// The bridge writes chroma at full resolution, so the picture has none.
static void jpeg_loss_of_grey_is_that_of_a_written_file(void **state) {
  (void)state;
#ifndef VT_WITH_OPENIMAGEIO
  skip();
#endif
  bench b;
  open_bench(&b, 1, 0);
  const int sizes[][2] = {{160, 112}, {157, 109}, {17, 9}};
  for (int k = 0; k < 3; k++) {
    vt_damage_desc d = vt_default_damage_desc();
    d.jpeg_quality = 92; // what image_file_oiio.cc writes
    int width = sizes[k][0], height = sizes[k][1], count = width * height;
    vt_views views = make_views(b.context, 1, width, height);
    vt_image *picture = &views.items[0].picture, rgb, back;
    draw_leaves(picture);
    make_grey(picture);
    assert_int_equal(vt_make_image(b.context, width, height, 3, &rgb), VT_OK);
    for (int i = 0; i < count; i++) memcpy(rgb.pixels + 3 * i, picture->pixels + 4 * i, 3);
    assert_int_equal(vt_write_image(b.context, in_folder(&b, "a.jpg"), &rgb), VT_OK);
    assert_int_equal(vt_read_image(b.context, in_folder(&b, "a.jpg"), &back), VT_OK);
    damage(b.context, &d, &views);
    double loss = decibels_between(rgb.pixels, 3, back.pixels, 3, count);
    double apart = decibels_between(picture->pixels, 4, back.pixels, 3, count);
    printf("%d x %d: JPEG loses to %.2f dB, ours is %.2f dB from it\n", width, height, loss, apart);
    assert_true(loss < 42);
    assert_true(apart > 50);
    vt_free_image(b.context, &rgb);
    vt_free_image(b.context, &back);
    vt_free_views(b.context, &views);
  }
  close_bench(&b);
}

// Chroma at half resolution, as most cameras write it, by OpenCV's libjpeg.
static void jpeg_loss_of_colours_is_that_of_another_implementation(void **state) {
  (void)state;
  if (!vt_has_opencv_quality()) skip();
  vt_context *context = open_context(1);
  const int qualities[] = {20, 50, 75, 92, 100};
  for (int k = 0; k < 5; k++) {
    vt_damage_desc d = vt_default_damage_desc();
    d.jpeg_quality = qualities[k];
    int width = 157, height = 109, count = width * height;
    vt_views views = make_views(context, 1, width, height);
    vt_image *picture = &views.items[0].picture, rgb, back;
    draw_leaves(picture);
    assert_int_equal(vt_make_image(context, width, height, 3, &rgb), VT_OK);
    assert_int_equal(vt_make_image(context, width, height, 3, &back), VT_OK);
    for (int i = 0; i < count; i++) memcpy(rgb.pixels + 3 * i, picture->pixels + 4 * i, 3);
    assert_int_equal(vt_opencv_jpeg(context, &rgb, qualities[k], &back), VT_OK);
    damage(context, &d, &views);
    double loss = decibels_between(rgb.pixels, 3, back.pixels, 3, count);
    double apart = decibels_between(picture->pixels, 4, back.pixels, 3, count);
    printf("quality %d: JPEG loses to %.2f dB, ours is %.2f dB from it\n", qualities[k], loss, apart);
    assert_true(apart > 42 && apart > loss + 10);
    vt_free_image(context, &rgb);
    vt_free_image(context, &back);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

static void a_lower_jpeg_quality_loses_more(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  double last = 0;
  for (int quality = 5; quality <= 100; quality += 19) {
    vt_damage_desc d = vt_default_damage_desc();
    d.jpeg_quality = quality;
    vt_views views = make_views(context, 2, 160, 112);
    draw_leaves(&views.items[0].picture);
    draw_leaves(&views.items[1].picture);
    vt_views one = {.count = 1, .items = views.items};
    damage(context, &d, &one);
    double now = decibels_between(views.items[0].picture.pixels, 4, views.items[1].picture.pixels, 4, 160 * 112);
    assert_true(now > last + 0.5);
    last = now;
    vt_free_views(context, &views);
  }
  assert_true(last > 25); // at 100 only chroma at half resolution is lost
  vt_destroy_context(context);
}

// ---- trouble

static void amounts_out_of_range_are_refused(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  vt_damage_desc bad[14];
  for (int i = 0; i < 14; i++) bad[i] = vt_default_damage_desc();
  bad[0].noise = -0.1, bad[1].blur = NAN, bad[2].jpeg_quality = 101, bad[3].exposure = INFINITY,
  bad[4].white_balance = -1;
  bad[5].distortion = 2, bad[6].pose_degrees = 91, bad[7].pose_share = -0.1, bad[8].focal_share = -1,
  bad[9].matte_erosion = 17;
  bad[10].matte_blur = 51, bad[11].matte_holes = 1, bad[12].matte_noise = NAN, bad[13].jpeg_quality = -1;
  vt_views views = make_views(context, 1, 8, 8);
  for (int i = 0; i < 14; i++) {
    assert_int_equal(vt_damage_views(context, &bad[i], &views), VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(context), "give"));
    vt_clear_error(context);
  }
  vt_cancel(context);
  vt_damage_desc fine = vt_default_damage_desc();
  fine.blur = 1;
  assert_int_equal(vt_damage_views(context, &fine, &views), VT_CANCELLED);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void tiny_pictures_and_empty_ones_survive_everything(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  vt_damage_desc all = everything();
  all.blur = 50, all.matte_erosion = -16, all.matte_noise = 0;
  for (int size = 1; size < 20; size += 6) {
    vt_views views = make_views(context, 2, size, 20 - size);
    fill(&views.items[1].picture, 255, 0, 100, 200);
    damage(context, &all, &views);
    assert_close(covered(&views.items[0].picture), 0, 0);
    vt_free_views(context, &views);
  }
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(no_damage_changes_nothing),
      cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
      cmocka_unit_test(another_amount_does_not_change_what_a_draw_gives),
      cmocka_unit_test(noise_at_mid_grey_has_its_deviation_and_grows_with_the_light),
      cmocka_unit_test(exposure_and_white_balance_are_gains_of_light_as_drawn),
      cmocka_unit_test(a_blurred_edge_is_as_wide_as_asked),
      cmocka_unit_test(transparent_pixels_pull_no_colour),
      cmocka_unit_test(distortion_bends_points_and_mattes_by_the_model),
      cmocka_unit_test(jpeg_loss_of_grey_is_that_of_a_written_file),
      cmocka_unit_test(jpeg_loss_of_colours_is_that_of_another_implementation),
      cmocka_unit_test(a_lower_jpeg_quality_loses_more),
      cmocka_unit_test(amounts_out_of_range_are_refused),
      cmocka_unit_test(tiny_pictures_and_empty_ones_survive_everything),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
