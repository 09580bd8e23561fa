// hash.c - XXH64 of bytes in memory
// SPDX-License-Identifier: BSD-3-Clause
//
// Four lanes of 64 bits take 32 bytes a round; the lanes are merged, the rest of the bytes follows in eights, fours and
// ones, and the result is mixed (xxHash fast digest algorithm, specification 0.1.1, Collet). Words are little-endian in
// the specification and are put together from bytes, so that every machine says the same. Not for secrets.
#include "base/hash.h"

static const uint64_t prime1 = 0x9E3779B185EBCA87u, prime2 = 0xC2B2AE3D27D4EB4Fu, prime3 = 0x165667B19E3779F9u,
                      prime4 = 0x85EBCA77C2B2AE63u, prime5 = 0x27D4EB2F165667C5u;

static uint64_t rotate(uint64_t v, int bits) {
  return v << bits | v >> (64 - bits);
}

static uint64_t read32(const uint8_t *p) {
  return (uint64_t)p[0] | (uint64_t)p[1] << 8 | (uint64_t)p[2] << 16 | (uint64_t)p[3] << 24;
}

static uint64_t read64(const uint8_t *p) {
  return read32(p) | read32(p + 4) << 32;
}

static uint64_t add_lane(uint64_t lane, uint64_t word) {
  return rotate(lane + word * prime2, 31) * prime1;
}

static uint64_t merge_lane(uint64_t hash, uint64_t lane) {
  return (hash ^ add_lane(0, lane)) * prime1 + prime4;
}

uint64_t vt_hash(const void *bytes, size_t size, uint64_t seed) {
  const uint8_t *p = bytes;
  size_t left = size;
  uint64_t hash = seed + prime5;
  if (left >= 32) {
    uint64_t a = seed + prime1 + prime2, b = seed + prime2, c = seed, d = seed - prime1;
    for (; left >= 32; left -= 32, p += 32) {
      a = add_lane(a, read64(p));
      b = add_lane(b, read64(p + 8));
      c = add_lane(c, read64(p + 16));
      d = add_lane(d, read64(p + 24));
    }
    hash = rotate(a, 1) + rotate(b, 7) + rotate(c, 12) + rotate(d, 18);
    hash = merge_lane(merge_lane(merge_lane(merge_lane(hash, a), b), c), d);
  }
  hash += (uint64_t)size;
  for (; left >= 8; left -= 8, p += 8) hash = rotate(hash ^ add_lane(0, read64(p)), 27) * prime1 + prime4;
  for (; left >= 4; left -= 4, p += 4) hash = rotate(hash ^ read32(p) * prime1, 23) * prime2 + prime3;
  for (; left; left--, p++) hash = rotate(hash ^ *p * prime5, 11) * prime1;
  hash = (hash ^ hash >> 33) * prime2;
  hash = (hash ^ hash >> 29) * prime3;
  return hash ^ hash >> 32;
}
