// test_ignored.c - pixels that are not to be looked at say nothing, neither that there is a tree nor that there is none
// SPDX-License-Identifier: BSD-3-Clause

#include "base/image_metrics.h"
#include "capture/masks.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/reconstruct.h"
#include "render/render.h"
#include "tests/capture_folders.h"

// ---- a post in front of the tree

enum { SIZE = 64, VIEWS = 24, HALF_WIDTH = 3 };
typedef enum post { NO_POST, AS_BACKDROP, AS_TREE, IGNORED } post;

// A post stands at (1.7, 0.2), where half of the photographs have it before the tree.
static void put_post(vt_context *context, vt_views *views, post how) {
  for (int i = 0; i < views->count && how != NO_POST; i++) {
    vt_view *view = &views->items[i];
    double pixel[2];
    vt_vec3 foot = vt_v3(1.7, 0.2, 0);
    bool before = vt_to_camera(&view->camera, foot).z < vt_to_camera(&view->camera, vt_v3(0, 0, 0)).z;
    if (view->role == VT_TEST || !before || !vt_project(&view->camera, foot, pixel)) continue;
    if (how == IGNORED) assert_int_equal(vt_make_image(context, SIZE, SIZE, 1, &view->ignored), VT_OK);
    for (int y = 0; y < SIZE; y++)
      for (int x = 0; x < SIZE; x++) {
        if (fabs(x + 0.5 - pixel[0]) > HALF_WIDTH) continue;
        uint8_t *at = view->picture.pixels + 4 * (y * SIZE + x);
        memset(at, 90, 3);
        at[3] = how == AS_TREE ? 255 : 0;
        if (how == IGNORED) view->ignored.pixels[y * SIZE + x] = 255;
      }
  }
}

static double held_out_alpha(vt_context *context, const vt_tree *tree, const vt_views *views) {
  const float white[3] = {1, 1, 1};
  double sum = 0;
  int count = 0;
  for (int i = 0; i < views->count; i++) {
    if (views->items[i].role != VT_TEST) continue;
    vt_fimage picture;
    vt_metrics metrics;
    vt_view_weights weights = vt_choose_views(tree, vt_camera_centre(&views->items[i].camera), 4);
    assert_int_equal(vt_composite(context, tree, tree->octree.level_count - 1, &weights, VT_BLEND_SUM, false,
                                  &views->items[i].camera, &picture), VT_OK);
    assert_int_equal(vt_measure(context, &picture, &views->items[i].picture, white, &metrics), VT_OK);
    sum += metrics.alpha_rmse, count++;
    vt_free_fimage(context, &picture);
  }
  return sum / count;
}

static double error_with(vt_context *context, vt_method method, post how, double *edge) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = VT_SYNTHETIC_BLOBS;
  desc.train_count = VIEWS;
  desc.test_count = 6;
  desc.width = desc.height = SIZE;
  desc.peak_extinction = 2;
  vt_views views;
  vt_tree tree;
  vt_reconstruct_desc reconstruct = vt_default_reconstruct_desc(method, VT_PRESET_DRAFT);
  reconstruct.leaf_level = method == VT_METHOD_BEST ? 5 : 4;
  assert_int_equal(vt_make_synthetic_views(context, &desc, &views), VT_OK);
  put_post(context, &views, how);
  assert_int_equal(vt_reconstruct(context, &reconstruct, &views, &tree, NULL), VT_OK);
  double error = held_out_alpha(context, &tree, &views);
  *edge = tree.octree.edge;
  vt_free_tree(context, &tree);
  vt_free_views(context, &views);
  return error;
}

static void an_ignored_post_leaves_the_tree_that_is_there_without_it(void **state) {
  (void)state;
  place p = open_place();
  static const vt_method methods[] = {VT_METHOD_BEST, VT_METHOD_2006};
  for (int m = 0; m < 2; m++) {
    double error[4], edge[4];
    for (int how = 0; how < 4; how++) error[how] = error_with(p.context, methods[m], (post)how, &edge[how]);
    printf("held-out alpha RMSE %.4f; with a post seen as backdrop %.4f, as tree %.4f, ignored %.4f\n", error[NO_POST],
           error[AS_BACKDROP], error[AS_TREE], error[IGNORED]);
    assert_true(fmax(error[AS_BACKDROP], error[AS_TREE]) > 2 * error[NO_POST]); // what --ignore is for
    assert_true(error[IGNORED] < 1.15 * error[NO_POST] + 0.002);
    assert_close(edge[IGNORED], edge[NO_POST], 0.1 * edge[NO_POST]);
  }
  close_place(&p);
}

