// test_base_metrics.c - PSNR, SSIM and alpha error against closed forms and a brute-force SSIM
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/unit.h"

#include "base/image_metrics.h"
#include "base/rng.h"

static vt_context *open_context(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads;
  desc.log_level = VT_LOG_QUIET;
  return vt_create_context(&desc);
}

typedef struct pair {
  vt_fimage result;
  vt_image truth;
} pair;

static pair make_pair(vt_context *context, int width, int height) {
  pair p = {0};
  assert_int_equal(vt_make_fimage(context, width, height, 4, &p.result), VT_OK);
  assert_int_equal(vt_make_image(context, width, height, 4, &p.truth), VT_OK);
  return p;
}

static void free_pair(vt_context *context, pair *p) {
  vt_free_fimage(context, &p->result);
  vt_free_image(context, &p->truth);
}

// Truth: blobs of random colour with soft alpha; result: the same with noise of the given size.
static void fill_pair(pair *p, double noise, uint64_t seed) {
  vt_rng rng = vt_seed_rng(seed, 1);
  int width = p->truth.width, height = p->truth.height;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      size_t i = (size_t)(y * width + x) * 4;
      double a = 0.5 + 0.8 * sin(0.2 * x + 0.1 * y) * cos(0.15 * y - 0.07 * x);
      a = a < 0 ? 0 : a > 1 ? 1 : a;
      p->truth.pixels[i + 3] = (uint8_t)(a * 255 + 0.5);
      for (size_t c = 0; c < 3; c++)
        p->truth.pixels[i + c] = (uint8_t)(127 + 120 * sin(0.3 * x * (double)(c + 1) + 0.2 * y));
      double alpha = p->truth.pixels[i + 3] / 255.0;
      for (size_t c = 0; c < 3; c++)
        p->result.pixels[i + c] =
            (float)(alpha * p->truth.pixels[i + c] / 255.0 + noise * (vt_random_unit(&rng) - 0.5));
      p->result.pixels[i + 3] = (float)(alpha + noise * (vt_random_unit(&rng) - 0.5));
    }
}

// SSIM straight from its definition: two-dimensional window, moments about the mean, no shortcut.
static double brute_ssim(const pair *p, const float background[3]) {
  int width = p->truth.width, height = p->truth.height, side = width < height ? width : height;
  int taps = side >= 11 ? 11 : side % 2 ? side : side - 1;
  double window[11][11], norm = 0, total = 0;
  for (int j = 0; j < taps; j++)
    for (int i = 0; i < taps; i++) {
      double dx = i - taps / 2, dy = j - taps / 2;
      norm += window[j][i] = exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5));
    }
  for (size_t c = 0; c < 3; c++)
    for (int top = 0; top + taps <= height; top++)
      for (int left = 0; left + taps <= width; left++) {
        double x[121], y[121], mx = 0, my = 0, vx = 0, vy = 0, cov = 0;
        for (int k = 0; k < taps * taps; k++) {
          size_t at = (size_t)((top + k / taps) * width + left + k % taps) * 4;
          double ra = p->result.pixels[at + 3], ta = p->truth.pixels[at + 3] / 255.0;
          ra = ra < 0 ? 0 : ra > 1 ? 1 : ra;
          double r = p->result.pixels[at + c] + (1 - ra) * background[c];
          x[k] = r < 0 ? 0 : r > 1 ? 1 : r;
          y[k] = p->truth.pixels[at + c] / 255.0 * ta + (1 - ta) * background[c];
          mx += window[k / taps][k % taps] / norm * x[k];
          my += window[k / taps][k % taps] / norm * y[k];
        }
        for (int k = 0; k < taps * taps; k++) {
          double w = window[k / taps][k % taps] / norm;
          vx += w * (x[k] - mx) * (x[k] - mx);
          vy += w * (y[k] - my) * (y[k] - my);
          cov += w * (x[k] - mx) * (y[k] - my);
        }
        total += (2 * mx * my + 1e-4) * (2 * cov + 9e-4) / ((mx * mx + my * my + 1e-4) * (vx + vy + 9e-4));
      }
  return total / (3.0 * (width - taps + 1) * (height - taps + 1));
}

static const float white[3] = {1, 1, 1};

static void a_perfect_picture_has_no_error(void **state) {
  (void)state;
  vt_context *context = open_context(2);
  pair p = make_pair(context, 67, 43);
  vt_metrics m;
  fill_pair(&p, 0, 1);
  assert_int_equal(vt_measure(context, &p.result, &p.truth, white, &m), VT_OK);
  assert_close(m.psnr, 99, 0);
  assert_close(m.psnr_foreground, 99, 0);
  assert_close(m.ssim, 1, 1e-9);
  assert_close(m.alpha_rmse, 0, 1e-7);
  assert_close(m.delta_e, 0, 1e-4);
  assert_close(m.sharpness, 1, 1e-6);
  free_pair(context, &p);
  vt_destroy_context(context);
}

