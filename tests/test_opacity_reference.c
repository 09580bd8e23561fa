// test_opacity_reference.c - the solvers of opacity against Ceres on the same small problems, and gradients by differences
// SPDX-License-Identifier: BSD-3-Clause
//
// 8^3 cells, 8 photographs of 20 x 20 pixels, no hull, every ray a residual: small enough that Levenberg-Marquardt finds the
// least of the very function that vt_opacity_objective says our solvers lower. Ceres projects its steps and stalls about a
// percent above the least when many bounds are active at once, so it is asked in rounds: all cells free within their bounds,
// then with those at zero held there, until a round gains nothing.
#include "base/least_squares.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/opacity.h"
#include "reconstruct/solid_angle.h"
#include "reconstruct/total_variation.h"
#include "tests/unit.h"

enum { LEVEL = 3, AXIS = 8, CELLS = AXIS * AXIS * AXIS, VIEWS = 8, PIXELS = 20, MOST_RAYS = VIEWS * PIXELS * PIXELS, MOST_CHORDS = 32 };

typedef struct small_ray {
  int count, cells[MOST_CHORDS];
  double lengths[MOST_CHORDS], t, root_weight;
} small_ray;

typedef struct small {
  vt_context *context;
  vt_views views;
  vt_reduced_views reduced;
  vt_octree octree;
  vt_rays rays;
  float weights[VIEWS];
  vt_variation variation;
  int ray_count;
  small_ray *list;
} small;

static void list_ray(void *user, const vt_swept_ray *ray) {
  small *s = user; // one thread: lanes come one after another
  small_ray *r = &s->list[s->ray_count++];
  assert_true(ray->chord_count <= MOST_CHORDS);
  *r = (small_ray){.count = (int)ray->chord_count, .t = 1 - ray->pixel[3] / 255.0, .root_weight = sqrt(s->weights[ray->view])};
  for (int k = 0; k < r->count; k++) r->cells[k] = (int)ray->chords[k].cell, r->lengths[k] = ray->chords[k].length;
}

static void begin(small *s, const vt_opacity_desc *desc) {
  vt_context_desc quiet = vt_default_context_desc();
  quiet.log_level = VT_LOG_QUIET, quiet.thread_count = 1;
  *s = (small){.context = vt_create_context(&quiet)};
  vt_synthetic_desc scene = vt_default_synthetic_desc();
  scene.kind = VT_SYNTHETIC_BLOBS, scene.train_count = VIEWS, scene.test_count = 0;
  scene.width = scene.height = PIXELS, scene.supersample = 2, scene.peak_extinction = 4;
  assert_int_equal(vt_make_synthetic_views(s->context, &scene, &s->views), VT_OK);
  assert_int_equal(vt_reduce_views(s->context, &s->views, 1, &s->reduced), VT_OK);
  s->octree = (vt_octree){.origin = {-1.1, -1.1, -1.1}, .edge = 2.2, .branching = 2, .level_count = LEVEL + 1};
  uint16_t xyz[CELLS][3];
  for (int i = 0; i < CELLS; i++)
    xyz[i][0] = (uint16_t)(i % AXIS), xyz[i][1] = (uint16_t)(i / AXIS % AXIS), xyz[i][2] = (uint16_t)(i / AXIS / AXIS);
  vt_level *cells = &s->octree.levels[LEVEL];
  assert_int_equal(vt_make_level(s->context, 2, LEVEL, CELLS, xyz, cells), VT_OK);
  for (int i = 0; i < CELLS; i++) cells->optical_depth[i] = 0.1f + 0.001f * (float)(i * 37 % 101);
  assert_int_equal(vt_collect_rays(s->context, &s->octree, LEVEL, LEVEL, &s->reduced, 1 << 28, &s->rays), VT_OK);
  vt_weigh_views(&s->octree, &s->reduced, desc->weigh_views, s->weights);
  assert_int_equal(vt_begin_variation(s->context, cells, 2, desc->total_variation, desc->variation_width, &s->variation), VT_OK);
  s->list = VT_NEW(s->context, small_ray, MOST_RAYS);
  assert_non_null(s->list);
  assert_int_equal(vt_sweep_rays(s->context, &s->rays, NULL, 0, list_ray, s), VT_OK);
  assert_true(s->ray_count > 1000);
}

static void end(small *s) {
  vt_free(s->context, s->list);
  vt_end_variation(s->context, &s->variation);
  vt_free_rays(s->context, &s->rays);
  vt_free_octree(s->context, &s->octree);
  vt_free_reduced_views(s->context, &s->reduced);
  vt_free_views(s->context, &s->views);
  vt_destroy_context(s->context);
}

