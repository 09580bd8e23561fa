// image_detail.c - colour difference and sharpness over the foreground
// SPDX-License-Identifier: BSD-3-Clause
//
// Colour: the mean of CIEDE2000 over pixels whose true alpha is above 0.02, both pictures over the background.
//
// Sharpness: PSNR forgives blur, since the mean of all leaves that might be there is the safest guess; so a blurred
// tree can win. The ratio
//     sum over the foreground of |grad L_result|^2 / the same of the truth,   L = .299 R + .587 G + .114 B as encoded,
// with central differences, is 1 where detail has the right strength, below 1 where it is smeared, above 1 where there
// are speckles. It asks for strength alone, not for place: read it beside PSNR and SSIM. Central differences are blind
// at the finest frequency (a one-pixel checkerboard) and strongest at a period of four pixels, which is what one pixel
// of blur takes. At the frame's edge the neighbour outside is the pixel itself.

#include "base/image_detail.h"
#include "base/delta_e.h"
#include "base/lab.h"

#include <math.h>

enum { STRIP = 32 };

static float clamp(float v) {
  return v > 0 ? (v < 1 ? v : 1) : 0;
} // NaN is 0

void vt_flatten_pair(const vt_picture_pair *pair, size_t y, float *result_row, float *truth_row) {
  size_t width = (size_t)pair->result->width;
  const float *r = pair->result->pixels + y * width * 4;
  const uint8_t *t = pair->truth->pixels + y * width * 4;
  for (size_t x = 0; x < width; x++, r += 4, t += 4) {
    float r_clear = 1 - clamp(r[3]), t_alpha = (float)t[3] / 255, t_clear = 1 - t_alpha;
    for (int c = 0; c < 3; c++) {
      result_row[3 * x + (size_t)c] = clamp(r[c] + r_clear * pair->background[c]);
      truth_row[3 * x + (size_t)c] = (float)t[c] / 255 * t_alpha + t_clear * pair->background[c];
    }
  }
}

typedef struct detail_job {
  const vt_picture_pair *pair;
  double *sums; // [height][4]: colour difference, foreground pixels, gradient energy of result and truth
  float *rows;  // [worker][2][3 width]: both pictures, RGB
  float *lumas; // [worker][2][STRIP + 2][width]
} detail_job;

static void take_lumas(const float *rgb, size_t width, float *luma) {
  for (size_t x = 0; x < width; x++) luma[x] = 0.299f * rgb[3 * x] + 0.587f * rgb[3 * x + 1] + 0.114f * rgb[3 * x + 2];
}

static double colour_difference(const float *a, const float *b) {
  float lab_a[3], lab_b[3];
  vt_lab_from_srgb(a, lab_a), vt_lab_from_srgb(b, lab_b);
  const double x[3] = {(double)lab_a[0], (double)lab_a[1], (double)lab_a[2]};
  const double y[3] = {(double)lab_b[0], (double)lab_b[1], (double)lab_b[2]};
  return vt_delta_e(x, y);
}

// Of the row at `middle`; rows above and below it lie before and behind.
static double gradient_energy(const float *middle, const float *above, const float *below, size_t x, size_t width) {
  double across = (double)middle[x + 1 < width ? x + 1 : x] - (double)middle[x > 0 ? x - 1 : x];
  double down = (double)below[x] - (double)above[x];
  return 0.25 * (across * across + down * down);
}

static void measure_strip(void *user, size_t begin, size_t end, int worker) {
  detail_job *job = user;
  size_t width = (size_t)job->pair->result->width, height = (size_t)job->pair->result->height;
  float *a = job->rows + (size_t)worker * 6 * width, *b = a + 3 * width;
  float *lumas[2] = {job->lumas + (size_t)worker * 2 * (STRIP + 2) * width, NULL};
  lumas[1] = lumas[0] + (STRIP + 2) * width;
  size_t first = begin > 0 ? begin - 1 : 0, last = end < height ? end : height - 1;
  for (size_t y = first; y <= last; y++) {
    const uint8_t *truth = job->pair->truth->pixels + 4 * y * width;
    double difference = 0;
    size_t count = 0;
    vt_flatten_pair(job->pair, y, a, b);
    take_lumas(a, width, lumas[0] + (y - first) * width), take_lumas(b, width, lumas[1] + (y - first) * width);
    if (y < begin || y >= end) continue;
    for (size_t x = 0; x < width; x++)
      if (truth[4 * x + 3] >= VT_FOREGROUND_BYTE) difference += colour_difference(a + 3 * x, b + 3 * x), count++;
    job->sums[4 * y] = difference, job->sums[4 * y + 1] = (double)count;
  }
  for (size_t y = begin; y < end; y++) {
    const uint8_t *truth = job->pair->truth->pixels + 4 * y * width;
    for (size_t p = 0; p < 2; p++) {
      const float *middle = lumas[p] + (y - first) * width;
      const float *above = y > 0 ? middle - width : middle, *below = y + 1 < height ? middle + width : middle;
      double energy = 0;
      for (size_t x = 0; x < width; x++)
        if (truth[4 * x + 3] >= VT_FOREGROUND_BYTE) energy += gradient_energy(middle, above, below, x, width);
      job->sums[4 * y + 2 + p] = energy;
    }
  }
}

vt_status vt_measure_detail(vt_context *context, const vt_picture_pair *pair, double *delta_e, double *sharpness) {
  size_t width = (size_t)pair->result->width, height = (size_t)pair->result->height;
  size_t workers = (size_t)vt_thread_count(context);
  detail_job job = {.pair = pair};
  double sums[4] = {0, 0, 0, 0};
  vt_status status = VT_OUT_OF_MEMORY;
  job.sums = VT_NEW(context, double, 4 * height);
  job.rows = VT_NEW(context, float, workers * 6 * width);
  job.lumas = VT_NEW(context, float, workers * 2 * (STRIP + 2) * width);
  if (job.sums && job.rows && job.lumas) status = vt_parallel(context, height, STRIP, measure_strip, &job);
  for (size_t y = 0; y < height && !status; y++)
    for (size_t k = 0; k < 4; k++) sums[k] += job.sums[4 * y + k];
  *delta_e = sums[1] > 0 ? sums[0] / sums[1] : (double)NAN;
  *sharpness = sums[3] > 0 ? sums[2] / sums[3] : (double)NAN;
  vt_free(context, job.sums);
  vt_free(context, job.rows);
  vt_free(context, job.lumas);
  return status;
}