static void constant_pictures_have_the_errors_of_the_formula(void **state) {
  (void)state;
  vt_context *context = open_context(2);
  pair p = make_pair(context, 40, 30);
  const float background[3] = {0.25f, 0.5f, 1};
  vt_metrics m;
  // Left half: true alpha 1, colour 51/255 = 0.2, result 0.3 opaque. Right half: true alpha 5 (no foreground), result
  // empty.
  for (size_t i = 0; i < 40 * 30; i++) {
    bool left = i % 40 < 20;
    for (size_t c = 0; c < 3; c++) {
      p.truth.pixels[4 * i + c] = 51;
      p.result.pixels[4 * i + c] = left ? 0.3f : 0;
    }
    p.truth.pixels[4 * i + 3] = left ? 255 : 5;
    p.result.pixels[4 * i + 3] = left ? 1 : 0;
  }
  double right = 0, a = 5 / 255.0;
  for (size_t c = 0; c < 3; c++) right += pow(a * (background[c] - 0.2), 2) / 3;
  assert_int_equal(vt_measure(context, &p.result, &p.truth, background, &m), VT_OK);
  assert_close(m.psnr, -10 * log10((0.01 + right) / 2), 1e-4);
  assert_close(m.psnr_foreground, 20, 1e-4);
  assert_close(m.alpha_rmse, a / sqrt(2), 1e-7);
  // Two constants: variances vanish, SSIM is the luminance term.
  for (size_t i = 0; i < 40 * 30; i++) {
    p.truth.pixels[4 * i + 3] = 255;
    for (size_t c = 0; c < 3; c++) p.result.pixels[4 * i + c] = 0.3f;
    p.result.pixels[4 * i + 3] = 1;
  }
  assert_int_equal(vt_measure(context, &p.result, &p.truth, background, &m), VT_OK);
  assert_close(m.ssim, (2 * 0.2 * 0.3 + 1e-4) / (0.04 + 0.09 + 1e-4), 1e-6);
  assert_close(m.psnr, 20, 1e-4);
  free_pair(context, &p);
  vt_destroy_context(context);
}

static void ssim_is_that_of_its_definition(void **state) {
  (void)state;
  const int sizes[][2] = {{11, 11}, {12, 70}, {70, 12}, {53, 47}, {10, 40}, {40, 5}, {3, 3}, {2, 9}, {1, 1}};
  vt_context *context = open_context(2);
  for (int i = 0; i < 9; i++)
    for (int k = 0; k < 2; k++) {
      const float background[3] = {k ? 1.0f : 0.1f, k ? 1.0f : 0.4f, k ? 1.0f : 0.0f};
      pair p = make_pair(context, sizes[i][0], sizes[i][1]);
      vt_metrics m;
      fill_pair(&p, 0.3, (uint64_t)i);
      assert_int_equal(vt_measure(context, &p.result, &p.truth, background, &m), VT_OK);
      assert_close(m.ssim, brute_ssim(&p, background), 1e-6);
      if (sizes[i][0] > 11) assert_true(m.ssim < 0.99);
      free_pair(context, &p);
    }
  vt_destroy_context(context);
}

static void any_number_of_threads_gives_the_same_bits(void **state) {
  (void)state;
  vt_metrics first = {0};
  for (int threads = 1; threads <= 7; threads += 3) {
    vt_context *context = open_context(threads);
    pair p = make_pair(context, 150, 131);
    vt_metrics m;
    fill_pair(&p, 0.2, 9);
    assert_int_equal(vt_measure(context, &p.result, &p.truth, white, &m), VT_OK);
    if (threads == 1) first = m;
    assert_memory_equal(&m, &first, sizeof m);
    free_pair(context, &p);
    vt_destroy_context(context);
  }
}

static void odd_values_are_clamped_and_an_empty_truth_has_no_foreground(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  pair p = make_pair(context, 16, 16);
  vt_metrics m;
  for (size_t i = 0; i < 256; i++) { // over white the result is white, as the empty truth is
    float odd[4] = {1e30f, INFINITY, 2, 0};
    memcpy(p.result.pixels + 4 * i, odd, sizeof odd);
  }
  assert_int_equal(vt_measure(context, &p.result, &p.truth, white, &m), VT_OK);
  assert_close(m.psnr, 99, 0);
  assert_true(isnan(m.psnr_foreground) && isnan(m.delta_e) && isnan(m.sharpness));
  for (size_t i = 0; i < 1024; i++) p.result.pixels[i] = NAN;
  const float black[3] = {0, 0, 0};
  assert_int_equal(vt_measure(context, &p.result, &p.truth, black, &m), VT_OK);
  assert_close(m.psnr, 99, 0);
  assert_close(m.ssim, 1, 0);
  free_pair(context, &p);
  vt_destroy_context(context);
}

static void a_cancelled_run_measures_nothing(void **state) {
  (void)state;
  vt_context *context = open_context(2);
  pair p = make_pair(context, 16, 16);
  vt_metrics m;
  vt_cancel(context);
  assert_int_equal(vt_measure(context, &p.result, &p.truth, white, &m), VT_CANCELLED);
  free_pair(context, &p);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_perfect_picture_has_no_error),
      cmocka_unit_test(constant_pictures_have_the_errors_of_the_formula),
      cmocka_unit_test(ssim_is_that_of_its_definition),
      cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
      cmocka_unit_test(odd_values_are_clamped_and_an_empty_truth_has_no_foreground),
      cmocka_unit_test(a_cancelled_run_measures_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