// ---- from files to views

#define IDENTITY "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"
#define FRAME(name, more) "{\"file_path\": \"" name "\"" more ", \"transform_matrix\": " IDENTITY "}"

// White from column `from` on.
static inline void put_half(place *p, const char *name, int width, int height, int from) {
  vt_image mask = {0};
  assert_int_equal(vt_make_image(p->context, width, height, 1, &mask), VT_OK);
  for (int i = 0; i < width * height; i++) mask.pixels[i] = i % width >= from ? 255 : 0;
  put_image(p, name, &mask);
  vt_free_image(p->context, &mask);
}

#ifdef VT_WITH_JANSSON
static void put_capture(place *p, const char *more) {
  char text[1024];
  put_picture(p, "images/a.pam", 12, 8, 4);
  put_picture(p, "images/b.pam", 12, 8, 4);
  snprintf(text, sizeof text, "{\"fl_x\": 9, %s \"frames\": [" FRAME("images/a.pam", "") "," FRAME("images/b.pam", "") "]}", more);
  put_text(p, "transforms.json", text);
}

static void expect_ignored(const vt_view *view, int from) { // from < 0: nothing
  int width = view->picture.width, height = view->picture.height;
  if (from < 0) {
    assert_null(view->ignored.pixels);
    return;
  }
  assert_int_equal(view->ignored.width, width);
  assert_int_equal(view->ignored.height, height);
  for (int i = 0; i < width * height; i++) {
    assert_int_equal(view->ignored.pixels[i], i % width >= from ? 255 : 0);
    if (i % width >= from) assert_int_equal(view->picture.pixels[4 * i + 3], 0);
  }
  assert_true(view->picture.pixels[4 * (width * height - width) + 3] > 0); // the rest is as it was
}

static void masks_of_what_to_ignore_are_found_by_name_and_go_with_the_view(void **state) {
  (void)state;
  place p = open_place();
  char ignore[1024], out[1024];
  put_capture(&p, "");
  put_half(&p, "posts/a.pam", 12, 8, 7);
  snprintf(ignore, sizeof ignore, "%s", at(&p, "posts"));
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  desc.ignore = ignore;
  vt_views v = load(&p, &desc, NULL);
  expect_ignored(&v.items[0], 7);
  expect_ignored(&v.items[1], -1); // one without a mask counts whole
#ifdef VT_WITH_OPENIMAGEIO
  snprintf(out, sizeof out, "%s", at(&p, "out"));
  assert_int_equal(vt_write_capture(p.context, &v, out), VT_OK);
  assert_true(vt_is_file(at(&p, "out/ignored/a.png")));
  assert_false(vt_is_file(at(&p, "out/ignored/b.png")));
  vt_views again = load_name(&p, "out");
  expect_ignored(&again.items[0], 7);
  expect_ignored(&again.items[1], -1);
  assert_int_equal(vt_write_capture(p.context, &again, out), VT_OK); // replaces what it wrote itself
  vt_free_views(p.context, &again);
#else
  (void)out;
#endif
  vt_free_views(p.context, &v);
  desc.max_image_size = 4; // by 3: pixels 7 and 8 share theirs with what is ignored
  v = load(&p, &desc, NULL);
  expect_ignored(&v.items[0], 2);
  vt_free_views(p.context, &v);
  desc.max_image_size = 0;
  put_half(&p, "one.pam", 24, 16, 10); // one for all, of another size
  snprintf(ignore, sizeof ignore, "%s", at(&p, "one.pam"));
  v = load(&p, &desc, NULL);
  for (int i = 0; i < 2; i++) expect_ignored(&v.items[i], 5);
  vt_free_views(p.context, &v);
  close_place(&p);
}

