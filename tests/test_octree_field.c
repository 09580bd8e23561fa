// test_octree_field.c - corners, the field along a ray, views' textures, and pictures of them
// SPDX-License-Identifier: BSD-3-Clause

#include "octree/field.h"
#include "tests/field_scenes.h"

#define ROOM 4096

typedef struct sample_room {
  float along[ROOM], inside[ROOM][4], value[ROOM][4], log_ratio[ROOM];
} sample_room;

static vt_field_samples samples_in(sample_room *room) {
  return (vt_field_samples){room->along, room->inside, room->value, room->log_ratio};
}

// Chords of one ray.
static size_t chords_of(const vt_octree *octree, int level, const vt_ray *ray, vt_chord *out, size_t capacity) {
  uint32_t count;
  vt_walk_rays(octree, level, vt_best_walk_path(), ray, 1, out, capacity, &count);
  return count;
}

static void both_instances_give_the_same_bits(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_rng rng = vt_seed_rng(3, 1);
  sample_room *a = VT_NEW(context, sample_room, 1), *b = VT_NEW(context, sample_room, 1);
  size_t met = 0;
  for (int round = 0; round < 6; round++) {
    vt_tree tree = scene_random_field(context, 5, 0.3, 5, (uint64_t)round, round % 3 != 1, true);
    const vt_level *cells = &tree.octree.levels[5];
    if (round > 2) scene_cut_textures(&tree, 5, &rng);
    if (round == 4) scene_make_linear(&tree, 5);
    size_t capacity = vt_max_segments(cells);
    vt_chord *chords = VT_NEW(context, vt_chord, capacity);
    for (int i = 0; i < 600; i++) {
      vt_ray ray = scene_random_ray(&rng);
      size_t count = chords_of(&tree.octree, 5, &ray, chords, capacity);
      vt_field_ray entered = vt_enter_root(&tree.octree, 5, &ray);
      vt_field_view views[5];
      vt_field_sight sights[5];
      for (int v = 0; v < 5; v++)
        views[v] = vt_aim_field_view(&tree.octree, 5, &tree.cameras[v], tree.view_textures[5].factor,
                                     &tree.view_textures[5].views[v], 0.1f + 0.2f * v);
      int sight_count = vt_aim_sights(&entered, views, i % 6, sights);
      vt_field_samples to_a = samples_in(a), to_b = samples_in(b);
      memset(a, 0xff, sizeof *a);
      memset(b, 0xff, sizeof *b);
      vt_sample_field_plain(cells, &entered, chords, count, &to_a);
      vt_sample_ratios_plain(sights, sight_count, a->along, count, a->log_ratio);
      vt_sample_field_avx2(cells, &entered, chords, count, &to_b);
      vt_sample_ratios_avx2(sights, sight_count, b->along, count, b->log_ratio);
      assert_memory_equal(a, b, sizeof *a); // and nothing is written behind the chords
      met += count;
    }
    vt_free(context, chords);
    vt_free_tree(context, &tree);
  }
  assert_true(met > 3000);
  vt_free(context, a);
  vt_free(context, b);
  vt_destroy_context(context);
}

// ---- corners

// A random level of any branching.
static vt_octree random_octree(vt_context *context, int branching, int level, double share, uint64_t seed) {
  int n = 1;
  for (int l = 0; l < level; l++) n *= branching;
  vt_octree octree = {.origin = {-1, -1, -1}, .edge = 2, .branching = branching, .level_count = level + 1};
  vt_rng rng = vt_seed_rng(seed, 1);
  uint16_t(*xyz)[3] = vt_alloc(context, (size_t)(n * n * n), sizeof *xyz);
  size_t count = 0;
  for (int i = 0; i < n * n * n; i++)
    if (vt_random_unit(&rng) < share)
      xyz[count][0] = (uint16_t)(i % n), xyz[count][1] = (uint16_t)(i / n % n), xyz[count++][2] = (uint16_t)(i / n / n);
  assert_int_equal(vt_make_level(context, branching, level, count, (const uint16_t(*)[3])xyz, &octree.levels[level]), VT_OK);
  assert_int_equal(vt_make_corners(context, branching, &octree.levels[level]), VT_OK);
  vt_free(context, xyz);
  return octree;
}

