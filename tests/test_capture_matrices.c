// test_capture_matrices.c - cameras of Bundler and bare projection matrices mean the same cameras
// SPDX-License-Identifier: BSD-3-Clause

#include "capture/bundler.h"
#include "tests/capture_folders.h"

enum { COUNT = 5, WIDTH = 16, HEIGHT = 12 };

static vt_camera camera_of(int i) {
  vt_camera c = vt_look_at(vt_v3(4 * cos(i), 4 * sin(i), 1 + 0.2 * i), vt_v3(0.1, 0.2, 0.5), vt_v3(0.1, 0.2, 1), 0.7, WIDTH, HEIGHT);
  c.fy *= 1 + 0.01 * i;
  c.cx += 0.3 * i;
  return c;
}

static void expect_same(const vt_camera *a, const vt_camera *b) {
  for (int n = 0; n < 40; n++) {
    vt_vec3 point = vt_v3(sin(n), cos(2 * n), 0.5 + sin(3 * n));
    double pa[2], pb[2];
    assert_true(vt_project(a, point, pa) && vt_project(b, point, pb));
    assert_close(pa[0], pb[0], 1e-8);
    assert_close(pa[1], pb[1], 1e-8);
  }
}

// ---- matrices

static void make_matrix(const vt_camera *c, double factor, double p[12]) {
  double t[3] = {c->translation.x, c->translation.y, c->translation.z};
  for (int j = 0; j < 4; j++) {
    double x = j < 3 ? c->rotation.m[j] : t[0], y = j < 3 ? c->rotation.m[3 + j] : t[1], z = j < 3 ? c->rotation.m[6 + j] : t[2];
    p[j] = factor * (c->fx * x + c->cx * z), p[4 + j] = factor * (c->fy * y + c->cy * z), p[8 + j] = factor * z;
  }
}

static void put_matrix(place *p, const char *name, const char *before, const double m[12]) {
  char text[1024];
  int n = snprintf(text, sizeof text, "%s", before);
  for (int i = 0; i < 12; i++) n += snprintf(text + n, sizeof text - (size_t)n, "%.17g%c", m[i], i % 4 == 3 ? '\n' : ' ');
  put_text(p, name, text);
}

static void projection_matrices_of_any_factor_are_split(void **state) {
  (void)state;
  static const char *const files[][2] = {{"a.P", ""}, {"b.txt", ""}, {"txt/c.txt", "CONTOUR\n"}};
  static const double factors[] = {1, -0.01, 300};
  place p = open_place();
  for (int i = 0; i < 3; i++) {
    char name[16];
    double m[12];
    vt_camera c = camera_of(i);
    make_matrix(&c, factors[i], m);
    snprintf(name, sizeof name, "%c.pam", 'a' + i);
    put_picture(&p, name, WIDTH, HEIGHT, 4);
    put_matrix(&p, files[i][0], files[i][1], m);
  }
  put_picture(&p, "d.pam", WIDTH, HEIGHT, 4);
  vt_capture_desc desc = vt_default_capture_desc();
  vt_capture_report report;
  desc.source = p.root;
  vt_views v = load(&p, &desc, &report);
  assert_int_equal(report.kind, VT_SOURCE_PROJECTIONS);
  assert_int_equal(v.count, 3);
  assert_int_equal(report.left_out_count, 1);
  assert_non_null(strstr(report.left_out[0], "d.pam: no projection matrix"));
  for (int i = 0; i < 3; i++) {
    vt_camera c = camera_of(i);
    expect_same(&c, &v.items[i].camera);
  }
  vt_free_views(p.context, &v);
  vt_free_capture_report(p.context, &report);
  close_place(&p);
}

static void matrices_that_no_camera_has_are_refused(void **state) {
  (void)state;
  vt_lens lens;
  vt_mat3 rotation;
  vt_vec3 translation;
  vt_camera c = camera_of(1);
  double m[12], bad[12];
  make_matrix(&c, 1, m);
  assert_true(vt_split_projection(m, &lens, &rotation, &translation));
  memcpy(bad, m, sizeof m);
  for (int i = 0; i < 4; i++) bad[i] = bad[4 + i]; // singular
  assert_false(vt_split_projection(bad, &lens, &rotation, &translation));
  memcpy(bad, m, sizeof m);
  for (int i = 0; i < 4; i++) bad[i] += 0.1 * m[4 + i]; // slanted pixels
  assert_false(vt_split_projection(bad, &lens, &rotation, &translation));
  memcpy(bad, m, sizeof m);
  bad[5] = NAN;
  assert_false(vt_split_projection(bad, &lens, &rotation, &translation));
  memset(bad, 0, sizeof bad);
  assert_false(vt_split_projection(bad, &lens, &rotation, &translation));
  static const char *const texts[] = {"1 2 3", "1 0 0 0 0 1 0 0 0 0 1 0 7", "1 0 0 0 0 1 0 0 0 0 x 0", "0 0 0 0 0 0 0 0 0 0 0 0"};
  for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
    place p = open_place();
    put_picture(&p, "a.pam", WIDTH, HEIGHT, 4);
    put_picture(&p, "b.pam", WIDTH, HEIGHT, 4);
    put_matrix(&p, "a.P", "", m);
    put_text(&p, "b.P", texts[i]);
    vt_capture_desc desc = vt_default_capture_desc();
    vt_views v = {0};
    desc.source = p.root;
    assert_int_equal(vt_load_views(p.context, &desc, &v, NULL), VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(p.context), "b.P"));
    close_place(&p);
  }
}

