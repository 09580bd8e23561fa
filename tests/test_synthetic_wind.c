// test_synthetic_wind.c - wind, backdrops and the truth of meshes
// SPDX-License-Identifier: BSD-3-Clause

#include "datasets-synthetic/truth_mesh.h"
#include "datasets-synthetic/wind.h"
#include "tests/synthetic_cases.h"

// ---- wind

static void wind_moves_leaves_and_not_the_foot_of_the_trunk(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  vt_synthetic_desc desc = small_desc();
  desc.light_path = VT_RASTERISED;
  vt_mesh mesh;
  assert_int_equal(vt_make_synthetic_mesh(ctx, &desc, &mesh), VT_OK);
  vt_wind wind;
  const double amplitude = 0.05;
  assert_int_equal(vt_make_wind(ctx, &mesh, 1, amplitude, &wind), VT_OK);
  vt_vertex *moved = VT_NEW(ctx, vt_vertex, mesh.vertex_count), *again = VT_NEW(ctx, vt_vertex, mesh.vertex_count);
  vt_blow(&wind, &mesh, 3, moved);
  vt_blow(&wind, &mesh, 4, again);
  double farthest = 0, leaves = 0, between = 0;
  size_t leaf_count = 0;
  for (size_t v = 0; v < mesh.vertex_count; v++) {
    const float *p = mesh.vertices[v].position, *q = moved[v].position, *r = again[v].position, *n = moved[v].normal;
    double way = hypot(hypot(q[0] - p[0], q[1] - p[1]), q[2] - p[2]);
    farthest = fmax(farthest, way);
    assert_close(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-4);
    if (p[2] < -0.99 && !wind.flutters[v]) assert_true(way < 1e-3 * amplitude + 1e-6);
    if (wind.flutters[v]) leaves += way, between += hypot(hypot(q[0] - r[0], q[1] - r[1]), q[2] - r[2]), leaf_count++;
  }
  assert_true(farthest <= amplitude * 1.0001 && farthest > 0.3 * amplitude);
  assert_true(leaves / leaf_count > 0.05 * amplitude && between / leaf_count > 0.05 * amplitude);
  wind.amplitude = 0;
  vt_blow(&wind, &mesh, 3, moved);
  assert_memory_equal(moved, mesh.vertices, mesh.vertex_count * sizeof *moved);
  vt_free(ctx, moved);
  vt_free(ctx, again);
  vt_free_wind(ctx, &wind);
  vt_free_mesh(ctx, &mesh);
  vt_destroy_context(ctx);
}

static void normals_turn_with_the_surface_in_wind(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  enum { N = 20 };
  vt_mesh sheet = {0}; // N x N small quads of a plane, no two of one leaf
  for (int y = 0; y < N; y++)
    for (int x = 0; x < N; x++)
      add_quad(ctx, &sheet, vt_v3(0.1 * x - 1, 0.1 * y, 0.05 * x), vt_v3(1e-3, 0, 5e-4), vt_v3(0, 1e-3, 0));
  vt_wind wind;
  assert_int_equal(vt_make_wind(ctx, &sheet, 7, 0.1, &wind), VT_OK);
  vt_vertex *moved = VT_NEW(ctx, vt_vertex, sheet.vertex_count);
  vt_blow(&wind, &sheet, 1, moved);
  double turned = 0;
  for (size_t t = 0; t < sheet.triangle_count; t++) {
    vt_vec3 p[3];
    for (int k = 0; k < 3; k++) {
      const float *q = moved[sheet.triangles[t][k]].position;
      p[k] = vt_v3(q[0], q[1], q[2]);
    }
    vt_vec3 flat = vt_normalise(vt_cross(vt_sub(p[1], p[0]), vt_sub(p[2], p[0])));
    const float *n = moved[sheet.triangles[t][0]].normal, *old = sheet.vertices[sheet.triangles[t][0]].normal;
    assert_true(vt_dot(flat, vt_v3(n[0], n[1], n[2])) > 0.999);
    turned = fmax(turned, 1 - (double)(n[0] * old[0] + n[1] * old[1] + n[2] * old[2]));
  }
  assert_true(turned > 0.01);
  vt_free(ctx, moved);
  vt_free_wind(ctx, &wind);
  vt_free_mesh(ctx, &sheet);
  vt_destroy_context(ctx);
}

