// test_base_image_kinds.c - pictures of every depth and alpha, EXIF: read from files that our writer cannot make
// SPDX-License-Identifier: BSD-3-Clause
//
// Files of 16 bits, grey with alpha, OpenEXR, premultiplied TIFF are put together here byte by byte, uncompressed, so
// that the reader is not judged by its own library.
#define _XOPEN_SOURCE 700 // mkdtemp
#ifdef VT_WITH_OPENIMAGEIO
#include "tests/picture_bench.h"

static void grey_and_deep_png_become_8_bit_colour(void **state) {
  (void)state;
  bench b;
  bytes o;
  open_bench(&b, 1, 0);
  make_png(&o, 2, 2, 8, 0, (const uint8_t *)"\0\x10\x20\0\x30\x40", 6);
  put_file(&b, "grey.png", o.data, o.size);
  expect_pixels(&b, "grey.png", 2, 2, 3, (const uint8_t *)"\x10\x10\x10\x20\x20\x20\x30\x30\x30\x40\x40\x40");
  make_png(&o, 2, 1, 8, 4, (const uint8_t *)"\0\x10\x00\x20\x80", 5);
  put_file(&b, "grey_alpha.png", o.data, o.size);
  expect_pixels(&b, "grey_alpha.png", 2, 1, 4, (const uint8_t *)"\x10\x10\x10\x00\x20\x20\x20\x80");
  make_png(&o, 1, 1, 16, 6, (const uint8_t *)"\0\x80\x80\xff\xff\x00\x00\x01\x01", 9);
  put_file(&b, "deep.png", o.data, o.size);
  expect_pixels(&b, "deep.png", 1, 1, 4, (const uint8_t *)"\x80\xff\x00\x01");
  make_png(&o, 2, 1, 16, 0, (const uint8_t *)"\0\x01\x01\xfe\xfe", 5);
  put_file(&b, "deep_grey.png", o.data, o.size);
  expect_pixels(&b, "deep_grey.png", 2, 1, 3, (const uint8_t *)"\x01\x01\x01\xfe\xfe\xfe");
  vt_image mask;
  assert_int_equal(vt_read_mask(b.context, in_folder(&b, "deep_grey.png"), &mask), VT_OK);
  assert_memory_equal(mask.pixels, "\x01\xfe", 2);
  vt_free_image(b.context, &mask);
  assert_int_equal(vt_read_mask(b.context, in_folder(&b, "grey_alpha.png"), &mask), VT_OK);
  assert_memory_equal(mask.pixels, "\x00\x80", 2);
  vt_free_image(b.context, &mask);
  close_bench(&b);
}

static void bmp_alpha_is_straight(void **state) {
  (void)state;
  bench b;
  bytes o = {.size = 0};
  open_bench(&b, 1, 0);
  put(&o, "BM", 2);
  const uint32_t head[] = {122 + 8, 0,    122, 108, 2,        1,      1 | 32 << 16, 3,           8,
                           2835,    2835, 0,   0,   0xff0000, 0xff00, 0xff,         0xff000000u, 0x73524742};
  for (size_t i = 0; i < sizeof head / sizeof *head; i++) put_word(&o, head[i], 4, false);
  for (int i = 0; i < 12; i++) put_word(&o, 0, 4, false);
  put(&o, "\x10\x20\x30\x80\xf0\xe0\xd0\x40", 8);
  put_file(&b, "a.bmp", o.data, o.size);
  expect_pixels(&b, "a.bmp", 2, 1, 4, (const uint8_t *)"\x30\x20\x10\x80\xd0\xe0\xf0\x40");
  close_bench(&b);
}

static void stray_bytes_between_jpeg_segments_do_no_harm(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_image image = make_noise(&b, 40, 40, 3, true), clean;
  uint8_t *data;
  size_t size;
  bytes o = {.size = 0};
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "a.jpg"), &image), VT_OK);
  assert_int_equal(vt_read_image(b.context, b.path, &clean), VT_OK);
  assert_int_equal(vt_read_file(b.context, b.path, &data, &size), VT_OK);
  put(&o, data, size - 2);
  put(&o, "\0\0\0\0", 4);
  put(&o, data + size - 2, 2);
  put_file(&b, "stray.jpg", o.data, o.size);
  expect_pixels(&b, "stray.jpg", 40, 40, 3, clean.pixels);
  put(&o, "behind the end", 14);
  put_file(&b, "stray.jpg", o.data, o.size);
  expect_pixels(&b, "stray.jpg", 40, 40, 3, clean.pixels);
  put_file(&b, "liar.png", data, size); // content other than the ending says
  expect_pixels(&b, "liar.png", 40, 40, 3, clean.pixels);
  vt_free(b.context, data);
  vt_free_image(b.context, &image);
  vt_free_image(b.context, &clean);
  close_bench(&b);
}

