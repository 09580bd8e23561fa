// test_base_image_memory.c - pictures encoded and decoded in memory, cut off, damaged, of unknown kinds
// SPDX-License-Identifier: BSD-3-Clause
#define _XOPEN_SOURCE 700 // mkdtemp
#include "tests/picture_bench.h"

static void expect_refused_bytes(bench *b, const uint8_t *data, size_t size, vt_status expected) {
  vt_image back;
  vt_status status = vt_decode_image(b->context, data, size, "a.glb: image 3", &back);
  if (status != expected) fail_msg("%zu bytes: status %d, not %d", size, status, expected);
  assert_non_null(strstr(vt_last_error(b->context), "a.glb: image 3: "));
  assert_null(back.pixels);
  vt_clear_error(b->context);
}

static void pam_is_decoded_from_memory_in_every_build(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  const char good[] = "P7\nWIDTH 2\nHEIGHT 1\nDEPTH 4\nMAXVAL 255\nENDHDR\nabcdefgh";
  vt_image back;
  assert_int_equal(vt_decode_image(b.context, (const uint8_t *)good, sizeof good - 1, "a", &back), VT_OK);
  assert_true(back.width == 2 && back.height == 1 && back.channels == 4 && !memcmp(back.pixels, "abcdefgh", 8));
  vt_free_image(b.context, &back);
  for (size_t cut = 3; cut < sizeof good - 1; cut++) expect_refused_bytes(&b, (const uint8_t *)good, cut, VT_BAD_INPUT);
  close_bench(&b);
}

#ifndef VT_WITH_OPENIMAGEIO
static void other_kinds_are_refused_in_a_build_without_openimageio(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_image image = make_noise(&b, 3, 3, 3, true);
  uint8_t *data;
  size_t size;
  assert_int_equal(vt_encode_png(b.context, &image, &data, &size), VT_MISSING_PROGRAM);
  assert_null(data);
  vt_clear_error(b.context);
  expect_refused_bytes(&b, (const uint8_t *)"\x89PNG\r\n\x1a\n", 8, VT_MISSING_PROGRAM);
  vt_free_image(b.context, &image);
  close_bench(&b);
}
#else

static void png_round_trips_through_memory_as_through_a_file(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  for (int channels = 1; channels <= 4; channels++) {
    if (channels == 2) continue;
    vt_image image = make_noise(&b, 37, 301, channels, false), back;
    uint8_t *data, *file;
    size_t size, file_size;
    assert_int_equal(vt_encode_png(b.context, &image, &data, &size), VT_OK);
    assert_int_equal(vt_decode_image(b.context, data, size, "a", &back), VT_OK);
    assert_true(back.width == 37 && back.height == 301 && back.channels == (channels == 1 ? 3 : channels));
    for (int i = 0; channels == 1 && i < 37 * 301; i++) assert_int_equal(back.pixels[3 * i + 1], image.pixels[i]);
    if (channels > 1) assert_memory_equal(back.pixels, image.pixels, 37 * 301 * channels);
    assert_int_equal(vt_write_image(b.context, in_folder(&b, "a.png"), &image), VT_OK);
    assert_int_equal(vt_read_file(b.context, b.path, &file, &file_size), VT_OK);
    assert_int_equal(file_size, size);
    assert_memory_equal(file, data, size);
    vt_free(b.context, file);
    vt_free(b.context, data);
    vt_free_image(b.context, &back);
    vt_free_image(b.context, &image);
  }
  close_bench(&b);
}

static void kinds_are_told_by_their_first_bytes(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_image image = make_noise(&b, 16, 16, 3, true);
  const char *names[] = {"a.jpg", "a.tif", "a.png"};
  for (int i = 0; i < 3; i++) {
    uint8_t *data;
    size_t size;
    vt_image back, from_file;
    assert_int_equal(vt_write_image(b.context, in_folder(&b, names[i]), &image), VT_OK);
    assert_int_equal(vt_read_image(b.context, b.path, &from_file), VT_OK);
    assert_int_equal(vt_read_file(b.context, b.path, &data, &size), VT_OK);
    assert_int_equal(vt_decode_image(b.context, data, size, "a", &back), VT_OK);
    assert_memory_equal(back.pixels, from_file.pixels, 16 * 16 * 3);
    vt_free_image(b.context, &back);
    vt_free_image(b.context, &from_file);
    vt_free(b.context, data);
  }
  expect_refused_bytes(&b, (const uint8_t *)"GIF89a and so on", 16, VT_BAD_INPUT);
  expect_refused_bytes(&b, (const uint8_t *)"", 0, VT_BAD_INPUT);
  expect_refused_bytes(&b, (const uint8_t *)"\x89PNG\r\n\x1a\n", 8, VT_BAD_INPUT);
  vt_free_image(b.context, &image);
  close_bench(&b);
}

static void bytes_cut_off_or_damaged_are_refused_or_sound(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 64 << 20);
  vt_image image = make_noise(&b, 32, 300, 4, false), jpeg_image = make_noise(&b, 32, 30, 3, true);
  uint8_t *data[2];
  size_t size[2];
  assert_int_equal(vt_encode_png(b.context, &image, &data[0], &size[0]), VT_OK);
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "a.jpg"), &jpeg_image), VT_OK);
  assert_int_equal(vt_read_file(b.context, b.path, &data[1], &size[1]), VT_OK);
  vt_rng rng = vt_seed_rng(12, 1);
  for (int kind = 0; kind < 2; kind++) {
    for (int i = 0; i < 100; i++) {
      size_t cut = i < 20 ? (size_t)i : vt_random(&rng) % (size[kind] - 2); // a JPEG's end mark holds no pixels
      expect_refused_bytes(&b, data[kind], cut, VT_BAD_INPUT);
    }
    uint8_t *copy = VT_NEW(b.context, uint8_t, size[kind]);
    for (int i = 0; i < 1000; i++) {
      vt_image back;
      memcpy(copy, data[kind], size[kind]);
      for (int k = 0; k < 3; k++) copy[vt_random(&rng) % (k ? size[kind] : 64)] = (uint8_t)vt_random(&rng);
      vt_status status = vt_decode_image(b.context, copy, size[kind], "a", &back);
      assert_true(status == VT_OK || status == VT_BAD_INPUT || status == VT_OUT_OF_MEMORY);
      assert_true(!status == !!back.pixels);
      vt_free_image(b.context, &back);
      vt_clear_error(b.context);
    }
    vt_free(b.context, copy);
    vt_free(b.context, data[kind]);
  }
  vt_free_image(b.context, &image);
  vt_free_image(b.context, &jpeg_image);
  close_bench(&b);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(pam_is_decoded_from_memory_in_every_build),
#ifndef VT_WITH_OPENIMAGEIO
      cmocka_unit_test(other_kinds_are_refused_in_a_build_without_openimageio),
#else
      cmocka_unit_test(png_round_trips_through_memory_as_through_a_file),
      cmocka_unit_test(kinds_are_told_by_their_first_bytes),
      cmocka_unit_test(bytes_cut_off_or_damaged_are_refused_or_sound),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
