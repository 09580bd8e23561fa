// test_synthetic_truth.c - comb and crown against quadrature, cells against sums, meshes cut into cells
// SPDX-License-Identifier: BSD-3-Clause
#include "base/rng.h"
#include "datasets-synthetic/mesh.h"
#include "datasets-synthetic/synthetic.h"
#include "datasets-synthetic/truth_cells.h"
#include "tests/unit.h"

static vt_context *open_context(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads, desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

static vt_synthetic_desc desc_of(vt_synthetic_kind kind, uint32_t seed) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = kind, desc.seed = seed, desc.peak_extinction = kind == VT_SYNTHETIC_COMB ? 80 : 4;
  return desc;
}

static vt_truth *open_truth(vt_context *context, const vt_synthetic_desc *desc) {
  vt_truth *truth;
  assert_int_equal(vt_create_truth(context, desc, &truth), VT_OK);
  return truth;
}

static vt_vec3 random_point(vt_rng *rng, double half) {
  double x = vt_random_between(rng, -half, half), y = vt_random_between(rng, -half, half);
  return vt_v3(x, y, vt_random_between(rng, -half, half));
}

// ---- phantoms

static void depth_is_the_integral_of_extinction(void **state) {
  (void)state;
  enum { STEPS = 200000 };
  vt_context *context = open_context(1);
  vt_rng rng = vt_seed_rng(3, 3);
  for (int round = 0; round < 40; round++) {
    vt_synthetic_desc desc = desc_of(round % 2 ? VT_SYNTHETIC_COMB : VT_SYNTHETIC_CROWN, (uint32_t)round);
    vt_truth *truth = open_truth(context, &desc);
    vt_vec3 from = random_point(&rng, 2), to = random_point(&rng, 0.5);
    vt_ray ray = {from, vt_normalise(vt_sub(to, from))};
    double near = vt_random_between(&rng, 0, 1), far = near + vt_random_between(&rng, 1, 3), sum = 0;
    for (int k = 0; k < STEPS; k++) {
      double s = near + (far - near) * (k + 0.5) / STEPS;
      sum += vt_true_extinction(truth, vt_add(ray.origin, vt_scale(ray.direction, s))) * (far - near) / STEPS;
    }
    double depth = vt_true_optical_depth(truth, &ray, near, far, 0), middle = 0.4 * near + 0.6 * far;
    assert_close(depth, sum, desc.kind == VT_SYNTHETIC_COMB ? 2e-2 : 3e-3); // each surface is met to half a step
    double parts =
        vt_true_optical_depth(truth, &ray, near, middle, 0) + vt_true_optical_depth(truth, &ray, middle, far, 0);
    assert_close(parts, depth, 1e-11);
    vt_ray away = {vt_add(from, vt_scale(ray.direction, -1e4)), ray.direction}; // from far away the same
    assert_close(vt_true_optical_depth(truth, &away, near + 1e4, far + 1e4, 0), depth, 1e-8);
    vt_destroy_truth(context, truth);
  }
  vt_destroy_context(context);
}

static void extinction_is_never_negative_and_peaks_as_asked(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  for (uint32_t seed = 0; seed < 12; seed++) {
    vt_synthetic_desc desc = desc_of(VT_SYNTHETIC_CROWN, seed);
    vt_phantom phantom = vt_make_phantom(&desc);
    vt_rng rng = vt_seed_rng(seed, 1);
    double highest = 0, core = 0;
    for (int i = 0; i < 60000; i++) {
      vt_vec3 point = random_point(&rng, 1);
      double extinction = vt_phantom_extinction(&phantom, point);
      assert_true(extinction > -1e-12);
      assert_true(extinction < 1e-12 || vt_length(point) <= 1);
      highest = fmax(highest, extinction);
      vt_vec3 inner = vt_scale(vt_sub(point, vt_v3(0, 0, -0.7)), 0.2); // around the middle of the crown
      core += vt_phantom_extinction(&phantom, inner) / 60000;
    }
    printf("crown %u: highest %.3f of 4, core %.3f\n", seed, highest, core);
    assert_true(highest > 2.8 && highest < 4.001); // where three clumps overlap is a small place
    assert_true(core < 0.15 * 4);                  // hollow
  }
  vt_destroy_context(context);
}

