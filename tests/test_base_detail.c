// test_base_detail.c - colour difference, sharpness, and our PSNR and SSIM against another implementation
// SPDX-License-Identifier: BSD-3-Clause
#include "base/delta_e.h"
#include "base/image_metrics.h"
#include "base/rng.h"
#include "datasets-synthetic/synthetic.h"
#include "tests/quality.h"
#include "tests/unit.h"

static const float white[3] = {1, 1, 1};

static vt_context *open_context(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads, desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

// ---- CIEDE2000

// Sharma, Wu, Dalal 2005, table 1: two CIELab colours and their difference.
static const double pairs[34][7] = {{50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425},
                                    {50, 3.1571, -77.2803, 50, 0, -82.7485, 2.8615},
                                    {50, 2.8361, -74.0200, 50, 0, -82.7485, 3.4412},
                                    {50, -1.3802, -84.2814, 50, 0, -82.7485, 1.0000},
                                    {50, -1.1848, -84.8006, 50, 0, -82.7485, 1.0000},
                                    {50, -0.9009, -85.5211, 50, 0, -82.7485, 1.0000},
                                    {50, 0, 0, 50, -1, 2, 2.3669},
                                    {50, -1, 2, 50, 0, 0, 2.3669},
                                    {50, 2.4900, -0.0010, 50, -2.4900, 0.0009, 7.1792},
                                    {50, 2.4900, -0.0010, 50, -2.4900, 0.0010, 7.1792},
                                    {50, 2.4900, -0.0010, 50, -2.4900, 0.0011, 7.2195},
                                    {50, 2.4900, -0.0010, 50, -2.4900, 0.0012, 7.2195},
                                    {50, -0.0010, 2.4900, 50, 0.0009, -2.4900, 4.8045},
                                    {50, -0.0010, 2.4900, 50, 0.0010, -2.4900, 4.8045},
                                    {50, -0.0010, 2.4900, 50, 0.0011, -2.4900, 4.7461},
                                    {50, 2.5, 0, 50, 0, -2.5, 4.3065},
                                    {50, 2.5, 0, 73, 25, -18, 27.1492},
                                    {50, 2.5, 0, 61, -5, 29, 22.8977},
                                    {50, 2.5, 0, 56, -27, -3, 31.9030},
                                    {50, 2.5, 0, 58, 24, 15, 19.4535},
                                    {50, 2.5, 0, 50, 3.1736, 0.5854, 1.0000},
                                    {50, 2.5, 0, 50, 3.2972, 0, 1.0000},
                                    {50, 2.5, 0, 50, 1.8634, 0.5757, 1.0000},
                                    {50, 2.5, 0, 50, 3.2592, 0.3350, 1.0000},
                                    {60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644},
                                    {63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630},
                                    {61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731},
                                    {35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645},
                                    {22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373},
                                    {36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146},
                                    {90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441},
                                    {90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381},
                                    {6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377},
                                    {2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082}};

static void published_pairs_have_their_difference(void **state) {
  (void)state;
  for (int i = 0; i < 34; i++) {
    assert_close(vt_delta_e(pairs[i], pairs[i] + 3), pairs[i][6], 1e-4);
    assert_close(vt_delta_e(pairs[i] + 3, pairs[i]), pairs[i][6], 1e-4);
  }
}

static void difference_is_symmetric_and_nothing_differs_from_itself(void **state) {
  (void)state;
  vt_rng rng = vt_seed_rng(4, 4);
  for (int i = 0; i < 20000; i++) {
    double a[3], b[3];
    for (int k = 0; k < 3; k++) {
      a[k] = vt_random_between(&rng, k ? -100 : 0, 100), b[k] = vt_random_between(&rng, k ? -100 : 0, 100);
      if (i % 3 == 0) b[k] = a[k] + vt_random_between(&rng, -1, 1);
      if (i % 50 == 0 && k) b[k] = 0;
    }
    double there = vt_delta_e(a, b);
    assert_true(isfinite(there) && there >= 0);
    assert_close(vt_delta_e(b, a), there, 1e-9);
    assert_close(vt_delta_e(a, a), 0, 1e-12);
  }
}

// ---- on pictures

typedef struct scene {
  vt_views views;
  const vt_image *truth;
  vt_fimage result; // the truth, premultiplied
} scene;

static scene open_scene(vt_context *context) {
  scene s;
  vt_synthetic_desc desc;
  assert_true(vt_find_scene("tree_96", &desc));
  desc.train_count = 1, desc.test_count = 0;
  assert_int_equal(vt_make_synthetic_views(context, &desc, &s.views), VT_OK);
  s.truth = &s.views.items[0].picture;
  assert_int_equal(vt_fimage_from_image(context, s.truth, &s.result), VT_OK);
  return s;
}

static void close_scene(vt_context *context, scene *s) {
  vt_free_fimage(context, &s->result);
  vt_free_views(context, &s->views);
}

static vt_metrics measure(vt_context *context, const scene *s) {
  vt_metrics m;
  assert_int_equal(vt_measure(context, &s->result, s->truth, white, &m), VT_OK);
  return m;
}

static void blur(vt_context *context, vt_fimage *picture, double deviation) { // all four channels, straight sums
  int width = picture->width, height = picture->height, reach = 6;
  vt_fimage out;
  assert_int_equal(vt_make_fimage(context, width, height, 4, &out), VT_OK);
  for (int i = 0; i < width * height * 4; i++) {
    double sum = 0, weight = 0;
    int x = i / 4 % width, y = i / 4 / width;
    for (int dy = -reach; dy <= reach; dy++)
      for (int dx = -reach; dx <= reach; dx++) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= width || y + dy >= height) continue;
        double w = exp(-(dx * dx + dy * dy) / (2 * deviation * deviation));
        weight += w, sum += w * picture->pixels[4 * ((y + dy) * width + x + dx) + i % 4];
      }
    out.pixels[i] = (float)(sum / weight);
  }
  vt_free_fimage(context, picture);
  *picture = out;
}

