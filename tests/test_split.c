// test_split.c - which cells have finer ones: not the empty, not the hidden, and no more than memory holds
// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruct/reconstruct.h"
#include "tests/opacity_run.h"
#include "tests/unit.h"

static vt_context *make_context(int threads, uint64_t bound) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads;
  desc.log_level = VT_LOG_QUIET;
  if (bound) desc.max_memory = bound;
  return vt_create_context(&desc);
}

static void photograph(opacity_run *run, const char *name, int size, double peak) {
  vt_synthetic_desc scene;
  assert_true(vt_find_scene(name, &scene));
  scene.train_count = 16, scene.test_count = 4, scene.width = scene.height = size, scene.supersample = 2;
  if (peak > 0) scene.peak_extinction = peak;
  assert_int_equal(photograph_scene(run, &scene, 0), VT_OK);
}

// Error of a scene at a level with and without splits chosen; cells of the last level; what was chosen on the level before.
static void solve_both_ways(const char *name, int size, double peak, int leaf, const vt_split_desc *splitting, double error[2],
                            uint32_t cells[2], vt_split_report *report) {
  vt_opacity_desc desc = vt_default_opacity_desc();
  opacity_run run = {.context = make_context(2, 0)};
  photograph(&run, name, size, peak);
  for (int chosen = 0; chosen < 2; chosen++) {
    run.splitting = chosen ? splitting : NULL;
    assert_int_equal(begin_run(&run), VT_OK);
    for (int level = 0; level <= leaf; level++) {
      if (chosen && level == leaf) *report = run.split_report;
      assert_int_equal(solve_run_level(&run, &desc, level, level == leaf ? 2 : 3), VT_OK);
    }
    assert_int_equal(judge_run(&run, leaf), VT_OK);
    error[chosen] = run.alpha_rmse, cells[chosen] = run.octree.levels[leaf].cell_count;
  }
  free_opacity_run(&run);
  vt_destroy_context(run.context);
}

static void the_core_of_a_dense_ball_is_left_out_and_no_light_leaks_in(void **state) {
  (void)state;
  vt_split_desc splitting = vt_default_split_desc();
  vt_split_report report;
  double error[2];
  uint32_t cells[2];
  splitting.least_depth = 0;
  solve_both_ways("ball_256", 96, 100, 6, &splitting, error, cells, &report);
  printf("dense ball: %u and %u cells, alpha RMSE %.5f and %.5f\n", cells[0], cells[1], error[0], error[1]);
  assert_true(report.hidden > 100 && report.empty == 0 && cells[1] + 1000 < cells[0]);
  assert_true(fabs(error[1] - error[0]) < 2e-4);
}

static void empty_cells_are_left_out_at_little_cost(void **state) {
  (void)state;
  vt_split_desc splitting = vt_default_split_desc();
  vt_split_report report;
  double error[2];
  uint32_t cells[2];
  splitting.least_axis_cells = 32;
  solve_both_ways("small_oak_128", 128, 0, 6, &splitting, error, cells, &report);
  printf("oak: %u and %u cells, alpha RMSE %.5f and %.5f\n", cells[0], cells[1], error[0], error[1]);
  assert_true(report.empty > 0 && report.for_memory == 0 && cells[1] < 0.95 * cells[0]);
  assert_true(error[1] < error[0] + 0.002);
}

// A solved level of an oak with its rays.
typedef struct solved {
  opacity_run run;
  vt_reduced_views reduced;
  vt_rays rays;
  vt_level *cells;
} solved;

static void solve_oak(solved *s, int threads, int level) {
  vt_opacity_desc desc = vt_default_opacity_desc();
  *s = (solved){.run = {.context = make_context(threads, 0)}};
  photograph(&s->run, "small_oak_128", 96, 0);
  assert_int_equal(begin_run(&s->run), VT_OK);
  for (int l = 0; l <= level; l++) assert_int_equal(solve_run_level(&s->run, &desc, l, 2), VT_OK);
  assert_int_equal(collect_run(&s->run, level, 2, &s->reduced, &s->rays), VT_OK);
  s->cells = &s->run.octree.levels[level];
}

static void free_solved(solved *s) {
  vt_free_rays(s->run.context, &s->rays);
  vt_free_reduced_views(s->run.context, &s->reduced);
  free_opacity_run(&s->run);
  vt_destroy_context(s->run.context);
}

