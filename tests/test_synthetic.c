// test_synthetic.c - trees and phantoms with exact cameras and mattes
// SPDX-License-Identifier: BSD-3-Clause

#include "base/rng.h"
#include "datasets-synthetic/bark.h"
#include "datasets-synthetic/grow.h"
#include "datasets-synthetic/leaves.h"
#include "datasets-synthetic/phantom.h"
#include "datasets-synthetic/photograph.h"
#include "datasets-synthetic/rasterise.h"
#include "datasets-synthetic/sky.h"
#include "datasets-synthetic/synthetic.h"
#include "tests/unit.h"

static vt_context *make_context(int threads, uint64_t max_memory) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads, desc.max_memory = max_memory, desc.log_level = VT_LOG_QUIET;
  vt_context *ctx = vt_create_context(&desc);
  assert_non_null(ctx);
  return ctx;
}

static const vt_synthetic_kind kinds[] = {VT_SYNTHETIC_TREE, VT_SYNTHETIC_BALL, VT_SYNTHETIC_SHELL, VT_SYNTHETIC_BLOBS};

static vt_synthetic_desc small_desc(vt_synthetic_kind kind) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = kind, desc.train_count = 5, desc.test_count = 2, desc.width = desc.height = 64, desc.supersample = 2;
  desc.leaf_count = 1500;
  return desc;
}

static void views_have_names_roles_pictures_and_valid_cameras(void **state) {
  (void)state;
  vt_context *ctx = make_context(2, 0);
  for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
    vt_synthetic_kind kind = kinds[k];
    vt_synthetic_desc desc = small_desc(kind);
    desc.width = 48, desc.height = 32;
    vt_views views;
    assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_OK);
    assert_int_equal(views.count, 7);
    assert_int_equal(vt_count_views(&views, VT_TRAIN), 5);
    assert_int_equal(vt_count_views(&views, VT_TEST), 2);
    assert_string_equal(views.items[0].name, "train/r_0.png");
    assert_string_equal(views.items[4].name, "train/r_4.png");
    assert_string_equal(views.items[6].name, "test/r_1.png");
    for (int i = 0; i < views.count; i++) {
      const vt_view *view = &views.items[i];
      assert_int_equal(vt_check_camera(ctx, &view->camera, view->name), VT_OK);
      assert_int_equal(view->picture.width, 48);
      assert_int_equal(view->picture.height, 32);
      assert_int_equal(view->picture.channels, 4);
      double pixel[2];
      assert_true(vt_project(&view->camera, vt_v3(0, 0, 0), pixel));
      assert_close(pixel[0], 24, 1e-9);
      assert_close(pixel[1], 16, 1e-9);
      assert_true(vt_project(&view->camera, vt_v3(0, 0, 0.5), pixel) && pixel[1] < 15.9); // z is up
    }
    vt_free_views(ctx, &views);
  }
  vt_destroy_context(ctx);
}

static void test_views_stand_apart_from_training_views(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_synthetic_desc desc = small_desc(VT_SYNTHETIC_BALL);
  desc.train_count = 48, desc.test_count = 12, desc.width = desc.height = 8;
  vt_views views;
  assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_OK);
  double lowest = 90, highest = -90;
  for (int j = 0; j < 60; j++) {
    vt_vec3 to = vt_normalise(vt_camera_centre(&views.items[j].camera));
    double elevation = asin(to.z) * 180 / VT_PI;
    lowest = fmin(lowest, elevation), highest = fmax(highest, elevation);
    for (int i = 0; i < j; i++) {
      vt_vec3 other = vt_normalise(vt_camera_centre(&views.items[i].camera));
      assert_true(acos(fmin(1, vt_dot(to, other))) > 4 * VT_PI / 180);
    }
  }
  assert_true(lowest >= -5 && lowest < 0 && highest <= 60 && highest > 55);
  vt_free_views(ctx, &views);
  vt_destroy_context(ctx);
}

// Half the picture's edge that the covered pixels reach from the middle, over the half edge; the largest of all views.
static double measure_reach(const vt_views *views) {
  double reach = 0;
  for (int i = 0; i < views->count; i++) {
    const vt_image *p = &views->items[i].picture;
    for (int y = 0; y < p->height; y++)
      for (int x = 0; x < p->width; x++)
        if (p->pixels[4 * (y * p->width + x) + 3]) {
          reach = fmax(reach, fabs(x + 0.5 - 0.5 * p->width) / (0.5 * p->width));
          reach = fmax(reach, fabs(y + 0.5 - 0.5 * p->height) / (0.5 * p->height));
        }
  }
  return reach;
}

