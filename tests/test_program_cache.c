// test_program_cache.c - whatever stops a run, the same command goes on, and what was kept changes no byte
// SPDX-License-Identifier: BSD-3-Clause
//
// A ball is photographed before a backdrop; colmap is played by a script that hands out the true cameras, keeps count of its
// calls and can be slow. Runs are killed at many moments, by all means, and repeated.
#if defined VT_WITH_OPENIMAGEIO && defined VT_WITH_JANSSON
#include "base/file.h"
#include "base/image_file.h"
#include "datasets-synthetic/synthetic.h"
#include "tests/program_run.h"

enum { VIEWS = 9, SIZE = 32 };
#define TREE "--preset draft --levels 3 --colmap ./colmap --cache kept --matte backdrop --threads 2"

static void put(FILE *file, const void *bytes, size_t size) {
  if (fwrite(bytes, 1, size, file) != size) abort();
}

// Quaternion (w, x, y, z) of a rotation.
static void quaternion_of(const double *m, double q[4]) {
  double t[4] = {1 + m[0] + m[4] + m[8], 1 + m[0] - m[4] - m[8], 1 - m[0] + m[4] - m[8], 1 - m[0] - m[4] + m[8]};
  int k = 0;
  for (int i = 1; i < 4; i++)
    if (t[i] > t[k]) k = i;
  double s = 2 * sqrt(t[k]);
  double all[4][4] = {{s / 4, (m[7] - m[5]) / s, (m[2] - m[6]) / s, (m[3] - m[1]) / s},
                      {(m[7] - m[5]) / s, s / 4, (m[1] + m[3]) / s, (m[2] + m[6]) / s},
                      {(m[2] - m[6]) / s, (m[1] + m[3]) / s, s / 4, (m[5] + m[7]) / s},
                      {(m[3] - m[1]) / s, (m[2] + m[6]) / s, (m[5] + m[7]) / s, s / 4}};
  memcpy(q, all[k], sizeof all[k]);
}

static void put_model(const vt_views *views) {
  const vt_camera *c = &views->items[0].camera;
  uint64_t n = 1, size[2] = {(uint64_t)c->width, (uint64_t)c->height}, many = (uint64_t)views->count, none = 0;
  double lens[3] = {c->fx, c->cx, c->cy};
  uint32_t one = 1, model = 0; // SIMPLE_PINHOLE
  shell("mkdir -p model");
  FILE *file = fopen("model/cameras.bin", "wb");
  put(file, &n, 8), put(file, &one, 4), put(file, &model, 4), put(file, size, 16), put(file, lens, 24);
  fclose(file);
  file = fopen("model/images.bin", "wb");
  put(file, &many, 8);
  for (int i = 0; i < views->count; i++) {
    uint32_t id = (uint32_t)i + 1;
    double pose[7];
    char name[16];
    const vt_camera *v = &views->items[i].camera;
    quaternion_of(v->rotation.m, pose);
    pose[4] = v->translation.x, pose[5] = v->translation.y, pose[6] = v->translation.z;
    snprintf(name, sizeof name, "%02d.png", i);
    put(file, &id, 4), put(file, pose, 56), put(file, &one, 4), put(file, name, strlen(name) + 1), put(file, &none, 8);
  }
  fclose(file);
  file = fopen("model/points3D.bin", "wb");
  put(file, &none, 8);
  fclose(file);
}

static const char script[] = "#!/bin/sh\n"
                             "here=$(dirname \"$0\")\n"
                             "[ \"$2\" = -h ] && { echo 'COLMAP 3.8'; echo --database_path; exit 0; }\n"
                             "echo $1 >> $here/calls\n"
                             "[ -e $here/slow-$1 ] && sleep 0.7\n"
                             "if [ $1 = mapper ]; then while [ $# -gt 0 ]; do [ $1 = --output_path ] && out=$2; shift; done\n"
                             "mkdir -p $out/0 && cp $here/model/* $out/0/ || exit 9; fi\n"
                             "exit 0\n";

static int prepare(void **state) {
  (void)state;
  if (enter_folder()) return -1;
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  vt_synthetic_desc scene = vt_default_synthetic_desc();
  vt_views views = {0};
  scene.kind = VT_SYNTHETIC_BALL;
  scene.train_count = VIEWS;
  scene.test_count = 0;
  scene.width = scene.height = SIZE;
  scene.backdrop = VT_BACKDROP_STUDIO;
  shell("mkdir photos kept");
  bool good = !vt_make_synthetic_views(context, &scene, &views) && !vt_put_before_backdrop(context, &scene, &views);
  for (int i = 0; i < views.count && good; i++) {
    char name[32];
    snprintf(name, sizeof name, "photos/%02d.png", i);
    good = !vt_write_image(context, name, &views.items[i].picture);
  }
  if (good) put_model(&views);
  vt_free_views(context, &views);
  vt_destroy_context(context);
  write_words("colmap", script);
  shell("chmod +x colmap");
  outcome *o = run("reconstruct photos -o true.vtree " TREE " --no-cache -q");
  if (o->code) printf("%s\n", o->err);
  return good && !o->code ? 0 : -1;
}

