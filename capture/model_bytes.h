// model_bytes.h - a cursor over a file of a COLMAP model that never passes its end
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_MODEL_BYTES_H
#define VT_CAPTURE_MODEL_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_cursor {
  uint8_t *bytes; // with a zero behind the last one, where vt_read_file put it
  size_t size, at;
  bool short_read; // something was asked for beyond the end
} vt_cursor;

// ---- binary

static inline uint64_t vt_take(vt_cursor *c, size_t bytes) { // little-endian, up to 8 bytes; 0 beyond the end
  uint64_t value = 0;
  if (c->size - c->at < bytes) {
    c->short_read = true;
    c->at = c->size;
    return 0;
  }
  for (size_t i = 0; i < bytes; i++) value |= (uint64_t)c->bytes[c->at + i] << (8 * i);
  c->at += bytes;
  return value;
}

static inline double vt_take_double(vt_cursor *c) {
  uint64_t bits = vt_take(c, 8);
  double value;
  memcpy(&value, &bits, 8);
  return value;
}

static inline void vt_pass(vt_cursor *c, uint64_t count, uint64_t bytes) { // bytes is small
  if (count > (c->size - c->at) / bytes) {
    c->short_read = true;
    c->at = c->size;
  } else {
    c->at += (size_t)(count * bytes);
  }
}

// The text up to the next zero; NULL where there is none.
static inline const char *vt_take_name(vt_cursor *c) {
  const char *name = (const char *)c->bytes + c->at;
  const uint8_t *end = (const uint8_t *)memchr(name, 0, c->size - c->at);
  if (c->short_read || !end) return NULL;
  c->at = (size_t)(end - c->bytes) + 1;
  return name;
}

// ---- text

// The next line, cut at its end; NULL behind the last one.
static inline char *vt_take_line(vt_cursor *c) {
  if (c->at >= c->size) return NULL;
  char *line = (char *)c->bytes + c->at, *end = (char *)memchr(line, '\n', c->size - c->at);
  c->at = end ? (size_t)(end - (char *)c->bytes) + 1 : c->size;
  if (!end) end = (char *)c->bytes + c->size;
  *end = 0;
  while (end > line && strchr(" \t\r", end[-1])) *--end = 0;
  return line + strspn(line, " \t");
}

// The next line that is neither empty nor a comment.
static inline char *vt_take_data_line(vt_cursor *c) {
  char *line;
  do line = vt_take_line(c);
  while (line && (!*line || *line == '#'));
  return line;
}

// `count` numbers; false if there are fewer. *text moves behind them.
static inline bool vt_take_numbers(char **text, int count, double *out) {
  for (int i = 0; i < count; i++) {
    char *end;
    out[i] = strtod(*text, &end);
    if (end == *text || (*end && *end != ' ' && *end != '\t')) return false;
    *text = end + strspn(end, " \t");
  }
  return true;
}

#ifdef __cplusplus
}
#endif
#endif
