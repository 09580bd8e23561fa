// test_capture_bad_input.c - captures that cannot be used are refused with a sentence that names the file
// SPDX-License-Identifier: BSD-3-Clause

#include "capture/colmap_model.h"
#include "tests/capture_folders.h"

#define IDENTITY "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"
#define ONE_FRAME(head, matrix) "{" head "\"frames\": [{\"file_path\": \"a.pam\", \"transform_matrix\": " matrix "}]}"

// Loads `name` and expects `status` and a sentence with both words in it.
static void refuse(place *p, const vt_capture_desc *desc, vt_status status, const char *word, const char *other) {
  vt_views views = {0};
  vt_capture_report report;
  vt_clear_error(p->context);
  vt_status got = vt_load_views(p->context, desc, &views, &report);
  const char *sentence = vt_last_error(p->context);
  if (got != status || !strstr(sentence, word) || !strstr(sentence, other) || !strchr(sentence, ';'))
    fail_msg("wanted %d with \"%s\" and \"%s\" and a cure, got %d: %s\n", status, word, other, got, sentence);
  assert_int_equal(views.count, 0);
  vt_free_capture_report(p->context, &report);
}

static void refuse_source(place *p, const char *name, vt_status status, const char *word, const char *other) {
  char source[1024];
  vt_capture_desc desc = desc_of(p, name);
  snprintf(source, sizeof source, "%s", desc.source);
  desc.source = source;
  refuse(p, &desc, status, word, other);
}

static void missing_and_empty_sources_are_named(void **state) {
  (void)state;
  place p = open_place();
  refuse_source(&p, "nowhere", VT_BAD_INPUT, "nowhere", "no such folder");
  assert_int_equal(vt_make_folder(p.context, at(&p, "empty")), VT_OK);
  refuse_source(&p, "empty", VT_BAD_INPUT, "empty", "no photographs");
  put_text(&p, "letter.txt", "dear tree");
  refuse_source(&p, "letter.txt", VT_BAD_INPUT, "letter.txt", "folder of photographs");
  put_text(&p, "words/letter.txt", "dear tree");
  refuse_source(&p, "words", VT_BAD_INPUT, "words", "no photographs");
  close_place(&p);
}

static void two_photographs_are_too_few(void **state) {
  (void)state;
  place p = open_place();
  put_picture(&p, "photos/a.pam", 8, 6, 3);
  put_picture(&p, "photos/b.pam", 8, 6, 3);
  put_picture(&p, "photos/masks/c.pam", 8, 6, 3); // no photograph
  refuse_source(&p, "photos", VT_TOO_FEW_VIEWS, "2 photographs", "at least 3");
  close_place(&p);
}

static void broken_photographs_are_named_before_calibration(void **state) {
  (void)state;
  place p = open_place();
  put_picture(&p, "photos/a.pam", 8, 6, 3);
  put_picture(&p, "photos/b.pam", 8, 6, 3);
  put_picture(&p, "photos/d.pam", 8, 6, 3);
  put_bytes(&p, "photos/c.pam", "", 0);
  refuse_source(&p, "photos", VT_BAD_INPUT, "c.pam", ";");
  put_text(&p, "photos/c.pam", "no picture at all");
  refuse_source(&p, "photos", VT_BAD_INPUT, "c.pam", ";");
  uint8_t *bytes = NULL;
  size_t size = 0;
  assert_int_equal(vt_read_file(p.context, at(&p, "photos/a.pam"), &bytes, &size), VT_OK);
  put_bytes(&p, "photos/c.pam", bytes, size - 1);
  put_bytes(&p, "photos/d.pam", bytes, size - 1);
  for (int i = 0; i < 5; i++) refuse_source(&p, "photos", VT_BAD_INPUT, "c.pam", ";"); // the first, whoever found it
  vt_free(p.context, bytes);
  close_place(&p);
}

