// damage_picture.c - what lens, shutter and sensor do to light
// SPDX-License-Identifier: BSD-3-Clause
//
// All in linear light, where light adds up, and premultiplied, so that a transparent pixel pulls no colour.
//
// Blur: the Gaussian for a grid is T(n, t) = exp(-t) I_n(t), I_n the modified Bessel functions (Lindeberg, "Scale-space
// for discrete signals", PAMI 1990): its variance is t exactly, where a sampled Gaussian of half a pixel has a third
// too little. I_n comes from I_{n-1} = I_{n+1} + 2n/t I_n downwards (Miller), and the sum of all is made 1.
//
// Sensor: photons are counted, so the variance of linear light L is c L. Mid grey, encoded 0.5, is L = 0.214, where the
// encoded value changes by E' per unit of light: c = (noise / E')^2 / L. A count has a Poisson distribution, which
// Gaussian noise is only near for many photons: in the dark it would be negative.
//
// Lens: the picture at a bent place shows what the pinhole saw at x with r (1 + k1 r^2) = r_bent, found by Newton; a
// barrel (k1 < 0) shows no more from where r (1 + k1 r^2) turns back. Between pixels Catmull and Rom's cubic, which
// keeps a picture sharp; its overshoot is clipped.

#include "datasets-synthetic/damage_picture.h"

#include <string.h>

enum { TAP_LIMIT = 256 };

static float decode(double v) {
  return (float)(v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4));
}

static double encode(double v) {
  return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
}

void vt_linear_from_bytes(const uint8_t *straight, size_t count, float *light) {
  float linear[256];
  for (int i = 0; i < 256; i++) linear[i] = decode(i / 255.0);
  for (size_t i = 0; i < 4 * count; i += 4) {
    float alpha = (float)straight[i + 3] / 255;
    for (size_t c = 0; c < 3; c++) light[i + c] = linear[straight[i + c]] * alpha;
    light[i + 3] = alpha;
  }
}

// ---- lens

// r with r (1 + k1 r^2) = bent.
static double unbend(double bent, double k1) {
  double last = k1 < 0 ? sqrt(-1 / (3 * k1)) : INFINITY; // the model turns back there
  double r = fmin(bent, last);
  if (bent >= last * (1 + k1 * last * last) && k1 < 0) return last;
  for (int turn = 0; turn < 30; turn++) {
    double change = (r * (1 + k1 * r * r) - bent) / (1 + 3 * k1 * r * r);
    r = fmin(fmax(r - change, 0), last);
    if (fabs(change) < 1e-12) break;
  }
  return r;
}

static void cubic_weights(double t, float w[4]) {
  w[0] = (float)(0.5 * t * (t * (2 - t) - 1)), w[1] = (float)(0.5 * (t * t * (3 * t - 5) + 2));
  w[2] = (float)(0.5 * t * (t * (4 - 3 * t) + 1)), w[3] = (float)(0.5 * t * t * (t - 1));
}

static int inside(int at, int size) {
  return at < 0 ? 0 : at >= size ? size - 1 : at;
}

static void read_cubic(const float *light, int width, int height, double x, double y, float out[4]) {
  x = fmin(fmax(x, 0), width) - 0.5, y = fmin(fmax(y, 0), height) - 0.5;
  int left = (int)floor(x), top = (int)floor(y);
  float wx[4], wy[4], sum[4] = {0, 0, 0, 0};
  cubic_weights(x - left, wx), cubic_weights(y - top, wy);
  for (int j = 0; j < 4; j++)
    for (int i = 0; i < 4; i++) {
      size_t row = (size_t)inside(top + j - 1, height) * (size_t)width;
      const float *p = light + 4 * (row + (size_t)inside(left + i - 1, width));
      for (int c = 0; c < 4; c++) sum[c] += wy[j] * wx[i] * p[c];
    }
  float over = fmaxf(sum[3], 1); // colours are scaled with what is clipped, or a rim would change its colour
  out[3] = fmaxf(sum[3], 0) / over;
  for (int c = 0; c < 3; c++) out[c] = fminf(fmaxf(sum[c], 0) / over, out[3]);
}

