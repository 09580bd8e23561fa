// test_ray_packets.c - rays in packets against a brute-force walk in double; neighbours, ranges and maps of sparse levels
// SPDX-License-Identifier: BSD-3-Clause
//
// The reference cuts a ray at every plane of the grid that it crosses, sorts the cuts, and asks for the cell around the
// middle of each piece: no stepping, no state, nothing shared with the code under test.

#include "base/rng.h"
#include "octree/octree.h"
#include "tests/unit.h"

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  return vt_create_context(&desc);
}

static int power(int b, int e) { return e ? b * power(b, e - 1) : 1; }

static int compare_keys(const void *a, const void *b) {
  uint64_t p = *(const uint64_t *)a, q = *(const uint64_t *)b;
  return p < q ? -1 : p > q;
}

// `wanted` different cells at most: all of them if the level has no more, else random ones, half of them in a small lump, so
// that there are bricks with many cells and wide empty space between.
static void make_octree(vt_context *context, int branching, int level, size_t wanted, uint64_t seed, vt_octree *out) {
  uint64_t n = (uint64_t)power(branching, level), all = n * n * n;
  size_t count = all <= wanted ? (size_t)all : wanted;
  *out = (vt_octree){.edge = 1, .branching = branching, .level_count = level + 1};
  uint64_t *keys = VT_NEW(context, uint64_t, count);
  uint16_t(*xyz)[3] = vt_alloc(context, count, sizeof *xyz);
  vt_rng rng = vt_seed_rng(seed, 1);
  uint64_t lump = n < 24 ? n : 24;
  for (size_t i = 0; i < count; i++) {
    uint64_t c[3];
    for (int a = 0; a < 3; a++)
      c[a] = i % 2 ? n / 2 - lump / 2 + vt_random(&rng) % lump : vt_random(&rng) % n;
    keys[i] = count == all ? i : c[0] + n * (c[1] + n * c[2]);
  }
  qsort(keys, count, sizeof *keys, compare_keys);
  size_t kept = 0;
  for (size_t i = 0; i < count; i++)
    if (i == 0 || keys[i] != keys[i - 1]) {
      xyz[kept][0] = (uint16_t)(keys[i] % n), xyz[kept][1] = (uint16_t)(keys[i] / n % n);
      xyz[kept][2] = (uint16_t)(keys[i] / n / n);
      kept++;
    }
  assert_int_equal(vt_make_level(context, branching, level, kept, (const uint16_t(*)[3])xyz, &out->levels[level]), VT_OK);
  vt_free(context, keys);
  vt_free(context, xyz);
}

typedef enum ray_kind { ANYHOW, IN_A_FACE, ALONG_AN_EDGE, FROM_A_CORNER, DIAGONAL, PAST_CORNERS, ALONG_AN_AXIS, FROM_INSIDE,
                        GRAZING, FROM_AFAR, KINDS } ray_kind;

