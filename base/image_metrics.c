// image_metrics.c - PSNR, SSIM and alpha error of a rendered picture
// SPDX-License-Identifier: BSD-3-Clause
//
// SSIM(x, y) = (2 mu_x mu_y + C1)(2 sigma_xy + C2) / ((mu_x^2 + mu_y^2 + C1)(sigma_x^2 + sigma_y^2 + C2)), C1 = (K1
// L)^2, C2 = (K2 L)^2, L = 1, K1 = .01, K2 = .03, moments under a Gaussian window of 11x11, sigma 1.5, that lies wholly
// inside the picture (Wang, Bovik, Sheikh, Simoncelli, Image quality assessment: from error visibility to structural
// similarity, IEEE TIP 2004, section III.B). Mean over all windows and over R, G and B, without that paper's reduction
// to 256 pixels. In a picture smaller than 11 the window is the largest odd one that fits, its weights normed to sum 1.
// The window is separable: four moments (x, y, xx + yy, xy) are smoothed down the columns of a strip, then along the
// row; R, G and B lie interleaved, so that one pass does all three. Moments are summed in double: a variance is a small
// difference of large numbers on the white background that most of these pictures have.
// Colour difference and sharpness are measured by image_detail.c.
#include "base/image_metrics.h"
#include "base/image_detail.h"

#include <math.h>
#include <string.h>

#define MAX_TAPS 11
#define STRIP 32 // rows of windows a block makes; MAX_TAPS - 1 more rows are flattened for it

typedef struct measurement {
  vt_picture_pair pair;
  double *errors; // [height][4]: squared error, the same over the foreground, foreground pixels, squared alpha error
  double *ssim;   // [height - taps + 1]: sums over a row of windows
  int taps;
  double weights[MAX_TAPS];
  float *strips;   // [workers][2][STRIP + MAX_TAPS - 1][3 width]
  double *moments; // [workers][4][3 width]
} measurement;

static float clamp(float v) {
  return v > 0 ? (v < 1 ? v : 1) : 0;
} // NaN is 0

static float *strip_of(const measurement *m, int worker, int picture) {
  size_t size = (size_t)(STRIP + MAX_TAPS - 1) * 3 * (size_t)m->pair.result->width;
  return m->strips + ((size_t)worker * 2 + (size_t)picture) * size;
}

static void measure_rows(void *user, size_t begin, size_t end, int worker) {
  measurement *m = user;
  size_t width = (size_t)m->pair.result->width;
  float *a = strip_of(m, worker, 0), *b = strip_of(m, worker, 1);
  for (size_t y = begin; y < end; y++) {
    double all = 0, foreground = 0, alpha = 0;
    size_t count = 0;
    vt_flatten_pair(&m->pair, y, a, b);
    for (size_t x = 0; x < width; x++) {
      uint8_t true_alpha = m->pair.truth->pixels[(y * width + x) * 4 + 3];
      double error = 0, alpha_error = clamp(m->pair.result->pixels[(y * width + x) * 4 + 3]) - true_alpha / 255.0;
      for (size_t i = 3 * x; i < 3 * x + 3; i++) error += ((double)a[i] - b[i]) * ((double)a[i] - b[i]);
      all += error;
      alpha += alpha_error * alpha_error;
      if (true_alpha >= VT_FOREGROUND_BYTE) {
        foreground += error;
        count++;
      }
    }
    double *out = m->errors + 4 * y;
    out[0] = all, out[1] = foreground, out[2] = (double)count, out[3] = alpha;
  }
}

// The four moments of each column of `taps` rows.
static void smooth_columns(const measurement *m, const float *a, const float *b, size_t samples, double *moments) {
  double *mx = moments, *my = mx + samples, *mq = my + samples, *mp = mq + samples;
  memset(moments, 0, 4 * samples * sizeof *moments);
  for (int k = 0; k < m->taps; k++, a += samples, b += samples) {
    double w = m->weights[k];
    for (size_t i = 0; i < samples; i++) {
      double x = a[i], y = b[i];
      mx[i] += w * x;
      my[i] += w * y;
      mq[i] += w * (x * x + y * y);
      mp[i] += w * (x * y);
    }
  }
}