// As after a solver that has lost a twig: thinness alone would drop every cell.
static void thin_cells_that_photographs_ask_for_are_split(void **state) {
  (void)state;
  solved s;
  vt_split_desc desc = vt_default_split_desc();
  vt_split_report report;
  desc.least_axis_cells = 1;
  solve_oak(&s, 2, 4);
  uint8_t *split = VT_NEW(s.run.context, uint8_t, s.cells->cell_count);
  memset(s.cells->optical_depth, 0, s.cells->cell_count * sizeof(float));
  assert_int_equal(vt_choose_splits(s.run.context, &desc, &s.rays, s.cells, split, &report), VT_OK);
  assert_int_equal(report.split, s.cells->cell_count);
  vt_free(s.run.context, split);
  free_solved(&s);
}

static void a_bound_leaves_the_cells_that_matter_least(void **state) {
  (void)state;
  uint8_t *first = NULL;
  for (int threads = 1; threads < 8; threads += 3) {
    solved s;
    vt_split_desc desc = vt_default_split_desc();
    vt_split_report report;
    solve_oak(&s, threads, 5);
    uint32_t count = s.cells->cell_count;
    uint8_t *split = VT_NEW(s.run.context, uint8_t, count);
    desc.most_cells = count / 2;
    assert_int_equal(vt_choose_splits(s.run.context, &desc, &s.rays, s.cells, split, &report), VT_OK);
    double all = 0, left = 0;
    uint32_t chosen = 0;
    for (uint32_t i = 0; i < count; i++) {
      double opacity = 1 - exp(-s.cells->optical_depth[i]);
      all += opacity, chosen += split[i];
      if (!split[i]) left += opacity;
    }
    assert_int_equal(chosen, count / 2);
    assert_int_equal(report.split, count / 2);
    assert_int_equal(report.split + report.empty + report.hidden + report.for_memory, count);
    assert_true(report.opacity_left > 0 && report.opacity_left <= left / all + 1e-6);
    assert_true(left < 0.15 * all); // half of the cells at random would hold half of it
    if (!first) {
      first = malloc(count);
      memcpy(first, split, count);
    }
    assert_memory_equal(first, split, count);
    vt_free(s.run.context, split);
    free_solved(&s);
  }
  free(first);
}

// From plenty of memory down: first all is split, then less, then the tree ends at a coarser level.
static void short_memory_splits_less_before_it_ends_the_tree(void **state) {
  (void)state;
  vt_synthetic_desc scene;
  assert_true(vt_find_scene("small_oak_128", &scene));
  scene.train_count = 16, scene.test_count = 0, scene.width = scene.height = 96, scene.supersample = 2;
  vt_context *context = make_context(2, 0);
  vt_views views;
  assert_int_equal(vt_make_synthetic_views(context, &scene, &views), VT_OK);
  int leaf = 5, split_less = 0;
  vt_status status = VT_OK;
  for (double megabytes = 100; leaf == 5 && !status; megabytes *= 0.8) {
    vt_context *bounded = make_context(2, (uint64_t)(megabytes * 1e6));
    vt_tree tree = {0};
    vt_reconstruct_report report;
    status = vt_reconstruct_opacity(bounded, &views, VT_SOLVER_ADAM, 1, 5, &tree, &report);
    if (!status) {
      leaf = report.leaf_level;
      if (megabytes == 100) assert_true(leaf == 5 && report.levels[4].unsplit_for_memory == 0);
      split_less += leaf == 5 && report.levels[4].unsplit_for_memory > 0;
    }
    vt_free_tree(bounded, &tree);
    vt_destroy_context(bounded);
  }
  printf("%d bounds of memory split less; then the tree ends at level %d\n", split_less, leaf);
  assert_true(!status && split_less > 0 && leaf == 4);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(the_core_of_a_dense_ball_is_left_out_and_no_light_leaks_in),
                                     cmocka_unit_test(empty_cells_are_left_out_at_little_cost),
                                     cmocka_unit_test(thin_cells_that_photographs_ask_for_are_split),
                                     cmocka_unit_test(a_bound_leaves_the_cells_that_matter_least),
                                     cmocka_unit_test(short_memory_splits_less_before_it_ends_the_tree)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
