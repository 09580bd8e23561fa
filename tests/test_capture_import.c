// test_capture_import.c - captures of other programs become views whose cameras and pixels are the ones meant
// SPDX-License-Identifier: BSD-3-Clause

#include "capture/transforms.h"
#include "tests/capture_folders.h"

#ifdef VT_WITH_JANSSON
static bool same_pixels(const vt_image *a, const vt_image *b) {
  return a->width == b->width && a->height == b->height && a->channels == b->channels &&
         !memcmp(a->pixels, b->pixels, (size_t)a->width * (size_t)a->height * (size_t)a->channels);
}

// ---- transforms.json

#define FRAME(name, more, matrix) "{\"file_path\": \"" name "\"" more ", \"transform_matrix\": " matrix "}"
#define IDENTITY "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"
// stands at (5, 0, 1), looks along -x, up is z
#define SIDE "[[0,0,1,5],[1,0,0,0],[0,1,0,1],[0,0,0,1]]"

static void nerf_files_without_endings_and_opengl_axes_are_understood(void **state) {
  (void)state;
  place p = open_place();
  put_picture(&p, "train/r_0.pam", 8, 6, 4);
  put_picture(&p, "train/r_1.pam", 8, 6, 4);
  put_picture(&p, "test/r_0.pam", 8, 6, 4);
  put_text(&p, "transforms_train.json",
           "{\"camera_angle_x\": 0.9272952180016122, \"frames\": [" FRAME("./train/r_1", "", SIDE) "," FRAME(
               "./train/r_0", "", IDENTITY) "]}");
  put_text(&p, "transforms_test.json",
           "{\"camera_angle_x\": 0.9272952180016122, \"frames\": [" FRAME(".\\\\test\\\\r_0", "", IDENTITY) "]}");
  put_text(&p, "transforms_val.json", "no JSON, never read");
  vt_views v = load_name(&p, ".");
  assert_int_equal(v.count, 3);
  assert_string_equal(v.items[0].name, "train/r_1.pam"); // the order of the file
  assert_string_equal(v.items[1].name, "train/r_0.pam");
  assert_string_equal(v.items[2].name, "test/r_0.pam");
  assert_int_equal(v.items[1].role, VT_TRAIN);
  assert_int_equal(v.items[2].role, VT_TEST);
  const vt_camera *c = &v.items[1].camera;
  assert_close(c->fx, 8, 1e-12); // tan of half the angle is 1/2
  assert_close(c->fy, 8, 1e-12);
  expect_pixel(c, 0, 0, -2, 4, 3, 1e-12);              // the middle of the picture is between its middle pixels
  expect_pixel(c, 1, 0, -2, 8, 3, 1e-12);              // right edge
  expect_pixel(c, 0, 0.5, -2, 4, 1, 1e-12);            // up is towards the first row
  expect_pixel(c, -0.875, 0.625, -2, 0.5, 0.5, 1e-12); // the centre of the first pixel
  c = &v.items[0].camera;
  assert_close(vt_camera_centre(c).x, 5, 1e-12);
  assert_close(vt_camera_centre(c).z, 1, 1e-12);
  assert_close(vt_camera_forward(c).x, -1, 1e-12);
  expect_pixel(c, 3, 0, 1.5, 4, 1, 1e-12);
  expect_pixel(c, 3, 0.5, 1, 6, 3, 1e-12);
  vt_free_views(p.context, &v);
  v = load_name(&p, "transforms_train.json"); // brings the test views along
  assert_int_equal(v.count, 3);
  vt_free_views(p.context, &v);
  v = load_name(&p, "transforms_test.json");
  assert_int_equal(v.count, 1);
  assert_int_equal(v.items[0].role, VT_TEST);
  vt_free_views(p.context, &v);
  close_place(&p);
}

