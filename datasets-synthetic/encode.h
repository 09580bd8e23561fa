// encode.h - linear light to the bytes of a picture
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_ENCODE_H
#define VT_DATASETS_SYNTHETIC_ENCODE_H

#include <math.h>
#include <stdint.h>

enum { VT_ENCODE_STEPS = 4096 };

typedef struct vt_encode_table {
  float values[VT_ENCODE_STEPS + 2]; // sRGB of linear light i / VT_ENCODE_STEPS
} vt_encode_table;

static inline void vt_make_encode_table(vt_encode_table *table) {
  for (int i = 0; i <= VT_ENCODE_STEPS + 1; i++) {
    double linear = fmin((double)i / VT_ENCODE_STEPS, 1);
    table->values[i] = (float)(linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055);
  }
}

static inline float vt_encode(const vt_encode_table *table, float linear) {
  float at = fminf(fmaxf(linear, 0), 1) * VT_ENCODE_STEPS;
  int step = (int)at;
  return table->values[step] + (table->values[step + 1] - table->values[step]) * (at - (float)step);
}

static inline uint8_t vt_byte_of(double unit) {
  return (uint8_t)(unit <= 0 ? 0 : unit >= 1 ? 255 : unit * 255 + 0.5);
}

#endif
