// test_capture_mattes.c - alpha and foreground colours of known pictures over cloth, paper and sky
// SPDX-License-Identifier: BSD-3-Clause
#include "base/image_file.h"
#include "base/rng.h"
#include "capture/backdrop_model.h"
#include "capture/lens.h"
#include "capture/matte.h"
#include "capture/spread.h"
#include "tests/unit.h"

enum { W = 480, H = 400, FINE = 4 };
typedef enum scene { CLOTH, PAPER, SKY } scene;

typedef struct truth {
  float *alpha, *colour; // [H][W], [H][W][3]
  vt_image photo;
} truth;

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.log_level = VT_LOG_QUIET;
  return vt_create_context(&desc);
}

// Distance of a point from a segment, and the place along it.
static double from_segment(double x, double y, const double s[4], double *t) {
  double dx = s[2] - s[0], dy = s[3] - s[1];
  *t = ((x - s[0]) * dx + (y - s[1]) * dy) / (dx * dx + dy * dy);
  *t = *t < 0 ? 0 : *t > 1 ? 1 : *t;
  return hypot(x - s[0] - *t * dx, y - s[1] - *t * dy);
}

// A plant of a stem cut by the lower edge, twigs down to a pixel's width, and leaves. Its colour, or false.
static bool plant_at(double x, double y, double colour[3]) {
  static const double twigs[][6] = {// x0 y0 x1 y1, half width at both ends
                                    {240, 400, 250, 40, 6, 1.6},    {244, 300, 330, 250, 2.0, 1.0},
                                    {246, 240, 150, 180, 1.6, 0.8}, {248, 180, 320, 120, 1.2, 0.5},
                                    {249, 120, 190, 70, 0.9, 0.5},  {244, 330, 120, 320, 1.5, 1.0}};
  static const double leaves[][4] = {// centre, half axes
                                     {345, 243, 24, 11}, {138, 175, 20, 9}, {330, 112, 16, 8}, {180, 64, 14, 7},
                                     {100, 320, 30, 12}, {250, 30, 9, 13},  {300, 340, 40, 16}};
  double shade = 1 + 0.12 * sin(x * 0.15) * cos(y * 0.11), t;
  for (size_t i = 0; i < sizeof leaves / sizeof leaves[0]; i++) {
    double u = (x - leaves[i][0]) / leaves[i][2], v = (y - leaves[i][1]) / leaves[i][3];
    if (u * u + v * v > 1) continue;
    colour[0] = 84 * shade, colour[1] = 128 * shade, colour[2] = 46 * shade;
    return true;
  }
  for (size_t i = 0; i < sizeof twigs / sizeof twigs[0]; i++) {
    double d = from_segment(x, y, twigs[i], &t);
    if (d > twigs[i][4] + t * (twigs[i][5] - twigs[i][4])) continue;
    colour[0] = 112 * shade, colour[1] = 124 * shade, colour[2] = 66 * shade;
    return true;
  }
  return false;
}

static void backdrop_at(scene s, double x, double y, double colour[3]) {
  double u = x / W, v = y / H;
  double cloth =
      30 + 14 * u - 10 * v + 6 * sin(9 * u + 5 * v) + (fabs(y - 210 - 0.1 * x) < 4 ? 10 : 0); // folds and a seam
  double paper = 236 - 22 * u * u - 12 * v;
  switch (s) {
  case CLOTH:
    colour[0] = cloth + 2, colour[1] = cloth, colour[2] = cloth - 3;
    break;
  case PAPER:
    colour[0] = paper, colour[1] = paper - 2, colour[2] = paper - 8;
    break;
  case SKY:
    colour[0] = 120 + 90 * v, colour[1] = 165 + 60 * v, colour[2] = 225 + 20 * v;
    break;
  }
}

static double linear_of(double level) {
  double v = fmin(fmax(level / 255, 0), 1);
  return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static double level_of(double linear) {
  return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055);
}

// Light adds up in linear light; the matte before cloth is one of encoded values.
static double mix(scene s, double alpha, double f, double b) {
  if (s != SKY) return alpha * f + (1 - alpha) * b;
  return level_of(alpha * linear_of(f) + (1 - alpha) * linear_of(b));
}

