// json_jansson.c - reading JSON with jansson
// SPDX-License-Identifier: BSD-3-Clause
//
// A vt_json is a json_t under another name; values below the root are borrowed from it. Whole numbers are read as
// doubles, as every other program of this field does, so a whole number of any size is legal. jansson itself bounds the
// depth (2048), checks UTF-8, refuses NaN, Infinity and zero characters, and reads numbers right in any locale.
#include "base/json.h"

#include "base/file.h"
#include <jansson.h>
#include <string.h>

static const json_t *inside(const vt_json *value) {
  return (const json_t *)value;
}
static const vt_json *outside(const json_t *value) {
  return (const vt_json *)value;
}

vt_status vt_parse_json(vt_context *context, const char *text, size_t size, const char *name, vt_json **out) {
  json_error_t error = {.text = ""};
  *out = NULL;
  if (size >= 3 && !memcmp(text, "\xef\xbb\xbf", 3)) { // some editors put a byte order mark in front
    text += 3;
    size -= 3;
  }
  json_t *root = json_loadb(text, size, JSON_DECODE_ANY | JSON_DECODE_INT_AS_REAL, &error);
  if (!root && json_error_code(&error) == json_error_out_of_memory)
    return vt_fail(context, VT_OUT_OF_MEMORY, "%s: the system has no memory to read it; close other programs", name);
  if (!root)
    return vt_fail(context, VT_BAD_INPUT, "%s: line %d, column %d: not valid JSON (%s); correct it there", name,
                   error.line, error.column, error.text);
  *out = (vt_json *)root;
  return VT_OK;
}

vt_status vt_read_json(vt_context *context, const char *path, vt_json **out) {
  uint8_t *bytes;
  size_t size;
  *out = NULL;
  vt_status status = vt_read_file(context, path, &bytes, &size);
  if (!status) status = vt_parse_json(context, (const char *)bytes, size, path, out);
  vt_free(context, bytes);
  return status;
}

void vt_free_json(vt_context *context, vt_json *root) {
  (void)context;
  json_decref((json_t *)root);
}

const vt_json *vt_json_member(const vt_json *object, const char *key) {
  return outside(json_object_get(inside(object), key)); // NULL for all that is no object
}

const vt_json *vt_json_item(const vt_json *array, size_t index) {
  return outside(json_array_get(inside(array), index));
}

size_t vt_json_count(const vt_json *value) {
  return json_is_object(inside(value)) ? json_object_size(inside(value)) : json_array_size(inside(value));
}

bool vt_json_is_number(const vt_json *value) {
  return json_is_number(inside(value));
}

bool vt_json_is_array(const vt_json *value) {
  return json_is_array(inside(value));
}

double vt_json_number(const vt_json *value, double fallback) {
  return json_is_number(inside(value)) ? json_number_value(inside(value)) : fallback;
}

const char *vt_json_string(const vt_json *value, const char *fallback) {
  return json_is_string(inside(value)) ? json_string_value(inside(value)) : fallback;
}

bool vt_json_bool(const vt_json *value, bool fallback) {
  return json_is_boolean(inside(value)) ? json_is_true(inside(value)) : fallback;
}
