// json_writer.c - writing JSON text, always there
// SPDX-License-Identifier: BSD-3-Clause
//
// No stack of open brackets is kept: a key says that we are in an object, none that we are in an array, and the last
// character written says what a closing bracket ends. Members stand on lines of their own; plain items of an array
// share one line, objects and arrays in an array have their own, so that a matrix is written row by row. The text is
// valid whatever comes in: bytes that are no UTF-8 (file names in old encodings) become U+FFFD.
#include "base/json.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

static void put_bytes(vt_json_writer *writer, const char *bytes, size_t size) {
  if (writer->failed) return;
  if (size >= writer->capacity - writer->size) { // one byte stays for the final zero
    size_t capacity = writer->capacity;
    while (capacity <= SIZE_MAX / 2 && size >= capacity - writer->size) capacity *= 2;
    char *text = vt_realloc(writer->context, writer->text, capacity, 1);
    if (!text || size >= capacity - writer->size) {
      vt_free(writer->context, text ? text : writer->text);
      writer->text = NULL;
      writer->failed = true;
      return;
    }
    writer->text = text;
    writer->capacity = capacity;
  }
  memcpy(writer->text + writer->size, bytes, size);
  writer->size += size;
  writer->text[writer->size] = 0;
}

static void put_text(vt_json_writer *writer, const char *text) {
  put_bytes(writer, text, strlen(text));
}

static void put_line(vt_json_writer *writer) {
  put_bytes(writer, "\n", 1);
  for (int i = 0; i < writer->depth; i++) put_bytes(writer, "  ", 2);
}

// Length of the UTF-8 sequence at `s` (well-formed, shortest, no surrogate), or 0.
static size_t measure_utf8(const unsigned char *s) {
  if (s[0] < 0x80) return 1;
  size_t length = s[0] >= 0xc2 && s[0] < 0xe0 ? 2 : (s[0] & 0xf0) == 0xe0 ? 3 : s[0] >= 0xf0 && s[0] < 0xf5 ? 4 : 0;
  for (size_t i = 1; i < length; i++)
    if ((s[i] & 0xc0) != 0x80) return 0; // the final zero ends here too
  if (s[0] == 0xe0 && s[1] < 0xa0) return 0;
  if (s[0] == 0xed && s[1] >= 0xa0) return 0;
  if (s[0] == 0xf0 && s[1] < 0x90) return 0;
  if (s[0] == 0xf4 && s[1] >= 0x90) return 0;
  return length;
}

static void put_quoted(vt_json_writer *writer, const char *value) {
  const unsigned char *s = (const unsigned char *)value;
  put_bytes(writer, "\"", 1);
  while (*s) {
    size_t length = measure_utf8(s);
    if (!length) {
      put_text(writer, "\xef\xbf\xbd");
      s++;
      continue;
    }
    if (*s < 0x20 || *s == 0x7f) {
      char code[8];
      snprintf(code, sizeof code, *s == '\n' ? "\\n" : *s == '\t' ? "\\t" : "\\u%04x", *s);
      put_text(writer, code);
    } else {
      if (*s == '"' || *s == '\\') put_bytes(writer, "\\", 1);
      put_bytes(writer, (const char *)s, length);
    }
    s += length;
  }
  put_bytes(writer, "\"", 1);
}

// All that stands in front of a value.
static void begin_value(vt_json_writer *writer, const char *key, bool is_container) {
  if (!writer->first) put_bytes(writer, ",", 1);
  if (writer->depth && (key || is_container))
    put_line(writer);
  else if (!writer->first)
    put_bytes(writer, " ", 1);
  writer->first = false;
  if (!key) return;
  VT_ASSERT(writer->depth > 0);
  put_quoted(writer, key);
  put_bytes(writer, ": ", 2);
}

static void open_container(vt_json_writer *writer, const char *key, const char *bracket) {
  begin_value(writer, key, true);
  put_text(writer, bracket);
  writer->depth++;
  writer->first = true;
}

vt_json_writer vt_begin_json(vt_context *context) {
  vt_json_writer writer = {.context = context, .capacity = 256, .first = true};
  writer.text = vt_alloc(context, writer.capacity, 1);
  writer.failed = !writer.text;
  return writer;
}

void vt_json_open_object(vt_json_writer *writer, const char *key) {
  open_container(writer, key, "{");
}

void vt_json_open_array(vt_json_writer *writer, const char *key) {
  open_container(writer, key, "[");
}

void vt_json_close_object(vt_json_writer *writer) {
  VT_ASSERT(writer->depth > 0);
  writer->depth--;
  if (!writer->first) put_line(writer);
  put_bytes(writer, "}", 1);
  writer->first = false;
}

void vt_json_close_array(vt_json_writer *writer) {
  VT_ASSERT(writer->depth > 0);
  writer->depth--;
  char last = writer->failed ? 0 : writer->text[writer->size - 1];
  if (!writer->first && (last == '}' || last == ']')) put_line(writer);
  put_bytes(writer, "]", 1);
  writer->first = false;
}

void vt_json_put_number(vt_json_writer *writer, const char *key, double value) {
  char text[48] = "null";
  for (int digits = 15; isfinite(value) && digits <= 17; digits++) {
    snprintf(text, sizeof text, "%.*g", digits, value);
    if (strtod(text, NULL) == value) break;
  }
  // Some locales write the decimal point as a comma, or as several bytes.
  char *end = text;
  for (const char *s = text; isfinite(value) && *s; s++) {
    if (strchr("0123456789+-e", *s))
      *end++ = *s;
    else if (end == text || end[-1] != '.')
      *end++ = '.';
  }
  if (isfinite(value)) *end = 0;
  begin_value(writer, key, false);
  put_text(writer, text);
}

void vt_json_put_integer(vt_json_writer *writer, const char *key, long long value) {
  char text[32];
  snprintf(text, sizeof text, "%lld", value);
  begin_value(writer, key, false);
  put_text(writer, text);
}

void vt_json_put_string(vt_json_writer *writer, const char *key, const char *value) {
  begin_value(writer, key, false);
  if (value)
    put_quoted(writer, value);
  else
    put_text(writer, "null");
}

void vt_json_put_bool(vt_json_writer *writer, const char *key, bool value) {
  begin_value(writer, key, false);
  put_text(writer, value ? "true" : "false");
}

void vt_json_put_raw(vt_json_writer *writer, const char *key, const char *json_text) {
  size_t size = strlen(json_text);
  while (size && strchr(" \t\r\n", json_text[size - 1])) size--;
  begin_value(writer, key, json_text[0] == '{' || json_text[0] == '[');
  put_bytes(writer, json_text, size);
}

vt_status vt_end_json(vt_json_writer *writer, char **text, size_t *size) {
  VT_ASSERT(writer->depth == 0);
  put_bytes(writer, "\n", 1);
  *text = writer->text;
  *size = writer->failed ? 0 : writer->size;
  vt_status status = writer->failed ? VT_OUT_OF_MEMORY : VT_OK;
  *writer = (vt_json_writer){.failed = true};
  return status;
}

void vt_drop_json(vt_json_writer *writer) {
  vt_free(writer->context, writer->text);
  *writer = (vt_json_writer){.failed = true};
}
