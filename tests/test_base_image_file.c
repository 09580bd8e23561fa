// test_base_image_file.c - pictures written and read back, cut off, damaged, too large, by many workers
// SPDX-License-Identifier: BSD-3-Clause
#define _XOPEN_SOURCE 700 // mkdtemp
#include "tests/picture_bench.h"

// ---- everywhere

static void names_of_pictures_are_known_by_their_endings(void **state) {
  (void)state;
  const char *yes[] = {"a.jpg",  "b/c.JPEG", "x.y.PnG", "a.tif", "a.tiff", "a.exr", "a.webp", "a.heic",
                       "a.heif", "a.avif",   "a.bmp",   "a.pam", "a.CR2",  "a.nef", "a.dng",  "a.arw"};
  const char *no[] = {"", "jpg", ".jpg", "a.jpg/b", "a.txt", "a.jpg.tmp.12", "a.", "a.mp4", "a.json"};
  for (size_t i = 0; i < sizeof yes / sizeof *yes; i++) assert_true(vt_is_image_name(yes[i]));
  for (size_t i = 0; i < sizeof no / sizeof *no; i++) assert_false(vt_is_image_name(no[i]));
}

static void names_that_can_be_written_are_fewer(void **state) {
  (void)state;
  const char *no[] = {"", "a", "a.exr", "a.heic", "a.dng", "a.webp", "a.gif"};
  for (size_t i = 0; i < sizeof no / sizeof *no; i++) assert_false(vt_is_output_name(no[i], false));
  assert_true(vt_is_output_name("a.pam", true));
#ifdef VT_WITH_OPENIMAGEIO
  assert_true(vt_is_output_name("b/a.PNG", true) && vt_is_output_name("a.tiff", true));
  assert_true(vt_is_output_name("a.jpg", false) && !vt_is_output_name("a.jpg", true));
#else
  assert_false(vt_is_output_name("a.png", false)); // so that nothing is drawn that cannot be written
#endif
}

static void pam_round_trips_exactly(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  for (int channels = 1; channels <= 4; channels++) {
    if (channels == 2) continue;
    vt_image image = make_noise(&b, 37, 23, channels, false);
    assert_int_equal(vt_write_image(b.context, in_folder(&b, "a.pam"), &image), VT_OK);
    if (channels > 1) expect_pixels(&b, "a.pam", 37, 23, channels, image.pixels);
    vt_image mask;
    vt_image_info info;
    assert_int_equal(vt_read_mask(b.context, in_folder(&b, "a.pam"), &mask), VT_OK);
    assert_int_equal(mask.channels, 1);
    for (int i = 0; i < 37 * 23; i++) {
      const uint8_t *p = image.pixels + i * channels;
      double luma = channels == 3 ? 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2] : channels == 4 ? p[3] : p[0];
      assert_close(mask.pixels[i], luma, channels == 3 ? 2 : 0);
    }
    assert_int_equal(vt_read_image_info(b.context, in_folder(&b, "a.pam"), &info), VT_OK);
    assert_true(info.width == 37 && info.height == 23 && info.channels == channels && info.orientation == 1);
    vt_free_image(b.context, &mask);
    vt_free_image(b.context, &image);
  }
  close_bench(&b);
}

static void pam_of_other_depths_is_read(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  const char grey16[] = "P7\n# a remark\n\nWIDTH 2\nHEIGHT 1\nDEPTH 1\nMAXVAL 65535\nENDHDR\n\x80\x00\xff\xff";
  put_file(&b, "a.pam", grey16, sizeof grey16 - 1);
  expect_pixels(&b, "a.pam", 2, 1, 3, (const uint8_t *)"\x80\x80\x80\xff\xff\xff");
  const char bits[] = "P7\nWIDTH 3\nHEIGHT 1\nDEPTH 1\nMAXVAL 1\nTUPLTYPE BLACKANDWHITE\nENDHDR\n\x00\x01\x07";
  put_file(&b, "b.pam", bits, sizeof bits - 1);
  expect_pixels(&b, "b.pam", 3, 1, 3, (const uint8_t *)"\0\0\0\xff\xff\xff\xff\xff\xff");
  const char alpha[] = "P7\nWIDTH 1\nHEIGHT 2\nDEPTH 2\nMAXVAL 255\nTUPLTYPE GRAYSCALE_ALPHA\nENDHDR\n\x10\x20\x30\x40";
  put_file(&b, "c.pam", alpha, sizeof alpha - 1);
  expect_pixels(&b, "c.pam", 1, 2, 4, (const uint8_t *)"\x10\x10\x10\x20\x30\x30\x30\x40");
  close_bench(&b);
}