static void half_of_the_crowns_rays_saturate(void **state) {
  (void)state;
  vt_context *context = open_context(2);
  vt_synthetic_desc desc;
  vt_views views;
  assert_true(vt_find_scene("crown_64", &desc));
  assert_int_equal(vt_make_synthetic_views(context, &desc, &views), VT_OK);
  int met = 0, saturated = 0;
  for (int i = 0; i < views.count; i++)
    for (int k = 0; k < 64 * 64; k++) {
      int alpha = views.items[i].picture.pixels[4 * k + 3];
      met += alpha > 0, saturated += alpha > 0.99 * 255;
    }
  printf("crown_64: %.3f of its rays saturate\n", (double)saturated / met);
  assert_close((double)saturated / met, 0.5, 0.08);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void plates_of_the_comb_are_thinner_than_cells_of_level_7(void **state) {
  (void)state;
  vt_synthetic_desc desc = desc_of(VT_SYNTHETIC_COMB, 4);
  vt_phantom comb = vt_make_phantom(&desc);
  double low[3] = {9, 9, 9}, high[3] = {-9, -9, -9};
  vt_rng rng = vt_seed_rng(1, 1);
  for (int i = 0; i < 1000000; i++) {
    vt_vec3 p = random_point(&rng, 1);
    double at[3] = {p.x, p.y, p.z};
    if (vt_phantom_extinction(&comb, p) <= 0) continue;
    assert_true(vt_length(p) <= 1);
    for (int k = 0; k < 3; k++) low[k] = fmin(low[k], at[k]), high[k] = fmax(high[k], at[k]);
  }
  double cell = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2])) / 128;
  assert_int_equal(comb.solid_count, 10);
  for (int i = 0; i < comb.solid_count; i++) { // twice the shortest half axis: 2 / the longest row of M
    double thickness = 2;
    for (int k = 0; k < 3; k++) {
      const double *row = comb.solids[i].unit_from_world.m + 3 * k;
      thickness = fmin(thickness, 2 / sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]));
    }
    assert_true(thickness < cell);
  }
}

static void mean_depth_is_the_weighted_mean_of_distance(void **state) {
  (void)state;
  enum { STEPS = 100000 };
  vt_rng rng = vt_seed_rng(9, 3);
  double worst = 0;
  for (int round = 0; round < 50; round++) {
    vt_synthetic_desc desc = desc_of(VT_SYNTHETIC_BALL + round % 5, (uint32_t)round);
    vt_phantom phantom = vt_make_phantom(&desc);
    vt_vec3 from = random_point(&rng, 2), to = random_point(&rng, 0.6);
    vt_ray ray = {from, vt_normalise(vt_sub(to, from))};
    double alpha, mean, far = 6, sum = 0, weight = 0, last = 0;
    vt_phantom_first_moment(&phantom, &ray, 0, INFINITY, &alpha, &mean);
    for (int k = 0; k < STEPS; k++) {
      double s = far * (k + 1) / STEPS, now = -expm1(-vt_phantom_depth(&phantom, &ray, 0, s));
      sum += (now - last) * (s - 0.5 * far / STEPS), weight += now - last, last = now;
    }
    assert_close(alpha, weight, 1e-6); // blobs end at the radius 1
    if (!(weight > 1e-6)) continue;
    worst = fmax(worst, fabs(mean - sum / weight));
    assert_close(mean, sum / weight, 1e-4);
  }
  printf("mean depth within %.2g\n", worst);
}

static void views_show_the_alphas_of_the_photographs(void **state) {
  (void)state;
  vt_context *context = open_context(2);
  for (int kind = VT_SYNTHETIC_BALL; kind <= VT_SYNTHETIC_CROWN; kind++) {
    vt_synthetic_desc desc = desc_of((vt_synthetic_kind)kind, 2);
    desc.train_count = 2, desc.test_count = 0, desc.width = 40, desc.height = 30, desc.supersample = 3;
    vt_truth *truth = open_truth(context, &desc);
    vt_views views;
    assert_int_equal(vt_make_synthetic_views(context, &desc, &views), VT_OK);
    const vt_view *view = &views.items[1];
    vt_fimage alpha, depth, again;
    double distance = vt_length(vt_camera_centre(&view->camera));
    assert_int_equal(vt_true_view(context, truth, &view->camera, 3, &alpha, &depth), VT_OK);
    assert_int_equal(vt_true_view(context, truth, &view->camera, 3, &again, NULL), VT_OK);
    assert_memory_equal(alpha.pixels, again.pixels, 40 * 30 * sizeof(float));
    int seen = 0;
    for (int i = 0; i < 40 * 30; i++) {
      assert_close(view->picture.pixels[4 * i + 3], 255 * (double)alpha.pixels[i], 0.51);
      seen += alpha.pixels[i] > 0;
      if (alpha.pixels[i] > 0) assert_close(depth.pixels[i], distance, 1.001);
      if (!(alpha.pixels[i] > 0)) assert_true(isinf(depth.pixels[i]));
    }
    assert_true(seen > 200);
    vt_free_fimage(context, &alpha);
    vt_free_fimage(context, &depth);
    vt_free_fimage(context, &again);
    vt_free_views(context, &views);
    vt_destroy_truth(context, truth);
  }
  vt_destroy_context(context);
}

