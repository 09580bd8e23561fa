// test_program_synth.c - voltree synth from outside: every option, combinations that make no sense, truth and its use
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/program_run.h"

static void help_explains_every_option(void **state) {
  (void)state;
  static const char *const names[] = {"scene",         "kind",           "mesh",
                                      "seed",          "views",          "test-views",
                                      "size",          "width",          "height",
                                      "fov",           "supersample",    "leaves",
                                      "rig",           "backdrop",       "light",
                                      "sun",           "wind",           "relight",
                                      "export",        "damage-seed",    "damage-test-views",
                                      "noise",         "blur",           "jpeg",
                                      "exposure",      "distortion",     "white-balance",
                                      "pose-error",    "position-error", "focal-error",
                                      "matte-erosion", "matte-blur",     "matte-holes",
                                      "matte-noise",   "peak-extinction"};
  outcome *o = run("synth --help");
  assert_code(o, 0);
  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    char option[40];
    snprintf(option, sizeof option, " --%s", names[i]);
    assert_says(o->out, option);
  }
  assert_says(o->out, "spiral|ring|hemisphere|arc|drone|handheld");
  assert_says(o->out, "comb|crown");
}

static void what_does_not_go_together_is_refused(void **state) {
  (void)state;
  static const struct {
    const char *words, *says;
  } cases[] = {{"--scene nowhere", "give one of tree_96"},
               {"--kind ball --wind 0.1", "--wind: a phantom (ball) has no surfaces"},
               {"--kind crown --sun 2", "--sun: a phantom (crown)"},
               {"--scene comb_64 --relight 2", "--relight: a phantom (comb)"},
               {"--scene blobs_64 --export a.obj", "--export: a phantom"},
               {"--scene ball_64 --light trace", "--light: a phantom"},
               {"--kind shell --leaves 5", "only grown trees have a number of leaves"},
               {"--kind oak --peak-extinction 4", "only phantoms have one"},
               {"--kind mesh", "give --mesh FILE"},
               {"--kind oak --mesh a.obj", "--kind is oak; give one of them"},
               {"--size 64 --width 80", "give it alone"},
               {"--backdrop sky --matte-holes 0.1", "--matte-holes: photographs before a backdrop carry no matte"},
               {"--export tree.stl", "ends in .obj, .gltf or .glb"},
               {"--noise 0.6", "from 0 to 0.5"},
               {"--jpeg 0", "from 1 to 100"},
               {"--distortion -0.6", "from -0.5 to 0.5"},
               {"--matte-erosion nan", "not a number"},
               {"--fov 150", "from 1 to 140"},
               {"--rig circle", "spiral|ring"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char words[200];
    snprintf(words, sizeof words, "synth refused %s", cases[i].words);
    outcome *o = run(words);
    if (o->code != 2) printf("%s\n", words);
    assert_code(o, 2);
    assert_says(o->err, cases[i].says);
  }
  assert_false(exists("refused"));
}

#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)

static double number_in(const char *json, const char *key) {
  char quoted[80];
  snprintf(quoted, sizeof quoted, "\"%s\":", key);
  const char *at = strstr(json, quoted);
  return at ? strtod(at + strlen(quoted), NULL) : NAN;
}

static char text[200000];

static void truth_says_what_was_photographed_and_how_it_was_damaged(void **state) {
  (void)state;
  assert_code(
      run("synth t --scene crown_64 --seed 9 --views 5 --test-views 2 --width 40 --height 30 --rig drone --fov 40 "
          "--noise 0.03 --jpeg 85 --pose-error 0.5 --matte-erosion -1.5 --damage-seed 3 -q"),
      0);
  read_text("t/truth.json", text, sizeof text);
  assert_says(text, "\"kind\": \"crown\"");
  assert_says(text, "\"rig\": \"drone\"");
  assert_close(number_in(text, "seed"), 9, 0);
  assert_close(number_in(text, "peak_extinction"), 50, 0);
  assert_close(number_in(text, "train_count"), 5, 0);
  assert_close(number_in(text, "width"), 40, 0);
  assert_close(number_in(text, "fov_y"), 40 * 3.14159265358979 / 180, 1e-9);
  assert_close(number_in(text, "noise"), 0.03, 0);
  assert_close(number_in(text, "jpeg_quality"), 85, 0);
  assert_close(number_in(text, "matte_erosion"), -1.5, 0);
  assert_true(exists("t/truth/transforms_train.json") && exists("t/truth/transforms_test.json"));
  assert_true(exists("t/truth/mattes/train/r_4.png") && exists("t/truth/mattes/test/r_1.png"));
  // the same options give the same bytes, and a capture of ours may be replaced with all that lies in it
  shell("cp -r t before");
  assert_code(
      run("synth t --scene crown_64 --seed 9 --views 5 --test-views 2 --width 40 --height 30 --rig drone --fov 40 "
          "--noise 0.03 --jpeg 85 --pose-error 0.5 --matte-erosion -1.5 --damage-seed 3 -q"),
      0);
  shell("diff -r t before");
  assert_code(run("synth t --scene crown_64 --views 3 --test-views 0 --size 32 -q"), 0);
  assert_false(exists("t/truth"));
  assert_true(exists("t/transforms.json") && exists("t/truth.json"));
}

static void what_others_put_into_the_truth_is_not_lost(void **state) {
  (void)state;
  assert_code(run("synth kept --scene ball_64 --views 3 --test-views 0 --size 32 --pose-error 1 -q"), 0);
  write_words("kept/truth/notes.txt", "mine");
  outcome *o = run("synth kept --scene ball_64 --views 3 --test-views 0 --size 32 -q");
  assert_code(o, 1);
  assert_says(o->err, "voltree did not write");
  assert_true(exists("kept/truth/notes.txt"));
}

static void exact_cameras_stand_beside_wrong_ones(void **state) {
  (void)state;
  const char *scene = "--scene ball_64 --views 6 --test-views 2 --size 32 -q";
  char words[300];
  snprintf(words, sizeof words, "synth right %s", scene);
  assert_code(run(words), 0);
  snprintf(words, sizeof words, "synth wrong %s --pose-error 2 --position-error 0.02 --focal-error 0.05", scene);
  assert_code(run(words), 0);
  // all numbers but the pictures' paths are those of the undamaged capture
  shell("grep -v file_path right/transforms_train.json >one; grep -v file_path wrong/truth/transforms_train.json >two");
  shell("cmp one two");
  shell("! cmp -s right/transforms_train.json wrong/transforms_train.json");
  shell("cmp right/transforms_test.json wrong/transforms_test.json"); // judged against exact views
  shell("cmp right/images/train/r_3.png wrong/images/train/r_3.png");
  assert_false(exists("right/truth"));
  snprintf(words, sizeof words, "synth both %s --focal-error 0.05 --damage-test-views", scene);
  assert_code(run(words), 0);
  shell("! cmp -s right/transforms_test.json both/transforms_test.json");
  // and make a capture of their own
  assert_code(run("reconstruct wrong/truth -o exact.vtree --preset draft --levels 3 -q"), 0);
  assert_code(run("reconstruct right -o right.vtree --preset draft --levels 3 -q"), 0);
  outcome *o = run("evaluate exact.vtree wrong/truth --no-predictors --json -");
  assert_code(o, 0);
  double exact = number_in(o->out, "psnr");
  o = run("evaluate right.vtree right --no-predictors --json -");
  assert_close(number_in(o->out, "psnr"), exact, 1e-6);
  assert_true(isfinite(number_in(o->out, "delta_e")) && number_in(o->out, "sharpness") > 0);
}

static void exact_mattes_are_a_choice_of_masks(void **state) {
  (void)state;
  assert_code(run("synth clean --scene ball_64 --views 6 --test-views 2 --size 48 -q"), 0);
  assert_code(run("synth eaten --scene ball_64 --views 6 --test-views 2 --size 48 --matte-holes 0.3 -q"), 0);
  shell("! cmp -s clean/images/train/r_0.png eaten/images/train/r_0.png");
  double alpha[3];
  static const char *const words[] = {"clean", "eaten", "eaten/truth --matte masks"};
  for (int i = 0; i < 3; i++) {
    char line[200];
    snprintf(line, sizeof line, "reconstruct %s -o m.vtree --preset draft --levels 3 -q", words[i]);
    assert_code(run(line), 0);
    snprintf(line, sizeof line, "evaluate m.vtree %s --no-predictors --json -", words[i]);
    outcome *o = run(line);
    assert_code(o, 0);
    alpha[i] = number_in(o->out, "alpha_rmse");
  }
  printf("alpha RMSE: clean %.4f, holes %.4f, holes with exact mattes %.4f\n", alpha[0], alpha[1], alpha[2]);
  assert_close(alpha[2], alpha[0], 0.005);
  assert_true(alpha[1] > alpha[0] + 0.02);
}

static const char *truth_of_level_4(const char *json) {
  const char *truth = strstr(json, "\"truth\": {"), *last = truth ? strstr(truth, "\"level\": 4,") : NULL;
  assert_true(truth && last);
  return last;
}

static void evaluate_compares_with_the_truth(void **state) {
  (void)state;
  assert_code(run("synth b --scene blobs_64 -q"), 0);
  assert_code(run("reconstruct b -o b.vtree -q"), 0);
  outcome *o = run("evaluate b.vtree b --truth --no-predictors --json b.json");
  assert_code(o, 0);
  assert_says(o->out, "against the truth");
  read_text("b.json", text, sizeof text);
  const char *last = truth_of_level_4(text);
  double correlation = number_in(last, "extinction_correlation"), error = number_in(last, "extinction_relative_rms");
  double mass = number_in(last, "mass_ratio"), through = number_in(text, "transmittance_rmse"),
         depth = number_in(text, "depth_rmse");
  printf("blobs: correlation %.3f, relative RMS %.3f, mass %.3f, transmittance %.4f, depth %.4f\n", correlation, error,
         mass, through, depth);
  assert_true(correlation > 0.9 && error < 0.4 && fabs(mass - 1) < 0.15 && through < 0.05 && depth < 0.1);
  // the truth of another object is found out
  assert_code(run("synth c --scene blobs_64 --seed 2 -q"), 0);
  shell("cp b/truth.json b/kept.json; cp c/truth.json b/truth.json");
  o = run("evaluate b.vtree b --truth --no-predictors --json -");
  assert_code(o, 0);
  assert_true(number_in(truth_of_level_4(o->out), "extinction_correlation") < 0.6);
  assert_true(number_in(o->out, "transmittance_rmse") > 3 * through);
  // any number of threads
  shell("cp b/kept.json b/truth.json");
  assert_code(run("evaluate b.vtree b --truth --no-predictors --threads 1 --json one.json -q"), 0);
  assert_code(run("evaluate b.vtree b --truth --no-predictors --threads 3 --json three.json -q"), 0);
  shell("sed -n '/\"truth\": {$/,/^  }/p' one.json >one; sed -n '/\"truth\": {$/,/^  }/p' three.json >three; test -s "
        "one; cmp one three");
}

static void damaged_truth_is_refused(void **state) {
  (void)state;
  assert_code(run("synth d --scene ball_64 --views 4 --test-views 1 --size 32 -q"), 0);
  assert_code(run("reconstruct d -o d.vtree --preset draft --levels 2 -q"), 0);
  static const struct {
    const char *content, *says;
  } cases[] = {{"{", "truth.json"},
               {"{}", "nothing of an \"object\""},
               {"{\"object\": {\"kind\": \"elm\"}}", "\"kind\" is \"elm\""},
               {"{\"object\": {\"kind\": \"ball\", \"peak_extinction\": -1}}", "\"peak_extinction\" is not a number"},
               {"{\"object\": {\"kind\": \"ball\", \"seed\": \"x\"}}", "\"seed\" is not a number"},
               {"{\"object\": {\"kind\": \"mesh\"}}", "which mesh"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    write_words("d/truth.json", cases[i].content);
    outcome *o = run("evaluate d.vtree d --truth --no-predictors");
    assert_code(o, 3);
    assert_says(o->err, cases[i].says);
  }
  shell("rm d/truth.json");
  outcome *o = run("evaluate d.vtree d --truth --no-predictors");
  assert_code(o, 3);
  assert_says(o->err, "leave out --truth");
}

static void every_rig_and_every_damage_makes_a_capture(void **state) {
  (void)state;
  static const char *const rigs[] = {"spiral", "ring", "hemisphere", "arc", "drone", "handheld"};
  for (int i = 1; i < 6; i += 2) {
    char words[200];
    snprintf(words, sizeof words, "synth rig --scene comb_64 --views 4 --test-views 1 --size 24 --rig %s -q", rigs[i]);
    assert_code(run(words), 0);
    read_text("rig/truth.json", text, sizeof text);
    assert_says(text, rigs[i]);
  }
  static const char *const damages[] = {"--noise 0.05 --white-balance 0.3 --exposure 1 --jpeg 30",
                                        "--blur 1.5 --distortion 0.3",
                                        "--matte-erosion 1 --matte-blur 1 --matte-noise 0.1"};
  const char *plain = "synth plain --scene crown_64 --views 2 --test-views 0 --size 48 -q";
  assert_code(run(plain), 0);
  for (int i = 0; i < 3; i++) {
    char words[200];
    snprintf(words, sizeof words, "synth bad --scene crown_64 --views 2 --test-views 0 --size 48 -q %s", damages[i]);
    assert_code(run(words), 0);
    shell("! cmp -s plain/images/train/r_0.png bad/images/train/r_0.png");
  }
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(help_explains_every_option),
    cmocka_unit_test(what_does_not_go_together_is_refused),
#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)
    cmocka_unit_test(truth_says_what_was_photographed_and_how_it_was_damaged),
    cmocka_unit_test(what_others_put_into_the_truth_is_not_lost),
    cmocka_unit_test(exact_cameras_stand_beside_wrong_ones),
    cmocka_unit_test(exact_mattes_are_a_choice_of_masks),
    cmocka_unit_test(evaluate_compares_with_the_truth),
    cmocka_unit_test(damaged_truth_is_refused),
    cmocka_unit_test(every_rig_and_every_damage_makes_a_capture)
#endif
  };
  if (enter_folder()) return 1;
  int failed = cmocka_run_group_tests(tests, NULL, NULL);
  leave_folder();
  return failed;
}
