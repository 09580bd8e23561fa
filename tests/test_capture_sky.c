// test_capture_sky.c - trees before the sky, and what stands behind a tree, recognised
// SPDX-License-Identifier: BSD-3-Clause
#include "base/rng.h"
#include "capture/develop.h"
#include "capture/chroma.h"
#include "capture/matte.h"
#include "capture/situation.h"
#include "capture/sky_model.h"
#include "tests/capture_folders.h"
#include "tests/matte_scenes.h"
#include "tests/unit.h"

static vt_context *make_context(int thread_count) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = thread_count;
  desc.log_level = VT_LOG_QUIET;
  return vt_create_context(&desc);
}

static matte_scene make_case(vt_synthetic_kind kind, vt_backdrop backdrop, bool horizon) {
  matte_scene s = {.tree = vt_default_synthetic_desc(), .backdrop = backdrop, .horizon = horizon, .damage = vt_default_damage_desc()};
  s.tree.kind = kind;
  s.tree.width = s.tree.height = 320;
  s.tree.train_count = 1, s.tree.test_count = 0;
  s.tree.supersample = 4;
  s.tree.leaf_count = kind == VT_SYNTHETIC_BIRCH ? 6000 : kind == VT_SYNTHETIC_PINE ? 2500 : 900;
  s.tree.rig = VT_RIG_RING;
  s.damage.noise = 0.012, s.damage.blur = 0.7, s.damage.jpeg_quality = 92;
  return s;
}

typedef struct score {
  double square, bias, holes, ours, naive, fake; // fake: share of clear pixels far from the tree that are kept
} score;

static score judge(const vt_image *truth, const vt_image *rgb, const vt_image *found, int rows) {
  score s = {0};
  double pixels = 0, holes = 0, clear = 0;
  for (int y = 0; y < rows; y++)
    for (int x = 0; x < truth->width; x++) {
      size_t p = (size_t)y * truth->width + x;
      const uint8_t *t = truth->pixels + 4 * p, *f = found->pixels + 4 * p;
      double d = (f[3] - t[3]) / 255.0;
      pixels++, s.square += d * d, s.bias += d;
      if (t[3] > 12 && t[3] < 128) holes++, s.holes += f[3] < 128;
      if (t[3] == 0) clear++, s.fake += f[3] > 25;
      if (t[3] < 26 || t[3] > 229) continue;
      for (int c = 0; c < 3; c++) s.ours += abs(f[c] - t[c]), s.naive += abs(rgb->pixels[3 * p + c] - t[c]);
    }
  s.square /= pixels, s.bias /= pixels, s.holes /= holes, s.fake /= clear;
  return s;
}

static score matte_case(matte_scene scene, double rows, const char *name) {
  vt_context *context = make_context(2);
  vt_views truth = {0}, photos = {0};
  vt_image rgb = {0}, found = {0};
  assert_int_equal(make_matte_scene(context, &scene, &truth, &photos), VT_OK);
  assert_int_equal(drop_picture_alpha(context, &photos.items[0].picture, &rgb), VT_OK);
  assert_int_equal(vt_matte_sky(context, &rgb, name, &found), VT_OK);
  score s = judge(&truth.items[0].picture, &rgb, &found, (int)(rows * rgb.height));
  printf("%s: alpha MSE %.5f, bias %+.4f, mixed pixels below 1/2 found %.3f, colour error %.2f of the pixel's own, clear pixels "
         "kept %.5f\n",
         name, s.square, s.bias, s.holes, s.ours / s.naive, s.fake);
  vt_free_image(context, &rgb);
  vt_free_image(context, &found);
  vt_free_views(context, &truth);
  vt_free_views(context, &photos);
  vt_destroy_context(context);
  return s;
}