static void a_blurred_tree_is_below_1_and_a_noisy_one_above(void **state) {
  (void)state;
  vt_context *context = open_context(2);
  scene s = open_scene(context);
  assert_close(measure(context, &s).sharpness, 1, 1e-5);
  blur(context, &s.result, 1);
  double once = measure(context, &s).sharpness;
  blur(context, &s.result, 1);
  double twice = measure(context, &s).sharpness;
  close_scene(context, &s);
  s = open_scene(context);
  vt_rng rng = vt_seed_rng(1, 1);
  for (int i = 0; i < 96 * 96 * 4; i++)
    if (i % 4 < 3) s.result.pixels[i] += (float)(s.result.pixels[i - i % 4 + 3] * vt_random_between(&rng, -0.25, 0.25));
  double noisy = measure(context, &s).sharpness;
  printf("sharpness: blurred by 1 pixel %.3f, twice %.3f; noisy %.3f\n", once, twice, noisy);
  assert_true(once < 0.6 && twice < once && noisy > 1.1);
  close_scene(context, &s);
  vt_destroy_context(context);
}

static void sharpness_is_the_ratio_of_its_definition(void **state) {
  (void)state;
  vt_context *context = open_context(2);
  scene s = open_scene(context);
  for (int i = 0; i < 96 * 96 * 4; i++) s.result.pixels[i] *= 0.8f + 0.2f * (float)sin(i * 0.37);
  double energy[2] = {0, 0};
  for (int p = 0; p < 2; p++)
    for (int y = 0; y < 96; y++)
      for (int x = 0; x < 96; x++) {
        double luma[4]; // left, right, above, below
        for (int k = 0; k < 4; k++) {
          int nx = x + (k == 1) - (k == 0), ny = y + (k == 3) - (k == 2);
          nx = nx < 0 ? 0 : nx > 95 ? 95 : nx, ny = ny < 0 ? 0 : ny > 95 ? 95 : ny;
          const float *r = s.result.pixels + 4 * (ny * 96 + nx);
          const uint8_t *t = s.truth->pixels + 4 * (ny * 96 + nx);
          double rgb[3];
          for (int c = 0; c < 3; c++)
            rgb[c] = p ? t[c] / 255.0 * t[3] / 255.0 + 1 - t[3] / 255.0 : fmin(fmax(r[c] + 1 - r[3], 0), 1);
          luma[k] = 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2];
        }
        if (s.truth->pixels[4 * (y * 96 + x) + 3] > 0.02 * 255)
          energy[p] += (pow(luma[1] - luma[0], 2) + pow(luma[3] - luma[2], 2)) / 4;
      }
  assert_close(measure(context, &s).sharpness, energy[0] / energy[1], 1e-5);
  close_scene(context, &s);
  vt_destroy_context(context);
}

