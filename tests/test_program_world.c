// test_program_world.c - scale and cameras from outside: from an option to the tree's metadata, and to other programs
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/program_run.h"

#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)
// The number behind "key": in a text; NAN if it is not there.
static double number_in(const char *text, const char *key) {
  char word[64];
  snprintf(word, sizeof word, "\"%s\":", key);
  const char *at = strstr(text, word);
  return at ? strtod(at + strlen(word), NULL) : NAN;
}

static outcome *expect(outcome *o, int code) { // the macro would run twice
  assert_code(o, code);
  return o;
}

static void make_ball(void) { // of radius 1, so 2 units high
  expect(run("synth ball --kind ball --views 16 --test-views 0 --size 96 -q"), 0);
}

static void the_height_of_the_tree_becomes_a_scale_that_info_tells(void **state) {
  (void)state;
  make_ball();
  outcome *o = run("reconstruct ball -o ball.vtree --preset draft --height 10");
  assert_code(o, 0);
  assert_says(o->out, "the tree is 10 metres high");
  o = run("info ball.vtree --json -");
  assert_code(o, 0);
  double scale = number_in(o->out, "metres_per_unit");
  printf("a ball of 2 units that is 10 metres high: a unit is %.3f metres\n", scale);
  assert_close(scale, 5, 0.2); // a cell is 0.14 here
  assert_close(number_in(o->out, "height_metres"), 10, 1e-9);
  o = run("info ball.vtree");
  assert_says(o->out, "up: (0.0000, 0.0000, 1.0000); a unit is ");
  // the figure survives packing anew, and points come out in metres
  expect(run("reconstruct ball -o raw.vtree --preset draft --height 10 --raw -q"), 0);
  expect(run("compress raw.vtree -o packed.vtree -q"), 0);
  assert_close(number_in(run("info packed.vtree --json -")->out, "metres_per_unit"), scale, 0.01); // measured before packing
  expect(run("export ball.vtree -o units.ply"), 0);
  expect(run("export ball.vtree -o metres.ply --metres"), 0);
  float x[2];
  for (int i = 0; i < 2; i++) {
    static char bytes[65536];
    read_text(i ? "metres.ply" : "units.ply", bytes, sizeof bytes);
    memcpy(&x[i], strstr(bytes, "end_header\n") + 11, sizeof x[i]);
  }
  assert_close(x[1] / x[0], scale, 1e-5);
}

static void a_capture_hands_the_height_on(void **state) {
  (void)state;
  make_ball();
  static char text[200000];
  expect(run("capture ball -o capture --height 10 -q"), 0);
  read_text("capture/transforms.json", text, sizeof text);
  assert_close(number_in(text, "tree_height_metres"), 10, 0);
  expect(run("reconstruct capture -o tree.vtree --preset draft -q"), 0);
  assert_close(number_in(run("info tree.vtree --json -")->out, "metres_per_unit"), 5, 0.2);
}

static void a_tree_without_a_scale_says_so(void **state) {
  (void)state;
  make_ball();
  outcome *o = expect(run("reconstruct ball -o ball.vtree --preset draft -q"), 0);
  o = run("info ball.vtree");
  assert_says(o->out, "the scale is not known");
  o = run("export ball.vtree -o none.ply --metres");
  assert_code(o, 3);
  assert_says(o->err, "--height");
  assert_true(!exists("none.ply"));
}

static void cameras_of_trees_and_captures_are_written_for_others(void **state) {
  (void)state;
  static char a[200000], b[200000];
  make_ball();
  expect(run("reconstruct ball -o ball.vtree --preset draft -q"), 0);
  outcome *o = run("export ball.vtree --cameras colmap-text -o of_tree");
  assert_code(o, 0);
  assert_says(o->out, "16 cameras");
  expect(run("export ball --cameras colmap-text -o of_capture"), 0);
  read_text("of_tree/cameras.txt", a, sizeof a);
  read_text("of_capture/cameras.txt", b, sizeof b);
  assert_string_equal(a, b);
  read_text("of_tree/images.txt", a, sizeof a);
  read_text("of_capture/images.txt", b, sizeof b);
  assert_string_equal(a, b);
  expect(run("export ball --cameras transforms -o again"), 0);
  expect(run("export again/transforms.json --cameras colmap-binary -o last/sparse/0"), 0);
  assert_true(exists("last/sparse/0/cameras.bin") && exists("last/sparse/0/images.bin") && exists("last/sparse/0/points3D.bin"));
  o = run("export ball --cameras colmap-text -o of_capture");
  assert_code(o, 1);
  assert_says(o->err, "something already");
  o = run("export ball --cameras bundler -o x");
  assert_code(o, 2);
  assert_true(count_entries(".tmp.") == 0);
}
#else
static void nothing_is_lost_without_json(void **state) { // cameras are written in every build
  (void)state;
  outcome *o = run("export --help");
  assert_code(o, 0);
  assert_says(o->out, "colmap-text|colmap-binary|transforms");
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)
      cmocka_unit_test(the_height_of_the_tree_becomes_a_scale_that_info_tells),
      cmocka_unit_test(a_capture_hands_the_height_on),
      cmocka_unit_test(a_tree_without_a_scale_says_so),
      cmocka_unit_test(cameras_of_trees_and_captures_are_written_for_others),
#else
      cmocka_unit_test(nothing_is_lost_without_json),
#endif
  };
  if (enter_folder()) return 1;
  int failed = cmocka_run_group_tests(tests, NULL, NULL);
  leave_folder();
  return failed;
}
