// test_capture_tracks.c - a calibration's tracks are read, follow their photographs, and find the lens
// SPDX-License-Identifier: BSD-3-Clause
#include "base/adjust_camera.h"
#include "base/least_squares.h"
#include "capture/adjust_lens.h"
#include "capture/keep_lens.h"
#include "capture/photo_tracks.h"
#include "tests/capture_folders.h"
#include "tests/invented_tracks.h"

// ---- reading

typedef struct written { uint8_t bytes[2048]; size_t size; } written;

static void put(written *w, uint64_t value, size_t bytes) {
  for (size_t i = 0; i < bytes; i++) w->bytes[w->size++] = (uint8_t)(value >> (8 * i));
}

static void put_double(written *w, double value) {
  uint64_t bits;
  memcpy(&bits, &value, 8);
  put(w, bits, 8);
}

// Two images of three and two keypoints, three points.
static void put_model(place *p, bool binary) {
  static const double keypoints[2][3][2] = {{{1.5, 2.25}, {30, 40}, {7, 8}}, {{100.5, 3}, {11, 12}}};
  static const int counts[2] = {3, 2};
  if (!binary) {
    put_text(p, "m/images.txt", "# text\n7 1 0 0 0 0 0 1 1 a.jpg\n1.5 2.25 1 30 40 -1 7 8 2\n9 1 0 0 0 0 0 1 1 b.jpg\n100.5 3 1 11 12 2\n");
    put_text(p, "m/points3D.txt", "1 0.1 0.2 0.3 9 9 9 0.5 7 0 9 0\n2 1 2 3 9 9 9 0.7 7 2 9 1 7 1\n3 4 5 6 9 9 9 0.7 7 99 9 1 5 0\n");
    return;
  }
  written images = {.size = 0}, points = {.size = 0};
  put(&images, 2, 8);
  for (int i = 0; i < 2; i++) {
    put(&images, i ? 9 : 7, 4), put_double(&images, 1);
    for (int k = 0; k < 6; k++) put_double(&images, k == 5);
    put(&images, 1, 4);
    for (const char *c = i ? "b.jpg" : "a.jpg"; *c; c++) put(&images, (uint8_t)*c, 1);
    put(&images, 0, 1), put(&images, (uint64_t)counts[i], 8);
    for (int k = 0; k < counts[i]; k++) put_double(&images, keypoints[i][k][0]), put_double(&images, keypoints[i][k][1]), put(&images, 1, 8);
  }
  static const int tracks[3][6] = {{7, 0, 9, 0, -1, -1}, {7, 2, 9, 1, 7, 1}, {7, 99, 9, 1, 5, 0}};
  put(&points, 3, 8);
  for (int k = 0; k < 3; k++) {
    put(&points, (uint64_t)k, 8);
    for (int c = 0; c < 3; c++) put_double(&points, k + c);
    put(&points, 0, 3), put_double(&points, 0.5), put(&points, k ? 3 : 2, 8);
    for (int i = 0; i < (k ? 6 : 4); i++) put(&points, (uint64_t)tracks[k][i], 4);
  }
  put_bytes(p, "m/images.bin", images.bytes, images.size);
  put_bytes(p, "m/points3D.bin", points.bytes, points.size);
}

static void points_know_their_pixels_in_text_and_in_binary(void **state) {
  (void)state;
  place p = open_place();
  static const char *const names[] = {"a.jpg", "b.jpg"};
  for (int binary = 0; binary < 2; binary++) {
    vt_landmarks l;
    put_model(&p, binary);
    assert_int_equal(vt_read_landmarks(p.context, at(&p, "m"), binary, names, 2, &l), VT_OK);
    assert_int_equal(l.count, 3);
    assert_int_equal(l.seen_count, 6); // the second keypoint of a.jpg on point 2 and an unknown image do not count
    static const float pixels[6][2] = {{1.5f, 2.25f}, {100.5f, 3}, {7, 8}, {11, 12}, {NAN, NAN}, {11, 12}};
    for (int k = 0; k < 6; k++) {
      assert_int_equal(l.seen_by[k], k % 2);
      for (int c = 0; c < 2; c++) assert_true(k == 4 ? isnan(l.pixels[k][c]) : l.pixels[k][c] == pixels[k][c]);
    }
    vt_free_landmarks(p.context, &l);
  }
  close_place(&p);
}