static void trees_fill_the_frame_and_stay_inside_it(void **state) {
  (void)state;
  vt_context *ctx = make_context(2, 0);
  for (uint32_t seed = 0; seed < 5; seed++) {
    vt_synthetic_desc desc = small_desc(VT_SYNTHETIC_TREE);
    desc.seed = seed * 77, desc.width = 100 + 20 * (int)seed, desc.height = 120;
    vt_views views;
    assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_OK);
    double reach = measure_reach(&views);
    assert_true(reach > 0.79 && reach < 0.86);
    vt_free_views(ctx, &views);
  }
  vt_destroy_context(ctx);
}

static void same_desc_gives_same_bits_for_any_number_of_threads(void **state) {
  (void)state;
  for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k += 3) {
    vt_synthetic_kind kind = kinds[k];
    vt_synthetic_desc desc = small_desc(kind);
    vt_context *first = make_context(1, 0);
    vt_views expected;
    assert_int_equal(vt_make_synthetic_views(first, &desc, &expected), VT_OK);
    for (int threads = 1; threads <= 3; threads++) {
      vt_context *ctx = make_context(threads, 0);
      vt_views views;
      assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_OK);
      for (int i = 0; i < views.count; i++) {
        assert_memory_equal(views.items[i].picture.pixels, expected.items[i].picture.pixels, 64 * 64 * 4);
        assert_memory_equal(&views.items[i].camera, &expected.items[i].camera, sizeof(vt_camera));
      }
      vt_free_views(ctx, &views);
      vt_destroy_context(ctx);
    }
    vt_free_views(first, &expected);
    vt_destroy_context(first);
  }
}

static void other_seeds_give_clearly_other_trees(void **state) {
  (void)state;
  vt_context *ctx = make_context(2, 0);
  vt_views views[4];
  for (uint32_t seed = 0; seed < 4; seed++) {
    vt_synthetic_desc desc = small_desc(VT_SYNTHETIC_TREE);
    desc.seed = seed;
    assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views[seed]), VT_OK);
    for (uint32_t other = 0; other < seed; other++) {
      const uint8_t *a = views[seed].items[0].picture.pixels, *b = views[other].items[0].picture.pixels;
      int covered = 0, differing = 0;
      for (int k = 3; k < 64 * 64 * 4; k += 4) covered += a[k] > 127 || b[k] > 127, differing += abs(a[k] - b[k]) > 127;
      assert_true(covered > 300);
      assert_true(differing > covered / 10);
    }
  }
  for (int i = 0; i < 4; i++) vt_free_views(ctx, &views[i]);
  vt_destroy_context(ctx);
}

// ---- wood and leaves

static void radii_follow_the_pipe_model_and_parents_come_first(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (uint32_t seed = 0; seed < 3; seed++) {
    vt_skeleton s;
    assert_int_equal(vt_grow_skeleton(ctx, vt_habit_of(VT_SYNTHETIC_TREE), seed, &s), VT_OK);
    assert_true(s.count > 1000 && s.nodes[0].parent == -1);
    assert_true(s.nodes[0].radius > 0.03 && s.nodes[0].radius < 0.1);
    for (int n = 1; n < s.count; n++) {
      assert_true(s.nodes[n].parent >= 0 && s.nodes[n].parent < n);
      assert_true(s.nodes[n].radius < s.nodes[s.nodes[n].parent].radius);
      assert_true(s.nodes[n].radius >= s.tip_radius * 0.999);
    }
    vt_free_skeleton(ctx, &s);
  }
  vt_destroy_context(ctx);
}

static int compare_edges(const void *a, const void *b) {
  uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
  return (x > y) - (x < y);
}