static void pictures_with_alpha_stay_as_they_are_to_the_last_bit(void **state) {
  (void)state;
  place p = open_place();
  vt_image picture = make_picture(&p, 9, 7, 4);
  put_image(&p, "a.pam", &picture);
  put_text(&p, "transforms.json", "{\"fl_x\": 9, \"frames\": [" FRAME("a.pam", "", IDENTITY) "]}");
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  vt_capture_report report;
  vt_views v = load(&p, &desc, &report);
  assert_int_equal(report.kind, VT_SOURCE_TRANSFORMS);
  assert_int_equal(report.matte, VT_MATTE_ALPHA);
  assert_int_equal(report.photograph_count, 1);
  assert_true(isnan(report.reprojection_error));
  assert_true(same_pixels(&picture, &v.items[0].picture));
  vt_free_views(p.context, &v);
  vt_free_capture_report(p.context, &report);
  desc.matte = VT_MATTE_NONE;
  v = load(&p, &desc, NULL);
  for (int i = 0; i < 9 * 7; i++) {
    assert_memory_equal(v.items[0].picture.pixels + 4 * i, picture.pixels + 4 * i, 3);
    assert_int_equal(v.items[0].picture.pixels[4 * i + 3], 255);
  }
  vt_free_views(p.context, &v);
  vt_free_image(p.context, &picture);
  close_place(&p);
}

static void lenses_of_frames_go_before_the_lens_of_the_file(void **state) {
  (void)state;
  place p = open_place();
  put_picture(&p, "a.pam", 8, 6, 4);
  put_picture(&p, "b.pam", 16, 12, 4);
  put_text(&p, "transforms.json",
           "{\"camera_model\": \"OPENCV\", \"w\": 16, \"h\": 12, \"fl_x\": 20, \"fl_y\": 22, \"cx\": 7, \"cy\": 6.5,"
           " \"k1\": 0.1, \"k2\": 0.2, \"p1\": 0.3, \"p2\": 0.4, \"k3\": 0.5, \"test_filenames\": [\"b.pam\"], "
           "\"frames\": [" FRAME("a.pam", "", IDENTITY) "," FRAME(
               "b.pam", ",\"fl_x\": 30, \"fl_y\": 31, \"k1\": 0, \"k2\": 0, \"p1\": 0, \"p2\": 0, \"k3\": 0",
               IDENTITY) "," FRAME("b.pam",
                                   ",\"is_fisheye\": true, \"k4\": 0.6, \"camera_angle_x\": 0.9272952180016122",
                                   IDENTITY) "]}");
  vt_photos photos = {0};
  assert_int_equal(vt_read_transforms(p.context, at(&p, "transforms.json"), VT_TRAIN, &photos), VT_OK);
  assert_int_equal(photos.count, 3);
  const vt_lens *l = &photos.items[0].lens; // half the size that the file says
  assert_int_equal(l->model, VT_LENS_OPENCV);
  assert_int_equal(l->width, 8);
  assert_close(l->fx, 10, 1e-12);
  assert_close(l->fy, 11, 1e-12);
  assert_close(l->cx, 3.5, 1e-12);
  assert_close(l->cy, 3.25, 1e-12);
  for (int i = 0; i < 8; i++) assert_close(l->k[i], i < 5 ? 0.1 * (i + 1) : 0, 1e-12);
  l = &photos.items[1].lens;
  assert_true(vt_lens_is_pinhole(l));
  assert_close(l->fx, 30, 1e-12);
  assert_close(l->fy, 31, 1e-12);
  assert_close(l->cx, 7, 1e-12);
  assert_int_equal(photos.items[0].role, VT_TRAIN);
  assert_int_equal(photos.items[1].role, VT_TEST);
  l = &photos.items[2].lens;
  assert_int_equal(l->model, VT_LENS_FISHEYE);
  assert_close(l->fx, 16, 1e-12);
  assert_close(l->k[2], 0.5, 1e-12);
  assert_close(l->k[3], 0.6, 1e-12);
  vt_free_photos(p.context, &photos);
  close_place(&p);
}

static void scaled_and_rounded_matrices_become_rotations(void **state) {
  (void)state;
  place p = open_place();
  put_picture(&p, "a.pam", 8, 6, 4);
  put_text(
      &p, "transforms.json",
      "{\"fl_x\": 8, \"frames\": [" FRAME("a.pam", "", "[[0,0,1000,5],[1000,0,0,0],[0,1000,0,1],[0,0,0,1]]") "," FRAME(
          "a.pam", "", "[[0,0,1e-5,5],[1e-5,0,0,0],[0,1e-5,0,1]]") "," FRAME("a.pam", "",
                                                                             "[[0.0001,0,1,5],[1.0002,0,0.0001,0],[0,0."
                                                                             "9999,0,1],[0,0,0,1]]") "]}");
  vt_views v = load_name(&p, "transforms.json");
  for (int n = 0; n < 3; n++) {
    const double *m = v.items[n].camera.rotation.m;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        assert_close(m[3 * i] * m[3 * j] + m[3 * i + 1] * m[3 * j + 1] + m[3 * i + 2] * m[3 * j + 2], i == j, 1e-14);
    expect_pixel(&v.items[n].camera, 3, 0, 1.5, 4, 1, n < 2 ? 1e-10 : 1e-2);
    assert_close(vt_camera_centre(&v.items[n].camera).x, 5, 1e-12);
  }
  vt_free_views(p.context, &v);
  close_place(&p);
}

