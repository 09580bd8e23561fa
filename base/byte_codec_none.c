// byte_codec_none.c - packing of bytes in builds without zstd: the caller stores them as they are
// SPDX-License-Identifier: BSD-3-Clause
#include "base/byte_codec.h"

bool vt_can_pack_bytes(void) {
  return false;
}

vt_status vt_pack_bytes(vt_context *context, const void *bytes, size_t size, int level, uint8_t **packed,
                        size_t *packed_size) {
  (void)bytes;
  (void)level;
  *packed = NULL;
  *packed_size = 0;
  return vt_fail(context, VT_MISSING_PROGRAM, "%zu bytes: this build cannot pack them; build voltree with zstd", size);
}

vt_status vt_unpack_bytes(vt_context *context, const void *packed, size_t packed_size, void *out, size_t size,
                          const char *name) {
  (void)packed;
  (void)packed_size;
  (void)out;
  (void)size;
  return vt_fail(context, VT_MISSING_PROGRAM,
                 "%s: is packed with zstd, which this build lacks; build voltree with zstd", name);
}