// Every edge is run through once in each direction: no holes, and outsides agree.
static void bark_is_closed(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_skeleton s;
  vt_mesh mesh = {0};
  assert_int_equal(vt_grow_skeleton(ctx, vt_habit_of(VT_SYNTHETIC_TREE), 3, &s), VT_OK);
  assert_int_equal(vt_add_bark(ctx, vt_habit_of(VT_SYNTHETIC_TREE), &s, 3, 0, &mesh), VT_OK);
  assert_int_equal(mesh.solid_count, mesh.triangle_count);
  size_t count = 3 * mesh.triangle_count;
  uint64_t *edges = malloc(count * sizeof *edges), *reversed = malloc(count * sizeof *reversed);
  for (size_t t = 0; t < mesh.triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      uint64_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      edges[3 * t + (size_t)k] = a << 32 | b, reversed[3 * t + (size_t)k] = b << 32 | a;
    }
  qsort(edges, count, sizeof *edges, compare_edges);
  qsort(reversed, count, sizeof *reversed, compare_edges);
  bool twice = false, open = false;
  for (size_t i = 0; i < count; i++) {
    twice = twice || (i && edges[i] == edges[i - 1]);
    open = open || edges[i] != reversed[i];
  }
  free(edges);
  free(reversed);
  vt_free_mesh(ctx, &mesh);
  vt_free_skeleton(ctx, &s);
  vt_destroy_context(ctx);
  assert_false(twice);
  assert_false(open);
}

static void leaves_are_as_many_as_asked_for_and_face_their_normals(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_skeleton s;
  assert_int_equal(vt_grow_skeleton(ctx, vt_habit_of(VT_SYNTHETIC_TREE), 2, &s), VT_OK);
  for (uint32_t shape = 0; shape < 4; shape++) {
    vt_mesh one = {0}, many = {0};
    assert_int_equal(vt_add_leaves(ctx, &vt_habit_of(VT_SYNTHETIC_TREE)->foliage, &s, shape, 1, 2, &one), VT_OK);
    assert_int_equal(vt_add_leaves(ctx, &vt_habit_of(VT_SYNTHETIC_TREE)->foliage, &s, shape, 700, 2, &many), VT_OK);
    assert_int_equal(many.triangle_count, 700 * one.triangle_count);
    assert_int_equal(many.solid_count, 0);
    for (size_t t = 0; t < many.triangle_count; t++) {
      vt_vec3 p[3], mean = {0, 0, 0};
      for (int k = 0; k < 3; k++) {
        const vt_vertex *v = &many.vertices[many.triangles[t][k]];
        p[k] = vt_v3(v->position[0], v->position[1], v->position[2]);
        mean = vt_add(mean, vt_v3(v->normal[0], v->normal[1], v->normal[2]));
        for (int c = 0; c < 3; c++) assert_true(v->albedo[c] > 0 && v->albedo[c] < 1);
      }
      assert_true(vt_dot(mean, vt_cross(vt_sub(p[1], p[0]), vt_sub(p[2], p[0]))) > 0);
    }
    vt_free_mesh(ctx, &one);
    vt_free_mesh(ctx, &many);
  }
  vt_free_skeleton(ctx, &s);
  vt_destroy_context(ctx);
}

// ---- rasterising and light

static void triangles_that_share_edges_share_out_the_samples(void **state) {
  (void)state;
  enum { SIZE = 40, CORNERS = 9 };
  static float near[SIZE * SIZE];
  static int32_t triangle[SIZE * SIZE];
  vt_rng rng = vt_seed_rng(1, 1);
  for (int round = 0; round < 200; round++) {
    vt_projected corners[CORNERS + 1];
    uint32_t indices[CORNERS][3];
    int step = round % 2 ? 1 : VT_SAMPLE_UNITS / 2; // every other fan has corners and edges on sample centres
    for (int k = 0; k <= CORNERS; k++) {
      double angle = 2 * VT_PI * (k + 0.8 * vt_random_unit(&rng)) / CORNERS, r = vt_random_between(&rng, 5, 19);
      if (k == CORNERS) r = 0;
      corners[k].x = (int32_t)((20 + r * cos(angle)) * VT_SAMPLE_UNITS / step) * step;
      corners[k].y = (int32_t)((20 + r * sin(angle)) * VT_SAMPLE_UNITS / step) * step;
      corners[k].near = 1;
      if (k < CORNERS)
        indices[k][0] = CORNERS, indices[k][1] = (uint32_t)k, indices[k][2] = (uint32_t)((k + 1) % CORNERS);
    }
    int covered[SIZE * SIZE] = {0};
    double area = 0;
    vt_sample_band band = {SIZE, 0, SIZE, near, triangle};
    for (int k = 0; k < CORNERS; k++) {
      vt_mesh mesh = {.triangle_count = 1, .triangles = &indices[k]};
      vt_clear_band(&band);
      vt_draw_mesh(&mesh, corners, false, &band);
      for (int i = 0; i < SIZE * SIZE; i++) covered[i] += triangle[i] == 0;
      area += 0.5 * (double)vt_twice_area(&corners[CORNERS], &corners[k], &corners[(k + 1) % CORNERS]);
    }
    int sum = 0;
    for (int i = 0; i < SIZE * SIZE; i++) {
      assert_true(covered[i] <= 1);
      sum += covered[i];
    }
    assert_int_equal(covered[20 * SIZE + 20], 1);
    assert_close(sum, area / VT_SAMPLE_UNITS / VT_SAMPLE_UNITS, 12);
  }
}