// A ray that passes near the middle of some cell. Coordinates of planes are such that a power of two holds them exactly.
static vt_ray make_ray(vt_rng *rng, const vt_octree *o, int level, ray_kind kind) {
  const vt_level *cells = &o->levels[level];
  int n = cells->axis_cells;
  uint32_t cell = (uint32_t)(vt_random(rng) % cells->cell_count);
  double target[3] = {cells->x[cell] + vt_random_unit(rng), cells->y[cell] + vt_random_unit(rng),
                      cells->z[cell] + vt_random_unit(rng)};
  double from[3];
  for (int a = 0; a < 3; a++) from[a] = vt_random_between(rng, -n, 2.0 * n);
  int axis = (int)(vt_random(rng) % 3), other = (axis + 1) % 3;
  switch (kind) {
  case IN_A_FACE: target[axis] = from[axis] = floor(target[axis]); break;
  case ALONG_AN_EDGE:
    target[axis] = from[axis] = floor(target[axis]), target[other] = from[other] = floor(target[other]);
    break;
  case FROM_A_CORNER:
    for (int a = 0; a < 3; a++) from[a] = floor(target[a]);
    break;
  case PAST_CORNERS: // pieces just too short to be kept, at each of them
  case DIAGONAL: {   // through corners only, and from outside
    double steps = floor(vt_random_between(rng, 0, n)) + (vt_random(rng) % 2 ? n : 0), sign[3];
    for (int a = 0; a < 3; a++) sign[a] = vt_random(rng) % 2 ? 1 : -1;
    double past = kind == PAST_CORNERS ? vt_random_between(rng, -5e-7, 5e-7) : 0;
    for (int a = 0; a < 3; a++) {
      target[a] = floor(target[a]) + (a == axis ? past : a == other ? -past : 0);
      from[a] = target[a] + sign[a] * (steps + 1);
    }
    break;
  }
  case ALONG_AN_AXIS:
    for (int a = 0; a < 3; a++)
      if (a != axis) from[a] = target[a];
    break;
  case FROM_INSIDE:
    for (int a = 0; a < 3; a++) from[a] = vt_random_between(rng, 0, n);
    break;
  case GRAZING: from[axis] = target[axis] + vt_random_between(rng, -1, 1) * pow(10, vt_random_between(rng, -11, -2)); break;
  case FROM_AFAR:
    for (int a = 0; a < 3; a++) from[a] *= 1e4;
    break;
  default: break;
  }
  vt_vec3 p = vt_v3(from[0] / n, from[1] / n, from[2] / n), q = vt_v3(target[0] / n, target[1] / n, target[2] / n);
  vt_ray ray = {p, vt_normalise(vt_sub(q, p))};
  if (!(vt_length(ray.direction) > 0.5)) ray.direction = vt_v3(0, 0, 1);
  return ray;
}

// The cuts of a ray with all planes, in cell edges, sorted, from where it enters the root to where it leaves it.
static size_t cut_ray(vt_ray ray, int n, double *cuts) {
  double near = 0, far = INFINITY, o[3] = {ray.origin.x * n, ray.origin.y * n, ray.origin.z * n},
         d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  for (int a = 0; a < 3; a++) {
    if (fabs(d[a]) <= 1e-12) {
      if (o[a] < 0 || o[a] >= n) return 0;
      continue;
    }
    near = fmax(near, fmin(-o[a] / d[a], (n - o[a]) / d[a]));
    far = fmin(far, fmax(-o[a] / d[a], (n - o[a]) / d[a]));
  }
  if (!(near < far)) return 0;
  size_t count = 0;
  cuts[count++] = near;
  cuts[count++] = far;
  for (int a = 0; a < 3; a++)
    for (int i = 1; i < n && fabs(d[a]) > 1e-12; i++) {
      double t = (i - o[a]) / d[a];
      if (t > near && t < far) cuts[count++] = t;
    }
  for (size_t i = 1; i < count; i++) // three sorted runs, nearly: cheaper than qsort for some hundreds
    for (size_t k = i; k > 0 && cuts[k] < cuts[k - 1]; k--) {
      double t = cuts[k];
      cuts[k] = cuts[k - 1], cuts[k - 1] = t;
    }
  return count;
}

typedef struct expected { uint32_t cell; double length; } expected;

// *sure: no piece of the ray lies so close to a plane that rounding could put it on the other side.
static size_t expected_chords(const vt_octree *o, int level, vt_ray ray, double *cuts, expected *out, bool *sure) {
  int n = o->levels[level].axis_cells;
  size_t count = cut_ray(ray, n, cuts), met = 0;
  *sure = true;
  for (size_t i = 0; i + 1 < count; i++) {
    double length = cuts[i + 1] - cuts[i], t = cuts[i] + length / 2;
    if (!(length > 1e-9)) continue;
    double at[3] = {ray.origin.x * n + t * ray.direction.x, ray.origin.y * n + t * ray.direction.y,
                    ray.origin.z * n + t * ray.direction.z}, d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
    for (int a = 0; a < 3; a++)
      if (length > 1e-6 && fabs(at[a] - floor(at[a] + 0.5)) < 1e-9 && d[a] != 0) *sure = false;
    uint32_t cell = vt_find_cell(&o->levels[level], o->branching, (int)floor(at[0]), (int)floor(at[1]), (int)floor(at[2]));
    if (cell == VT_NO_CELL) continue;
    if (met && out[met - 1].cell == cell)
      out[met - 1].length += length;
    else
      out[met++] = (expected){cell, length};
  }
  return met;
}

