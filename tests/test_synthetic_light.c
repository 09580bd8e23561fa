// test_synthetic_light.c - ray-traced photographs
// SPDX-License-Identifier: BSD-3-Clause

#include "datasets-synthetic/photograph_traced.h"
#include "datasets-synthetic/sky.h"
#include "datasets-synthetic/truth_mesh.h"
#include "tests/synthetic_cases.h"

enum { SIZE = 48 };

// One photograph of the mesh from straight above (or below) in the given sun, 3 units away, half the picture 1 unit
// wide.
static vt_image look_down(vt_context *ctx, const vt_mesh *mesh, vt_vec3 sun, bool from_below) {
  vt_view view = {.name = "above"};
  view.camera =
      vt_look_at(vt_v3(0, 0, from_below ? -3 : 3), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 2 * atan(1.0 / 3), SIZE, SIZE);
  vt_views views = {.count = 1, .items = &view};
  vt_status status = vt_photograph_traced(ctx, mesh, sun, &(vt_wind){0}, 4, &views);
  if (status) printf("%s\n", vt_last_error(ctx));
  assert_int_equal(status, VT_OK);
  return view.picture;
}

static const uint8_t *pixel_at(const vt_image *p, double x, double y) { // of look_down from above, world units
  int column = (int)((x + 1) * 0.5 * SIZE), row = (int)((1 - y) * 0.5 * SIZE);
  return p->pixels + 4 * (row * SIZE + column);
}

// ---- two ways to photograph a tree

static void both_paths_measure_the_same_alpha(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(2, 0);
  vt_synthetic_desc desc = small_desc();
  desc.supersample = 4;
  vt_views traced = photograph(ctx, &desc);
  desc.light_path = VT_RASTERISED;
  vt_views drawn = photograph(ctx, &desc);
  double level = 255.0 / 16;
  int covered = 0, other = 0, far = 0;
  for (int i = 0; i < traced.count; i++)
    for (int p = 0; p < 72 * 64; p++) {
      int a = traced.items[i].picture.pixels[4 * p + 3], b = drawn.items[i].picture.pixels[4 * p + 3];
      covered += a > 0 || b > 0, other += a != b, far += abs(a - b) > 1.1 * level;
    }
  assert_true(covered > 3000);
  // The rasteriser rounds corners to 1/256 of a sample: a sample in a hundred edges may fall to the other side.
  assert_true(other < covered / 50);
  assert_true(far <= covered / 2000);
  vt_free_views(ctx, &traced);
  vt_free_views(ctx, &drawn);
  vt_destroy_context(ctx);
}

static double mean_of(const vt_views *views, int channel) { // over covered pixels
  double sum = 0, weight = 0;
  for (int i = 0; i < views->count; i++) {
    const vt_image *p = &views->items[i].picture;
    for (int k = 0; k < p->width * p->height; k++)
      sum += p->pixels[4 * k + channel] * (double)p->pixels[4 * k + 3], weight += p->pixels[4 * k + 3];
  }
  return sum / weight;
}

static void both_paths_agree_about_brightness(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(2, 0);
  vt_synthetic_desc desc = small_desc();
  vt_views traced = photograph(ctx, &desc);
  desc.light_path = VT_RASTERISED;
  vt_views drawn = photograph(ctx, &desc);
  for (int c = 0; c < 3; c++) assert_close(mean_of(&traced, c), mean_of(&drawn, c), 30);
  assert_true(mean_of(&traced, 1) > mean_of(&traced, 0) + 10); // it is green
  int black = 0, covered = 0;
  for (int i = 0; i < traced.count; i++)
    for (int k = 0; k < 72 * 64; k++) {
      const uint8_t *p = traced.items[i].picture.pixels + 4 * k;
      covered += p[3] == 255, black += p[3] == 255 && p[0] < 8 && p[1] < 8 && p[2] < 8;
    }
  assert_true(covered > 1000);
  assert_int_equal(black, 0);
  vt_free_views(ctx, &traced);
  vt_free_views(ctx, &drawn);
  vt_destroy_context(ctx);
}

