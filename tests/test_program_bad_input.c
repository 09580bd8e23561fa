// test_program_bad_input.c - bad input gives the right exit code, one sentence that names it, and no output
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/program_run.h"

// Runs and expects: the exit code; exactly one line "voltree: what: why" on stderr, with `name` in it; no file "out" of
// any kind and no temporary file.
#define expect_trouble(words_, code_, name_)                                                                           \
  do {                                                                                                                 \
    outcome *o_ = run(words_);                                                                                         \
    if (o_->code != (code_)) printf("%s\n", words_);                                                                   \
    assert_code(o_, code_);                                                                                            \
    assert_says(o_->err, name_);                                                                                       \
    assert_int_equal(count_sentences(o_->err), 1);                                                                     \
    assert_int_equal(count_entries("out"), 1); /* .out of the test itself */                                           \
    assert_int_equal(count_entries("tmp"), 0);                                                                         \
  } while (0)

static int count_sentences(const char *text) {
  int count = !strncmp(text, "voltree: ", 9);
  for (const char *at = text; (at = strstr(at, "\nvoltree: ")); at++) count++;
  return count;
}

static void missing_and_empty_folders_are_named(void **state) {
  (void)state;
  shell("mkdir -p empty && mkdir -p textonly && echo hello > textonly/notes.txt");
  expect_trouble("reconstruct nowhere -o out.vtree", 3, "nowhere");
  expect_trouble("capture nowhere -o out", 3, "nowhere");
  expect_trouble("reconstruct empty -o out.vtree", 3, "empty");
  expect_trouble("reconstruct textonly -o out.vtree", 3, "textonly");
  expect_trouble("info nowhere.vtree", 3, "nowhere.vtree");
  expect_trouble("info empty", 3, "empty");
  expect_trouble("render nowhere.vtree -o out.pam", 3, "nowhere.vtree");
  expect_trouble("evaluate nowhere.vtree empty", 3, "nowhere.vtree");
  expect_trouble("compress nowhere.vtree -o out.vtree", 3, "nowhere.vtree");
  expect_trouble("export nowhere.vtree -o out.ply", 3, "nowhere.vtree");
  expect_trouble("play nowhere.vtree", 3, "nowhere.vtree");
}

static void outputs_that_cannot_be_written_fail_before_the_work(void **state) {
  (void)state;
  expect_trouble("synth nofolder/cap", 1, "nofolder/cap");
  expect_trouble("reconstruct nowhere -o nofolder/t.vtree", 1, "nofolder/t.vtree");
  expect_trouble("capture nowhere -o nofolder/cap", 1, "nofolder/cap");
  expect_trouble("render nowhere -o /dev/null/a.pam", 1, "/dev/null/a.pam");
  expect_trouble("render nowhere -o nofolder/turn --turntable 3", 1, "nofolder/turn");
  expect_trouble("export nowhere -o nofolder/a.ply", 1, "nofolder/a.ply");
  expect_trouble("compress nowhere -o nofolder/b.vtree", 1, "nofolder/b.vtree");
  expect_trouble("info nowhere --json nofolder/a.json", 1, "nofolder/a.json");
  shell("mkdir -p taken.vtree && touch takenfile");
  expect_trouble("reconstruct nowhere -o taken.vtree", 1, "taken.vtree");
  expect_trouble("synth takenfile", 1, "takenfile");
  if (geteuid() != 0) { // nothing is read-only for root
    shell("mkdir -p locked && chmod 500 locked");
    expect_trouble("reconstruct nowhere -o locked/t.vtree", 1, "locked/t.vtree");
    expect_trouble("synth locked/cap", 1, "locked/cap");
  }
}

static void pictures_that_cannot_be_written_are_told_before_the_work(void **state) {
  (void)state;
  expect_trouble("render nowhere.vtree -o out.exr", 2, "out.exr");
  expect_trouble("render nowhere.vtree -o out", 2, "out");
#ifdef VT_WITH_OPENIMAGEIO
  expect_trouble("render nowhere.vtree -o out.jpg", 2, "JPEG keeps no transparency");
  expect_trouble("render nowhere.vtree -o out.jpg --background white", 3, "nowhere.vtree");
#endif
}