static void add_quad(vt_context *ctx, vt_mesh *mesh, vt_vec3 centre, vt_vec3 u, vt_vec3 v) {
  assert_int_equal(vt_reserve_mesh(ctx, mesh, 4, 2), VT_OK);
  vt_vec3 normal = vt_normalise(vt_cross(u, v)), grey = {0.2, 0.2, 0.2};
  uint32_t first = (uint32_t)mesh->vertex_count;
  for (int k = 0; k < 4; k++) {
    vt_vec3 off = vt_add(vt_scale(u, k == 1 || k == 2 ? 1 : -1), vt_scale(v, k >= 2 ? 1 : -1));
    vt_add_vertex(mesh, vt_add(centre, off), normal, grey);
  }
  vt_add_triangle(mesh, first, first + 1, first + 2);
  vt_add_triangle(mesh, first, first + 2, first + 3);
}

static void alpha_is_the_covered_area_and_edges_keep_their_colour(void **state) {
  (void)state;
  enum { SIZE = 24, SAMPLES = 4 };
  vt_context *ctx = make_context(1, 0);
  vt_mesh mesh = {0};
  vt_lighting lighting;
  add_quad(ctx, &mesh, vt_v3(0, 0, 0), vt_v3(0.613, 0, 0), vt_v3(0, 0.377, 0));
  assert_int_equal(vt_light_mesh(ctx, &mesh, vt_sun_direction(1, 0), &lighting), VT_OK);
  vt_view view = {.camera = vt_look_at(vt_v3(0, 0, 3), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 2 * atan(1.0 / 3), SIZE, SIZE)};
  vt_views views = {.count = 1, .items = &view};
  assert_int_equal(vt_photograph_mesh(ctx, &mesh, &lighting, &(vt_wind){0}, SAMPLES, &views), VT_OK);
  const uint8_t *middle = view.picture.pixels + 4 * (12 * SIZE + 12);
  assert_int_equal(middle[3], 255);
  assert_true(middle[0] > 40 && middle[0] < 250);
  for (int y = 0; y < SIZE; y++)
    for (int x = 0; x < SIZE; x++) {
      double half_x = 0.613 * 12, half_y = 0.377 * 12;
      double wide = fmax(0, fmin(x + 1, 12 + half_x) - fmax(x, 12 - half_x));
      double high = fmax(0, fmin(y + 1, 12 + half_y) - fmax(y, 12 - half_y));
      const uint8_t *p = view.picture.pixels + 4 * (y * SIZE + x);
      // A regular grid errs by less than half a row and half a column of samples.
      assert_close(p[3] / 255.0, wide * high, (wide < 1 && high < 1 ? 1.0 : 0.5) / SAMPLES + 0.003);
      assert_close(p[3] / 255.0 * SAMPLES * SAMPLES, round(p[3] / 255.0 * SAMPLES * SAMPLES), 0.04);
      // 1 level: a flat quad hides its own corner from the one sky direction that grazes it, so the sky varies by 1/48.
      for (int c = 0; c < 3; c++) assert_close(p[c], p[3] ? middle[c] : 0, p[3] ? 1 : 0);
    }
  vt_free_image(ctx, &view.picture);
  vt_free_lighting(ctx, &lighting);
  vt_free_mesh(ctx, &mesh);
  vt_destroy_context(ctx);
}

