// status.h - what a call that can meet trouble in the world returns
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_STATUS_H
#define VT_BASE_STATUS_H

#include <stdio.h>
#include <stdlib.h>

#ifdef __cplusplus
extern "C" {
#endif

// Three tiers of error, never mixed: trouble in the world is a vt_status and a sentence (vt_last_error); a caller's bug
// is a VT_ASSERT; a bug of our own is a VT_VALIDATE. Untrusted bytes are never asserted.
// The values are the exit codes of the program.
typedef enum vt_status {
  VT_OK = 0,
  VT_FAILED = 1,          // could not be done: disk full, read-only folder, a driver that refuses
  VT_BAD_USAGE = 2,       // the command line is wrong
  VT_BAD_INPUT = 3,       // a file or folder that cannot be used
  VT_TOO_FEW_VIEWS = 4,   // fewer than 3 photographs could be registered
  VT_MISSING_PROGRAM = 5, // an external program or an optional part of the build is missing
  VT_OUT_OF_MEMORY = 6,   // over --max-memory, or the system has no more
  VT_BELOW_QUALITY = 7,   // a requested quality was not reached
  VT_CANCELLED = 130      // interrupted
} vt_status;

#define VT_ASSERT(condition)                                                                                           \
  ((condition) ? (void)0                                                                                               \
               : (fprintf(stderr, "voltree: %s:%d: broken contract: %s\n", __FILE__, __LINE__, #condition), abort()))

#ifdef VT_VALIDATION // presets dev and tsan
#define VT_VALIDATE(condition) VT_ASSERT(condition)
#else
#define VT_VALIDATE(condition) ((void)sizeof(condition))
#endif

#ifdef __cplusplus
}
#endif
#endif
