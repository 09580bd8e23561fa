// test_exactness.c - at a photograph's own camera the tiles of 2004 and 2006 show that photograph
// SPDX-License-Identifier: BSD-3-Clause
//
// Every (view, cell) texture is kept and none is packed; the picture of the finest level is compared with the photograph reduced to
// the level's texels (vt_tiles.grid), which on a leaf level are its own pixels.

#include "base/image_metrics.h"
#include "capture/capture.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/reconstruct.h"
#include "render/render.h"
#include "tests/unit.h"

#include <unistd.h>

static const char *const method_names[] = {"2004", "2006", "best"};

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

static void make_scene(vt_context *context, const char *name, vt_views *views) {
  vt_synthetic_desc desc;
  assert_true(vt_find_scene(name, &desc));
  assert_int_equal(vt_make_synthetic_views(context, &desc, views), VT_OK);
}

// All textures kept; level 0: the method's own.
static void reconstruct(vt_context *context, const vt_views *views, vt_method method, int level, vt_tree *tree) {
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(method, VT_PRESET_NORMAL);
  desc.prune_hidden = false;
  desc.leaf_level = level;
  assert_int_equal(vt_reconstruct(context, &desc, views, tree, NULL), VT_OK);
}

static vt_metrics measure_own(vt_context *context, const vt_tree *tree, int level, int v, const vt_view *view) {
  const float white[3] = {1, 1, 1};
  vt_view_weights alone = {.count = 1, .view = {v}, .weight = {1}};
  vt_camera camera = view->camera;
  vt_image reduced = {0};
  vt_fimage picture;
  vt_metrics m;
  int grid = tree->tiles[level].grid;
  assert_true(grid >= 1);
  assert_int_equal(vt_reduce_image(context, &view->picture, grid, &reduced), VT_OK);
  camera.fx /= grid, camera.fy /= grid, camera.cx /= grid, camera.cy /= grid;
  camera.width = reduced.width, camera.height = reduced.height;
  assert_int_equal(vt_composite(context, tree, level, &alone, VT_BLEND_SUM, false, &camera, &picture), VT_OK);
  assert_int_equal(vt_measure(context, &picture, &reduced, white, &m), VT_OK);
  vt_free_fimage(context, &picture);
  vt_free_image(context, &reduced);
  return m;
}

static void check_own_photographs(vt_context *context, const char *name, const vt_views *views, vt_method method, int level) {
  vt_tree tree;
  double alpha = 0, psnr = 0, worst = 0;
  reconstruct(context, views, method, level, &tree);
  int leaf = tree.octree.level_count - 1;
  for (int i = 0, v = 0; i < views->count; i++) {
    if (views->items[i].role != VT_TRAIN) continue;
    vt_metrics m = measure_own(context, &tree, leaf, v++, &views->items[i]);
    alpha += m.alpha_rmse / tree.view_count;
    psnr += m.psnr / tree.view_count;
    worst = fmax(worst, m.alpha_rmse);
  }
  printf("%s, method %s, level %d, texels of %d pixels: alpha RMSE %.4f (worst %.4f), PSNR %.1f dB\n", name,
         method_names[method], leaf, tree.tiles[leaf].grid, alpha, worst, psnr);
  assert_true(alpha <= 0.005 && worst <= 0.01);
  assert_true(psnr >= 40);
  vt_free_tree(context, &tree);
}

