// test_capture_reading.c - photographs as cameras write them: raw sensor data, many large ones in little memory
// SPDX-License-Identifier: BSD-3-Clause

#include "capture/masks.h"
#include "tests/capture_folders.h"

#define IDENTITY "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"

// ---- raw pictures

#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)
enum { WIDTH = 64, HEIGHT = 48, TAGS = 23 };

typedef struct dng { // a picture as a sensor with a Bayer pattern gives it, put together byte by byte
  uint8_t bytes[20000];
  size_t size;
} dng;

static void put16(dng *d, size_t at, unsigned value) {
  d->bytes[at] = (uint8_t)value, d->bytes[at + 1] = (uint8_t)(value >> 8);
}
static void put32(dng *d, size_t at, unsigned value) {
  put16(d, at, value & 65535), put16(d, at + 2, value >> 16);
}

// A tag with values of 1, 2 or 4 bytes; what has no room in it goes to the end.
static void put_tag(dng *d, int number, unsigned tag, unsigned type, unsigned count, const unsigned *values) {
  size_t at = 10 + 12 * (size_t)number, each = type == 3 ? 2 : type == 1 || type == 2 ? 1 : 4;
  size_t all = type == 5 || type == 10 ? 2 * count : count, to = at + 8;
  put16(d, at, tag), put16(d, at + 2, type), put32(d, at + 4, count);
  if (each * all > 4) {
    put32(d, at + 8, (unsigned)d->size);
    to = d->size;
    d->size += each * all + each * all % 2;
  }
  for (size_t i = 0; i < all; i++) {
    if (each == 1) d->bytes[to + i] = (uint8_t)values[i];
    if (each == 2) put16(d, to + 2 * i, values[i]);
    if (each == 4) put32(d, to + 4 * i, values[i]);
  }
}

static void make_dng(dng *d, unsigned orientation) {
  static const unsigned maker[] = {'T', 'e', 's', 't', 0}, model[] = {'O', 'n', 'e', 0}, zero[] = {0}, one[] = {1},
                        pattern[] = {2, 2}, bayer[] = {0, 1, 1, 2}, version[] = {1, 4, 0, 0}, backward[] = {1, 1, 0, 0},
                        white[] = {65535}, neutral[] = {1, 1, 1, 1, 1, 1}, light[] = {21}, deep[] = {16}, cfa[] = {32803},
                        width[] = {WIDTH}, height[] = {HEIGHT}, length[] = {2 * WIDTH * HEIGHT},
                        matrix[] = {1, 1, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1, 1};
  memset(d, 0, sizeof *d);
  memcpy(d->bytes, "II*\0\x08\0\0\0", 8);
  put16(d, 8, TAGS);
  d->size = 10 + 12 * TAGS + 4;
  int n = 0;
  put_tag(d, n++, 254, 4, 1, zero), put_tag(d, n++, 256, 4, 1, width), put_tag(d, n++, 257, 4, 1, height);
  put_tag(d, n++, 258, 3, 1, deep), put_tag(d, n++, 259, 3, 1, one), put_tag(d, n++, 262, 3, 1, cfa);
  put_tag(d, n++, 271, 2, 5, maker), put_tag(d, n++, 272, 2, 4, model), put_tag(d, n, 273, 4, 1, zero);
  size_t strip = 10 + 12 * (size_t)n++ + 8;
  put_tag(d, n++, 274, 3, 1, &orientation), put_tag(d, n++, 277, 3, 1, one), put_tag(d, n++, 278, 4, 1, height);
  put_tag(d, n++, 279, 4, 1, length), put_tag(d, n++, 33421, 3, 2, pattern), put_tag(d, n++, 33422, 1, 4, bayer);
  put_tag(d, n++, 50706, 1, 4, version), put_tag(d, n++, 50707, 1, 4, backward), put_tag(d, n++, 50708, 2, 5, maker);
  put_tag(d, n++, 50714, 3, 1, zero), put_tag(d, n++, 50717, 4, 1, white), put_tag(d, n++, 50721, 10, 9, matrix);
  put_tag(d, n++, 50728, 5, 3, neutral), put_tag(d, n++, 50778, 3, 1, light);
  assert_int_equal(n, TAGS);
  put32(d, strip, (unsigned)d->size);
  for (unsigned i = 0; i < WIDTH * HEIGHT; i++) { // darker to the left
    put16(d, d->size, 4000 + 500 * (i % WIDTH));
    d->size += 2;
  }
}

static double brightness(const vt_image *image, int x, int y) {
  const uint8_t *p = image->pixels + (size_t)image->channels * ((size_t)y * (size_t)image->width + (size_t)x);
  return (p[0] + p[1] + p[2]) / 3.0;
}

