// child_process.h - running another program and reading what it says
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_CHILD_PROCESS_H
#define VT_BASE_CHILD_PROCESS_H

#include "base/context.h"
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef void (*vt_line_function)(void *user, const char *line); // without its newline

// Runs arguments[0], found on PATH, with no input and no display, and waits for its end; every line that it writes to
// its output or its errors goes to `hear` and, unless it is NULL, to `log`. *exit_code is 128 + the signal's number
// if a signal ended it. VT_MISSING_PROGRAM (without a sentence) if there is no such program; VT_CANCELLED after the
// program and what it started were ended; VT_FAILED naming it.
vt_status vt_run_program(vt_context *, char *const arguments[], FILE *log, vt_line_function hear, void *user,
                         int *exit_code);
// The same, but the program and what it started are ended after so many seconds; *exit_code is then VT_OUT_OF_TIME.
#define VT_OUT_OF_TIME (-1)
vt_status vt_run_program_within(vt_context *, char *const arguments[], double seconds, FILE *log, vt_line_function hear,
                                void *user, int *exit_code);

#ifdef __cplusplus
}
#endif
#endif
