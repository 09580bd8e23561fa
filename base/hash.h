// hash.h - 64-bit checksums of bytes (XXH64, the algorithm of the xxHash specification 0.1.1)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_HASH_H
#define VT_BASE_HASH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

uint64_t vt_hash(const void *bytes, size_t size, uint64_t seed);

#ifdef __cplusplus
}
#endif
#endif