static void what_to_ignore_and_does_not_fit_is_refused_by_name(void **state) {
  (void)state;
  static const char *const words[] = {"no such folder", "fits a photograph", "another shape"};
  for (int i = 0; i < 3; i++) {
    place p = open_place();
    char ignore[1024];
    put_capture(&p, "");
    if (i == 1) put_half(&p, "posts/z.pam", 12, 8, 7);
    if (i == 2) put_half(&p, "posts/a.pam", 12, 9, 7);
    snprintf(ignore, sizeof ignore, "%s", at(&p, "posts"));
    vt_capture_desc desc = vt_default_capture_desc();
    vt_views v = {0};
    desc.source = p.root;
    desc.ignore = ignore;
    assert_int_equal(vt_load_views(p.context, &desc, &v, NULL), VT_BAD_INPUT);
    const char *sentence = vt_last_error(p.context);
    if (!strstr(sentence, "posts") || !strstr(sentence, words[i]) || !strchr(sentence, ';')) fail_msg("%d: %s\n", i, sentence);
    assert_int_equal(v.count, 0);
    close_place(&p);
  }
}

static void paths_of_masks_that_are_no_text_or_not_there_are_refused(void **state) {
  (void)state;
  static const char *const frames[] = {", \"mask_path\": 3", ", \"ignore_path\": [1]", ", \"ignore_path\": \"gone.pam\""};
  static const char *const words[] = {"mask_path", "ignore_path", "gone.pam"};
  for (int i = 0; i < 3; i++) {
    place p = open_place();
    char text[512];
    put_picture(&p, "a.pam", 12, 8, 4);
    snprintf(text, sizeof text,
             "{\"fl_x\": 9, \"frames\": [{\"file_path\": \"a.pam\"%s, \"transform_matrix\": " IDENTITY "}]}", frames[i]);
    put_text(&p, "transforms.json", text);
    vt_capture_desc desc = vt_default_capture_desc();
    vt_views v = {0};
    desc.source = p.root;
    assert_int_equal(vt_load_views(p.context, &desc, &v, NULL), VT_BAD_INPUT);
    const char *sentence = vt_last_error(p.context);
    if (!strstr(sentence, "frame 0 (a.pam)") || !strstr(sentence, words[i]) || !strchr(sentence, ';')) fail_msg("%d: %s\n", i, sentence);
    close_place(&p);
  }
}

static void one_mask_for_all_is_the_tree_in_every_photograph(void **state) {
  (void)state;
  place p = open_place();
  char masks[1024];
  put_capture(&p, "");
  put_half(&p, "one.pam", 12, 8, 4);
  snprintf(masks, sizeof masks, "%s", at(&p, "one.pam"));
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  desc.masks = masks;
  vt_capture_report report;
  vt_views v = load(&p, &desc, &report);
  assert_int_equal(report.matte, VT_MATTE_MASKS);
  assert_int_equal(v.count, 2);
  for (int n = 0; n < 2; n++)
    for (int i = 0; i < 96; i++) assert_int_equal(v.items[n].picture.pixels[4 * i + 3], i % 12 >= 4 ? 255 : 0);
  vt_free_views(p.context, &v);
  vt_free_capture_report(p.context, &report);
  close_place(&p);
}

static void masks_of_upright_pictures_are_turned_as_their_photographs_are_stored(void **state) {
  (void)state;
  place p = open_place();
  vt_image mask = {0};
  assert_int_equal(vt_make_image(p.context, 8, 12, 1, &mask), VT_OK); // as a viewer shows a photograph of 12 x 8
  for (int i = 0; i < 96; i++) mask.pixels[i] = (uint8_t)(2 * i);
  put_image(&p, "m.pam", &mask);
  for (int turn = 5; turn <= 8; turn++) {
    char path[1024];
    double share;
    snprintf(path, sizeof path, "%s", at(&p, "m.pam"));
    vt_photo photo = {.mask = path, .upright = turn, .width = 12, .height = 8};
    vt_image picture = make_picture(&p, 12, 8, 3);
    assert_int_equal(vt_apply_mask(p.context, &photo, false, &picture, &share), VT_OK);
    for (int v = 0; v < 12; v++)
      for (int u = 0; u < 8; u++) {
        int x = turn == 5 || turn == 6 ? v : 11 - v, y = turn == 5 || turn == 8 ? u : 7 - u;
        assert_int_equal(picture.pixels[4 * (12 * y + x) + 3], mask.pixels[8 * v + u]);
      }
    vt_free_image(p.context, &picture);
  }
  vt_free_image(p.context, &mask);
  close_place(&p);
}