typedef struct walk_test {
  vt_octree o;
  int level;
  size_t capacity;
  vt_chord *chords, *others;
  double *cuts;
  expected *expected;
} walk_test;

static walk_test begin_walks(vt_context *context, int branching, int level, size_t wanted, uint64_t seed) {
  walk_test t = {.level = level};
  make_octree(context, branching, level, wanted, seed, &t.o);
  t.capacity = vt_max_segments(&t.o.levels[level]);
  t.chords = VT_NEW(context, vt_chord, t.capacity * VT_PACKET_RAYS);
  t.others = VT_NEW(context, vt_chord, t.capacity * VT_PACKET_RAYS);
  t.cuts = VT_NEW(context, double, t.capacity);
  t.expected = VT_NEW(context, expected, t.capacity);
  return t;
}

static void end_walks(vt_context *context, walk_test *t) {
  vt_free(context, t->chords);
  vt_free(context, t->others);
  vt_free(context, t->cuts);
  vt_free(context, t->expected);
  vt_free_octree(context, &t->o);
}

// Walks on the plain path, and demands the same bits of every other path that this machine has.
static void walk_on_all_paths(walk_test *t, const vt_ray *rays, int count, uint32_t *chord_count) {
  vt_walk_rays(&t->o, t->level, VT_WALK_PLAIN, rays, count, t->chords, t->capacity, chord_count);
  for (int path = VT_WALK_AVX2; path <= (int)vt_best_walk_path(); path++) {
    uint32_t other_count[VT_PACKET_RAYS];
    vt_walk_rays(&t->o, t->level, (vt_walk_path)path, rays, count, t->others, t->capacity, other_count);
    for (int i = 0; i < count; i++) {
      assert_int_equal(other_count[i], chord_count[i]);
      assert_memory_equal(t->others + i * t->capacity, t->chords + i * t->capacity, chord_count[i] * sizeof(vt_chord));
    }
  }
}

static void compare_ray(walk_test *t, vt_ray ray, const vt_chord *chords, size_t count) {
  bool sure;
  size_t met = expected_chords(&t->o, t->level, ray, t->cuts, t->expected, &sure), k = 0;
  if (!sure) return;
  // The eye's distance loses digits to both; everything else is good to a few units of 2^-26 and a float's last bit.
  double tolerance = 2e-6 + 4e-16 * t->o.levels[t->level].axis_cells * vt_length(ray.origin);
  for (size_t i = 0; i < count; i++) {
    assert_true(chords[i].cell < t->o.levels[t->level].cell_count && chords[i].length > 0);
    while (k < met && t->expected[k].cell != chords[i].cell) {
      assert_true(t->expected[k].length < tolerance); // only slivers may be missed
      k++;
    }
    if (k == met) { // not in order, met twice, or not on the ray at all: a sliver at most
      assert_true(chords[i].length < tolerance);
      k = 0;
      while (k < met && i > 0 && t->expected[k].cell != chords[i - 1].cell) k++;
      continue;
    }
    assert_close(chords[i].length, t->expected[k].length, tolerance);
    k++;
  }
  for (; k < met; k++) assert_true(t->expected[k].length < tolerance);
}

static void compare_level(vt_context *context, int branching, int level, size_t wanted, int packets, uint64_t seed) {
  walk_test t = begin_walks(context, branching, level, wanted, seed);
  vt_rng rng = vt_seed_rng(seed, 7);
  for (int i = 0; i < packets; i++) {
    vt_ray rays[VT_PACKET_RAYS];
    uint32_t count[VT_PACKET_RAYS];
    int n = 1 + i % VT_PACKET_RAYS;
    for (int r = 0; r < n; r++) rays[r] = make_ray(&rng, &t.o, level, (ray_kind)((i + r) % KINDS));
    walk_on_all_paths(&t, rays, n, count);
    for (int r = 0; r < n; r++) compare_ray(&t, rays[r], t.chords + r * t.capacity, count[r]);
  }
  end_walks(context, &t);
}