static void no_tree_at_all_is_refused(void **state) {
  (void)state;
  write_words("zero.vtree", "");
  write_words("words.vtree", "this is no tree at all, whatever its name says, and it is long enough to be read");
  expect_trouble("info zero.vtree", 3, "zero.vtree");
  expect_trouble("info words.vtree", 3, "words.vtree");
  expect_trouble("render words.vtree -o out.pam", 3, "words.vtree");
}

#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)

static int made;
static void make_capture(void) {
  if (made) return;
  assert_code(run("synth cap --size 48 --views 8 --test-views 0 --leaves 200 -q"), 0);
  assert_code(run("reconstruct cap -o good.vtree --preset draft --levels 3 -q"), 0);
  made = 1;
}
// A fresh copy of the capture at "bad".
static void copy_capture(void) {
  make_capture();
  shell("rm -rf bad && cp -r cap bad");
}
static const char *photo(void) { // the first picture of "bad", found as it lies
  static char path[200];
  FILE *pipe = popen("find bad -name '*.png' | sort | head -1", "r");
  if (!pipe || !fgets(path, sizeof path, pipe)) abort();
  pclose(pipe);
  path[strcspn(path, "\n")] = 0;
  return path;
}
static const char *name_of(const char *path) {
  return strrchr(path, '/') + 1;
}

static void damaged_pictures_are_named(void **state) {
  (void)state;
  copy_capture();
  const char *path = photo();
  write_words(path, "");
  expect_trouble("reconstruct bad -o out.vtree", 3, name_of(path));
  write_words(path, "no picture");
  expect_trouble("reconstruct bad -o out.vtree", 3, name_of(path));
  expect_trouble("capture bad -o out", 3, name_of(path));
  copy_capture();
  path = photo();
  if (truncate(path, size_of(path) / 2)) abort();
  expect_trouble("reconstruct bad -o out.vtree", 3, name_of(path));
  unlink(path);
  expect_trouble("reconstruct bad -o out.vtree", 3, name_of(path));
}

static void one_photograph_is_too_few(void **state) {
  (void)state;
  copy_capture();
  char command[400];
  snprintf(command, sizeof command, "rm -rf one && mkdir one && cp '%s' one/a.png", photo());
  shell(command);
  expect_trouble("reconstruct one -o out.vtree", 4, "one");
  expect_trouble("capture one -o out", 4, "one");
}

static void photographs_for_judging_only_make_no_tree(void **state) {
  (void)state;
  assert_code(run("synth judged --size 32 --views 3 --test-views 3 --leaves 50 -q"), 0);
  expect_trouble("reconstruct judged/transforms_test.json -o out.vtree", 4, "judged/transforms_test.json");
}

static const char frame[] =
    "{\"camera_angle_x\": 0.7, \"frames\": [{\"file_path\": \"%s\", \"transform_matrix\": [[%s, 0, 0, 0], "
    "[0, %s, 0, -4], [0, 0, 1, 0], [0, 0, 0, 1]]}]}";

static void bad_transforms_are_refused_with_their_file(void **state) {
  (void)state;
  static const struct {
    const char *picture, *a, *b, *says;
  } cases[] = {{"a.png", "NaN", "1", "transforms.json"},   // no JSON
               {"a.png", "1e999", "1", "transforms.json"}, // no number
               {"a.png", "0", "1", "a.png"},               // singular
               {"a.png", "-1", "1", "a.png"},              // a mirror
               {"missing.png", "1", "1", "missing.png"}};
  copy_capture();
  char command[400], text[600];
  snprintf(command, sizeof command, "rm -rf tf && mkdir tf && cp '%s' tf/a.png", photo());
  shell(command);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    snprintf(text, sizeof text, frame, cases[i].picture, cases[i].a, cases[i].b);
    write_words("tf/transforms.json", text);
    expect_trouble("reconstruct tf -o out.vtree", 3, cases[i].says);
  }
  write_words("tf/transforms.json", "{\"frames\": []}");
  expect_trouble("reconstruct tf -o out.vtree", 3, "transforms.json");
  write_words("tf/transforms.json", "[1, 2");
  expect_trouble("reconstruct tf -o out.vtree", 3, "transforms.json");
  write_words("tf/transforms.json", "");
  expect_trouble("reconstruct tf -o out.vtree", 3, "transforms.json");
}