static void every_cell(int axis, uint16_t (*xyz)[3]) {
  for (int i = 0; i < axis * axis * axis; i++)
    xyz[i][0] = (uint16_t)(i % axis), xyz[i][1] = (uint16_t)(i / axis % axis), xyz[i][2] = (uint16_t)(i / axis / axis);
}

static void cells_of_phantoms_are_means_of_points(void **state) {
  (void)state;
  enum { AXIS = 8, COUNT = AXIS * AXIS * AXIS, POINTS = 24 };
  vt_context *context = open_context(2);
  static uint16_t xyz[COUNT][3];
  static float extinction[COUNT], area[COUNT];
  every_cell(AXIS, xyz);
  const double edge = 2.2 / AXIS;
  for (int kind = VT_SYNTHETIC_BALL; kind <= VT_SYNTHETIC_CROWN; kind++) {
    vt_synthetic_desc desc = desc_of((vt_synthetic_kind)kind, 2);
    vt_truth *truth = open_truth(context, &desc);
    assert_int_equal(vt_true_cells(context, truth, vt_v3(-1.1, -1.1, -1.1), 2.2, AXIS, COUNT, (const uint16_t(*)[3])xyz,
                                   extinction, area),
                     VT_OK);
    double mean = 0, error = 0, true_mean = 0;
    for (int i = 0; i < COUNT; i++) {
      double sum = 0;
      for (int k = 0; k < POINTS * POINTS * POINTS; k++) {
        double x = (k % POINTS + 0.5) / POINTS, y = (k / POINTS % POINTS + 0.5) / POINTS,
               z = (k / POINTS / POINTS + 0.5) / POINTS;
        sum += vt_true_extinction(
            truth, vt_v3((xyz[i][0] + x) * edge - 1.1, (xyz[i][1] + y) * edge - 1.1, (xyz[i][2] + z) * edge - 1.1));
      }
      sum /= POINTS * POINTS * POINTS;
      mean += extinction[i] / COUNT, true_mean += sum / COUNT, error += pow(extinction[i] - sum, 2) / COUNT;
      assert_true(area[i] == 0);
    }
    printf("%s: mean %.5f of %.5f, RMS %.5f\n", vt_synthetic_name((vt_synthetic_kind)kind), mean, true_mean,
           sqrt(error));
    assert_close(mean, true_mean, 0.02 * true_mean);
    assert_true(sqrt(error) < (kind == VT_SYNTHETIC_COMB ? 0.25 : 0.05) * desc.peak_extinction / 4);
    vt_destroy_truth(context, truth);
  }
  vt_destroy_context(context);
}

// ---- meshes

static double area_of(const vt_mesh *mesh, size_t begin, size_t end) {
  double sum = 0;
  for (size_t t = begin; t < end; t++) {
    vt_vec3 p[3];
    for (int k = 0; k < 3; k++) {
      const float *at = mesh->vertices[mesh->triangles[t][k]].position;
      p[k] = vt_v3(at[0], at[1], at[2]);
    }
    sum += 0.5 * vt_length(vt_cross(vt_sub(p[1], p[0]), vt_sub(p[2], p[0])));
  }
  return sum;
}

static void add_triangle(vt_context *context, vt_mesh *mesh, vt_vec3 a, vt_vec3 b, vt_vec3 c) {
  assert_int_equal(vt_reserve_mesh(context, mesh, 3, 1), VT_OK);
  vt_vec3 up = {0, 0, 1}, grey = {0.5, 0.5, 0.5};
  uint32_t i = vt_add_vertex(mesh, a, up, grey);
  vt_add_vertex(mesh, b, up, grey), vt_add_vertex(mesh, c, up, grey);
  vt_add_triangle(mesh, i, i + 1, i + 2);
}