static void photographs_that_are_left_out_take_their_sights_along(void **state) {
  (void)state;
  vt_landmark items[2] = {{{0, 0, 0}, 1, 0, 3}, {{1, 1, 1}, 1, 3, 2}};
  int seen_by[5] = {0, 1, 2, 1, 2}, new_place[3] = {0, -1, 1};
  float pixels[5][2] = {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}};
  vt_landmarks l = {2, 5, items, seen_by, pixels};
  vt_renumber_landmarks(&l, new_place);
  assert_int_equal(l.seen_count, 3);
  assert_int_equal(items[0].count, 2);
  assert_int_equal(items[1].first, 2);
  assert_int_equal(items[1].count, 1);
  static const int by[3] = {0, 1, 1}, pixel[3] = {0, 2, 4};
  for (int k = 0; k < 3; k++) {
    assert_int_equal(seen_by[k], by[k]);
    assert_true(pixels[k][0] == pixel[k]);
  }
}

// ---- the lens

enum { CAMERAS = 20, SIZE = 1200 };

// Photographs bent by true_k1 whose calibration believes in k1, with the tracks as landmarks; poses and focal length a little off.
static vt_photos take_photos(vt_context *context, vt_lens_model model, double k1, double true_k1, double noise, int points, vt_camera *truth) {
  vt_photos out = {0};
  put_cameras(CAMERAS, SIZE, truth);
  vt_tracks tracks = invent_tracks(context, truth, CAMERAS, points, noise, 0.02, true_k1);
  vt_rng rng = vt_seed_rng(4, 4);
  for (int i = 0; i < CAMERAS; i++) {
    double pose[6];
    for (int k = 0; k < 6; k++) pose[k] = 0.001 * normal_number(&rng);
    vt_camera c = vt_adjust_camera(&truth[i], pose, 0.002, 3);
    vt_photo *photo = vt_add_photo(context, &out, "x", "x");
    assert_non_null(photo);
    photo->lens = (vt_lens){model, SIZE, SIZE, c.fx, c.fy, c.cx, c.cy, {k1}};
    photo->rotation = c.rotation, photo->translation = c.translation;
  }
  vt_landmarks *l = &out.landmarks;
  *l = (vt_landmarks){tracks.count, tracks.sight_count, VT_NEW(context, vt_landmark, tracks.count),
                      VT_NEW(context, int, tracks.sight_count), vt_alloc(context, tracks.sight_count, sizeof *l->pixels)};
  assert_true(l->items && l->seen_by && l->pixels);
  for (size_t k = 0; k < tracks.count; k++)
    l->items[k] = (vt_landmark){tracks.items[k].place, (float)noise, tracks.items[k].first, tracks.items[k].count};
  for (size_t k = 0; k < tracks.sight_count; k++) {
    l->seen_by[k] = tracks.sights[k].view;
    for (int c = 0; c < 2; c++) l->pixels[k][c] = tracks.sights[k].pixel[c];
  }
  vt_free_tracks(context, &tracks);
  return out;
}

static void need_ceres(void) {
  if (!vt_can_solve_least_squares()) skip();
}

static void find_lens(double wrong) {
  place p = open_place();
  vt_camera truth[CAMERAS];
  vt_lens_report report;
  double true_k1 = -0.05;
  vt_photos photos = take_photos(p.context, VT_LENS_OPENCV, true_k1 + wrong, true_k1, 0.2, 1000, truth);
  assert_int_equal(vt_adjust_lenses(p.context, &photos, &report), VT_OK);
  const vt_lens *lens = &photos.items[0].lens;
  printf("k1 off by %.4f -> %.4f, focal length by %.5f, points held back by %.4f -> %.4f deviations: %s\n", wrong,
         lens->k[0] - true_k1, lens->fx / truth[0].fx - 1, report.before, report.after, report.why);
  assert_true(report.tried && report.kept && report.after < report.before);
  assert_true(fabs(lens->k[0] - true_k1) < 0.003 && fabs(lens->fx / truth[0].fx - 1) < 0.001);
  for (int i = 1; i < CAMERAS; i++) assert_memory_equal(&photos.items[i].lens, lens, sizeof *lens); // one lens for all
  size_t known = 0;
  for (size_t k = 0; k < photos.landmarks.count; k++) known += isfinite(photos.landmarks.items[k].position.x) != 0;
  assert_true(known > photos.landmarks.count / 2); // landmarks have moved with it
  vt_free_photos(p.context, &photos);
  close_place(&p);
}