void vt_bend_picture(const vt_camera *camera, double k1, const float *light, float *out) {
  for (int y = 0; y < camera->height; y++)
    for (int x = 0; x < camera->width; x++) {
      double u = (x + 0.5 - camera->cx) / camera->fx, v = (y + 0.5 - camera->cy) / camera->fy, bent = hypot(u, v);
      double scale = bent > 0 ? unbend(bent, k1) / bent : 1;
      read_cubic(light, camera->width, camera->height, camera->cx + camera->fx * u * scale,
                 camera->cy + camera->fy * v * scale, out + 4 * ((size_t)y * (size_t)camera->width + (size_t)x));
    }
}

// ---- blur

static int make_taps(double deviation, float taps[TAP_LIMIT]) {
  int radius = (int)ceil(4 * deviation) + 2, far = (int)ceil(9 * deviation) + 30;
  double t = fmax(deviation * deviation, 1e-12), above = 0, here = 1e-300, sum = 0, values[TAP_LIMIT];
  VT_ASSERT(radius < TAP_LIMIT);
  for (int n = far; n >= 0; n--) {
    double below = above + 2 * (n + 1) / t * here; // I_n of I_{n+2} and I_{n+1}
    above = here, here = below;
    if (n <= radius) values[n] = here;
    if (here > 1e250) { // only the ratios count
      above *= 1e-250, here *= 1e-250;
      for (int k = n; k <= radius; k++) values[k] *= 1e-250;
    }
  }
  for (int n = 0; n <= radius; n++) sum += (n ? 2 : 1) * values[n];
  for (int n = 0; n <= radius; n++) taps[n] = (float)(values[n] / sum);
  return radius;
}

// One pass: `count` lines of `length` samples, `step` floats from sample to sample and `skip` from line to line.
static void blur_lines(const float *in, float *out, int count, size_t skip, int length, size_t step, const float *taps,
                       int radius) {
  for (int line = 0; line < count; line++) {
    const float *from = in + (size_t)line * skip;
    float *to = out + (size_t)line * skip;
    for (int i = 0; i < length; i++) {
      float sum = taps[0] * from[(size_t)i * step];
      for (int k = 1; k <= radius; k++)
        sum += taps[k] * (from[(size_t)inside(i - k, length) * step] + from[(size_t)inside(i + k, length) * step]);
      to[(size_t)i * step] = sum;
    }
  }
}

void vt_blur_picture(float *pixels, int width, int height, int channels, double deviation, float *scratch) {
  float taps[TAP_LIMIT];
  int radius = make_taps(deviation, taps);
  size_t pixel = (size_t)channels, row = pixel * (size_t)width;
  for (int y = 0; y < height; y++) // the channels of a row are lines that begin one float apart
    blur_lines(pixels + (size_t)y * row, scratch + (size_t)y * row, channels, 1, width, pixel, taps, radius);
  blur_lines(scratch, pixels, (int)row, 1, height, row, taps, radius);
}

// ---- sensor

static double count_photons(vt_rng *rng, double mean) {
  if (mean > 40) return fmax(mean + sqrt(mean) * vt_random_normal(rng), 0);
  double limit = exp(-mean), product = vt_random_unit(rng); // Knuth, The Art of Computer Programming 2, 3.4.1
  int count = 0;
  for (; product > limit; count++) product *= vt_random_unit(rng);
  return count;
}

void vt_bytes_from_light(const float *light, size_t count, double exposure, double noise, const double balance[3],
                         vt_rng *rng, uint8_t *straight) {
  double grey = decode(0.5), slope = 1.055 / 2.4 * pow(grey, 1 / 2.4 - 1);
  double photon = noise > 0 ? noise / slope * (noise / slope) / grey : 0; // its light
  for (size_t i = 0; i < 4 * count; i += 4) {
    double alpha = (double)light[i + 3];
    uint8_t *out = straight + i;
    out[3] = (uint8_t)(alpha <= 0 ? 0 : alpha >= 1 ? 255 : alpha * 255 + 0.5);
    for (size_t c = 0; c < 3; c++) {
      double value = out[3] ? exposure * (double)light[i + c] / alpha : 0;
      if (photon > 0 && out[3]) value = photon * count_photons(rng, value / photon);
      value = fmin(fmin(value, 1) * balance[c], 1);
      out[c] = (uint8_t)(encode(value) * 255 + 0.5);
    }
  }
}
