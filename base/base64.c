// base64.c - bytes as printable text (RFC 4648) and back
// SPDX-License-Identifier: BSD-3-Clause
//
// Three bytes are four digits of six bits. A last group of one or two bytes has two or three digits, filled up with
// '='. What those digits hold beyond their bytes must be zero: one text for the same bytes, so that a changed one is
// seen.
#include "base/base64.h"

static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

char *vt_base64_encode(vt_context *context, const void *bytes, size_t size) {
  const uint8_t *from = bytes;
  char *text = vt_alloc(context, size / 3 + 2, 4), *to = text; // one group for what is left, one for the final zero
  if (!text) return NULL;
  for (; size >= 3; size -= 3, from += 3) {
    uint32_t group = (uint32_t)from[0] << 16 | (uint32_t)from[1] << 8 | from[2];
    for (int shift = 18; shift >= 0; shift -= 6) *to++ = digits[group >> shift & 63];
  }
  if (size) {
    uint32_t group = (uint32_t)from[0] << 16 | (size == 2 ? (uint32_t)from[1] << 8 : 0);
    *to++ = digits[group >> 18];
    *to++ = digits[group >> 12 & 63];
    *to++ = size == 2 ? digits[group >> 6 & 63] : '=';
    *to++ = '=';
  }
  *to = 0;
  return text;
}

static int value_of(char c) { // -1: no digit
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

vt_status vt_base64_decode(vt_context *context, const char *text, size_t length, const char *name, uint8_t **bytes,
                           size_t *size) {
  *bytes = NULL;
  *size = 0;
  size_t whole = length;
  for (int i = 0; i < 2 && length && whole % 4 == 0 && text[length - 1] == '='; i++) length--;
  if (length % 4 == 1)
    return vt_fail(context, VT_BAD_INPUT, "%s: base64 text of %zu characters ends within a byte; write it again", name,
                   length);
  uint8_t *out = vt_alloc(context, length / 4 * 3 + 4, 1), *to = out;
  if (!out) return VT_OUT_OF_MEMORY;
  uint32_t group = 0;
  int bits = 0;
  for (size_t i = 0; i < length; i++) {
    int value = value_of(text[i]);
    if (value < 0) {
      vt_free(context, out);
      return vt_fail(context, VT_BAD_INPUT, "%s: character %zu is no base64; write it again", name, i + 1);
    }
    group = group << 6 | (uint32_t)value;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    *to++ = (uint8_t)(group >> bits);
    group &= (1u << bits) - 1;
  }
  if (group) {
    vt_free(context, out);
    return vt_fail(context, VT_BAD_INPUT, "%s: base64 text has bits behind its last byte; write it again", name);
  }
  *bytes = out;
  *size = (size_t)(to - out);
  return VT_OK;
}