// Both ways: straightening stretches errors where it takes a barrel out, and shrinks them where it puts one in.
static void a_wrong_distortion_comes_back_whatever_its_sign(void **state) {
  (void)state;
  need_ceres();
  find_lens(0.02);
  find_lens(-0.02);
}

static void any_number_of_threads_gives_the_same_lens(void **state) {
  (void)state;
  need_ceres();
  static const int thread_counts[] = {1, 7};
  vt_lens lens[2];
  vt_mat3 rotation[2];
  for (int t = 0; t < 2; t++) {
    vt_context_desc desc = vt_default_context_desc();
    desc.thread_count = thread_counts[t], desc.log_level = VT_LOG_QUIET;
    vt_context *context = vt_create_context(&desc);
    vt_camera truth[CAMERAS];
    vt_lens_report report;
    vt_photos photos = take_photos(context, VT_LENS_OPENCV, 0.1, 0, 0.2, 400, truth);
    assert_int_equal(vt_adjust_lenses(context, &photos, &report), VT_OK);
    assert_true(report.kept);
    lens[t] = photos.items[0].lens, rotation[t] = photos.items[7].rotation;
    vt_free_photos(context, &photos);
    vt_destroy_context(context);
  }
  assert_memory_equal(&lens[0], &lens[1], sizeof lens[0]);
  assert_memory_equal(&rotation[0], &rotation[1], sizeof rotation[0]);
}

static void a_kept_lens_is_the_same_to_the_last_bit_and_a_damaged_one_is_made_again(void **state) {
  (void)state;
  need_ceres();
  place p = open_place();
  char cache[900];
  vt_lens lens[4];
  vt_camera truth[CAMERAS];
  vt_vec3 point[4];
  snprintf(cache, sizeof cache, "%.880s", at(&p, "cache"));
  for (int run = 0; run < 4; run++) { // looked at only; made; taken; damaged and made again
    vt_lens_report report;
    vt_photos photos = take_photos(p.context, VT_LENS_OPENCV, 0.1, 0, 0.2, 400, truth);
    assert_int_equal(vt_adjust_lenses_or_take(p.context, cache, run > 0, &photos, &report), VT_OK);
    assert_true(report.kept && report.sight_count > 600 && report.after < report.before);
    assert_true((strstr(report.why, "before") != NULL) == (run == 2));
    assert_true(vt_is_folder(cache) == (run > 0));
    lens[run] = photos.items[0].lens;
    for (size_t k = 0; k < photos.landmarks.count; k++)
      if (isfinite(photos.landmarks.items[k].position.x)) point[run] = photos.landmarks.items[k].position;
    assert_memory_equal(&lens[run], &lens[0], sizeof lens[0]);
    assert_memory_equal(&point[run], &point[0], sizeof point[0]);
    vt_free_photos(p.context, &photos);
    vt_names names = {0};
    if (run == 2) {
      assert_int_equal(vt_list_folder(p.context, cache, true, &names), VT_OK);
      assert_int_equal(names.count, 1);
      char name[100];
      snprintf(name, sizeof name, "cache/%.80s", names.items[0]);
      put_text(&p, name, "vtlens1");
      vt_free_names(p.context, &names);
    }
  }
  close_place(&p);
}

