// test_capture_models.c - COLMAP workspaces become views, and photographs alone are calibrated once
// SPDX-License-Identifier: BSD-3-Clause

#include "capture/colmap_model.h"
#include "tests/capture_folders.h"

#include <sys/stat.h>

static void put_text_model(place *p, const char *folder, const char *names[], int count) {
  char name[256], text[2048];
  int n = 0;
  snprintf(name, sizeof name, "%s/cameras.txt", folder);
  put_text(p, name, "# Camera list\n1 SIMPLE_RADIAL 8 6 9.5 4.25 3 0\n20 PINHOLE 8 6 10 11 4 3\n");
  n += snprintf(text + n, sizeof text - (size_t)n, "# Image list with two lines of data per image\n");
  for (int i = 0; i < count; i++) // quaternions of any length; the second turns by 90 degrees about y
    n += snprintf(text + n, sizeof text - (size_t)n, "%d %s %d 0.5 2 %d %s\r\n%s\n", i + 1,
                  i == 1 ? "2 0 2 0" : "0.5 0 0 0", i, i ? 20 : 1, names[i], i ? "" : "1.5 2.5 -1 3 4 1");
  snprintf(name, sizeof name, "%s/images.txt", folder);
  put_text(p, name, text);
}

static void colmap_text_models_mean_what_colmap_means(void **state) {
  (void)state;
  place p = open_place();
  const char *names[] = {"b.pam", "sub/a b.pam", "a.pam"};
  put_text_model(&p, "sparse/0", names, 3);
  put_text(&p, "sparse/0/points3D.txt", "# points\n1 0 0 0 9 9 9 0.5 1 2\n2 0 0 0 9 9 9 1.0 1 2\n3 0 0 0 9 9 9 -1\n");
  const char *few[] = {"a.pam"};
  put_text_model(&p, "sparse/1", few, 1);
  for (int i = 0; i < 3; i++) {
    char name[64];
    snprintf(name, sizeof name, "images/%s", names[i]);
    put_picture(&p, name, 8, 6, 4);
  }
  put_picture(&p, "images/blurred.pam", 8, 6, 4);
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  vt_capture_report report;
  vt_views v = load(&p, &desc, &report);
  assert_int_equal(report.kind, VT_SOURCE_COLMAP);
  assert_close(report.reprojection_error, 0.75, 1e-12);
  assert_int_equal(report.photograph_count, 4);
  assert_int_equal(report.left_out_count, 1);
  assert_non_null(strstr(report.left_out[0], "blurred.pam: not registered"));
  assert_int_equal(v.count, 3);
  assert_string_equal(v.items[0].name, "a.pam"); // by name
  assert_string_equal(v.items[1].name, "b.pam");
  assert_string_equal(v.items[2].name, "sub/a b.pam");
  expect_pixel(&v.items[1].camera, 0, 0, 0, 4.25, 3 + 9.5 * 0.25, 1e-12); // t = (0, 0.5, 2), f x/z + cx
  expect_pixel(&v.items[1].camera, (0.5 - 4.25) / 9.5 * 2, -0.5 - 2.5 / 9.5 * 2, 0, 0.5, 0.5,
               1e-12);                                                                   // first pixel's centre
  expect_pixel(&v.items[2].camera, -2, 0, 1, 4 + 10 * 2.0 / 4, 3 + 11 * 0.5 / 4, 1e-12); // x' = z + 1, z' = -x + 2
  vt_free_views(p.context, &v);
  vt_free_capture_report(p.context, &report);
  close_place(&p);
}

static void add_bytes(uint8_t **end, const void *value, size_t size) {
  memcpy(*end, value, size);
  *end += size;
}
static void add_u64(uint8_t **end, uint64_t v) {
  add_bytes(end, &v, 8);
} // tests run on little-endian machines
static void add_u32(uint8_t **end, uint32_t v) {
  add_bytes(end, &v, 4);
}
static void add_f64(uint8_t **end, double v) {
  add_bytes(end, &v, 8);
}

