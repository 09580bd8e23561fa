// unit.h - cmocka, or the few of its macros that our tests use where there is only a C compiler
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_UNIT_H
#define VT_TESTS_UNIT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Address and thread sanitizers look for other things than numbers and make everything some times slower: where they are on,
// tests that measure leave out cases that run the same code once more.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VT_UNIT_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define VT_UNIT_SANITIZED 1
#endif
#endif
#ifndef VT_UNIT_SANITIZED
#define VT_UNIT_SANITIZED 0
#endif

#ifdef VT_WITH_CMOCKA
#include <cmocka.h>
// The thread sanitizer makes everything many times slower, and what runs on one thread has nothing to show it: where it is on,
// only the tests of this program whose names speak of threads are run.
#ifdef __SANITIZE_THREAD__
#define only_threads_for_the_thread_sanitizer() cmocka_set_test_filter("*thread*")
#else
#define only_threads_for_the_thread_sanitizer() ((void)0)
#endif
#else
#define only_threads_for_the_thread_sanitizer() ((void)0)

typedef struct CMUnitTest { const char *name; void (*run)(void **); } CMUnitTest;
#define cmocka_unit_test(f) {#f, f}
static jmp_buf vt_unit_escape;
static void vt_unit_fail(const char *file, int line, const char *what) {
  printf("%s:%d: %s\n", file, line, what);
  longjmp(vt_unit_escape, 1);
}
#define assert_true(c) ((c) ? (void)0 : vt_unit_fail(__FILE__, __LINE__, #c))
#define assert_false(c) assert_true(!(c))
#define assert_int_equal(a, b) assert_true((long long)(a) == (long long)(b))
#define assert_int_not_equal(a, b) assert_true((long long)(a) != (long long)(b))
#define assert_null(p) assert_true(!(p))
#define assert_non_null(p) assert_true(p)
#define assert_string_equal(a, b) assert_true(!strcmp((a), (b)))
#define assert_memory_equal(a, b, n) assert_true(!memcmp((a), (b), (n)))
#define assert_memory_not_equal(a, b, n) assert_true(memcmp((a), (b), (n)) != 0)
#define assert_in_range(v, lo, hi) assert_true((v) >= (lo) && (v) <= (hi))
#define fail_msg(...) (printf(__VA_ARGS__), vt_unit_fail(__FILE__, __LINE__, "failed"))
#define skip() longjmp(vt_unit_escape, 2)
#define cmocka_run_group_tests(tests, s, t) vt_unit_run(tests, sizeof(tests) / sizeof(tests[0]))
static int vt_unit_run(const CMUnitTest *tests, size_t count) {
  volatile int failed = 0; // survives longjmp
  for (size_t i = 0; i < count; i++) {
    void *state = NULL;
    int how = setjmp(vt_unit_escape);
    if (!how) tests[i].run(&state);
    printf("[ %s ] %s\n", how == 0 ? "OK" : how == 2 ? "SKIPPED" : "FAILED", tests[i].name);
    failed += how == 1;
  }
  return failed;
}
#endif

// |a - b| <= tolerance, with the values shown when it is not so
#define assert_close(a, b, tolerance)                                                                                  \
  do {                                                                                                                 \
    double close_a = (a), close_b = (b), close_t = (tolerance);                                                        \
    if (!(fabs(close_a - close_b) <= close_t)) {                                                                       \
      printf("%s:%d: %s = %.9g is not %s = %.9g within %g\n", __FILE__, __LINE__, #a, close_a, #b, close_b, close_t);  \
      assert_true(0);                                                                                                  \
    }                                                                                                                  \
  } while (0)

#endif