// A walk that sums distances misses cells after some hundred planes; one that steps on both axes at an edge, or on the wrong
// one, misses or doubles cells there; one that enters a brick by its position enters the one before it.
static void every_met_cell_is_found_once_at_every_level(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int level = 0; level <= VT_MAX_LEVEL; level++)
    for (int full = 0; full <= (level <= 5); full++)
      compare_level(context, 2, level, full ? 1u << 15 : 3000, 300 / (1 + level), 10 + (uint64_t)level);
  for (int level = 0; level <= 6; level++)
    for (int full = 0; full <= (level <= 3); full++)
      compare_level(context, 3, level, full ? 19683 : 3000, 400 / (1 + level), 40 + (uint64_t)level);
  vt_destroy_context(context);
}

// Beyond 2^18 bricks the map has pages; the tri-grid's level 10 has 59049 cells along an edge, and six pages on the way to a
// brick. A map with an entry for each brick would ask for 30 TB here.
static void the_finest_levels_cost_what_their_cells_cost(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int branching = 2; branching <= 3; branching++) {
    walk_test t = begin_walks(context, branching, VT_MAX_LEVEL, 2000, 3);
    const vt_level *level = &t.o.levels[VT_MAX_LEVEL];
    assert_true(level->map.depth > 0);
    assert_true(level->map.entry_count * sizeof(int32_t) < 4u << 20);
    for (uint32_t i = 0; i < level->cell_count; i++)
      assert_int_equal(vt_find_cell(level, branching, level->x[i], level->y[i], level->z[i]), i);
    vt_rng rng = vt_seed_rng(6, 6);
    for (int i = 0; i < 20; i++) {
      vt_ray rays[VT_PACKET_RAYS];
      uint32_t count[VT_PACKET_RAYS];
      for (int r = 0; r < VT_PACKET_RAYS; r++) rays[r] = make_ray(&rng, &t.o, VT_MAX_LEVEL, (ray_kind)(r % KINDS));
      walk_on_all_paths(&t, rays, VT_PACKET_RAYS, count);
      for (int r = 0; r < VT_PACKET_RAYS; r++) {
        vt_segment *segments = VT_NEW(context, vt_segment, t.capacity);
        size_t met = vt_walk_ray(&t.o, VT_MAX_LEVEL, &rays[r], segments), k = 0;
        for (size_t c = 0; c < count[r]; c++) { // as the ray-by-ray walk finds them
          const vt_chord *chord = &t.chords[r * t.capacity + c];
          size_t same = k;
          while (same < met && segments[same].cell != chord->cell) same++;
          if (same == met) {
            assert_true(chord->length < 1e-4); // that walk drops more
            continue;
          }
          while (k < same) assert_true(segments[k++].length < 1e-4);
          assert_close(segments[k++].length, chord->length, 1e-4);
        }
        while (k < met) assert_true(segments[k++].length < 1e-4);
        vt_free(context, segments);
      }
    }
    end_walks(context, &t);
  }
  vt_destroy_context(context);
}

// Chords that do not add up make a full cell lighter or heavier than its ray: dropped slivers at corners, float sums of
// planes, and a last cell that ends at the brick's plane in one sum and at the root's in another are the usual reasons.
static void chords_of_millions_of_rays_sum_to_the_clipped_length(void **state) {
  (void)state;
  vt_context *context = make_context();
  const struct { int branching, level, packets; } rows[] = {{2, 0, 30000}, {2, 1, 30000}, {2, 3, 30000}, {2, 5, 20000},
                                                            {2, 7, 3000},  {3, 1, 20000}, {3, 4, 5000}};
  for (size_t row = 0; row < sizeof rows / sizeof rows[0]; row++) {
    walk_test t = begin_walks(context, rows[row].branching, rows[row].level, SIZE_MAX, 1);
    vt_rng rng = vt_seed_rng(row, 5);
    int n = t.o.levels[t.level].axis_cells;
    double worst = 0;
    for (int i = 0; i < rows[row].packets; i++) {
      vt_ray rays[VT_PACKET_RAYS];
      uint32_t count[VT_PACKET_RAYS];
      for (int r = 0; r < VT_PACKET_RAYS; r++) rays[r] = make_ray(&rng, &t.o, t.level, (ray_kind)((i + r) % KINDS));
      vt_walk_rays(&t.o, t.level, vt_best_walk_path(), rays, VT_PACKET_RAYS, t.chords, t.capacity, count);
      for (int r = 0; r < VT_PACKET_RAYS; r++) {
        double sum = 0, near = 0, far = INFINITY, o[3] = {rays[r].origin.x * n, rays[r].origin.y * n, rays[r].origin.z * n},
               d[3] = {rays[r].direction.x, rays[r].direction.y, rays[r].direction.z};
        for (int a = 0; a < 3; a++) {
          if (fabs(d[a]) <= 1e-12) {
            if (o[a] < 0 || o[a] >= n) far = 0;
            continue;
          }
          near = fmax(near, fmin(-o[a] / d[a], (n - o[a]) / d[a]));
          far = fmin(far, fmax(-o[a] / d[a], (n - o[a]) / d[a]));
        }
        for (uint32_t k = 0; k < count[r]; k++) sum += t.chords[r * t.capacity + k].length;
        double lost = fabs(sum - fmax(0, far - near)) / n;
        if (vt_length(rays[r].origin) < 10 && lost > worst) worst = lost;
        assert_true(lost < 1e-6 || (vt_length(rays[r].origin) >= 10 && lost < 2e-6 + 1e-15 * vt_length(rays[r].origin)));
      }
    }
    printf("branching %d level %d: worst difference %.1e of the root's edge\n", rows[row].branching, rows[row].level, worst);
    end_walks(context, &t);
  }
  vt_destroy_context(context);
}