static void a_colmap_model_without_pictures_is_refused(void **state) {
  (void)state;
  shell("rm -rf ws && mkdir -p ws/sparse/0");
  write_words("ws/sparse/0/cameras.txt", "1 PINHOLE 48 48 60 60 24 24\n");
  write_words("ws/sparse/0/images.txt",
              "1 1 0 0 0 0 0 4 1 a.png\n\n2 1 0 0 0 0.1 0 4 1 b.png\n\n3 1 0 0 0 0.2 0 4 1 c.png\n\n");
  write_words("ws/sparse/0/points3D.txt", "");
  outcome *o = run("reconstruct ws -o out.vtree");
  assert_true(o->code == 3 || o->code == 4);
  assert_int_equal(count_sentences(o->err), 1);
  assert_says(o->err, "ws");
  assert_false(exists("out.vtree"));
}

static void damaged_trees_are_refused_by_every_verb(void **state) {
  (void)state;
  make_capture();
  long size = size_of("good.vtree");
  char *bytes = malloc((size_t)size);
  FILE *file = fopen("good.vtree", "rb");
  if (!file || fread(bytes, 1, (size_t)size, file) != (size_t)size) abort();
  fclose(file);
  for (int i = 1; i < 8; i++) {
    write_bytes("cut.vtree", bytes, (size_t)(size * i / 8));
    expect_trouble("info cut.vtree", 3, "cut.vtree");
  }
  write_bytes("cut.vtree", bytes, (size_t)size - 1);
  expect_trouble("render cut.vtree -o out.png", 3, "cut.vtree");
  expect_trouble("evaluate cut.vtree cap", 3, "cut.vtree");
  for (int i = 0; i < 8; i++) { // one bit, anywhere
    long at = (2 * i + 1) * size / 16;
    bytes[at] ^= 16;
    write_bytes("bent.vtree", bytes, (size_t)size);
    bytes[at] ^= 16;
    expect_trouble("info bent.vtree", 3, "bent.vtree");
  }
  free(bytes);
}

static void evaluate_without_photographs_to_judge_on_says_so(void **state) {
  (void)state;
  make_capture();
  expect_trouble("evaluate good.vtree cap --split holdout", 3, "good.vtree");
  expect_trouble("evaluate good.vtree cap --split test", 3, "cap");
  expect_trouble("evaluate good.vtree nowhere", 3, "nowhere");
}
#endif

int main(void) {
  if (enter_folder()) return 77;
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(missing_and_empty_folders_are_named),
    cmocka_unit_test(outputs_that_cannot_be_written_fail_before_the_work),
    cmocka_unit_test(pictures_that_cannot_be_written_are_told_before_the_work),
    cmocka_unit_test(no_tree_at_all_is_refused),
#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)
    cmocka_unit_test(damaged_pictures_are_named),
    cmocka_unit_test(one_photograph_is_too_few),
    cmocka_unit_test(photographs_for_judging_only_make_no_tree),
    cmocka_unit_test(bad_transforms_are_refused_with_their_file),
    cmocka_unit_test(a_colmap_model_without_pictures_is_refused),
    cmocka_unit_test(damaged_trees_are_refused_by_every_verb),
    cmocka_unit_test(evaluate_without_photographs_to_judge_on_says_so),
#endif
  };
  int failed = cmocka_run_group_tests(tests, NULL, NULL);
  leave_folder();
  return failed;
}
