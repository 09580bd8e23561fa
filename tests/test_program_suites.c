// test_program_suites.c - what the suites of the bench say must hold whatever the machine
// SPDX-License-Identifier: BSD-3-Clause
//
// Each suite runs once, --quick, and its report is asked for what would be wrong if the suite lied: a disturbance that does
// not reach the reconstruction, a skip that is not switched, a count that grows by pruning, a curve that should be flat.
// Times are only asked for what no load of the machine can turn round.
#include "base/json.h"
#include "tests/program_run.h"

static vt_context *context;
static vt_json *report;

static void run_suite(const char *suite) {
#ifndef VT_WITH_JANSSON
  skip(); // a build that reads no JSON
#endif
  char words[200];
  snprintf(words, sizeof words, "bench %s --quick --repetitions 1 --json %s.json --report %s --quiet", suite, suite, suite);
  assert_code(run(words), 0);
  snprintf(words, sizeof words, "%s.json", suite);
  vt_free_json(context, report);
  report = NULL;
  assert_int_equal(vt_read_json(context, words, &report), VT_OK);
}

// ---- asking a report

static const vt_json *find_named(const char *list, const char *key, const char *name) {
  const vt_json *items = vt_json_member(report, list);
  for (size_t i = 0; i < vt_json_count(items); i++)
    if (!strcmp(vt_json_string(vt_json_member(vt_json_item(items, i), key), ""), name)) return vt_json_item(items, i);
  fail_msg("the report has no %s in %s\n", name, list);
  return NULL;
}

static const vt_json *table_named(const char *name) { return find_named("tables", "name", name); }

static size_t row_count(const vt_json *table) { return vt_json_count(vt_json_member(table, "rows")); }

static const char *label_at(const vt_json *table, size_t row) {
  return vt_json_string(vt_json_member(vt_json_item(vt_json_member(table, "rows"), row), "label"), "");
}

// The value in a row and the column of that name; NAN where the cell is empty.
static double value_at(const vt_json *table, size_t row, const char *column) {
  const vt_json *columns = vt_json_member(table, "columns");
  for (size_t c = 0; c < vt_json_count(columns); c++)
    if (!strcmp(vt_json_string(vt_json_member(vt_json_item(columns, c), "name"), ""), column)) {
      const vt_json *values = vt_json_member(vt_json_item(vt_json_member(table, "rows"), row), "values");
      return vt_json_number(vt_json_item(values, c), NAN);
    }
  fail_msg("the table has no column %s\n", column);
  return NAN;
}

// The row of that label, or else the first one that starts so.
static size_t row_named(const vt_json *table, const char *label) {
  for (size_t r = 0; r < row_count(table); r++)
    if (!strcmp(label_at(table, r), label)) return r;
  for (size_t r = 0; r < row_count(table); r++)
    if (!strncmp(label_at(table, r), label, strlen(label))) return r;
  fail_msg("the table has no row %s\n", label);
  return 0;
}

static double value_of(const vt_json *table, const char *row, const char *column) {
  return value_at(table, row_named(table, row), column);
}

#define assert_within(value_, low_, high_)                                                                             \
  do {                                                                                                                 \
    double within_v = (value_);                                                                                        \
    if (!(within_v >= (low_) && within_v <= (high_)))                                                                  \
      printf("%s:%d: %s = %.6g is not within %g and %g\n", __FILE__, __LINE__, #value_, within_v, (double)(low_),      \
             (double)(high_));                                                                                         \
    assert_true(within_v >= (low_) && within_v <= (high_));                                                            \
  } while (0)

// ---- the suites

