// test_capture_check.c - photographs looked at before the work: what is wrong is found, what is right is left alone
// SPDX-License-Identifier: BSD-3-Clause
#include "base/file.h"
#include "base/folders.h"
#include "base/image_file.h"
#include "base/rng.h"
#include "capture/capture.h"
#include "capture/photo_measure.h"
#include "tests/unit.h"
#include <unistd.h>

enum { WIDTH = 240, HEIGHT = 160 };

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 2;
  desc.log_level = VT_LOG_QUIET;
  return vt_create_context(&desc);
}

// Discs of all sizes and colours on grey, moved by `shift` pixels: edges everywhere, as leaves make them.
static vt_image draw(vt_context *context, int width, int height, double shift, double gain, double blue) {
  vt_image out = {0};
  assert_int_equal(vt_make_image(context, width, height, 3, &out), VT_OK);
  for (int i = 0; i < width * height * 3; i++) out.pixels[i] = 90;
  vt_rng rng = vt_seed_rng(7, 0);
  for (int d = 0; d < 500; d++) {
    double x = vt_random_unit(&rng) * width + shift, y = vt_random_unit(&rng) * height, r = 2 + 10 * vt_random_unit(&rng);
    uint8_t c[3] = {(uint8_t)(40 + 150 * vt_random_unit(&rng)), (uint8_t)(40 + 150 * vt_random_unit(&rng)), 60};
    for (int v = 0; v < height; v++)
      for (int u = 0; u < width; u++)
        if ((u - x) * (u - x) + (v - y) * (v - y) < r * r) memcpy(out.pixels + 3 * (v * width + u), c, 3);
  }
  for (int i = 0; i < width * height * 3; i++) {
    double v = out.pixels[i] * gain * (i % 3 == 2 ? blue : 1);
    out.pixels[i] = (uint8_t)(v < 255 ? v : 255);
  }
  return out;
}

static void blur_rows(vt_image *p, int width) { // motion along the rows
  for (int y = 0; y < p->height; y++) {
    uint8_t row[3 * 1024];
    for (int x = 0; x < p->width; x++)
      for (int c = 0; c < 3; c++) {
        int sum = 0;
        for (int k = 0; k < width; k++) sum += p->pixels[3 * (y * p->width + (x + k < p->width ? x + k : p->width - 1)) + c];
        row[3 * x + c] = (uint8_t)(sum / width);
      }
    memcpy(p->pixels + 3 * y * p->width, row, (size_t)(3 * p->width));
  }
}

static void sharpness_falls_with_blur_and_not_with_light(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_photo_measure plain, dark, soft, softer;
  vt_image p = draw(context, WIDTH, HEIGHT, 0, 1, 1), q = draw(context, WIDTH, HEIGHT, 0, 0.5, 1);
  assert_int_equal(vt_measure_photo(context, &p, &plain), VT_OK);
  assert_int_equal(vt_measure_photo(context, &q, &dark), VT_OK);
  blur_rows(&p, 3);
  assert_int_equal(vt_measure_photo(context, &p, &soft), VT_OK);
  blur_rows(&p, 7);
  assert_int_equal(vt_measure_photo(context, &p, &softer), VT_OK);
  assert_true(fabs(dark.sharpness / plain.sharpness - 1) < 0.05);
  assert_true(soft.sharpness < 0.8 * plain.sharpness && softer.sharpness < 0.75 * soft.sharpness);
  assert_true(dark.exposure < plain.exposure - 1.5);
  vt_free_image(context, &p);
  vt_image flat = {0};
  assert_int_equal(vt_make_image(context, 64, 64, 1, &flat), VT_OK); // black and grey: nothing to measure, nothing breaks
  assert_int_equal(vt_measure_photo(context, &flat, &plain), VT_OK);
  assert_true(isnan(plain.sharpness) && plain.exposure == -20);
  vt_free_image(context, &flat);
  vt_free_image(context, &q);
  assert_int_equal(vt_make_image(context, 3, 2, 3, &flat), VT_OK);
  assert_int_equal(vt_measure_photo(context, &flat, &plain), VT_OK);
  vt_free_image(context, &flat);
  vt_destroy_context(context);
}

#ifdef VT_WITH_OPENIMAGEIO
static void put_photo(vt_context *context, const char *folder, int number, const vt_image *picture) {
  char path[160];
  snprintf(path, sizeof path, "%s/%02d.png", folder, number);
  assert_int_equal(vt_write_image(context, path, picture), VT_OK);
}