static int finish(void **state) {
  (void)state;
  leave_folder();
  return 0;
}

static void begin_anew(void) {
  shell("rm -rf kept calls slow-* *.vtree.tmp* a.vtree b.vtree; mkdir kept");
}

static int calls_of(const char *command) {
  char text[4000];
  int count = 0;
  read_text("calls", text, sizeof text);
  for (char *at = text; (at = strstr(at, command)); at++) count++;
  return count;
}

// Starts the program and ends it by `signal_number` after `seconds`, or when colmap is called by `command_called` (not NULL).
static void start_and_stop(const char *words, double seconds, const char *command_called, int signal_number) {
  char command[1000];
  snprintf(command, sizeof command, "HOME=%s exec '%s' %s >/dev/null 2>&1", run_folder, VT_PROGRAM, words);
  pid_t pid = fork();
  if (!pid) {
    setpgid(0, 0);
    execl("/bin/sh", "sh", "-c", command, (char *)NULL);
    _exit(127);
  }
  struct timespec pause = {(time_t)seconds, (long)((seconds - (time_t)seconds) * 1e9)};
  nanosleep(&pause, NULL);
  struct timespec look = {0, 5000000};
  for (int i = 0; command_called && !calls_of(command_called) && i < 4000; i++) nanosleep(&look, NULL);
  kill(pid, signal_number);
  waitpid(pid, NULL, 0);
}

static void expect_same_tree(const char *name) {
  char command[100];
  snprintf(command, sizeof command, "cmp %s true.vtree", name);
  shell(command);
}

static void what_was_kept_changes_no_byte(void **state) {
  (void)state;
  begin_anew();
  outcome *o = run("reconstruct photos -o a.vtree " TREE " --json -");
  assert_code(o, 0);
  assert_says(o->out, "\"calibration_from_cache\": false");
  assert_says(o->out, "\"tree_from_cache\": false");
  expect_same_tree("a.vtree");
  o = run("reconstruct photos -o b.vtree " TREE " --json -");
  assert_code(o, 0);
  assert_says(o->out, "\"calibration_from_cache\": true");
  assert_says(o->out, "\"views_from_cache\": true");
  assert_says(o->out, "\"tree_from_cache\": true");
  assert_int_equal(calls_of("mapper"), 1);
  expect_same_tree("b.vtree");
  o = run("reconstruct photos -o b.vtree " TREE " --depth-steps 2 --json -"); // packing alone is done again
  assert_says(o->out, "\"tree_from_cache\": true");
  o = run("reconstruct photos -o b.vtree " TREE " --max-image-size 16 --json -");
  assert_says(o->out, "\"calibration_from_cache\": true");
  assert_says(o->out, "\"views_from_cache\": false");
  assert_says(o->out, "\"tree_from_cache\": false");
}

static void damaged_entries_are_made_again(void **state) {
  (void)state;
  begin_anew();
  assert_code(run("reconstruct photos -o a.vtree " TREE " -q"), 0);
  static const char *const files[] = {"kept/tree-*/raw.vtree kept/views-*/00003.view", "kept/tree-*/cells",
                                      "kept/tree-*/report kept/calibration-*/0/images.bin"};
  for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
    char command[300];
    snprintf(command, sizeof command, "for f in %s; do head -c 150 $f > short && cat short > $f; done", files[i]);
    shell(command);
    outcome *o = run("reconstruct photos -o b.vtree " TREE);
    assert_code(o, 0);
    assert_says(o->err, "made again");
    expect_same_tree("b.vtree");
  }
}

static void a_dry_run_tells_the_plan_and_writes_nothing(void **state) {
  (void)state;
  begin_anew();
  shell("rmdir kept");
  outcome *o = run("reconstruct photos -o a.vtree " TREE " --dry-run");
  assert_code(o, 0);
  assert_says(o->out, "calibration  about");
  assert_says(o->out, "memory: about");
  assert_false(exists("kept") || exists("a.vtree") || exists("calls"));
  shell("mkdir kept");
  assert_code(run("reconstruct photos -o a.vtree " TREE " -q"), 0);
  shell("rm a.vtree; ls -R kept > before");
  o = run("reconstruct photos -o a.vtree " TREE " --dry-run");
  assert_code(o, 0);
  assert_says(o->out, "calibration  from the cache");
  assert_says(o->out, "views        from the cache");
  assert_says(o->out, "reconstruct  from the cache");
  o = run("capture photos -o cap --colmap ./colmap --cache kept --matte backdrop --dry-run");
  assert_code(o, 0);
  assert_says(o->out, "views        from the cache");
  assert_false(exists("a.vtree") || exists("cap"));
  shell("ls -R kept > after; cmp before after");
}

