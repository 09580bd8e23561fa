// test_capture_cameras.c - cameras written for other programs are read back as the same cameras, lenses and all
// SPDX-License-Identifier: BSD-3-Clause

#include "capture/colmap_model.h"
#include "capture/transforms.h"
#include "capture/write_cameras.h"
#include "tests/capture_folders.h"

// A lens of every kind that can be read, of a picture of 40 x 30 pixels.
static const vt_lens lenses[] = {{VT_LENS_PINHOLE, 40, 30, 41, 42, 20.5, 14.25, {0}},
                                 {VT_LENS_OPENCV, 40, 30, 40, 40, 20, 15, {-0.1}},
                                 {VT_LENS_OPENCV, 40, 30, 41, 43, 19, 16, {-0.1, 0.02, 0.001, -0.002}},
                                 {VT_LENS_OPENCV, 40, 30, 41, 43, 19, 16, {-0.1, 0.02, 0.001, -0.002, 0.003}},
                                 {VT_LENS_FISHEYE, 40, 30, 22, 23, 20, 15, {0.05, -0.01, 0.002, -0.001}}};
static const vt_lens rational = {VT_LENS_OPENCV, 40, 30, 41, 43, 19, 16,
                                 {-0.1, 0.02, 0.001, -0.002, 0.003, 0.01, -0.02, 0.03}};
static const vt_lens eighth = {VT_LENS_OPENCV, 40, 30, 41, 43, 19, 16, {-0.1, 0.02, 0.001, -0.002, 0.003, 0, 0, 0, -0.004}};
enum { LENSES = sizeof lenses / sizeof lenses[0] };

// Photographs that stand all around, upside down and sideways too, under names that need care.
static vt_photos make_photos(place *p, const vt_lens *of, int count) {
  static const char *const names[] = {"a.pam", "b c.pam", "sub/d.pam", "e\xc3\xbc.pam", "f.pam", "g.pam", "h.pam"};
  vt_photos photos = {0};
  for (int i = 0; i < count; i++) {
    char file[64];
    snprintf(file, sizeof file, "images/%s", names[i % 7]);
    put_picture(p, file, 40, 30, 4);
    vt_photo *photo = vt_add_photo(p->context, &photos, file, at(p, file));
    vt_vec3 up = i == 1 ? vt_v3(0, 0, -1) : i == 2 ? vt_v3(0.3, -2, 0.1) : vt_v3(0, 0.1, 1);
    vt_camera camera = vt_look_at(vt_v3(30 * cos(i), 30 * sin(i), 5 + i), vt_v3(0.1, 0.2, 1), up, 0.6, 40, 30);
    photo->lens = of[i];
    photo->rotation = camera.rotation;
    photo->translation = camera.translation;
  }
  return photos;
}

// Where a world point falls in a photograph as it was taken. False if it is behind.
static bool place_point(const vt_photo *photo, vt_vec3 point, double pixel[2]) {
  vt_vec3 c = vt_add(vt_mul(&photo->rotation, point), photo->translation);
  if (!(c.z > 0)) return false;
  vt_lens_project(&photo->lens, c.x / c.z, c.y / c.z, pixel);
  return true;
}

static void expect_same_photos(const vt_photos *a, const vt_photos *b) {
  assert_int_equal(a->count, b->count);
  int placed = 0;
  double worst = 0;
  for (int i = 0; i < a->count; i++)
    for (int n = 0; n < 60; n++) {
      vt_vec3 point = vt_v3(4 * sin(n), 4 * cos(2 * n + 1), 1 + 4 * sin(3 * n));
      double pa[2], pb[2];
      bool there = place_point(&a->items[i], point, pa);
      assert_int_equal(there, place_point(&b->items[i], point, pb));
      if (!there) continue;
      placed++;
      worst = fmax(worst, hypot(pa[0] - pb[0], pa[1] - pb[1]));
    }
  assert_true(placed > 50 * a->count);
  if (!(worst < 1e-6)) fail_msg("points move by %g pixels\n", worst);
}

