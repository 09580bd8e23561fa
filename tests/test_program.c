// test_program.c - the program from outside: help, exit codes, the whole way from synth to pictures
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/program_run.h"

static const char *const verbs[] = {"synth",  "capture", "reconstruct", "compress", "evaluate",
                                    "render", "info",    "export",      "bench",    "play",
                                    "doctor"};
#define VERB_COUNT (sizeof verbs / sizeof *verbs)

// ---- the command line

static void every_verb_explains_itself(void **state) {
  (void)state;
  for (size_t i = 0; i < VERB_COUNT; i++) {
    char words[100], usage[100];
    snprintf(words, sizeof words, "%s --help", verbs[i]);
    snprintf(usage, sizeof usage, "Usage: voltree %s ", verbs[i]);
    outcome *o = run(words);
    assert_code(o, 0);
    assert_says(o->out, usage);
    assert_says(o->out, "Example:\n  voltree ");
    assert_says(o->out, "--max-memory");
    assert_null(strstr(o->out, " \n"));
    assert_string_equal(o->err, "");
  }
}

static void help_and_version_are_found_before_and_behind_a_verb(void **state) {
  (void)state;
  assert_says(run("help render")->out, "Usage: voltree render ");
  outcome *o = run("render --version");
  assert_code(o, 0);
  assert_says(o->out, "voltree ");
}

static void overview_names_all_verbs_and_exit_codes(void **state) {
  (void)state;
  outcome *o = run("--help");
  assert_code(o, 0);
  for (size_t i = 0; i < VERB_COUNT; i++) assert_says(o->out, verbs[i]);
  assert_says(o->out, "130 interrupted");
  assert_code(run("--version"), 0);
  assert_code(run("help nonsense"), 2);
}

static void no_arguments_is_a_usage_error(void **state) {
  (void)state;
  outcome *o = run("");
  assert_code(o, 2);
  assert_says(o->err, "voltree: no verb was given");
  assert_string_equal(o->out, "");
}