static void alpha_of_a_turned_quad_adds_up_to_its_area(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_rng rng = vt_seed_rng(5, 5);
  for (int round = 0; round < 4; round++) {
    double angle = vt_random_between(&rng, 0.2, 0.6), a = 0.6, b = 0.31;
    vt_mesh mesh = {0};
    vt_lighting lighting;
    add_quad(ctx, &mesh, vt_v3(0.011, 0.023, 0), vt_v3(a * cos(angle), a * sin(angle), 0),
             vt_v3(-b * sin(angle), b * cos(angle), 0));
    assert_int_equal(vt_light_mesh(ctx, &mesh, vt_sun_direction(1, 0), &lighting), VT_OK);
    vt_view view = {.camera = vt_look_at(vt_v3(0, 0, 3), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 2 * atan(1.0 / 3), 30, 30)};
    vt_views views = {.count = 1, .items = &view};
    assert_int_equal(vt_photograph_mesh(ctx, &mesh, &lighting, &(vt_wind){0}, 4, &views), VT_OK);
    double sum = 0;
    for (int i = 0; i < 900; i++) sum += view.picture.pixels[4 * i + 3] / 255.0;
    assert_close(sum, 4 * a * b * 15 * 15, 4 * a * b * 15 * 15 / 16.0 / 8);
    vt_free_image(ctx, &view.picture);
    vt_free_lighting(ctx, &lighting);
    vt_free_mesh(ctx, &mesh);
  }
  vt_destroy_context(ctx);
}

static vt_surface_point vertex_point(const vt_mesh *mesh, const vt_lighting *lighting, size_t v) {
  vt_surface_point p = {.sun_x = lighting->vertices[v].sun_x, .sun_y = lighting->vertices[v].sun_y};
  p.sun_near = lighting->vertices[v].sun_near, p.sky = lighting->vertices[v].sky;
  for (int k = 0; k < 3; k++) p.albedo[k] = mesh->vertices[v].albedo[k], p.normal[k] = mesh->vertices[v].normal[k];
  return p;
}

static void what_is_between_a_point_and_the_sun_darkens_it(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_mesh mesh = {0};
  vt_lighting lighting;
  add_quad(ctx, &mesh, vt_v3(0, 0, -0.5), vt_v3(1, 0, 0), vt_v3(0, 1, 0));
  assert_int_equal(vt_light_mesh(ctx, &mesh, vt_sun_direction(9, 0), &lighting), VT_OK);
  vt_vec3 sun = lighting.sun;
  assert_close(vt_length(sun), 1, 1e-12);
  vt_free_lighting(ctx, &lighting);
  vt_vec3 corner = {-1, -1, -0.5}, side = vt_normalise(vt_cross(sun, vt_v3(0, 0, 1)));
  add_quad(ctx, &mesh, vt_add(corner, vt_scale(sun, 0.4)), vt_scale(side, 0.1), vt_scale(vt_cross(sun, side), 0.1));
  assert_int_equal(vt_light_mesh(ctx, &mesh, vt_sun_direction(9, 0), &lighting), VT_OK);
  float dark[3], bright[3], through[3];
  vt_surface_point below = vertex_point(&mesh, &lighting, 0), open = vertex_point(&mesh, &lighting, 2);
  assert_true(below.sky < open.sky && open.sky == 1.0f);
  vt_shade(&lighting, &below, dark);
  vt_shade(&lighting, &open, bright);
  open.thin = true, open.back = true;
  vt_shade(&lighting, &open, through);
  for (int k = 0; k < 3; k++) assert_true(dark[k] < 0.6f * bright[k] && through[k] < bright[k] && through[k] > 0);
  assert_true(through[1] / through[2] > bright[1] / bright[2]); // light through a leaf is greener
  vt_free_lighting(ctx, &lighting);
  vt_free_mesh(ctx, &mesh);
  vt_destroy_context(ctx);
}

// ---- phantoms

static void ball_alpha_is_the_formula(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_synthetic_desc desc = small_desc(VT_SYNTHETIC_BALL);
  desc.width = desc.height = 63, desc.supersample = 1, desc.peak_extinction = 0.5;
  vt_views views;
  assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_OK);
  for (int i = 0; i < views.count; i++)
    assert_int_equal(views.items[i].picture.pixels[4 * (31 * 63 + 31) + 3], lround(255 * (1 - exp(-2 * 0.5))));
  vt_free_views(ctx, &views);
  vt_destroy_context(ctx);
}

static vt_truth *open_truth(vt_context *ctx, const vt_synthetic_desc *desc) {
  vt_truth *truth;
  assert_int_equal(vt_create_truth(ctx, desc, &truth), VT_OK);
  return truth;
}

