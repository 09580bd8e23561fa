// test_render_twins.c - the CPU and the OpenGL renderer draw the same picture
// SPDX-License-Identifier: BSD-3-Clause

#include "render/render.h"
#include "tests/field_scenes.h"

// A renderer with OpenGL; skips the test where there is none.
static vt_renderer *gl_or_skip(vt_context *context, vt_tree *tree) {
  vt_renderer *renderer = NULL;
  vt_status status = vt_create_renderer(context, tree, VT_BACKEND_GL, &renderer);
  if (!status) return renderer;
  assert_int_equal(status, VT_MISSING_PROGRAM);
  assert_true(strstr(vt_last_error(context), "OpenGL") != NULL);
  vt_free_tree(context, tree);
  vt_destroy_context(context);
  skip();
  return NULL;
}

static const vt_vec3 eyes[] = {
    {2.6, 1.1, 1.9},     // outside, above
    {2.4, -0.4, 0.05},   // outside, at mid-height
    {-0.3, 0.05, -2.9},  // below, nearly on an axis
    {0, 3, 0},           // exactly on an axis
    {0.31, -0.22, 0.13}, // inside
    {0.0, 0.0, 0.0},     // inside, on the corner of cells
    {-0.95, 0.1, 0.2},   // at the border
    {40, 30, -20},       // far
};
#define EYES (int)(sizeof eyes / sizeof eyes[0])

// The world is scaled and shifted: see scene_move.
static void compare_moved(vt_context *context, vt_renderer *cpu, vt_renderer *gl, const vt_render_desc *desc,
                          double bound, double scale, vt_vec3 shift) {
  for (int e = 0; e < EYES; e++) {
    double fov = e == 7 ? 0.05 : 0.8;
    vt_camera camera = vt_look_at(eyes[e], vt_v3(0.02, 0.03, 0.01), vt_v3(0, 0.1, 1), fov, 150, 110);
    camera.cx += 3.3;
    camera.fy *= 1.05;
    scene_move_camera(&camera, scale, shift);
    vt_fimage a, b;
    vt_render_report of_cpu, of_gl;
    assert_int_equal(vt_render(context, cpu, desc, &camera, &a, &of_cpu), VT_OK);
    assert_int_equal(vt_render(context, gl, desc, &camera, &b, &of_gl), VT_OK);
    assert_int_equal(of_cpu.backend, VT_BACKEND_CPU);
    assert_int_equal(of_gl.backend, VT_BACKEND_GL);
    assert_true(of_cpu.billboards == of_gl.billboards && of_gl.billboards > 0 && of_cpu.level == of_gl.level);
    double largest, mean = scene_difference(&a, &b, &largest), sum = 0;
    for (int i = 0; i < 150 * 110; i++) sum += a.pixels[4 * i + 3];
    if (getenv("VT_TEST_VERBOSE"))
      printf("eye %d views %d blend %d flat %d: mean %.4f largest %.3f of 255\n", e, desc->blend_views,
             (int)desc->blend, desc->flat, mean * 255, largest * 255);
    assert_true(sum > 1000);
    assert_true(mean * 255 < bound);
    assert_true(largest * 255 < 40 * bound);
    vt_free_fimage(context, &a);
    vt_free_fimage(context, &b);
  }
}

static void compare(vt_context *context, vt_renderer *cpu, vt_renderer *gl, const vt_render_desc *desc,
                    double bound) {
  compare_moved(context, cpu, gl, desc, bound, 1, vt_v3(0, 0, 0));
}

static void compare_tree(vt_context *context, vt_tree *tree, int level) {
  vt_renderer *gl = gl_or_skip(context, tree), *cpu = NULL;
  assert_int_equal(vt_create_renderer(context, tree, VT_BACKEND_CPU, &cpu), VT_OK);
  vt_render_desc desc = vt_default_render_desc();
  desc.level = level;
  for (int k = 1; k <= 8; k *= 2)
    for (int blend = 0; blend < 2; blend++) {
      desc.blend_views = k;
      desc.blend = blend ? VT_BLEND_GEOMETRIC : VT_BLEND_SUM;
      compare(context, cpu, gl, &desc, 0.05);
    }
  desc.flat = true;
  compare(context, cpu, gl, &desc, 0.05);
  vt_destroy_renderer(context, cpu);
  vt_destroy_renderer(context, gl);
}

