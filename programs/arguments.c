// arguments.c - parsing the words behind a verb against its option tables
// SPDX-License-Identifier: BSD-3-Clause
//
// getopt_long is a GNU extension that abbreviates names, so that a new option can break an old script, and that knows
// nothing of values. Here a table says what a value may be, everything is checked before any work begins, and no name
// is ever abbreviated. Values stay the strings of argv, checked once and converted where they are asked for.
#include "programs/arguments.h"

#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <string.h>

#ifdef __GNUC__
__attribute__((format(printf, 2, 3)))
#endif
static vt_status
complain(vt_arguments *arguments, const char *format, ...) {
  va_list list;
  va_start(list, format);
  vsnprintf(arguments->problem, sizeof arguments->problem, format, list);
  va_end(list);
  return VT_BAD_USAGE;
}

// ---- values

// Index of `text` among the words of "a|b|c", or -1.
static int find_choice(const char *words, const char *text) {
  size_t length = strlen(text);
  for (int index = 0;; index++) {
    size_t here = strcspn(words, "|");
    if (here == length && !memcmp(words, text, here)) return index;
    if (!words[here]) return -1;
    words += here + 1;
  }
}

static bool read_integer(const char *text, long long *out) {
  char *end;
  errno = 0;
  *out = strtoll(text, &end, 10);
  return *text && !isspace((unsigned char)*text) && !*end && !errno;
}

static bool read_number(const char *text, double *out) {
  char *end;
  *out = strtod(text, &end);
  return *text && !isspace((unsigned char)*text) && !*end && isfinite(*out);
}

static bool read_bytes(const char *text, uint64_t *out) {
  char *end;
  double number = strtod(text, &end);
  static const char units[] = "KMGT";
  if (end == text || isspace((unsigned char)*text)) return false;
  const char *unit = *end ? strchr(units, toupper((unsigned char)*end)) : NULL;
  if (unit) {
    number = ldexp(number, 10 * (int)(unit - units + 1));
    end++;
    if (*end == 'i') end++;
  }
  if (*end == 'B') end++;
  if (*end || !(number >= 1) || number > 1e18) return false;
  *out = (uint64_t)number;
  return true;
}

static bool read_dimensions(const char *text, int out[2]) {
  char *end;
  if (!isdigit((unsigned char)*text)) return false;
  long width = strtol(text, &end, 10);
  if (*end != 'x' || !isdigit((unsigned char)end[1])) return false;
  long height = strtol(end + 1, &end, 10);
  if (*end || width < 1 || height < 1 || width > 16384 || height > 16384) return false;
  out[0] = (int)width;
  out[1] = (int)height;
  return true;
}

static bool read_background(const char *text, float colour[3], bool *none) {
  *none = !strcmp(text, "none");
  if (*none || !strcmp(text, "white") || !strcmp(text, "black")) {
    for (int c = 0; c < 3; c++) colour[c] = !strcmp(text, "white") ? 1.0f : 0.0f;
    return true;
  }
  for (int c = 0; c < 3; c++) {
    char *end;
    if (!isdigit((unsigned char)*text)) return false;
    long value = strtol(text, &end, 10);
    if (value < 0 || value > 255 || *end != (c < 2 ? ',' : '\0')) return false;
    colour[c] = (float)value / 255;
    text = end + 1;
  }
  return true;
}

static vt_status check_value(vt_arguments *arguments, const vt_option *option, const char *text) {
  long long integer;
  double number;
  uint64_t bytes;
  int dimensions[2];
  float colour[3];
  bool none;
  switch (option->kind) {
  case VT_OPTION_FLAG:
    break;
  case VT_OPTION_TEXT:
  case VT_OPTION_LIST:
    if (!*text) return complain(arguments, "--%s: its value is empty; give %s", option->name, option->value);
    break;
  case VT_OPTION_INTEGER:
    if (!read_integer(text, &integer) || (double)integer < option->low || (double)integer > option->high)
      return complain(arguments, "--%s %s: not a whole number from %.0f to %.0f; give one", option->name, text,
                      option->low, option->high);
    break;
  case VT_OPTION_NUMBER:
    if (!read_number(text, &number) || number < option->low || number > option->high)
      return complain(arguments, "--%s %s: not a number from %g to %g; give one", option->name, text, option->low,
                      option->high);
    break;
  case VT_OPTION_CHOICE:
    if (find_choice(option->value, text) < 0)
      return complain(arguments, "--%s %s: no such choice; give one of %s", option->name, text, option->value);
    break;
  case VT_OPTION_BYTES:
    if (!read_bytes(text, &bytes))
      return complain(arguments, "--%s %s: not a size; give it like 4G, 512M or 100000000", option->name, text);
    break;
  case VT_OPTION_DIMENSIONS:
    if (!read_dimensions(text, dimensions))
      return complain(arguments, "--%s %s: not a size in pixels up to 16384; give it like 800x600", option->name, text);
    break;
  case VT_OPTION_BACKGROUND:
    if (!read_background(text, colour, &none))
      return complain(arguments, "--%s %s: not a background; give %s with 0..255 each", option->name, text,
                      option->value);
    break;
  }
  return VT_OK;
}

