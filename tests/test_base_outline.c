// test_base_outline.c - fog, broken stems and the error inside a matte are seen
// SPDX-License-Identifier: BSD-3-Clause
#include "base/image_outline.h"
#include "tests/unit.h"

enum { WIDTH = 80, HEIGHT = 100 };
static const float black[3] = {0, 0, 0};

static vt_context *open_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1, desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

typedef struct scene {
  vt_image truth;
  vt_fimage result;
} scene;

// A stem of three pixels from top to bottom, grey .5, and the same as the result.
static scene make_stem(vt_context *context) {
  scene s = {0};
  assert_int_equal(vt_make_image(context, WIDTH, HEIGHT, 4, &s.truth), VT_OK);
  assert_int_equal(vt_make_fimage(context, WIDTH, HEIGHT, 4, &s.result), VT_OK);
  for (size_t y = 10; y < 90; y++)
    for (size_t x = 39; x < 42; x++) {
      uint8_t *t = s.truth.pixels + 4 * (y * WIDTH + x);
      float *r = s.result.pixels + 4 * (y * WIDTH + x);
      t[0] = t[1] = t[2] = 128, t[3] = 255;
      for (int c = 0; c < 3; c++) r[c] = 128 / 255.0f;
      r[3] = 1;
    }
  return s;
}

static void put_alpha(scene *s, int x, int y, float alpha) {
  float *r = s->result.pixels + 4 * ((size_t)y * WIDTH + (size_t)x);
  for (int c = 0; c < 3; c++) r[c] = alpha * 128 / 255.0f;
  r[3] = alpha;
}

static vt_outline measure(vt_context *context, scene *s) {
  vt_outline outline;
  assert_int_equal(vt_measure_outline(context, &s->result, &s->truth, black, &outline), VT_OK);
  return outline;
}

static void free_scene(vt_context *context, scene *s) {
  vt_free_image(context, &s->truth);
  vt_free_fimage(context, &s->result);
}

static void an_exact_stem_is_whole_and_has_no_fog(void **state) {
  (void)state;
  vt_context *context = open_context();
  scene s = make_stem(context);
  vt_outline o = measure(context, &s);
  assert_close(o.near, 1, 1e-12);
  assert_close(o.reach, 1, 1e-12);
  assert_true(o.psnr_inside > 90);
  free_scene(context, &s);
  vt_destroy_context(context);
}

static void a_gap_in_the_stem_shortens_it(void **state) {
  (void)state;
  vt_context *context = open_context();
  scene s = make_stem(context);
  for (int x = 39; x < 42; x++) put_alpha(&s, x, 40, 0.2f);
  vt_outline o = measure(context, &s);
  assert_close(o.reach, hypot(3, 49) / hypot(3, 80), 1e-9);
  assert_close(o.near, 1, 1e-12);
  free_scene(context, &s);
  vt_destroy_context(context);
}

static void a_stem_that_touches_by_a_corner_is_whole(void **state) {
  (void)state;
  vt_context *context = open_context();
  scene s = make_stem(context);
  for (int x = 39; x < 42; x++) put_alpha(&s, x, 40, 0);
  put_alpha(&s, 38, 40, 1); // row 39 ends at 39, row 41 begins there
  assert_close(measure(context, &s).reach, hypot(4, 80) / hypot(3, 80), 1e-9);
  free_scene(context, &s);
  vt_destroy_context(context);
}

static void fog_is_counted_beyond_three_pixels(void **state) {
  (void)state;
  vt_context *context = open_context();
  scene s = make_stem(context);
  double stem = 240;
  put_alpha(&s, 44, 50, 0.25f); // three pixels away: near
  assert_close(measure(context, &s).near, 1, 1e-12);
  put_alpha(&s, 45, 50, 0.25f);
  assert_close(measure(context, &s).near, (stem + 0.25) / (stem + 0.5), 1e-6);
  free_scene(context, &s);
  vt_destroy_context(context);
}

static void the_error_inside_ignores_what_is_outside(void **state) {
  (void)state;
  vt_context *context = open_context();
  scene s = make_stem(context);
  for (int y = 0; y < HEIGHT; y++) put_alpha(&s, 5, y, 1);
  assert_true(measure(context, &s).psnr_inside > 90);
  for (int y = 10; y < 90; y++)
    for (int x = 39; x < 42; x++) put_alpha(&s, x, y, 0.5f);
  assert_close(measure(context, &s).psnr_inside, -20 * log10(64 / 255.0), 1e-3);
  free_scene(context, &s);
  vt_destroy_context(context);
}

static void empty_pictures_and_nan_are_told(void **state) {
  (void)state;
  vt_context *context = open_context();
  scene s = make_stem(context);
  memset(s.truth.pixels, 0, (size_t)WIDTH * HEIGHT * 4);
  vt_outline o = measure(context, &s);
  assert_true(isnan(o.psnr_inside) && isnan(o.reach) && o.near == 0);
  for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * 4; i++) s.result.pixels[i] = NAN;
  assert_close(measure(context, &s).near, 1, 0);
  free_scene(context, &s);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(an_exact_stem_is_whole_and_has_no_fog),    cmocka_unit_test(a_gap_in_the_stem_shortens_it),
      cmocka_unit_test(a_stem_that_touches_by_a_corner_is_whole), cmocka_unit_test(fog_is_counted_beyond_three_pixels),
      cmocka_unit_test(the_error_inside_ignores_what_is_outside), cmocka_unit_test(empty_pictures_and_nan_are_told)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