static void a_run_that_is_killed_at_any_moment_goes_on(void **state) {
  (void)state;
  static const double moments[] = {0.06, 0.12, 0.2, 0.3};
  for (size_t i = 0; i < sizeof moments / sizeof *moments; i++) {
    static const int signals[] = {SIGKILL, SIGINT, SIGKILL, SIGTERM};
    begin_anew();
    start_and_stop("reconstruct photos -o a.vtree " TREE, moments[i], NULL, signals[i]);
    assert_code(run("reconstruct photos -o a.vtree " TREE " -q"), 0);
    expect_same_tree("a.vtree");
    assert_int_equal(count_entries("vtree.tmp") <= 1, 1); // of the killed one itself, beside the output
    shell("rm -f a.vtree.tmp*");
  }
}

static void what_colmap_has_done_is_not_done_again(void **state) {
  (void)state;
  begin_anew();
  shell("touch slow-mapper");
  start_and_stop("reconstruct photos -o a.vtree " TREE, 0, "mapper", SIGKILL);
  shell("rm slow-mapper; ls kept > entries");
  char entries[400];
  read_text("entries", entries, sizeof entries);
  assert_says(entries, "work-");
  outcome *o = run("reconstruct photos -o a.vtree " TREE); // waits for the mapper that is left running, then begins anew
  assert_code(o, 0);
  assert_says(o->err, "goes on");
  expect_same_tree("a.vtree");
  assert_int_equal(calls_of("mapper"), 2);
  shell("! ls kept | grep work-"); // the workspace goes when it is done
}

static void two_runs_at_once_share_one_calibration(void **state) {
  (void)state;
  begin_anew();
  shell("touch slow-feature_extractor");
  char command[1000];
  snprintf(command, sizeof command,
           "for n in a b; do HOME=. '%s' reconstruct photos -o $n.vtree " TREE " -q 2>err-$n & done; wait", VT_PROGRAM);
  shell(command);
  expect_same_tree("a.vtree");
  expect_same_tree("b.vtree");
  assert_int_equal(calls_of("mapper"), 1);
  shell("rm slow-feature_extractor; ! ls kept | grep -E 'tmp|work'");
}

static void the_cache_stays_within_its_bound(void **state) {
  (void)state;
  begin_anew();
  assert_code(run("reconstruct photos -o a.vtree " TREE " -q"), 0);
  assert_code(run("reconstruct photos -o a.vtree " TREE " --cache-size 1K -q"), 0);
  shell("! ls kept | grep -E 'calibration|views|tree'");
  expect_same_tree("a.vtree");
}

static void a_full_disk_costs_the_cache_and_not_the_run(void **state) {
  (void)state;
  begin_anew();
  if (system("mount -t tmpfs -o size=40k tmpfs kept 2>/dev/null")) skip(); // not ours to do here
  outcome *o = run("reconstruct photos -o kept/a.vtree " TREE);
  int code = o->code; // the calibration has room, mattes and tree have none
  static char said[20000];
  snprintf(said, sizeof said, "%s", o->err);
  shell("ls kept > entries; head -c 1M /dev/zero > kept/full 2>/dev/null; true");
  outcome *full = run("reconstruct photos -o a.vtree " TREE);
  assert_code(full, 0); // everything from memory, nothing kept
  expect_same_tree("a.vtree");
  shell("rm -rf kept/*; mount -o remount,size=20m kept");
  outcome *again = run("reconstruct photos -o kept/a.vtree " TREE " -q");
  int code_again = again->code;
  shell("cmp kept/a.vtree true.vtree; umount kept");
  assert_true(code == 0 || code == 1);
  assert_says(said, "full");
  assert_int_equal(code_again, 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(what_was_kept_changes_no_byte),
      cmocka_unit_test(damaged_entries_are_made_again),
      cmocka_unit_test(a_dry_run_tells_the_plan_and_writes_nothing),
      cmocka_unit_test(a_run_that_is_killed_at_any_moment_goes_on),
      cmocka_unit_test(what_colmap_has_done_is_not_done_again),
      cmocka_unit_test(two_runs_at_once_share_one_calibration),
      cmocka_unit_test(the_cache_stays_within_its_bound),
      cmocka_unit_test(a_full_disk_costs_the_cache_and_not_the_run),
  };
  return cmocka_run_group_tests(tests, prepare, finish);
}
#else
int main(void) {
  return 77;
}
#endif