static void raw_random_levels_look_the_same(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  vt_tree tree = scene_random_tree(context, 4, 0.35, 9, 4, 5);
  compare_tree(context, &tree, 4);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void packed_random_levels_look_the_same(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  vt_tree tree = scene_random_tree(context, 4, 0.35, 9, 4, 6);
  scene_pack(context, &tree, 4);
  compare_tree(context, &tree, 4);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void tiles_of_other_sizes_look_the_same(void **state) {
  (void)state;
  for (int n = 1; n <= 8; n += n == 1 ? 2 : 5) { // 1, 3, 8
    vt_context *context = scene_context(2);
    vt_tree tree = scene_random_tree(context, 3, 0.5, 3, n, 8);
    compare_tree(context, &tree, 3);
    vt_free_tree(context, &tree);
    vt_destroy_context(context);
  }
}

static void sparse_fine_level_looks_the_same(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  vt_tree tree = scene_random_tree(context, 6, 0.05, 2, 4, 9);
  vt_renderer *gl = gl_or_skip(context, &tree), *cpu = NULL;
  assert_int_equal(vt_create_renderer(context, &tree, VT_BACKEND_CPU, &cpu), VT_OK);
  vt_render_desc desc = vt_default_render_desc();
  compare(context, cpu, gl, &desc, 0.05);
  vt_destroy_renderer(context, cpu);
  vt_destroy_renderer(context, gl);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void scaled_and_shifted_scenes_look_the_same(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  double scales[] = {1e-6, 1e6, 1};
  vt_vec3 shifts[] = {{0.1, 0.2, -0.1}, {0, 0, 0}, {1e5, -2e5, 1.2e5}}; // about 10^6 cells
  for (int i = 0; i < 3; i++) {
    vt_tree tree = scene_random_tree(context, 4, 0.3, 3, 4, 11);
    scene_move(&tree, scales[i], shifts[i]);
    vt_renderer *gl = gl_or_skip(context, &tree), *cpu = NULL;
    assert_int_equal(vt_create_renderer(context, &tree, VT_BACKEND_CPU, &cpu), VT_OK);
    vt_render_desc desc = vt_default_render_desc();
    compare_moved(context, cpu, gl, &desc, 0.05, scales[i], shifts[i]);
    vt_destroy_renderer(context, cpu);
    vt_destroy_renderer(context, gl);
    vt_free_tree(context, &tree);
  }
  vt_destroy_context(context);
}

// Views' textures and flat, with a cell's corners or without.
static void compare_field_tree(vt_context *context, vt_tree *tree, int level, int most_views) {
  vt_renderer *gl = gl_or_skip(context, tree), *cpu = NULL;
  assert_int_equal(vt_create_renderer(context, tree, VT_BACKEND_CPU, &cpu), VT_OK);
  vt_render_desc desc = vt_default_render_desc();
  desc.level = level;
  for (int k = 1; k <= most_views; k += k < 4 ? 1 : 4) {
    desc.blend_views = k;
    compare(context, cpu, gl, &desc, 0.05);
  }
  desc.flat = true;
  compare(context, cpu, gl, &desc, 0.05);
  vt_destroy_renderer(context, cpu);
  vt_destroy_renderer(context, gl);
}

static void fields_and_view_textures_look_the_same(void **state) {
  (void)state;
  for (int what = 1; what < 8; what++) { // field only, view textures only, both; with R interpolated
    vt_context *context = scene_context(2);
    vt_tree tree = scene_random_field(context, 4, 0.35, 7, 30 + (uint64_t)what, what & 1, what & 2);
    if (what & 4) scene_make_linear(&tree, 4);
    compare_field_tree(context, &tree, 4, what & 2 ? 4 : 0);
    vt_free_tree(context, &tree);
    vt_destroy_context(context);
  }
}

// Cameras that do not see all of the tree, one of them within it; of most photographs only little is kept.
static void views_that_see_little_look_the_same(void **state) {
  (void)state;
  for (int field = 0; field < 2; field++) {
    vt_context *context = scene_context(2);
    vt_tree tree = scene_random_field(context, 4, 0.35, 9, 41, field, false);
    for (int v = 0; v < 9; v += 2) tree.cameras[v].fx *= 3, tree.cameras[v].fy *= 3;
    tree.cameras[3] = scene_camera(0.2, 0.3, -0.1, 33);
    scene_add_textures(context, &tree, 4, 1, 42);
    vt_rng rng = vt_seed_rng(43, 1);
    scene_cut_textures(&tree, 4, &rng);
    compare_field_tree(context, &tree, 4, field ? 8 : 2);
    vt_free_tree(context, &tree);
    vt_destroy_context(context);
  }
}

// 27 MB of codes: more than a layer of the driver's arrays holds, and views begin anywhere within one.
static void large_view_textures_look_the_same(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  vt_tree tree = scene_random_field(context, 4, 0.35, 5, 45, true, false);
  for (int v = 0; v < 5; v++) {
    vt_camera *camera = &tree.cameras[v];
    const double scale = 16;
    camera->fx *= scale, camera->fy *= scale, camera->cx *= scale, camera->cy *= scale;
    camera->width = 2561, camera->height = 2099; // odd rows
  }
  scene_add_textures(context, &tree, 4, 1, 46);
  assert_true(vt_texture_bytes(&tree) > 26000000);
  compare_field_tree(context, &tree, 4, 2);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void scaled_and_shifted_fields_look_the_same(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  double scales[] = {1e-6, 1e6, 1};
  vt_vec3 shifts[] = {{0.1, 0.2, -0.1}, {0, 0, 0}, {1e5, -2e5, 1.2e5}}; // about 10^6 cells
  for (int i = 0; i < 3; i++) {
    vt_tree tree = scene_random_field(context, 4, 0.3, 3, 44, true, true);
    scene_move(&tree, scales[i], shifts[i]);
    vt_renderer *gl = gl_or_skip(context, &tree), *cpu = NULL;
    assert_int_equal(vt_create_renderer(context, &tree, VT_BACKEND_CPU, &cpu), VT_OK);
    vt_render_desc desc = vt_default_render_desc();
    compare_moved(context, cpu, gl, &desc, 0.05, scales[i], shifts[i]);
    vt_destroy_renderer(context, cpu);
    vt_destroy_renderer(context, gl);
    vt_free_tree(context, &tree);
  }
  vt_destroy_context(context);
}

// Two renderers of two trees take turns, the order kept from picture to picture, levels and views changing.
static void two_renderers_do_not_disturb_each_other(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_tree tree = scene_random_tree(context, 3, 0.5, 4, 4, 21), other = scene_random_tree(context, 4, 0.3, 6, 8, 22);
  vt_renderer *a = NULL, *b = NULL;
  if (vt_create_renderer(context, &tree, VT_BACKEND_GL, &a)) {
    vt_free_tree(context, &other);
    a = gl_or_skip(context, &tree);
  }
  assert_int_equal(vt_create_renderer(context, &other, VT_BACKEND_GL, &b), VT_OK);
  vt_render_desc desc = vt_default_render_desc();
  for (int i = 0; i < 12; i++) {
    vt_camera camera = scene_camera(2.5 * cos(i * 0.4), 2.5 * sin(i * 0.4), 0.5, 60 + 10 * (i % 3));
    desc.flat = i % 4 == 3;
    for (int which = 0; which < 2; which++) {
      vt_fimage got, expected;
      const vt_tree *t = which ? &other : &tree;
      int level = which ? 4 : 3;
      desc.level = level;
      vt_view_weights weights = vt_choose_views(t, vt_camera_centre(&camera), 2);
      assert_int_equal(vt_render(context, which ? b : a, &desc, &camera, &got, NULL), VT_OK);
      assert_int_equal(vt_composite(context, t, level, &weights, desc.blend, desc.flat, &camera, &expected), VT_OK);
      assert_true(scene_difference(&got, &expected, NULL) * 255 < 0.05);
      vt_free_fimage(context, &got);
      vt_free_fimage(context, &expected);
    }
    if (i == 6) { // destroying and making one leaves the other alone
      vt_destroy_renderer(context, a);
      assert_int_equal(vt_create_renderer(context, &tree, VT_BACKEND_GL, &a), VT_OK);
    }
  }
  vt_destroy_renderer(context, a);
  vt_destroy_renderer(context, b);
  vt_free_tree(context, &tree);
  vt_free_tree(context, &other);
  vt_destroy_context(context);
}

static void renderers_say_what_is_wrong(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_tree tree = scene_random_tree(context, 2, 0.5, 2, 4, 23);
  vt_backend backends[] = {VT_BACKEND_CPU, VT_BACKEND_AUTO};
  for (int i = 0; i < 2; i++) {
    vt_renderer *renderer = NULL;
    assert_int_equal(vt_create_renderer(context, &tree, backends[i], &renderer), VT_OK);
    assert_true(!strcmp(vt_renderer_name(renderer), "CPU") || !strncmp(vt_renderer_name(renderer), "OpenGL: ", 8));
    vt_render_desc desc = vt_default_render_desc();
    vt_camera camera = scene_camera(2, 2, 1, 40);
    vt_fimage image;
    desc.level = 3;
    assert_int_equal(vt_render(context, renderer, &desc, &camera, &image, NULL), VT_BAD_USAGE);
    assert_null(image.pixels);
    assert_true(strstr(vt_last_error(context), "levels 0 to 2") != NULL);
    vt_clear_error(context);
    desc.level = 1; // no textures
    assert_int_equal(vt_render(context, renderer, &desc, &camera, &image, NULL), VT_BAD_USAGE);
    vt_clear_error(context);
    desc.level = -1;
    camera.fx = NAN;
    assert_int_equal(vt_render(context, renderer, &desc, &camera, &image, NULL), VT_BAD_INPUT);
    vt_clear_error(context);
    camera = scene_camera(2, 2, 1, 40);
    vt_render_report report;
    assert_int_equal(vt_render(context, renderer, &desc, &camera, &image, &report), VT_OK);
    assert_int_equal(report.level, 2);
    assert_true(scene_pixel(&image, 20, 20)[3] > 0.05);
    vt_free_fimage(context, &image);
    vt_destroy_renderer(context, renderer);
  }
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(raw_random_levels_look_the_same),
      cmocka_unit_test(packed_random_levels_look_the_same),
      cmocka_unit_test(tiles_of_other_sizes_look_the_same),
      cmocka_unit_test(sparse_fine_level_looks_the_same),
      cmocka_unit_test(scaled_and_shifted_scenes_look_the_same),
      cmocka_unit_test(fields_and_view_textures_look_the_same),
      cmocka_unit_test(views_that_see_little_look_the_same),
      cmocka_unit_test(large_view_textures_look_the_same),
      cmocka_unit_test(scaled_and_shifted_fields_look_the_same),
      cmocka_unit_test(two_renderers_do_not_disturb_each_other),
      cmocka_unit_test(renderers_say_what_is_wrong),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
