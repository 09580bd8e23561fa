// chroma.c - the detail of colour that a JPEG does not keep, from that of lightness
// SPDX-License-Identifier: BSD-3-Clause
//
// Nearly every JPEG keeps chroma at half the size. A twig two pixels wide has its own lightness there and half of the sky's
// blue, and the colour line finds it half as opaque; a hole two pixels wide, which the sky fills, keeps the leaves' yellow.
// Lightness Y is sharp. Along an edge between two things chroma C is a function of it, so in a small window, with Y smeared as
// the chroma was,
//   C = a Y_smeared + b     in least squares (He, Sun, Tang, "Guided image filtering", ECCV 2010, eq. 5),   C' = C + a (Y - Y_smeared)
// puts back what was taken. How far it was smeared the picture says itself: by the kernel whose Y_smeared explains C best. Where
// Y itself does (PNG, camera RAW, JPEG 4:4:4) nothing is done.
// What goes wrong: edges between colours of one lightness stay smeared, and where three things meet in a window the slope is
// a mean of theirs.

#include "capture/chroma.h"

#include <math.h>
#include <string.h>

enum { KERNELS = 3, REACH = 2, ROWS = 2 * REACH + 1, PROBES = 40000 }; // REACH: of windows and of the widest kernel, pixels
#define RIDGE 100.0f // levels squared: what little lightness varies says nothing of colour
#define SURELY 0.98    // what noise makes of a Y that is not smeared at all
static const float kernels[KERNELS][ROWS] = {{0, 0, 1, 0, 0}, {0, 0.25f, 0.5f, 0.25f, 0}, {0.0625f, 0.25f, 0.375f, 0.25f, 0.0625f}};

static inline float luma_of(const uint8_t *p) {
  return 0.299f * (float)p[0] + 0.587f * (float)p[1] + 0.114f * (float)p[2];
}

static int clamp(int i, int size) {
  return i < 0 ? 0 : i >= size ? size - 1 : i;
}

// ---- how far

// Adds, for one window, the variance of red and blue less Y, and what of it each kernel leaves unexplained.
static void probe_window(const vt_image *rgb, int x, int y, double left[KERNELS]) {
  enum { SIDE = ROWS + 2 * REACH };
  float luma[SIDE][SIDE];
  for (int j = 0; j < SIDE; j++)
    for (int i = 0; i < SIDE; i++)
      luma[j][i] = luma_of(rgb->pixels + 3 * ((size_t)(y + j - 2 * REACH) * (size_t)rgb->width + (size_t)(x + i - 2 * REACH)));
  for (int k = 0; k < KERNELS; k++) {
    double sum[3] = {0}, square[3] = {0}, product[2] = {0}, n = ROWS * ROWS;
    for (int j = 0; j < ROWS; j++)
      for (int i = 0; i < ROWS; i++) {
        float smeared = 0;
        for (int v = 0; v < ROWS; v++)
          for (int u = 0; u < ROWS; u++) smeared += kernels[k][v] * kernels[k][u] * luma[j + v][i + u];
        const uint8_t *p = rgb->pixels + 3 * ((size_t)(y + j - REACH) * (size_t)rgb->width + (size_t)(x + i - REACH));
        float own = luma[j + REACH][i + REACH], value[3] = {smeared, (float)p[0] - own, (float)p[2] - own};
        for (int c = 0; c < 3; c++) sum[c] += (double)value[c], square[c] += (double)value[c] * (double)value[c];
        for (int c = 0; c < 2; c++) product[c] += (double)value[0] * (double)value[c + 1];
      }
    double variance = square[0] - sum[0] * sum[0] / n;
    for (int c = 0; c < 2; c++) {
      double covariance = product[c] - sum[0] * sum[c + 1] / n;
      left[k] += square[c + 1] - sum[c + 1] * sum[c + 1] / n - covariance * covariance / (variance + (double)RIDGE);
    }
  }
}

int vt_measure_smear(const vt_image *rgb) {
  VT_ASSERT(rgb->channels == 3);
  double left[KERNELS] = {0};
  int width = rgb->width - 4 * REACH, height = rgb->height - 4 * REACH, smear = 0;
  if (width < 1 || height < 1) return 0;
  int step = (int)sqrt((double)width * height / PROBES) + 1;
  for (int y = 0; y < height; y += step)
    for (int x = 0; x < width; x += step) probe_window(rgb, x + 2 * REACH, y + 2 * REACH, left);
  for (int k = 1; k < KERNELS; k++)
    if (left[k] < (smear ? 1 : SURELY) * left[smear]) smear = k;
  return smear;
}

// ---- sharper

