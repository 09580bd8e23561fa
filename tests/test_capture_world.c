// test_capture_world.c - up from how cameras are held, and the scale from marks and markers of known size
// SPDX-License-Identifier: BSD-3-Clause

#include "base/rng.h"
#include "capture/vision.h"
#include "capture/world.h"
#include "tests/capture_folders.h"

enum { WIDTH = 400, HEIGHT = 300 };

static double normal(vt_rng *rng) {
  double sum = 0;
  for (int i = 0; i < 12; i++) sum += vt_random(rng) / 4294967296.0;
  return sum - 6;
}

// A world whose up is not an axis: what stands upright in the rig's own z is turned by this.
static const vt_vec3 side = {0.48, 0.6, 0.64}, front = {-0.8, 0.6, 0}, up = {-0.384, -0.512, 0.768};
static vt_vec3 turned(double x, double y, double z) {
  return vt_add(vt_add(vt_scale(side, x), vt_scale(front, y)), vt_scale(up, z));
}

// `count` photographs over `arc` radians at the distance 5; heights and rolls as said, in radians and units.
typedef struct rig {
  int count;
  double arc, height, height_noise, roll_noise, distance_noise, pitch_noise;
} rig;

static vt_photos stand(place *p, const rig *r, const vt_lens *lens) {
  vt_photos photos = {0};
  vt_rng rng = vt_seed_rng(7, 1);
  vt_vec3 real_up = vt_normalise(vt_cross(side, front));
  for (int i = 0; i < r->count; i++) {
    char name[32];
    snprintf(name, sizeof name, "images/%02d.pam", i);
    vt_photo *photo = vt_add_photo(p->context, &photos, name, at(p, name));
    double a = r->arc * i / r->count, d = 5 + r->distance_noise * normal(&rng);
    vt_vec3 eye = turned(d * cos(a), d * sin(a), r->height + r->height_noise * normal(&rng));
    vt_camera c = vt_look_at(eye, turned(0, 0, 0.3 + r->pitch_noise * normal(&rng)), real_up, 0.8, WIDTH, HEIGHT);
    double roll = r->roll_noise * normal(&rng), m[9];
    memcpy(m, c.rotation.m, sizeof m);
    for (int k = 0; k < 3; k++) {
      c.rotation.m[k] = cos(roll) * m[k] - sin(roll) * m[3 + k];
      c.rotation.m[3 + k] = sin(roll) * m[k] + cos(roll) * m[3 + k];
    }
    photo->rotation = c.rotation;
    photo->translation = vt_scale(vt_mul(&c.rotation, eye), -1);
    photo->lens = lens ? *lens : (vt_lens){VT_LENS_PINHOLE, WIDTH, HEIGHT, 350, 355, 201, 148, {0}};
    photo->width = WIDTH, photo->height = HEIGHT;
    photo->upright = 1;
  }
  return photos;
}

static double degrees_off(vt_vec3 a) {
  return acos(fmin(1, vt_dot(vt_normalise(a), vt_normalise(vt_cross(side, front))))) * 180 / VT_PI;
}

static void up_is_found_from_what_says_it_best(void **state) {
  (void)state;
  static const struct {
    rig rig;
    const char *by;
    double most; // degrees
  } cases[] = {{{40, 6.28, 1, 0.8, 0.01, 0.3, 0.3}, "level", 0.4},   // level cameras at all heights
               {{40, 6.28, 1, 0.01, 0.1, 0.3, 0.3}, "plane", 0.3},   // careless hands on level ground
               {{40, 1.7, 1, 0.5, 0.01, 0.3, 0.3}, "level", 1.5},    // from one side only
               {{40, 6.28, 1, 1, 0.4, 1, 0.3}, "", 10},              // nothing is level: still up and not down
               {{2, 1, 1, 0, 0.01, 0, 0}, "mean", 25}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    place p = open_place();
    vt_photos photos = stand(&p, &cases[i].rig, NULL);
    vt_up found = vt_find_up(&photos);
    double off = degrees_off(found.direction);
    printf("rig %zu: %.3f degrees off, %.3f said, by %s\n", i, off, found.error * 180 / VT_PI, found.by);
    if (!(off < cases[i].most) || !strstr(found.by, cases[i].by)) fail_msg("rig %zu\n", i);
    if (isfinite(found.error)) assert_true(off < 4 * found.error * 180 / VT_PI + 0.05); // it knows what it does not know
    vt_free_photos(p.context, &photos);
    close_place(&p);
  }
}

