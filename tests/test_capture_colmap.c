// test_capture_colmap.c - the colmap program as it is run, watched and judged, played by small scripts
// SPDX-License-Identifier: BSD-3-Clause
#include "base/file.h"
#include "base/image_file.h"
#include "capture/colmap_run.h"
#include "base/folders.h"
#include "tests/unit.h"
#include <errno.h>
#include <signal.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

typedef struct stage { // a folder with photographs and a script that plays colmap
  vt_context *context;
  char folder[64], script[96], images[96], workspace[96];
  vt_names names;
  vt_capture_desc desc;
  const char *program; // NULL: the script
} stage;

static char *names_of_five[] = {"a.png", "b.png", "c.png", "d.png", "e.png"};

static void write_text(const char *path, const char *text, int mode) {
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  fputs(text, file);
  fclose(file);
  assert_int_equal(chmod(path, (mode_t)mode), 0);
}

#ifdef VT_WITH_OPENIMAGEIO
static void write_photo(stage *s, const char *name, int width, int height) {
  char path[160];
  vt_image picture = {0};
  snprintf(path, sizeof path, "%s/%s", s->images, name);
  assert_int_equal(vt_make_image(s->context, width, height, 3, &picture), VT_OK);
  assert_int_equal(vt_write_image(s->context, path, &picture), VT_OK);
  vt_free_image(s->context, &picture);
}
#endif

// What every script begins with: $1 is the command, options -> $images $output; all calls are kept in calls.txt.
static const char prologue[] =
    "#!/bin/sh\n"
    "here=$(dirname \"$0\")\n"
    "if [ \"$2\" = -h ]; then echo ' --database_path arg'; echo ' --random_seed arg (=0)'; "
    "echo \" --$USE_GPU arg (=1)\"; exit 0; fi\n"
    "echo \"$QT_QPA_PLATFORM $*\" >> \"$here/calls.txt\"\n"
    "command=$1; shift\n"
    "while [ $# -gt 0 ]; do case $1 in --output_path) output=$2;; --image_path) images=$2;; esac; shift; done\n"
    "model() { mkdir -p \"$output/$1\"; printf \"\\\\$2\\0\\0\\0\\0\\0\\0\\0rest\" > \"$output/$1/images.bin\"; }\n";

static stage set_stage(const char *body) {
  stage s = {0};
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.log_level = VT_LOG_QUIET;
  s.context = vt_create_context(&desc);
  s.desc = vt_default_capture_desc();
  snprintf(s.folder, sizeof s.folder, "/tmp/vt-colmap-XXXXXX");
  assert_non_null(mkdtemp(s.folder));
  snprintf(s.script, sizeof s.script, "%s/colmap", s.folder);
  snprintf(s.images, sizeof s.images, "%s/photos", s.folder);
  snprintf(s.workspace, sizeof s.workspace, "%s/work", s.folder);
  assert_int_equal(mkdir(s.images, 0700), 0);
  assert_int_equal(mkdir(s.workspace, 0700), 0);
  s.names = (vt_names){5, names_of_five};
  char text[4096];
  snprintf(text, sizeof text, "%s%s", prologue, body);
  write_text(s.script, text, 0700);
  setenv("USE_GPU", "SiftExtraction.use_gpu", 1);
#ifdef VT_WITH_OPENIMAGEIO
  for (int i = 0; i < 5; i++) write_photo(&s, names_of_five[i], 8, 6);
#endif
  return s;
}

static vt_status play(stage *s) {
  s->desc.colmap = s->program ? s->program : s->script;
  return vt_run_colmap(s->context, &s->desc, s->images, &s->names, s->workspace);
}

static void strike(stage *s) {
  assert_true(vt_remove_folder(s->context, s->folder));
  vt_destroy_context(s->context);
}

#ifdef VT_WITH_OPENIMAGEIO
static char *calls_of(stage *s) { // free with vt_free
  char path[160];
  uint8_t *bytes = NULL;
  size_t size = 0;
  snprintf(path, sizeof path, "%s/calls.txt", s->folder);
  assert_int_equal(vt_read_file(s->context, path, &bytes, &size), VT_OK);
  return (char *)bytes;
}

