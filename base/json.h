// json.h - reading JSON (jansson; json_none.c refuses) and writing it (our own, always there)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_JSON_H
#define VT_BASE_JSON_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- reading: an immutable value
typedef struct vt_json vt_json;
// Parses UTF-8 text. VT_BAD_INPUT with `name`, line and column. NaN and Infinity are refused as no JSON. Free the root
// with vt_free_json (values got from it go with it).
vt_status vt_parse_json(vt_context *, const char *text, size_t size, const char *name, vt_json **out);
vt_status vt_read_json(vt_context *, const char *path, vt_json **out);
void vt_free_json(vt_context *, vt_json *root);
// NULL or the fallback where the value is NULL, of another kind, or has no such member: chains need no checks.
const vt_json *vt_json_member(const vt_json *object, const char *key);
const vt_json *vt_json_item(const vt_json *array, size_t index);
size_t vt_json_count(const vt_json *array_or_object); // 0 for others
bool vt_json_is_number(const vt_json *);
bool vt_json_is_array(const vt_json *);
double vt_json_number(const vt_json *, double fallback);
const char *vt_json_string(const vt_json *, const char *fallback);
bool vt_json_bool(const vt_json *, bool fallback);

// ---- writing: text grows as you go; commas, indentation and escapes are its care. A NaN or infinity becomes null.
typedef struct vt_json_writer {
  vt_context *context;
  char *text; // NUL-terminated; owned; NULL when memory ran out
  size_t size, capacity;
  int depth;
  bool first, failed;
} vt_json_writer;
vt_json_writer vt_begin_json(vt_context *);
void vt_json_open_object(vt_json_writer *, const char *key_or_null);
void vt_json_close_object(vt_json_writer *);
void vt_json_open_array(vt_json_writer *, const char *key_or_null);
void vt_json_close_array(vt_json_writer *);
void vt_json_put_number(vt_json_writer *, const char *key_or_null, double value); // shortest that reads back the same
void vt_json_put_integer(vt_json_writer *, const char *key_or_null, long long value);
void vt_json_put_string(vt_json_writer *, const char *key_or_null, const char *value);
void vt_json_put_bool(vt_json_writer *, const char *key_or_null, bool value);
void vt_json_put_raw(vt_json_writer *, const char *key_or_null, const char *json_text); // already JSON
// Ends the text. VT_OUT_OF_MEMORY if it could not be kept. The caller frees *text with vt_free.
vt_status vt_end_json(vt_json_writer *, char **text, size_t *size);
void vt_drop_json(vt_json_writer *); // instead of vt_end_json, on an error path

#ifdef __cplusplus
}
#endif
#endif