// ---- suggestions

static int edit_distance(const char *a, const char *b) { // Levenshtein, one row
  int row[64], length = (int)strlen(b);
  if (length >= 64) return INT_MAX;
  for (int j = 0; j <= length; j++) row[j] = j;
  for (int i = 1; a[i - 1]; i++) {
    int diagonal = row[0];
    row[0] = i;
    for (int j = 1; j <= length; j++) {
      int change = diagonal + (a[i - 1] != b[j - 1]), gap = 1 + (row[j] < row[j - 1] ? row[j] : row[j - 1]);
      diagonal = row[j];
      row[j] = change < gap ? change : gap;
    }
  }
  return row[length];
}

const char *vt_nearest_word(const char *word, const char *const *words, int count) {
  const char *best = NULL;
  int best_distance = INT_MAX, limit = 1 + (int)strlen(word) / 3;
  for (int i = 0; i < count; i++) {
    int distance = edit_distance(word, words[i]);
    size_t length = strlen(word);
    if (length >= 3 && !strncmp(word, words[i], length)) distance = 1; // the beginning of a name is meant for it
    if (distance < best_distance) best_distance = distance, best = words[i];
  }
  return best_distance <= limit ? best : NULL;
}

static vt_status complain_unknown(vt_arguments *arguments, const char *word) {
  const char *names[VT_MAX_OPTIONS], *verb = arguments->verb->name;
  for (int i = 0; i < arguments->option_count; i++) names[i] = arguments->options[i]->name;
  const char *nearest = word[1] == '-' ? vt_nearest_word(word + 2, names, arguments->option_count) : NULL;
  if (nearest)
    return complain(arguments, "%s: unknown option of %s; did you mean --%s? (voltree %s --help lists all)", word, verb,
                    nearest, verb);
  return complain(arguments, "%s: unknown option of %s; voltree %s --help lists all", word, verb, verb);
}

// ---- the parser

static int find_name(const vt_arguments *arguments, const char *name, size_t length) {
  for (int i = 0; i < arguments->option_count; i++)
    if (strlen(arguments->options[i]->name) == length && !memcmp(arguments->options[i]->name, name, length)) return i;
  return -1;
}

static int find_letter(const vt_arguments *arguments, char letter) {
  for (int i = 0; i < arguments->option_count; i++)
    if (arguments->options[i]->letter == letter) return i;
  return -1;
}

static vt_status set_value(vt_arguments *arguments, int index, const char *text) {
  arguments->values[index] = text;
  if (arguments->options[index]->kind == VT_OPTION_LIST) {
    if (arguments->listed_count == VT_MAX_LISTED)
      return complain(arguments, "--%s %s: one too many; give at most %d", arguments->options[index]->name, text, VT_MAX_LISTED);
    arguments->listed[arguments->listed_count++] = (struct vt_listed){arguments->options[index], text};
  }
  return check_value(arguments, arguments->options[index], text);
}

// `next` is the word behind this one, or NULL; *used_next says whether it was the value.
static vt_status parse_long(vt_arguments *arguments, char *word, const char *next, bool *used_next) {
  const char *name = word + 2, *equals = strchr(name, '=');
  int index = find_name(arguments, name, equals ? (size_t)(equals - name) : strlen(name));
  if (index < 0) {
    char known[80]; // the option without its value, for the sentence
    snprintf(known, sizeof known, "%.*s", (int)strcspn(word, "="), word);
    return complain_unknown(arguments, known);
  }
  const vt_option *option = arguments->options[index];
  if (option->kind == VT_OPTION_FLAG) {
    if (equals) return complain(arguments, "--%s: takes no value; leave out %s", option->name, equals);
    return set_value(arguments, index, "");
  }
  if (equals) return set_value(arguments, index, equals + 1);
  if (!next) return complain(arguments, "--%s: its value is missing; give %s", option->name, option->value);
  *used_next = true;
  return set_value(arguments, index, next);
}

static vt_status parse_letters(vt_arguments *arguments, char *word, const char *next, bool *used_next) {
  for (const char *at = word + 1; *at; at++) {
    int index = find_letter(arguments, *at);
    if (index < 0) {
      char known[3] = {'-', *at, 0};
      return complain_unknown(arguments, known);
    }
    const vt_option *option = arguments->options[index];
    if (option->kind != VT_OPTION_FLAG) {
      if (at[1]) return set_value(arguments, index, at + 1);
      if (!next) return complain(arguments, "-%c: its value is missing; give %s", *at, option->value);
      *used_next = true;
      return set_value(arguments, index, next);
    }
    set_value(arguments, index, "");
  }
  return VT_OK;
}