static void traced_pictures_have_the_same_bits_for_any_number_of_threads(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  for (int wind = 0; wind < 2; wind++) {
    vt_synthetic_desc desc = small_desc();
    desc.wind = wind ? 0.04 : 0;
    vt_context *first = make_context(1, 0);
    vt_views expected = photograph(first, &desc);
    static const int thread_counts[] = {1, 2, 3, 7};
    for (int t = 0; t < 4; t++) {
      vt_context *ctx = make_context(thread_counts[t], 0);
      vt_views views = photograph(ctx, &desc);
      for (int i = 0; i < views.count; i++)
        assert_memory_equal(views.items[i].picture.pixels, expected.items[i].picture.pixels, 72 * 64 * 4);
      vt_free_views(ctx, &views);
      vt_destroy_context(ctx);
    }
    vt_free_views(first, &expected);
    vt_destroy_context(first);
  }
}

// ---- light

static void a_shadow_falls_on_the_side_away_from_the_sun(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(1, 0);
  vt_mesh mesh = {0};
  add_quad(ctx, &mesh, vt_v3(0, 0, -0.5), vt_v3(0.95, 0, 0), vt_v3(0, 0.95, 0));
  add_quad(ctx, &mesh, vt_v3(0, 0, 0), vt_v3(0.15, 0, 0), vt_v3(0, 0.15, 0));
  mesh.solid_count = mesh.triangle_count;
  vt_image p = look_down(ctx, &mesh, vt_normalise(vt_v3(1, 0, 1)), false); // from +x, 45 degrees high
  // Half a unit under it the shadow's middle is half a unit to -x; there the ground is 3.5 away and looks smaller.
  const uint8_t *shadow = pixel_at(&p, -0.43, 0), *mirror = pixel_at(&p, 0.43, 0), *side = pixel_at(&p, 0, 0.43);
  for (int c = 0; c < 3; c++) {
    assert_int_equal(shadow[3], 255);
    assert_true(shadow[c] > 10 && shadow[c] < 0.75 * mirror[c]);
    assert_close(side[c], mirror[c], 12);
  }
  // No surface shadows itself: the ground far from the plate varies by the sky's noise only.
  for (double y = -0.7; y < 0.71; y += 0.1) assert_close(pixel_at(&p, 0.7, y)[1], pixel_at(&p, 0.7, 0)[1], 6);
  vt_free_image(ctx, &p);
  vt_free_mesh(ctx, &mesh);
  vt_destroy_context(ctx);
}

static void a_leaf_lit_from_behind_is_bright_and_greener(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(1, 0);
  vt_mesh leaf = {0};
  add_quad(ctx, &leaf, vt_v3(0, 0, 0), vt_v3(0.8, 0, 0), vt_v3(0, 0.8, 0)); // thin: solid_count is 0
  vt_vec3 above = vt_normalise(vt_v3(0.1, 0.2, 1)), level = {1, 0, 0};
  vt_image front = look_down(ctx, &leaf, above, false), through = look_down(ctx, &leaf, above, true);
  vt_image unlit = look_down(ctx, &leaf, level, true); // the sun grazes it: sky and ground alone
  leaf.solid_count = leaf.triangle_count;
  vt_image solid = look_down(ctx, &leaf, above, true);
  const uint8_t *f = pixel_at(&front, 0, 0), *t = pixel_at(&through, 0, 0), *u = pixel_at(&unlit, 0, 0),
                *s = pixel_at(&solid, 0, 0);
  for (int c = 0; c < 3; c++) assert_true(f[c] > t[c] && t[c] > u[c] + 10 && u[c] > s[c]);
  assert_true((double)t[1] / t[2] > (double)f[1] / f[2]);
  vt_free_image(ctx, &front);
  vt_free_image(ctx, &through);
  vt_free_image(ctx, &unlit);
  vt_free_image(ctx, &solid);
  vt_free_mesh(ctx, &leaf);
  vt_destroy_context(ctx);
}

