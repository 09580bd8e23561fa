// mesh_text.h - text files of lines, words and numbers (OBJ, MTL)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_MESH_TEXT_H
#define VT_DATASETS_SYNTHETIC_MESH_TEXT_H

#include "base/context.h"

typedef struct vt_text {
  vt_context *context;
  const char *path; // borrowed
  char *begin;      // owned; ends with a zero at `end`
  const char *end;
} vt_text;

// Reads the file; lines end in '\n', whatever they ended in, and continued lines are one.
vt_status vt_open_text(vt_context *, const char *path, vt_text *out);
void vt_close_text(vt_text *);
// VT_BAD_INPUT naming file and line of `at`; `why` is "why; what to do".
vt_status vt_fail_line(const vt_text *, const char *at, const char *why);

const char *vt_next_line(const vt_text *, const char *at); // its first character behind blanks; NULL behind the last
const char *vt_skip_blanks(const char *at);
bool vt_at_line_end(const char *at); // or at a remark
// The word and the blanks behind it, or NULL if another word stands at `at`.
const char *vt_skip_word(const char *at, const char *word);
size_t vt_word_length(const char *at);
// Behind a finite number; NULL if there is none, or other characters hang on it.
const char *vt_scan_number(const char *at, double *value);
// Up to `limit` numbers to the end of the line; -1 where a word is no number or there are more.
int vt_scan_numbers(const char *at, int limit, double *values);

// A number of `digits` (1..15) significant digits, without zeros at the end; at most 32 characters. Returns the end.
char *vt_print_number(char *to, double value, int digits);
char *vt_print_float(char *to, float value); // as many digits as it takes to read the same float back

#endif