static void trees_before_clouds_are_matted_through_noise_blur_and_jpeg(void **state) {
  (void)state;
  static const vt_synthetic_kind kinds[] = {VT_SYNTHETIC_SMALL_OAK, VT_SYNTHETIC_BIRCH, VT_SYNTHETIC_PINE};
  for (int i = 0; i < 3; i++) {
    score s = matte_case(make_case(kinds[i], VT_BACKDROP_SKY, false), 1, vt_synthetic_name(kinds[i]));
    assert_true(s.square <= 2e-3);
    assert_true(fabs(s.bias) <= 0.01);
    assert_true(s.holes >= 0.85);
    assert_true(s.ours <= 0.5 * s.naive);
    assert_true(s.fake <= 0.02);
  }
}

static void a_dark_crown_before_dark_cloth_is_not_taken_for_cloth(void **state) {
  (void)state;
  static const vt_synthetic_kind kinds[] = {VT_SYNTHETIC_PINE, VT_SYNTHETIC_SMALL_OAK};
  vt_context *context = make_context(2);
  for (int i = 0; i < 2; i++) {
    matte_scene scene = make_case(kinds[i], VT_BACKDROP_STUDIO, false);
    vt_views truth = {0}, photos = {0};
    vt_image rgb = {0}, found = {0};
    assert_int_equal(make_matte_scene(context, &scene, &truth, &photos), VT_OK);
    assert_int_equal(drop_picture_alpha(context, &photos.items[0].picture, &rgb), VT_OK);
    assert_int_equal(vt_matte_backdrop(context, &rgb, "cloth", &found), VT_OK);
    score s = judge(&truth.items[0].picture, &rgb, &found, rgb.height);
    printf("%s before cloth: alpha MSE %.4f, bias %+.4f\n", vt_synthetic_name(kinds[i]), s.square, s.bias);
    assert_true(s.square < 0.03); // .15 and more where tiles begin in the crown
    vt_free_image(context, &rgb);
    vt_free_image(context, &found);
    vt_free_views(context, &truth);
    vt_free_views(context, &photos);
  }
  vt_destroy_context(context);
}

// Means of the distance of chroma (red and blue less luma) from that of the picture before it was packed.
static double chroma_error(const vt_image *sharp, const vt_image *now) {
  double sum = 0;
  for (int p = 0; p < now->width * now->height; p++) {
    const uint8_t *a = sharp->pixels + 3 * p, *b = now->pixels + 3 * p;
    double d = 0.299 * (b[0] - a[0]) + 0.587 * (b[1] - a[1]) + 0.114 * (b[2] - a[2]);
    sum += fabs(b[0] - a[0] - d) + fabs(b[2] - a[2] - d);
  }
  return sum / now->width / now->height;
}

static void colours_that_a_jpeg_smeared_are_told_and_sharpened(void **state) {
  (void)state;
  vt_context *context = make_context(2);
  vt_image pictures[2] = {{0}}, mended = {0};
  for (int packed = 0; packed < 2; packed++) {
    matte_scene scene = make_case(VT_SYNTHETIC_SMALL_OAK, VT_BACKDROP_SKY, false);
    scene.damage.noise = 0.002, scene.damage.jpeg_quality = packed ? 92 : 0;
    vt_views truth = {0}, photos = {0};
    assert_int_equal(make_matte_scene(context, &scene, &truth, &photos), VT_OK);
    assert_int_equal(drop_picture_alpha(context, &photos.items[0].picture, &pictures[packed]), VT_OK);
    vt_free_views(context, &truth);
    vt_free_views(context, &photos);
  }
  assert_int_equal(vt_measure_smear(&pictures[0]), 0);
  assert_int_equal(vt_measure_smear(&pictures[1]), 2);
  assert_int_equal(vt_sharpen_chroma(context, &pictures[1], 2, &mended), VT_OK);
  double before = chroma_error(&pictures[0], &pictures[1]), after = chroma_error(&pictures[0], &mended);
  printf("chroma off by %.2f levels, %.2f when sharpened\n", before, after);
  assert_true(after < 0.95 * before);
  vt_free_image(context, &mended);
  assert_int_equal(vt_sharpen_chroma(context, &pictures[0], 0, &mended), VT_OK); // nothing to mend, nothing changed
  assert_memory_equal(mended.pixels, pictures[0].pixels, 3 * 320 * 320);
  vt_free_image(context, &mended);
  vt_free_image(context, &pictures[0]);
  vt_free_image(context, &pictures[1]);
  vt_destroy_context(context);
}