static truth make_truth(vt_context *context, scene s) {
  truth t = {VT_NEW(context, float, W *H), VT_NEW(context, float, W *H * 3), {0}};
  assert_int_equal(vt_make_image(context, W, H, 3, &t.photo), VT_OK);
  vt_rng rng = vt_seed_rng(7, s);
  for (int y = 0; y < H; y++)
    for (int x = 0; x < W; x++) {
      size_t p = (size_t)y * W + (size_t)x;
      double sum[3] = {0}, back[3];
      int hits = 0;
      for (int k = 0; k < FINE * FINE; k++) {
        double c[3];
        if (!plant_at(x + (k % FINE + 0.5) / FINE, y + (k / FINE + 0.5) / FINE, c)) continue;
        hits++;
        for (int i = 0; i < 3; i++) sum[i] += c[i];
      }
      backdrop_at(s, x, y, back);
      t.alpha[p] = (float)hits / (FINE * FINE);
      for (int i = 0; i < 3; i++) {
        double noise = 0, f = hits ? sum[i] / hits : 0;
        for (int k = 0; k < 4; k++) noise += vt_random_between(&rng, -2, 2); // standard deviation 2.3
        double value = mix(s, t.alpha[p], f, back[i]) + noise;
        t.colour[p * 3 + i] = (float)f;
        t.photo.pixels[p * 3 + i] = (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value + 0.5);
      }
    }
  return t;
}

static void free_truth(vt_context *context, truth *t) {
  vt_free(context, t->alpha);
  vt_free(context, t->colour);
  vt_free_image(context, &t->photo);
}

static vt_status make_matte(vt_context *context, scene s, const vt_image *rgb, vt_image *out) {
  return s == SKY ? vt_matte_sky(context, rgb, "a.jpg", out) : vt_matte_backdrop(context, rgb, "a.jpg", out);
}

static void judge(scene s, const char *name) {
  vt_context *context = make_context();
  truth t = make_truth(context, s);
  vt_image rgba = {0};
  assert_int_equal(make_matte(context, s, &t.photo, &rgba), VT_OK);
  double square = 0, bias = 0, band = 0, ours = 0, naive = 0, clear = 0, clear_zero = 0, solid = 0, solid_low = 0;
  int band_count = 0, colours = 0;
  for (size_t p = 0; p < W * H; p++) {
    double a = t.alpha[p], d = rgba.pixels[p * 4 + 3] / 255.0 - a;
    square += d * d;
    bias += d;
    if (a > 0 && a < 1) band += d * d, band_count++;
    if (a == 0) clear++, clear_zero += rgba.pixels[p * 4 + 3] == 0;
    if (a == 1) solid++, solid_low += rgba.pixels[p * 4 + 3] < 230;
    if (a < 0.1 || a > 0.9 || rgba.pixels[p * 4 + 3] == 255) continue;
    colours++;
    for (int i = 0; i < 3; i++) {
      ours += fabs(rgba.pixels[p * 4 + i] - t.colour[p * 3 + i]);
      naive += fabs(t.photo.pixels[p * 3 + i] - t.colour[p * 3 + i]);
    }
  }
  double area = (double)W * H;
  printf("%s: alpha MSE %.5f, bias %.5f, MSE where mixed %.4f, clear %.4f, solid lost %.4f, colour error %.1f instead "
         "of %.1f\n",
         name, square / area, bias / area, band / band_count, clear_zero / clear, solid_low / solid, ours / colours / 3,
         naive / colours / 3);
  assert_true(square / area <= 2e-4);
  assert_true(fabs(bias / area) <= 0.002);
  assert_true(band / band_count <= 0.008);
  assert_true(clear_zero / clear >= 0.995);
  assert_true(solid_low / solid <= 0.005);
  assert_true(colours > 500);
  assert_true(ours <= 0.2 * naive);
  vt_free_image(context, &rgba);
  free_truth(context, &t);
  vt_destroy_context(context);
}

static void a_plant_before_dark_cloth_is_matted(void **state) {
  (void)state, judge(CLOTH, "cloth");
}
static void a_plant_before_light_paper_is_matted(void **state) {
  (void)state, judge(PAPER, "paper");
}
static void a_tree_before_the_sky_is_matted(void **state) {
  (void)state, judge(SKY, "sky");
}

