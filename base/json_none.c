// json_none.c - reading JSON in builds without jansson: refused
// SPDX-License-Identifier: BSD-3-Clause
#include "base/json.h"

vt_status vt_parse_json(vt_context *context, const char *text, size_t size, const char *name, vt_json **out) {
  (void)text;
  (void)size;
  *out = NULL;
  return vt_fail(context, VT_MISSING_PROGRAM, "%s: this build cannot read JSON; build voltree with jansson", name);
}

vt_status vt_read_json(vt_context *context, const char *path, vt_json **out) {
  return vt_parse_json(context, NULL, 0, path, out);
}

void vt_free_json(vt_context *context, vt_json *root) {
  (void)context;
  (void)root;
}

const vt_json *vt_json_member(const vt_json *object, const char *key) {
  (void)object;
  (void)key;
  return NULL;
}

const vt_json *vt_json_item(const vt_json *array, size_t index) {
  (void)array;
  (void)index;
  return NULL;
}

size_t vt_json_count(const vt_json *value) {
  (void)value;
  return 0;
}

bool vt_json_is_number(const vt_json *value) {
  (void)value;
  return false;
}

bool vt_json_is_array(const vt_json *value) {
  (void)value;
  return false;
}

double vt_json_number(const vt_json *value, double fallback) {
  (void)value;
  return fallback;
}

const char *vt_json_string(const vt_json *value, const char *fallback) {
  (void)value;
  return fallback;
}

bool vt_json_bool(const vt_json *value, bool fallback) {
  (void)value;
  return fallback;
}