static void delta_e_is_the_mean_over_the_foreground(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  vt_fimage result;
  vt_image truth;
  vt_metrics m;
  assert_int_equal(vt_make_fimage(context, 20, 50, 4, &result), VT_OK);
  assert_int_equal(vt_make_image(context, 20, 50, 4, &truth), VT_OK);
  for (int i = 0; i < 20 * 50; i++) { // a third is foreground; of that, half is right
    bool foreground = i % 3 == 0, right = i % 2 == 0;
    const uint8_t colour[4] = {60, 120, 30, 255};
    if (foreground) memcpy(truth.pixels + 4 * i, colour, 4);
    for (int c = 0; c < 3 && foreground; c++) result.pixels[4 * i + c] = right ? colour[c] / 255.0f : 0.5f;
    result.pixels[4 * i + 3] = 1; // black behind, where nothing counts
  }
  const double grey[3] = {53.3890, 0, 0}, green[3] = {45.1, -35.7, 41.5}; // sRGB 0.5, and about (60, 120, 30)
  double roughly = vt_delta_e(grey, green) / 2;
  assert_int_equal(vt_measure(context, &result, &truth, white, &m), VT_OK);
  assert_close(m.delta_e, roughly, 0.05 * roughly);
  vt_free_fimage(context, &result);
  vt_free_image(context, &truth);
  vt_destroy_context(context);
}

// ---- another implementation

// OpenCV blurs with borders filled and gives a value at every pixel, ours only has windows that lie inside: its map is
// averaged over these. Both then weigh the same pixels with the same Gaussian; it computes in float on 0..255, so five
// digits are the same.
static void psnr_and_ssim_are_those_of_another_implementation(void **state) {
  (void)state;
  if (!vt_has_opencv_quality()) skip();
  vt_context *context = open_context(2);
  for (int k = 0; k < 4; k++) {
    scene s = open_scene(context);
    if (k == 1) blur(context, &s.result, 1.3);
    vt_rng rng = vt_seed_rng((uint64_t)k, 1);
    for (int i = 0; i < 96 * 96 * 4 && k >= 2; i++)
      s.result.pixels[i] = fminf(fmaxf(s.result.pixels[i] + (float)vt_random_between(&rng, -0.1 * k, 0.1 * k), 0), 1);
    if (k == 0) s.result.pixels[4 * 40 * 96] -= 0.5f;
    vt_image a, b;
    vt_fimage exact, over;
    assert_int_equal(vt_flatten(context, &s.result, white, &a), VT_OK); // bytes, as OpenCV takes them
    assert_int_equal(vt_fimage_from_image(context, s.truth, &exact), VT_OK);
    assert_int_equal(vt_flatten(context, &exact, white, &b), VT_OK);
    vt_image truth;
    assert_int_equal(vt_make_fimage(context, 96, 96, 4, &over), VT_OK);
    assert_int_equal(vt_make_image(context, 96, 96, 4, &truth), VT_OK);
    for (int i = 0; i < 96 * 96; i++) {
      for (int c = 0; c < 3; c++)
        over.pixels[4 * i + c] = a.pixels[3 * i + c] / 255.0f, truth.pixels[4 * i + c] = b.pixels[3 * i + c];
      over.pixels[4 * i + 3] = 1, truth.pixels[4 * i + 3] = 255;
    }
    static float map[96 * 96 * 3];
    double psnr, ssim = 0;
    vt_metrics m;
    assert_int_equal(vt_measure(context, &over, &truth, white, &m), VT_OK);
    if (vt_opencv_quality(context, &a, &b, &psnr, map)) fail_msg("%s", vt_last_error(context));
    for (int y = 5; y < 91; y++)
      for (int x = 5; x < 91; x++)
        for (int c = 0; c < 3; c++) ssim += (double)map[3 * (y * 96 + x) + c] / (86.0 * 86 * 3);
    printf("PSNR %.6f and %.6f, SSIM %.7f and %.7f\n", m.psnr, psnr, m.ssim, ssim);
    assert_close(m.psnr, psnr, 1e-4);
    assert_close(m.ssim, ssim, 2e-5);
    vt_free_image(context, &a);
    vt_free_image(context, &b);
    vt_free_image(context, &truth);
    vt_free_fimage(context, &exact);
    vt_free_fimage(context, &over);
    close_scene(context, &s);
  }
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(published_pairs_have_their_difference),
                                     cmocka_unit_test(difference_is_symmetric_and_nothing_differs_from_itself),
                                     cmocka_unit_test(a_blurred_tree_is_below_1_and_a_noisy_one_above),
                                     cmocka_unit_test(sharpness_is_the_ratio_of_its_definition),
                                     cmocka_unit_test(delta_e_is_the_mean_over_the_foreground),
                                     cmocka_unit_test(psnr_and_ssim_are_those_of_another_implementation)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