static void black_bars_beside_a_photograph_change_nothing_inside(void **state) {
  (void)state;
  vt_context *context = make_context();
  truth t = make_truth(context, CLOTH);
  vt_image wide = {0}, rgba = {0};
  assert_int_equal(vt_make_image(context, W + 200, H, 3, &wide), VT_OK);
  vt_paste(&wide, &t.photo, 100, 0);
  assert_int_equal(vt_matte_backdrop(context, &wide, "a.jpg", &rgba), VT_OK);
  double square = 0;
  for (int y = 0; y < H; y++)
    for (int x = 0; x < W + 200; x++) {
      double a = x < 100 || x >= W + 100 ? 0 : t.alpha[y * W + x - 100];
      double d = rgba.pixels[((size_t)y * (W + 200) + (size_t)x) * 4 + 3] / 255.0 - a;
      square += d * d;
    }
  assert_true(square / (W * H) <= 2e-4);
  vt_free_image(context, &rgba);
  vt_free_image(context, &wide);
  free_truth(context, &t);
  vt_destroy_context(context);
}

static void foreground_of_a_soft_mask_has_no_backdrop_in_it(void **state) {
  (void)state;
  vt_context *context = make_context();
  truth t = make_truth(context, PAPER);
  vt_image rgba = {0};
  assert_int_equal(vt_make_image(context, W, H, 4, &rgba), VT_OK);
  for (size_t p = 0; p < W * H; p++) {
    memcpy(rgba.pixels + p * 4, t.photo.pixels + p * 3, 3);
    rgba.pixels[p * 4 + 3] = (uint8_t)(t.alpha[p] * 255 + 0.5f);
  }
  assert_int_equal(vt_estimate_foreground(context, &rgba), VT_OK);
  double ours = 0, naive = 0;
  for (size_t p = 0; p < W * H; p++)
    for (int i = 0; i < 3; i++) {
      if (t.alpha[p] == 1) assert_int_equal(rgba.pixels[p * 4 + i], t.photo.pixels[p * 3 + i]);
      if (t.alpha[p] == 0) assert_true(rgba.pixels[p * 4 + i] < 180); // paper is above
      if (t.alpha[p] <= 0.1 || t.alpha[p] == 1) continue;
      ours += fabs(rgba.pixels[p * 4 + i] - t.colour[p * 3 + i]);
      naive += fabs(t.photo.pixels[p * 3 + i] - t.colour[p * 3 + i]);
    }
  printf("soft mask: colour error %.0f %% of that of the pixel\n", 100 * ours / naive);
  assert_true(ours <= 0.1 * naive);
  vt_free_image(context, &rgba);
  free_truth(context, &t);
  vt_destroy_context(context);
}

static void spread_colours_are_the_nearest_known_ones(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_image rgb = {0}, out = {0};
  assert_int_equal(vt_make_image(context, 37, 21, 3, &rgb), VT_OK);
  uint8_t *known = VT_NEW(context, uint8_t, 37 * 21);
  assert_int_equal(vt_spread_colours(context, &rgb, known, &out), VT_OK); // nothing known: black
  for (int i = 0; i < 37 * 21 * 3; i++) assert_int_equal(out.pixels[i], 0);
  vt_free_image(context, &out);
  known[0] = known[37 * 21 - 1] = 1;
  rgb.pixels[0] = 200;
  rgb.pixels[(37 * 21 - 1) * 3 + 2] = 100;
  assert_int_equal(vt_spread_colours(context, &rgb, known, &out), VT_OK);
  assert_int_equal(out.pixels[0], 200);
  assert_true(out.pixels[(5 * 37 + 5) * 3] > 150);
  assert_true(out.pixels[(18 * 37 + 33) * 3 + 2] > 75);
  vt_free_image(context, &out);
  vt_free_image(context, &rgb);
  vt_free(context, known);
  vt_destroy_context(context);
}

