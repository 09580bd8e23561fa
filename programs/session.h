// session.h - one run of the program: its context, its common options, its stages and what it says
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_SESSION_H
#define VT_PROGRAMS_SESSION_H

#include "programs/arguments.h"

#define VT_MAX_STAGES 48
#define VT_CACHE_BYTES 10000000000u // of the cache, where --cache-size was not given

typedef struct vt_stage_note {
  char name[40];
  double seconds;
  uint64_t peak_bytes; // held by vt_alloc; 0 where it was not taken
} vt_stage_note;

typedef struct vt_session {
  vt_context *context;
  vt_arguments arguments;
  bool quiet;         // no readable results on stdout: --quiet, or the JSON goes there
  const char *json;   // file, "-" or NULL
  const char *report; // folder or NULL
  const char *probe;  // folder or NULL
  const char *cache;  // folder or NULL
  char cache_text[1024];
  double start, stage_start;
  uint64_t peak_bytes;
  int stage_count;
  vt_stage_note stages[VT_MAX_STAGES];
  char *said; // everything that was said, for the report; owned
  size_t said_size, said_capacity;
} vt_session;

// Reads the common options, makes the folders of --report and --probe, and the context. A sentence in problem (of
// `size` characters) if that fails.
vt_status vt_begin_session(vt_session *, char *problem, size_t size);
void vt_end_session(vt_session *);

// A readable result on stdout, unless quiet; kept for the report.
#ifdef __GNUC__
__attribute__((format(printf, 2, 3)))
#endif
void vt_say(vt_session *, const char *format, ...);

// Wall time and highest vt_alloc between the two calls, noted under `name`.
void vt_begin_stage(vt_session *);
void vt_end_stage(vt_session *, const char *name);
// A stage that was measured by someone else, peak 0 if unknown.
void vt_note_stage(vt_session *, const char *name, double seconds, uint64_t peak_bytes);

// Can a file (or a folder) of that name be made? Tried before the long work: VT_FAILED with the cure.
vt_status vt_check_output_file(vt_session *, const char *path);
vt_status vt_check_output_folder(vt_session *, const char *path);

// "png", or "pam" in builds that cannot write PNG.
const char *vt_picture_ending(void);
// A printed path that vt_free frees.
#ifdef __GNUC__
__attribute__((format(printf, 2, 3)))
#endif
char *
vt_print_text(vt_context *, const char *format, ...);
// "train/r_0.png" -> "train_r_0": a name that can stand in a file name of the report.
void vt_plain_name(const char *name, char *out, size_t size);

#endif