static void stability_curves_are_flat_where_nothing_may_change(void **state) {
  (void)state;
  run_suite("stability");
  static const char *const flat[] = {"scale", "shift"};
  for (int i = 0; i < 2; i++) {
    const vt_json *table = table_named(flat[i]);
    assert_true(row_count(table) >= 4);
    for (size_t r = 0; r < row_count(table); r++) {
      assert_close(value_at(table, r, "alpha RMSE, textured"), value_at(table, 0, "alpha RMSE, textured"), 2e-4);
      assert_within(value_at(table, r, "change"), 0, 0.2);
    }
  }
  const vt_json *threads = table_named("threads");
  for (size_t r = 0; r < row_count(threads); r++) {
    assert_true(value_at(threads, r, "same raw tree") == 1);
    assert_true(value_at(threads, r, "same packed tree") == 1);
    assert_true(value_at(threads, r, "same picture") == 1);
  }
  for (size_t r = 1; r < row_count(table_named("order")); r++) // subsets differ, so bits do, but not the quality
    assert_close(value_at(table_named("order"), r, "PSNR"), value_at(table_named("order"), 0, "PSNR"), 0.5);
}

static void stability_disturbances_reach_the_reconstruction(void **state) {
  (void)state;
  if (!report) skip();
  static const char *const curves[] = {"matte_noise", "sensor_noise", "pose", "focal"};
  for (int i = 0; i < 4; i++) {
    const vt_json *table = table_named(curves[i]);
    size_t last = row_count(table) - 1;
    assert_true(value_at(table, 0, "change") == 0);
    assert_within(value_at(table, last, "change"), 0.5, 60);
    assert_true(value_at(table, last, "change") > value_at(table, 1, "change"));
    assert_within(value_at(table, last, "PSNR"), 12, value_at(table, 0, "PSNR") + 0.3); // graceful, and not for the better
  }
  const vt_json *clustered = table_named("clustered"), *dense = table_named("saturation");
  assert_true(value_of(clustered, "within 1 degrees", "all around: alpha RMSE, flat") >
              1.5 * value_of(clustered, "within 360 degrees", "all around: alpha RMSE, flat"));
  for (size_t r = 0; r < row_count(clustered); r++) assert_within(value_at(clustered, r, "alpha RMSE, textured"), 0, 0.1);
  for (size_t r = 1; r < row_count(dense); r++)
    assert_true(value_at(dense, r, "saturated rays") >= value_at(dense, r - 1, "saturated rays"));
  assert_true(value_at(dense, row_count(dense) - 1, "saturated rays") > 0.1);
  assert_within(value_at(dense, row_count(dense) - 1, "alpha RMSE, textured"), 0, 0.2);
}

static void paper_prunes_packs_and_draws(void **state) {
  (void)state;
  run_suite("paper");
  const vt_json *billboards = table_named("billboards"), *textures = table_named("textures");
  const vt_json *switches = table_named("level_switch"), *quantisers = table_named("quantisers");
  const vt_json *codebooks = table_named("codebooks"), *frames = table_named("frames");
  for (size_t r = 0; r < row_count(billboards); r++) {
    double before = value_at(billboards, r, "before"), after = value_at(billboards, r, "after");
    assert_true(before > 0);
    if (strstr(label_at(billboards, r), "octree")) assert_within(after, 0.1 * before, before);
  }
  assert_true(value_of(billboards, "oak/octree level 5", "paper: after") == 53000);
  for (size_t r = 0; r < row_count(switches); r++) {
    assert_true(value_at(switches, r, "primitives, fine") > 2 * value_at(switches, r, "primitives, coarse"));
    assert_within(value_at(switches, r, "RMS"), 0.5, value_at(switches, r, "RMS on the tree"));
  }
  for (size_t r = 0; r < row_count(textures); r++) {
    assert_true(value_at(textures, r, "raw") == 64 * value_at(textures, r, "textures"));
    assert_true(value_at(textures, r, "packed") < 0.2 * value_at(textures, r, "raw"));
    assert_true(value_at(textures, r, "raw") <= value_at(textures, r, "unpruned, raw"));
  }
  for (size_t r = 1; r < row_count(codebooks); r++)
    if (value_at(codebooks, r, "codewords") > value_at(codebooks, r - 1, "codewords")) { // the same tree
      assert_true(value_at(codebooks, r, "PSNR of textures, colour") > value_at(codebooks, r - 1, "PSNR of textures, colour"));
      assert_true(value_at(codebooks, r, "PSNR of pictures") > value_at(codebooks, r - 1, "PSNR of pictures") - 0.2);
    }
  for (size_t r = 0; r < row_count(quantisers); r++) assert_within(value_at(quantisers, r, "RMS"), 0.1, 28);
  for (size_t r = 0; r < row_count(frames); r++) assert_within(value_at(frames, r, "frames a second"), 0.05, 1e5);
  assert_true(value_of(frames, "12 trees/processor", "trees drawn") <= 12);
  assert_within(value_of(frames, "290 trees/processor", "trees drawn"), 50, 290);
  assert_true(exists("paper/index.html") && exists("paper/billboards.csv"));
}