static void degenerate_pictures_are_matted_without_harm(void **state) {
  (void)state;
  static const int sizes[][2] = {{1, 1}, {2, 1}, {1, 7}, {3, 3}, {9, 200}, {64, 48}};
  vt_context *context = make_context();
  vt_rng rng = vt_seed_rng(3, 1);
  for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++)
    for (int kind = 0; kind < 5; kind++)
      for (scene s = CLOTH; s <= SKY; s += SKY - CLOTH) {
        vt_image rgb = {0}, rgba = {0};
        assert_int_equal(vt_make_image(context, sizes[k][0], sizes[k][1], 3, &rgb), VT_OK);
        int count = rgb.width * rgb.height * 3, kept = 0;
        for (int i = 0; i < count; i++) // black, white, grey, noise, two halves
          rgb.pixels[i] = (uint8_t)(kind == 0   ? 0
                                    : kind == 1 ? 255
                                    : kind == 2 ? 127
                                    : kind == 3 ? vt_random(&rng) >> 24
                                                : (i / 3 % rgb.width * 2 < rgb.width) * 255);
        assert_int_equal(make_matte(context, s, &rgb, &rgba), VT_OK);
        for (int i = 0; i < count / 3; i++) kept += rgba.pixels[i * 4 + 3] > 0;
        if (s == SKY && kind == 0) assert_int_equal(kept, count / 3); // no sky is black: all is tree
        else if (kind < 3) assert_int_equal(kept, 0);                 // nothing stands out
        vt_free_image(context, &rgb);
        vt_free_image(context, &rgba);
      }
  vt_destroy_context(context);
}

static void mattes_are_the_same_bits_each_time(void **state) {
  (void)state;
  vt_context *context = make_context();
  truth t = make_truth(context, CLOTH);
  vt_image first = {0}, second = {0};
  assert_int_equal(vt_matte_backdrop(context, &t.photo, "a.jpg", &first), VT_OK);
  assert_int_equal(vt_matte_backdrop(context, &t.photo, "b.jpg", &second), VT_OK);
  assert_memory_equal(first.pixels, second.pixels, W * H * 4);
  vt_free_image(context, &first);
  vt_free_image(context, &second);
  free_truth(context, &t);
  vt_destroy_context(context);
}

#ifdef VT_WITH_OPENIMAGEIO
// A ray-traced crown of leaves, with its own exact alpha, put over each backdrop: most of it is holes and mixed pixels.
// `light` is how much brighter than rendered it is lit.
static void judge_crown(vt_context *context, const vt_image *rgba, scene s, const char *name, double light, double most,
                        double most_bias) {
  vt_image photo = {0}, found = {0};
  vt_rng rng = vt_seed_rng(9, s);
  assert_int_equal(vt_make_image(context, rgba->width, rgba->height, 3, &photo), VT_OK);
  for (int y = 0; y < photo.height; y++)
    for (int x = 0; x < photo.width; x++) {
      size_t p = (size_t)y * (size_t)photo.width + (size_t)x;
      double back[3], a = rgba->pixels[p * 4 + 3] / 255.0;
      backdrop_at(s, x * (double)W / photo.width, y * (double)H / photo.height, back);
      for (int i = 0; i < 3; i++) {
        double value = mix(s, a, fmin(light * rgba->pixels[p * 4 + i], 255), back[i]) + vt_random_between(&rng, -3, 3);
        photo.pixels[p * 3 + i] = (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value + 0.5);
      }
    }
  assert_int_equal(make_matte(context, s, &photo, &found), VT_OK);
  double square = 0, bias = 0, holes = 0, holes_found = 0;
  size_t count = (size_t)photo.width * (size_t)photo.height;
  for (size_t p = 0; p < count; p++) {
    double a = rgba->pixels[p * 4 + 3] / 255.0, d = found.pixels[p * 4 + 3] / 255.0 - a;
    square += d * d;
    bias += d;
    if (a < 0.5) holes++, holes_found += found.pixels[p * 4 + 3] < 128;
  }
  printf("crown over %s: alpha MSE %.5f, bias %.5f, holes found %.4f\n", name, square / count, bias / count,
         holes_found / holes);
  assert_true(square / count <= most);
  assert_true(fabs(bias / count) <= most_bias);
  assert_true(holes_found / holes >= 0.9);
  vt_free_image(context, &photo);
  vt_free_image(context, &found);
}
#endif