// ---- Bundler

static const vt_lens bent = {VT_LENS_OPENCV, WIDTH, HEIGHT, 20, 20, 8, 6, {-0.1, 0.02}};

// Cameras as Bundler writes them: y up, looking along -z. Number `lost` has no camera.
static void put_bundle(place *p, int lost, const char *tail) {
  char text[8192];
  int n = snprintf(text, sizeof text, "# Bundle file v0.3\n%d 0\n", COUNT);
  for (int i = 0; i < COUNT; i++) {
    vt_camera c = camera_of(i);
    const double *r = c.rotation.m;
    vt_vec3 t = c.translation;
    if (i == lost)
      n += snprintf(text + n, sizeof text - (size_t)n, "0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n");
    else
      n += snprintf(text + n, sizeof text - (size_t)n,
                    "20 -0.1 0.02\n%.17g %.17g %.17g\n%.17g %.17g %.17g\n%.17g %.17g %.17g\n%.17g %.17g %.17g\n", r[0], r[1], r[2],
                    -r[3], -r[4], -r[5], -r[6], -r[7], -r[8], t.x, -t.y, -t.z);
  }
  snprintf(text + n - (tail ? 20 : 0), sizeof text - (size_t)n, "%s", tail ? tail : "");
  put_text(p, "bundle.out", text);
}

static void bundlers_cameras_have_y_up_and_look_back(void **state) {
  (void)state;
  place p = open_place();
  char list[256] = "";
  for (int i = 0; i < COUNT; i++) {
    char name[32];
    snprintf(name, sizeof name, "photos/%c.pam", 'e' - i);
    put_picture(&p, name, WIDTH, HEIGHT, 4);
    snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s%s\n", i == 1 ? "./" : "", name, i == 2 ? " 0 600.5" : "");
  }
  put_text(&p, "list.txt", list);
  put_bundle(&p, 3, NULL);
  vt_photos photos = {0};
  vt_capture_report report = {0};
  vt_status status = vt_read_bundler(p.context, at(&p, "bundle.out"), &photos, &report);
  if (status) fail_msg("%s\n", vt_last_error(p.context));
  assert_int_equal(photos.count, COUNT - 1);
  assert_int_equal(report.photograph_count, COUNT);
  assert_non_null(strstr(report.left_out[0], "photos/b.pam"));
  for (int k = 0; k < photos.count; k++) {
    const vt_photo *photo = &photos.items[k];
    vt_camera c = camera_of(k < 3 ? k : k + 1);
    assert_string_equal(photo->lens.model == VT_LENS_OPENCV ? "bent" : "", "bent");
    for (int n = 0; n < 20; n++) { // Bundler's own words: p = -P / P.z, f (1 + k1 |p|^2 + k2 |p|^4) p from the middle, y up
      vt_vec3 q = vt_to_camera(&c, vt_v3(sin(n), cos(2 * n), 0.5 + sin(3 * n)));
      double px = -q.x / -q.z, py = -(-q.y) / -q.z, r2 = px * px + py * py, s = 20 * (1 - 0.1 * r2 + 0.02 * r2 * r2), pixel[2];
      vt_vec3 own = vt_add(vt_mul(&photo->rotation, vt_v3(sin(n), cos(2 * n), 0.5 + sin(3 * n))), photo->translation);
      vt_lens_project(&photo->lens, own.x / own.z, own.y / own.z, pixel);
      assert_close(pixel[0], 0.5 * WIDTH + s * px, 1e-9);
      assert_close(pixel[1], 0.5 * HEIGHT - s * py, 1e-9);
    }
    assert_close(photo->lens.k[1], bent.k[1], 0);
  }
  vt_free_photos(p.context, &photos);
  vt_free_capture_report(p.context, &report);
  close_place(&p);
}

static void bundles_that_are_cut_or_without_names_are_refused(void **state) {
  (void)state;
  static const char *const lists[] = {NULL, "a.pam\n", "a.pam\na.pam\na.pam\na.pam\nb.pam\n", "a.pam\na.pam\na.pam\na.pam\na.pam\n"};
  static const char *const words[] = {"list.txt", "only 1 photographs", "b.pam", "too few numbers"};
  for (int i = 0; i < 4; i++) {
    place p = open_place();
    put_picture(&p, "a.pam", WIDTH, HEIGHT, 4);
    put_bundle(&p, -1, i == 3 ? "x" : NULL);
    if (lists[i]) put_text(&p, "list.txt", lists[i]);
    vt_capture_desc desc = vt_default_capture_desc();
    vt_views v = {0};
    desc.source = p.root;
    assert_int_equal(vt_load_views(p.context, &desc, &v, NULL), VT_BAD_INPUT);
    const char *sentence = vt_last_error(p.context);
    if (!strstr(sentence, "bundle.out") || !strstr(sentence, words[i]) || !strchr(sentence, ';')) fail_msg("%d: %s\n", i, sentence);
    assert_int_equal(v.count, 0);
    close_place(&p);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(projection_matrices_of_any_factor_are_split),
      cmocka_unit_test(matrices_that_no_camera_has_are_refused),
      cmocka_unit_test(bundlers_cameras_have_y_up_and_look_back),
      cmocka_unit_test(bundles_that_are_cut_or_without_names_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