static void a_trunk_is_cut_out_of_the_ground_before_which_it_stands(void **state) {
  (void)state;
  score s = matte_case(make_case(VT_SYNTHETIC_SMALL_OAK, VT_BACKDROP_SKY, true), 1, "horizon");
  assert_true(s.square <= 3.2e-3); // a meadow that is kept would be 0.15, the trunk that is lost .003 above that of the crown
  assert_true(s.fake <= 0.02);
}

// A disc of bark colour before a white that has no blue left to tell, all channels at the end of their range.
static void a_clipped_sky_is_still_the_sky(void **state) {
  (void)state;
  vt_context *context = make_context(1);
  vt_image rgb = {0}, found = {0};
  assert_int_equal(vt_make_image(context, 200, 160, 3, &rgb), VT_OK);
  for (int y = 0; y < 160; y++)
    for (int x = 0; x < 200; x++) {
      double d = hypot(x - 100, y - 90) - 40, a = fmin(fmax(0.5 - d, 0), 1);
      for (int c = 0; c < 3; c++)
        rgb.pixels[3 * (y * 200 + x) + c] = matte_byte_of(a * (0.1 - 0.03 * c + 0.02 * ((x ^ y) & 1)) + (1 - a) * 1.3);
    }
  assert_int_equal(vt_matte_sky(context, &rgb, "a.jpg", &found), VT_OK);
  double square = 0;
  for (int y = 0; y < 160; y++)
    for (int x = 0; x < 200; x++) {
      double d = hypot(x - 100, y - 90) - 40, a = fmin(fmax(0.5 - d, 0), 1), e = found.pixels[4 * (y * 200 + x) + 3] / 255.0 - a;
      square += e * e;
    }
  printf("clipped: alpha MSE %.6f\n", square / 200 / 160);
  assert_true(square / 200 / 160 < 1e-3); // light above white is lost: mixed pixels look clearer than they are
  vt_free_image(context, &rgb);
  vt_free_image(context, &found);
  vt_destroy_context(context);
}

static void fill(vt_image *rgb, uint64_t seed, const int base[3], int spread, int patch) {
  for (int y = 0; y < rgb->height; y++)
    for (int x = 0; x < rgb->width; x++) {
      vt_rng rng = vt_seed_rng(seed, (uint64_t)(y / patch) * 1000 + (uint64_t)(x / patch));
      for (int c = 0; c < 3; c++) {
        int v = base[c] + (int)vt_random_between(&rng, -spread, spread + 0.999);
        rgb->pixels[3 * (y * rgb->width + x) + c] = (uint8_t)(v < 0 ? 0 : v > 255 ? 255 : v);
      }
    }
}

static void a_picture_that_is_all_tree_or_all_sky_is_said_to_be(void **state) {
  (void)state;
  static const int leaves[3] = {70, 110, 40}, sky[3] = {130, 170, 225}, sizes[][2] = {{1, 1}, {3, 40}, {40, 3}, {120, 90}};
  vt_context *context = make_context(1);
  for (int i = 0; i < 4; i++)
    for (int kind = 0; kind < 2; kind++) {
      vt_image rgb = {0}, found = {0};
      assert_int_equal(vt_make_image(context, sizes[i][0], sizes[i][1], 3, &rgb), VT_OK);
      fill(&rgb, 5, kind ? sky : leaves, kind ? 4 : 50, 1);
      assert_int_equal(vt_matte_sky(context, &rgb, "a.jpg", &found), VT_OK);
      for (int p = 0; p < rgb.width * rgb.height; p++) assert_int_equal(found.pixels[4 * p + 3], kind ? 0 : 255);
      vt_free_image(context, &rgb);
      vt_free_image(context, &found);
    }
  vt_destroy_context(context);
}

