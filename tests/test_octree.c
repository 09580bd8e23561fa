// test_octree.c - cells, the walk of a ray, the order from far to near
// SPDX-License-Identifier: BSD-3-Clause
#include "base/rng.h"
#include "octree/octree.h"
#include "tests/unit.h"

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  return vt_create_context(&desc);
}

// A level with each cell there with probability `share`; share 1: all.
static void random_octree(vt_context *context, int branching, int level, double share, double edge, vt_vec3 origin,
                          uint64_t seed, vt_octree *out) {
  *out = (vt_octree){.origin = origin, .edge = edge, .branching = branching, .level_count = level + 1};
  int n = 1;
  for (int i = 0; i < level; i++) n *= branching;
  uint16_t(*xyz)[3] = vt_alloc(context, (size_t)n * n * n, sizeof *xyz);
  size_t count = 0;
  vt_rng rng = vt_seed_rng(seed, 1);
  for (int i = 0; i < n * n * n; i++)
    if (share >= 1 || vt_random_unit(&rng) < share) {
      int j = (int)((i * 7919ll) % (n * n * n)); // any order will do
      xyz[count][0] = (uint16_t)(j % n), xyz[count][1] = (uint16_t)(j / n % n), xyz[count][2] = (uint16_t)(j / (n * n));
      count++;
    }
  assert_int_equal(vt_make_level(context, branching, level, count, (const uint16_t(*)[3])xyz, &out->levels[level]), VT_OK);
  vt_free(context, xyz);
}

static double clipped_length(const vt_octree *o, vt_ray ray) {
  double near = 0, far = 1e300, from[3] = {ray.origin.x - o->origin.x, ray.origin.y - o->origin.y, ray.origin.z - o->origin.z},
         d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  for (int a = 0; a < 3; a++) {
    if (fabs(d[a]) < 1e-12) {
      if (from[a] < 0 || from[a] >= o->edge) return 0;
      continue;
    }
    double t0 = -from[a] / d[a], t1 = (o->edge - from[a]) / d[a];
    near = fmax(near, fmin(t0, t1));
    far = fmin(far, fmax(t0, t1));
  }
  return far > near ? far - near : 0;
}

static vt_ray random_ray(vt_rng *rng, const vt_octree *o, int n) {
  vt_vec3 p = vt_v3(vt_random_between(rng, -1, 2), vt_random_between(rng, -1, 2), vt_random_between(rng, -1, 2));
  vt_vec3 q = vt_v3(vt_random_between(rng, 0, 1), vt_random_between(rng, 0, 1), vt_random_between(rng, 0, 1));
  int kind = (int)(vt_random(rng) % 6);
  if (kind == 1) q.x = p.x = floor(p.x * n) / n;                                // within a plane of the grid
  if (kind == 2) p.y = q.y = floor(p.y * n) / n, p.z = q.z = floor(q.z * n) / n; // along an edge
  if (kind == 3) p = vt_v3(floor(q.x * n) / n, floor(q.y * n) / n, floor(q.z * n) / n); // from a corner
  if (kind == 4) q = vt_v3(p.x + 1, p.y + 1, p.z + 1);                           // along the diagonal
  if (kind == 5) p = vt_v3(q.x, q.y, -1), q.x = p.x;                             // along an axis
  vt_ray ray = {vt_add(o->origin, vt_scale(p, o->edge)), vt_normalise(vt_sub(q, p))};
  if (vt_length(ray.direction) == 0) ray.direction = vt_v3(0, 0, 1);
  return ray;
}

static void chords_of_a_full_grid_sum_to_the_clipped_length(int branching, int level, double edge, vt_vec3 origin) {
  vt_context *context = make_context();
  vt_octree o;
  random_octree(context, branching, level, 1, edge, origin, 1, &o);
  vt_segment *segments = VT_NEW(context, vt_segment, vt_max_segments(&o.levels[level]));
  vt_rng rng = vt_seed_rng(5, 5);
  int n = o.levels[level].axis_cells;
  for (int i = 0; i < 200000; i++) {
    vt_ray ray = random_ray(&rng, &o, n);
    size_t count = vt_walk_ray(&o, level, &ray, segments);
    double sum = 0, last = -1;
    for (size_t k = 0; k < count; k++) {
      sum += segments[k].length;
      assert_true(segments[k].length > 0 && segments[k].cell < o.levels[level].cell_count);
      assert_true(segments[k].entry >= last - 1e-4);
      last = segments[k].entry;
    }
    // each dropped chord is shorter than 1e-5 edges, and a float chord is good to 1e-6
    assert_close(sum, clipped_length(&o, ray) * n / edge, 3e-5 * n);
  }
  vt_free(context, segments);
  vt_free_octree(context, &o);
  vt_destroy_context(context);
}