static void a_shining_leaf_is_brighter_where_it_mirrors_the_sun(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(1, 0);
  vt_mesh leaf = {0};
  add_quad(ctx, &leaf, vt_v3(0, 0, 0), vt_v3(0.8, 0, 0), vt_v3(0, 0.8, 0));
  leaf.materials = VT_NEW(ctx, vt_material, 1);
  leaf.material_count = 1;
  leaf.materials[0] = (vt_material){.albedo = {1, 1, 1}, .thin = true, .roughness = 0.3f};
  vt_vec3 above = {0, 0, 1}, aside = vt_normalise(vt_v3(1, 0, 0.3));
  int gain[2];
  for (int k = 0; k < 2; k++) {
    leaf.materials[0].specular = 0;
    vt_image matt = look_down(ctx, &leaf, k ? aside : above, false);
    leaf.materials[0].specular = 0.05f;
    vt_image shining = look_down(ctx, &leaf, k ? aside : above, false);
    gain[k] = pixel_at(&shining, 0, 0)[2] - pixel_at(&matt, 0, 0)[2];
    vt_free_image(ctx, &matt);
    vt_free_image(ctx, &shining);
  }
  assert_true(gain[1] > 3);           // the sky's sheen
  assert_true(gain[0] > 3 * gain[1]); // and the sun's highlight
  vt_free_mesh(ctx, &leaf);
  vt_destroy_context(ctx);
}

static void another_sun_changes_colours_but_not_alpha(void **state) {
  (void)state;
  vt_context *ctx = make_context(2, 0);
  for (int path = VT_RASTERISED; path <= (vt_can_trace_rays() ? VT_RAY_TRACED : VT_RASTERISED); path++) {
    vt_synthetic_desc desc = small_desc();
    desc.light_path = (vt_light_path)path;
    vt_views a = photograph(ctx, &desc);
    desc.sun = 1;
    vt_views b = photograph(ctx, &desc);
    int other = 0, covered = 0;
    for (int i = 0; i < a.count; i++)
      for (int k = 0; k < 72 * 64; k++) {
        const uint8_t *p = a.items[i].picture.pixels + 4 * k, *q = b.items[i].picture.pixels + 4 * k;
        assert_int_equal(p[3], q[3]);
        covered += p[3] > 0, other += abs(p[1] - q[1]) > 10;
      }
    assert_true(other > covered / 5);
    vt_free_views(ctx, &a);
    vt_free_views(ctx, &b);
  }
  vt_destroy_context(ctx);
}

static void suns_stand_well_apart_and_above_the_horizon(void **state) {
  (void)state;
  for (uint32_t seed = 0; seed < 20; seed++)
    for (int i = 0; i < 8; i++) {
      vt_vec3 sun = vt_sun_direction(seed, i);
      assert_close(vt_length(sun), 1, 1e-12);
      assert_true(sun.z > 0.39);
      for (int j = 0; j < i; j++) assert_true(vt_dot(sun, vt_sun_direction(seed, j)) < cos(20 * VT_PI / 180));
    }
}

// ---- holes and broken meshes