static void a_lens_that_is_right_or_none_stays_bit_for_bit(void **state) {
  (void)state;
  place p = open_place();
  for (int trial = 0; trial < 4; trial++) { // right; pinhole pictures; points without pixels; hardly any points
    vt_camera truth[CAMERAS];
    vt_lens_report report;
    vt_photos photos = take_photos(p.context, trial == 1 ? VT_LENS_PINHOLE : VT_LENS_OPENCV, trial == 1 ? 0 : 0.02, trial == 1 ? 0.03 : 0.02, 0.5, 700,
                                   truth);
    if (trial == 2) vt_free(p.context, photos.landmarks.pixels), photos.landmarks.pixels = NULL;
    if (trial == 3) photos.landmarks.count = 10;
    vt_lens lenses[CAMERAS];
    vt_mat3 rotations[CAMERAS];
    for (int i = 0; i < CAMERAS; i++) lenses[i] = photos.items[i].lens, rotations[i] = photos.items[i].rotation;
    assert_int_equal(vt_adjust_lenses(p.context, &photos, &report), VT_OK);
    assert_false(report.kept);
    assert_non_null(report.why);
    for (int i = 0; i < CAMERAS; i++) {
      assert_memory_equal(&photos.items[i].lens, &lenses[i], sizeof lenses[i]);
      assert_memory_equal(&photos.items[i].rotation, &rotations[i], sizeof rotations[i]);
    }
    vt_free_photos(p.context, &photos);
  }
  close_place(&p);
}

static void landmarks_of_any_kind_harm_nothing(void **state) {
  (void)state;
  place p = open_place();
  for (int trial = 0; trial < 3; trial++) {
    vt_camera truth[CAMERAS];
    vt_lens_report report;
    vt_photos photos = take_photos(p.context, VT_LENS_OPENCV, 0.02, 0.02, 0.5, 400, truth);
    for (size_t k = 0; k < photos.landmarks.seen_count; k++) {
      if (trial == 0) photos.landmarks.pixels[k][k % 2] = NAN;
      if (trial == 1) photos.landmarks.pixels[k][0] = 1e30f;
      if (trial == 2) photos.landmarks.seen_by[k] = 3;
    }
    assert_int_equal(vt_adjust_lenses(p.context, &photos, &report), VT_OK);
    assert_false(report.kept);
    vt_free_photos(p.context, &photos);
  }
  close_place(&p);
}

static void tracks_fall_where_the_straightened_picture_shows_them(void **state) {
  (void)state;
  place p = open_place();
  vt_camera truth[CAMERAS], reduced[CAMERAS];
  vt_photos photos = take_photos(p.context, VT_LENS_OPENCV, 0.05, 0.05, 0.5, 700, truth);
  for (int i = 0; i < CAMERAS; i++) reduced[i] = vt_resize_camera(&truth[i], SIZE / 3, SIZE / 3);
  vt_tracks tracks;
  assert_int_equal(vt_photo_tracks(p.context, &photos, reduced, &tracks), VT_OK);
  assert_int_equal(tracks.sight_count, photos.landmarks.seen_count);
  size_t good = 0, all = 0;
  for (size_t k = 0; k < tracks.count; k++) {
    double error;
    vt_vec3 point = tracks.items[k].place;
    if (tracks.items[k].count < 3) continue;
    all++;
    if (vt_settle_track(reduced, tracks.sights + tracks.items[k].first, tracks.items[k].count, &point, &error)) good += error < 2.5;
  }
  assert_true(all > 200 && good > 0.8 * all); // some per cent have an outlier among their sights
  assert_close(tracks.sights[0].deviation, 0.5 / 3, 1e-3); // known as surely as a reduced picture can show it
  vt_free_tracks(p.context, &tracks);
  vt_free_photos(p.context, &photos);
  close_place(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(points_know_their_pixels_in_text_and_in_binary),
                                     cmocka_unit_test(photographs_that_are_left_out_take_their_sights_along),
                                     cmocka_unit_test(a_wrong_distortion_comes_back_whatever_its_sign),
                                     cmocka_unit_test(any_number_of_threads_gives_the_same_lens),
                                     cmocka_unit_test(a_kept_lens_is_the_same_to_the_last_bit_and_a_damaged_one_is_made_again),
                                     cmocka_unit_test(a_lens_that_is_right_or_none_stays_bit_for_bit),
                                     cmocka_unit_test(landmarks_of_any_kind_harm_nothing),
                                     cmocka_unit_test(tracks_fall_where_the_straightened_picture_shows_them)};
  only_threads_for_the_thread_sanitizer();
  return cmocka_run_group_tests(tests, NULL, NULL);
}