static void put_attribute(bytes *o, const char *name, const char *type, const bytes *value) {
  put(o, name, strlen(name) + 1);
  put(o, type, strlen(type) + 1);
  put_word(o, value->size, 4, false);
  put(o, value->data, value->size);
}

// OpenEXR: one row of `width` pixels RGBA float, uncompressed; `shift` moves the data window in the display window.
static void make_exr(bytes *o, int width, int shift, const float *rgba) {
  const char names[4] = {'A', 'B', 'G', 'R'};
  const int channel_of[4] = {3, 2, 1, 0};
  bytes v = {.size = 0};
  o->size = 0;
  put(o, "\x76\x2f\x31\x01\x02\x00\x00\x00", 8);
  for (int c = 0; c < 4; c++) {
    put(&v, &names[c], 1);
    put(&v, "\0\2\0\0\0\0\0\0\0\1\0\0\0\1\0\0\0", 17); // float, sampled at every pixel
  }
  put(&v, "", 1);
  put_attribute(o, "channels", "chlist", &v);
  v.size = 0;
  put(&v, "", 1);
  put_attribute(o, "compression", "compression", &v);
  put_attribute(o, "lineOrder", "lineOrder", &v);
  for (int i = 0; i < 2; i++) {
    v.size = 0;
    put_word(&v, i ? 0 : (uint32_t)shift, 4, false);
    put_word(&v, 0, 4, false);
    put_word(&v, (uint32_t)(width - 1 + (i ? 0 : shift)), 4, false);
    put_word(&v, 0, 4, false);
    put_attribute(o, i ? "displayWindow" : "dataWindow", "box2i", &v);
  }
  v.size = 0;
  put_word(&v, 0x3f800000u, 4, false);
  put_attribute(o, "pixelAspectRatio", "float", &v);
  put_attribute(o, "screenWindowWidth", "float", &v);
  v.size = 0;
  put_word(&v, 0, 8, false);
  put_attribute(o, "screenWindowCenter", "v2f", &v);
  put(o, "", 1);
  put_word(o, o->size + 8, 8, false);
  put_word(o, 0, 4, false);
  put_word(o, (uint64_t)width * 16, 4, false);
  for (int c = 0; c < 4; c++)
    for (int x = 0; x < width; x++) {
      uint32_t bits;
      memcpy(&bits, &rgba[4 * x + channel_of[c]], 4);
      put_word(o, bits, 4, false);
    }
}

static uint8_t encode(double v) {
  return (uint8_t)(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055) + 0.5);
}

static void linear_exr_becomes_straight_srgb(void **state) {
  (void)state;
  bench b;
  bytes o;
  open_bench(&b, 1, 0);
  const float rgba[] = {0.18f, 0, 0.5f, 1, 0.09f, 0.001f, 0.25f, 0.5f, 7, -1, NAN, 1, 0, 0, 0, 0};
  const uint8_t expected[] = {
      encode(0.18), 0, encode(0.5), 255, encode(0.18), encode(0.002), encode(0.5), 128, 255, 0, 0, 255, 0, 0, 0, 0};
  make_exr(&o, 4, 0, rgba);
  put_file(&b, "a.exr", o.data, o.size);
  expect_pixels(&b, "a.exr", 4, 1, 4, expected);
  put_file(&b, "cut.exr", o.data, o.size - 5);
  expect_refusal(&b, "cut.exr", VT_BAD_INPUT);
  make_exr(&o, 4, 1, rgba);
  put_file(&b, "part.exr", o.data, o.size);
  expect_refusal(&b, "part.exr", VT_BAD_INPUT);
  close_bench(&b);
}

// TIFF: one row RGBA, uncompressed, alpha of the given kind (1 premultiplied, 2 straight).
static void make_tiff(bytes *o, int width, int alpha_kind, const uint8_t *rgba) {
  const struct {
    int tag, type, count;
    uint32_t value;
  } entries[] = {{256, 4, 1, (uint32_t)width},
                 {257, 4, 1, 1},
                 {258, 3, 4, 8 + 2 + 11 * 12 + 4},
                 {259, 3, 1, 1},
                 {262, 3, 1, 2},
                 {273, 4, 1, 8 + 2 + 11 * 12 + 4 + 8},
                 {277, 3, 1, 4},
                 {278, 4, 1, 1},
                 {279, 4, 1, (uint32_t)width * 4},
                 {284, 3, 1, 1},
                 {338, 3, 1, (uint32_t)alpha_kind}};
  o->size = 0;
  put(o, "II\x2a\0\x08\0\0\0\x0b\0", 10);
  for (int i = 0; i < 11; i++) {
    put_word(o, (uint64_t)entries[i].tag, 2, false);
    put_word(o, (uint64_t)entries[i].type, 2, false);
    put_word(o, (uint64_t)entries[i].count, 4, false);
    put_word(o, entries[i].value, 4, false);
  }
  put_word(o, 0, 4, false);
  put(o, "\x08\0\x08\0\x08\0\x08\0", 8);
  put(o, rgba, (size_t)width * 4);
}