static int registered_in_result(stage *s) {
  char path[160];
  snprintf(path, sizeof path, "%s/sparse/0/images.bin", s->workspace);
  FILE *file = fopen(path, "rb");
  int count = file ? fgetc(file) : -1;
  if (file) fclose(file);
  return count;
}
#endif

static void a_missing_program_is_named_with_the_cure(void **state) {
  (void)state;
  stage s = set_stage("exit 0\n");
  s.program = "no-such-program-of-this-name";
  assert_int_equal(play(&s), VT_MISSING_PROGRAM);
  assert_non_null(strstr(vt_last_error(s.context), "no-such-program-of-this-name"));
  assert_non_null(strstr(vt_last_error(s.context), "apt-get install colmap"));
  strike(&s);
}

static void a_program_that_is_not_colmap_is_refused(void **state) {
  (void)state;
  stage s = set_stage("exit 0\n");
  write_text(s.script, "#!/bin/sh\necho hello\n", 0700);
  assert_int_equal(play(&s), VT_MISSING_PROGRAM);
  assert_non_null(strstr(vt_last_error(s.context), "not COLMAP"));
  strike(&s);
}

static void fewer_than_three_photographs_are_too_few(void **state) {
  (void)state;
  stage s = set_stage("exit 0\n");
  s.names.count = 2;
  assert_int_equal(play(&s), VT_TOO_FEW_VIEWS);
  strike(&s);
}

#ifdef VT_WITH_OPENIMAGEIO
static void the_last_error_of_a_failed_step_is_told(void **state) {
  (void)state;
  stage s = set_stage(
      "echo 'Processed file [1/5]'; echo 'ERROR: the database is on fire' >&2; echo; echo '=====' ; exit 3\n");
  assert_int_equal(play(&s), VT_FAILED);
  assert_non_null(strstr(vt_last_error(s.context), "feature_extractor"));
  assert_non_null(strstr(vt_last_error(s.context), "the database is on fire"));
  strike(&s);
}

static void a_mapper_that_is_killed_is_a_failure(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && { echo 'Registering image #2 (3)'; kill -9 $$; }; exit 0\n");
  assert_int_equal(play(&s), VT_FAILED);
  assert_non_null(strstr(vt_last_error(s.context), "mapper"));
  assert_non_null(strstr(vt_last_error(s.context), "137"));
  strike(&s);
}

static void no_model_asks_for_more_overlap_after_every_attempt(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && { echo '  => No good initial image pair found.'; exit 1; }; exit 0\n");
  assert_int_equal(play(&s), VT_TOO_FEW_VIEWS);
  assert_non_null(strstr(vt_last_error(s.context), "only 0 of 5"));
  assert_non_null(strstr(vt_last_error(s.context), "overlap"));
  char *calls = calls_of(&s);
  assert_non_null(strstr(calls, "guided_matching 1"));
  assert_non_null(strstr(calls, "init_min_tri_angle 4"));
  assert_null(strstr(calls, "sequential_matcher"));
  vt_free(s.context, calls);
  strike(&s);
}

static void the_model_with_most_photographs_is_kept(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && { model 0 3; model 1 5; model 2 2; }; exit 0\n");
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(registered_in_result(&s), 5);
  char *calls = calls_of(&s);
  assert_non_null(strstr(calls, "offscreen feature_extractor"));
  assert_non_null(strstr(calls, "--SiftExtraction.use_gpu 0"));
  assert_non_null(strstr(calls, "--SiftMatching.use_gpu 0"));
  assert_non_null(strstr(calls, "--ImageReader.single_camera 1"));
  assert_non_null(strstr(calls, "--random_seed"));
  assert_null(strstr(calls, "init_min_tri_angle")); // the first attempt was good enough
  vt_free(s.context, calls);
  strike(&s);
}

static void a_later_attempt_is_kept_only_if_it_is_better(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && { case $output in *-0) model 0 2;; *) model 0 4;; esac; }; exit 0\n");
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(registered_in_result(&s), 4);
  strike(&s);
}

static void newer_versions_get_their_own_options(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && model 0 5; exit 0\n");
  setenv("USE_GPU", "FeatureExtraction.use_gpu", 1);
  assert_int_equal(play(&s), VT_OK);
  char *calls = calls_of(&s);
  assert_non_null(strstr(calls, "--FeatureExtraction.use_gpu 0"));
  assert_non_null(strstr(calls, "--FeatureMatching.use_gpu 0"));
  assert_null(strstr(calls, "SiftMatching"));
  vt_free(s.context, calls);
  strike(&s);
}