static void phantom_pictures_agree_with_true_optical_depth(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int kind = VT_SYNTHETIC_BALL; kind <= VT_SYNTHETIC_BLOBS; kind++) {
    vt_synthetic_desc desc = small_desc(kind);
    desc.supersample = 3, desc.width = desc.height = 33;
    vt_views views;
    vt_truth *truth = open_truth(ctx, &desc);
    assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_OK);
    const vt_view *view = &views.items[3];
    int between = 0;
    for (int i = 0; i < 33 * 33; i++) {
      double alpha = 0;
      for (int k = 0; k < 9; k++) {
        vt_ray ray = vt_camera_ray(&view->camera, i % 33 + (k % 3 + 0.5) / 3, i / 33 + (k / 3 + 0.5) / 3);
        alpha += (1 - exp(-vt_true_optical_depth(truth, &ray, 0, 1e3, 0))) / 9;
      }
      assert_close(view->picture.pixels[4 * i + 3], 255 * alpha, 0.501);
      between += alpha > 0.05 && alpha < 0.95;
    }
    assert_true(between > 40);
    assert_close(measure_reach(&views), kind == VT_SYNTHETIC_BLOBS ? 0.8 : 0.84,
                 kind == VT_SYNTHETIC_BLOBS ? 0.17 : 0.04);
    vt_destroy_truth(ctx, truth);
    vt_free_views(ctx, &views);
  }
  vt_destroy_context(ctx);
}

static void optical_depth_is_the_integral_of_extinction(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_rng rng = vt_seed_rng(3, 3);
  for (int round = 0; round < 60; round++) {
    vt_synthetic_desc desc = small_desc(VT_SYNTHETIC_BALL + round % 3);
    desc.seed = (uint32_t)round;
    vt_truth *truth = open_truth(ctx, &desc);
    vt_vec3 from = {0, 0, 0}, to = {0, 0, 0};
    from.x = vt_random_between(&rng, -2, 2), from.y = vt_random_between(&rng, -2, 2),
    from.z = vt_random_between(&rng, -2, 2);
    to.x = vt_random_between(&rng, -.6, .6), to.y = vt_random_between(&rng, -.6, .6),
    to.z = vt_random_between(&rng, -.6, .6);
    vt_ray ray = {from, vt_normalise(vt_sub(to, from))};
    double near = vt_random_between(&rng, 0, 2), far = near + vt_random_between(&rng, 0.5, 3), sum = 0;
    int steps = 200000;
    for (int k = 0; k < steps; k++) {
      double s = near + (far - near) * (k + 0.5) / steps;
      sum += vt_true_extinction(truth, vt_add(ray.origin, vt_scale(ray.direction, s))) * (far - near) / steps;
    }
    double depth = vt_true_optical_depth(truth, &ray, near, far, 0), middle = 0.3 * near + 0.7 * far;
    assert_close(depth, sum, desc.kind == VT_SYNTHETIC_BLOBS ? 1e-8 : 3e-4);
    assert_close(vt_true_optical_depth(truth, &ray, near, middle, 0) + vt_true_optical_depth(truth, &ray, middle, far, 0),
                 depth, 1e-12);
    assert_true(vt_true_optical_depth(truth, &ray, far, near, 0) == 0);
    vt_destroy_truth(ctx, truth);
  }
  vt_destroy_context(ctx);
}

static void blobs_peak_at_the_asked_extinction(void **state) {
  (void)state;
  for (uint32_t seed = 0; seed < 20; seed++) {
    vt_synthetic_desc desc = small_desc(VT_SYNTHETIC_BLOBS);
    desc.seed = seed, desc.peak_extinction = 6;
    vt_phantom phantom = vt_make_phantom(&desc);
    double highest = 0;
    for (int i = 0; i < phantom.blob_count; i++) {
      highest = fmax(highest, vt_phantom_extinction(&phantom, phantom.blobs[i].centre));
      assert_true(vt_length(phantom.blobs[i].centre) + 3 * phantom.blobs[i].deviation < 1);
    }
    assert_close(highest, 6, 1e-9);
  }
}

// ---- trouble