// The photographs of a model, in the order in which they were written.
static vt_photos photos_of_model(place *p, const char *folder, const vt_photos *order) {
  vt_colmap_model model = {0};
  vt_photos photos = {0};
  vt_status status = vt_read_colmap_model(p->context, folder, &model);
  if (status) fail_msg("%s\n", vt_last_error(p->context));
  for (int i = 0; i < order->count; i++)
    for (int k = 0; k < model.count; k++) {
      if (strcmp(model.items[k].name, order->items[i].name + strlen("images/"))) continue;
      vt_photo *photo = vt_add_photo(p->context, &photos, model.items[k].name, "");
      photo->lens = model.items[k].lens;
      photo->rotation = model.items[k].rotation;
      photo->translation = model.items[k].translation;
    }
  vt_free_colmap_model(p->context, &model);
  return photos;
}

static vt_status write_in(place *p, const vt_photos *photos, vt_camera_format format, const char *name) {
  char folder[1024];
  snprintf(folder, sizeof folder, "%s", at(p, name));
  vt_clear_error(p->context);
  return vt_export_photos(p->context, photos, true, format, folder);
}

static void colmap_models_come_back_the_same(void **state) {
  (void)state;
  place p = open_place();
  vt_lens all[LENSES + 1];
  memcpy(all, lenses, sizeof lenses);
  all[LENSES] = rational;
  vt_photos photos = make_photos(&p, all, LENSES + 1);
  for (int binary = 0; binary < 2; binary++) {
    const char *name = binary ? "b/0" : "t/0";
    assert_int_equal(write_in(&p, &photos, binary ? VT_CAMERAS_COLMAP_BINARY : VT_CAMERAS_COLMAP_TEXT, name), VT_OK);
    assert_true(vt_is_file(at(&p, binary ? "b/0/points3D.bin" : "t/0/points3D.txt")));
    vt_photos again = photos_of_model(&p, at(&p, name), &photos);
    expect_same_photos(&photos, &again);
    vt_free_photos(p.context, &again);
    assert_int_equal(write_in(&p, &photos, VT_CAMERAS_COLMAP_TEXT, name), VT_FAILED); // nobody's model is written over
    assert_non_null(strstr(vt_last_error(p.context), "something already"));
  }
  vt_names left = {0};
  assert_int_equal(vt_list_folder(p.context, at(&p, "b"), false, &left), VT_OK);
  assert_int_equal(left.count, 1); // nothing half-written
  vt_free_names(p.context, &left);
  vt_free_photos(p.context, &photos);
  close_place(&p);
}

static void lenses_that_a_format_has_no_place_for_are_refused_by_name(void **state) {
  (void)state;
  place p = open_place();
  vt_photos photos = make_photos(&p, &rational, 1);
  assert_int_equal(write_in(&p, &photos, VT_CAMERAS_TRANSFORMS, "a"), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(p.context), "a.pam"));
  assert_non_null(strstr(vt_last_error(p.context), "write a COLMAP model"));
  assert_false(vt_is_file(at(&p, "a/transforms.json")));
  photos.items[0].lens = eighth;
  assert_int_equal(write_in(&p, &photos, VT_CAMERAS_COLMAP_TEXT, "c"), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(p.context), "a.pam"));
  assert_false(vt_is_folder(at(&p, "c")));
  vt_free_photos(p.context, &photos);
  close_place(&p);
}

static void every_lens_finds_the_ray_of_a_pixel_again(void **state) {
  (void)state;
  vt_lens all[LENSES + 2];
  memcpy(all, lenses, sizeof lenses);
  all[LENSES] = rational;
  all[LENSES + 1] = eighth;
  for (int l = 0; l < LENSES + 2; l++)
    for (int n = 0; n <= 40; n++) {
      double pixel[2] = {n, 30 - 0.75 * n}, ray[2], back[2];
      assert_true(vt_lens_unproject(&all[l], pixel, ray));
      vt_lens_project(&all[l], ray[0], ray[1], back);
      assert_close(back[0], pixel[0], 1e-9);
      assert_close(back[1], pixel[1], 1e-9);
    }
  vt_lens turning = {VT_LENS_OPENCV, 40, 30, 40, 40, 20, 15, {-1}}; // r (1 - r^2) never gets to 0.5
  double far[2] = {40, 15}, ray[2];
  assert_false(vt_lens_unproject(&turning, far, ray));
}

// ---- rigs