static void raw_pictures_keep_the_sensors_rows_and_tell_their_turn(void **state) {
  (void)state;
  place p = open_place();
  static dng d;
  for (unsigned orientation = 1; orientation <= 8; orientation++) {
    if (orientation == 2 || orientation == 4 || orientation == 5 || orientation == 7) continue; // no camera mirrors
    vt_image_info info;
    vt_image image = {0};
    make_dng(&d, orientation);
    put_bytes(&p, "a.dng", d.bytes, d.size);
    vt_status status = vt_read_image_info(p.context, at(&p, "a.dng"), &info);
    if (status == VT_BAD_INPUT && strstr(vt_last_error(p.context), "a.dng")) {
      printf("OpenImageIO reads no raw pictures here\n");
      close_place(&p);
      skip();
    }
    assert_int_equal(status, VT_OK);
    assert_int_equal(info.orientation, orientation);
    assert_int_equal(info.width, WIDTH);
    assert_int_equal(info.height, HEIGHT);
    assert_string_equal(info.make, "Test");
    assert_int_equal(vt_read_image(p.context, at(&p, "a.dng"), &image), VT_OK);
    assert_int_equal(image.width, WIDTH);
    assert_true(brightness(&image, 5, 20) + 20 < brightness(&image, WIDTH - 6, 20));
    vt_free_image(p.context, &image);
  }
  make_dng(&d, 1);
  put_bytes(&p, "cut.dng", d.bytes, d.size / 2);
  vt_image image = {0};
  assert_int_equal(vt_read_image(p.context, at(&p, "cut.dng"), &image), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(p.context), "cut.dng"));
  assert_null(image.pixels);
  close_place(&p);
}
#endif

// ---- memory

#ifdef VT_WITH_JANSSON
enum { PHOTOGRAPHS = 20 };

static void put_many(place *p) {
  char text[8192], name[32];
  int n = snprintf(text, sizeof text, "{\"fl_x\": 400, \"frames\": [");
  for (int i = 0; i < PHOTOGRAPHS; i++) {
    snprintf(name, sizeof name, "images/%02d.pam", i);
    put_picture(p, name, 400, 300, 4);
    n += snprintf(text + n, sizeof text - (size_t)n, "%s{\"file_path\": \"%s\", \"transform_matrix\": " IDENTITY "}", i ? "," : "",
                  name);
  }
  snprintf(text + n, sizeof text - (size_t)n, "]}");
  put_text(p, "transforms.json", text);
}

static vt_status load_within(place *p, uint64_t bound, int size, uint64_t *peak, char *sentence, size_t length) {
  vt_context_desc context = vt_default_context_desc();
  context.log_level = VT_LOG_QUIET;
  context.thread_count = 4;
  context.max_memory = bound;
  vt_context *within = vt_create_context(&context);
  vt_capture_desc desc = vt_default_capture_desc();
  vt_views v = {0};
  desc.source = p->root;
  desc.max_image_size = size;
  vt_status status = vt_load_views(within, &desc, &v, NULL);
  *peak = vt_peak_bytes(within);
  snprintf(sentence, length, "%s", vt_last_error(within));
  vt_free_views(within, &v);
  vt_destroy_context(within);
  return status;
}

// As pictures they are 9.6 MB, as views of 100 pixels 0.6 MB.
static void photographs_go_through_one_by_one_where_memory_is_short(void **state) {
  (void)state;
  place p = open_place();
  put_many(&p);
  uint64_t peak;
  char sentence[1024];
  vt_status status = load_within(&p, 5000000, 100, &peak, sentence, sizeof sentence);
  if (status) fail_msg("%s\n", sentence);
  assert_true(peak < 5000000);
  printf("20 photographs of 400 x 300 to views of 100 x 75: at most %.2f MB\n", (double)peak / 1e6);
  status = load_within(&p, 0, 100, &peak, sentence, sizeof sentence); // not all are held even without a bound
  assert_int_equal(status, VT_OK);
  assert_true(peak < 8000000);
  close_place(&p);
}

static void what_cannot_fit_is_told_before_the_work_with_a_size_that_does(void **state) {
  (void)state;
  place p = open_place();
  put_many(&p);
  uint64_t peak;
  char sentence[1024];
  assert_int_equal(load_within(&p, 6000000, 0, &peak, sentence, sizeof sentence), VT_OUT_OF_MEMORY);
  assert_non_null(strstr(sentence, "--max-memory"));
  const char *size = strstr(sentence, "--max-image-size ");
  assert_non_null(size);
  assert_true(peak < 1000000); // nothing was read
  int fits = atoi(size + strlen("--max-image-size "));
  assert_true(fits >= 100 && fits < 400);
  vt_status status = load_within(&p, 6000000, fits, &peak, sentence, sizeof sentence);
  if (status) fail_msg("%d: %s\n", fits, sentence);
  assert_int_equal(load_within(&p, 1000000, 0, &peak, sentence, sizeof sentence), VT_OUT_OF_MEMORY); // no size helps
  assert_null(strstr(sentence, "--max-image-size"));
  assert_non_null(strstr(sentence, "--max-memory"));
  close_place(&p);
}
#endif

static void masks_are_no_photographs(void **state) {
  (void)state;
  static const char *const masks[] = {"masks/a.png", "x/masks/a.jpg.png", "a.mask.png", "a_mask.png", "a.jpg.mask.png", ".mask/a.png"};
  static const char *const photographs[] = {"a.png", "mask/a.png", "masks.png", "unmasked/a.jpg", "a.mask.jpg"};
  for (size_t i = 0; i < sizeof masks / sizeof masks[0]; i++) assert_true(vt_is_mask_name(masks[i]));
  for (size_t i = 0; i < sizeof photographs / sizeof photographs[0]; i++) assert_false(vt_is_mask_name(photographs[i]));
}

int main(void) {
  const struct CMUnitTest tests[] = {
#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)
      cmocka_unit_test(raw_pictures_keep_the_sensors_rows_and_tell_their_turn),
#endif
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(photographs_go_through_one_by_one_where_memory_is_short),
      cmocka_unit_test(what_cannot_fit_is_told_before_the_work_with_a_size_that_does),
#endif
      cmocka_unit_test(masks_are_no_photographs),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
