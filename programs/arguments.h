// arguments.h - the command line of a verb: one table gives the parser, the help and the suggestions
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_ARGUMENTS_H
#define VT_PROGRAMS_ARGUMENTS_H

#include "base/context.h"

typedef enum vt_option_kind {
  VT_OPTION_FLAG,       // takes no value
  VT_OPTION_TEXT,       // not empty
  VT_OPTION_LIST,       // texts: may be given several times
  VT_OPTION_INTEGER,    // low..high
  VT_OPTION_NUMBER,     // low..high, finite
  VT_OPTION_CHOICE,     // one of the words of `value`, "a|b|c"
  VT_OPTION_BYTES,      // 4G, 512M, 64K or a number of bytes
  VT_OPTION_DIMENSIONS, // 800x600
  VT_OPTION_BACKGROUND  // none, white, black or R,G,B with 0..255 each
} vt_option_kind;

typedef struct vt_option {
  const char *name; // without the dashes; NULL ends a table
  char letter;      // its short form, or 0
  vt_option_kind kind;
  const char *value; // what stands for the value in the help
  double low, high;  // of integers and numbers
  bool required;
  const char *help;
} vt_option;

#define VT_MAX_OPTIONS 64
#define VT_MAX_OPERANDS 4
#define VT_MAX_TABLES 6
#define VT_MAX_LISTED 32

struct vt_session;
struct vt_arguments;

typedef struct vt_verb {
  const char *name;
  const char *operands; // "PHOTOS|CAPTURE", one word for each
  const char *summary;
  const char *notes; // a paragraph for the help, or ""
  const char *example;
  int operand_count, operand_most; // the last ones may be missing if there may be more; operand_most 0: exactly operand_count
  const vt_option *tables[VT_MAX_TABLES]; // ended by NULL
  vt_status (*run)(struct vt_session *);
} vt_verb;

typedef struct vt_arguments {
  const vt_verb *verb;
  bool help, version;
  int option_count, operand_count;
  const vt_option *options[VT_MAX_OPTIONS];
  const char *values[VT_MAX_OPTIONS]; // by option; NULL where not given; "" of a flag
  const char *operands[VT_MAX_OPERANDS];
  int listed_count;
  struct vt_listed {
    const vt_option *option;
    const char *text;
  } listed[VT_MAX_LISTED]; // the values of lists, in the order in which they were given
  char problem[600]; // the sentence of an error, "what: why, and what to do"
} vt_arguments;

// Reads the words behind the verb. GNU conventions: --name VALUE, --name=VALUE, -o VALUE, -oVALUE, -qv, -- ends the
// options, options and operands in any order, the last of two equal options holds. Every value is checked here.
// VT_BAD_USAGE and out->problem. --help or --version anywhere win over every other trouble.
vt_status vt_parse_arguments(const vt_verb *, int count, char **words, vt_arguments *out);
void vt_print_help(FILE *, const vt_verb *);

// Values by the option's name, which must be one of the verb's (asserted); the fallback where it was not given.
bool vt_given(const vt_arguments *, const char *name);
const char *vt_text_of(const vt_arguments *, const char *name, const char *fallback); // of a list: the last one
const char *vt_listed_of(const vt_arguments *, const char *name, int i); // the i-th value of a list; NULL behind the last
int vt_integer_of(const vt_arguments *, const char *name, int fallback);
double vt_number_of(const vt_arguments *, const char *name, double fallback);
int vt_choice_of(const vt_arguments *, const char *name, int fallback); // index of the word
uint64_t vt_bytes_of(const vt_arguments *, const char *name, uint64_t fallback);
bool vt_dimensions_of(const vt_arguments *, const char *name, int dimensions[2]); // false: not given, untouched
// The colour 0..1 of a background; false, and nothing written, where not given. *none: it is the word "none".
bool vt_background_of(const vt_arguments *, const char *name, float colour[3], bool *none);

// The word of `words[0..count)` nearest to `word` by edit distance, or NULL if none is near enough to be meant.
const char *vt_nearest_word(const char *word, const char *const *words, int count);

#endif