static void areas_of_cells_add_up_to_the_meshs(void **state) {
  (void)state;
  vt_rng rng = vt_seed_rng(21, 2);
  for (int level = 0; level <= 6; level += 2) {
    vt_context *context = open_context(2);
    vt_mesh mesh = {0};
    int axis = 1 << level;
    size_t count = (size_t)axis * (size_t)axis * (size_t)axis;
    for (int i = 0; i < 4000; i++) { // the first 1500 are of a solid; sizes from far below a cell to the whole root
      vt_vec3 a = random_point(&rng, 0.99);
      double size = pow(10, vt_random_between(&rng, -3, 0));
      vt_vec3 b = vt_add(a, vt_scale(random_point(&rng, 1), size)),
              c = vt_add(a, vt_scale(random_point(&rng, 1), size));
      if (fabs(b.x) > 1 || fabs(b.y) > 1 || fabs(b.z) > 1 || fabs(c.x) > 1 || fabs(c.y) > 1 || fabs(c.z) > 1)
        b = a, c = a;
      add_triangle(context, &mesh, a, b, c);
      if (i == 1499) mesh.solid_count = mesh.triangle_count;
    }
    // in planes between cells, and in the faces of the root
    add_triangle(context, &mesh, vt_v3(0, -0.7, -0.7), vt_v3(0, 0.7, -0.7), vt_v3(0, 0.1, 0.9));
    add_triangle(context, &mesh, vt_v3(1, -0.7, -0.7), vt_v3(1, 0.7, -0.7), vt_v3(1, 0.1, 0.9));
    add_triangle(context, &mesh, vt_v3(-0.7, -1, -0.7), vt_v3(0.7, -1, -0.7), vt_v3(0.1, -1, 0.9));
    add_triangle(context, &mesh, vt_v3(-1, -1, 0.5), vt_v3(1, -1, 0.5), vt_v3(-1, 1, 0.5));
    uint16_t(*xyz)[3] = vt_alloc(context, count, sizeof *xyz);
    float *extinction = VT_NEW(context, float, count), *area = VT_NEW(context, float, count);
    assert_true(xyz && extinction && area);
    every_cell(axis, xyz);
    vt_grid grid = {vt_v3(-1, -1, -1), 2.0 / axis, axis};
    assert_int_equal(vt_mesh_cells(context, &mesh, &grid, count, (const uint16_t(*)[3])xyz, extinction, area), VT_OK);
    double leaves = 0, stopped = 0, volume = pow(2.0 / axis, 3);
    for (size_t i = 0; i < count; i++) leaves += area[i], stopped += extinction[i] * volume;
    double solid = area_of(&mesh, 0, mesh.solid_count), thin = area_of(&mesh, mesh.solid_count, mesh.triangle_count);
    printf("level %d: leaves %.9f of %.9f, stopped %.9f of %.9f\n", level, leaves, thin, stopped, solid / 4 + thin / 2);
    assert_close(leaves, thin, 1e-6 * thin);
    assert_close(stopped, solid / 4 + thin / 2, 1e-6 * stopped);
    vt_free(context, xyz);
    vt_free(context, extinction);
    vt_free(context, area);
    vt_free_mesh(context, &mesh);
    vt_destroy_context(context);
  }
}

static void a_cut_triangle_is_shared_out_as_geometry_says(void **state) {
  (void)state;
  vt_context *context = open_context(1);
  vt_mesh mesh = {0};
  // Half of a square of side 2 in the plane z = 0.25: three of four columns, one of them whole, two halved.
  add_triangle(context, &mesh, vt_v3(0, 0, 0.25), vt_v3(2, 0, 0.25), vt_v3(0, 2, 0.25));
  uint16_t xyz[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}};
  float extinction[5], area[5];
  vt_grid grid = {vt_v3(0, 0, 0), 1, 2};
  assert_int_equal(vt_mesh_cells(context, &mesh, &grid, 5, (const uint16_t(*)[3])xyz, extinction, area), VT_OK);
  const double want[5] = {1, 0.5, 0.5, 0, 0};
  for (int i = 0; i < 5; i++) {
    assert_close(area[i], want[i], 1e-7);
    assert_close(extinction[i], want[i] / 2, 1e-7);
  }
  vt_free_mesh(context, &mesh);
  vt_destroy_context(context);
}