static void a_ray_traced_crown_is_matted(void **state) {
  (void)state;
#ifndef VT_WITH_OPENIMAGEIO
  skip();
#else
  vt_context *context = make_context();
  vt_image rgba = {0};
  if (vt_read_image(context, VT_DATASETS_DIR "/maple/train/r_0.png", &rgba) != VT_OK) {
    vt_destroy_context(context);
    skip();
  }
  judge_crown(context, &rgba, CLOTH, "cloth", 2, 2e-2, 0.04);
  judge_crown(context, &rgba, PAPER, "paper", 1, 2e-3, 0.01);
  judge_crown(context, &rgba, SKY, "sky", 1, 2e-3, 0.01);
  vt_free_image(context, &rgba);
  vt_destroy_context(context);
#endif
}

// The plant of the real photographs is a thin stem: no more than a few per cent of the picture, over most of its
// height.
static void a_real_plant_before_cloth_is_found(void **state) {
  (void)state;
#ifndef VT_WITH_OPENIMAGEIO
  skip();
#else
  static const int photos[] = {0, 15, 30, 51};
  vt_context *context = make_context();
  for (size_t i = 0; i < sizeof photos / sizeof photos[0]; i++) {
    char path[1024];
    snprintf(path, sizeof path, "%s/arabidopsis-photos/images/%05d_rgb.jpg", VT_DATASETS_DIR, photos[i]);
    FILE *file = fopen(path, "rb");
    if (!file) {
      vt_destroy_context(context);
      skip();
    }
    fclose(file);
    vt_image rgb = {0}, rgba = {0};
    assert_int_equal(vt_read_image(context, path, &rgb), VT_OK);
    assert_int_equal(vt_matte_backdrop(context, &rgb, path, &rgba), VT_OK);
    int kept = 0, rows = 0;
    for (int y = 0; y < rgba.height; y++) {
      int solid = 0;
      for (int x = 0; x < rgba.width; x++) {
        uint8_t alpha = rgba.pixels[((size_t)y * (size_t)rgba.width + (size_t)x) * 4 + 3];
        kept += alpha > 0;
        solid += alpha > 200 && x > 400 && x < 1000;
      }
      rows += solid > 0;
    }
    double share = (double)kept / rgba.width / rgba.height;
    printf("%05d: %.2f %% kept, stem in %d of %d rows\n", photos[i], 100 * share, rows, rgba.height);
    assert_true(share < 0.06);
    assert_true(rows > 980);
    vt_free_image(context, &rgb);
    vt_free_image(context, &rgba);
  }
  vt_destroy_context(context);
#endif
}

// ---- undistortion

static void a_pinhole_picture_is_copied(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_image in = {0}, out = {0};
  assert_int_equal(vt_make_image(context, 5, 4, 4, &in), VT_OK);
  for (int i = 0; i < 80; i++) in.pixels[i] = (uint8_t)(i * 3);
  vt_lens lens = {VT_LENS_PINHOLE, 5, 4, 10, 11, 2.5, 2, {0}};
  vt_camera camera = {0};
  assert_int_equal(vt_undistort_image(context, &lens, &in, &camera, &out), VT_OK);
  assert_memory_equal(in.pixels, out.pixels, 80);
  assert_true(camera.width == 5 && camera.height == 4 && camera.fx == 10 && camera.fy == 11 && camera.cx == 2.5);
  vt_free_image(context, &in);
  vt_free_image(context, &out);
  vt_destroy_context(context);
}