static void pictures_are_reduced_by_a_whole_factor_and_cameras_with_them(void **state) {
  (void)state;
  place p = open_place();
  put_picture(&p, "a.pam", 17, 10, 4); // 17 is no multiple of 3: the last column covers less
  put_text(&p, "transforms.json", "{\"fl_x\": 20, \"frames\": [" FRAME("a.pam", "", IDENTITY) "]}");
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  vt_views whole = load(&p, &desc, NULL);
  desc.max_image_size = 6;
  vt_views v = load(&p, &desc, NULL);
  assert_int_equal(v.items[0].picture.width, 6);
  assert_int_equal(v.items[0].picture.height, 4);
  assert_int_equal(v.items[0].camera.width, 6);
  double large[2], small[2];
  assert_true(vt_project(&whole.items[0].camera, vt_v3(0.7, 0.3, -2), large));
  assert_true(vt_project(&v.items[0].camera, vt_v3(0.7, 0.3, -2), small));
  assert_close(small[0], large[0] / 3, 1e-12);
  assert_close(small[1], large[1] / 3, 1e-12);
  vt_free_views(p.context, &whole);
  vt_free_views(p.context, &v);
  close_place(&p);
}

// ---- masks

// Loads a capture of one opaque picture with a mask under `name` and expects that mask as alpha.
static void expect_mask_rule(const char *picture, const char *name, const char *frame_more) {
  place p = open_place();
  char text[1024];
  put_picture(&p, picture, 8, 6, 3);
  vt_image mask = {0};
  assert_int_equal(vt_make_image(p.context, 8, 6, 1, &mask), VT_OK);
  for (int i = 0; i < 48; i++) mask.pixels[i] = (uint8_t)(i * 5);
  put_image(&p, name, &mask);
  snprintf(text, sizeof text,
           "{\"fl_x\": 9, \"frames\": [{\"file_path\": \"%s\"%s, \"transform_matrix\": " IDENTITY "}]}", picture,
           frame_more);
  put_text(&p, "transforms.json", text);
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  for (int inverted = 0; inverted < 2; inverted++) {
    vt_capture_report report;
    desc.invert_masks = inverted;
    vt_views v = load(&p, &desc, &report);
    assert_int_equal(report.matte, VT_MATTE_MASKS);
    for (int i = 0; i < 48; i++)
      assert_int_equal(v.items[0].picture.pixels[4 * i + 3], inverted ? 255 - mask.pixels[i] : mask.pixels[i]);
    vt_free_views(p.context, &v);
    vt_free_capture_report(p.context, &report);
  }
  vt_free_image(p.context, &mask);
  close_place(&p);
}

static void masks_are_found_by_every_rule_of_naming(void **state) {
  (void)state;
  expect_mask_rule("images/sub/a.pam", "elsewhere/m.pam", ", \"mask_path\": \"./elsewhere/m.pam\"");
  expect_mask_rule("images/sub/a.pam", "masks/sub/a.pam", "");
#ifdef VT_WITH_OPENIMAGEIO
  static const char *const names[] = {"masks/sub/a.pam.png",   "masks/sub/a.png",           "images/sub/a.mask.png",
                                      "images/sub/a_mask.png", "images/sub/a.pam.mask.png", "masks/sub/a.mask.png",
                                      "masks/sub/a_mask.png",  "masks/sub/a.pam.mask.png",  ".mask/sub/a.png"};
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) expect_mask_rule("images/sub/a.pam", names[i], "");
  expect_mask_rule("a.pam", "masks/a.png", ", \"mask_path\": \"gone.png\""); // a wrong mask_path is no end
#endif
}