// Number of a corner's place among (axis_cells + 1)^3.
static size_t place_of_corner(const vt_level *cells, size_t cell, int corner) {
  size_t n = (size_t)cells->axis_cells + 1;
  size_t x = cells->x[cell] + (size_t)(corner & 1), y = cells->y[cell] + (size_t)(corner >> 1 & 1);
  return x + n * (y + n * (cells->z[cell] + (size_t)(corner >> 2)));
}

static void every_corner_has_one_number_and_every_number_one_corner(void **state) {
  (void)state;
  const struct { int branching, level; double share; } cases[] = {
      {2, 0, 1}, {2, 1, 0.5}, {2, 3, 1}, {2, 4, 0.1}, {2, 5, 0.4}, {3, 1, 0.6}, {3, 2, 1}, {3, 3, 0.3}, {2, 3, 0}};
  vt_context *context = scene_context(2);
  for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
    vt_octree octree = random_octree(context, cases[c].branching, cases[c].level, cases[c].share, c);
    const vt_level *cells = &octree.levels[cases[c].level];
    size_t n = (size_t)cells->axis_cells + 1;
    uint32_t *number = VT_NEW(context, uint32_t, n * n * n), next = 0; // 0: not met yet
    for (size_t i = 0; i < cells->cell_count; i++)
      for (int k = 0; k < 8; k++) {
        uint32_t *here = &number[place_of_corner(cells, i, k)];
        if (!*here) *here = ++next; // in the order in which the cells meet them
        assert_int_equal(cells->corner_of[8 * i + (size_t)k], *here - 1);
      }
    assert_int_equal(cells->corner_count, next);
    vt_free(context, number);
    vt_free_octree(context, &octree);
  }
  vt_destroy_context(context);
}

static void corners_take_the_mean_of_their_cells_and_cells_of_their_corners(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_octree octree = random_octree(context, 3, 2, 0.5, 9);
  vt_level *cells = &octree.levels[2];
  vt_rng rng = vt_seed_rng(10, 1);
  for (size_t i = 0; i < cells->cell_count; i++) {
    cells->optical_depth[i] = (float)vt_random_unit(&rng);
    for (size_t c = 0; c < 3; c++) cells->colour[3 * i + c] = (float)vt_random_unit(&rng);
  }
  assert_int_equal(vt_corners_from_cells(context, cells), VT_OK);
  for (size_t i = 0; i < cells->cell_count; i++)
    for (int k = 0; k < 8; k++) {
      double sum[4] = {0}, met = 0;
      for (size_t j = 0; j < cells->cell_count; j++)
        for (int other = 0; other < 8; other++) {
          if (place_of_corner(cells, j, other) != place_of_corner(cells, i, k)) continue;
          met++;
          sum[0] += cells->optical_depth[j];
          for (size_t c = 0; c < 3; c++) sum[c + 1] += cells->colour[3 * j + c];
        }
      const float *v = cells->corner_values + 4 * (size_t)cells->corner_of[8 * i + (size_t)k];
      for (int c = 0; c < 4; c++) assert_close(v[c], sum[c] / met, 1e-6);
    }
  vt_cells_from_corners(cells);
  double sum = 0;
  for (int k = 0; k < 8; k++) sum += cells->corner_values[4 * (size_t)cells->corner_of[8 * 5 + k]];
  assert_close(cells->optical_depth[5], sum / 8, 1e-6);
  vt_free_octree(context, &octree);
  vt_destroy_context(context);
}

// ---- the field along a ray