// Lanes without a ray store too: nothing but the rays' own parts of the room may change.
static void packets_that_are_not_full_write_only_to_their_rays(void **state) {
  (void)state;
  vt_context *context = make_context();
  walk_test t = begin_walks(context, 2, 5, 3000, 4);
  vt_rng rng = vt_seed_rng(8, 1);
  size_t all = VT_PACKET_RAYS * t.capacity, met = 0;
  for (int path = 0; path <= (int)vt_best_walk_path(); path++)
    for (int count = 0; count <= VT_PACKET_RAYS; count++) {
      vt_ray rays[VT_PACKET_RAYS];
      uint32_t chord_count[VT_PACKET_RAYS];
      for (int r = 0; r < count; r++) rays[r] = make_ray(&rng, &t.o, t.level, (ray_kind)((count + r) % KINDS));
      memset(t.chords, 0x5a, all * sizeof *t.chords);
      vt_walk_rays(&t.o, t.level, (vt_walk_path)path, rays, count, t.chords, t.capacity, chord_count);
      for (size_t i = (size_t)count * t.capacity; i < all; i++) assert_int_equal(t.chords[i].cell, 0x5a5a5a5a);
      for (int r = 0; r < count; r++) met += chord_count[r];
    }
  assert_true(met > 1000);
  end_walks(context, &t);
  vt_destroy_context(context);
}

// An inverse of 0 is infinite, and 0 x infinity is NaN for an eye on a plane: then every comparison is false, and a walk hangs
// or meets nothing. Half-open: the face belongs to the cell above, so the root's lower faces are inside, its upper ones are not.
static void rays_along_faces_belong_to_the_cell_above(void **state) {
  (void)state;
  vt_context *context = make_context();
  walk_test t = begin_walks(context, 2, 3, SIZE_MAX, 1);
  for (int axis = 0; axis < 3; axis++)
    for (int sign = -1; sign <= 1; sign += 2)
      for (int i = 0; i <= 8; i++)
        for (int j = 0; j <= 8; j++) {
          double o[3], d[3] = {0, 0, 0};
          int c[3];
          o[axis] = sign > 0 ? 0 : 1, d[axis] = sign; // the eye itself stands on the root's face
          o[(axis + 1) % 3] = i / 8.0, o[(axis + 2) % 3] = j / 8.0;
          d[(axis + 1) % 3] = -0.0;
          vt_ray ray = {vt_v3(o[0], o[1], o[2]), vt_v3(d[0], d[1], d[2])};
          uint32_t count;
          walk_on_all_paths(&t, &ray, 1, &count);
          assert_int_equal(count, i == 8 || j == 8 ? 0 : 8);
          for (uint32_t k = 0; k < count; k++) {
            c[axis] = sign > 0 ? (int)k : 7 - (int)k, c[(axis + 1) % 3] = i, c[(axis + 2) % 3] = j;
            assert_int_equal(t.chords[k].cell, vt_find_cell(&t.o.levels[3], 2, c[0], c[1], c[2]));
            assert_true(t.chords[k].length == 1);
          }
        }
  end_walks(context, &t);
  vt_destroy_context(context);
}