static void a_missing_mask_leaves_the_photograph_out_and_says_so(void **state) {
  (void)state;
  place p = open_place();
  put_picture(&p, "a.pam", 8, 6, 3);
  put_picture(&p, "b.pam", 8, 6, 3);
  put_picture(&p, "mine/b.pam", 16, 12, 1); // twice the size
  put_text(&p, "transforms.json",
           "{\"fl_x\": 9, \"frames\": [" FRAME("a.pam", "", IDENTITY) "," FRAME("b.pam", "", IDENTITY) "]}");
  char masks[1024];
  snprintf(masks, sizeof masks, "%s", at(&p, "mine"));
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  desc.masks = masks;
  vt_capture_report report;
  vt_views v = load(&p, &desc, &report);
  assert_int_equal(v.count, 1);
  assert_string_equal(v.items[0].name, "b.pam");
  assert_int_equal(report.photograph_count, 2);
  assert_int_equal(report.left_out_count, 1);
  assert_string_equal(report.left_out[0], "a.pam: no mask, which the others have");
  vt_image mask = make_picture(&p, 16, 12, 1);
  for (int y = 0; y < 6; y++) // each pixel is the mean of its four
    for (int x = 0; x < 8; x++) {
      const uint8_t *m = mask.pixels + 32 * y + 2 * x;
      assert_close(v.items[0].picture.pixels[4 * (8 * y + x) + 3], (m[0] + m[1] + m[16] + m[17]) / 4.0, 0.51);
    }
  vt_free_image(p.context, &mask);
  vt_free_views(p.context, &v);
  vt_free_capture_report(p.context, &report);
  close_place(&p);
}

static void a_smaller_mask_is_enlarged_without_a_shift(void **state) {
  (void)state;
  place p = open_place();
  put_picture(&p, "a.pam", 64, 4, 3);
  put_text(&p, "transforms.json", "{\"fl_x\": 9, \"frames\": [" FRAME("a.pam", "", IDENTITY) "]}");
  vt_image mask = {0};
  assert_int_equal(vt_make_image(p.context, 16, 1, 1, &mask), VT_OK);
  for (int x = 0; x < 16; x++) mask.pixels[x] = (uint8_t)(16 * x + 8); // value = 16 (x + 0.5)
  put_image(&p, "masks/a.pam", &mask);
  vt_views v = load_name(&p, ".");
  for (int x = 2; x < 62; x++) assert_close(v.items[0].picture.pixels[4 * x + 3], 4 * (x + 0.5), 0.51);
  vt_free_image(p.context, &mask);
  vt_free_views(p.context, &v);
  close_place(&p);
}

// ---- writing and reading again

static inline void expect_same_views(const vt_views *a, const vt_views *b) {
  assert_int_equal(a->count, b->count);
  for (int i = 0; i < a->count; i++) {
    const vt_camera *c = &a->items[i].camera;
    assert_int_equal(a->items[i].role, b->items[i].role);
    assert_true(same_pixels(&a->items[i].picture, &b->items[i].picture));
    for (int n = 0; n < 60; n++) { // points all over the picture, near and far
      vt_ray ray = vt_camera_ray(c, n * 7 % 61 / 60.0 * c->width, n * 11 % 59 / 58.0 * c->height);
      vt_vec3 point = vt_add(ray.origin, vt_scale(ray.direction, exp(0.2 * (n - 20))));
      double pa[2], pb[2];
      assert_true(vt_project(c, point, pa) && vt_project(&b->items[i].camera, point, pb));
      assert_close(pa[0], pb[0], 1e-6);
      assert_close(pa[1], pb[1], 1e-6);
    }
  }
}

#ifdef VT_WITH_OPENIMAGEIO
static vt_views make_views(place *p, int count, int test_from) {
  static const char *const names[] = {"images/a.jpg", "b/c.jpg", "b/c.png", "../x/./y.tif", "/root/z.png", "b/c_2.jpg"};
  vt_views views = {.count = count, .items = VT_NEW(p->context, vt_view, (size_t)count)};
  for (int i = 0; i < count; i++) {
    vt_view *view = &views.items[i];
    view->name = vt_strdup(p->context, names[i % 6]);
    view->role = i >= test_from ? VT_TEST : VT_TRAIN;
    view->picture = make_picture(p, 20 + i, 15, 4);
    view->camera =
        vt_look_at(vt_v3(3 * cos(i), 3 * sin(i), 1 + 0.1 * i), vt_v3(0.1, 0.2, 1), vt_v3(0, 0, 1), 0.6, 20 + i, 15);
    view->camera.cx += 0.37;
    view->camera.fy *= 1.01;
  }
  return views;
}