static void photographs_taken_on_edge_are_set_upright_by_their_headers(void **state) {
  (void)state;
  place p = open_place();
  rig r = {40, 6.28, 1, 0.8, 0.01, 0.3, 0.3};
  vt_photos photos = stand(&p, &r, NULL);
  // what is stored when the camera is turned: rows of the upright picture become columns
  for (int i = 0; i < photos.count; i += 2) {
    vt_photo *photo = &photos.items[i];
    double m[9];
    memcpy(m, photo->rotation.m, sizeof m);
    vt_vec3 t = photo->translation;
    bool right = i % 4 != 0; // orientation 6: stored x is down, stored y is left of the upright picture
    photo->upright = right ? 6 : 8;
    for (int k = 0; k < 3; k++) {
      photo->rotation.m[k] = right ? m[3 + k] : -m[3 + k];
      photo->rotation.m[3 + k] = right ? -m[k] : m[k];
    }
    photo->translation = vt_v3(right ? t.y : -t.y, right ? -t.x : t.x, t.z);
  }
  vt_up found = vt_find_up(&photos);
  assert_true(degrees_off(found.direction) < 0.4);
  for (int i = 0; i < photos.count; i++) photos.items[i].upright = 1; // without headers it is worse
  vt_up without = vt_find_up(&photos);
  assert_true(!(vt_length(without.direction) > 0) || degrees_off(without.direction) > 2);
  vt_free_photos(p.context, &photos);
  close_place(&p);
}

// ---- marks

static const vt_lens bent = {VT_LENS_OPENCV, WIDTH, HEIGHT, 350, 355, 201, 148, {-0.15, 0.03, 0.001, -0.001}};

static void see(const vt_photo *photo, vt_vec3 point, double pixel[2]) {
  vt_vec3 c = vt_add(vt_mul(&photo->rotation, point), photo->translation);
  assert_true(c.z > 0);
  vt_lens_project(&photo->lens, c.x / c.z, c.y / c.z, pixel);
}

static int put_mark(char *text, size_t size, const vt_photos *photos, int photo, vt_vec3 point, const char *name, double noise) {
  double pixel[2];
  see(&photos->items[photo], point, pixel);
  return snprintf(text, size, "%s %.12g %.12g %s\n", vt_base_name(photos->items[photo].name), pixel[0] + noise, pixel[1] - noise, name);
}

static void marks_give_the_scale_through_bent_lenses(void **state) {
  (void)state;
  place p = open_place();
  rig r = {12, 6.28, 1, 0.2, 0.05, 0.3, 0.1};
  vt_photos photos = stand(&p, &r, &bent);
  vt_vec3 foot = turned(0.2, 0.1, -0.8), top = turned(-0.1, 0.3, 0.9), branch = turned(0.5, -0.4, 0.2);
  for (int noisy = 0; noisy < 2; noisy++) {
    char text[8192];
    int n = snprintf(text, sizeof text, "# foot and top\n\n");
    for (int i = 0; i < 12; i += 3) {
      n += put_mark(text + n, sizeof text - (size_t)n, &photos, i, foot, "foot", noisy * 0.5);
      n += put_mark(text + n, sizeof text - (size_t)n, &photos, i + 1, top, "\"the top\"", noisy * 0.5);
      n += put_mark(text + n, sizeof text - (size_t)n, &photos, i, branch, "branch", noisy * -0.5);
    }
    double metres = 2.5 * vt_length(vt_sub(foot, top)), short_one = 2.5 * vt_length(vt_sub(foot, branch)), scale = 0;
    snprintf(text + n, sizeof text - (size_t)n, "distance foot \"the top\" %.12g # by tape\r\ndistance branch foot %.12g", metres,
             short_one);
    put_text(&p, "marks.txt", text);
    vt_status status = vt_scale_by_marks(p.context, at(&p, "marks.txt"), &photos, &scale);
    if (status) fail_msg("%s\n", vt_last_error(p.context));
    assert_close(scale, 2.5, noisy ? 0.02 : 1e-8);
  }
  vt_free_photos(p.context, &photos);
  close_place(&p);
}