static void a_cut_out_texture_makes_holes_for_eyes_and_for_light(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(1, 0);
  vt_mesh mesh = {0};
  add_quad(ctx, &mesh, vt_v3(0, 0, -0.2), vt_v3(0.9, 0, 0), vt_v3(0, 0.9, 0));
  add_quad(ctx, &mesh, vt_v3(0, 0, 0.4), vt_v3(0.8, 0, 0), vt_v3(0, 0.8, 0));
  mesh.triangle_materials[2] = mesh.triangle_materials[3] = 1;
  mesh.materials = VT_NEW(ctx, vt_material, 2);
  mesh.material_count = 2;
  mesh.materials[0] = (vt_material){.albedo = {1, 1, 1}, .roughness = 1};
  mesh.materials[1] = (vt_material){.albedo = {1, 1, 1}, .roughness = 1, .cutoff = 0.5f};
  vt_image *texture = &mesh.materials[1].texture;
  assert_int_equal(vt_make_image(ctx, 8, 8, 4, texture), VT_OK);
  for (int k = 0; k < 64; k++) { // the left half is a hole, above it is red, below it is blue; row 0 is at v = 1
    uint8_t *p = texture->pixels + 4 * k;
    p[0] = k < 32 ? 255 : 30, p[1] = 30, p[2] = k < 32 ? 30 : 255, p[3] = k % 8 < 4 ? 0 : 255;
  }
  vt_image p = look_down(ctx, &mesh, vt_v3(0, 0, 1), false);
  const uint8_t *hole = pixel_at(&p, -0.4, 0.4), *red = pixel_at(&p, 0.4, 0.4), *blue = pixel_at(&p, 0.4, -0.4);
  assert_true(hole[3] == 255 && hole[1] > 2 * hole[2]); // the green ground below it, in the sun
  assert_true(red[0] > red[2] && blue[2] > blue[0]);
  mesh.materials[1].cutoff = 0; // no holes: the ground is not seen
  vt_image whole = look_down(ctx, &mesh, vt_v3(0, 0, 1), false);
  assert_true(pixel_at(&whole, -0.4, 0.4)[1] != hole[1]);
  vt_free_image(ctx, &whole);
  mesh.materials[1].cutoff = 0.5f;
  mesh.triangle_count = 2; // without the upper sheet the ground seen through its hole is as bright: light came through
  vt_image bare = look_down(ctx, &mesh, vt_v3(0, 0, 1), false);
  assert_true(hole[1] > 0.8 * pixel_at(&bare, -0.4, 0.4)[1]);
  vt_free_image(ctx, &bare);
  vt_free_image(ctx, &p);
  vt_free_mesh(ctx, &mesh);
  vt_destroy_context(ctx);
}

static void degenerate_triangles_are_ignored_and_corners_that_are_no_numbers_refused(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(1, 0);
  vt_mesh mesh = {0};
  add_quad(ctx, &mesh, vt_v3(0, 0, 0), vt_v3(0.5, 0, 0), vt_v3(0, 0.5, 0));
  vt_image clean = look_down(ctx, &mesh, vt_v3(0, 0, 1), false);
  assert_int_equal(vt_reserve_mesh(ctx, &mesh, 3, 3), VT_OK);
  for (int k = 0; k < 3; k++) vt_add_vertex(&mesh, vt_v3(0.4 * k - 0.4, 0.1, 0.5), vt_v3(0, 0, 0), vt_v3(1, 1, 1));
  vt_add_triangle(&mesh, 4, 5, 6); // a line
  vt_add_triangle(&mesh, 4, 4, 5);
  vt_add_triangle(&mesh, 6, 6, 6); // a point
  vt_image p = look_down(ctx, &mesh, vt_v3(0, 0, 1), false);
  for (int k = 0; k < SIZE * SIZE; k++) {
    assert_int_equal(p.pixels[4 * k + 3], clean.pixels[4 * k + 3]);
    for (int c = 0; c < 3; c++) assert_close(p.pixels[4 * k + c], clean.pixels[4 * k + c], 1);
  }
  vt_free_image(ctx, &p);
  vt_free_image(ctx, &clean);
  static const float bad[] = {NAN, INFINITY, -INFINITY};
  for (int k = 0; k < 9; k++) {
    vt_vertex *v = &mesh.vertices[2];
    float *field = k < 3 ? &v->position[k] : k < 6 ? &v->normal[k - 3] : k < 8 ? &v->uv[k - 6] : &v->albedo[1];
    float old = *field;
    *field = bad[k % 3];
    vt_view view = {.camera = vt_look_at(vt_v3(0, 0, 3), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 0.6, 8, 8)};
    vt_views views = {.count = 1, .items = &view};
    assert_int_equal(vt_photograph_traced(ctx, &mesh, vt_v3(0, 0, 1), &(vt_wind){0}, 1, &views), VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(ctx), "vertex 2"));
    vt_clear_error(ctx);
    vt_free_image(ctx, &view.picture);
    *field = old;
  }
  vt_free_mesh(ctx, &mesh);
  vt_destroy_context(ctx);
}

