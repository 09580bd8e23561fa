// test_capture_clutter.c - the tree told from clutter: alone, with strokes, and what is said where that cannot be
// SPDX-License-Identifier: BSD-3-Clause
#include "base/camera.h"
#include "capture/scribbles.h"
#include "tests/clutter_scene.h"

typedef struct error {
  double rmse, overlap; // of alpha over all photographs; area in both over area in one of them, at alpha 1/2
} error;

// Photographs that the user drew on are no proof.
static error judge(place *p, const scene *s, const vt_clutter *clutter, const bool *left_out) {
  double sum = 0, both = 0, either = 0, count = 0;
  for (int v = 0; v < s->view_count; v++) {
    vt_image rgba = {0};
    if (left_out && left_out[v]) continue;
    assert_int_equal(vt_matte_clutter(p->context, clutter, v, &s->pictures[v], &rgba), VT_OK);
    assert_int_equal(rgba.channels, 4);
    for (size_t i = 0; i < SCENE_WIDTH * SCENE_HEIGHT; i++) {
      double alpha = rgba.pixels[4 * i + 3] / 255.0, truth = (double)s->truth[v][i];
      sum += (alpha - truth) * (alpha - truth);
      both += alpha > 0.5 && truth > 0.5;
      either += alpha > 0.5 || truth > 0.5;
      count++;
    }
    vt_free_image(p->context, &rgba);
  }
  return (error){sqrt(sum / count), both / either};
}

static error separate(place *p, const scene *s, bool landmarks, const char *scribbles, const bool *left_out) {
  vt_photos photos = scene_photos(p, s, landmarks);
  vt_clutter clutter = {0};
  vt_status status = vt_separate_clutter(p->context, &photos, scribbles, &clutter);
  if (status) fail_msg("%s\n", vt_last_error(p->context));
  error e = judge(p, s, &clutter, left_out);
  vt_free_clutter(p->context, &clutter);
  vt_free_photos(p->context, &photos);
  return e;
}

static void tree_is_found_before_ground_wall_and_stones(void **state) {
  (void)state;
  place p = open_place();
  scene *s = make_scene(&p, 6, 3.0, 1.5, false);
  error e = separate(&p, s, true, NULL, NULL);
  printf("alone: alpha RMSE %.3f, overlap %.3f\n", e.rmse, e.overlap);
  assert_true(e.rmse < 0.12 && e.overlap > 0.88);
  free_scene(&p, s);
  close_place(&p);
}

static void tree_is_found_by_cameras_that_look_in_one_direction(void **state) {
  (void)state;
  place p = open_place();
  scene *s = make_scene(&p, 5, 3.0, 1.5, true);
  error e = separate(&p, s, true, NULL, NULL);
  printf("parallel: alpha RMSE %.3f, overlap %.3f\n", e.rmse, e.overlap);
  assert_true(e.rmse < 0.22 && e.overlap > 0.75);
  free_scene(&p, s);
  close_place(&p);
}

static void strokes_on_three_photographs_part_the_tree_from_its_neighbour_in_the_others(void **state) {
  (void)state;
  place p = open_place();
  scene *s = make_scene(&p, 7, 1.5, 0.3, false);
  bool drawn[SCENE_MOST_VIEWS] = {[1] = true, [3] = true, [5] = true};
  char folder[1024];
  for (int v = 0; v < s->view_count; v++)
    if (drawn[v]) scene_draw_strokes(&p, s, v);
  snprintf(folder, sizeof folder, "%s", at(&p, "strokes"));
  error alone = separate(&p, s, true, NULL, drawn), with = separate(&p, s, true, folder, drawn);
  printf("neighbour: alone %.3f %.3f, with strokes %.3f %.3f\n", alone.rmse, alone.overlap, with.rmse, with.overlap);
  assert_true(with.rmse < 0.13 && with.overlap > 0.85 && with.rmse < 0.7 * alone.rmse);
  free_scene(&p, s);
  close_place(&p);
}

