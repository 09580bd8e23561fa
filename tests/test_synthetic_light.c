// test_synthetic_light.c - ray-traced photographs, wind, backdrops and the truth of meshes
// SPDX-License-Identifier: BSD-3-Clause

#include "datasets-synthetic/mesh.h"
#include "datasets-synthetic/photograph.h"
#include "datasets-synthetic/photograph_traced.h"
#include "datasets-synthetic/shade_traced.h"
#include "datasets-synthetic/sky.h"
#include "datasets-synthetic/synthetic.h"
#include "datasets-synthetic/truth_mesh.h"
#include "tests/unit.h"

static vt_context *make_context(int threads, uint64_t max_memory) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads, desc.max_memory = max_memory, desc.log_level = VT_LOG_QUIET;
  vt_context *ctx = vt_create_context(&desc);
  assert_non_null(ctx);
  return ctx;
}

static vt_synthetic_desc small_desc(void) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.train_count = 3, desc.test_count = 1, desc.width = 72, desc.height = 64, desc.supersample = 3;
  desc.leaf_count = 800, desc.light_path = VT_RAY_TRACED;
  return desc;
}

static vt_views photograph(vt_context *ctx, const vt_synthetic_desc *desc) {
  vt_views views;
  vt_status status = vt_make_synthetic_views(ctx, desc, &views);
  if (status) printf("%s\n", vt_last_error(ctx));
  assert_int_equal(status, VT_OK);
  return views;
}

static void add_quad(vt_context *ctx, vt_mesh *mesh, vt_vec3 centre, vt_vec3 u, vt_vec3 v) {
  assert_int_equal(vt_reserve_mesh(ctx, mesh, 4, 2), VT_OK);
  vt_vec3 normal = vt_normalise(vt_cross(u, v)), green = {0.07, 0.15, 0.03};
  uint32_t first = (uint32_t)mesh->vertex_count;
  for (int k = 0; k < 4; k++) {
    double x = k == 1 || k == 2 ? 1 : -1, y = k >= 2 ? 1 : -1;
    uint32_t at = vt_add_vertex(mesh, vt_add(centre, vt_add(vt_scale(u, x), vt_scale(v, y))), normal, green);
    mesh->vertices[at].uv[0] = (float)(0.5 + 0.5 * x), mesh->vertices[at].uv[1] = (float)(0.5 + 0.5 * y);
  }
  vt_add_triangle(mesh, first, first + 1, first + 2);
  vt_add_triangle(mesh, first, first + 2, first + 3);
}

enum { SIZE = 48 };

// One photograph of the mesh from straight above (or below) in the given sun, 3 units away, half the picture 1 unit wide.
static vt_image look_down(vt_context *ctx, const vt_mesh *mesh, vt_vec3 sun, bool from_below) {
  vt_view view = {.name = "above"};
  view.camera = vt_look_at(vt_v3(0, 0, from_below ? -3 : 3), vt_v3(0, 0, 0), vt_v3(0, 1, 0), 2 * atan(1.0 / 3), SIZE, SIZE);
  vt_views views = {1, &view};
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
    static const int threads[] = {1, 2, 3, 7};
    for (int t = 0; t < 4; t++) {
      vt_context *ctx = make_context(threads[t], 0);
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
    vt_views views = {1, &view};
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
    if (wind.flutters[v])
      leaves += way, between += hypot(hypot(q[0] - r[0], q[1] - r[1]), q[2] - r[2]), leaf_count++;
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
  vt_context *ctx = make_context(2, 0);
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
    vt_views roles = {windy.count, windy.items};
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
  vt_views views = {2, items};
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
      cmocka_unit_test(wind_moves_leaves_and_not_the_foot_of_the_trunk),
      cmocka_unit_test(normals_turn_with_the_surface_in_wind),
      cmocka_unit_test(every_photograph_in_wind_has_its_own_gust),
      cmocka_unit_test(backdrops_are_opaque_and_keep_what_covers_them),
      cmocka_unit_test(the_sky_is_the_same_from_two_cameras),
      cmocka_unit_test(a_beam_is_stopped_by_the_share_of_its_disc_that_is_covered),
      cmocka_unit_test(true_views_agree_with_photographs_and_know_depth),
      cmocka_unit_test(builds_without_rays_say_what_to_do),
      cmocka_unit_test(unusable_light_and_wind_are_refused_with_a_sentence),
      cmocka_unit_test(tracing_keeps_to_the_memory_bound_and_ends_when_cancelled),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
