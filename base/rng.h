// rng.h - repeatable random numbers (PCG32, O'Neill 2014, "PCG: a family of simple fast ... algorithms")
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_RNG_H
#define VT_BASE_RNG_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_rng { uint64_t state, stream; } vt_rng;

static inline uint32_t vt_random(vt_rng *rng) { // 0..2^32-1
  uint64_t old = rng->state;
  rng->state = old * 6364136223846793005ull + (rng->stream | 1u);
  uint32_t shifted = (uint32_t)(((old >> 18) ^ old) >> 27), rotation = (uint32_t)(old >> 59);
  return (shifted >> rotation) | (shifted << ((32u - rotation) & 31u));
}
static inline vt_rng vt_seed_rng(uint64_t seed, uint64_t stream) {
  vt_rng rng = {0, stream << 1 | 1u};
  (void)vt_random(&rng);
  rng.state += seed;
  (void)vt_random(&rng);
  return rng;
}
static inline double vt_random_unit(vt_rng *rng) { return vt_random(rng) * (1.0 / 4294967296.0); } // [0, 1)
static inline double vt_random_between(vt_rng *rng, double low, double high) {
  return low + (high - low) * vt_random_unit(rng);
}

#ifdef __cplusplus
}
#endif
#endif