static void put_rig_model(place *p, const char *folder, const char *poses, const char *rigs, const char *frames) {
  char name[256];
  snprintf(name, sizeof name, "%s/cameras.txt", folder);
  put_text(p, name, "1 PINHOLE 8 6 10 10 4 3\n2 PINHOLE 8 6 12 12 4 3\n");
  snprintf(name, sizeof name, "%s/images.txt", folder);
  put_text(p, name, poses);
  snprintf(name, sizeof name, "%s/rigs.txt", folder);
  if (rigs) put_text(p, name, rigs);
  snprintf(name, sizeof name, "%s/frames.txt", folder);
  if (frames) put_text(p, name, frames);
}

#define RIGS "# rigs\n1 3 CAMERA 1 CAMERA 2 1 0.7071067811865476 0 0.7071067811865476 0 1 0 0 IMU 1 0\n"
#define FRAMES "# frames\n1 1 2 0 0 0 0.5 0 3 2 CAMERA 1 1 CAMERA 2 2\n2 1 1 0 0 0 0.25 0 3 2 CAMERA 1 3 IMU 1 3\n"
#define POSED "1 1 0 0 0 0.5 0 3 1 a.pam\n\n2 0.7071067811865476 0 0.7071067811865476 0 4 0 -0.5 2 b.pam\n\n3 1 0 0 0 0.25 0 3 1 c.pam\n\n"
#define UNPOSED "1 nan nan nan nan nan nan nan 1 a.pam\n\n2 0 0 0 0 0 0 0 2 b.pam\n\n3 1 0 0 0 0.25 0 3 1 c.pam\n\n"

static void images_without_poses_take_them_from_frames_and_rigs(void **state) {
  (void)state;
  place p = open_place();
  put_rig_model(&p, "plain", POSED, NULL, NULL);
  put_rig_model(&p, "both", POSED, RIGS, FRAMES);
  put_rig_model(&p, "rig", UNPOSED, RIGS, FRAMES);
  vt_colmap_model plain = {0}, other = {0};
  assert_int_equal(vt_read_colmap_model(p.context, at(&p, "plain"), &plain), VT_OK);
  for (int i = 0; i < 2; i++) {
    assert_int_equal(vt_read_colmap_model(p.context, at(&p, i ? "rig" : "both"), &other), VT_OK);
    assert_int_equal(other.count, 3);
    for (int k = 0; k < 3; k++) {
      for (int m = 0; m < 9; m++) assert_close(other.items[k].rotation.m[m], plain.items[k].rotation.m[m], 1e-14);
      assert_close(other.items[k].translation.x, plain.items[k].translation.x, 1e-14);
      assert_close(other.items[k].translation.z, plain.items[k].translation.z, 1e-14);
    }
    vt_free_colmap_model(p.context, &other);
  }
  vt_free_colmap_model(p.context, &plain);
  close_place(&p);
}

static void an_image_that_no_frame_knows_is_not_registered(void **state) {
  (void)state;
  place p = open_place();
  put_rig_model(&p, "m", UNPOSED, RIGS, "1 1 1 0 0 0 0.5 0 3 1 CAMERA 1 1\n");
  vt_colmap_model model = {0};
  assert_int_equal(vt_read_colmap_model(p.context, at(&p, "m"), &model), VT_OK);
  assert_int_equal(model.count, 2);
  assert_string_equal(model.items[1].name, "c.pam");
  vt_free_colmap_model(p.context, &model);
  close_place(&p);
}

static void rigs_that_do_not_help_are_refused_by_name(void **state) {
  (void)state;
  static const struct {
    const char *rigs, *frames, *word;
  } cases[] = {{RIGS, NULL, "images.txt"}, {NULL, NULL, "images.txt"},         {"1 2 CAMERA 1 CAMERA\n", FRAMES, "rigs.txt"},
               {RIGS, "1 1 1 0\n", "frames.txt"}, {RIGS, "1 1 1 0 0 0 0 0 0 9 CAMERA 1 1\n", "frames.txt"},
               {"1 2 CAMERA 1 CAMERA 2 1 0 0 0 0 0 0 0\n", FRAMES, "rigs.txt"}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    place p = open_place();
    vt_colmap_model model = {0};
    put_rig_model(&p, "m", UNPOSED, cases[i].rigs, cases[i].frames);
    assert_int_equal(vt_read_colmap_model(p.context, at(&p, "m"), &model), VT_BAD_INPUT);
    const char *sentence = vt_last_error(p.context);
    if (!strstr(sentence, cases[i].word) || !strchr(sentence, ';')) fail_msg("case %zu: %s\n", i, sentence);
    assert_int_equal(model.count, 0);
    close_place(&p);
  }
}