// In cell edges from the root's lowest corner, relative to where the ray enters the root: where the middle of its chord in a
// cell is. False where the cell's slab and the walk do not agree on the chord's length, as along faces.
static bool middle_by_slabs(const vt_octree *octree, int level, const vt_ray *ray, const vt_chord *chord, double middle[3],
                            double *along) {
  const vt_level *cells = &octree->levels[level];
  double e = vt_cell_edge(octree, level), root_enter, root_leave, enter, leave;
  vt_vec3 low = vt_add(octree->origin,
                       vt_scale(vt_v3(cells->x[chord->cell], cells->y[chord->cell], cells->z[chord->cell]), e));
  if (!scene_slab(ray, octree->origin, octree->edge, &root_enter, &root_leave)) return false;
  if (!scene_slab(ray, low, e, &enter, &leave) || fabs((leave - enter) / e - chord->length) > 1e-5) return false;
  vt_vec3 p = vt_add(ray->origin, vt_scale(ray->direction, 0.5 * (enter + leave)));
  p = vt_scale(vt_sub(p, octree->origin), 1 / e);
  middle[0] = p.x, middle[1] = p.y, middle[2] = p.z;
  *along = (0.5 * (enter + leave) - root_enter) / e;
  return true;
}

static double linear(const double p[3], int channel) { // about 1 in the root of any level
  static const double slopes[4][3] = {{0.3, -0.2, 0.5}, {0, 0.7, 0}, {-0.4, 0.1, 0.2}, {0.25, 0.25, 0.25}};
  return 1 + slopes[channel][0] * p[0] + slopes[channel][1] * p[1] + slopes[channel][2] * p[2];
}

static void fill_linear(vt_level *cells) {
  for (size_t i = 0; i < cells->cell_count; i++)
    for (int k = 0; k < 8; k++) {
      double n = cells->axis_cells;
      double p[3] = {(cells->x[i] + (k & 1)) / n, (cells->y[i] + (k >> 1 & 1)) / n, (cells->z[i] + (k >> 2)) / n};
      float *v = cells->corner_values + 4 * (size_t)cells->corner_of[8 * i + (size_t)k];
      for (int c = 0; c < 4; c++) v[c] = (float)linear(p, c);
    }
}

static void linear_functions_are_met_exactly_in_the_middles_of_chords(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  sample_room *room = VT_NEW(context, sample_room, 1);
  vt_field_samples samples = samples_in(room);
  vt_rng rng = vt_seed_rng(12, 1);
  size_t checked = 0, met = 0;
  for (int which = 0; which < 3; which++) {
    int level = which == 2 ? 4 : which ? 7 : 4, branching = which == 2 ? 3 : 2;
    vt_octree octree = random_octree(context, branching, level, which == 1 ? 0.02 : 0.4, 11);
    vt_level *cells = &octree.levels[level];
    fill_linear(cells);
    vt_chord *chords = VT_NEW(context, vt_chord, vt_max_segments(cells));
    for (int i = 0; i < 3000; i++) {
      vt_ray ray = scene_random_ray(&rng);
      size_t count = chords_of(&octree, level, &ray, chords, vt_max_segments(cells));
      vt_sample_field(&octree, level, &ray, chords, count, &samples);
      for (size_t k = 0; k < count; k++) {
        double middle[3], along, at[3] = {cells->x[chords[k].cell], cells->y[chords[k].cell], cells->z[chords[k].cell]};
        met++;
        for (int a = 0; a < 3; a++) assert_true(room->inside[k][a] >= 0 && room->inside[k][a] <= 1);
        if (!middle_by_slabs(&octree, level, &ray, &chords[k], middle, &along)) continue;
        checked++;
        assert_close(room->along[k], along, 1e-5 + 2e-7 * along);
        for (int a = 0; a < 3; a++) {
          assert_close(at[a] + room->inside[k][a], middle[a], 1e-5);
          middle[a] /= cells->axis_cells;
        }
        for (int c = 0; c < 4; c++) assert_close(room->value[k][c], linear(middle, c), 1e-5);
      }
    }
    vt_free(context, chords);
    vt_free_octree(context, &octree);
  }
  assert_true(checked > 10000 && checked > met - met / 50);
  vt_free(context, room);
  vt_destroy_context(context);
}