static void chords_sum_to_the_clipped_length(void **state) {
  (void)state;
  chords_of_a_full_grid_sum_to_the_clipped_length(2, 0, 1, vt_v3(0, 0, 0));
  chords_of_a_full_grid_sum_to_the_clipped_length(2, 5, 2, vt_v3(-1, -1, -1));
  chords_of_a_full_grid_sum_to_the_clipped_length(3, 3, 3e-6, vt_v3(1e-6, 0, -2e-6));
  chords_of_a_full_grid_sum_to_the_clipped_length(2, 3, 5e6, vt_v3(1e6, -2e6, 3e6));
}

// Every cell that the ray meets is found once, and no other: against a slab test of all cells.
static void walk_finds_each_met_cell_once(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int branching = 2; branching <= 3; branching++) {
    int level = branching == 2 ? 4 : 2;
    vt_octree o;
    random_octree(context, branching, level, 0.3, 1, vt_v3(0, 0, 0), 9, &o);
    const vt_level *cells = &o.levels[level];
    vt_segment *segments = VT_NEW(context, vt_segment, vt_max_segments(cells));
    uint8_t *seen = VT_NEW(context, uint8_t, cells->cell_count);
    vt_rng rng = vt_seed_rng(3, 3);
    for (int i = 0; i < 3000; i++) {
      vt_ray ray = random_ray(&rng, &o, cells->axis_cells);
      size_t count = vt_walk_ray(&o, level, &ray, segments);
      memset(seen, 0, cells->cell_count);
      for (size_t k = 0; k < count; k++) {
        vt_octree one = {.edge = vt_cell_edge(&o, level)};
        one.origin = vt_sub(vt_cell_centre(&o, level, segments[k].cell), vt_v3(one.edge / 2, one.edge / 2, one.edge / 2));
        double chord = clipped_length(&one, ray) / one.edge;
        assert_false(seen[segments[k].cell]++);
        if (chord > 1e-6) assert_close(chord, segments[k].length, 1e-5);
      }
      for (uint32_t c = 0; c < cells->cell_count; c++) {
        vt_octree one = {.edge = vt_cell_edge(&o, level)};
        one.origin = vt_sub(vt_cell_centre(&o, level, c), vt_v3(one.edge / 2, one.edge / 2, one.edge / 2));
        double chord = clipped_length(&one, ray) / one.edge;
        bool along_face = fabs(ray.direction.x) < 1e-9 || fabs(ray.direction.y) < 1e-9 || fabs(ray.direction.z) < 1e-9;
        if (chord > 1e-3 && !along_face) assert_true(seen[c]);
      }
    }
    vt_free(context, seen);
    vt_free(context, segments);
    vt_free_octree(context, &o);
  }
  vt_destroy_context(context);
}

static void splitting_leaves_every_rays_depth_unchanged(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int branching = 2; branching <= 3; branching++) {
    vt_octree o;
    random_octree(context, branching, 2, 0.4, 4, vt_v3(0, 0, 0), 2, &o);
    vt_rng rng = vt_seed_rng(8, 8);
    for (uint32_t i = 0; i < o.levels[2].cell_count; i++) o.levels[2].optical_depth[i] = (float)vt_random_unit(&rng);
    assert_int_equal(vt_split_level(context, branching, 2, &o.levels[2], NULL, &o.levels[3]), VT_OK);
    vt_segment *segments = VT_NEW(context, vt_segment, vt_max_segments(&o.levels[3]));
    for (int i = 0; i < 5000; i++) {
      vt_ray ray = random_ray(&rng, &o, o.levels[3].axis_cells);
      double depth[2] = {0, 0};
      for (int l = 2; l <= 3; l++) {
        size_t count = vt_walk_ray(&o, l, &ray, segments);
        for (size_t k = 0; k < count; k++) depth[l - 2] += segments[k].length * o.levels[l].optical_depth[segments[k].cell];
      }
      assert_close(depth[0], depth[1], 2e-4);
    }
    for (uint32_t i = 0; i < o.levels[3].cell_count; i++)
      assert_int_equal(vt_find_cell(&o.levels[3], branching, o.levels[3].x[i], o.levels[3].y[i], o.levels[3].z[i]), i);
    vt_free(context, segments);
    vt_free_octree(context, &o);
  }
  vt_destroy_context(context);
}