static void strokes_are_enough_where_there_are_no_landmarks(void **state) {
  (void)state;
  place p = open_place();
  scene *s = make_scene(&p, 5, 3.0, 1.5, false);
  bool drawn[SCENE_MOST_VIEWS] = {[0] = true, [2] = true, [4] = true};
  char folder[1024];
  for (int v = 0; v < s->view_count; v++)
    if (drawn[v]) scene_draw_strokes(&p, s, v);
  snprintf(folder, sizeof folder, "%s", at(&p, "strokes"));
  error e = separate(&p, s, false, folder, drawn);
  printf("no landmarks: alpha RMSE %.3f, overlap %.3f\n", e.rmse, e.overlap);
  assert_true(e.rmse < 0.22 && e.overlap > 0.75);
  free_scene(&p, s);
  close_place(&p);
}

static void users_word_is_kept_where_it_was_given(void **state) {
  (void)state;
  place p = open_place();
  scene *s = make_scene(&p, 3, 3.0, 1.5, false);
  vt_image mask = {0};
  assert_int_equal(vt_make_image(p.context, SCENE_WIDTH, SCENE_HEIGHT, 1, &mask), VT_OK);
  for (int y = 0; y < SCENE_HEIGHT; y++) // against all evidence: the right half is the tree
    for (int x = SCENE_WIDTH / 2; x < SCENE_WIDTH; x++) mask.pixels[y * SCENE_WIDTH + x] = 255;
  put_image(&p, "strokes/photo_02.pam", &mask);
  char folder[1024];
  snprintf(folder, sizeof folder, "%s", at(&p, "strokes"));
  vt_photos photos = scene_photos(&p, s, true);
  vt_clutter clutter = {0};
  vt_image rgba = {0};
  assert_int_equal(vt_separate_clutter(p.context, &photos, folder, &clutter), VT_OK);
  assert_int_equal(vt_matte_clutter(p.context, &clutter, 2, &s->pictures[2], &rgba), VT_OK);
  for (int y = 0; y < SCENE_HEIGHT; y++)
    for (int x = 0; x < SCENE_WIDTH; x++)
      if (x < SCENE_WIDTH / 2 - 2 || x >= SCENE_WIDTH / 2 + 2)
        assert_int_equal(rgba.pixels[(y * SCENE_WIDTH + x) * 4 + 3], mask.pixels[y * SCENE_WIDTH + x]);
  vt_free_image(p.context, &rgba);
  vt_free_image(p.context, &mask);
  vt_free_clutter(p.context, &clutter);
  vt_free_photos(p.context, &photos);
  free_scene(&p, s);
  close_place(&p);
}

static void number_of_threads_changes_no_bit_of_the_mattes(void **state) {
  (void)state;
  static const int thread_counts[] = {1, 3};
  place p = open_place();
  scene *s = make_scene(&p, 3, 3.0, 1.5, false);
  vt_photos photos = scene_photos(&p, s, true);
  uint8_t *first = VT_NEW(p.context, uint8_t, 3 * SCENE_WIDTH * SCENE_HEIGHT);
  for (int t = 0; t < 2; t++) {
    vt_context_desc desc = vt_default_context_desc();
    desc.thread_count = thread_counts[t];
    desc.log_level = VT_LOG_QUIET;
    vt_context *context = vt_create_context(&desc);
    vt_clutter clutter = {0};
    assert_int_equal(vt_separate_clutter(context, &photos, NULL, &clutter), VT_OK);
    for (int v = 0; v < 3; v++) {
      uint8_t *kept = first + v * SCENE_WIDTH * SCENE_HEIGHT;
      if (t) assert_memory_equal(kept, clutter.photos[v].tree, SCENE_WIDTH * SCENE_HEIGHT);
      memcpy(kept, clutter.photos[v].tree, SCENE_WIDTH * SCENE_HEIGHT);
    }
    vt_free_clutter(context, &clutter);
    vt_destroy_context(context);
  }
  vt_free(p.context, first);
  vt_free_photos(p.context, &photos);
  free_scene(&p, s);
  close_place(&p);
}

