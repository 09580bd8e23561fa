// help.c - the help of a verb, printed from its option tables
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/arguments.h"

#include <string.h>

#define WIDTH 100 // columns of the help
#define INDENT 30 // where the explanations begin

// Words of `text` between the columns `indent` and WIDTH; the cursor stands at `column`.
static void print_wrapped(FILE *file, const char *text, int column, int indent) {
  bool first = true;
  for (; *text; text += strspn(text, " ")) {
    int length = (int)strcspn(text, " ");
    if (!first && column + 1 + length > WIDTH) {
      fprintf(file, "\n%*s", indent, "");
      column = indent;
    } else if (!first) {
      fputc(' ', file);
      column++;
    }
    fprintf(file, "%.*s", length, text);
    column += length;
    text += length;
    first = false;
  }
  fputc('\n', file);
}

static void print_option(FILE *file, const vt_option *option) {
  char left[160];
  snprintf(left, sizeof left, "  %c%c%s --%s%s%s", option->letter ? '-' : ' ', option->letter ? option->letter : ' ',
           option->letter ? "," : " ", option->name, option->kind == VT_OPTION_FLAG ? "" : " ",
           option->kind == VT_OPTION_FLAG ? "" : option->value);
  int column = fprintf(file, "%s", left);
  if (column > INDENT - 2) {
    fputc('\n', file);
    column = 0;
  }
  fprintf(file, "%*s", INDENT - column, "");
  print_wrapped(file, option->help, INDENT, INDENT);
}

void vt_print_help(FILE *file, const vt_verb *verb) {
  fprintf(file, "Usage: voltree %s%s%s", verb->name, *verb->operands ? " " : "", verb->operands);
  for (int t = 0; t < VT_MAX_TABLES && verb->tables[t]; t++)
    for (const vt_option *option = verb->tables[t]; option->name; option++)
      if (option->required) fprintf(file, " -%c %s", option->letter, option->value);
  fprintf(file, " [OPTION...]\n");
  print_wrapped(file, verb->summary, 0, 0);
  if (*verb->notes) {
    fputc('\n', file);
    print_wrapped(file, verb->notes, 0, 0);
  }
  fprintf(file, "\nOptions:\n");
  for (int t = 0; t < VT_MAX_TABLES && verb->tables[t]; t++)
    for (const vt_option *option = verb->tables[t]; option->name; option++) print_option(file, option);
  fprintf(file, "\nExample:\n  %s\n", verb->example);
}