static void unknown_names_get_the_nearest_suggested(void **state) {
  (void)state;
  static const struct {
    const char *words, *says;
  } cases[] = {{"reconstrut a -o b", "did you mean reconstruct?"},
               {"xyzzy", "xyzzy: unknown verb; voltree --help lists all"},
               {"--threads 2 info", "the verb comes first"},
               {"render a -o b.png --azimut 3", "did you mean --azimuth?"},
               {"render a -o b.png --azi=3", "did you mean --azimuth?"},
               {"info a --frobnicate", "--frobnicate: unknown option of info; voltree info --help lists all"},
               {"info a -z", "-z: unknown option"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    outcome *o = run(cases[i].words);
    assert_code(o, 2);
    assert_says(o->err, "voltree: ");
    assert_says(o->err, cases[i].says);
  }
}

static void every_value_is_checked_before_the_work(void **state) {
  (void)state;
  static const struct {
    const char *words, *says;
  } cases[] = {{"synth", "OUT is missing"},
               {"evaluate tree.vtree", "CAPTURE is missing"},
               {"synth a b", "b: one name too many"},
               {"reconstruct a", "-o TREE.vtree is missing"},
               {"synth a --views", "--views: its value is missing"},
               {"synth a --views=", "not a whole number"},
               {"synth a --views 0", "from 1 to 1000"},
               {"synth a --views 12x", "not a whole number"},
               {"synth a --views 99999999999999999999", "not a whole number"},
               {"synth a --kind elm", "tree|oak|pine"},
               {"synth a --quiet=yes", "takes no value"},
               {"synth a --threads 0", "from 1 to 64"},
               {"synth a --max-memory lots", "give it like 4G"},
               {"synth a --max-memory -3", "give it like 4G"},
               {"reconstruct a -o b --time-budget nan", "not a number"},
               {"reconstruct a -o b --levels 11", "from 1 to 10"},
               {"reconstruct a -o b --method 2005", "2004|2006|best"},
               {"reconstruct a -o", "its value is missing"},
               {"reconstruct a -o ''", "its value is empty"},
               {"reconstruct '' -o b", "empty name"},
               {"render a -o b.png --size 10", "like 800x600"},
               {"render a -o b.png --size 0x4", "like 800x600"},
               {"render a -o b.png --background red", "R,G,B"},
               {"render a -o b.png --background 1,2,256", "R,G,B"},
               {"render a -o b.xyz", "give a name that ends in"},
               {"render a -o b --turntable 4 --levels-sheet", "give one of them"},
               {"export a -o b.obj", "ends in .ply"},
               {"bench nonsense", "no such suite; there is frontier"},
               {"evaluate a b --background none", "give white, black"},
               {"play a --headless 3", "-o DIR go together"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    outcome *o = run(cases[i].words);
    if (o->code != 2) printf("%s\n", cases[i].words);
    assert_code(o, 2);
    assert_says(o->err, cases[i].says);
    assert_string_equal(o->out, "");
  }
  assert_int_equal(count_entries("tmp"), 0);
}

#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)
// ---- the whole way

static int made; // the small tree that the tests below look at
static void make_tree(void) {
  if (made) return;
  assert_code(run("synth cap --size 64 --views 12 --test-views 3 --leaves 400 --seed 3 -q"), 0);
  assert_code(
      run("reconstruct cap -o tree.vtree --preset draft --levels 4 --holdout 4 --threads 2 -q --alpha-codewords 64 "
          "--colour-codewords 64"),
      0);
  made = 1;
}

// The number behind "key": in a JSON text, the first one.
static double number_in(const char *json, const char *key) {
  char quoted[80];
  snprintf(quoted, sizeof quoted, "\"%s\":", key);
  const char *at = strstr(json, quoted);
  return at ? strtod(at + strlen(quoted), NULL) : NAN;
}

static void quiet_says_nothing(void **state) {
  (void)state;
  make_tree();
  outcome *o = run("info tree.vtree --quiet");
  assert_code(o, 0);
  assert_string_equal(o->out, "");
  assert_string_equal(o->err, "");
}

static void reconstruct_reports_stages_levels_and_held_out_scores(void **state) {
  (void)state;
  make_tree();
  outcome *o =
      run("reconstruct cap -o again.vtree --no-cache --preset draft --levels 4 --holdout 4 --threads 1 --alpha-codewords 64 "
          "--colour-codewords 64 --json - --report rep");
  assert_code(o, 0);
  assert_true(o->out[0] == '{');
  assert_int_equal(number_in(o->out, "schema_version"), 1);
  assert_int_equal(number_in(o->out, "photographs_used"), 9);
  assert_says(o->out, "\"held_out\": [\"");
  assert_true(number_in(o->out, "total") > 0);
  assert_true(number_in(o->out, "cells_before_pruning") >= number_in(o->out, "cells"));
  assert_int_equal(number_in(o->out, "file_bytes"), size_of("again.vtree"));
  assert_true(number_in(o->out, "texture_bytes") > 0 && number_in(o->out, "file_bytes") < number_in(o->out, "texture_bytes_raw"));
  assert_true(number_in(o->out, "psnr") > 10);
  assert_true(exists("rep/report.json") && exists("rep/index.html") && exists("rep/levels.png"));
  shell("cmp tree.vtree again.vtree"); // one worker and two, with a report and without: the same bytes
}

static void probes_show_each_level(void **state) {
  (void)state;
  make_tree();
  assert_code(run("reconstruct cap -o p.vtree --preset draft --levels 3 --probe probes -q"), 0);
  assert_true(size_of("probes/level_3_cells.png") > 0 && size_of("probes/level_3_residual.png") > 0);
}

static void evaluate_beats_white_and_fails_below_a_wanted_quality(void **state) {
  (void)state;
  make_tree();
  outcome *o = run("evaluate tree.vtree cap --split test --backend cpu --json e.json --report er --max-memory 1G");
  assert_code(o, 0);
  assert_says(o->out, "nearest_photograph");
  static char json[200000];
  read_text("e.json", json, sizeof json);
  assert_int_equal(number_in(json, "views"), 3);
  assert_int_equal(number_in(json, "level"), 4);
  assert_true(number_in(json, "psnr") > number_in(json, "white"));
  assert_true(number_in(json, "ssim") > 0.3 && number_in(json, "alpha_rmse") < 0.4 &&
              number_in(json, "psnr_foreground") > 5);
  assert_true(number_in(json, "seconds_per_frame") > 0);
  assert_true(exists("er/contact_sheet.png") && exists("er/report.json"));
  o = run("evaluate tree.vtree cap --split holdout --backend cpu --no-predictors --min-psnr 60 --json -");
  assert_code(o, 7);
  assert_int_equal(number_in(o->out, "views"), 3);
  assert_null(strstr(o->out, "predictors"));
  assert_says(o->err, "--min-psnr is 60");
  o = run("evaluate tree.vtree cap --split train --backend cpu --no-predictors --level 2 --json -");
  assert_code(o, 0);
  assert_int_equal(number_in(o->out, "views"), 9);
  assert_int_equal(number_in(o->out, "level"), 2);
  assert_code(run("evaluate tree.vtree cap --level 9"), 2);
}

static void evaluate_refuses_photographs_with_other_cameras(void **state) {
  (void)state;
  make_tree();
  assert_code(run("synth other --size 64 --views 13 --leaves 400 --seed 3 -q"), 0);
  outcome *o = run("evaluate tree.vtree other --split train --backend cpu");
  assert_code(o, 3);
  assert_says(o->err, "is not the one that tree.vtree was made with");
}

static void render_draws_pictures_turntables_and_sheets(void **state) {
  (void)state;
  make_tree();
  assert_code(run("render tree.vtree -o a.png --azimuth 30 --elevation=-20 --size 40x30 --backend cpu"), 0);
  assert_code(run("render tree.vtree -o v.png --view 2 --level 3 --background 10,20,30 --backend cpu"), 0);
  assert_code(run("render tree.vtree -o sheet.png --levels-sheet --backend cpu"), 0);
  assert_true(size_of("a.png") > 100 && size_of("v.png") > 100 && size_of("sheet.png") > 100);
  outcome *o = run("render tree.vtree -o turn --turntable 3 --size 33x31 --backend cpu --json -");
  assert_code(o, 0);
  assert_int_equal(number_in(o->out, "pictures"), 3);
  assert_true(exists("turn/frame_0000.png") && exists("turn/frame_0002.png"));
  assert_code(run("render tree.vtree -o turn --turntable 2 --size 33x31 --backend cpu"), 0); // into the same folder
  assert_code(run("render tree.vtree -o b.png --view 9"), 2);
  assert_code(run("render tree.vtree -o b.png --level 7"), 2);
  assert_code(run("render tree.vtree -o b.png --view 1 --azimuth 10"), 2); // one of them would be passed over
  assert_false(exists("b.png"));
  assert_int_equal(count_entries("tmp"), 0);
}

static void export_writes_a_point_for_each_cell(void **state) {
  (void)state;
  make_tree();
  outcome *o = run("export tree.vtree -o t.ply --level 3 --json -");
  assert_code(o, 0);
  static char text[100000];
  read_text("t.ply", text, sizeof text);
  assert_says(text, "ply\nformat binary_little_endian 1.0\n");
  long head = strstr(text, "end_header\n") + 11 - text;
  assert_int_equal(size_of("t.ply"), head + 20 * (long)number_in(o->out, "points"));
}

static void raw_trees_are_packed_by_compress_once(void **state) {
  (void)state;
  make_tree();
  assert_code(run("reconstruct cap -o raw.vtree --method 2006 --preset draft --levels 3 --raw -q"), 0);
  outcome *o =
      run("compress raw.vtree -o packed.vtree --colour-codewords 16 --alpha-codewords 16 --quantiser lab-gla --json -");
  assert_code(o, 0);
  assert_says(o->out, "\"lab-gla\"");
  assert_true(size_of("packed.vtree") < size_of("raw.vtree"));
  o = run("info packed.vtree --json -");
  assert_code(o, 0);
  assert_int_equal(number_in(o->out, "colour_codewords"), 16);
  assert_says(o->out, "\"compression\"");
  o = run("compress packed.vtree -o twice.vtree");
  assert_code(o, 3);
  assert_says(o->err, "packed.vtree: is packed already");
  assert_false(exists("twice.vtree"));
  assert_code(run("reconstruct cap -o field.vtree --preset draft --levels 3 --raw -q"), 0); // corners and view textures
  assert_code(run("compress field.vtree -o packed_field.vtree -q"), 0);
  assert_true(size_of("packed_field.vtree") < size_of("field.vtree"));
  assert_code(run("compress packed_field.vtree -o twice.vtree"), 3);
}

static void trees_without_tiles_are_told_packed_and_exported(void **state) {
  (void)state;
  const char *golden = VT_SOURCE_DIR "/tests/golden/v1_field_stored.vtree";
  char line[4096];
  snprintf(line, sizeof line, "info %s", golden);
  outcome *o = run(line);
  assert_code(o, 0);
  assert_says(o->out, "corners");
  assert_says(o->out, "view pixels");
  assert_true(!strstr(o->out, "billboards"));
  snprintf(line, sizeof line, "compress %s -o field.vtree --field-colours 9 --depth-steps 2 --ratio-levels 5 --json -", golden);
  o = run(line);
  assert_code(o, 0);
  assert_int_equal(number_in(o->out, "field_colours"), 9);
  assert_int_equal(number_in(o->out, "depth_steps"), 2);
  assert_int_equal(number_in(o->out, "ratio_levels"), 5);
  o = run("info field.vtree --json -");
  assert_code(o, 0);
  assert_int_equal(number_in(o->out, "field_codewords"), 9);
  assert_true(number_in(o->out, "field_bytes") > 0 && number_in(o->out, "view_bytes") > 0);
  assert_code(run("export field.vtree -o field.ply -q"), 0);
  assert_true(exists("field.ply"));
  snprintf(line, sizeof line, "compress %s -o field.vtree --depth-steps 4", golden);
  o = run(line);
  assert_code(o, 2);
  assert_says(o->err, "1|2|3|6|9|18");
}

static void play_runs_without_a_window(void **state) {
  (void)state;
  make_tree();
  outcome *o = run("play tree.vtree --headless 3 -o played --size 64x48 --backend cpu --json -");
  assert_code(o, 0);
  assert_int_equal(number_in(o->out, "frames"), 3);
  assert_true(exists("played/frame_0002.png"));
}

static void play_without_a_display_fails_and_does_not_wait(void **state) {
  (void)state;
  make_tree();
  unsetenv("DISPLAY"), unsetenv("WAYLAND_DISPLAY"), unsetenv("SDL_VIDEODRIVER");
  outcome *o = run("play tree.vtree"); // a program that waits runs into the time limit of the test
  assert_true(o->code == 1 || o->code == 5);
  assert_says(o->err, "voltree: window: ");
}

static void bench_shows_time_and_error(void **state) {
  (void)state;
  make_tree();
  outcome *o = run("bench frontier --quick --capture cap --colour-codewords 32 --alpha-codewords 32 --json -");
  assert_code(o, 0);
  assert_says(o->out, "\"suite\": \"frontier\"");
  assert_says(o->out, "\"label\": \"voltree/draft\"");
  assert_says(o->out, "\"label\": \"visual hull\"");
}

static void too_little_memory_is_exit_6(void **state) {
  (void)state;
  make_tree();
  outcome *o = run("reconstruct cap -o m.vtree --preset draft --levels 4 --max-memory 200K");
  assert_code(o, 6);
  assert_says(o->err, "memory");
  assert_false(exists("m.vtree"));
  assert_int_equal(count_entries("tmp"), 0);
}
#endif

// ---- Ctrl-C

static void interrupted_work_leaves_nothing(void **state) {
  (void)state;
  static char *words[] = {(char *)"voltree", (char *)"synth",   (char *)"cut",
                          (char *)"--size",  (char *)"1500",    (char *)"--views",
                          (char *)"900",     (char *)"--quiet", NULL};
  int status = 0;
  for (int wait = 1; wait < 10; wait *= 3) { // a signal before the program has begun only kills it: then wait longer
    pid_t child = fork();
    if (child == 0) {
      int null = open("/dev/null", O_WRONLY);
      dup2(null, 2);
      execv(VT_PROGRAM, words);
      _exit(99);
    }
    struct timespec moment = {wait, 0};
    nanosleep(&moment, NULL);
    kill(child, SIGINT);
    waitpid(child, &status, 0);
    if (WIFEXITED(status)) break;
  }
  assert_true(WIFEXITED(status));
  assert_int_equal(WEXITSTATUS(status), 130);
  assert_int_equal(count_entries("cut"), 0);
}

int main(void) {
  if (enter_folder()) return 77;
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(every_verb_explains_itself),
    cmocka_unit_test(help_and_version_are_found_before_and_behind_a_verb),
    cmocka_unit_test(overview_names_all_verbs_and_exit_codes),
    cmocka_unit_test(no_arguments_is_a_usage_error),
    cmocka_unit_test(unknown_names_get_the_nearest_suggested),
    cmocka_unit_test(every_value_is_checked_before_the_work),
#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)
    cmocka_unit_test(quiet_says_nothing),
    cmocka_unit_test(reconstruct_reports_stages_levels_and_held_out_scores),
    cmocka_unit_test(probes_show_each_level),
    cmocka_unit_test(evaluate_beats_white_and_fails_below_a_wanted_quality),
    cmocka_unit_test(evaluate_refuses_photographs_with_other_cameras),
    cmocka_unit_test(render_draws_pictures_turntables_and_sheets),
    cmocka_unit_test(export_writes_a_point_for_each_cell),
    cmocka_unit_test(raw_trees_are_packed_by_compress_once),
    cmocka_unit_test(trees_without_tiles_are_told_packed_and_exported),
    cmocka_unit_test(play_runs_without_a_window),
    cmocka_unit_test(play_without_a_display_fails_and_does_not_wait),
    cmocka_unit_test(bench_shows_time_and_error),
    cmocka_unit_test(too_little_memory_is_exit_6),
#endif
    cmocka_unit_test(interrupted_work_leaves_nothing),
  };
  int failed = cmocka_run_group_tests(tests, NULL, NULL);
  leave_folder();
  return failed;
}
