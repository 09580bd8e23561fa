// test_base_least_squares.c - the bridge to non-linear least squares
// SPDX-License-Identifier: BSD-3-Clause
#include "base/least_squares.h"
#include "base/rng.h"
#include "tests/unit.h"

static vt_context *open_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

// Rosenbrock's valley: (1 - x)^2 + 100 (y - x^2)^2, least at (1, 1).
static bool rosenbrock(void *user, const double *const *parameters, double *residuals, double **jacobians) {
  (void)user;
  double x = parameters[0][0], y = parameters[0][1];
  residuals[0] = 1 - x;
  residuals[1] = 10 * (y - x * x);
  if (jacobians && jacobians[0]) memcpy(jacobians[0], (double[]){-1, 0, -20 * x, 10}, 4 * sizeof(double));
  return true;
}

static vt_status solve_valley(vt_context *context, double xy[2], const double *most, vt_least_squares_report *report) {
  vt_least_squares_desc desc = vt_default_least_squares_desc();
  int group = 0;
  vt_parameter_group groups[] = {{.values = xy, .size = 2, .most = most}};
  vt_residual_block blocks[] = {{rosenbrock, NULL, 2, 1, &group}};
  return vt_solve_least_squares(context, &desc, "valley", 1, groups, 1, blocks, report);
}

static void rosenbrocks_valley_ends_at_its_least_with_and_without_a_bound(void **state) {
  (void)state;
  if (!vt_can_solve_least_squares()) skip();
  vt_context *context = open_context();
  double free_end[2] = {-1.2, 1}, bound_end[2] = {-1.2, 0.2};
  const double most[2] = {0.5, 10};
  vt_least_squares_report report;
  assert_int_equal(solve_valley(context, free_end, NULL, &report), VT_OK);
  assert_true(report.converged && report.iterations > 3 && report.final_cost < 1e-15 && report.initial_cost > 12);
  assert_close(free_end[0], 1, 1e-7);
  assert_close(free_end[1], 1, 1e-7);
  assert_int_equal(solve_valley(context, bound_end, most, &report), VT_OK);
  assert_close(bound_end[0], 0.5, 1e-9); // the bound is active, y follows the valley
  assert_close(bound_end[1], 0.25, 5e-3); // Ceres projects its steps and stalls early beside an active bound, at any tolerance
  assert_true(report.final_cost >= 0.125 - 1e-12 && report.final_cost < 0.1255);
  vt_destroy_context(context);
}

static bool line_residual(void *user, const double *const *parameters, double *residuals, double **jacobians) {
  const double *point = user;
  residuals[0] = parameters[0][0] * point[0] + parameters[1][0] - point[1];
  if (jacobians && jacobians[0]) jacobians[0][0] = point[0];
  if (jacobians && jacobians[1]) jacobians[1][0] = 1;
  return true;
}

static void fit_line(vt_context *context, vt_loss loss, bool constant_offset, double *slope, double *offset) {
  enum { POINTS = 60 };
  static const int both[] = {0, 1};
  double points[POINTS][2];
  vt_rng rng = vt_seed_rng(3, 1);
  vt_residual_block blocks[POINTS];
  for (int i = 0; i < POINTS; i++) {
    points[i][0] = i / 10.0;
    points[i][1] = 2 * points[i][0] - 1 + vt_random_between(&rng, -0.01, 0.01) + (i % 5 ? 0 : 40); // one in five lies
    blocks[i] = (vt_residual_block){line_residual, points[i], 1, 2, both};
  }
  *slope = 0;
  vt_parameter_group groups[] = {{.values = slope, .size = 1}, {.values = offset, .size = 1, .constant = constant_offset}};
  vt_least_squares_desc desc = vt_default_least_squares_desc();
  desc.loss = loss, desc.loss_width = 0.05;
  assert_int_equal(vt_solve_least_squares(context, &desc, "line", 2, groups, POINTS, blocks, NULL), VT_OK);
}

static void a_robust_loss_fits_the_line_that_outliers_pull_away(void **state) {
  (void)state;
  if (!vt_can_solve_least_squares()) skip();
  vt_context *context = open_context();
  double slope, offset = 0;
  fit_line(context, VT_LOSS_NONE, false, &slope, &offset);
  assert_true(fabs(offset + 1) > 5);
  offset = 0;
  fit_line(context, VT_LOSS_HUBER, false, &slope, &offset);
  assert_close(slope, 2, 0.02);
  assert_close(offset, -1, 0.06);
  offset = 0.25;
  fit_line(context, VT_LOSS_HUBER, true, &slope, &offset);
  assert_true(offset == 0.25); // a constant group stays
  vt_destroy_context(context);
}

static bool refuse(void *user, const double *const *parameters, double *residuals, double **jacobians) {
  (void)user, (void)parameters, (void)jacobians;
  residuals[0] = 0;
  return false;
}

static void a_start_that_cannot_be_judged_or_is_outside_its_bounds_is_named(void **state) {
  (void)state;
  if (!vt_can_solve_least_squares()) skip();
  vt_context *context = open_context();
  double outside[2] = {0.6, 0}, nan[2] = {NAN, 0}, value = 0;
  const double most[2] = {0.5, 10};
  vt_least_squares_report report;
  assert_int_equal(solve_valley(context, outside, most, &report), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(context), "valley"));
  vt_clear_error(context);
  assert_int_equal(solve_valley(context, nan, NULL, &report), VT_BAD_INPUT);
  vt_clear_error(context);
  int group = 0;
  vt_least_squares_desc desc = vt_default_least_squares_desc();
  vt_parameter_group groups[] = {{.values = &value, .size = 1}};
  vt_residual_block blocks[] = {{refuse, NULL, 1, 1, &group}};
  assert_int_equal(vt_solve_least_squares(context, &desc, "blind", 1, groups, 1, blocks, NULL), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(context), "blind"));
  vt_destroy_context(context);
}

static void a_build_without_ceres_says_so(void **state) {
  (void)state;
  if (vt_can_solve_least_squares()) skip();
  vt_context *context = open_context();
  double xy[2] = {0, 0};
  assert_int_equal(solve_valley(context, xy, NULL, NULL), VT_MISSING_PROGRAM);
  assert_non_null(strstr(vt_last_error(context), "Ceres"));
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(rosenbrocks_valley_ends_at_its_least_with_and_without_a_bound),
      cmocka_unit_test(a_robust_loss_fits_the_line_that_outliers_pull_away),
      cmocka_unit_test(a_start_that_cannot_be_judged_or_is_outside_its_bounds_is_named),
      cmocka_unit_test(a_build_without_ceres_says_so)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
