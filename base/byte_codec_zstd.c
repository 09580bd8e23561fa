// byte_codec_zstd.c - lossless packing of bytes with zstd, one frame a block
// SPDX-License-Identifier: BSD-3-Clause
//
// The frame states its unpacked size, which is compared with what the caller expects before anything is unpacked; bytes
// behind the frame are damage. A frame's window is never allocated: the whole output is there, and zstd keeps to it.
#include "base/byte_codec.h"

#include <zstd.h>

bool vt_can_pack_bytes(void) {
  return true;
}

vt_status vt_pack_bytes(vt_context *context, const void *bytes, size_t size, int level, uint8_t **packed,
                        size_t *packed_size) {
  VT_ASSERT(level >= 1 && level <= 19);
  *packed = NULL;
  *packed_size = 0;
  size_t bound = ZSTD_compressBound(size);
  if (ZSTD_isError(bound)) return vt_fail(context, VT_OUT_OF_MEMORY, "a block of %zu bytes: too large to pack", size);
  uint8_t *block = vt_alloc(context, bound, 1);
  if (!block) return VT_OUT_OF_MEMORY;
  size_t used = ZSTD_compress(block, bound, bytes, size, level);
  if (ZSTD_isError(used)) {
    vt_free(context, block);
    return vt_fail(context, VT_OUT_OF_MEMORY, "packing %zu bytes failed: %s; close other programs", size,
                   ZSTD_getErrorName(used));
  }
  uint8_t *fitted = vt_realloc(context, block, used, 1);
  *packed = fitted ? fitted : block;
  *packed_size = used;
  return VT_OK;
}

vt_status vt_unpack_bytes(vt_context *context, const void *packed, size_t packed_size, void *out, size_t size,
                          const char *name) {
  size_t frame = ZSTD_findFrameCompressedSize(packed, packed_size);
  if (ZSTD_isError(frame) || frame != packed_size || ZSTD_getFrameContentSize(packed, packed_size) != size)
    return vt_fail(context, VT_BAD_INPUT, "%s: its packed bytes are damaged; copy or make it again", name);
  size_t got = ZSTD_decompress(out, size, packed, packed_size);
  if (ZSTD_isError(got) || got != size)
    return vt_fail(context, VT_BAD_INPUT, "%s: its packed bytes are damaged; copy or make it again", name);
  return VT_OK;
}
