// byte_codec.h - lossless packing of bytes (zstd; byte_codec_none.c stores only)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_BYTE_CODEC_H
#define VT_BASE_BYTE_CODEC_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

// False in builds without zstd: vt_pack_bytes then answers VT_MISSING_PROGRAM and the caller stores the bytes as they are.
bool vt_can_pack_bytes(void);
// zstd at `level` 1..19; the caller frees *packed with vt_free.
vt_status vt_pack_bytes(vt_context *, const void *bytes, size_t size, int level, uint8_t **packed, size_t *packed_size);
// Unpacks exactly `size` bytes into `out`. VT_BAD_INPUT with `name` if the bytes are damaged or unpack to another size;
// never writes beyond `size`.
vt_status vt_unpack_bytes(vt_context *, const void *packed, size_t packed_size, void *out, size_t size, const char *name);

#ifdef __cplusplus
}
#endif
#endif