// Cameras of all seven models, an image with each.
static const struct {
  const char *name;
  int count;
} models[] = {{"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4},        {"SIMPLE_RADIAL", 4}, {"RADIAL", 5},
              {"OPENCV", 8},         {"OPENCV_FISHEYE", 8}, {"FULL_OPENCV", 12}};

static double parameter(int model, int i) {
  int plain = model == 0 || model == 2 || model == 3 ? 3 : 4;
  return i < plain ? 10 + 0.1 * model + i : 0.01 * (i - plain + 1);
}

static void put_binary_model(place *p, const char *folder, const char *const *names, int count, bool pinhole) {
  char path[256];
  uint8_t *bytes = VT_NEW(p->context, uint8_t, 8192), *end = bytes;
  add_u64(&end, (uint64_t)count);
  for (int n = 0; n < count; n++) {
    int m = pinhole ? 1 : n;
    add_u32(&end, (uint32_t)n + 5), add_u32(&end, (uint32_t)m);
    add_u64(&end, 8), add_u64(&end, 6);
    for (int i = 0; i < models[m].count; i++) add_f64(&end, parameter(m, i));
  }
  snprintf(path, sizeof path, "%s/cameras.bin", folder);
  put_bytes(p, path, bytes, (size_t)(end - bytes));
  end = bytes;
  add_u64(&end, (uint64_t)count);
  for (int m = 0; m < count; m++) {
    add_u32(&end, (uint32_t)m + 1);
    for (int i = 0; i < 7; i++) add_f64(&end, 0.1 * (i + 1) * (m + 1));
    add_u32(&end, (uint32_t)m + 5);
    add_bytes(&end, names[m], strlen(names[m]) + 1);
    add_u64(&end, (uint64_t)m);
    for (int i = 0; i < m; i++) add_f64(&end, 1), add_f64(&end, 2), add_u64(&end, UINT64_MAX);
  }
  snprintf(path, sizeof path, "%s/images.bin", folder);
  put_bytes(p, path, bytes, (size_t)(end - bytes));
  end = bytes;
  add_u64(&end, 1);
  add_u64(&end, 1), add_f64(&end, 0), add_f64(&end, 0), add_f64(&end, 0), add_bytes(&end, "rgb", 3),
      add_f64(&end, 0.375);
  add_u64(&end, 2), add_u32(&end, 1), add_u32(&end, 0), add_u32(&end, 2), add_u32(&end, 0);
  snprintf(path, sizeof path, "%s/points3D.bin", folder);
  put_bytes(p, path, bytes, (size_t)(end - bytes));
  vt_free(p->context, bytes);
}

static void colmap_binary_and_text_models_are_the_same_for_all_lenses(void **state) {
  (void)state;
  place p = open_place();
  static const char *const names[] = {"a.jpg", "b.jpg", "c.jpg", "d.jpg", "e.jpg", "f.jpg", "g.jpg"};
  char cameras[4096], images[4096];
  int nc = 0, ni = 0;
  for (int m = 0; m < 7; m++) {
    nc += snprintf(cameras + nc, sizeof cameras - (size_t)nc, "%d %s 8 6", m + 5, models[m].name);
    for (int i = 0; i < models[m].count; i++)
      nc += snprintf(cameras + nc, sizeof cameras - (size_t)nc, " %.17g", parameter(m, i));
    nc += snprintf(cameras + nc, sizeof cameras - (size_t)nc, "\n");
    ni += snprintf(images + ni, sizeof images - (size_t)ni, "%d", m + 1);
    for (int i = 0; i < 7; i++)
      ni += snprintf(images + ni, sizeof images - (size_t)ni, " %.17g", 0.1 * (i + 1) * (m + 1));
    ni += snprintf(images + ni, sizeof images - (size_t)ni, " %d %s\n%s", m + 5, names[m], m == 6 ? "" : "\n");
  }
  put_text(&p, "text/cameras.txt", cameras);
  put_text(&p, "text/images.txt", images);
  put_binary_model(&p, "binary", names, 7, false);
  vt_colmap_model text = {0}, binary = {0};
  assert_int_equal(vt_read_colmap_model(p.context, at(&p, "text"), &text), VT_OK);
  assert_int_equal(vt_read_colmap_model(p.context, at(&p, "binary"), &binary), VT_OK);
  assert_true(isnan(text.reprojection_error));
  assert_close(binary.reprojection_error, 0.375, 0);
  assert_int_equal(text.count, 7);
  assert_int_equal(binary.count, 7);
  for (int i = 0; i < 7; i++) {
    const vt_colmap_image *a = &text.items[i], *b = &binary.items[i];
    assert_string_equal(a->name, b->name);
    assert_memory_equal(&a->rotation, &b->rotation, sizeof a->rotation);
    assert_memory_equal(&a->translation, &b->translation, sizeof a->translation);
    assert_int_equal(a->lens.model, b->lens.model);
    assert_memory_equal(a->lens.k, b->lens.k, sizeof a->lens.k);
    assert_true(a->lens.fx == b->lens.fx && a->lens.fy == b->lens.fy && a->lens.cx == b->lens.cx &&
                a->lens.cy == b->lens.cy);
    assert_int_equal(a->lens.model, i < 2 ? VT_LENS_PINHOLE : i == 5 ? VT_LENS_FISHEYE : VT_LENS_OPENCV);
    int distortion = i < 2 ? 0 : i == 2 ? 1 : i == 3 ? 2 : i == 6 ? 8 : 4;
    for (int k = 0; k < 8; k++) assert_close(a->lens.k[k], k < distortion ? 0.01 * (k + 1) : 0, 0);
    bool one_focal = i == 0 || i == 2 || i == 3;
    assert_close(a->lens.fy - a->lens.fx, one_focal ? 0 : 1, 1e-12);
    assert_close(a->lens.cx, 10 + 0.1 * i + (one_focal ? 1 : 2), 1e-12);
  }
  vt_free_colmap_model(p.context, &text);
  vt_free_colmap_model(p.context, &binary);
  close_place(&p);
}

static void colmap_models_are_found_in_all_usual_places(void **state) {
  (void)state;
  static const char *const folders[] = {"sparse/0", "sparse", "colmap/sparse/0"};
  for (int i = 0; i < 3; i++)
    for (int beside = 0; beside < 2; beside++) { // pictures in images/ or in the folder itself
      place p = open_place();
      const char *names[] = {"b.pam", "a.pam"};
      put_text_model(&p, folders[i], names, 2);
      put_picture(&p, beside ? "a.pam" : "images/a.pam", 16, 12, 4); // twice the size of its camera
      put_picture(&p, beside ? "b.pam" : "images/b.pam", 8, 6, 4);
      vt_views v = load_name(&p, ".");
      assert_int_equal(v.count, 2);
      assert_close(v.items[0].camera.fx, 20, 1e-12);
      assert_close(v.items[1].camera.cx, 4.25, 1e-12);
      vt_free_views(p.context, &v);
      close_place(&p);
    }
}

#ifdef VT_WITH_OPENCV
// A soft spot of light at (x, y), in continuous pixels, in every channel.
static void put_spot(place *p, const char *name, int channels, double x, double y) {
  vt_image image = {0};
  assert_int_equal(vt_make_image(p->context, 96, 64, channels, &image), VT_OK);
  for (int i = 0; i < 96 * 64; i++) {
    double dx = i % 96 + 0.5 - x, dy = i / 96 + 0.5 - y;
    for (int c = 0; c < channels; c++) image.pixels[channels * i + c] = (uint8_t)(250 * exp(-(dx * dx + dy * dy) / 8));
  }
  put_image(p, name, &image);
  vt_free_image(p->context, &image);
}

static void expect_spot(const vt_view *view, int channel, vt_vec3 point) {
  double sum = 0, x = 0, y = 0, pixel[2];
  for (int i = 0; i < view->picture.width * view->picture.height; i++) {
    double light = view->picture.pixels[4 * i + channel];
    sum += light, x += light * (i % view->picture.width + 0.5), y += light * (i / view->picture.width + 0.5);
  }
  assert_true(sum > 0 && vt_project(&view->camera, point, pixel));
  assert_close(x / sum, pixel[0], 0.1);
  assert_close(y / sum, pixel[1], 0.1);
}

static void bent_lenses_are_straightened_together_with_their_masks(void **state) {
  (void)state;
  place p = open_place();
  double x = 0.38, y = -0.25, r = hypot(x, y), theta = atan(r);
  double radial = 1 - 0.2 * r * r, fisheye = theta * (1 + 0.05 * theta * theta) / r;
  put_text(&p, "sparse/cameras.txt",
           "1 SIMPLE_RADIAL 96 64 80 47 33 -0.2\n2 OPENCV_FISHEYE 96 64 80 81 47 33 0.05 0 0 0\n");
  put_text(&p, "sparse/images.txt", "1 1 0 0 0 0 0 0 1 a.pam\n\n2 1 0 0 0 0 0 0 2 b.pam\n\n");
  put_spot(&p, "images/a.pam", 3, 80 * x * radial + 47, 80 * y * radial + 33);
  put_spot(&p, "masks/a.pam", 1, 80 * x * radial + 47, 80 * y * radial + 33);
  put_spot(&p, "images/b.pam", 3, 80 * x * fisheye + 47, 81 * y * fisheye + 33);
  put_spot(&p, "masks/b.pam", 1, 80 * x * fisheye + 47, 81 * y * fisheye + 33);
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  vt_views v = load(&p, &desc, NULL);
  for (int i = 0; i < 2; i++) expect_spot(&v.items[i], 3, vt_v3(x, y, 1));
  vt_free_views(p.context, &v);
  desc.matte = VT_MATTE_NONE;
  v = load(&p, &desc, NULL);
  for (int i = 0; i < 2; i++) {
    expect_spot(&v.items[i], 0, vt_v3(x, y, 1));
    for (int k = 0; k < v.items[i].picture.width * v.items[i].picture.height; k++) // nothing from outside is in it
      assert_int_equal(v.items[i].picture.pixels[4 * k + 3], 255);
  }
  vt_free_views(p.context, &v);
  close_place(&p);
}
#endif

#ifdef VT_WITH_OPENIMAGEIO
// ---- photographs alone, calibrated by a program that stands in for colmap and keeps count of its calls

static void put_false_colmap(place *p, const char *const *names, const char *end) {
  char text[1024];
  put_binary_model(p, "tool/model", names, 3, true);
  snprintf(text, sizeof text,
           "#!/bin/sh\nhere=$(dirname \"$0\")\n"
           "[ \"$1\" = mapper ] && echo run >> \"$here/calls\"\n"
           "[ \"$1\" = feature_extractor ] && echo '--database_path --SiftExtraction.use_gpu'\n"
           "if [ \"$1\" = mapper ]; then while [ $# -gt 0 ]; do [ \"$1\" = --output_path ] && out=$2; shift; done\n"
           "mkdir -p \"$out/0\" && cp \"$here\"/model/* \"$out/0/\"\n%s\nfi\nexit 0\n",
           end);
  put_text(p, "tool/colmap", text);
  assert_int_equal(chmod(at(p, "tool/colmap"), 0755), 0);
}

static int count_calls(place *p) {
  uint8_t *text = NULL;
  size_t size = 0;
  if (!vt_is_file(at(p, "tool/calls"))) return 0;
  assert_int_equal(vt_read_file(p->context, at(p, "tool/calls"), &text, &size), VT_OK);
  vt_free(p->context, text);
  return (int)(size / 8); // two attempts each time: 3 of 4 photographs are few
}

static void expect_calibration(place *p, const vt_capture_desc *desc, bool from_cache, int calls) {
  vt_capture_report report;
  vt_views v = load(p, desc, &report);
  assert_int_equal(v.count, 3);
  assert_int_equal(report.kind, VT_SOURCE_PHOTOS);
  assert_int_equal(report.photograph_count, 4);
  assert_int_equal(report.left_out_count, 1);
  assert_non_null(strstr(report.left_out[0], "d.png: not registered"));
  assert_close(report.reprojection_error, 0.375, 0);
  assert_int_equal(report.calibration_from_cache, from_cache);
  assert_int_equal(count_calls(p), calls);
  vt_free_views(p->context, &v);
  vt_free_capture_report(p->context, &report);
}

static void the_same_photographs_are_calibrated_once(void **state) {
  (void)state;
  place p = open_place();
  static const char *const names[] = {"a.png", "b.png", "sub/c.png"};
  char photos[1024], tool[1024], cache[1024];
  put_false_colmap(&p, names, "");
  put_picture(&p, "photos/images/a.png", 8, 6, 4);
  put_picture(&p, "photos/images/b.png", 8, 6, 4);
  put_picture(&p, "photos/images/sub/c.png", 8, 6, 4);
  put_picture(&p, "photos/images/d.png", 8, 6, 4);
  snprintf(photos, sizeof photos, "%s", at(&p, "photos"));
  snprintf(tool, sizeof tool, "%s", at(&p, "tool/colmap"));
  snprintf(cache, sizeof cache, "%s", at(&p, "new/cache"));
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = photos;
  desc.colmap = tool;
  expect_calibration(&p, &desc, false, 1);
  expect_calibration(&p, &desc, false, 2); // nothing is kept without a cache
  desc.cache = cache;
  expect_calibration(&p, &desc, false, 3);
  expect_calibration(&p, &desc, true, 3);
  vt_names kept = {0};
  assert_int_equal(vt_list_folder(p.context, cache, false, &kept), VT_OK);
  assert_int_equal(kept.count, 1); // the model alone
  char damaged[512];
  snprintf(damaged, sizeof damaged, "new/cache/%s/0/images.bin", kept.items[0]);
  vt_free_names(p.context, &kept);
  put_bytes(&p, damaged, "short", 5);
  expect_calibration(&p, &desc, false, 4);
  expect_calibration(&p, &desc, true, 4);
  desc.seed = 1;
  expect_calibration(&p, &desc, false, 5);
  put_picture(&p, "photos/images/d.png", 9, 6, 4); // other content under the same name
  expect_calibration(&p, &desc, false, 6);
  close_place(&p);
}

static void a_calibration_that_breaks_off_leaves_only_its_workspace(void **state) {
  (void)state;
  place p = open_place();
  static const char *const names[] = {"a.png", "b.png", "c.png"};
  char tool[1024], cache[1024];
  for (int i = 0; i < 3; i++) put_picture(&p, names[i], 8, 6, 4);
  put_false_colmap(&p, names, "exit 9");
  snprintf(tool, sizeof tool, "%s", at(&p, "tool/colmap"));
  snprintf(cache, sizeof cache, "%s", at(&p, "cache"));
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  desc.colmap = tool;
  desc.cache = cache;
  vt_views v = {0};
  assert_int_equal(vt_load_views(p.context, &desc, &v, NULL), VT_FAILED);
  vt_names kept = {0};
  assert_int_equal(vt_list_folder(p.context, cache, false, &kept), VT_OK);
  assert_int_equal(kept.count, 1); // the same command may go on in it
  assert_int_equal(strncmp(kept.items[0], "work-", 5), 0);
  vt_free_names(p.context, &kept);
  close_place(&p);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(colmap_text_models_mean_what_colmap_means),
      cmocka_unit_test(colmap_binary_and_text_models_are_the_same_for_all_lenses),
      cmocka_unit_test(colmap_models_are_found_in_all_usual_places),
#ifdef VT_WITH_OPENCV
      cmocka_unit_test(bent_lenses_are_straightened_together_with_their_masks),
#endif
#ifdef VT_WITH_OPENIMAGEIO
      cmocka_unit_test(the_same_photographs_are_calibrated_once),
      cmocka_unit_test(a_calibration_that_breaks_off_leaves_only_its_workspace),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