static void written_captures_read_back_the_same(void **state) {
  (void)state;
  place p = open_place();
  for (int test_from = 6; test_from >= 0; test_from -= 3) { // no test views, some, nothing else
    char folder[1024];
    snprintf(folder, sizeof folder, "%s", at(&p, "out//"));
    vt_views views = make_views(&p, 6, test_from);
    assert_int_equal(vt_write_capture(p.context, &views, folder), VT_OK); // replaces the one before
    assert_int_equal(vt_is_file(at(&p, "out/transforms.json")), test_from == 6);
    assert_int_equal(vt_is_file(at(&p, "out/transforms_train.json")), test_from == 3);
    assert_int_equal(vt_is_file(at(&p, "out/transforms_test.json")), test_from < 6);
    assert_true(vt_is_file(at(&p, "out/images/a.png")));
    assert_true(vt_is_file(at(&p, "out/images/b/c.png")));
    vt_views again = load_name(&p, "out");
    expect_same_views(&views, &again);
    vt_free_views(p.context, &views);
    vt_free_views(p.context, &again);
  }
  vt_names left = {0};
  assert_int_equal(vt_list_folder(p.context, p.root, false, &left), VT_OK);
  assert_int_equal(left.count, 1); // no temporary folder stays
  vt_free_names(p.context, &left);
  close_place(&p);
}

static void other_peoples_folders_are_never_replaced(void **state) {
  (void)state;
  place p = open_place();
  char folder[1024];
  snprintf(folder, sizeof folder, "%s", at(&p, "theirs"));
  vt_views views = make_views(&p, 3, 3);
  put_text(&p, "theirs/transforms.json", "{\"frames\": []}");
  put_picture(&p, "theirs/images/a.pam", 8, 6, 3);
  assert_int_equal(vt_write_capture(p.context, &views, folder), VT_FAILED);
  assert_non_null(strstr(vt_last_error(p.context), "theirs"));
  assert_true(vt_is_file(at(&p, "theirs/images/a.pam")));
  assert_true(vt_remove_folder(p.context, folder));
  assert_int_equal(vt_make_folder(p.context, folder), VT_OK); // an empty one is taken
  vt_clear_error(p.context);
  assert_int_equal(vt_write_capture(p.context, &views, folder), VT_OK);
  put_text(&p, "theirs/notes.txt", "mine"); // something was put into it since
  assert_int_equal(vt_write_capture(p.context, &views, folder), VT_FAILED);
  assert_true(vt_is_file(at(&p, "theirs/notes.txt")));
  vt_free_views(p.context, &views);
  close_place(&p);
}

// ---- captures that others made

static bool has_datasets(const char *name) {
  char path[1024];
  snprintf(path, sizeof path, "%s/%s", VT_DATASETS_DIR, name);
  return vt_is_folder(path);
}

static vt_views load_dataset(place *p, const char *name, int size, vt_capture_report *report) {
  char path[1024];
  snprintf(path, sizeof path, "%s/%s", VT_DATASETS_DIR, name);
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = path;
  desc.max_image_size = size;
  return load(p, &desc, report);
}

// ---- do cameras and mattes agree? The silhouettes carve a grid of GRID^3 points; what is left must cover each of
// them. With wrong axes, a mirrored picture or a wrong focal length the views carve away what the others show.

enum { GRID = 64 };

static vt_vec3 nearest_to_axes(const vt_views *v) { // the point nearest to all optical axes, by least squares
  double a[9] = {0}, b[3] = {0};
  for (int i = 0; i < v->count; i++) {
    vt_vec3 forward = vt_camera_forward(&v->items[i].camera), centre = vt_camera_centre(&v->items[i].camera);
    double d[3] = {forward.x, forward.y, forward.z}, o[3] = {centre.x, centre.y, centre.z};
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) {
        a[3 * r + c] += (r == c) - d[r] * d[c];
        b[r] += ((r == c) - d[r] * d[c]) * o[c];
      }
  }
  for (int step = 0; step < 3; step++) // Gauss; the matrix is positive definite
    for (int r = 0; r < 3; r++) {
      double f = r == step ? 0 : a[3 * r + step] / a[4 * step];
      for (int c = 0; c < 3; c++) a[3 * r + c] -= f * a[3 * step + c];
      b[r] -= f * b[step];
    }
  return vt_v3(b[0] / a[0], b[1] / a[4], b[2] / a[8]);
}