static void tiff_alpha_of_both_kinds_becomes_straight(void **state) {
  (void)state;
  bench b;
  bytes o;
  open_bench(&b, 1, 0);
  const uint8_t straight[] = {10, 20, 30, 0, 200, 100, 50, 128, 255, 1, 2, 255};
  make_tiff(&o, 3, 2, straight);
  put_file(&b, "straight.tif", o.data, o.size);
  expect_pixels(&b, "straight.tif", 3, 1, 4, straight);
  const uint8_t multiplied[] = {0, 0, 0, 0, 64, 32, 16, 128, 255, 1, 2, 255};
  const uint8_t expected[] = {0, 0, 0, 0, 128, 64, 32, 128, 255, 1, 2, 255};
  make_tiff(&o, 3, 1, multiplied);
  put_file(&b, "multiplied.tif", o.data, o.size);
  expect_pixels(&b, "multiplied.tif", 3, 1, 4, expected);
  close_bench(&b);
}

static void exif_tells_orientation_and_focal_length(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_image image = make_noise(&b, 16, 8, 3, true), back;
  uint8_t *data;
  size_t size;
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "a.jpg"), &image), VT_OK);
  assert_int_equal(vt_read_file(b.context, b.path, &data, &size), VT_OK);
  bytes tiff = {.size = 0}, o = {.size = 0};
  put(&tiff, "II\x2a\0\x08\0\0\0\x04\0", 10);
  const struct {
    uint16_t tag, type;
    uint32_t count, value;
  } first[] = {{0x10f, 2, 4, 'A' | 'c' << 8 | 'm' << 16}, {0x110, 2, 2, 'X'}, {0x112, 3, 1, 6}, {0x8769, 4, 1, 62}},
    second[] = {{0x920a, 5, 1, 92}, {0xa405, 3, 1, 52}};
  for (int i = 0; i < 6; i++) {
    uint16_t tag = i < 4 ? first[i].tag : second[i - 4].tag, type = i < 4 ? first[i].type : second[i - 4].type;
    if (i == 4) {
      put_word(&tiff, 0, 4, false);
      put_word(&tiff, 2, 2, false);
    }
    put_word(&tiff, tag, 2, false);
    put_word(&tiff, type, 2, false);
    put_word(&tiff, i < 4 ? first[i].count : second[i - 4].count, 4, false);
    put_word(&tiff, i < 4 ? first[i].value : second[i - 4].value, 4, false);
  }
  put_word(&tiff, 0, 4, false);
  put_word(&tiff, 71, 4, false);
  put_word(&tiff, 2, 4, false);
  put(&o, data, 2);
  put(&o, "\xff\xe1", 2);
  put_word(&o, tiff.size + 8, 2, true);
  put(&o, "Exif\0\0", 6);
  put(&o, tiff.data, tiff.size);
  put(&o, data + 2, size - 2);
  put_file(&b, "exif.jpg", o.data, o.size);
  vt_image_info info;
  assert_int_equal(vt_read_image_info(b.context, in_folder(&b, "exif.jpg"), &info), VT_OK);
  assert_int_equal(info.orientation, 6);
  assert_close(info.focal_mm, 35.5, 1e-6);
  assert_close(info.focal_35mm, 52, 0);
  assert_string_equal(info.make, "Acm");
  assert_string_equal(info.model, "X");
  assert_int_equal(vt_read_image(b.context, in_folder(&b, "exif.jpg"), &back), VT_OK);
  assert_true(info.width == 16 && back.width == 16 && back.height == 8); // as stored, not turned
  vt_free_image(b.context, &back);
  vt_free_image(b.context, &image);
  vt_free(b.context, data);
  close_bench(&b);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(grey_and_deep_png_become_8_bit_colour),
      cmocka_unit_test(bmp_alpha_is_straight),
      cmocka_unit_test(stray_bytes_between_jpeg_segments_do_no_harm),
      cmocka_unit_test(linear_exr_becomes_straight_srgb),
      cmocka_unit_test(tiff_alpha_of_both_kinds_becomes_straight),
      cmocka_unit_test(exif_tells_orientation_and_focal_length),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
#else
int main(void) {
  return 77;
} // skipped
#endif