#ifdef VT_WITH_JANSSON
static void bad_cameras_in_transforms_name_file_and_frame(void **state) {
  (void)state;
  static const struct {
    const char *text, *word;
  } cases[] = {{"{", "transforms.json"},
               {"[]", "frames"},
               {"{\"frames\": []}", "frames"},
               {"{\"frames\": 3}", "frames"},
               {"{\"frames\": [3]}", "file_path"},
               {"{\"camera_angle_x\": 1, \"frames\": [{\"transform_matrix\": " IDENTITY "}]}", "file_path"},
               {"{\"camera_angle_x\": 1, \"frames\": [{\"file_path\": \"b\", \"transform_matrix\": " IDENTITY "}]}",
                "b is missing"},
               {"{\"camera_angle_x\": 1, \"frames\": [{\"file_path\": \"a\"}]}", "frame 0 (a): transform_matrix"},
               {ONE_FRAME("\"camera_angle_x\": NaN,", IDENTITY), "transforms.json"},
               {ONE_FRAME("\"camera_angle_x\": 1,", "[[1,0,0,NaN],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), "transforms.json"},
               {ONE_FRAME("", IDENTITY), "no focal length"},
               {ONE_FRAME("\"camera_angle_x\": 0,", IDENTITY), "frame 0 (a.pam): camera_angle_x"},
               {ONE_FRAME("\"camera_angle_x\": 45,", IDENTITY), "radians"},
               {ONE_FRAME("\"camera_angle_x\": \"1\",", IDENTITY), "no number"},
               {ONE_FRAME("\"fl_x\": -3,", IDENTITY), "fl_x"},
               {ONE_FRAME("\"fl_x\": 9, \"w\": 8,", IDENTITY), "w and h"},
               {ONE_FRAME("\"fl_x\": 9, \"w\": 8, \"h\": 1e9,", IDENTITY), "w and h"},
               {ONE_FRAME("\"fl_x\": 9, \"w\": 6, \"h\": 8,", IDENTITY), "another shape"},
               {ONE_FRAME("\"fl_x\": 9, \"camera_model\": \"EQUIRECTANGULAR\",", IDENTITY), "EQUIRECTANGULAR"},
               {ONE_FRAME("\"fl_x\": 9, \"camera_model\": 7,", IDENTITY), "camera_model"},
               {ONE_FRAME("\"fl_x\": 9, \"k4\": \"0.1\",", IDENTITY), "k4"},
               {ONE_FRAME("\"fl_x\": 9,", "[[1,0,0,0],[0,1,0,0],[0,0,0,0],[0,0,0,1]]"),
                "frame 0 (a.pam): transform_matrix is singular"},
               {ONE_FRAME("\"fl_x\": 9,", "[[0,0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,1]]"), "singular"},
               {ONE_FRAME("\"fl_x\": 9,", "[[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), "mirrored"},
               {ONE_FRAME("\"fl_x\": 9,", "[[1,0.3,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), "sheared"},
               {ONE_FRAME("\"fl_x\": 9,", "[[1,0,0,0],[0,2,0,0],[0,0,1,0],[0,0,0,1]]"), "sheared"},
               {ONE_FRAME("\"fl_x\": 9,", "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]]"), "last row"},
               {ONE_FRAME("\"fl_x\": 9,", "[[1,0,0],[0,1,0],[0,0,1]]"), "4 x 4"},
               {ONE_FRAME("\"fl_x\": 9,", "[[1,0,0,0],[0,1,0,0]]"), "4 x 4"},
               {ONE_FRAME("\"fl_x\": 9,", "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]"), "4 x 4"},
               {ONE_FRAME("\"fl_x\": 9,", "[[1,0,0,null],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), "4 x 4"}};
  place p = open_place();
  put_picture(&p, "a.pam", 8, 6, 4);
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    put_text(&p, "transforms.json", cases[i].text);
    refuse_source(&p, "transforms.json", VT_BAD_INPUT, "transforms.json", cases[i].word);
  }
  close_place(&p);
}

static void a_truncated_transforms_file_is_refused_at_every_byte(void **state) {
  (void)state;
  static const char text[] = ONE_FRAME("\"camera_angle_x\": 1,", IDENTITY);
  place p = open_place();
  put_picture(&p, "a.pam", 8, 6, 4);
  for (size_t size = 0; size < sizeof text - 1; size++) {
    put_bytes(&p, "transforms.json", text, size);
    refuse_source(&p, "transforms.json", VT_BAD_INPUT, "transforms.json", "");
  }
  close_place(&p);
}

static void a_damaged_picture_of_a_capture_is_named(void **state) {
  (void)state;
  place p = open_place();
  put_text(&p, "transforms.json", ONE_FRAME("\"camera_angle_x\": 1,", IDENTITY));
  put_bytes(&p, "a.pam", "", 0);
  refuse_source(&p, "transforms.json", VT_BAD_INPUT, "a.pam", ";");
  put_picture(&p, "a.pam", 8, 6, 4);
  uint8_t *bytes = NULL;
  size_t size = 0;
  assert_int_equal(vt_read_file(p.context, at(&p, "a.pam"), &bytes, &size), VT_OK);
  for (size_t cut = 1; cut < size; cut += 5) {
    put_bytes(&p, "a.pam", bytes, size - cut);
    refuse_source(&p, "transforms.json", VT_BAD_INPUT, "a.pam", ";");
  }
  vt_free(p.context, bytes);
  close_place(&p);
}

static void mattes_that_are_not_there_are_refused(void **state) {
  (void)state;
  place p = open_place();
  char masks[1024];
  put_text(&p, "transforms.json", ONE_FRAME("\"camera_angle_x\": 1,", IDENTITY));
  put_picture(&p, "a.pam", 8, 6, 3);
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  desc.matte = VT_MATTE_ALPHA;
  refuse(&p, &desc, VT_BAD_INPUT, p.root, "alpha channel");
  desc.matte = VT_MATTE_MASKS;
  refuse(&p, &desc, VT_BAD_INPUT, p.root, "no mask fits");
  desc.matte = VT_MATTE_AUTO;
  snprintf(masks, sizeof masks, "%s", at(&p, "mine"));
  desc.masks = masks;
  refuse(&p, &desc, VT_BAD_INPUT, "mine", "no such folder");
  assert_int_equal(vt_make_folder(p.context, masks), VT_OK);
  refuse(&p, &desc, VT_BAD_INPUT, "mine", "no mask fits");
  put_picture(&p, "mine/a.pam", 6, 8, 1);
  refuse(&p, &desc, VT_BAD_INPUT, "mine/a.pam", "another shape");
  put_text(&p, "mine/a.pam", "P7 nothing");
  refuse(&p, &desc, VT_BAD_INPUT, "mine/a.pam", ";");
  close_place(&p);
}
#endif

// ---- COLMAP models

typedef struct bytes {
  uint8_t data[1024];
  size_t size;
} bytes;

static void add(bytes *b, const void *value, size_t size) {
  memcpy(b->data + b->size, value, size);
  b->size += size;
}
static void add_count(bytes *b, uint64_t value) {
  add(b, &value, 8);
} // tests run on little-endian machines
static void add_word(bytes *b, uint32_t value) {
  add(b, &value, 4);
}
static void add_real(bytes *b, double value) {
  add(b, &value, 8);
}

static bytes good_cameras(void) {
  bytes b = {.size = 0};
  add_count(&b, 1);
  add_word(&b, 7), add_word(&b, 1);
  add_count(&b, 8), add_count(&b, 6);
  add_real(&b, 10), add_real(&b, 10), add_real(&b, 4), add_real(&b, 3);
  return b;
}

static bytes good_images(void) {
  bytes b = {.size = 0};
  add_count(&b, 2);
  for (int i = 0; i < 2; i++) {
    add_word(&b, (uint32_t)i + 1);
    add_real(&b, 1), add_real(&b, 0), add_real(&b, 0), add_real(&b, 0);
    add_real(&b, i), add_real(&b, 0), add_real(&b, 5);
    add_word(&b, 7);
    add(&b, i ? "b.pam" : "a.pam", 6);
    add_count(&b, 1);
    add_real(&b, 1), add_real(&b, 2), add_count(&b, 3);
  }
  return b;
}

static bytes good_points(void) {
  bytes b = {.size = 0};
  add_count(&b, 1);
  add_count(&b, 3);
  add_real(&b, 0), add_real(&b, 0), add_real(&b, 0);
  add(&b, "rgb", 3);
  add_real(&b, 0.75);
  add_count(&b, 1);
  add_word(&b, 1), add_word(&b, 0);
  return b;
}

static void put_model(place *p, const bytes *cameras, const bytes *images, const bytes *points) {
  put_bytes(p, "sparse/0/cameras.bin", cameras->data, cameras->size);
  put_bytes(p, "sparse/0/images.bin", images->data, images->size);
  put_bytes(p, "sparse/0/points3D.bin", points->data, points->size);
}

static vt_status read_model(place *p) {
  vt_colmap_model model = {0};
  vt_clear_error(p->context);
  vt_status status = vt_read_colmap_model(p->context, at(p, "sparse/0"), &model);
  vt_free_colmap_model(p->context, &model);
  if (status) assert_true(vt_last_error(p->context)[0] != 0);
  return status;
}

static void a_truncated_model_is_refused_at_every_byte(void **state) {
  (void)state;
  place p = open_place();
  bytes parts[3] = {good_cameras(), good_images(), good_points()};
  static const char *const names[3] = {"cameras.bin", "images.bin", "points3D.bin"};
  put_model(&p, &parts[0], &parts[1], &parts[2]);
  assert_int_equal(read_model(&p), VT_OK);
  for (int part = 0; part < 3; part++) {
    size_t whole = parts[part].size;
    for (parts[part].size = 0; parts[part].size < whole; parts[part].size++) {
      put_model(&p, &parts[0], &parts[1], &parts[2]);
      assert_int_equal(read_model(&p), VT_BAD_INPUT);
      assert_non_null(strstr(vt_last_error(p.context), names[part]));
    }
  }
  close_place(&p);
}

static void a_model_with_any_changed_byte_never_crashes(void **state) {
  (void)state;
  place p = open_place();
  const bytes good[3] = {good_cameras(), good_images(), good_points()};
  static const uint8_t masks[] = {0xff, 0x80, 0x01};
  for (int part = 0; part < 3; part++)
    for (size_t i = 0; i < good[part].size; i++)
      for (size_t m = 0; m < sizeof masks; m++) {
        bytes bad[3] = {good[0], good[1], good[2]};
        bad[part].data[i] ^= masks[m];
        put_model(&p, &bad[0], &bad[1], &bad[2]);
        vt_status status = read_model(&p);
        assert_true(status == VT_OK || status == VT_BAD_INPUT);
      }
  close_place(&p);
}

static void counts_whose_bytes_overflow_are_refused(void **state) {
  (void)state;
  place p = open_place();
  bytes cameras = good_cameras(), images = good_images(), points = good_points();
  uint64_t one = 1, wraps = UINT64_C(0xaaaaaaaaaaaaaab); // times 24 bytes a keypoint: 2^64 + 8
  memcpy(images.data, &one, 8);
  memcpy(images.data + 8 + 4 + 56 + 4 + 6, &wraps, 8);
  put_model(&p, &cameras, &images, &points);
  assert_int_equal(read_model(&p), VT_BAD_INPUT);
  images = good_images();
  memset(images.data, 0xff, 8);
  put_model(&p, &cameras, &images, &points);
  assert_int_equal(read_model(&p), VT_BAD_INPUT);
  close_place(&p);
}

static void poses_and_cameras_of_a_model_that_make_no_sense_are_refused(void **state) {
  (void)state;
  static const struct {
    const char *cameras, *images, *word;
  } cases[] = {{"1 PINHOLE 8 6 10 10 4 nan\n", "1 1 0 0 0 0 0 5 1 a.pam\n\n", "NaN"},
               {"1 PINHOLE 8 6 10 10 4\n", "1 1 0 0 0 0 0 5 1 a.pam\n\n", "too few"},
               {"1 PINHOLE 0 6 10 10 4 3\n", "1 1 0 0 0 0 0 5 1 a.pam\n\n", "size"},
               {"1 PINHOLE 8 6 10 10 4 3\n", "1 0 0 0 0 0 0 5 1 a.pam\n\n", "quaternion"},
               {"1 PINHOLE 8 6 10 10 4 3\n", "1 1 0 0 inf 0 0 5 1 a.pam\n\n", "NaN"},
               {"1 PINHOLE 8 6 10 10 4 3\n", "1 1 0 0 0 0 nan 5 1 a.pam\n\n", "NaN"},
               {"1 PINHOLE 8 6 10 10 4 3\n", "1 1 0 0 0 0 0 5 2 a.pam\n\n", "not in cameras"},
               {"1 PINHOLE 8 6 10 10 4 3\n", "1 1 0 0 0 0 0 5 1 \n\n", "no name"},
               {"1 PINHOLE 8 6 10 10 4 3\n", "1 1 0 0 0 0 0 5 1 a.pam\n2 1 0 0 0 0 0 5 1 b.pam\n", "keypoints"},
               {"1 PINHOLE 8 6 10 10 4 3\n", "1 1 0 0 0 0 0 5 1 a.pam\n\n2 1 0 0 0 0 0 5 1 a.pam\n\n", "twice"},
               {"1 PINHOLE 8 6 10 10 4 3\n", "# nothing\n", "without images"},
               {"1 PINHOLE 8 6 10 10 4 3\n", "1 1 0 0 a.pam\n", "too few"},
               {"1 FOV 8 6 10 10 4 3 1\n", "1 1 0 0 0 0 0 5 1 a.pam\n\n", "image_undistorter"},
               {"1 MAGIC 8 6 10 10 4 3 1\n", "1 1 0 0 0 0 0 5 1 a.pam\n\n", "image_undistorter"}};
  place p = open_place();
  put_text(&p, "sparse/0/points3D.txt", "");
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    put_text(&p, "sparse/0/cameras.txt", cases[i].cameras);
    put_text(&p, "sparse/0/images.txt", cases[i].images);
    assert_int_equal(read_model(&p), VT_BAD_INPUT);
    if (!strstr(vt_last_error(p.context), cases[i].word))
      fail_msg("wanted \"%s\" in: %s\n", cases[i].word, vt_last_error(p.context));
  }
  close_place(&p);
}

static void a_workspace_with_missing_or_contradicting_pictures_is_refused(void **state) {
  (void)state;
  place p = open_place();
  bytes cameras = good_cameras(), images = good_images(), points = good_points();
  put_model(&p, &cameras, &images, &points);
  put_picture(&p, "images/a.pam", 8, 6, 4);
  refuse_source(&p, ".", VT_BAD_INPUT, "b.pam", "missing");
  put_picture(&p, "images/b.pam", 6, 8, 4);
  refuse_source(&p, ".", VT_BAD_INPUT, "b.pam", "another shape");
  assert_int_equal(remove(at(&p, "sparse/0/images.bin")), 0);
  refuse_source(&p, ".", VT_BAD_INPUT, "sparse/0", "no COLMAP model");
  close_place(&p);
}

static void an_interrupted_load_gives_nothing(void **state) {
  (void)state;
  place p = open_place();
  bytes cameras = good_cameras(), images = good_images(), points = good_points();
  put_model(&p, &cameras, &images, &points);
  put_picture(&p, "images/a.pam", 8, 6, 4);
  put_picture(&p, "images/b.pam", 8, 6, 4);
  vt_cancel(p.context);
  refuse_source(&p, ".", VT_CANCELLED, "interrupted", "");
  close_place(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(missing_and_empty_sources_are_named),
      cmocka_unit_test(two_photographs_are_too_few),
      cmocka_unit_test(broken_photographs_are_named_before_calibration),
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(bad_cameras_in_transforms_name_file_and_frame),
      cmocka_unit_test(a_truncated_transforms_file_is_refused_at_every_byte),
      cmocka_unit_test(a_damaged_picture_of_a_capture_is_named),
      cmocka_unit_test(mattes_that_are_not_there_are_refused),
#endif
      cmocka_unit_test(a_truncated_model_is_refused_at_every_byte),
      cmocka_unit_test(a_model_with_any_changed_byte_never_crashes),
      cmocka_unit_test(counts_whose_bytes_overflow_are_refused),
      cmocka_unit_test(poses_and_cameras_of_a_model_that_make_no_sense_are_refused),
      cmocka_unit_test(a_workspace_with_missing_or_contradicting_pictures_is_refused),
      cmocka_unit_test(an_interrupted_load_gives_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