static vt_situation situation_of(vt_context *context, const vt_image *rgb, const char *name) {
  vt_evidence e;
  assert_int_equal(vt_judge_situation(context, rgb, &e), VT_OK);
  printf("%s: border %.2f plain, sky %.2f of the picture, %.2f of the upper edge, luma %.2f, blue %.2f, ground %.2f\n", name,
         e.plain, e.sky, e.sky_top, e.brightness, e.blue, e.ground);
  return e.situation;
}

static void the_situation_of_a_photograph_is_recognised(void **state) {
  (void)state;
  static const struct {
    const char *name;
    vt_backdrop backdrop;
    bool horizon;
    vt_situation expected;
  } cases[] = {{"studio", VT_BACKDROP_STUDIO, false, VT_SITUATION_PLAIN},
               {"sky", VT_BACKDROP_SKY, false, VT_SITUATION_SKY},
               {"sky and ground", VT_BACKDROP_SKY, true, VT_SITUATION_SKY}};
  vt_context *context = make_context(2);
  for (int i = 0; i < 3; i++)
    for (uint32_t seed = 1; seed < 4; seed++) {
      vt_views truth = {0}, photos = {0};
      vt_image rgb = {0};
      matte_scene scene = make_case(VT_SYNTHETIC_SMALL_OAK, cases[i].backdrop, cases[i].horizon);
      scene.tree.seed = seed, scene.tree.supersample = 1;
      assert_int_equal(make_matte_scene(context, &scene, &truth, &photos), VT_OK);
      assert_int_equal(drop_picture_alpha(context, &photos.items[0].picture, &rgb), VT_OK);
      assert_int_equal(situation_of(context, &rgb, cases[i].name), cases[i].expected);
      vt_free_image(context, &rgb);
      vt_free_views(context, &truth);
      vt_free_views(context, &photos);
    }
  static const int grey[3] = {120, 120, 120}, paper[3] = {235, 233, 228}, wall[3] = {190, 160, 130};
  vt_image rgb = {0};
  assert_int_equal(vt_make_image(context, 320, 240, 3, &rgb), VT_OK);
  fill(&rgb, 3, grey, 110, 24);
  assert_int_equal(situation_of(context, &rgb, "patches"), VT_SITUATION_CLUTTER);
  fill(&rgb, 4, grey, 110, 2);
  assert_int_equal(situation_of(context, &rgb, "texture"), VT_SITUATION_CLUTTER);
  fill(&rgb, 5, paper, 3, 1);
  assert_int_equal(situation_of(context, &rgb, "paper"), VT_SITUATION_PLAIN);
  for (int y = 0; y < 120; y++) // a wall of a room, smooth and bright but warm, over all kinds of things
    for (int x = 0; x < 320; x++)
      for (int c = 0; c < 3; c++) rgb.pixels[3 * (y * 320 + x) + c] = (uint8_t)(wall[c] + (x * 7 + y * 3) % 5);
  for (int y = 120; y < 240; y++)
    for (int x = 0; x < 320; x++)
      for (int c = 0; c < 3; c++) rgb.pixels[3 * (y * 320 + x) + c] = (uint8_t)(60 + 50 * ((x / 20 * 7 + y / 16 * 3 + c) % 4));
  assert_int_equal(situation_of(context, &rgb, "room"), VT_SITUATION_CLUTTER);
  vt_free_image(context, &rgb);
  vt_destroy_context(context);
}

