// base64.h - bytes as printable text (RFC 4648) and back
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_BASE64_H
#define VT_BASE_BASE64_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

// Padded text without line breaks, NUL-terminated. NULL only without memory. Free with vt_free.
char *vt_base64_encode(vt_context *, const void *bytes, size_t size);
// Padding at the end may be missing, nothing else: VT_BAD_INPUT naming `name` and the character where another alphabet,
// a line break or bits behind the last byte stand. One zero byte behind *bytes is not counted. Free *bytes with
// vt_free.
vt_status vt_base64_decode(vt_context *, const char *text, size_t length, const char *name, uint8_t **bytes,
                           size_t *size);

#ifdef __cplusplus
}
#endif
#endif