static void photographs_of_several_sizes_do_not_share_a_camera(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && model 0 5; exit 0\n");
  write_photo(&s, "c.png", 6, 8);
  assert_int_equal(play(&s), VT_OK);
  char *calls = calls_of(&s);
  assert_non_null(strstr(calls, "photographs-0.txt")); // each group is extracted by itself, with one camera
  assert_non_null(strstr(calls, "photographs-1.txt --ImageReader.camera_model SIMPLE_RADIAL --ImageReader.single_camera 1"));
  assert_null(strstr(calls, "photographs-2.txt"));
  vt_free(s.context, calls);
  strike(&s);
}

static void kinds_that_colmap_cannot_read_are_converted_under_their_names(void **state) {
  (void)state;
  stage s = set_stage("[ $command = feature_extractor ] && cp -rL \"$images\" \"$here/seen\"\n[ $command = mapper ] && "
                      "model 0 5; exit 0\n");
  write_photo(&s, "b.pam", 8, 6);
  char *names[] = {"a.png", "b.pam", "c.png"}, path[160];
  s.names = (vt_names){3, names};
  assert_int_equal(play(&s), VT_OK);
  snprintf(path, sizeof path, "%s/seen/b.pam", s.folder);
  uint8_t *bytes = NULL;
  size_t size = 0;
  assert_int_equal(vt_read_file(s.context, path, &bytes, &size), VT_OK);
  assert_memory_equal(bytes, "\x89PNG", 4);
  vt_free(s.context, bytes);
  snprintf(path, sizeof path, "%s/seen/c.png", s.folder);
  assert_true(vt_is_file(path));
  strike(&s);
}

static vt_context *to_cancel;
static void cancel_it(int signal_number) {
  (void)signal_number;
  vt_cancel(to_cancel);
}

static void cancelling_ends_the_program_and_what_it_started(void **state) {
  (void)state;
  stage s = set_stage("[ $command = feature_extractor ] && { sleep 100 & echo $! > \"$here/pid\"; wait; }; exit 0\n");
  to_cancel = s.context;
  signal(SIGALRM, cancel_it);
  double start = vt_seconds();
  alarm(2);
  assert_int_equal(play(&s), VT_CANCELLED);
  assert_true(vt_seconds() - start < 20);
  char path[160];
  snprintf(path, sizeof path, "%s/pid", s.folder);
  FILE *file = fopen(path, "r");
  assert_non_null(file);
  int pid = 0;
  assert_int_equal(fscanf(file, "%d", &pid), 1);
  fclose(file);
  bool gone = false; // or a zombie that nobody has collected yet
  for (int i = 0; i < 50 && !gone; i++) {
    char status_path[64], line[256] = "";
    snprintf(status_path, sizeof status_path, "/proc/%d/stat", pid);
    FILE *status = fopen(status_path, "r");
    if (status && !fgets(line, sizeof line, status)) line[0] = 0;
    if (status) fclose(status);
    gone = (kill(pid, 0) != 0 && errno == ESRCH) || strstr(line, ") Z ");
    nanosleep(&(struct timespec){0, 100000000}, NULL);
  }
  assert_true(gone);
  strike(&s);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_missing_program_is_named_with_the_cure),
      cmocka_unit_test(a_program_that_is_not_colmap_is_refused),
      cmocka_unit_test(fewer_than_three_photographs_are_too_few),
#ifdef VT_WITH_OPENIMAGEIO
      cmocka_unit_test(the_last_error_of_a_failed_step_is_told),
      cmocka_unit_test(a_mapper_that_is_killed_is_a_failure),
      cmocka_unit_test(no_model_asks_for_more_overlap_after_every_attempt),
      cmocka_unit_test(the_model_with_most_photographs_is_kept),
      cmocka_unit_test(a_later_attempt_is_kept_only_if_it_is_better),
      cmocka_unit_test(newer_versions_get_their_own_options),
      cmocka_unit_test(photographs_of_several_sizes_do_not_share_a_camera),
      cmocka_unit_test(kinds_that_colmap_cannot_read_are_converted_under_their_names),
      cmocka_unit_test(cancelling_ends_the_program_and_what_it_started),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
