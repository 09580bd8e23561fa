// depth_ladder.c - optical depths on the logarithmic ladder of the .vtree file
// SPDX-License-Identifier: BSD-3-Clause
//
// Code k > 0 means low * 2^((k - 1) / 18), 0 means nothing. Neighbouring codes differ by 3.93 %, so a depth is off by at most
// 1.95 %. The table and not exp2: the same bits with every maths library. A tree may be put on fewer rungs before it is
// written (vt_snap_depths): zstd then finds few different codes, and the file needs no other scheme.

#include "octree/depth_ladder.h"
#include "octree/tree_file.h"
#include <float.h>

#define CODES_PER_OCTAVE 18

static double depth_ratio(uint32_t step) {
  static const double octave[CODES_PER_OCTAVE] = {
      1.0, 1.0392592260318434, 1.080059738892306, 1.122462048309373, 1.1665290395761165,
      1.2123260668135445, 1.2599210498948732, 1.3093845751749735, 1.360790000174377, 1.4142135623730951,
      1.4697344922755988, 1.5274351309146432, 1.5874010519681994, 1.649721188670605, 1.7144879657061456,
      1.7817974362806785, 1.8517494245745807, 1.9244476737882903};
  return ldexp(octave[step % CODES_PER_OCTAVE], (int)(step / CODES_PER_OCTAVE));
}

// The rungs that are used, and between them the borders, their geometric means.
typedef struct ladder {
  uint32_t stride; // codes from rung to rung
  double borders[CODES_PER_OCTAVE];
} ladder;

static ladder make_ladder(int steps_per_octave) {
  VT_ASSERT(steps_per_octave >= 1 && CODES_PER_OCTAVE % steps_per_octave == 0);
  ladder l = {.stride = (uint32_t)(CODES_PER_OCTAVE / steps_per_octave)};
  for (uint32_t i = 0; i < (uint32_t)steps_per_octave; i++)
    l.borders[i] = sqrt(depth_ratio(i * l.stride) * depth_ratio((i + 1) * l.stride));
  return l;
}

// The code nearest to ratio = depth / low >= 1 on a logarithmic scale: whole octaves from the exponent, the rest by
// comparing with the borders.
static uint32_t depth_code(const ladder *l, double ratio) {
  int exponent;
  double mantissa = 2 * frexp(ratio, &exponent); // 1 <= mantissa < 2
  uint32_t step = 0;
  while (step * l->stride < CODES_PER_OCTAVE && mantissa >= l->borders[step]) step++;
  return 1 + (uint32_t)(exponent - 1) * CODES_PER_OCTAVE + step * l->stride;
}

static float depth_of(float low, uint32_t code) {
  double value = code > 0 ? low * depth_ratio(code - 1) : 0;
  return value < FLT_MAX ? (float)value : FLT_MAX; // the largest may have been rounded up
}

// Smallest and largest depth that is not below `least`; 0 if there is none.
static void find_range(const float *depth, size_t stride, size_t count, float least, float *low, float *high) {
  *low = *high = 0;
  for (size_t i = 0; i < count; i++) {
    float d = depth[i * stride];
    if (d < least) continue;
    if (*low == 0 || d < *low) *low = d;
    if (d > *high) *high = d;
  }
}

uint8_t *vt_code_depths(vt_context *context, const float *depth, size_t stride, size_t count, size_t *size) {
  ladder l = make_ladder(CODES_PER_OCTAVE);
  float low, high;
  find_range(depth, stride, count, FLT_MIN, &low, &high); // a denormal number has no 2 % to be off by; it is written as 0
  size_t planes = low > 0 && depth_code(&l, (double)high / low) > 255 ? 2 : 1;
  *size = 4 + count * planes;
  uint8_t *raw = vt_alloc(context, *size, 1);
  if (raw) vt_put_f32(raw, low);
  for (size_t i = 0; raw && i < count; i++) {
    float d = depth[i * stride];
    uint32_t code = d < FLT_MIN ? 0 : depth_code(&l, (double)d / low);
    raw[4 + i] = (uint8_t)code;
    if (planes == 2) raw[4 + count + i] = (uint8_t)(code >> 8);
  }
  return raw;
}

bool vt_decode_depths(const uint8_t *raw, size_t count, bool wide, float *depth, size_t stride) {
  float low = vt_get_f32(raw);
  if (!(low == 0 || (low >= FLT_MIN && low <= FLT_MAX)) || signbit(low)) return false;
  bool has_low = low == 0, has_wide = !wide; // one way to say it: `low` occurs, two planes only where codes need them
  for (size_t i = 0; i < count; i++) {
    uint32_t code = raw[4 + i] | (wide ? (uint32_t)raw[4 + count + i] << 8 : 0);
    if (code > 0 && (low == 0 || code > 300 * CODES_PER_OCTAVE)) return false;
    if (code > 0 && low * depth_ratio(code - 1) > FLT_MAX * 1.04) return false;
    depth[i * stride] = depth_of(low, code);
    has_low = has_low || code == 1, has_wide = has_wide || code > 255;
  }
  return has_low && has_wide;
}

void vt_snap_depths(float *depth, size_t stride, size_t count, float least, int steps_per_octave) {
  ladder l = make_ladder(steps_per_octave);
  float low, high;
  VT_ASSERT(least >= FLT_MIN);
  find_range(depth, stride, count, least, &low, &high);
  for (size_t i = 0; i < count; i++) {
    float *d = depth + i * stride;
    *d = *d < least ? 0 : depth_of(low, depth_code(&l, (double)*d / low));
  }
}