// Along the diagonal all three planes are met at once: a walk that steps one axis at a time finds cells of no length between, one
// that steps all three must not leave the brick on one axis and stay on another.
static void diagonals_meet_the_cells_of_the_diagonal_alone(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int branching = 2; branching <= 3; branching++) {
    int level = branching == 2 ? 5 : 3;
    walk_test t = begin_walks(context, branching, level, SIZE_MAX, 1);
    int n = t.o.levels[level].axis_cells;
    for (int way = 0; way < 8; way++) {
      vt_vec3 sign = vt_v3(way & 1 ? -1 : 1, way & 2 ? -1 : 1, way & 4 ? -1 : 1);
      vt_ray ray = {vt_add(vt_v3(0.5, 0.5, 0.5), vt_scale(sign, -1.5)), vt_normalise(sign)};
      uint32_t count;
      walk_on_all_paths(&t, &ray, 1, &count);
      assert_int_equal(count, n);
      for (int k = 0; k < n; k++) {
        int x = way & 1 ? n - 1 - k : k, y = way & 2 ? n - 1 - k : k, z = way & 4 ? n - 1 - k : k;
        uint32_t cell = vt_find_cell(&t.o.levels[level], branching, x, y, z);
        assert_int_equal(t.chords[k].cell, cell);
        assert_close(t.chords[k].length, sqrt(3), 1e-6);
      }
    }
    end_walks(context, &t);
  }
  vt_destroy_context(context);
}

// An eye within a cell sees the rest of that cell, not all of it and not none.
static void eyes_inside_cells_see_the_rest_of_them(void **state) {
  (void)state;
  vt_context *context = make_context();
  walk_test t = begin_walks(context, 2, 4, SIZE_MAX, 1);
  vt_ray ray = {vt_v3(5.25 / 16, 7.5 / 16, 3.5 / 16), vt_v3(1, 0, 0)};
  uint32_t count;
  walk_on_all_paths(&t, &ray, 1, &count);
  assert_int_equal(count, 11);
  assert_int_equal(t.chords[0].cell, vt_find_cell(&t.o.levels[4], 2, 5, 7, 3));
  assert_true(t.chords[0].length == 0.75f);
  ray.direction = vt_v3(-1, 0, 0);
  walk_on_all_paths(&t, &ray, 1, &count);
  assert_int_equal(count, 6);
  assert_true(t.chords[0].length == 0.25f && t.chords[5].length == 1);
  end_walks(context, &t);
  vt_destroy_context(context);
}

// One NaN in a lane must not hang the others (no comparison with it is ever true), nor change a bit of theirs.
static void rays_that_are_no_numbers_or_miss_meet_nothing(void **state) {
  (void)state;
  vt_context *context = make_context();
  walk_test t = begin_walks(context, 2, 4, SIZE_MAX, 1);
  double bad[] = {NAN, INFINITY, -INFINITY, 1e300};
  for (int k = 0; k < 4; k++)
    for (int part = 0; part < 6; part++) {
      double v[6] = {-1, 0.5, 0.5, 1, 0, 0};
      v[part] = bad[k];
      if (k == 3 && part == 3) continue; // along x, only faster
      vt_ray rays[2] = {{vt_v3(v[0], v[1], v[2]), vt_v3(v[3], v[4], v[5])}, {vt_v3(-1, 0.5, 0.5), vt_v3(1, 0, 0)}};
      uint32_t count[2];
      walk_on_all_paths(&t, rays, 2, count);
      assert_true(count[0] == 0 || k == 3);
      assert_int_equal(count[1], 16); // whatever its neighbour is
    }
  vt_ray misses[3] = {{vt_v3(2, 2, 2), vt_normalise(vt_v3(1, 1, 1))}, {vt_v3(-1, 1.5, 0.5), vt_v3(1, 0, 0)}, {vt_v3(0.5, 0.5, 0.5), vt_v3(0, 0, 0)}};
  uint32_t count[3];
  walk_on_all_paths(&t, misses, 3, count);
  for (int i = 0; i < 3; i++) assert_int_equal(count[i], 0);
  end_walks(context, &t);
  walk_test none = begin_walks(context, 2, 4, 0, 1);
  vt_ray ray = {vt_v3(-1, 0.5, 0.5), vt_v3(1, 0, 0)};
  walk_on_all_paths(&none, &ray, 1, count);
  assert_int_equal(count[0], 0);
  end_walks(context, &none);
  vt_destroy_context(context);
}