// The pixels [box[0], box[2]) x [box[1], box[3]) that a cube of that half edge around the point may cover; false if it
// is behind or outside.
static bool cover(const vt_camera *c, vt_vec3 point, double half, int box[4]) {
  double pixel[2], z = vt_to_camera(c, point).z, radius = 1.8 * half * c->fx / (z - 1.8 * half);
  if (z <= 2 * half || !vt_project(c, point, pixel)) return false;
  box[0] = (int)floor(pixel[0] - radius), box[1] = (int)floor(pixel[1] - radius);
  box[2] = (int)ceil(pixel[0] + radius), box[3] = (int)ceil(pixel[1] + radius);
  return box[0] >= 0 && box[1] >= 0 && box[2] <= c->width && box[3] <= c->height;
}

// The lowest share, over the views, of silhouette pixels that the carved grid covers.
static double hull_coverage(place *p, const vt_views *v) {
  int count = v->count, width = v->items[0].picture.width, height = v->items[0].picture.height, box[4];
  int pixels = width * height, stride = width + 1, table = stride * (height + 1);
  int *sums = VT_NEW(p->context, int, (size_t)(table * count)); // of alpha > 0, from the corner
  uint8_t *covered = VT_NEW(p->context, uint8_t, (size_t)(pixels * count));
  for (int i = 0; i < count; i++) {
    int *s = sums + i * table;
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        s[(y + 1) * stride + x + 1] = (v->items[i].picture.pixels[4 * (y * width + x) + 3] > 0) +
                                      s[y * stride + x + 1] + s[(y + 1) * stride + x] - s[y * stride + x];
  }
  vt_vec3 middle = nearest_to_axes(v);
  double reach = vt_length(vt_sub(vt_camera_centre(&v->items[0].camera), middle));
  double half_box = reach * fmin(0.9, 0.55 * width / v->items[0].camera.fx), half = half_box / GRID;
  for (int n = 0; n < GRID * GRID * GRID; n++) {
    vt_vec3 point =
        vt_add(middle, vt_v3((2 * (n % GRID) + 1) * half - half_box, (2 * (n / GRID % GRID) + 1) * half - half_box,
                             (2 * (n / GRID / GRID) + 1) * half - half_box));
    bool kept = true;
    for (int i = 0; i < count && kept; i++) {
      const int *s = sums + i * table;
      if (!cover(&v->items[i].camera, point, half, box)) continue; // not seen whole: not carved
      kept = s[box[3] * stride + box[2]] - s[box[1] * stride + box[2]] - s[box[3] * stride + box[0]] +
                 s[box[1] * stride + box[0]] >
             0;
    }
    for (int i = 0; i < count && kept; i++)
      if (cover(&v->items[i].camera, point, half, box))
        for (int y = box[1]; y < box[3]; y++)
          memset(covered + i * pixels + y * width + box[0], 1, (size_t)(box[2] - box[0]));
  }
  double lowest = 1;
  for (int i = 0; i < count; i++) {
    double inside = 0, both = 0;
    for (int k = 0; k < pixels; k++)
      if (v->items[i].picture.pixels[4 * k + 3] > 127) inside++, both += covered[i * pixels + k];
    assert_true(inside > 0);
    lowest = fmin(lowest, both / inside);
  }
  vt_free(p->context, sums);
  vt_free(p->context, covered);
  return lowest;
}

// Cameras as somebody would read them who forgets the turn from OpenGL's axes to ours about x, but looks the right way:
// pictures are upside down and mirrored.
static void turn_pictures_over(vt_views *v) {
  for (int i = 0; i < v->count; i++)
    for (int k = 0; k < 6; k++) v->items[i].camera.rotation.m[k] *= -1;
  for (int i = 0; i < v->count; i++) v->items[i].camera.translation.x *= -1, v->items[i].camera.translation.y *= -1;
}

static void expect_agreement(place *p, vt_views *v) {
  double right = hull_coverage(p, v);
  turn_pictures_over(v);
  double wrong = hull_coverage(p, v);
  turn_pictures_over(v);
  printf("silhouettes covered by their hull: %.4f, with wrong axes %.4f\n", right, wrong);
  assert_true(right > 0.995);
  assert_true(wrong < 0.9);
}