// The scene as a COLMAP workspace.
static void put_workspace(place *p, const scene *s, const vt_landmarks *landmarks) {
  size_t room = landmarks->count * 60 + landmarks->seen_count * 10 + 1;
  char *text = VT_NEW(p->context, char, room), *end = text, images[4096], *at_end = images, camera[128];
  const vt_camera *c = &s->cameras[0];
  snprintf(camera, sizeof camera, "1 PINHOLE %d %d %.9g %.9g %.9g %.9g\n", c->width, c->height, c->fx, c->fy, c->cx,
           c->cy);
  put_text(p, "sparse/0/cameras.txt", camera);
  for (int v = 0; v < s->view_count; v++) {
    const double *m = s->cameras[v].rotation.m;
    vt_vec3 t = s->cameras[v].translation;
    double w = sqrt(fmax(0, 1 + m[0] + m[4] + m[8])) /
               2; // the cameras stand upright and look away from the viewer's side: w > 0
    assert_true(w > 0.1);
    at_end += sprintf(at_end, "%d %.12g %.12g %.12g %.12g %.12g %.12g %.12g 1 photo_%02d.pam\n\n", v + 1, w,
                      (m[7] - m[5]) / (4 * w), (m[2] - m[6]) / (4 * w), (m[3] - m[1]) / (4 * w), t.x, t.y, t.z, v);
  }
  put_text(p, "sparse/0/images.txt", images);
  for (size_t k = 0; k < landmarks->count; k++) {
    const vt_landmark *l = &landmarks->items[k];
    end += sprintf(end, "%zu %.6f %.6f %.6f 0 0 0 0.5", k + 1, l->position.x, l->position.y, l->position.z);
    for (uint32_t i = 0; i < l->count; i++) end += sprintf(end, " %d 0", landmarks->seen_by[l->first + i] + 1);
    end += sprintf(end, "\n");
  }
  assert_true((size_t)(end - text) < room);
  put_text(p, "sparse/0/points3D.txt", text);
  vt_free(p->context, text);
}

static void clutter_is_recognised_and_a_folder_of_strokes_asks_for_it(void **state) {
  (void)state;
  place p = open_place();
  scene *s = make_scene(&p, 3, 3.0, 1.5, false);
  vt_photos photos = scene_photos(&p, s, true);
  vt_capture_report report = {0};
  char folder[1024], source[1024];
  put_workspace(&p, s, &photos.landmarks);
  scene_draw_strokes(&p, s, 1);
  snprintf(folder, sizeof folder, "%s", at(&p, "strokes"));
  snprintf(source, sizeof source, "%s", p.root);
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = source;
  desc.scribbles = folder;
  vt_views views = load(&p, &desc, &report);
  assert_int_equal(report.matte, VT_MATTE_CLUTTER);
  assert_int_equal(views.count, 3);
  double both = 0, either = 0;
  for (int v = 0; v < 3; v++)
    for (size_t i = 0; i < SCENE_WIDTH * SCENE_HEIGHT; i++) {
      bool mine = views.items[v].picture.pixels[4 * i + 3] > 127, truth = s->truth[v][i] > 0.5f;
      both += mine && truth, either += mine || truth;
    }
  assert_true(both > 0.8 * either);
  vt_free_views(p.context, &views);
  vt_free_capture_report(p.context, &report);
  desc.scribbles = NULL;
  views = load(&p, &desc, &report);
  assert_int_equal(report.matte, VT_MATTE_CLUTTER);
  vt_free_views(p.context, &views);
  vt_free_capture_report(p.context, &report);
  vt_free_photos(p.context, &photos);
  free_scene(&p, s);
  close_place(&p);
}

// ---- bad input

static void expect_refused(place *p, const vt_photos *photos, const char *folder, const char *file, const char *cure) {
  vt_clutter clutter = {0};
  assert_int_equal(vt_separate_clutter(p->context, photos, folder, &clutter), VT_BAD_INPUT);
  if (!strstr(vt_last_error(p->context), file) || !strstr(vt_last_error(p->context), cure))
    fail_msg("\"%s\" does not say %s and %s\n", vt_last_error(p->context), file, cure);
  vt_clear_error(p->context);
}