static void scaling_exponents_are_those_of_foliage_and_rays(void **state) {
  (void)state;
  run_suite("scaling");
  const vt_json *exponents = table_named("exponents");
  assert_within(value_of(exponents, "cells over cells along an edge", "exponent"), 1.8, 2.9);
  assert_within(value_of(exponents, "cells over photographs", "exponent"), -0.3, 0.2);
  assert_within(value_of(exponents, "rays over photographs", "exponent"), 0.7, 1.1);
  assert_within(value_of(exponents, "textures over photographs", "exponent"), 0.7, 1.1);
  assert_within(value_of(exponents, "textures over cells", "exponent"), 0.8, 1.15);
  assert_within(value_of(exponents, "peak over photographs", "exponent"), 0.2, 1.1);
  assert_within(value_of(exponents, "seconds over photographs", "exponent"), 0.2, 1.6);
  assert_within(value_of(exponents, "compression: seconds over codewords", "exponent"), 0, 1.3);
  for (size_t r = 0; r < row_count(exponents); r++) assert_true(value_at(exponents, r, "points") >= 3);
  const vt_json *trees = table_named("trees");
  assert_true(value_of(trees, "overview/trees 256", "drawn") == 256);
  assert_true(value_of(trees, "overview/trees 256", "seconds a frame") < 64 * value_of(trees, "overview/trees 1", "seconds a frame"));
  for (size_t r = 0; r < row_count(table_named("codebooks")); r++)
    assert_within(value_at(table_named("codebooks"), r, "colour PSNR"), 20, 60);
}

static void skips_save_what_they_say_and_change_little(void **state) {
  (void)state;
  run_suite("skips");
  const vt_json *skips = table_named("skips");
  static const char *const without_a_trace[] = {"reconstruct/pixels that meet no coarse cell", "reconstruct/chords kept",
                                                "draw/cells outside the picture", "draw/empty space jumped over"};
  for (int i = 0; i < 4; i++) assert_within(value_of(skips, without_a_trace[i], "pictures differ"), 0, 0.01);
  assert_within(value_of(skips, "draw/what an opaque ray cannot see", "pictures differ"), 0, 0.05);
  assert_true(value_of(skips, "reconstruct/chords kept", "memory saved") < 0.9); // it costs memory
  assert_true(value_of(skips, "reconstruct/chords kept", "time saved") > 0.7); // 2 to 3 on a machine of its own
  assert_true(value_of(skips, "reconstruct/hidden billboards, method 2006", "memory saved") > 1.02);
  assert_true(value_of(skips, "reconstruct/cells all but empty", "memory saved") > 0.9); // tiles saved half; corners cost little
  assert_within(value_of(skips, "reconstruct/cells all but empty", "PSNR lost"), -0.5, 0.5);
  assert_true(value_of(skips, "reconstruct/refinement beyond", "pictures differ") > 0.1); // the switch does something
  assert_true(value_of(skips, "compress/", "pictures differ") > 0.01);
  for (size_t r = 0; r < row_count(skips); r++) assert_true(value_at(skips, r, "with") > 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(stability_curves_are_flat_where_nothing_may_change),
                                            cmocka_unit_test(stability_disturbances_reach_the_reconstruction),
                                            cmocka_unit_test(paper_prunes_packs_and_draws),
                                            cmocka_unit_test(scaling_exponents_are_those_of_foliage_and_rays),
                                            cmocka_unit_test(skips_save_what_they_say_and_change_little)};
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  context = vt_create_context(&desc);
  if (!context || enter_folder()) return 1;
  int failed = cmocka_run_group_tests(tests, NULL, NULL);
  vt_free_json(context, report);
  vt_destroy_context(context);
  leave_folder();
  return failed;
}
