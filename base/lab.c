// lab.c - sRGB to CIELab (D65) and back
// SPDX-License-Identifier: BSD-3-Clause
//
// sRGB (IEC 61966-2-1) -> linear light -> XYZ -> CIELab with the exact fractions of CIE 15:2004, 216/24389 and
// 24389/27. The white is the image of (1,1,1), i.e. the row sums of the matrix, so that every grey has a = b = 0. With
// the rounded constants often seen (4-digit matrix, 0.008856) white gets a = .005, b = -.010. The cube root is our own
// (a guess from the exponent and two steps of Halley's iteration, relative error about 2e-7): it vectorises, and it is
// the same on every machine, which cbrtf of different libraries is not.

#include "base/lab.h"
#include <math.h>
#include <string.h>

#define EPSILON (216.0f / 24389.0f)
#define KAPPA (24389.0f / 27.0f)

// Linear sRGB to X/Xn, Y/Yn, Z/Zn, and XYZ to linear sRGB.
#define WHITE_X 0.9504559270516718
#define WHITE_Z 1.0890577507598784
static const float xyz_from_rgb[3][3] = {{(float)(0.4123907992659595 / WHITE_X), (float)(0.357584339383878 / WHITE_X),
                                          (float)(0.1804807884018343 / WHITE_X)},
                                         {0.21263900587151027f, 0.715168678767756f, 0.07219231536073371f},
                                         {(float)(0.01933081871559182 / WHITE_Z),
                                          (float)(0.11919477979462598 / WHITE_Z),
                                          (float)(0.9505321522496607 / WHITE_Z)}};
static const float rgb_from_xyz[3][3] = {
    {(float)(3.2409699419045226 * WHITE_X), -1.537383177570094f, (float)(-0.4986107602930034 * WHITE_Z)},
    {(float)(-0.9692436362808796 * WHITE_X), 1.8759675015077202f, (float)(0.04155505740717559 * WHITE_Z)},
    {(float)(0.05563007969699366 * WHITE_X), -0.20397695888897652f, (float)(1.0569715142428786 * WHITE_Z)}};

static float decode(float v) {
  return v <= 0.04045f ? v / 12.92f : (float)pow(((double)v + 0.055) / 1.055, 2.4);
}

static float encode(float v) {
  if (!(v > 0)) return 0;
  float e = v <= 0.0031308f ? v * 12.92f : (float)(1.055 * pow((double)v, 1 / 2.4) - 0.055);
  return e < 1 ? e : 1;
}

// f(t) of CIELab. Both branches are computed: a choice without a jump vectorises.
static inline float lab_f(float t) {
  float s = t > EPSILON ? t : EPSILON, y;
  uint32_t bits;
  memcpy(&bits, &s, sizeof bits);
  bits = bits / 3 + 709921077u; // a third of the exponent: within 6 % of the root
  memcpy(&y, &bits, sizeof y);
  for (int i = 0; i < 2; i++) {
    float cube = y * y * y;
    y *= (cube + 2 * s) / (2 * cube + s);
  }
  float line = (KAPPA * t + 16) / 116;
  return t > EPSILON ? y : line;
}

static inline float lab_f_inverse(float f) {
  float cube = f * f * f;
  return cube > EPSILON ? cube : (116 * f - 16) / KAPPA;
}

static inline void lab_from_linear(float r, float g, float b, float *lab) {
  const float(*m)[3] = xyz_from_rgb;
  float fx = lab_f(m[0][0] * r + m[0][1] * g + m[0][2] * b);
  float fy = lab_f(m[1][0] * r + m[1][1] * g + m[1][2] * b);
  float fz = lab_f(m[2][0] * r + m[2][1] * g + m[2][2] * b);
  lab[0] = 116 * fy - 16;
  lab[1] = 500 * (fx - fy);
  lab[2] = 200 * (fy - fz);
}

void vt_lab_from_srgb(const float srgb[3], float lab[3]) {
  lab_from_linear(decode(srgb[0]), decode(srgb[1]), decode(srgb[2]), lab);
}

void vt_srgb_from_lab(const float lab[3], float srgb[3]) {
  float fy = (lab[0] + 16) / 116;
  float x = lab_f_inverse(fy + lab[1] / 500), y = lab_f_inverse(fy), z = lab_f_inverse(fy - lab[2] / 200);
  for (int i = 0; i < 3; i++)
    srgb[i] = encode(rgb_from_xyz[i][0] * x + rgb_from_xyz[i][1] * y + rgb_from_xyz[i][2] * z);
}

void vt_fill_srgb_table(float linear[256]) {
  for (int i = 0; i < 256; i++) linear[i] = decode((float)i / 255);
}

void vt_lab_from_bytes(const float linear[256], const uint8_t *rgb, size_t stride, size_t count, float *lab) {
  enum { BATCH = 16 };
  float in[3][BATCH], out[BATCH][3];
  for (size_t first = 0; first < count; first += BATCH) {
    size_t n = count - first < BATCH ? count - first : BATCH;
    for (size_t i = 0; i < BATCH; i++) // the last batch repeats its first colour
      for (size_t c = 0; c < 3; c++) in[c][i] = linear[rgb[(first + (i < n ? i : 0)) * stride + c]];
    for (int i = 0; i < BATCH; i++) lab_from_linear(in[0][i], in[1][i], in[2][i], out[i]);
    memcpy(lab + 3 * first, out, n * sizeof out[0]);
  }
}