// No TV, nothing held out, `iterations` sweeps and no more.
static vt_opacity_desc desc_of(vt_opacity_step step, int iterations, float variation) {
  vt_opacity_desc desc = vt_default_opacity_desc();
  desc.step = step, desc.iterations = iterations, desc.total_variation = variation;
  desc.held_out_share = 0;
  return desc;
}

static double objective(small *s, const vt_opacity_desc *desc) {
  double f;
  assert_int_equal(vt_opacity_objective(s->context, desc, &s->rays, &s->octree.levels[LEVEL], &f), VT_OK);
  return f;
}

// ---- the reference

static bool ray_residual(void *user, const double *const *p, double *residuals, double **jacobians) {
  const small_ray *r = user;
  double tau = 0;
  for (int k = 0; k < r->count; k++) tau += r->lengths[k] * *p[k];
  residuals[0] = r->root_weight * (exp(-tau) - r->t);
  for (int k = 0; k < r->count && jacobians; k++)
    if (jacobians[k]) jacobians[k][0] = -r->root_weight * exp(-tau) * r->lengths[k];
  return true;
}

typedef struct face { double weight, width; } face;

// The root of twice a face's term, with the sign of the difference: smooth through zero.
static bool face_residual(void *user, const double *const *p, double *residuals, double **jacobians) {
  const face *f = user;
  double d = *p[0] - *p[1];
  double root = sqrt(d * d + f->width * f->width), r = sqrt(2 * f->weight * d * d / (root + f->width));
  residuals[0] = d < 0 ? -r : r;
  double slope = fabs(d) > 1e-9 ? f->weight * fabs(d) / root / r : sqrt(f->weight / f->width);
  if (jacobians && jacobians[0]) jacobians[0][0] = slope;
  if (jacobians && jacobians[1]) jacobians[1][0] = -slope;
  return true;
}

typedef struct reference {
  double values[CELLS];
  vt_parameter_group groups[CELLS];
  vt_residual_block blocks[MOST_RAYS + 3 * CELLS];
  int pairs[3 * CELLS][2], block_count;
  face face;
} reference;

static void state_problem(small *s, const vt_opacity_desc *desc, const double *least, const double *most, reference *r) {
  int faces = 0;
  r->face = (face){desc->total_variation, desc->variation_width};
  for (int i = 0; i < CELLS; i++) {
    r->values[i] = 0.25;
    r->groups[i] = (vt_parameter_group){.values = &r->values[i], .size = 1, .least = least, .most = most};
  }
  for (int i = 0; i < s->ray_count; i++)
    r->blocks[r->block_count++] = (vt_residual_block){ray_residual, &s->list[i], 1, s->list[i].count, s->list[i].cells};
  for (int i = 0; i < CELLS && r->face.weight > 0; i++)
    for (int k = 1; k < 6; k += 2) {
      if (s->variation.neighbours[i][k] == VT_NO_CELL) continue;
      r->pairs[faces][0] = i, r->pairs[faces][1] = (int)s->variation.neighbours[i][k];
      r->blocks[r->block_count++] = (vt_residual_block){face_residual, &r->face, 1, 2, r->pairs[faces++]};
    }
}

// The least cost; the depths of the level become those of the last round.
static double solve_by_ceres(small *s, const vt_opacity_desc *opacity) {
  const double least = 0, most = opacity->largest;
  reference *r = VT_NEW(s->context, reference, 1);
  assert_non_null(r);
  state_problem(s, opacity, &least, &most, r);
  vt_least_squares_desc desc = vt_default_least_squares_desc();
  double cost = INFINITY, before;
  int rounds = 0;
  do {
    before = cost;
    for (int held = 0; held < 2; held++) {
      vt_least_squares_report report;
      for (int i = 0; i < CELLS; i++) r->groups[i].constant = held && r->values[i] < 1e-9;
      assert_int_equal(vt_solve_least_squares(s->context, &desc, "opacity", CELLS, r->groups, r->block_count, r->blocks, &report),
                       VT_OK);
      cost = report.final_cost; // of residuals that no free cell touches, too
    }
  } while (cost < before * (1 - 1e-6) && ++rounds < 12);
  printf("Ceres: %.8f after %d rounds\n", cost, rounds);
  for (int i = 0; i < CELLS; i++) s->octree.levels[LEVEL].optical_depth[i] = (float)r->values[i];
  vt_free(s->context, r);
  return cost;
}

static void fill(small *s, float depth) {
  for (int i = 0; i < CELLS; i++) s->octree.levels[LEVEL].optical_depth[i] = depth;
}

static double end_of(small *s, vt_opacity_step step, int iterations, float variation) {
  vt_opacity_desc desc = desc_of(step, iterations, variation);
  fill(s, 0.25f);
  assert_int_equal(vt_estimate_opacity(s->context, &desc, &s->rays, &s->octree.levels[LEVEL], NULL), VT_OK);
  return objective(s, &desc);
}