static void every_photograph_in_wind_has_its_own_gust(void **state) {
  (void)state;
  const int thread_count = 2;
  vt_context *ctx = make_context(thread_count, 0);
  for (int path = VT_RASTERISED; path <= (vt_can_trace_rays() ? VT_RAY_TRACED : VT_RASTERISED); path++) {
    vt_synthetic_desc desc = small_desc();
    desc.light_path = (vt_light_path)path, desc.wind = 0.12;
    vt_views windy = photograph(ctx, &desc);
    desc.wind = 0;
    vt_views still = photograph(ctx, &desc);
    for (int i = 0; i < windy.count; i++) {
      int other = 0, covered = 0;
      for (int k = 3; k < 72 * 64 * 4; k += 4) {
        int a = windy.items[i].picture.pixels[k], b = still.items[i].picture.pixels[k];
        covered += a || b, other += abs(a - b) > 30;
      }
      assert_true(other > covered / 20);
    }
    vt_views roles = {.count = windy.count, .items = windy.items};
    assert_true(vt_gust_of(&roles, 0) != vt_gust_of(&roles, 1) && vt_gust_of(&roles, 0) != vt_gust_of(&roles, 3));
    vt_free_views(ctx, &windy);
    vt_free_views(ctx, &still);
  }
  vt_destroy_context(ctx);
}

// ---- backdrops

static void backdrops_are_opaque_and_keep_what_covers_them(void **state) {
  (void)state;
  vt_context *ctx = make_context(2, 0);
  vt_synthetic_desc desc = small_desc();
  desc.light_path = VT_RASTERISED;
  for (int kind = VT_BACKDROP_NONE; kind <= VT_BACKDROP_STUDIO; kind++) {
    desc.backdrop = (vt_backdrop)kind;
    vt_views views = photograph(ctx, &desc), before = photograph(ctx, &desc);
    assert_int_equal(vt_put_before_backdrop(ctx, &desc, &views), VT_OK);
    int low = 255, high = 0;
    for (int i = 0; i < views.count; i++)
      for (int k = 0; k < 72 * 64; k++) {
        const uint8_t *p = views.items[i].picture.pixels + 4 * k, *q = before.items[i].picture.pixels + 4 * k;
        if (kind == VT_BACKDROP_NONE || q[3] == 255) assert_memory_equal(p, q, 4);
        if (kind == VT_BACKDROP_NONE) continue;
        assert_int_equal(p[3], 255);
        if (!q[3]) low = p[1] < low ? p[1] : low, high = p[1] > high ? p[1] : high;
        for (int c = 0; c < 3; c++) assert_true(p[c] >= q[c] * q[3] / 255 - 1);
      }
    if (kind != VT_BACKDROP_NONE) assert_true(high > low + 15); // not one colour
    if (kind == VT_BACKDROP_STUDIO) assert_true(high < 110);    // dark
    vt_free_views(ctx, &views);
    vt_free_views(ctx, &before);
  }
  vt_destroy_context(ctx);
}

static void the_sky_is_the_same_from_two_cameras(void **state) {
  (void)state;
  enum { EDGE = 64 };
  vt_context *ctx = make_context(1, 0);
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.backdrop = VT_BACKDROP_SKY;
  vt_view items[2] = {{.camera = vt_look_at(vt_v3(4, 0, 0), vt_v3(0, 0, 1), vt_v3(0, 0, 1), 0.9, EDGE, EDGE)},
                      {.camera = vt_look_at(vt_v3(3, 2, 1), vt_v3(-1, 2.8, 2.4), vt_v3(0, 0.2, 1), 0.7, EDGE, EDGE)}};
  vt_views views = {.count = 2, .items = items};
  for (int i = 0; i < 2; i++) assert_int_equal(vt_make_image(ctx, EDGE, EDGE, 4, &items[i].picture), VT_OK);
  assert_int_equal(vt_put_before_backdrop(ctx, &desc, &views), VT_OK);
  int shared = 0, varied = 0;
  double off = 0, otherwise = 0;
  for (int y = 0; y < EDGE; y++)
    for (int x = 0; x < EDGE; x++) {
      vt_vec3 d = vt_camera_ray(&items[0].camera, x + 0.5, y + 0.5).direction, far = vt_scale(d, 1e9);
      double at[2];
      if (!vt_project(&items[1].camera, far, at) || at[0] < 0 || at[1] < 0 || at[0] >= EDGE || at[1] >= EDGE) continue;
      const uint8_t *p = items[0].picture.pixels + 4 * (y * EDGE + x);
      const uint8_t *q = items[1].picture.pixels + 4 * ((int)at[1] * EDGE + (int)at[0]);
      // Half a pixel away at most, and clouds have edges; a mirrored place is the measure of what chance would give.
      const uint8_t *r = items[1].picture.pixels + 4 * ((EDGE - 1 - (int)at[1]) * EDGE + EDGE - 1 - (int)at[0]);
      off += abs(p[0] - q[0]), otherwise += abs(p[0] - r[0]);
      shared++, varied += abs(p[0] - items[0].picture.pixels[0]) > 24;
    }
  assert_true(shared > 500 && varied > 100);
  assert_true(off / shared < 5 && otherwise / shared > 4 * off / shared);
  for (int i = 0; i < 2; i++) vt_free_image(ctx, &items[i].picture);
  vt_destroy_context(ctx);
}

// ---- truth

