// test_base_child_process.c - programs that are run: what they say, how they end, and that they can be ended
// SPDX-License-Identifier: BSD-3-Clause
#include "base/child_process.h"
#include "tests/unit.h"

#include <unistd.h>

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1, desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

static void hear(void *user, const char *line) {
  strcat(user, line);
  strcat(user, "|");
}

static int run_shell(vt_context *context, const char *script, double seconds, char *said) {
  char *arguments[] = {"sh", "-c", (char *)script, NULL};
  int code = 999;
  *said = 0;
  assert_int_equal(vt_run_program_within(context, arguments, seconds, NULL, hear, said, &code), VT_OK);
  return code;
}

static void lines_and_exit_codes_arrive(void **state) {
  (void)state;
  vt_context *context = make_context();
  char said[1000];
  assert_int_equal(run_shell(context, "echo one; echo two >&2; exit 5", 60, said), 5);
  assert_string_equal(said, "one|two|");
  assert_int_equal(run_shell(context, "kill -9 $$", 60, said), 128 + 9);
  char *missing[] = {"/nowhere/at/all", NULL};
  int code;
  assert_int_equal(vt_run_program(context, missing, NULL, NULL, NULL, &code), VT_MISSING_PROGRAM);
  vt_destroy_context(context);
}

static void programs_that_hang_are_ended_with_what_they_started(void **state) {
  (void)state;
  vt_context *context = make_context();
  char said[1000];
  static const char *const scripts[] = {"echo $$; sleep 100",                          // says nothing more
                                        "echo $$; exec sleep 100 >/dev/null 2>&1",     // closes its output
                                        "echo $$; trap '' TERM; sleep 100; sleep 100", // does not listen
                                        "echo $$; sleep 100 & exit 0"}; // leaves a child that holds the output
  for (size_t i = 0; i < sizeof scripts / sizeof *scripts; i++) {
    double start = vt_seconds();
    assert_int_equal(run_shell(context, scripts[i], 0.3, said), VT_OUT_OF_TIME);
    assert_true(vt_seconds() - start < 20);
    char command[200];
    snprintf(command, sizeof command, "test -z \"$(ps -e -o pgid=,stat= | awk '$1 == %d && $2 !~ /^Z/')\"", atoi(said));
    if (system("command -v ps >/dev/null") == 0) assert_int_equal(system(command), 0);
  }
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(lines_and_exit_codes_arrive),
      cmocka_unit_test(programs_that_hang_are_ended_with_what_they_started),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