// Photographs as files with a camera each; PAM, which every build reads.
static void add_photo(place *p, vt_photos *photos, const char *name, const vt_image *rgb) {
  assert_int_equal(vt_write_image(p->context, at(p, name), rgb), VT_OK);
  vt_photo *photo = vt_add_photo(p->context, photos, name, at(p, name));
  assert_non_null(photo);
  photo->width = rgb->width, photo->height = rgb->height, photo->orientation = 1;
  photo->lens = (vt_lens){VT_LENS_PINHOLE, rgb->width, rgb->height, 300, 300, rgb->width / 2.0, rgb->height / 2.0, {0}};
  photo->rotation = (vt_mat3){{1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

static void a_capture_is_decided_by_most_of_its_photographs(void **state) {
  (void)state;
  static const int grey[3] = {120, 120, 120}, sky[3] = {130, 170, 225};
  for (int skies = 0; skies <= 5; skies += 2) { // of five
    place p = open_place();
    vt_photos photos = {0};
    vt_capture_report report = {0};
    vt_capture_desc desc = vt_default_capture_desc();
    vt_image rgb = {0};
    assert_int_equal(vt_make_image(p.context, 160, 120, 3, &rgb), VT_OK);
    for (int i = 0; i < 5; i++) {
      char name[16];
      fill(&rgb, (uint64_t)i, i < skies ? sky : grey, i < skies ? 4 : 110, i < skies ? 1 : 12);
      snprintf(name, sizeof name, "%d.pam", i);
      add_photo(&p, &photos, name, &rgb);
    }
    vt_status status = vt_choose_mattes(p.context, &desc, p.root, &photos, &report);
    assert_int_equal(status, VT_OK);
    assert_int_equal(report.matte, skies > 2 ? VT_MATTE_SKY : VT_MATTE_CLUTTER);
    assert_non_null(strstr(report.matte_evidence, "of 5 photographs"));
    vt_free_image(p.context, &rgb);
    vt_free_photos(p.context, &photos);
    vt_free_capture_report(p.context, &report);
    close_place(&p);
  }
}

// The matte of a photograph of 16 bits is that of the same one with 8.
static void photographs_of_sixteen_bits_are_matted_as_those_of_eight(void **state) {
  (void)state;
#ifndef VT_WITH_OPENIMAGEIO
  skip();
#else
  place p = open_place();
  vt_views truth = {0}, photos = {0};
  vt_image rgb = {0}, read = {0};
  matte_scene scene = make_case(VT_SYNTHETIC_SMALL_OAK, VT_BACKDROP_SKY, false);
  scene.tree.width = 90, scene.tree.height = 70;
  assert_int_equal(make_matte_scene(p.context, &scene, &truth, &photos), VT_OK);
  assert_int_equal(drop_picture_alpha(p.context, &photos.items[0].picture, &rgb), VT_OK);
  size_t count = (size_t)90 * 70 * 3;
  uint8_t *bytes = VT_NEW(p.context, uint8_t, 60 + count * 2);
  int size = snprintf((char *)bytes, 60, "P6\n90 70\n65535\n");
  for (size_t i = 0; i < count; i++) bytes[size + 2 * i] = bytes[size + 2 * i + 1] = rgb.pixels[i];
  put_bytes(&p, "a.ppm", bytes, size + 2 * count);
  vt_free(p.context, bytes);
  assert_int_equal(vt_read_image(p.context, at(&p, "a.ppm"), &read), VT_OK);
  assert_int_equal(read.channels, 3);
  assert_memory_equal(read.pixels, rgb.pixels, count);
  vt_free_image(p.context, &rgb);
  vt_free_image(p.context, &read);
  vt_free_views(p.context, &truth);
  vt_free_views(p.context, &photos);
  close_place(&p);
#endif
}

static void mattes_of_the_sky_are_the_same_bits_for_any_number_of_threads(void **state) {
  (void)state;
  static const int thread_counts[] = {1, 2, 7};
  vt_views first = {0};
  vt_context *owner = make_context(1);
  for (int t = 0; t < 3; t++) {
    place p = open_place();
    vt_context *context = make_context(thread_counts[t]);
    vt_views truth = {0}, pictures = {0}, views = {0};
    vt_photos photos = {0};
    vt_capture_report report = {.matte = VT_MATTE_SKY};
    vt_capture_desc desc = vt_default_capture_desc();
    matte_scene scene = make_case(VT_SYNTHETIC_SMALL_OAK, VT_BACKDROP_SKY, true);
    scene.tree.width = scene.tree.height = 160, scene.tree.train_count = 5, scene.tree.supersample = 2;
    assert_int_equal(make_matte_scene(p.context, &scene, &truth, &pictures), VT_OK);
    for (int i = 0; i < 5; i++) {
      char name[16];
      vt_image rgb = {0};
      snprintf(name, sizeof name, "%d.pam", i);
      assert_int_equal(drop_picture_alpha(p.context, &pictures.items[i].picture, &rgb), VT_OK);
      place with_threads = {.context = context, .root = p.root};
      add_photo(&with_threads, &photos, name, &rgb);
      vt_free_image(p.context, &rgb);
    }
    assert_int_equal(vt_develop_photos(context, &desc, &photos, &report, t ? &views : &first), VT_OK);
    for (int i = 0; i < 5 && t; i++)
      assert_memory_equal(views.items[i].picture.pixels, first.items[i].picture.pixels, 160 * 160 * 4);
    vt_free_views(context, &views);
    vt_free_photos(context, &photos);
    vt_free_views(p.context, &truth);
    vt_free_views(p.context, &pictures);
    if (t) vt_destroy_context(context);
    else vt_destroy_context(owner), owner = context; // the first views live in its memory
    close_place(&p);
  }
  vt_free_views(owner, &first);
  vt_destroy_context(owner);
}

// A telephone held upright stores what it sees lying on its side.
static void a_photograph_that_is_stored_on_its_side_has_its_sky_above(void **state) {
  (void)state;
  static const int uprights[] = {6, 8, 3};
  for (int k = 0; k < 3; k++) {
    place p = open_place();
    vt_views truth = {0}, pictures = {0}, views = {0};
    vt_photos photos = {0};
    vt_image rgb = {0};
    vt_capture_report report = {.matte = VT_MATTE_SKY};
    vt_capture_desc desc = vt_default_capture_desc();
    matte_scene scene = make_case(VT_SYNTHETIC_SMALL_OAK, VT_BACKDROP_SKY, true);
    scene.tree.width = 120, scene.tree.height = 160, scene.tree.supersample = 2;
    assert_int_equal(make_matte_scene(p.context, &scene, &truth, &pictures), VT_OK);
    assert_int_equal(drop_picture_alpha(p.context, &pictures.items[0].picture, &rgb), VT_OK);
    add_photo(&p, &photos, "a.pam", &rgb);
    assert_int_equal(vt_turn_upright(p.context, uprights[k], true, &rgb), VT_OK);
    add_photo(&p, &photos, "b.pam", &rgb);
    photos.items[1].upright = uprights[k];
    assert_int_equal(vt_develop_photos(p.context, &desc, &photos, &report, &views), VT_OK);
    assert_int_equal(vt_turn_upright(p.context, uprights[k], false, &views.items[1].picture), VT_OK);
    assert_int_equal(views.items[1].picture.width, 120);
    assert_memory_equal(views.items[0].picture.pixels, views.items[1].picture.pixels, 120 * 160 * 4);
    vt_free_image(p.context, &rgb);
    vt_free_views(p.context, &views);
    vt_free_photos(p.context, &photos);
    vt_free_views(p.context, &truth);
    vt_free_views(p.context, &pictures);
    close_place(&p);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(trees_before_clouds_are_matted_through_noise_blur_and_jpeg),
      cmocka_unit_test(a_dark_crown_before_dark_cloth_is_not_taken_for_cloth),
      cmocka_unit_test(colours_that_a_jpeg_smeared_are_told_and_sharpened),
      cmocka_unit_test(a_trunk_is_cut_out_of_the_ground_before_which_it_stands),
      cmocka_unit_test(a_clipped_sky_is_still_the_sky),
      cmocka_unit_test(a_picture_that_is_all_tree_or_all_sky_is_said_to_be),
      cmocka_unit_test(the_situation_of_a_photograph_is_recognised),
      cmocka_unit_test(a_capture_is_decided_by_most_of_its_photographs),
      cmocka_unit_test(photographs_of_sixteen_bits_are_matted_as_those_of_eight),
      cmocka_unit_test(mattes_of_the_sky_are_the_same_bits_for_any_number_of_threads),
      cmocka_unit_test(a_photograph_that_is_stored_on_its_side_has_its_sky_above),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