static void an_empty_mesh_gives_empty_pictures(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(1, 0);
  vt_mesh mesh = {0};
  vt_image p = look_down(ctx, &mesh, vt_v3(0, 0, 1), false);
  for (int k = 0; k < SIZE * SIZE * 4; k++) assert_int_equal(p.pixels[k], 0);
  vt_free_image(ctx, &p);
  vt_destroy_context(ctx);
}

// ---- trouble

static void builds_without_rays_say_what_to_do(void **state) {
  (void)state;
  if (vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(1, 0);
  vt_synthetic_desc desc = small_desc();
  vt_views views;
  assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_MISSING_PROGRAM);
  assert_non_null(strstr(vt_last_error(ctx), "Embree"));
  vt_clear_error(ctx);
  vt_mesh mesh = {0};
  vt_mesh_truth *truth;
  add_quad(ctx, &mesh, vt_v3(0, 0, 0), vt_v3(1, 0, 0), vt_v3(0, 1, 0));
  assert_int_equal(vt_create_mesh_truth(ctx, &mesh, &truth), VT_MISSING_PROGRAM);
  assert_null(truth);
  vt_free_mesh(ctx, &mesh);
  vt_destroy_context(ctx);
}

static void unusable_light_and_wind_are_refused_with_a_sentence(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_synthetic_desc bad[8];
  for (int i = 0; i < 8; i++) bad[i] = small_desc(), bad[i].light_path = VT_RASTERISED;
  bad[0].sun = -1, bad[1].wind = -0.1, bad[2].wind = 0.6, bad[3].wind = NAN, bad[4].light_path = (vt_light_path)2;
  bad[5].backdrop = (vt_backdrop)9, bad[6].rig = (vt_rig)77, bad[7].supersample = 9;
  for (int i = 0; i < 8; i++) {
    vt_views views;
    assert_int_equal(vt_make_synthetic_views(ctx, &bad[i], &views), VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(ctx), "give"));
    vt_clear_error(ctx);
  }
  vt_destroy_context(ctx);
}

static void tracing_keeps_to_the_memory_bound_and_ends_when_cancelled(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  bool refused = false, done = false;
  for (uint64_t bound = 1000000; bound < 200000000; bound *= 2) {
    vt_context *ctx = make_context(2, bound);
    vt_synthetic_desc desc = small_desc();
    vt_views views;
    vt_status status = vt_make_synthetic_views(ctx, &desc, &views);
    assert_true(status == VT_OK || status == VT_OUT_OF_MEMORY);
    refused = refused || status == VT_OUT_OF_MEMORY, done = status == VT_OK;
    assert_true(vt_peak_bytes(ctx) <= bound);
    vt_free_views(ctx, &views);
    vt_destroy_context(ctx); // asserts that nothing is left
  }
  assert_true(refused && done);
  vt_context *ctx = make_context(2, 0);
  vt_synthetic_desc desc = small_desc();
  vt_views views;
  vt_cancel(ctx);
  assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_CANCELLED);
  vt_destroy_context(ctx);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(both_paths_measure_the_same_alpha),
      cmocka_unit_test(both_paths_agree_about_brightness),
      cmocka_unit_test(traced_pictures_have_the_same_bits_for_any_number_of_threads),
      cmocka_unit_test(a_shadow_falls_on_the_side_away_from_the_sun),
      cmocka_unit_test(a_leaf_lit_from_behind_is_bright_and_greener),
      cmocka_unit_test(a_shining_leaf_is_brighter_where_it_mirrors_the_sun),
      cmocka_unit_test(another_sun_changes_colours_but_not_alpha),
      cmocka_unit_test(suns_stand_well_apart_and_above_the_horizon),
      cmocka_unit_test(a_cut_out_texture_makes_holes_for_eyes_and_for_light),
      cmocka_unit_test(degenerate_triangles_are_ignored_and_corners_that_are_no_numbers_refused),
      cmocka_unit_test(an_empty_mesh_gives_empty_pictures),
      cmocka_unit_test(builds_without_rays_say_what_to_do),
      cmocka_unit_test(unusable_light_and_wind_are_refused_with_a_sentence),
      cmocka_unit_test(tracing_keeps_to_the_memory_bound_and_ends_when_cancelled),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
