// test_program_doctor.c - what is missing, on the machine or in the photographs, is said before the work
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/program_run.h"

static void the_doctor_names_what_is_missing_with_the_cure(void **state) {
  (void)state;
  outcome *o = run("doctor --colmap no-such-program --json found.json --cache kept");
  static char json[20000];
  read_text("found.json", json, sizeof json);
  assert_says(o->out, "no-such-program: finds the cameras of photographs");
  assert_says(o->out, "apt-get install colmap");
  assert_says(o->out, "self-test");
  assert_says(o->out, "disk of the cache");
  assert_false(exists("kept")); // looking makes nothing
#if defined VT_WITH_OPENIMAGEIO && defined VT_WITH_JANSSON
  assert_code(o, 0); // a capture with cameras needs no colmap
  assert_says(json, "\"demo_can_run\": true");
#else
  assert_code(o, 5);
  assert_says(o->out, "MISSING");
  assert_says(o->err, "setup.sh");
  assert_says(json, "\"demo_can_run\": false");
#endif
}

#ifdef VT_WITH_OPENIMAGEIO
static void a_check_needs_no_output_and_makes_none(void **state) {
  (void)state;
  assert_code(run("synth cap --views 6 --test-views 0 --size 48 -q"), 0);
  shell("mkdir photos; cp cap/images/train/*.png photos/; cp photos/r_3.png photos/r_4.png; head -c 200 photos/r_1.png > short; "
        "cp short photos/r_1.png");
  outcome *o = run("capture --check photos --cache kept --json report.json");
  static char json[20000];
  assert_code(o, 0);
  assert_says(o->out, "6 photographs: few for a tree");
  assert_says(o->out, "r_4.png: shows the same as r_3.png");
  assert_says(o->out, "unreadable");
  assert_says(o->out, "resolution: ");
  assert_says(o->out, "needed: about ");
  read_text("report.json", json, sizeof json);
  assert_says(json, "\"shows_the_same_as\": \"r_3.png\"");
  assert_says(json, "\"photographs_unreadable\": 1");
  assert_false(exists("kept"));
  assert_code(run("capture photos"), 2);
  assert_code(run("capture --check nowhere"), 3);
  shell("mkdir empty");
  o = run("capture --check empty");
  assert_code(o, 3);
  assert_says(o->err, "no photographs in it");
}

#ifdef VT_WITH_JANSSON
static void a_check_of_known_cameras_tells_the_coverage(void **state) {
  (void)state;
  assert_code(run("synth ring --views 24 --test-views 0 --size 32 -q"), 0);
  outcome *o = run("capture --check ring");
  assert_code(o, 0);
  assert_says(o->out, "coverage: all around the tree");
  o = run("capture ring -o out --json -");
  assert_code(o, 0);
  assert_says(o->out, "\"degrees_around\": ");
  assert_says(o->out, "\"reading\": ");
}
#endif
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_doctor_names_what_is_missing_with_the_cure),
#ifdef VT_WITH_OPENIMAGEIO
      cmocka_unit_test(a_check_needs_no_output_and_makes_none),
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(a_check_of_known_cameras_tells_the_coverage),
#endif
#endif
  };
  if (enter_folder()) return 1;
  int failed = cmocka_run_group_tests(tests, NULL, NULL);
  leave_folder();
  return failed;
}