// ---- the views' textures

// ln R at a point of the world, in doubles, pixel by pixel.
static double ratio_at(const vt_tree *tree, int level, vt_vec3 point, const float *weight, double *border) {
  const vt_view_textures *textures = &tree->view_textures[level];
  double sum = 0, weights = 0;
  for (int v = 0; v < tree->view_count; v++) {
    const vt_view_texture *t = &textures->views[v];
    vt_vec3 p = vt_to_camera(&tree->cameras[v], point);
    double x = (tree->cameras[v].fx * p.x / p.z + tree->cameras[v].cx) / textures->factor;
    double y = (tree->cameras[v].fy * p.y / p.z + tree->cameras[v].cy) / textures->factor;
    if (t->columns < 1 || t->rows < 1) continue;
    double edges[] = {x, y, x - t->width, y - t->height, 100 * p.z};
    for (int i = 0; i < 5; i++) *border = fmin(*border, fabs(edges[i]));
    if (!(p.z > 0 && x >= 0 && y >= 0 && x <= t->width && y <= t->height)) continue;
    double u = fmin(fmax(x - 0.5 - t->left, 0), t->columns - 1), w = fmin(fmax(y - 0.5 - t->top, 0), t->rows - 1);
    double code = 0, ratio = 0;
    for (int row = 0; row < t->rows; row++)
      for (int column = 0; column < t->columns; column++) {
        double share = fmax(0, 1 - fabs(u - column)) * fmax(0, 1 - fabs(w - row)), c = t->codes[row * t->columns + column];
        code += share * c, ratio += share * exp(0.030682533 * c);
      }
    if (t->linear) code = log(ratio) / 0.030682533;
    sum += weight[v] * code;
    weights += weight[v];
  }
  return weights > 0 ? -3.912023 + 0.030682533 * sum / weights : 0;
}

static void ratios_are_those_of_the_photographs_that_see_the_point(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  sample_room *room = VT_NEW(context, sample_room, 1);
  vt_field_samples samples = samples_in(room);
  vt_rng rng = vt_seed_rng(14, 1);
  size_t checked = 0, unseen = 0;
  for (int round = 0; round < 4; round++) { // the last: R is interpolated
    vt_tree tree = scene_random_field(context, 4, 0.2, 4, 15 + (uint64_t)round, true, false);
    for (int v = 0; v < 4; v++) tree.cameras[v].width = tree.cameras[v].height = 60, tree.cameras[v].cx = tree.cameras[v].cy = 30;
    if (round) tree.cameras[1] = scene_camera(0.1, -0.2, 0.3, 60); // within the crown: half of it is behind
    if (round == 2) tree.cameras[2] = scene_camera(0.4, 0.5, 0.3, 60), tree.cameras[0] = tree.cameras[3] = tree.cameras[1];
    scene_add_textures(context, &tree, 4, 3, 16);
    if (round) scene_cut_textures(&tree, 4, &rng);
    if (round == 3) scene_make_linear(&tree, 4);
    float weight[4] = {0.1f, 0.4f, 0.3f, 0.2f};
    vt_field_view views[4];
    for (int v = 0; v < 4; v++)
      views[v] = vt_aim_field_view(&tree.octree, 4, &tree.cameras[v], 3, &tree.view_textures[4].views[v], weight[v]);
    vt_chord chords[256];
    for (int i = 0; i < 1500; i++) {
      vt_ray ray = scene_random_ray(&rng);
      size_t count = chords_of(&tree.octree, 4, &ray, chords, 256);
      double enter = 0, leave;
      if (count) scene_slab(&ray, tree.octree.origin, tree.octree.edge, &enter, &leave);
      vt_sample_field(&tree.octree, 4, &ray, chords, count, &samples);
      vt_sample_ratios(&tree.octree, 4, &ray, views, 4, count, &samples);
      for (size_t k = 0; k < count; k++) {
        double border = 1, t = enter + room->along[k] * vt_cell_edge(&tree.octree, 4);
        double expected = ratio_at(&tree, 4, vt_add(ray.origin, vt_scale(ray.direction, t)), weight, &border);
        if (border < 0.01) continue; // seen or not, a digit decides
        assert_close(room->log_ratio[k], expected, 2e-3); // a pixel's slope is up to 120 codes: 3.7
        checked++;
        unseen += expected == 0;
      }
    }
    vt_free_tree(context, &tree);
  }
  assert_true(checked > 3000 && unseen > 300);
  vt_free(context, room);
  vt_destroy_context(context);
}