static void each_trouble_is_found_where_it_is_and_nowhere_else(void **state) {
  (void)state;
  vt_context *context = make_context();
  char folder[64] = "/tmp/vt-check-XXXXXX", path[160];
  assert_non_null(mkdtemp(folder));
  for (int i = 0; i < 16; i++) {
    double gain = i == 4 ? 0.7 : i >= 11 ? 0.8 : 1; // one photograph, and from 11 on all
    vt_image p = draw(context, i == 15 ? WIDTH / 2 : WIDTH, HEIGHT, i == 9 ? 8 * 7 : 7 * i, gain, i == 6 ? 0.8 : 1);
    if (i == 2) blur_rows(&p, 5);
    put_photo(context, folder, i, &p);
    vt_free_image(context, &p);
  }
  snprintf(path, sizeof path, "%s/14.png", folder);
  assert_int_equal(truncate(path, 900), 0);
  vt_capture_desc desc = vt_default_capture_desc();
  vt_check_report r;
  desc.source = folder;
  assert_int_equal(vt_check_capture(context, &desc, &r), VT_OK);
  assert_int_equal(r.count, 16);
  static const unsigned expected[16] = {[2] = VT_PHOTO_BLURRED, [4] = VT_PHOTO_EXPOSURE, [6] = VT_PHOTO_WHITE,
                                        [9] = VT_PHOTO_DOUBLE,  [14] = VT_PHOTO_UNREADABLE};
  for (int i = 0; i < 16; i++) assert_int_equal(r.photos[i].troubles, expected[i]);
  assert_int_equal(r.photos[9].twin, 8);
  assert_int_equal(r.unreadable_count, 1);
  assert_true(r.photos[15].width == WIDTH / 2);
  assert_false(r.cameras_known);
  assert_true(r.seconds_calibration > 0 && r.calibration_wanted);
  bool few = false, named = false;
  for (int i = 0; i < r.warning_count; i++) {
    few = few || strstr(r.warnings[i], "16 photographs: few");
    named = named || (strstr(r.warnings[i], "02.png: blurred") && strstr(r.warnings[i], "take it again"));
  }
  assert_true(few && named);
  vt_free_check_report(context, &r);
  assert_true(vt_remove_folder(context, folder));
  vt_destroy_context(context);
}

static void photographs_of_several_kinds_are_counted(void **state) {
  (void)state;
  vt_context *context = make_context();
  char folder[64] = "/tmp/vt-check-XXXXXX";
  assert_non_null(mkdtemp(folder));
  for (int i = 0; i < 6; i++) {
    vt_image p = draw(context, i % 2 ? WIDTH : HEIGHT, i % 2 ? HEIGHT : WIDTH, 9 * i, 1, 1);
    put_photo(context, folder, i, &p);
    vt_free_image(context, &p);
  }
  vt_capture_desc desc = vt_default_capture_desc();
  vt_check_report r;
  desc.source = folder;
  assert_int_equal(vt_check_capture(context, &desc, &r), VT_OK);
  assert_int_equal(r.group_count, 2);
  for (int i = 0; i < 6; i++) assert_int_equal(r.photos[i].group, i % 2);
  bool told = false;
  for (int i = 0; i < r.warning_count; i++) told = told || strstr(r.warnings[i], "2 kinds of photographs (sizes)");
  assert_true(told);
  vt_free_check_report(context, &r);
  assert_true(vt_remove_folder(context, folder));
  vt_destroy_context(context);
}
#endif

static vt_camera on_a_ring(double azimuth, double elevation) {
  double a = azimuth / 57.29577951308232, e = elevation / 57.29577951308232;
  vt_vec3 eye = {2 + 5 * cos(a) * cos(e), 3 + 5 * sin(a) * cos(e), 1 + 5 * sin(e)};
  return vt_look_at(eye, (vt_vec3){2, 3, 1}, (vt_vec3){0, 0, 1}, 0.8, 64, 48);
}

static void coverage_is_what_the_cameras_see_from(void **state) {
  (void)state;
  vt_camera cameras[40];
  vt_coverage c;
  for (int i = 0; i < 36; i++) cameras[i] = on_a_ring(10 * i, 20);
  vt_capture_coverage(cameras, 36, &c);
  assert_true(fabs(c.largest_gap - 10) < 0.01 && fabs(c.around - 350) < 0.01);
  assert_true(fabs(c.lowest - 20) < 0.5 && fabs(c.highest - 20) < 0.5);
  vt_capture_coverage(cameras, 28, &c); // the last 80 degrees are missing
  assert_true(fabs(c.largest_gap - 90) < 0.5);
  assert_int_equal(c.gap_begin, 27);
  assert_int_equal(c.gap_end, 0);
  for (int i = 0; i < 20; i++) cameras[i] = on_a_ring(-60 + 6 * i, 15 + 2 * (i % 5)); // from the front only, looking down
  vt_capture_coverage(cameras, 20, &c);
  assert_true(fabs(c.around - 114) < 4);
  assert_true(fabs(c.lowest - 15) < 4 && fabs(c.highest - 23) < 4);
  vt_capture_coverage(cameras, 1, &c);
  assert_int_equal(c.count, 0); // one axis has no nearest point
  vt_capture_coverage(cameras, 0, &c);
  assert_int_equal(c.count, 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(sharpness_falls_with_blur_and_not_with_light),
#ifdef VT_WITH_OPENIMAGEIO
      cmocka_unit_test(each_trouble_is_found_where_it_is_and_nowhere_else),
      cmocka_unit_test(photographs_of_several_kinds_are_counted),
#endif
      cmocka_unit_test(coverage_is_what_the_cameras_see_from),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