static vt_status check_complete(vt_arguments *arguments) {
  const vt_verb *verb = arguments->verb;
  if (arguments->operand_count < verb->operand_count) {
    const char *missing = verb->operands;
    for (int i = 0; i < arguments->operand_count; i++) missing += strcspn(missing, " ") + 1;
    return complain(arguments, "%s: %.*s is missing; for example: %s", verb->name, (int)strcspn(missing, " "), missing,
                    verb->example);
  }
  for (int i = 0; i < arguments->option_count; i++) {
    const vt_option *option = arguments->options[i];
    if (!option->required || arguments->values[i]) continue;
    return complain(arguments, "%s: -%c %s is missing; for example: %s", verb->name, option->letter, option->value,
                    verb->example);
  }
  return VT_OK;
}

vt_status vt_parse_arguments(const vt_verb *verb, int count, char **words, vt_arguments *out) {
  *out = (vt_arguments){.verb = verb};
  for (int t = 0; t < VT_MAX_TABLES && verb->tables[t]; t++)
    for (const vt_option *option = verb->tables[t]; option->name; option++) {
      VT_ASSERT(out->option_count < VT_MAX_OPTIONS);
      out->options[out->option_count++] = option;
    }
  for (int i = 0; i < count && strcmp(words[i], "--"); i++) {
    out->help |= !strcmp(words[i], "--help") || !strcmp(words[i], "-h");
    out->version |= !strcmp(words[i], "--version");
  }
  if (out->help || out->version) return VT_OK;
  bool only_operands = false;
  int most = verb->operand_most > verb->operand_count ? verb->operand_most : verb->operand_count;
  VT_ASSERT(most <= VT_MAX_OPERANDS);
  for (int i = 0; i < count; i++) {
    char *word = words[i];
    const char *next = i + 1 < count ? words[i + 1] : NULL;
    bool used_next = false;
    vt_status status = VT_OK;
    if (!only_operands && !strcmp(word, "--")) {
      only_operands = true;
    } else if (!only_operands && word[0] == '-' && word[1] == '-') {
      status = parse_long(out, word, next, &used_next);
    } else if (!only_operands && word[0] == '-' && word[1]) {
      status = parse_letters(out, word, next, &used_next);
    } else if (!*word) {
      status = complain(out, "%s: an empty name was given; give %s", verb->name, verb->operands);
    } else if (out->operand_count >= most) {
      status = complain(out, "%s: one name too many for %s; it takes %s", word, verb->name, verb->operands);
    } else {
      out->operands[out->operand_count++] = word;
    }
    if (status) return status;
    i += used_next;
  }
  return check_complete(out);
}

// ---- what was given

static const char *value_of(const vt_arguments *arguments, const char *name, vt_option_kind kind) {
  int index = find_name(arguments, name, strlen(name));
  VT_ASSERT(index >= 0 && arguments->options[index]->kind == kind);
  return arguments->values[index];
}

bool vt_given(const vt_arguments *arguments, const char *name) {
  int index = find_name(arguments, name, strlen(name));
  VT_ASSERT(index >= 0);
  return arguments->values[index] != NULL;
}

const char *vt_text_of(const vt_arguments *arguments, const char *name, const char *fallback) {
  int index = find_name(arguments, name, strlen(name));
  bool list = index >= 0 && arguments->options[index]->kind == VT_OPTION_LIST;
  const char *text = value_of(arguments, name, list ? VT_OPTION_LIST : VT_OPTION_TEXT);
  return text ? text : fallback;
}

const char *vt_listed_of(const vt_arguments *arguments, const char *name, int i) {
  value_of(arguments, name, VT_OPTION_LIST); // asserts the name
  for (int k = 0; k < arguments->listed_count; k++)
    if (!strcmp(arguments->listed[k].option->name, name) && i-- == 0) return arguments->listed[k].text;
  return NULL;
}

int vt_integer_of(const vt_arguments *arguments, const char *name, int fallback) {
  const char *text = value_of(arguments, name, VT_OPTION_INTEGER);
  return text ? (int)strtol(text, NULL, 10) : fallback;
}

double vt_number_of(const vt_arguments *arguments, const char *name, double fallback) {
  const char *text = value_of(arguments, name, VT_OPTION_NUMBER);
  return text ? strtod(text, NULL) : fallback;
}

int vt_choice_of(const vt_arguments *arguments, const char *name, int fallback) {
  const char *text = value_of(arguments, name, VT_OPTION_CHOICE);
  return text ? find_choice(arguments->options[find_name(arguments, name, strlen(name))]->value, text) : fallback;
}

uint64_t vt_bytes_of(const vt_arguments *arguments, const char *name, uint64_t fallback) {
  const char *text = value_of(arguments, name, VT_OPTION_BYTES);
  uint64_t bytes = fallback;
  if (text) read_bytes(text, &bytes);
  return bytes;
}

bool vt_dimensions_of(const vt_arguments *arguments, const char *name, int dimensions[2]) {
  const char *text = value_of(arguments, name, VT_OPTION_DIMENSIONS);
  return text && read_dimensions(text, dimensions);
}

bool vt_background_of(const vt_arguments *arguments, const char *name, float colour[3], bool *none) {
  const char *text = value_of(arguments, name, VT_OPTION_BACKGROUND);
  return text && read_background(text, colour, none);
}