static void distort(const vt_lens *lens, double x, double y, double pixel[2]) {
  const double *k = lens->k;
  double r2 = x * x + y * y, r = sqrt(r2), u, v;
  if (lens->model == VT_LENS_FISHEYE) {
    double t = atan(r), t2 = t * t, d = t * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
    u = r > 0 ? x * d / r : x, v = r > 0 ? y * d / r : y;
  } else {
    double f = (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
    u = x * f + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
    v = y * f + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
  }
  pixel[0] = lens->fx * u + lens->cx;
  pixel[1] = lens->fy * v + lens->cy;
}

// Colours that tell their own place, seen through a lens, must tell the place of the pinhole camera's rays.
static void undistorted_pixels_stand_where_the_lens_model_says(void **state) {
  (void)state;
  static const vt_lens lenses[] = {{VT_LENS_OPENCV, 250, 200, 300, 302, 126, 99, {-0.12, 0.02, 0.001, -0.002}},
                                   {VT_LENS_OPENCV, 250, 200, 300, 302, 124, 102, {0.15, 0.01, 0, 0}},
                                   {VT_LENS_OPENCV, 250, 200, 300, 300, 125, 100, {0.02, 0, 0, 0, 0, 0.05, 0.01, 0}},
                                   {VT_LENS_FISHEYE, 250, 200, 160, 160, 125, 100, {0.03, -0.01, 0.002, 0}}};
  vt_context *context = make_context();
  vt_image in = {0}, out = {0};
  assert_int_equal(vt_make_image(context, 250, 200, 4, &in), VT_OK);
  for (int y = 0; y < 200; y++)
    for (int x = 0; x < 250; x++) {
      uint8_t *p = in.pixels + (y * 250 + x) * 4;
      p[0] = (uint8_t)x, p[1] = (uint8_t)y, p[3] = 255;
    }
  for (size_t i = 0; i < sizeof lenses / sizeof lenses[0]; i++) {
    vt_camera camera = {0};
    vt_status status = vt_undistort_image(context, &lenses[i], &in, &camera, &out);
#ifdef VT_WITH_OPENCV
    assert_int_equal(status, VT_OK);
    double worst = 0;
    for (int y = 0; y < 200; y++)
      for (int x = 0; x < 250; x++) {
        double pixel[2];
        const uint8_t *p = out.pixels + (y * 250 + x) * 4;
        distort(&lenses[i], (x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, pixel);
        assert_int_equal(p[3], 255); // all of it was seen
        if (pixel[0] < 2 || pixel[1] < 2 || pixel[0] > 248 || pixel[1] > 198) continue;
        worst = fmax(worst, fmax(fabs(pixel[0] - 0.5 - p[0]), fabs(pixel[1] - 0.5 - p[1])));
      }
    printf("lens %zu: focal length %.1f from %.1f, worst place %.2f pixels\n", i, camera.fx, lenses[i].fx, worst);
    assert_true(worst < 0.6); // rounding to a byte is 0.5
    assert_true(camera.fx >= lenses[i].fx && camera.fx < 1.3 * lenses[i].fx);
    vt_free_image(context, &out);
#else
    assert_int_equal(status, VT_MISSING_PROGRAM);
    (void)distort;
#endif
  }
  vt_free_image(context, &in);
  vt_destroy_context(context);
}

static void a_photograph_of_another_size_than_its_camera_is_refused(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_image in = {0}, out = {0};
  assert_int_equal(vt_make_image(context, 5, 4, 3, &in), VT_OK);
  vt_lens lens = {VT_LENS_PINHOLE, 6, 4, 10, 11, 2.5, 2, {0}};
  vt_camera camera = {0};
  assert_int_equal(vt_undistort_image(context, &lens, &in, &camera, &out), VT_BAD_INPUT);
  vt_free_image(context, &in);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_plant_before_dark_cloth_is_matted),
      cmocka_unit_test(a_plant_before_light_paper_is_matted),
      cmocka_unit_test(a_tree_before_the_sky_is_matted),
      cmocka_unit_test(black_bars_beside_a_photograph_change_nothing_inside),
      cmocka_unit_test(foreground_of_a_soft_mask_has_no_backdrop_in_it),
      cmocka_unit_test(spread_colours_are_the_nearest_known_ones),
      cmocka_unit_test(degenerate_pictures_are_matted_without_harm),
      cmocka_unit_test(mattes_are_the_same_bits_each_time),
      cmocka_unit_test(a_ray_traced_crown_is_matted),
      cmocka_unit_test(a_real_plant_before_cloth_is_found),
      cmocka_unit_test(a_pinhole_picture_is_copied),
      cmocka_unit_test(undistorted_pixels_stand_where_the_lens_model_says),
      cmocka_unit_test(a_photograph_of_another_size_than_its_camera_is_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