static void tiles_reproduce_the_photographs_of_a_synthetic_tree(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_views views;
  make_scene(context, "tree_96", &views);
  check_own_photographs(context, "tree_96", &views, VT_METHOD_2006, 0);
  check_own_photographs(context, "tree_96", &views, VT_METHOD_2004, 0);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void tiles_reproduce_the_photographs_of_a_real_plant(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_capture_desc capture = vt_default_capture_desc();
  vt_views views = {0};
  capture.source = VT_DATASETS_DIR "/virtual-plant";
  if (access(VT_DATASETS_DIR "/virtual-plant/transforms.json", R_OK) || vt_load_views(context, &capture, &views, NULL)) {
    vt_destroy_context(context);
    skip();
  }
  vt_views small = {.count = views.count, .items = views.items};
  check_own_photographs(context, "virtual-plant", &small, VT_METHOD_2006, 6);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void texels_on_a_grid_fall_on_pixels(void **state) {
  (void)state;
  vt_camera camera = vt_look_at(vt_v3(3, 1, 2), vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.8, 150, 110);
  for (int grid = 1; grid <= 5; grid++)
    for (int i = 0; i < 200; i++) {
      vt_vec3 centre = vt_v3(0.9 * sin(i), 0.9 * cos(2.3 * i), 0.01 * i - 1);
      double pixel[2];
      vt_tile_frame frame = vt_snapped_frame_of(&camera, centre, grid, 4);
      assert_true(vt_project(&camera, centre, pixel));
      assert_true(fmod(frame.left, grid) == 0 && fmod(frame.top, grid) == 0);
      assert_close(frame.texel_scale * grid, 1, 1e-6);
      assert_true(fabs(frame.left + 2 * grid - pixel[0]) <= 0.5 * grid + 1e-4);
      assert_true(fabs(frame.top + 2 * grid - pixel[1]) <= 0.5 * grid + 1e-4);
    }
  assert_true(vt_snapped_frame_of(&camera, vt_v3(6, 2, 4), 1, 4).texel_scale == 0); // behind the camera
}

static double largest_difference(const vt_fimage *a, const vt_fimage *b) {
  double largest = 0;
  for (size_t i = 0; i < 4 * (size_t)a->width * (size_t)a->height; i++)
    largest = fmax(largest, fabs((double)a->pixels[i] - (double)b->pixels[i]));
  return largest;
}

// The grid goes into the file, and both renderers put the tiles where the compositor does.
static void a_grid_survives_the_file_and_both_renderers_draw_it(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_views views;
  vt_tree tree, back;
  const char *path = "test_exactness.vtree";
  make_scene(context, "tree_96", &views);
  reconstruct(context, &views, VT_METHOD_2006, 5, &tree);
  assert_int_equal(vt_write_tree(context, &tree, path, NULL), VT_OK);
  assert_int_equal(vt_read_tree(context, path, &back, NULL), VT_OK);
  remove(path);
  for (int l = 0; l < tree.octree.level_count; l++) assert_int_equal(back.tiles[l].grid, tree.tiles[l].grid);
  vt_render_desc desc = vt_default_render_desc();
  vt_renderer *cpu = NULL, *gl = NULL;
  assert_int_equal(vt_create_renderer(context, &back, VT_BACKEND_CPU, &cpu), VT_OK);
  vt_status with_gl = vt_create_renderer(context, &back, VT_BACKEND_GL, &gl);
  assert_true(with_gl == VT_OK || with_gl == VT_MISSING_PROGRAM);
  for (int level = 2; level <= 5; level++)
    for (int i = 0; i < 4; i++) {
      vt_camera camera = views.items[3 * i].camera;
      camera.translation.x += 0.07 * i; // 0: a photograph's own camera
      vt_fimage a, b;
      desc.level = level;
      assert_int_equal(vt_render(context, cpu, &desc, &camera, &a, NULL), VT_OK);
      if (!with_gl) {
        assert_int_equal(vt_render(context, gl, &desc, &camera, &b, NULL), VT_OK);
        assert_true(largest_difference(&a, &b) < 0.02);
        vt_free_fimage(context, &b);
      }
      vt_free_fimage(context, &a);
    }
  if (gl) vt_destroy_renderer(context, gl);
  vt_destroy_renderer(context, cpu);
  vt_free_tree(context, &back);
  vt_free_tree(context, &tree);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(tiles_reproduce_the_photographs_of_a_synthetic_tree),
                                     cmocka_unit_test(tiles_reproduce_the_photographs_of_a_real_plant),
                                     cmocka_unit_test(texels_on_a_grid_fall_on_pixels),
                                     cmocka_unit_test(a_grid_survives_the_file_and_both_renderers_draw_it)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