static void strokes_that_cannot_be_used_are_refused_with_the_cure(void **state) {
  (void)state;
  place p = open_place();
  scene *s = make_scene(&p, 3, 3.0, 1.5, false);
  vt_photos photos = scene_photos(&p, s, true);
  char folder[1024];
  snprintf(folder, sizeof folder, "%s", at(&p, "nowhere"));
  expect_refused(&p, &photos, folder, "nowhere", "check the path");
  put_picture(&p, "strange/other.pam", 40, 30, 4);
  snprintf(folder, sizeof folder, "%s", at(&p, "strange"));
  expect_refused(&p, &photos, folder, "strange", "photo_00");
  put_picture(&p, "shape/photo_01.pam", 240, 320, 4);
  snprintf(folder, sizeof folder, "%s", at(&p, "shape"));
  expect_refused(&p, &photos, folder, "photo_01.pam", "without turning or cutting");
  vt_image blank = {0};
  assert_int_equal(vt_make_image(p.context, SCENE_WIDTH, SCENE_HEIGHT, 4, &blank), VT_OK);
  put_image(&p, "blank/photo_02.pam", &blank);
  snprintf(folder, sizeof folder, "%s", at(&p, "blank"));
  expect_refused(&p, &photos, folder, "photo_02.pam", "green or white");
  put_image(&p, "twice/photo_02.pam", &blank);
  put_image(&p, "twice/photo_02_scribble.pam", &blank);
  snprintf(folder, sizeof folder, "%s", at(&p, "twice"));
  expect_refused(&p, &photos, folder, "photo_02_scribble.pam", "keep one");
  vt_free_image(p.context, &blank);
  vt_free_photos(p.context, &photos);
  free_scene(&p, s);
  close_place(&p);
}

static void strokes_of_one_kind_or_another_size_are_used(void **state) {
  (void)state;
  place p = open_place();
  scene *s = make_scene(&p, 3, 3.0, 1.5, false);
  vt_photos photos = scene_photos(&p, s, true);
  vt_image half = {0};
  vt_clutter clutter = {0};
  char folder[1024];
  assert_int_equal(vt_make_image(p.context, SCENE_WIDTH / 2, SCENE_HEIGHT / 2, 4, &half), VT_OK);
  for (int x = 60; x < 100; x++)
    for (int y = 50; y < 53; y++) memset(half.pixels + ((size_t)y * (SCENE_WIDTH / 2) + (size_t)x) * 4, 255, 4);
  put_image(&p, "half/photo_01.pam", &half);
  snprintf(folder, sizeof folder, "%s", at(&p, "half"));
  assert_int_equal(vt_separate_clutter(p.context, &photos, folder, &clutter), VT_OK);
  assert_null(clutter.photos[0].said);
  assert_non_null(clutter.photos[1].said);
  assert_int_equal(clutter.photos[1].said[101 * SCENE_WIDTH + 150], VT_SAID_TREE);
  assert_int_equal(clutter.photos[1].said[95 * SCENE_WIDTH + 150], VT_SAID_NOTHING);
  vt_free_clutter(p.context, &clutter);
  vt_free_image(p.context, &half);
  vt_free_photos(p.context, &photos);
  free_scene(&p, s);
  close_place(&p);
}

static void paint_on_the_photograph_counts_and_its_own_colours_do_not(void **state) {
  (void)state;
  place p = open_place();
  uint8_t said[40 * 30] = {0};
  size_t tree = 0, rest = 0;
  vt_photo photo = {.width = 40, .height = 30};
  vt_image picture = {0};
  assert_int_equal(vt_make_image(p.context, 40, 30, 3, &picture), VT_OK);
  for (int i = 0; i < 40 * 30; i++) // leaves and bark
    for (int c = 0; c < 3; c++) picture.pixels[3 * i + c] = (uint8_t)((c == 1 && i % 3 ? 120 : 60) + i % 50);
  for (int x = 5; x < 15; x++) {
    static const uint8_t green[3] = {0, 255, 0}, red[3] = {255, 0, 0};
    memcpy(picture.pixels + (10 * 40 + x) * 3, green, 3);
    memcpy(picture.pixels + (20 * 40 + x) * 3, red, 3);
  }
  put_image(&p, "a.pam", &picture);
  assert_int_equal(vt_read_scribble(p.context, at(&p, "a.pam"), &photo, 40, 30, said, &tree, &rest), VT_OK);
  assert_int_equal(tree, 10);
  assert_int_equal(rest, 10);
  assert_int_equal(said[10 * 40 + 7], VT_SAID_TREE);
  assert_int_equal(said[20 * 40 + 7], VT_SAID_REST);
  vt_free_image(p.context, &picture);
  close_place(&p);
}