static double sum_row(const measurement *m, const double *moments, size_t samples) {
  enum { PART = 96 }; // windows at a time: their sums stay in the nearest cache
  const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
  size_t windows = samples - 3 * (size_t)(m->taps - 1);
  double sum = 0, part[4][PART];
  for (size_t begin = 0; begin < windows; begin += PART) {
    size_t count = windows - begin < PART ? windows - begin : PART;
    memset(part, 0, sizeof part);
    for (int q = 0; q < 4; q++)
      for (int k = 0; k < m->taps; k++) {
        const double *from = moments + (size_t)q * samples + begin + 3 * (size_t)k;
        double w = m->weights[k];
        for (size_t i = 0; i < count; i++) part[q][i] += w * from[i];
      }
    for (size_t i = 0; i < count; i++) {
      double x = part[0][i], y = part[1][i], xy = x * y, squares = x * x + y * y;
      sum += (2 * xy + c1) * (2 * (part[3][i] - xy) + c2) / ((squares + c1) * (part[2][i] - squares + c2));
    }
  }
  return sum;
}

static void measure_windows(void *user, size_t begin, size_t end, int worker) {
  measurement *m = user;
  size_t samples = 3 * (size_t)m->pair.result->width, rows = end - begin + (size_t)m->taps - 1;
  float *a = strip_of(m, worker, 0), *b = strip_of(m, worker, 1);
  double *moments = m->moments + (size_t)worker * 4 * samples;
  for (size_t y = 0; y < rows; y++) vt_flatten_pair(&m->pair, begin + y, a + y * samples, b + y * samples);
  for (size_t y = begin; y < end; y++) {
    size_t top = (y - begin) * samples;
    smooth_columns(m, a + top, b + top, samples, moments);
    m->ssim[y] = sum_row(m, moments, samples);
  }
}

static void make_window(measurement *m) {
  int side = m->pair.result->width < m->pair.result->height ? m->pair.result->width : m->pair.result->height;
  double sum = 0;
  m->taps = side >= MAX_TAPS ? MAX_TAPS : side - !(side % 2);
  for (int k = 0; k < m->taps; k++) {
    double d = (k - m->taps / 2) / 1.5;
    sum += m->weights[k] = exp(-0.5 * d * d);
  }
  for (int k = 0; k < m->taps; k++) m->weights[k] /= sum;
}

// Capped at 99, so that a perfect picture is not below an almost perfect one.
static double decibels(double mean_square) {
  return mean_square > 0 ? fmin(-10 * log10(mean_square), 99) : 99;
}

static void sum_up(const measurement *m, vt_metrics *out) {
  double sums[4] = {0}, ssim = 0, width = m->pair.result->width, height = m->pair.result->height;
  size_t window_rows = (size_t)(m->pair.result->height - m->taps + 1);
  for (size_t y = 0; y < (size_t)m->pair.result->height; y++)
    for (int i = 0; i < 4; i++) sums[i] += m->errors[4 * y + (size_t)i];
  for (size_t y = 0; y < window_rows; y++) ssim += m->ssim[y];
  out->psnr = decibels(sums[0] / (3 * width * height));
  out->psnr_foreground = sums[2] > 0 ? decibels(sums[1] / (3 * sums[2])) : (double)NAN;
  out->ssim = ssim / (3 * (width - m->taps + 1) * (double)window_rows);
  out->alpha_rmse = sqrt(sums[3] / (width * height));
}

vt_status vt_measure(vt_context *context, const vt_fimage *result, const vt_image *truth, const float background[3],
                     vt_metrics *out) {
  VT_ASSERT(result->channels == 4 && truth->channels == 4);
  VT_ASSERT(result->width == truth->width && result->height == truth->height);
  VT_ASSERT(result->width > 0 && result->height > 0);
  measurement m = {.pair = {.result = result, .truth = truth}};
  memcpy(m.pair.background, background, sizeof m.pair.background);
  memset(out, 0, sizeof *out);
  make_window(&m);
  size_t width = (size_t)result->width, height = (size_t)result->height, workers = (size_t)vt_thread_count(context);
  vt_status status = VT_OUT_OF_MEMORY;
  m.errors = VT_NEW(context, double, 4 * height);
  m.ssim = VT_NEW(context, double, height);
  m.strips = VT_NEW(context, float, workers * 2 * (STRIP + MAX_TAPS - 1) * 3 * width);
  m.moments = VT_NEW(context, double, workers * 4 * 3 * width);
  if (!m.errors || !m.ssim || !m.strips || !m.moments) goto done;
  status = vt_parallel(context, height, STRIP, measure_rows, &m);
  if (!status) status = vt_parallel(context, height - (size_t)m.taps + 1, STRIP, measure_windows, &m);
  if (!status) sum_up(&m, out);
  if (!status) status = vt_measure_detail(context, &m.pair, &out->delta_e, &out->sharpness);
done:
  vt_free(context, m.errors);
  vt_free(context, m.ssim);
  vt_free(context, m.strips);
  vt_free(context, m.moments);
  return status;
}