static void marks_on_turned_photographs_are_meant_upright(void **state) {
  (void)state;
  for (int turn = 1; turn <= 8; turn++) {
    place p = open_place();
    rig r = {4, 2, 1, 0.2, 0.05, 0.3, 0.1};
    vt_photos photos = stand(&p, &r, NULL);
    vt_vec3 points[2] = {turned(0.2, 0.1, -0.8), turned(-0.1, 0.3, 0.9)};
    char text[2048];
    int n = 0;
    for (int i = 0; i < 4; i++)
      for (int k = 0; k < 2; k++) { // a viewer shows pixel (x, y) of the stored picture at (u, v)
        double s[2], x, y, u, v;
        photos.items[i].upright = turn;
        see(&photos.items[i], points[k], s);
        x = s[0], y = s[1];
        u = turn == 1 || turn == 4 ? x : turn == 2 || turn == 3 ? WIDTH - x : turn == 5 || turn == 8 ? y : HEIGHT - y;
        v = turn == 1 || turn == 2 ? y : turn == 3 || turn == 4 ? HEIGHT - y : turn == 5 || turn == 6 ? x : WIDTH - x;
        n += snprintf(text + n, sizeof text - (size_t)n, "%02d.pam %.12g %.12g %c\n", i, u, v, 'a' + k);
      }
    snprintf(text + n, sizeof text - (size_t)n, "distance a b %.12g\n", 3 * vt_length(vt_sub(points[0], points[1])));
    put_text(&p, "marks.txt", text);
    double scale = 0;
    if (vt_scale_by_marks(p.context, at(&p, "marks.txt"), &photos, &scale)) fail_msg("%d: %s\n", turn, vt_last_error(p.context));
    assert_close(scale, 3, 1e-8);
    vt_free_photos(p.context, &photos);
    close_place(&p);
  }
}

static void marks_that_cannot_be_right_are_told_with_their_line(void **state) {
  (void)state;
  static const struct {
    const char *text, *word, *other;
  } cases[] = {{"", "no distance", "marks.txt"},
               {"00.pam 1\n", "line 1", "two numbers"},
               {"00.pam 1 b c\n", "line 1", "two numbers"},
               {"00.pam 1 2 \n", "line 1", "a name"},
               {"# c\nzz.pam 1 2 a\n", "line 2", "zz.pam"},
               {"00.pam 1 400 a\n", "line 1", "is not in 00.pam"},
               {"00.pam nan 4 a\n", "line 1", "two numbers"},
               {"00.pam 10 20 a\n00.pam 30 40 b\ndistance a b 3\n", "marked in 1 photograph", "a "},
               {"distance a b 3\n", "marked in 0 photographs", "a "},
               {"distance a a 3\n", "line 1", "itself"},
               {"distance a b -3\n", "line 1", "metres above 0"},
               {"00.pam 10 20 a\n00.pam 11 21 a\n00.pam 30 40 b\n00.pam 31 40 b\ndistance a b 3\n", "one side", "a is"},
               {"00.pam 200 150 a\n03.pam 200 20 a\n06.pam 200 280 a\n09.pam 10 150 a\n00.pam 30 40 b\ndistance a b 3\n",
                "pixels from where", "line "}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    place p = open_place();
    rig r = {12, 6.28, 1, 0, 0, 0, 0};
    vt_photos photos = stand(&p, &r, NULL);
    double scale = 0;
    put_text(&p, "marks.txt", cases[i].text);
    assert_int_equal(vt_scale_by_marks(p.context, at(&p, "marks.txt"), &photos, &scale), VT_BAD_INPUT);
    const char *sentence = vt_last_error(p.context);
    if (!strstr(sentence, cases[i].word) || !strstr(sentence, cases[i].other) || !strchr(sentence, ';'))
      fail_msg("case %zu: %s\n", i, sentence);
    vt_free_photos(p.context, &photos);
    close_place(&p);
  }
}

// ---- markers

#ifdef VT_WITH_OPENCV
// Cells of the markers 0 and 1 of ArUco's dictionaries of 4x4 cells, row by row, white is 1.
static const char *const cells_of[2] = {"1011010100110010", "0000111110011010"};

// How bright the board in the plane z = 0 is at (x, y): two markers of side 1, at x 0..1 and 1.5..2.5, on white.
static double board(double x, double y) {
  for (int m = 0; m < 2; m++) {
    double u = (x - 1.5 * m) * 6, v = (1 - y) * 6;
    if (u < 0 || v < 0 || u >= 6 || v >= 6) continue;
    int i = (int)u - 1, j = (int)v - 1;
    return i < 0 || j < 0 || i > 3 || j > 3 || cells_of[m][4 * j + i] == '0' ? 20 : 230;
  }
  return 230;
}

static void put_board(place *p, const vt_photo *photo) {
  vt_image image = {0};
  assert_int_equal(vt_make_image(p->context, WIDTH, HEIGHT, 3, &image), VT_OK);
  vt_vec3 eye = vt_scale(vt_mul_transposed(&photo->rotation, photo->translation), -1);
  for (int i = 0; i < WIDTH * HEIGHT; i++) {
    double sum = 0;
    for (int s = 0; s < 16; s++) {
      double pixel[2] = {i % WIDTH + (s % 4 + 0.5) / 4, i / WIDTH + (s / 4 + 0.5) / 4}, xy[2];
      assert_true(vt_lens_unproject(&photo->lens, pixel, xy));
      vt_vec3 d = vt_mul_transposed(&photo->rotation, vt_v3(xy[0], xy[1], 1));
      double t = -eye.z / d.z;
      sum += board(eye.x + t * d.x, eye.y + t * d.y) / 16;
    }
    memset(image.pixels + 3 * i, (int)sum, 3);
  }
  put_image(p, photo->name, &image);
  vt_free_image(p->context, &image);
}