static void filtering_keeps_values_and_morton_order(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_octree o;
  vt_level kept;
  random_octree(context, 2, 4, 0.5, 1, vt_v3(0, 0, 0), 4, &o);
  vt_level *level = &o.levels[4];
  uint8_t *keep = VT_NEW(context, uint8_t, level->cell_count);
  size_t count = 0;
  for (uint32_t i = 0; i < level->cell_count; i++) {
    level->optical_depth[i] = (float)i;
    count += keep[i] = i % 3 == 0;
  }
  assert_int_equal(vt_filter_level(context, 2, 4, level, keep, &kept), VT_OK);
  assert_int_equal(kept.cell_count, count);
  for (uint32_t i = 0; i < kept.cell_count; i++) {
    assert_int_equal((int)kept.optical_depth[i], 3 * (int)i);
    if (i)
      assert_true(vt_morton(2, kept.x[i - 1], kept.y[i - 1], kept.z[i - 1]) < vt_morton(2, kept.x[i], kept.y[i], kept.z[i]));
  }
  assert_int_equal(vt_find_cell(&kept, 2, -1, 0, 0), VT_NO_CELL);
  assert_int_equal(vt_find_cell(&kept, 2, 0, 16, 0), VT_NO_CELL);
  vt_free(context, keep);
  vt_free_level(context, &kept);
  vt_free_octree(context, &o);
  vt_destroy_context(context);
}

// Along every ray from the eye, cells must come later in the far-to-near order the nearer they are.
static void order_is_exact_for_eyes_outside_and_inside(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int branching = 2; branching <= 3; branching++) {
    int level = branching == 2 ? 4 : 3;
    vt_octree o;
    random_octree(context, branching, level, 0.4, 1, vt_v3(0, 0, 0), 6, &o);
    const vt_level *cells = &o.levels[level];
    uint32_t *order = VT_NEW(context, uint32_t, cells->cell_count), *place = VT_NEW(context, uint32_t, cells->cell_count);
    vt_segment *segments = VT_NEW(context, vt_segment, vt_max_segments(cells));
    vt_rng rng = vt_seed_rng(7, 7);
    double range[3][2] = {{-5, 5}, {0.2, 0.8}, {0.4, 3}}; // around, inside, at crown height
    for (int i = 0; i < 300; i++) {
      double *r = range[i % 3];
      vt_vec3 eye = vt_v3(vt_random_between(&rng, r[0], r[1]), vt_random_between(&rng, r[0], r[1]),
                          vt_random_between(&rng, i % 3 == 2 ? 0.3 : r[0], i % 3 == 2 ? 0.7 : r[1]));
      if (i % 7 == 0) eye.x = 0.5; // on a plane between cells
      assert_int_equal(vt_order_back_to_front(context, &o, level, eye, order), VT_OK);
      for (uint32_t k = 0; k < cells->cell_count; k++) place[order[k]] = k;
      for (int j = 0; j < 50; j++) {
        vt_vec3 to = vt_v3(vt_random_unit(&rng), vt_random_unit(&rng), vt_random_unit(&rng));
        vt_ray ray = {eye, vt_normalise(vt_sub(to, eye))};
        size_t count = vt_walk_ray(&o, level, &ray, segments);
        for (size_t k = 1; k < count; k++) assert_true(place[segments[k].cell] < place[segments[k - 1].cell]);
      }
    }
    vt_free(context, segments);
    vt_free(context, place);
    vt_free(context, order);
    vt_free_octree(context, &o);
  }
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(chords_sum_to_the_clipped_length), cmocka_unit_test(walk_finds_each_met_cell_once),
      cmocka_unit_test(splitting_leaves_every_rays_depth_unchanged), cmocka_unit_test(filtering_keeps_values_and_morton_order),
      cmocka_unit_test(order_is_exact_for_eyes_outside_and_inside)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