static void damaged_pam_is_refused(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 64 << 20);
  const char good[] =
      "P7\nWIDTH 4\nHEIGHT 3\nDEPTH 3\nMAXVAL 255\nTUPLTYPE RGB\nENDHDR\n012345678901234567890123456789abcdef";
  size_t size = sizeof good - 1;
  put_file(&b, "good.pam", good, size);
  expect_pixels(&b, "good.pam", 4, 3, 3, (const uint8_t *)good + size - 36);
  for (size_t cut = 0; cut < size; cut++) {
    put_file(&b, "cut.pam", good, cut);
    expect_refusal(&b, "cut.pam", VT_BAD_INPUT);
  }
  const char *heads[] = {
      "WIDTH 65536\nHEIGHT 1\nDEPTH 1\nMAXVAL 255",      "WIDTH 65535\nHEIGHT 65535\nDEPTH 4\nMAXVAL 65535",
      "WIDTH 0\nHEIGHT 1\nDEPTH 1\nMAXVAL 255",          "WIDTH -1\nHEIGHT 1\nDEPTH 1\nMAXVAL 255",
      "WIDTH 4294967297\nHEIGHT 1\nDEPTH 1\nMAXVAL 255", "HEIGHT 1\nDEPTH 1\nMAXVAL 255",
      "WIDTH 1\nHEIGHT 1\nDEPTH 5\nMAXVAL 255",          "WIDTH 1\nHEIGHT 1\nDEPTH 1\nMAXVAL 65536",
      "WIDTH 1x\nHEIGHT 1\nDEPTH 1\nMAXVAL 255",         "WIDTH\nHEIGHT 1\nDEPTH 1\nMAXVAL 255"};
  for (size_t i = 0; i < sizeof heads / sizeof *heads; i++) {
    char text[256];
    snprintf(text, sizeof text, "P7\n%s\nENDHDR\nabcdefgh", heads[i]);
    put_file(&b, "head.pam", text, strlen(text));
    expect_refusal(&b, "head.pam", VT_BAD_INPUT);
  }
  vt_rng rng = vt_seed_rng(2, 1);
  for (int i = 0; i < 2000; i++) {
    char text[sizeof good];
    vt_image image;
    memcpy(text, good, size);
    for (int k = 0; k < 3; k++) text[vt_random(&rng) % size] = (char)vt_random(&rng);
    put_file(&b, "fuzz.pam", text, size);
    (void)vt_read_image(b.context, b.path, &image);
    vt_free_image(b.context, &image);
    vt_clear_error(b.context);
  }
  close_bench(&b);
}

static void what_is_no_picture_is_named(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_image image = make_noise(&b, 2, 2, 3, false);
  expect_refusal(&b, "missing.pam", VT_BAD_INPUT);
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "none/a.pam"), &image), VT_FAILED);
  assert_non_null(strstr(vt_last_error(b.context), "none/a.pam"));
  vt_clear_error(b.context);
#ifdef VT_WITH_OPENIMAGEIO
  expect_refusal(&b, "missing.jpg", VT_BAD_INPUT);
  put_file(&b, "empty.jpg", "", 0);
  expect_refusal(&b, "empty.jpg", VT_BAD_INPUT);
  put_file(&b, "text.png", "this is no picture at all, however long it may be", 50);
  expect_refusal(&b, "text.png", VT_BAD_INPUT);
  assert_int_equal(vt_make_folder(b.context, in_folder(&b, "folder.png")), VT_OK);
  expect_refusal(&b, "folder.png", VT_BAD_INPUT);
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "none/a.png"), &image), VT_FAILED);
  vt_clear_error(b.context);
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "a.xyz"), &image), VT_FAILED);
  assert_non_null(strstr(vt_last_error(b.context), "a.xyz"));
#else
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "a.png"), &image), VT_MISSING_PROGRAM);
  vt_clear_error(b.context);
  expect_refusal(&b, "a.jpg", VT_MISSING_PROGRAM);
#endif
  vt_free_image(b.context, &image);
  close_bench(&b);
}

#ifdef VT_WITH_OPENIMAGEIO
// ---- our own writer