static void unusable_descs_are_refused_with_a_sentence(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_synthetic_desc bad[12];
  for (int i = 0; i < 12; i++) bad[i] = small_desc(i % 2 ? VT_SYNTHETIC_TREE : VT_SYNTHETIC_BALL);
  bad[0].train_count = 0, bad[1].train_count = 1001, bad[2].test_count = -1, bad[3].width = 0,
  bad[4].height = 2000000000;
  bad[5].supersample = 0, bad[6].supersample = 9, bad[7].leaf_count = -2, bad[8].fov_y = NAN, bad[9].fov_y = 0;
  bad[10].peak_extinction = INFINITY, bad[11].kind = (vt_synthetic_kind)99;
  for (int i = 0; i < 12; i++) {
    vt_views views = {0};
    assert_int_equal(vt_make_synthetic_views(ctx, &bad[i], &views), VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(ctx), "give"));
    assert_null(views.items);
    vt_clear_error(ctx);
  }
  vt_destroy_context(ctx);
}

static void smallest_descs_work(void **state) {
  (void)state;
  vt_context *ctx = make_context(3, 0);
  for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
    vt_synthetic_kind kind = kinds[k];
    vt_synthetic_desc desc = small_desc(kind);
    desc.train_count = 1, desc.test_count = 0, desc.width = desc.height = 1, desc.supersample = 1, desc.leaf_count = 0;
    desc.fov_y = 2.5;
    vt_views views;
    assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_OK);
    assert_int_equal(views.count, 1);
    vt_free_views(ctx, &views);
  }
  vt_destroy_context(ctx);
}

static void memory_bound_is_kept(void **state) {
  (void)state;
  for (uint64_t bound = 1000; bound < 40000000; bound *= 3) {
    vt_context *ctx = make_context(2, bound);
    vt_synthetic_desc desc = small_desc(VT_SYNTHETIC_TREE);
    vt_views views;
    vt_status status = vt_make_synthetic_views(ctx, &desc, &views);
    assert_true(status == VT_OK || status == VT_OUT_OF_MEMORY);
    assert_true(bound > 1000000 || status == VT_OUT_OF_MEMORY);
    assert_true(vt_peak_bytes(ctx) <= bound);
    vt_free_views(ctx, &views);
    vt_destroy_context(ctx); // asserts that nothing is left
  }
}

static void cancelling_ends_it(void **state) {
  (void)state;
  for (int kind = VT_SYNTHETIC_TREE; kind <= VT_SYNTHETIC_BALL; kind++) {
    if (kind == VT_SYNTHETIC_MESH) continue; // needs a file
    vt_context *ctx = make_context(2, 0);
    vt_synthetic_desc desc = small_desc(kind);
    vt_views views;
    vt_cancel(ctx);
    assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_CANCELLED);
    assert_null(views.items);
    vt_destroy_context(ctx);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(views_have_names_roles_pictures_and_valid_cameras),
      cmocka_unit_test(test_views_stand_apart_from_training_views),
      cmocka_unit_test(trees_fill_the_frame_and_stay_inside_it),
      cmocka_unit_test(same_desc_gives_same_bits_for_any_number_of_threads),
      cmocka_unit_test(other_seeds_give_clearly_other_trees),
      cmocka_unit_test(radii_follow_the_pipe_model_and_parents_come_first),
      cmocka_unit_test(bark_is_closed),
      cmocka_unit_test(leaves_are_as_many_as_asked_for_and_face_their_normals),
      cmocka_unit_test(triangles_that_share_edges_share_out_the_samples),
      cmocka_unit_test(alpha_is_the_covered_area_and_edges_keep_their_colour),
      cmocka_unit_test(alpha_of_a_turned_quad_adds_up_to_its_area),
      cmocka_unit_test(what_is_between_a_point_and_the_sun_darkens_it),
      cmocka_unit_test(ball_alpha_is_the_formula),
      cmocka_unit_test(phantom_pictures_agree_with_true_optical_depth),
      cmocka_unit_test(optical_depth_is_the_integral_of_extinction),
      cmocka_unit_test(blobs_peak_at_the_asked_extinction),
      cmocka_unit_test(unusable_descs_are_refused_with_a_sentence),
      cmocka_unit_test(smallest_descs_work),
      cmocka_unit_test(memory_bound_is_kept),
      cmocka_unit_test(cancelling_ends_it),
  };
  only_threads_for_the_thread_sanitizer();
  return cmocka_run_group_tests(tests, NULL, NULL);
}
