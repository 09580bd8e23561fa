// test_base_lab.c - CIELab there and back
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/unit.h"
#include "base/context.h"
#include "compress/compress.h"
#include "base/lab.h"

// The textbook formulas in double, on their own constants.
static double reference_f(double t) {
  return t > 216.0 / 24389 ? cbrt(t) : (24389.0 / 27 * t + 16) / 116;
}
static void reference_lab(const double srgb[3], double lab[3]) {
  static const double m[3][3] = {
      {.4123908, .3575843, .1804808}, {.2126390, .7151687, .0721923}, {.0193308, .1191948, .9505322}};
  double f[3];
  for (int i = 0; i < 3; i++) {
    double t = 0, white = 0;
    for (int j = 0; j < 3; j++) {
      t += m[i][j] * (srgb[j] <= 0.04045 ? srgb[j] / 12.92 : pow((srgb[j] + 0.055) / 1.055, 2.4));
      white += m[i][j];
    }
    f[i] = reference_f(t / white);
  }
  lab[0] = 116 * f[1] - 16;
  lab[1] = 500 * (f[0] - f[1]);
  lab[2] = 200 * (f[1] - f[2]);
}

static void lab_agrees_with_the_formulas_in_double(void **state) {
  (void)state;
  for (int r = 0; r <= 255; r += 5)
    for (int g = 0; g <= 255; g += 5)
      for (int b = 0; b <= 255; b += 5) {
        float srgb[3] = {(float)r / 255, (float)g / 255, (float)b / 255}, lab[3];
        double wide[3] = {r / 255.0, g / 255.0, b / 255.0}, expected[3], error = 0;
        vt_lab_from_srgb(srgb, lab);
        reference_lab(wide, expected);
        for (int c = 0; c < 3; c++) error += (lab[c] - expected[c]) * (lab[c] - expected[c]);
        assert_close(sqrt(error), 0, 3e-4);
      }
}

static void greys_have_no_chroma_and_white_is_100(void **state) {
  (void)state;
  for (int v = 0; v < 256; v++) {
    float srgb[3] = {(float)v / 255, (float)v / 255, (float)v / 255}, lab[3];
    vt_lab_from_srgb(srgb, lab);
    assert_close(lab[1], 0, 2e-4);
    assert_close(lab[2], 0, 2e-4);
    if (v == 0) assert_close(lab[0], 0, 1e-6);
    if (v == 255) assert_close(lab[0], 100, 2e-5);
  }
}

static void pure_red_is_where_textbooks_put_it(void **state) {
  (void)state;
  float red[3] = {1, 0, 0}, lab[3];
  vt_lab_from_srgb(red, lab);
  assert_close(lab[0], 53.24, 0.01);
  assert_close(lab[1], 80.09, 0.03);
  assert_close(lab[2], 67.20, 0.03);
}

typedef struct sweep {
  float linear[256];
  uint32_t *wrong;
} sweep;

static void sweep_block(void *user, size_t begin, size_t end, int worker) {
  sweep *s = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    uint8_t rgb[3] = {(uint8_t)(i >> 16), (uint8_t)(i >> 8), (uint8_t)i};
    float lab[3], back[3];
    vt_lab_from_bytes(s->linear, rgb, 3, 1, lab);
    vt_srgb_from_lab(lab, back);
    for (int c = 0; c < 3; c++) s->wrong[begin >> 12] += (int)(255 * back[c] + 0.5f) != rgb[c];
  }
}

static void every_8_bit_colour_returns(void **state) {
  (void)state;
  vt_context_desc desc = vt_default_context_desc();
  vt_context *ctx = vt_create_context(&desc);
  sweep s;
  vt_fill_srgb_table(s.linear);
  s.wrong = VT_NEW(ctx, uint32_t, 1 << 12);
  assert_int_equal(vt_parallel(ctx, 1 << 24, 1 << 12, sweep_block, &s), VT_OK);
  uint64_t wrong = 0;
  for (int i = 0; i < 1 << 12; i++) wrong += s.wrong[i];
  assert_int_equal(wrong, 0);
  vt_free(ctx, s.wrong);
  vt_destroy_context(ctx);
}

static void many_at_once_are_the_same_bits_as_one(void **state) {
  (void)state;
  enum { COUNT = 37, STRIDE = 4 };
  uint8_t rgb[COUNT * STRIDE];
  float linear[256], lab[COUNT * 3], one[3];
  vt_fill_srgb_table(linear);
  for (int i = 0; i < COUNT * STRIDE; i++) rgb[i] = (uint8_t)(i * 97 + i / 7);
  vt_lab_from_bytes(linear, rgb, STRIDE, COUNT, lab);
  for (int i = 0; i < COUNT; i++) {
    const uint8_t *p = rgb + i * STRIDE;
    float srgb[3] = {(float)p[0] / 255, (float)p[1] / 255, (float)p[2] / 255};
    vt_lab_from_srgb(srgb, one);
    assert_memory_equal(one, lab + 3 * i, sizeof one);
  }
}

static void colours_outside_srgb_are_clamped(void **state) {
  (void)state;
  static const float outside[][3] = {{50, 200, -200}, {120, 0, 0}, {-20, 0, 0}, {60, -200, 200}, {1e20f, -1e20f, 0}};
  for (size_t i = 0; i < sizeof outside / sizeof outside[0]; i++) {
    float srgb[3];
    vt_srgb_from_lab(outside[i], srgb);
    for (int c = 0; c < 3; c++) assert_true(srgb[c] >= 0 && srgb[c] <= 1);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(lab_agrees_with_the_formulas_in_double), cmocka_unit_test(greys_have_no_chroma_and_white_is_100),
      cmocka_unit_test(pure_red_is_where_textbooks_put_it),     cmocka_unit_test(every_8_bit_colour_returns),
      cmocka_unit_test(many_at_once_are_the_same_bits_as_one),  cmocka_unit_test(colours_outside_srgb_are_clamped),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
