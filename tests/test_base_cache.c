// test_base_cache.c - the cache: entries, their bound, and locks that end with their holders
// SPDX-License-Identifier: BSD-3-Clause
#include "base/cache.h"
#include "base/file.h"
#include "base/folders.h"
#include "tests/unit.h"
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

typedef struct place {
  vt_context *context;
  char root[64];
} place;

static place open_place(void) {
  place p = {0};
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.log_level = VT_LOG_QUIET;
  p.context = vt_create_context(&desc);
  snprintf(p.root, sizeof p.root, "/tmp/vt-cache-XXXXXX");
  assert_non_null(mkdtemp(p.root));
  return p;
}

static void close_place(place *p) {
  assert_true(vt_remove_folder(p->context, p->root));
  vt_destroy_context(p->context);
}

// A folder with a file of `kilobytes`, used `seconds` ago.
static void put_entry(place *p, const char *name, int kilobytes, int seconds) {
  char path[256], file[300];
  uint8_t *bytes = calloc((size_t)kilobytes + 1, 1024);
  for (int i = 0; i < kilobytes * 1024; i++) bytes[i] = (uint8_t)(i * 7 + 1); // no holes
  snprintf(path, sizeof path, "%s/%s", p->root, name);
  snprintf(file, sizeof file, "%s/data", path);
  assert_int_equal(vt_make_folder(p->context, path), VT_OK);
  assert_int_equal(vt_write_file(p->context, file, bytes, (size_t)kilobytes * 1024), VT_OK);
  free(bytes);
  struct timespec times[2] = {{time(NULL) - seconds, 0}, {time(NULL) - seconds, 0}};
  assert_int_equal(utimensat(AT_FDCWD, path, times, 0), 0);
}

static bool there(place *p, const char *name) {
  char path[256];
  snprintf(path, sizeof path, "%s/%s", p->root, name);
  return vt_is_folder(path);
}

#define A "calibration-000000000000000a"
#define B "views-000000000000000b"
#define C "tree-000000000000000c"

static void the_entry_used_longest_ago_goes_first(void **state) {
  (void)state;
  place p = open_place();
  put_entry(&p, A, 100, 30), put_entry(&p, B, 100, 20), put_entry(&p, C, 100, 10);
  vt_trim_cache(p.context, p.root, 0, NULL); // no bound
  vt_trim_cache(p.context, p.root, 400000, NULL);
  assert_true(there(&p, A) && there(&p, B) && there(&p, C));
  char path[256];
  snprintf(path, sizeof path, "%s/%s", p.root, A);
  assert_true(vt_use_entry(path)); // now B is the oldest
  vt_trim_cache(p.context, p.root, 250000, NULL);
  assert_true(there(&p, A) && !there(&p, B) && there(&p, C));
  vt_trim_cache(p.context, p.root, 1, path);
  assert_true(there(&p, A) && !there(&p, C)); // what is asked to stay stays
  close_place(&p);
}

static void what_is_not_ours_is_never_removed(void **state) {
  (void)state;
  place p = open_place();
  put_entry(&p, "photographs", 50, 1000), put_entry(&p, "tree-house", 50, 1000), put_entry(&p, C "0", 50, 1000);
  put_entry(&p, C, 50, 10);
  vt_trim_cache(p.context, p.root, 1, NULL);
  assert_true(there(&p, "photographs") && there(&p, "tree-house") && there(&p, C "0") && !there(&p, C));
  close_place(&p);
}

static void what_killed_runs_left_is_cleared_away(void **state) {
  (void)state;
  place p = open_place();
  char dead[128], living[128], fresh[128];
  pid_t child = fork();
  if (!child) _exit(0);
  assert_int_equal(waitpid(child, NULL, 0), child); // its number is free now
  snprintf(dead, sizeof dead, "%s.tmp.%ld", B, (long)child);
  snprintf(fresh, sizeof fresh, "%s.tmp.%ld", C, (long)child);
  snprintf(living, sizeof living, "%s.tmp.%ld", A, (long)getpid());
  put_entry(&p, dead, 1, 1000), put_entry(&p, living, 1, 1000), put_entry(&p, fresh, 1, 0);
  vt_trim_cache(p.context, p.root, 0, NULL);
  assert_true(!there(&p, dead) && there(&p, living) && there(&p, fresh));
  close_place(&p);
}