static void a_beam_is_stopped_by_the_share_of_its_disc_that_is_covered(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(1, 0);
  vt_mesh mesh = {0};
  add_quad(ctx, &mesh, vt_v3(0.5, 0, 0), vt_v3(0.5, 0, 0), vt_v3(0, 1, 0)); // the half plane x > 0 (up to 1), at z = 0
  add_quad(ctx, &mesh, vt_v3(0, 0.5, 1), vt_v3(1, 0, 0), vt_v3(0, 0.5, 0)); // the half plane y > 0, at z = 1
  vt_mesh_truth *truth;
  assert_int_equal(vt_create_mesh_truth(ctx, &mesh, &truth), VT_OK);
  vt_ray down = {{0, 0, 3}, {0, 0, -1}};
  assert_close(vt_mesh_optical_depth(truth, &down, 0, 10, 0.2), -log(0.25), 1e-12);
  assert_close(vt_mesh_optical_depth(truth, &down, 0, 2.5, 0.2), -log(0.5), 1e-12); // the upper one alone
  assert_close(vt_mesh_optical_depth(truth, &down, 2.5, 10, 0.2), -log(0.5), 1e-12);
  assert_true(vt_mesh_optical_depth(truth, &down, 0, 1.5, 0.2) == 0);
  assert_true(vt_mesh_optical_depth(truth, &down, 2, 1, 0.2) == 0);
  down.origin.x = 0.5;
  assert_true(isinf(vt_mesh_optical_depth(truth, &down, 0, 10, 0.2)));
  down.origin.x = 0.1, down.origin.y = -0.5; // a chord of the disc at half its radius: 0.8045 of it is covered
  assert_close(exp(-vt_mesh_optical_depth(truth, &down, 0, 10, 0.2)), 1 - 0.8045, 0.01);
  vt_destroy_mesh_truth(ctx, truth);
  vt_free_mesh(ctx, &mesh);
  vt_destroy_context(ctx);
}

static void true_views_agree_with_photographs_and_know_depth(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *ctx = make_context(2, 0);
  vt_synthetic_desc desc = small_desc();
  vt_views views = photograph(ctx, &desc);
  vt_mesh mesh;
  vt_mesh_truth *truth;
  vt_fimage alpha, depth;
  assert_int_equal(vt_make_synthetic_mesh(ctx, &desc, &mesh), VT_OK);
  assert_int_equal(vt_create_mesh_truth(ctx, &mesh, &truth), VT_OK);
  const vt_camera *camera = &views.items[1].camera;
  assert_int_equal(vt_mesh_view(ctx, truth, camera, desc.supersample, &alpha, &depth), VT_OK);
  double distance = vt_length(vt_camera_centre(camera));
  for (int k = 0; k < 72 * 64; k++) {
    assert_close(alpha.pixels[k] * 255, views.items[1].picture.pixels[4 * k + 3], 0.51);
    assert_true((alpha.pixels[k] == 0) == (bool)isinf(depth.pixels[k]));
    if (alpha.pixels[k] > 0) assert_true(depth.pixels[k] > distance - 1.8 && depth.pixels[k] < distance + 1.8);
  }
  vt_free_fimage(ctx, &alpha);
  assert_int_equal(vt_mesh_view(ctx, truth, camera, 1, &alpha, NULL), VT_OK);
  vt_free_fimage(ctx, &alpha);
  vt_free_fimage(ctx, &depth);
  vt_destroy_mesh_truth(ctx, truth);
  vt_free_mesh(ctx, &mesh);
  vt_mesh wall = {0};
  add_quad(ctx, &wall, vt_v3(0, 0, 0.25), vt_v3(2, 0, 0), vt_v3(0, 2, 0));
  vt_camera above = vt_look_at(vt_v3(0, 0, 3), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 0.6, 16, 16);
  assert_int_equal(vt_create_mesh_truth(ctx, &wall, &truth), VT_OK);
  assert_int_equal(vt_mesh_view(ctx, truth, &above, 2, &alpha, &depth), VT_OK);
  for (int k = 0; k < 256; k++) assert_close(depth.pixels[k], 2.75, 1e-5); // z, not the distance along the ray
  vt_free_fimage(ctx, &alpha);
  vt_free_fimage(ctx, &depth);
  vt_destroy_mesh_truth(ctx, truth);
  vt_free_mesh(ctx, &wall);
  vt_free_views(ctx, &views);
  vt_destroy_context(ctx);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(wind_moves_leaves_and_not_the_foot_of_the_trunk),
      cmocka_unit_test(normals_turn_with_the_surface_in_wind),
      cmocka_unit_test(every_photograph_in_wind_has_its_own_gust),
      cmocka_unit_test(backdrops_are_opaque_and_keep_what_covers_them),
      cmocka_unit_test(the_sky_is_the_same_from_two_cameras),
      cmocka_unit_test(a_beam_is_stopped_by_the_share_of_its_disc_that_is_covered),
      cmocka_unit_test(true_views_agree_with_photographs_and_know_depth),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
