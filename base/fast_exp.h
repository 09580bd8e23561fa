// fast_exp.h - exp of a number that is not positive, to 2e-7 relative, inlined
// SPDX-License-Identifier: BSD-3-Clause
//
// exp(x) = 2^n 2^f with n = round(x log2 e): a degree-6 polynomial for 2^f on [-1/2, 1/2] and n put into the exponent.
// Every machine and compiler gives the same bits, which the library's expf does not promise. Below -87 it is 0.
#ifndef VT_BASE_FAST_EXP_H
#define VT_BASE_FAST_EXP_H

#include <stdint.h>
#include <string.h>

static inline float vt_exp_of_negative(float x) {
  if (!(x > -87.0f)) return 0;
  float y = x * 1.44269504f;
  int32_t n = (int32_t)(y - 0.5f); // y <= 0: rounds to the nearest
  float f = y - (float)n;
  float p = 1.5403530e-4f;
  p = p * f + 1.3333558e-3f;
  p = p * f + 9.6181291e-3f;
  p = p * f + 5.5504109e-2f;
  p = p * f + 2.4022651e-1f;
  p = p * f + 6.9314718e-1f;
  p = p * f + 1.0f;
  uint32_t bits = (uint32_t)(n + 127) << 23;
  float power;
  memcpy(&power, &bits, sizeof power);
  return p * power;
}

static inline float vt_exp_of_any(float x) { // |x| < 80
  return x > 0 ? 1 / vt_exp_of_negative(-x) : vt_exp_of_negative(x);
}

#endif