static void the_first_of_two_equal_results_stays(void **state) {
  (void)state;
  place p = open_place();
  char made[128], again[128], entry[128], file[160];
  put_entry(&p, "made", 1, 0), put_entry(&p, "again", 2, 0);
  snprintf(made, sizeof made, "%s/made", p.root);
  snprintf(again, sizeof again, "%s/again", p.root);
  snprintf(entry, sizeof entry, "%s/" B, p.root);
  vt_keep_entry(p.context, made, entry);
  vt_keep_entry(p.context, again, entry);
  assert_true(there(&p, B) && !there(&p, "made") && !there(&p, "again"));
  snprintf(file, sizeof file, "%s/data", entry);
  struct stat about;
  assert_int_equal(stat(file, &about), 0);
  assert_int_equal(about.st_size, 1024);
  close_place(&p);
}

// A process that takes the lock and starts another one that lives on for a while.
static pid_t hold_lock(place *p, const char *path, int child_seconds) {
  int ready[2];
  assert_int_equal(pipe(ready), 0);
  pid_t pid = fork();
  if (!pid) {
    vt_lock lock;
    bool taken = vt_try_lock(p->context, path, &lock);
    if (child_seconds && !fork()) {
      sleep((unsigned)child_seconds);
      _exit(0);
    }
    if (write(ready[1], taken ? "y" : "n", 1) != 1) _exit(1);
    for (;;) pause();
  }
  char answer = 0;
  assert_int_equal(read(ready[0], &answer, 1), 1);
  assert_int_equal(answer, 'y');
  close(ready[0]);
  close(ready[1]);
  return pid;
}

static void a_lock_ends_with_its_holder_and_what_that_started(void **state) {
  (void)state;
  place p = open_place();
  char path[128];
  vt_lock lock;
  snprintf(path, sizeof path, "%s/work.lock", p.root);
  pid_t pid = hold_lock(&p, path, 0);
  assert_false(vt_try_lock(p.context, path, &lock));
  kill(pid, SIGKILL);
  waitpid(pid, NULL, 0);
  assert_true(vt_try_lock(p.context, path, &lock));
  vt_drop_lock(p.context, &lock);
  assert_false(vt_is_file(path));
  pid = hold_lock(&p, path, 1);
  kill(pid, SIGKILL);
  waitpid(pid, NULL, 0);
  assert_false(vt_try_lock(p.context, path, &lock)); // the program that it started is still at it
  double start = vt_seconds();
  assert_int_equal(vt_take_lock(p.context, path, "photos", &lock), VT_OK);
  assert_true(vt_seconds() - start < 5);
  vt_drop_lock(p.context, &lock);
  close_place(&p);
}

static void waiting_for_a_lock_can_be_cancelled(void **state) {
  (void)state;
  place p = open_place();
  char path[128];
  vt_lock lock;
  snprintf(path, sizeof path, "%s/work.lock", p.root);
  pid_t pid = hold_lock(&p, path, 0);
  vt_cancel(p.context);
  assert_int_equal(vt_take_lock(p.context, path, "photos", &lock), VT_CANCELLED);
  vt_drop_lock(p.context, &lock);
  kill(pid, SIGKILL);
  waitpid(pid, NULL, 0);
  close_place(&p);
}

static void an_entry_that_a_run_works_on_is_not_removed(void **state) {
  (void)state;
  place p = open_place();
  char path[128];
  put_entry(&p, "work-000000000000000d", 50, 1000);
  snprintf(path, sizeof path, "%s/work-000000000000000d.lock", p.root);
  pid_t pid = hold_lock(&p, path, 0);
  vt_trim_cache(p.context, p.root, 1, NULL);
  assert_true(there(&p, "work-000000000000000d"));
  kill(pid, SIGKILL);
  waitpid(pid, NULL, 0);
  vt_trim_cache(p.context, p.root, 1, NULL);
  assert_false(there(&p, "work-000000000000000d"));
  close_place(&p);
}

static void room_on_a_disk_is_known_for_folders_to_come(void **state) {
  (void)state;
  place p = open_place();
  char path[128];
  snprintf(path, sizeof path, "%s/not/yet/there", p.root);
  assert_true(vt_free_bytes(path) > 0);
  assert_true(vt_free_bytes("relative/not/there") > 0);
  assert_int_equal(vt_folder_bytes(p.context, path), 0);
  assert_true(vt_program_hash() != 0 && vt_program_hash() == vt_program_hash());
  close_place(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_entry_used_longest_ago_goes_first),
      cmocka_unit_test(what_is_not_ours_is_never_removed),
      cmocka_unit_test(what_killed_runs_left_is_cleared_away),
      cmocka_unit_test(the_first_of_two_equal_results_stays),
      cmocka_unit_test(a_lock_ends_with_its_holder_and_what_that_started),
      cmocka_unit_test(waiting_for_a_lock_can_be_cancelled),
      cmocka_unit_test(an_entry_that_a_run_works_on_is_not_removed),
      cmocka_unit_test(room_on_a_disk_is_known_for_folders_to_come),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