typedef struct buffer {
  uint8_t bytes[1024];
  size_t size;
} buffer;
static void add(buffer *b, const void *value, size_t size) { // tests run on little-endian machines
  memcpy(b->bytes + b->size, value, size);
  b->size += size;
}
static void add_word(buffer *b, uint32_t value) {
  add(b, &value, 4);
}
static void add_long(buffer *b, uint64_t value) {
  add(b, &value, 8);
}
static void add_pose(buffer *b, double w, double y, double tx, double tz) {
  double q[7] = {w, 0, y, 0, tx, 0, tz};
  add(b, q, sizeof q);
}

// The model of images_without_poses_..., as COLMAP 4 writes it in binary; `cut` bytes short at the end of frames.bin.
static void put_binary_rigs(place *p, size_t cut) {
  buffer cameras = {.size = 0}, images = {.size = 0}, rigs = {.size = 0}, frames = {.size = 0};
  add_long(&cameras, 2);
  for (uint32_t c = 1; c < 3; c++) {
    double parameters[4] = {8 + 2 * c, 8 + 2 * c, 4, 3};
    add_word(&cameras, c), add_word(&cameras, 1), add_long(&cameras, 8), add_long(&cameras, 6);
    add(&cameras, parameters, sizeof parameters);
  }
  add_long(&images, 2);
  for (uint32_t i = 1; i < 3; i++) {
    add_word(&images, i);
    add_pose(&images, NAN, 0, 0, 0);
    add_word(&images, i), add(&images, i == 1 ? "a.pam" : "b.pam", 6), add_long(&images, 0);
  }
  add_long(&rigs, 1);
  add_word(&rigs, 1), add_word(&rigs, 2), add_word(&rigs, 0), add_word(&rigs, 1);
  add_word(&rigs, 0), add_word(&rigs, 2), add(&rigs, "\1", 1), add_pose(&rigs, 1, 1, 1, 0);
  add_long(&frames, 1);
  add_word(&frames, 1), add_word(&frames, 1), add_pose(&frames, 2, 0, 0.5, 3), add_word(&frames, 2);
  for (uint32_t i = 1; i < 3; i++) add_word(&frames, 0), add_word(&frames, i), add_long(&frames, i);
  put_bytes(p, "m/cameras.bin", cameras.bytes, cameras.size);
  put_bytes(p, "m/images.bin", images.bytes, images.size);
  put_bytes(p, "m/rigs.bin", rigs.bytes, rigs.size);
  put_bytes(p, "m/frames.bin", frames.bytes, frames.size - cut);
}

static void binary_rigs_mean_the_same_and_are_refused_when_cut(void **state) {
  (void)state;
  place p = open_place();
  vt_colmap_model model = {0};
  put_binary_rigs(&p, 0);
  assert_int_equal(vt_read_colmap_model(p.context, at(&p, "m"), &model), VT_OK);
  assert_int_equal(model.count, 2);
  assert_close(model.items[0].translation.x, 0.5, 1e-14);
  assert_close(model.items[1].translation.x, 4, 1e-14); // z of the rig becomes x, and 1 is added
  assert_close(model.items[1].translation.z, -0.5, 1e-14);
  vt_free_colmap_model(p.context, &model);
  for (size_t cut = 1; cut < 100; cut++) {
    put_binary_rigs(&p, cut);
    assert_int_equal(vt_read_colmap_model(p.context, at(&p, "m"), &model), VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(p.context), "frames.bin"));
    vt_clear_error(p.context);
  }
  close_place(&p);
}