typedef struct lines { // rows of the picture, a ring of them
  int width;
  float *luma, *smeared, *red, *blue; // [ROWS][width]
} lines;

// Luma smeared along a row and down its neighbours, and chroma, of row y into its place of the ring.
static void fill_line(const vt_image *rgb, const float *kernel, int y, float *column, lines *l) {
  int w = rgb->width;
  size_t at = (size_t)((y + ROWS) % ROWS) * (size_t)w;
  for (int x = 0; x < w; x++) {
    column[x] = 0;
    for (int v = -REACH; v <= REACH; v++)
      column[x] += kernel[v + REACH] *
                   luma_of(rgb->pixels + 3 * ((size_t)clamp(y + v, rgb->height) * (size_t)w + (size_t)x));
    const uint8_t *p = rgb->pixels + 3 * ((size_t)clamp(y, rgb->height) * (size_t)w + (size_t)x);
    float luma = luma_of(p);
    l->luma[at + (size_t)x] = luma, l->red[at + (size_t)x] = (float)p[0] - luma, l->blue[at + (size_t)x] = (float)p[2] - luma;
  }
  for (int x = 0; x < w; x++) {
    float sum = 0;
    for (int u = -REACH; u <= REACH; u++) sum += kernel[u + REACH] * column[clamp(x + u, w)];
    l->smeared[at + (size_t)x] = sum;
  }
}

static uint8_t byte_of(float v) {
  return (uint8_t)(v < 0 ? 0 : v > 255 ? 255 : v + 0.5f);
}

enum { SUMS = 6 }; // what a window needs
// sums[width][SUMS]: scratch.
static void sharpen_line(const lines *l, int y, float *sums, uint8_t *out) {
  int w = l->width;
  for (int x = 0; x < w; x++) { // down the ring
    float s[SUMS] = {0};
    for (int j = 0; j < ROWS; j++) {
      size_t at = (size_t)j * (size_t)w + (size_t)x;
      float a = l->smeared[at], r = l->red[at], b = l->blue[at];
      float add[SUMS] = {a, r, b, a * a, a * r, a * b};
      for (int k = 0; k < SUMS; k++) s[k] += add[k];
    }
    memcpy(sums + (size_t)x * SUMS, s, sizeof s);
  }
  size_t row = (size_t)((y + ROWS) % ROWS) * (size_t)w;
  for (int x = 0; x < w; x++) {
    float s[SUMS] = {0}, n = 0; // beside the picture there are none; above and below, the first and last row again
    for (int i = x > REACH ? x - REACH : 0; i <= x + REACH && i < w; i++, n += ROWS)
      for (int k = 0; k < SUMS; k++) s[k] += sums[(size_t)i * SUMS + (size_t)k];
    size_t at = row + (size_t)x;
    float variance = s[3] - s[0] * s[0] / n + RIDGE * n, detail = l->luma[at] - l->smeared[at];
    float r = l->red[at] + (s[4] - s[0] * s[1] / n) / variance * detail;
    float b = l->blue[at] + (s[5] - s[0] * s[2] / n) / variance * detail;
    out[3 * x] = byte_of(l->luma[at] + r), out[3 * x + 2] = byte_of(l->luma[at] + b);
    out[3 * x + 1] = byte_of(l->luma[at] - (0.299f * r + 0.114f * b) / 0.587f);
  }
}

vt_status vt_sharpen_chroma(vt_context *context, const vt_image *rgb, int smear, vt_image *out) {
  VT_ASSERT(rgb->channels == 3 && smear >= 0 && smear < KERNELS);
  vt_status status = vt_make_image(context, rgb->width, rgb->height, 3, out);
  if (status || !smear) {
    if (!status) memcpy(out->pixels, rgb->pixels, 3 * (size_t)rgb->width * (size_t)rgb->height);
    return status;
  }
  size_t w = (size_t)rgb->width;
  float *block = VT_NEW(context, float, w *(4 * ROWS + SUMS + 1));
  if (!block) {
    vt_free_image(context, out);
    return VT_OUT_OF_MEMORY;
  }
  lines l = {rgb->width, block, block + ROWS * w, block + 2 * ROWS * w, block + 3 * ROWS * w};
  float *sums = block + 4 * ROWS * w, *column = sums + SUMS * w;
  for (int y = -REACH; y < REACH; y++) fill_line(rgb, kernels[smear], y, column, &l);
  for (int y = 0; y < rgb->height; y++) {
    fill_line(rgb, kernels[smear], y + REACH, column, &l);
    sharpen_line(&l, y, sums, out->pixels + 3 * w * (size_t)y);
  }
  vt_free(context, block);
  return VT_OK;
}