static void markers_of_known_size_give_the_scale(void **state) {
  (void)state;
  place p = open_place();
  vt_photos photos = {0};
  for (int i = 0; i < 4; i++) {
    char name[32];
    snprintf(name, sizeof name, "images/%02d.pam", i);
    vt_photo *photo = vt_add_photo(p.context, &photos, name, at(&p, name));
    vt_camera c = vt_look_at(vt_v3(1.2 + 2.5 * cos(1.4 * i), 0.5 + 2.5 * sin(1.4 * i), 3.5), vt_v3(1.2, 0.5, 0), vt_v3(0, 1, 0.2), 0.8,
                             WIDTH, HEIGHT);
    photo->rotation = c.rotation;
    photo->translation = c.translation;
    photo->lens = bent;
    photo->width = WIDTH, photo->height = HEIGHT;
    put_board(&p, photo);
  }
  double scale = 0;
  vt_status status = vt_scale_by_markers(p.context, 0.12, 4, &photos, &scale);
  if (status) fail_msg("%s\n", vt_last_error(p.context));
  printf("markers of 0.12 m: a unit is %.5f m\n", scale);
  assert_close(scale, 0.12, 0.0006); // half a percent
  assert_int_equal(vt_scale_by_markers(p.context, 0.12, 6, &photos, &scale), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(p.context), "--marker-cells"));
  vt_clear_error(p.context);
  assert_int_equal(remove(at(&p, "images/02.pam")), 0);
  assert_int_equal(vt_scale_by_markers(p.context, 0.12, 4, &photos, &scale), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(p.context), "02.pam"));
  vt_free_photos(p.context, &photos);
  close_place(&p);
}
#endif

#ifdef VT_WITH_JANSSON
static void z_of_transforms_is_up_unless_the_cameras_say_otherwise(void **state) {
  (void)state;
  for (int wrong = 0; wrong < 2; wrong++) {
    place p = open_place();
    char text[4096];
    int n = snprintf(text, sizeof text, "{\"fl_x\": 9, \"frames\": [");
    put_picture(&p, "a.pam", 8, 6, 4);
    for (int i = 0; i < 8; i++) {
      double a = i * VT_PI / 4;
      vt_camera c = vt_look_at(vt_v3(3 * cos(a), 3 * sin(a), 1), vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.8, 8, 6);
      vt_vec3 e = vt_camera_centre(&c);
      const double *m = c.rotation.m;
      double rows[3][4] = {{m[0], -m[3], -m[6], e.x}, {m[1], -m[4], -m[7], e.y}, {m[2], -m[5], -m[8], e.z}};
      n += snprintf(text + n, sizeof text - (size_t)n, "%s{\"file_path\": \"a.pam\", \"transform_matrix\": [", i ? "," : "");
      for (int k = 0; k < 3; k++) { // wrong: y of the file is up
        const double *row = rows[wrong ? (k + 1) % 3 : k];
        n += snprintf(text + n, sizeof text - (size_t)n, "%s[%.17g,%.17g,%.17g,%.17g]", k ? "," : "", row[0], row[1], row[2], row[3]);
      }
      n += snprintf(text + n, sizeof text - (size_t)n, "]}");
    }
    snprintf(text + n, sizeof text - (size_t)n, "]}");
    put_text(&p, "transforms.json", text);
    vt_capture_desc desc = vt_default_capture_desc();
    desc.source = p.root;
    desc.tree_height = 3.5;
    vt_views v = load(&p, &desc, NULL);
    assert_close(v.world.up.z, wrong ? 0 : 1, wrong ? 1e-3 : 0);
    assert_close(v.world.up.y, wrong ? 1 : 0, wrong ? 1e-3 : 0);
    assert_close(v.world.tree_height, 3.5, 0);
    assert_close(v.world.metres_per_unit, 0, 0);
    vt_free_views(p.context, &v);
    close_place(&p);
  }
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(up_is_found_from_what_says_it_best),
      cmocka_unit_test(photographs_taken_on_edge_are_set_upright_by_their_headers),
      cmocka_unit_test(marks_give_the_scale_through_bent_lenses),
      cmocka_unit_test(marks_on_turned_photographs_are_meant_upright),
      cmocka_unit_test(marks_that_cannot_be_right_are_told_with_their_line),
#ifdef VT_WITH_OPENCV
      cmocka_unit_test(markers_of_known_size_give_the_scale),
#endif
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(z_of_transforms_is_up_unless_the_cameras_say_otherwise),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