#ifdef VT_WITH_JANSSON
static void transforms_come_back_the_same_and_name_the_pictures_by_their_way(void **state) {
  (void)state;
  place p = open_place();
  vt_lens all[LENSES + 1];
  memcpy(all, lenses, sizeof lenses);
  all[LENSES] = eighth;
  vt_photos photos = make_photos(&p, all, LENSES + 1), again = {0};
  photos.world = (vt_world){.up = {0, 0, 1}, .metres_per_unit = 0.25, .tree_height = 4.5, .estimated = true};
  assert_int_equal(write_in(&p, &photos, VT_CAMERAS_TRANSFORMS, "x/y"), VT_OK);
  assert_int_equal(vt_read_transforms(p.context, at(&p, "x/y/transforms.json"), VT_TRAIN, &again), VT_OK);
  assert_string_equal(again.items[2].name, "../../images/sub/d.pam");
  expect_same_photos(&photos, &again);
  assert_close(again.world.up.z, 1, 0);
  assert_true(again.world.estimated);
  assert_close(again.world.metres_per_unit, 0.25, 0);
  assert_close(again.world.tree_height, 4.5, 0);
  vt_free_photos(p.context, &again);
  assert_int_equal(write_in(&p, &photos, VT_CAMERAS_TRANSFORMS, "."), VT_OK);
  assert_int_equal(vt_read_transforms(p.context, at(&p, "transforms.json"), VT_TRAIN, &again), VT_OK);
  assert_string_equal(again.items[0].name, "images/a.pam");
  vt_free_photos(p.context, &again);
  vt_free_photos(p.context, &photos);
  close_place(&p);
}

static void a_capture_goes_to_colmap_and_back(void **state) {
  (void)state;
  place p = open_place();
  char source[1024], folder[1024];
  int count = 0;
  vt_photos photos = make_photos(&p, lenses, 1), again = {0};
  assert_int_equal(write_in(&p, &photos, VT_CAMERAS_TRANSFORMS, "."), VT_OK);
  vt_capture_desc desc = vt_default_capture_desc();
  snprintf(source, sizeof source, "%s", at(&p, "transforms.json"));
  snprintf(folder, sizeof folder, "%s", at(&p, "sparse/0"));
  desc.source = source;
  assert_int_equal(vt_convert_cameras(p.context, &desc, VT_CAMERAS_COLMAP_BINARY, folder, &count), VT_OK);
  assert_int_equal(count, 1);
  assert_int_equal(remove(source), 0);
  snprintf(source, sizeof source, "%s", p.root); // now a workspace: images/ and sparse/0
  snprintf(folder, sizeof folder, "%s", at(&p, "back"));
  assert_int_equal(vt_convert_cameras(p.context, &desc, VT_CAMERAS_TRANSFORMS, folder, &count), VT_OK);
  assert_int_equal(vt_read_transforms(p.context, at(&p, "back/transforms.json"), VT_TRAIN, &again), VT_OK);
  expect_same_photos(&photos, &again);
  vt_free_photos(p.context, &again);
  vt_free_photos(p.context, &photos);
  close_place(&p);
}

static void worlds_that_make_no_sense_are_refused(void **state) {
  (void)state;
  static const char *const bad[] = {"\"up\": [0, 0, 0]", "\"up\": [0, \"a\", 1]", "\"up\": 3", "\"metres_per_unit\": -1",
                                    "\"metres_per_unit\": \"1\"", "\"tree_height_metres\": []"};
  for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
    place p = open_place();
    char text[512];
    vt_photos photos = {0};
    put_picture(&p, "a.pam", 8, 6, 4);
    snprintf(text, sizeof text,
             "{%s, \"fl_x\": 9, \"frames\": [{\"file_path\": \"a.pam\", \"transform_matrix\": "
             "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}",
             bad[i]);
    put_text(&p, "transforms.json", text);
    assert_int_equal(vt_read_transforms(p.context, at(&p, "transforms.json"), VT_TRAIN, &photos), VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(p.context), "transforms.json"));
    vt_free_photos(p.context, &photos);
    close_place(&p);
  }
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(colmap_models_come_back_the_same),
      cmocka_unit_test(lenses_that_a_format_has_no_place_for_are_refused_by_name),
      cmocka_unit_test(every_lens_finds_the_ray_of_a_pixel_again),
      cmocka_unit_test(images_without_poses_take_them_from_frames_and_rigs),
      cmocka_unit_test(an_image_that_no_frame_knows_is_not_registered),
      cmocka_unit_test(rigs_that_do_not_help_are_refused_by_name),
      cmocka_unit_test(binary_rigs_mean_the_same_and_are_refused_when_cut),
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(transforms_come_back_the_same_and_name_the_pictures_by_their_way),
      cmocka_unit_test(a_capture_goes_to_colmap_and_back),
      cmocka_unit_test(worlds_that_make_no_sense_are_refused),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