static void check_solvers(float variation, double adam_default, double adam_long) {
  if (!vt_can_solve_least_squares()) skip();
  vt_opacity_desc desc = desc_of(VT_STEP_NESTEROV, 1, variation);
  small s;
  begin(&s, &desc);
  double least = solve_by_ceres(&s, &desc);
  assert_close(objective(&s, &desc) / least, 1, 1e-5); // one and the same function
  double nesterov = end_of(&s, VT_STEP_NESTEROV, 4000, variation), adam = end_of(&s, VT_STEP_ADAM, 4, variation);
  double longer = end_of(&s, VT_STEP_ADAM, 1500, variation);
  printf("variation %g, above Ceres' least: Nesterov %+.2e, Adam of 4 sweeps %+.2e, of 1500 %+.2e\n", variation,
         nesterov / least - 1, adam / least - 1, longer / least - 1);
  assert_true(nesterov / least - 1 < 1e-4 && nesterov / least - 1 > -1e-4);
  assert_true(adam / least - 1 < adam_default && longer / least - 1 < adam_long);
  end(&s);
}

static void solvers_end_where_ceres_does_without_variation(void **state) {
  (void)state;
  check_solvers(0, 0.25, 1e-3);
}

static void solvers_end_where_ceres_does_with_variation(void **state) {
  (void)state;
  check_solvers(0.05f, 0.25, 1e-3);
}

// ---- gradients

static double difference_along(small *s, const vt_opacity_desc *desc, int cell) {
  float *depth = &s->octree.levels[LEVEL].optical_depth[cell], old = *depth, above = old + 0.01f, below = old - 0.01f;
  *depth = above;
  double f = objective(s, desc);
  *depth = below;
  f -= objective(s, desc);
  *depth = old;
  return f / ((double)above - (double)below);
}

// One step of Nesterov without variation is minus the gradient over sum w l L (T^2 + 0.001).
static void step_of_nesterov_is_the_gradient_of_the_objective(void **state) {
  (void)state;
  vt_opacity_desc desc = desc_of(VT_STEP_NESTEROV, 1, 0);
  desc.least_updates = 0;
  small s;
  begin(&s, &desc);
  vt_level *cells = &s.octree.levels[LEVEL];
  double diagonal[CELLS] = {0}, difference[CELLS], largest = 0;
  float start[CELLS];
  memcpy(start, cells->optical_depth, sizeof start);
  for (int i = 0; i < s.ray_count; i++) {
    const small_ray *r = &s.list[i];
    double tau = 0, length = 0;
    for (int k = 0; k < r->count; k++) tau += r->lengths[k] * start[r->cells[k]], length += r->lengths[k];
    double h = exp(-2 * tau) + 0.001;
    for (int k = 0; k < r->count; k++) diagonal[r->cells[k]] += r->root_weight * r->root_weight * r->lengths[k] * length * h;
  }
  for (int i = 0; i < CELLS; i++) difference[i] = difference_along(&s, &desc, i), largest = fmax(largest, fabs(difference[i]));
  assert_int_equal(vt_estimate_opacity(s.context, &desc, &s.rays, cells, NULL), VT_OK);
  for (int i = 0; i < CELLS; i++)
    if (cells->optical_depth[i] > 0 && diagonal[i] > 1e-3)
      assert_close(-diagonal[i] * (cells->optical_depth[i] - (double)start[i]), difference[i], 2e-3 * largest);
  assert_true(largest > 0.1);
  end(&s);
}

static void pull_of_variation_is_its_gradient(void **state) {
  (void)state;
  vt_opacity_desc desc = desc_of(VT_STEP_NESTEROV, 1, 0.05f);
  small s;
  begin(&s, &desc);
  float *depth = s.octree.levels[LEVEL].optical_depth, total[2 * CELLS] = {0};
  assert_int_equal(vt_pull_by_variation(s.context, &s.variation, depth, 1, 2, total), VT_OK);
  double largest = 0;
  for (int i = 0; i < CELLS; i++) {
    float old = depth[i], above = old + 0.001f, below = old - 0.001f;
    depth[i] = above;
    double f = vt_variation_of(&s.variation, depth);
    depth[i] = below;
    f -= vt_variation_of(&s.variation, depth);
    depth[i] = old;
    double slope = f / ((double)above - (double)below);
    largest = fmax(largest, fabs(slope));
    assert_close(-total[2 * i], slope, 1e-3);
    assert_true(total[2 * i + 1] > 0);
  }
  assert_true(largest > 0.05);
  end(&s);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(solvers_end_where_ceres_does_without_variation),
                                     cmocka_unit_test(solvers_end_where_ceres_does_with_variation),
                                     cmocka_unit_test(step_of_nesterov_is_the_gradient_of_the_objective),
                                     cmocka_unit_test(pull_of_variation_is_its_gradient)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