#ifdef VT_WITH_OPENCV
static void what_is_ignored_is_straightened_with_its_photograph(void **state) {
  (void)state;
  place p = open_place();
  char ignore[1024];
  put_picture(&p, "images/a.pam", 96, 64, 4);
  put_text(&p, "transforms.json",
           "{\"fl_x\": 90, \"k1\": -0.2, \"frames\": [" FRAME("images/a.pam", "") "]}");
  put_half(&p, "posts/a.pam", 96, 64, 80);
  snprintf(ignore, sizeof ignore, "%s", at(&p, "posts"));
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = p.root;
  desc.ignore = ignore;
  vt_views v = load(&p, &desc, NULL);
  const vt_view *view = &v.items[0];
  vt_lens lens = {VT_LENS_OPENCV, 96, 64, 90, 90, 48, 32, {-0.2}};
  for (int y = 0; y < 64; y += 9)
    for (int x = 0; x < 96; x++) {
      double pixel[2];
      vt_lens_project(&lens, (x + 0.5 - view->camera.cx) / view->camera.fx, (y + 0.5 - view->camera.cy) / view->camera.fy, pixel);
      if (fabs(pixel[0] - 80) < 3) continue; // cubic interpolation may mark two more
      assert_int_equal(view->ignored.pixels[y * 96 + x], pixel[0] > 80 ? 255 : 0);
    }
  vt_free_views(p.context, &v);
  close_place(&p);
}
#endif
#endif

#ifdef VT_WITH_OPENIMAGEIO
static void colmap_gets_black_where_nothing_is_to_be_looked_at(void **state) {
  (void)state;
  place p = open_place();
  char posts[1024], photos[1024], to[1024];
  int written = 0;
  put_picture(&p, "photos/sub/a.pam", 12, 8, 3);
  put_picture(&p, "photos/b.pam", 12, 8, 3);
  put_half(&p, "posts/sub/a.png", 24, 16, 12);
  snprintf(posts, sizeof posts, "%s", at(&p, "posts"));
  snprintf(photos, sizeof photos, "%s", at(&p, "photos"));
  snprintf(to, sizeof to, "%s", at(&p, "to"));
  char *items[] = {"b.pam", "sub/a.pam"};
  vt_names names = {2, items};
  assert_int_equal(vt_write_colmap_masks(p.context, posts, photos, &names, to, &written), VT_OK);
  assert_int_equal(written, 1);
  assert_false(vt_is_file(at(&p, "to/b.pam.png")));
  vt_image mask = {0};
  assert_int_equal(vt_read_mask(p.context, at(&p, "to/sub/a.pam.png"), &mask), VT_OK);
  assert_int_equal(mask.width, 12);
  for (int i = 0; i < 96; i++) assert_int_equal(mask.pixels[i], i % 12 >= 6 ? 0 : 255);
  vt_free_image(p.context, &mask);
  close_place(&p);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(an_ignored_post_leaves_the_tree_that_is_there_without_it),
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(masks_of_what_to_ignore_are_found_by_name_and_go_with_the_view),
      cmocka_unit_test(what_to_ignore_and_does_not_fit_is_refused_by_name),
      cmocka_unit_test(one_mask_for_all_is_the_tree_in_every_photograph),
      cmocka_unit_test(paths_of_masks_that_are_no_text_or_not_there_are_refused),
      cmocka_unit_test(masks_of_upright_pictures_are_turned_as_their_photographs_are_stored),
#ifdef VT_WITH_OPENCV
      cmocka_unit_test(what_is_ignored_is_straightened_with_its_photograph),
#endif
#endif
#ifdef VT_WITH_OPENIMAGEIO
      cmocka_unit_test(colmap_gets_black_where_nothing_is_to_be_looked_at),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