static void png_and_tiff_round_trip_exactly_even_under_alpha_zero(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  const char *names[] = {"a.png", "a.tif", "odd name?x=1&%04d #.png"};
  for (int i = 0; i < 3; i++)
    for (int channels = 3; channels <= 4; channels++) {
      vt_image image = make_noise(&b, 123, 301, channels, false); // more rows than a strip
      vt_image_info info;
      assert_int_equal(vt_write_image(b.context, in_folder(&b, names[i]), &image), VT_OK);
      expect_pixels(&b, names[i], 123, 301, channels, image.pixels);
      assert_int_equal(vt_read_image_info(b.context, in_folder(&b, names[i]), &info), VT_OK);
      assert_true(info.width == 123 && info.height == 301 && info.channels == channels && info.orientation == 1);
      assert_true(info.focal_mm == 0 && info.focal_35mm == 0 && !info.make[0] && !info.model[0]);
      vt_free_image(b.context, &image);
    }
  vt_image mask = make_noise(&b, 50, 20, 1, false), back;
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "mask.png"), &mask), VT_OK);
  assert_int_equal(vt_read_mask(b.context, in_folder(&b, "mask.png"), &back), VT_OK);
  assert_memory_equal(back.pixels, mask.pixels, 1000);
  vt_free_image(b.context, &back);
  vt_free_image(b.context, &mask);
  vt_names names_left;
  assert_int_equal(vt_list_folder(b.context, b.folder, false, &names_left), VT_OK);
  assert_int_equal(names_left.count, 4);
  vt_free_names(b.context, &names_left);
  close_bench(&b);
}

static void jpeg_is_close_and_refuses_alpha(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_image image = make_noise(&b, 64, 80, 3, true), back, alpha = make_noise(&b, 4, 4, 4, false);
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "a.jpg"), &image), VT_OK);
  assert_int_equal(vt_read_image(b.context, in_folder(&b, "a.jpg"), &back), VT_OK);
  double error = 0;
  for (int i = 0; i < 64 * 80 * 3; i++) error += pow((double)back.pixels[i] - image.pixels[i], 2) / (64 * 80 * 3);
  assert_true(error > 0 && error < 4);
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "b.jpg"), &alpha), VT_FAILED);
  assert_non_null(strstr(vt_last_error(b.context), "b.jpg"));
  vt_free_image(b.context, &image);
  vt_free_image(b.context, &alpha);
  vt_free_image(b.context, &back);
  close_bench(&b);
}

static void pictures_cut_off_are_refused_and_never_half_read(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  const char *names[] = {"a.jpg", "a.png", "a.tif"};
  const size_t spare[] = {2, 0, 0}; // the end mark of a JPEG, behind its last pixel
  for (int i = 0; i < 3; i++)
    for (int kind = 0; kind < 2; kind++) {
      vt_image image = make_noise(&b, 40, 300, 3, kind);
      uint8_t *data;
      size_t size;
      char cut_name[16] = "cut";
      strcat(cut_name, names[i] + 1);
      assert_int_equal(vt_write_image(b.context, in_folder(&b, names[i]), &image), VT_OK);
      assert_int_equal(vt_read_file(b.context, b.path, &data, &size), VT_OK);
      vt_image whole;
      assert_int_equal(vt_read_image(b.context, b.path, &whole), VT_OK);
      vt_free_image(b.context, &whole);
      for (int k = 0; k < 60; k++) {
        size_t cut = k < 20   ? (size_t)k * (size / 20)
                     : k < 40 ? size - spare[i] - (size_t)(k - 19)
                              : (size_t)(k - 39) * 3;
        put_file(&b, cut_name, data, cut);
        expect_refusal(&b, cut_name, VT_BAD_INPUT);
      }
      vt_free(b.context, data);
      vt_free_image(b.context, &image);
    }
  close_bench(&b);
}

static void the_same_picture_gives_the_same_bytes_at_any_time(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  const char *names[] = {"a.jpg", "a.png", "a.tif"};
  uint8_t *first[3], *second;
  size_t first_size[3], size;
  vt_image image = make_noise(&b, 20, 20, 3, true);
  for (int pass = 0; pass < 2; pass++) {
    for (int i = 0; i < 3; i++) {
      assert_int_equal(vt_write_image(b.context, in_folder(&b, names[i]), &image), VT_OK);
      if (!pass) {
        assert_int_equal(vt_read_file(b.context, b.path, &first[i], &first_size[i]), VT_OK);
        continue;
      }
      assert_int_equal(vt_read_file(b.context, b.path, &second, &size), VT_OK);
      assert_int_equal(size, first_size[i]);
      assert_memory_equal(second, first[i], size);
      vt_free(b.context, first[i]);
      vt_free(b.context, second);
    }
    if (!pass) sleep(2); // a time of writing would show
  }
  vt_free_image(b.context, &image);
  close_bench(&b);
}