static void parallel_cameras_without_landmarks_are_refused_with_the_cure(void **state) {
  (void)state;
  place p = open_place();
  scene *s = make_scene(&p, 3, 3.0, 1.5, true);
  vt_photos photos = scene_photos(&p, s, false);
  expect_refused(&p, &photos, NULL, "one direction", "--masks");
  vt_free_photos(p.context, &photos);
  free_scene(&p, s);
  close_place(&p);
}

// ---- landmarks

static void landmarks_are_read_with_the_photographs_that_see_them(void **state) {
  (void)state;
  static const char *const names[] = {"a.jpg", "b.jpg", "c.jpg"};
  place p = open_place();
  vt_landmarks landmarks = {0};
  put_text(&p, "model/images.txt",
           "# images\n7 1 0 0 0 0 0 0 1 c.jpg\n\n2 1 0 0 0 0 0 0 1 a.jpg\n1 2 3\n9 1 0 0 0 0 0 0 1 lost.jpg\n\n");
  put_text(
      &p, "model/points3D.txt",
      "# points\n1 1 2 3 9 9 9 0.5 7 0 2 4 7 1\n2 4 5 6 9 9 9 0.25 9 0\n3 nan 0 0 9 9 9 1 2 0\n4 7 8 9 1 1 1 2 2 0\n");
  assert_int_equal(vt_read_landmarks(p.context, at(&p, "model"), false, names, 3, &landmarks), VT_OK);
  assert_int_equal(landmarks.count, 3);
  assert_close(landmarks.items[0].position.y, 2, 0);
  assert_int_equal(landmarks.items[0].count, 2);
  assert_int_equal(landmarks.seen_by[landmarks.items[0].first], 2);
  assert_int_equal(landmarks.seen_by[landmarks.items[0].first + 1], 0);
  assert_int_equal(landmarks.items[1].count, 0);
  assert_close(landmarks.items[2].error, 2, 0);
  assert_int_equal(landmarks.seen_by[landmarks.items[2].first], 0);
  vt_free_landmarks(p.context, &landmarks);
  put_text(&p, "bad/images.txt", "7 1 0 0 0 0 0 0 1 c.jpg\n\n");
  put_text(&p, "bad/points3D.txt", "1 1 2 3 9 9 9 0.5 7\n");
  assert_int_equal(vt_read_landmarks(p.context, at(&p, "bad"), false, names, 3, &landmarks), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(p.context), "points3D.txt"));
  vt_clear_error(p.context);
  close_place(&p);
}

int main(void) {
  only_threads_for_the_thread_sanitizer();
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(tree_is_found_before_ground_wall_and_stones),
      cmocka_unit_test(tree_is_found_by_cameras_that_look_in_one_direction),
      cmocka_unit_test(strokes_on_three_photographs_part_the_tree_from_its_neighbour_in_the_others),
      cmocka_unit_test(strokes_are_enough_where_there_are_no_landmarks),
      cmocka_unit_test(clutter_is_recognised_and_a_folder_of_strokes_asks_for_it),
      cmocka_unit_test(users_word_is_kept_where_it_was_given),
      cmocka_unit_test(number_of_threads_changes_no_bit_of_the_mattes),
      cmocka_unit_test(strokes_that_cannot_be_used_are_refused_with_the_cure),
      cmocka_unit_test(strokes_of_one_kind_or_another_size_are_used),
      cmocka_unit_test(paint_on_the_photograph_counts_and_its_own_colours_do_not),
      cmocka_unit_test(parallel_cameras_without_landmarks_are_refused_with_the_cure),
      cmocka_unit_test(landmarks_are_read_with_the_photographs_that_see_them),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