// ---- pictures

static vt_fimage picture_of(vt_context *context, const vt_tree *tree, int level, bool flat, const vt_camera *camera) {
  vt_view_weights weights = {.count = 3, .view = {0, 2, 1}, .weight = {0.5f, 0.3f, 0.2f}};
  vt_fimage image;
  assert_int_equal(vt_composite(context, tree, level, flat ? NULL : &weights, VT_BLEND_GEOMETRIC, flat, camera, &image), VT_OK);
  return image;
}

static const vt_vec3 eyes[] = {{2.6, 1.1, 1.9}, {0, 3, 0}, {0.31, -0.22, 0.13}, {0, 0, 0}, {-30, 20, 10}};
#define EYES (int)(sizeof eyes / sizeof eyes[0])

static vt_camera camera_at(int eye) {
  return vt_look_at(eyes[eye], vt_v3(0.02, 0.03, 0.01), vt_v3(0, 0.1, 1), eye == 4 ? 0.07 : 0.8, 97, 75);
}

static void constant_fields_look_like_constant_cells(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  vt_tree tree = scene_random_field(context, 4, 0.4, 3, 18, true, false);
  vt_level *cells = &tree.octree.levels[4];
  const float constant[4] = {0.7f, 0.2f, 0.9f, 0.4f};
  for (size_t i = 0; i < 4 * (size_t)cells->corner_count; i++) cells->corner_values[i] = constant[i % 4];
  vt_cells_from_corners(cells);
  uint32_t corner_count = cells->corner_count;
  for (int e = 0; e < EYES; e++) {
    vt_camera camera = camera_at(e);
    cells->corner_count = corner_count;
    vt_fimage field = picture_of(context, &tree, 4, true, &camera);
    cells->corner_count = 0;
    vt_fimage constant_cells = picture_of(context, &tree, 4, true, &camera);
    double largest, sum = 0;
    scene_difference(&field, &constant_cells, &largest);
    assert_true(largest < 1e-4);
    for (int i = 0; i < 97 * 75; i++) sum += field.pixels[4 * i + 3];
    assert_true(sum > 500);
    vt_free_fimage(context, &field);
    vt_free_fimage(context, &constant_cells);
  }
  cells->corner_count = corner_count;
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void pictures_have_the_same_bits_for_any_number_of_threads(void **state) {
  (void)state;
  const int threads[] = {1, 2, 7};
  vt_fimage pictures[3][2];
  for (int i = 0; i < 3; i++) {
    vt_context *context = scene_context(threads[i]);
    vt_tree tree = scene_random_field(context, 5, 0.3, 3, 19, true, true);
    vt_camera camera = camera_at(0);
    for (int flat = 0; flat < 2; flat++) {
      vt_fimage image = picture_of(context, &tree, 5, flat, &camera);
      pictures[i][flat] = image;
      pictures[i][flat].pixels = malloc(sizeof(float) * 4 * 97 * 75);
      memcpy(pictures[i][flat].pixels, image.pixels, sizeof(float) * 4 * 97 * 75);
      assert_memory_equal(pictures[i][flat].pixels, pictures[0][flat].pixels, sizeof(float) * 4 * 97 * 75);
      vt_free_fimage(context, &image);
    }
    vt_free_tree(context, &tree);
    vt_destroy_context(context);
  }
  assert_memory_not_equal(pictures[0][0].pixels, pictures[0][1].pixels, sizeof(float) * 4 * 97 * 75);
  for (int i = 0; i < 6; i++) free(pictures[i / 2][i % 2].pixels);
}

static void unit_and_place_of_the_world_do_not_show(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  const double scales[] = {1e-6, 1e6, 1};
  const vt_vec3 shifts[] = {{0.1, 0.2, -0.1}, {0, 0, 0}, {1e5, -2e5, 1.2e5}}; // about 10^6 cells
  for (int i = 0; i < 3; i++) {
    vt_tree tree = scene_random_field(context, 4, 0.3, 3, 20, true, true);
    vt_tree moved = scene_random_field(context, 4, 0.3, 3, 20, true, true);
    scene_move(&moved, scales[i], shifts[i]);
    for (int e = 0; e < EYES; e++)
      for (int flat = 0; flat < 2; flat++) {
        vt_camera camera = camera_at(e);
        vt_fimage here = picture_of(context, &tree, 4, flat, &camera);
        scene_move_camera(&camera, scales[i], shifts[i]);
        vt_fimage there = picture_of(context, &moved, 4, flat, &camera);
        double largest;
        scene_difference(&here, &there, &largest);
        assert_true(largest < 1e-4);
        vt_free_fimage(context, &here);
        vt_free_fimage(context, &there);
      }
    vt_free_tree(context, &tree);
    vt_free_tree(context, &moved);
  }
  vt_destroy_context(context);
}

// Without corners a level with view textures shows its constant cells, denser or thinner; a code of R = 1 changes nothing.
static void a_ratio_of_one_shows_what_is_shown_flat(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  for (int field = 0; field < 2; field++) {
    vt_tree tree = scene_random_field(context, 4, 0.3, 3, 21, field, true);
    for (int v = 0; v < 3; v++) {
      const vt_view_texture *t = &tree.view_textures[4].views[v];
      for (int i = 0; i < t->columns * t->rows; i++) t->codes[i] = 127 + (i & 1) * (v == 0); // ln R = -0.015 or 0.015
    }
    vt_camera camera = camera_at(0);
    vt_fimage textured = picture_of(context, &tree, 4, false, &camera), flat = picture_of(context, &tree, 4, true, &camera);
    double largest, mean = scene_difference(&textured, &flat, &largest);
    assert_true(largest > 0 && largest < 0.016 && mean < 0.008);
    vt_free_fimage(context, &textured);
    for (int v = 0; v < 3; v++) memset(tree.view_textures[4].views[v].codes, 200, 80 * 80); // R = 9
    textured = picture_of(context, &tree, 4, false, &camera);
    for (int i = 0; i < 97 * 75; i++) assert_true(textured.pixels[4 * i + 3] >= flat.pixels[4 * i + 3] - 1e-4f);
    assert_true(scene_difference(&textured, &flat, NULL) > 0.02);
    vt_free_fimage(context, &textured);
    vt_free_fimage(context, &flat);
    vt_free_tree(context, &tree);
  }
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(both_instances_give_the_same_bits),
      cmocka_unit_test(every_corner_has_one_number_and_every_number_one_corner),
      cmocka_unit_test(corners_take_the_mean_of_their_cells_and_cells_of_their_corners),
      cmocka_unit_test(linear_functions_are_met_exactly_in_the_middles_of_chords),
      cmocka_unit_test(ratios_are_those_of_the_photographs_that_see_the_point),
      cmocka_unit_test(constant_fields_look_like_constant_cells),
      cmocka_unit_test(pictures_have_the_same_bits_for_any_number_of_threads),
      cmocka_unit_test(unit_and_place_of_the_world_do_not_show),
      cmocka_unit_test(a_ratio_of_one_shows_what_is_shown_flat),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