static void a_grown_tree_answers_as_its_mesh(void **state) {
  (void)state;
  enum { AXIS = 32, COUNT = AXIS * AXIS * AXIS };
  static uint16_t xyz[COUNT][3];
  static float extinction[COUNT], area[COUNT];
  if (!vt_can_trace_rays()) skip();
  vt_context *context = open_context(2);
  vt_synthetic_desc desc = desc_of(VT_SYNTHETIC_SMALL_OAK, 3);
  desc.leaf_count = 300;
  vt_truth *truth = open_truth(context, &desc);
  vt_mesh mesh;
  assert_int_equal(vt_make_synthetic_mesh(context, &desc, &mesh), VT_OK);
  every_cell(AXIS, xyz);
  assert_int_equal(vt_true_cells(context, truth, vt_v3(-1.2, -1.2, -1.2), 2.4, AXIS, COUNT, (const uint16_t(*)[3])xyz,
                                 extinction, area),
                   VT_OK);
  double leaves = 0, stopped = 0, volume = pow(2.4 / AXIS, 3);
  for (int i = 0; i < COUNT; i++) leaves += area[i], stopped += extinction[i] * volume;
  double solid = area_of(&mesh, 0, mesh.solid_count), thin = area_of(&mesh, mesh.solid_count, mesh.triangle_count);
  assert_close(leaves, thin, 1e-6 * thin);
  assert_close(stopped, solid / 4 + thin / 2, 1e-6 * stopped);
  vt_ray foot = {vt_v3(-3, 0, -0.95), vt_v3(1, 0, 0)}, past = {vt_v3(-3, 0, 1.5), vt_v3(1, 0, 0)};
  double at = 0;
  for (int k = -20; k <= 20; k++) { // somewhere at its foot the stem stops all
    foot.origin.y = k * 0.02;
    at = fmax(at, vt_true_optical_depth(truth, &foot, 0, 6, 0.002));
  }
  assert_true(isinf(at));
  assert_close(vt_true_optical_depth(truth, &past, 0, 6, 0.01), 0, 0);
  vt_free_mesh(context, &mesh);
  vt_destroy_truth(context, truth);
  vt_destroy_context(context);
}

static void threads_change_no_bit_of_a_cell(void **state) {
  (void)state;
  enum { AXIS = 16, COUNT = AXIS * AXIS * AXIS };
  static uint16_t xyz[COUNT][3];
  static float first[2][COUNT], again[2][COUNT];
  every_cell(AXIS, xyz);
  for (int threads = 1; threads <= 7; threads += 3) {
    vt_context *context = open_context(threads);
    vt_mesh mesh = {0};
    vt_rng rng = vt_seed_rng(5, 5);
    for (int i = 0; i < 500; i++)
      add_triangle(context, &mesh, random_point(&rng, 1), random_point(&rng, 1), random_point(&rng, 1));
    vt_grid grid = {vt_v3(-1, -1, -1), 2.0 / AXIS, AXIS};
    vt_synthetic_desc desc = desc_of(VT_SYNTHETIC_CROWN, 3);
    vt_phantom crown = vt_make_phantom(&desc);
    assert_int_equal(vt_mesh_cells(context, &mesh, &grid, COUNT, (const uint16_t(*)[3])xyz, again[0], NULL), VT_OK);
    assert_int_equal(vt_phantom_cells(context, &crown, &grid, COUNT, (const uint16_t(*)[3])xyz, again[1]), VT_OK);
    if (threads == 1) memcpy(first, again, sizeof first);
    assert_memory_equal(first, again, sizeof first);
    vt_free_mesh(context, &mesh);
    vt_destroy_context(context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(depth_is_the_integral_of_extinction),
                                     cmocka_unit_test(extinction_is_never_negative_and_peaks_as_asked),
                                     cmocka_unit_test(half_of_the_crowns_rays_saturate),
                                     cmocka_unit_test(plates_of_the_comb_are_thinner_than_cells_of_level_7),
                                     cmocka_unit_test(mean_depth_is_the_weighted_mean_of_distance),
                                     cmocka_unit_test(views_show_the_alphas_of_the_photographs),
                                     cmocka_unit_test(cells_of_phantoms_are_means_of_points),
                                     cmocka_unit_test(areas_of_cells_add_up_to_the_meshs),
                                     cmocka_unit_test(a_cut_triangle_is_shared_out_as_geometry_says),
                                     cmocka_unit_test(a_grown_tree_answers_as_its_mesh),
                                     cmocka_unit_test(threads_change_no_bit_of_a_cell)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