static void neighbours_are_the_cells_at_the_next_coordinates(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int branching = 2; branching <= 3; branching++)
    for (int level = 0; level <= (branching == 2 ? 10 : 6); level += 2) {
      vt_octree o;
      make_octree(context, branching, level, 4000, 5, &o);
      const vt_level *cells = &o.levels[level];
      for (uint32_t i = 0; i < cells->cell_count; i++) {
        uint32_t face[6], all[27];
        vt_face_neighbours(cells, branching, i, face);
        vt_all_neighbours(cells, branching, i, all);
        assert_int_equal(all[13], i);
        for (int k = 0; k < 27; k++)
          assert_int_equal(all[k], vt_find_cell(cells, branching, cells->x[i] + k % 3 - 1, cells->y[i] + k / 3 % 3 - 1,
                                                cells->z[i] + k / 9 - 1));
        const int around[6] = {12, 14, 10, 16, 4, 22};
        for (int k = 0; k < 6; k++) assert_int_equal(face[k], all[around[k]]);
      }
      vt_free_octree(context, &o);
    }
  vt_destroy_context(context);
}

// Every cell below exactly one of the coarse cells that hold any, none below another: ranges tile the finer level.
static void cells_below_a_cell_are_one_range(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int branching = 2; branching <= 3; branching++)
    for (int up = 0; up <= 4; up += 2) {
      int fine = branching == 2 ? 10 : 6, coarse = fine - up, ratio = power(branching, up);
      vt_octree o;
      make_octree(context, branching, fine, 3000, 8, &o);
      const vt_level *below = &o.levels[fine];
      uint16_t(*xyz)[3] = vt_alloc(context, below->cell_count, sizeof *xyz);
      size_t count = 0;
      for (uint32_t i = 0; i < below->cell_count; i++) {
        xyz[count][0] = (uint16_t)(below->x[i] / ratio), xyz[count][1] = (uint16_t)(below->y[i] / ratio);
        xyz[count][2] = (uint16_t)(below->z[i] / ratio);
        if (count == 0 || memcmp(xyz[count], xyz[count - 1], sizeof *xyz)) count++; // Morton order: equal ones are neighbours
      }
      vt_level *above = &o.levels[coarse];
      if (up) assert_int_equal(vt_make_level(context, branching, coarse, count, (const uint16_t(*)[3])xyz, above), VT_OK);
      uint32_t next = 0;
      for (uint32_t i = 0; i < o.levels[coarse].cell_count; i++) {
        vt_cell_range range = vt_cells_below(&o, coarse, i, fine);
        assert_int_equal(range.begin, next);
        assert_true(range.end > range.begin);
        for (uint32_t k = range.begin; k < range.end; k++)
          assert_true(below->x[k] / ratio == o.levels[coarse].x[i] && below->y[k] / ratio == o.levels[coarse].y[i] &&
                      below->z[k] / ratio == o.levels[coarse].z[i]);
        next = range.end;
      }
      assert_int_equal(next, below->cell_count);
      vt_free(context, xyz);
      vt_free_octree(context, &o);
    }
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(every_met_cell_is_found_once_at_every_level),
      cmocka_unit_test(the_finest_levels_cost_what_their_cells_cost),
      cmocka_unit_test(chords_of_millions_of_rays_sum_to_the_clipped_length),
      cmocka_unit_test(packets_that_are_not_full_write_only_to_their_rays),
      cmocka_unit_test(rays_along_faces_belong_to_the_cell_above),
      cmocka_unit_test(diagonals_meet_the_cells_of_the_diagonal_alone),
      cmocka_unit_test(eyes_inside_cells_see_the_rest_of_them),
      cmocka_unit_test(rays_that_are_no_numbers_or_miss_meet_nothing),
      cmocka_unit_test(neighbours_are_the_cells_at_the_next_coordinates),
      cmocka_unit_test(cells_below_a_cell_are_one_range),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