static void the_maple_has_48_and_12_views_that_look_at_one_tree(void **state) {
  (void)state;
  if (!has_datasets("maple")) skip();
  place p = open_place();
  vt_capture_report report;
  vt_views v = load_dataset(&p, "maple", 0, &report);
  assert_int_equal(vt_count_views(&v, VT_TRAIN), 48);
  assert_int_equal(vt_count_views(&v, VT_TEST), 12);
  assert_int_equal(report.matte, VT_MATTE_ALPHA);
  assert_int_equal(v.items[0].picture.width, 400);
  expect_agreement(&p, &v);
  char folder[1024];
  snprintf(folder, sizeof folder, "%s", at(&p, "maple"));
  assert_int_equal(vt_write_capture(p.context, &v, folder), VT_OK);
  vt_views again = load_name(&p, "maple");
  expect_same_views(&v, &again);
  vt_free_views(p.context, &again);
  vt_free_views(p.context, &v);
  vt_free_capture_report(p.context, &report);
  close_place(&p);
}

static void the_virtual_plant_has_18_views_with_masks(void **state) {
  (void)state;
  if (!has_datasets("virtual-plant")) skip();
  place p = open_place();
  vt_capture_report report;
  vt_views v = load_dataset(&p, "virtual-plant", 300, &report);
  assert_int_equal(v.count, 18);
  assert_int_equal(report.matte, VT_MATTE_MASKS);
  assert_int_equal(report.left_out_count, 0);
  assert_int_equal(v.items[0].picture.width, 299); // 896 / 3
  expect_agreement(&p, &v);
  vt_free_views(p.context, &v);
  vt_free_capture_report(p.context, &report);
  close_place(&p);
}

static void views_are_the_same_for_any_number_of_threads(void **state) {
  (void)state;
  if (!has_datasets("virtual-plant")) skip();
  vt_views views[2];
  vt_context *contexts[2];
  for (int i = 0; i < 2; i++) {
    vt_context_desc desc = vt_default_context_desc();
    desc.log_level = VT_LOG_QUIET;
    desc.thread_count = i ? 7 : 1;
    place p = {.context = contexts[i] = vt_create_context(&desc)};
    views[i] = load_dataset(&p, "virtual-plant", 200, NULL);
  }
  for (int n = 0; n < views[0].count; n++)
    assert_true(same_pixels(&views[0].items[n].picture, &views[1].items[n].picture));
  for (int i = 0; i < 2; i++) {
    vt_free_views(contexts[i], &views[i]);
    vt_destroy_context(contexts[i]);
  }
}
#endif
#else
static void a_build_without_json_says_that_it_cannot_read_transforms(void **state) {
  (void)state;
  place p = open_place();
  vt_views views = {0};
  put_text(&p, "transforms.json", "{\"frames\": []}");
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  assert_int_equal(vt_load_views(p.context, &desc, &views, NULL), VT_MISSING_PROGRAM);
  close_place(&p);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(nerf_files_without_endings_and_opengl_axes_are_understood),
      cmocka_unit_test(pictures_with_alpha_stay_as_they_are_to_the_last_bit),
      cmocka_unit_test(lenses_of_frames_go_before_the_lens_of_the_file),
      cmocka_unit_test(scaled_and_rounded_matrices_become_rotations),
      cmocka_unit_test(pictures_are_reduced_by_a_whole_factor_and_cameras_with_them),
      cmocka_unit_test(masks_are_found_by_every_rule_of_naming),
      cmocka_unit_test(a_missing_mask_leaves_the_photograph_out_and_says_so),
      cmocka_unit_test(a_smaller_mask_is_enlarged_without_a_shift),
#ifdef VT_WITH_OPENIMAGEIO
      cmocka_unit_test(written_captures_read_back_the_same),
      cmocka_unit_test(other_peoples_folders_are_never_replaced),
      cmocka_unit_test(the_maple_has_48_and_12_views_that_look_at_one_tree),
      cmocka_unit_test(the_virtual_plant_has_18_views_with_masks),
      cmocka_unit_test(views_are_the_same_for_any_number_of_threads),
#endif
#else
      cmocka_unit_test(a_build_without_json_says_that_it_cannot_read_transforms),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