static void damaged_bytes_never_crash(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 256 << 20);
  const char *names[] = {"a.jpg", "a.png", "a.tif"};
  vt_rng rng = vt_seed_rng(11, 1);
  for (int i = 0; i < 3; i++) {
    vt_image image = make_noise(&b, 32, 24, i ? 4 : 3, true);
    uint8_t *data;
    size_t size;
    assert_int_equal(vt_write_image(b.context, in_folder(&b, names[i]), &image), VT_OK);
    assert_int_equal(vt_read_file(b.context, b.path, &data, &size), VT_OK);
    for (int k = 0; k < 150; k++) {
      vt_image back;
      size_t at = vt_random(&rng) % size;
      uint8_t old = data[at];
      data[at] = (uint8_t)vt_random(&rng);
      put_file(&b, names[i], data, size);
      data[at] = old;
      if (vt_read_image(b.context, b.path, &back)) assert_null(back.pixels);
      vt_free_image(b.context, &back);
      vt_clear_error(b.context);
    }
    vt_free(b.context, data);
    vt_free_image(b.context, &image);
  }
  close_bench(&b);
}

static void a_huge_picture_is_refused_before_it_is_decoded(void **state) {
  (void)state;
  bench b;
  bytes o;
  open_bench(&b, 1, 64 << 20);
  make_png(&o, 60000, 60000, 8, 6, (const uint8_t *)"\0", 1);
  put_file(&b, "bomb.png", o.data, o.size);
  expect_refusal(&b, "bomb.png", VT_OUT_OF_MEMORY);
  make_png(&o, 65536, 2, 8, 2, (const uint8_t *)"\0", 1);
  put_file(&b, "wide.png", o.data, o.size);
  expect_refusal(&b, "wide.png", VT_BAD_INPUT);
  close_bench(&b);
}

typedef struct reading {
  vt_context *context;
  const char *folder;
  vt_image *images;
  vt_status *status;
} reading;

static void read_some(void *user, size_t begin, size_t end, int worker) {
  reading *r = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    char path[128];
    snprintf(path, sizeof path, "%s/%zu.%s", r->folder, i, i % 3 == 0 ? "png" : i % 3 == 1 ? "jpg" : "tif");
    r->status[i] = vt_read_image(r->context, path, &r->images[i]);
  }
}

static void write_some(void *user, size_t begin, size_t end, int worker) {
  reading *r = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    char path[128];
    snprintf(path, sizeof path, "%s/%zu.%s", r->folder, i, i % 3 == 0 ? "png" : i % 3 == 1 ? "jpg" : "tif");
    r->status[i] = vt_write_image(r->context, path, &r->images[i]);
  }
}

static void many_workers_read_and_write_at_once(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 7, 0);
  enum { COUNT = 42 };
  vt_image images[COUNT], back[COUNT] = {{0}}, again[COUNT] = {{0}};
  vt_status status[COUNT];
  for (int i = 0; i < COUNT; i++) images[i] = make_noise(&b, 60 + i, 70, 3, true);
  assert_int_equal(vt_parallel(b.context, COUNT, 1, write_some, &(reading){b.context, b.folder, images, status}),
                   VT_OK);
  for (int i = 0; i < COUNT; i++) assert_int_equal(status[i], VT_OK);
  reading r = {b.context, b.folder, back, status};
  assert_int_equal(vt_parallel(b.context, COUNT, 1, read_some, &r), VT_OK);
  r.images = again;
  for (int i = 0; i < COUNT; i++) assert_int_equal(status[i], VT_OK);
  read_some(&r, 0, COUNT, 0);
  for (int i = 0; i < COUNT; i++) {
    size_t size = (size_t)images[i].width * 70 * 3;
    assert_memory_equal(back[i].pixels, again[i].pixels, size);
    if (i % 3 != 1) assert_memory_equal(back[i].pixels, images[i].pixels, size);
    vt_free_image(b.context, &images[i]);
    vt_free_image(b.context, &back[i]);
    vt_free_image(b.context, &again[i]);
  }
  close_bench(&b);
}

// A baseline JPEG of ours with an EXIF segment put behind its first two bytes.
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(names_of_pictures_are_known_by_their_endings),
    cmocka_unit_test(names_that_can_be_written_are_fewer),
      cmocka_unit_test(pam_round_trips_exactly),
      cmocka_unit_test(pam_of_other_depths_is_read),
      cmocka_unit_test(damaged_pam_is_refused),
      cmocka_unit_test(what_is_no_picture_is_named),
#ifdef VT_WITH_OPENIMAGEIO
      cmocka_unit_test(png_and_tiff_round_trip_exactly_even_under_alpha_zero),
      cmocka_unit_test(jpeg_is_close_and_refuses_alpha),
      cmocka_unit_test(pictures_cut_off_are_refused_and_never_half_read),
      cmocka_unit_test(the_same_picture_gives_the_same_bytes_at_any_time),
      cmocka_unit_test(damaged_bytes_never_crash),
      cmocka_unit_test(a_huge_picture_is_refused_before_it_is_decoded),
      cmocka_unit_test(many_workers_read_and_write_at_once),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
