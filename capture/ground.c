// ground.c - what of the picture below the horizon is the tree's
// SPDX-License-Identifier: BSD-3-Clause
//
// A photograph from the ground shows the lower trunk before a meadow, and no sky there to compare it with. What is cut
// there is the trunk alone, by colour: of the things that cross the horizon the one with most above it is the tree; its
// colours just above the horizon (where the sky tells them) against those of the ground farther away give each pixel a
// ratio of likelihoods (Swain and Ballard's histograms), averaged over a small square, taken near the trunk's columns
// only. All other ground is cut away.
//
// What goes wrong: a crown that hangs below the horizon (a photograph from above) is green before green and mostly
// lost; grass before the trunk's foot cuts it. Masks are the cure, and the log says how much of a picture is ground.
#include "capture/ground.h"
#include <math.h>
#include <string.h>

enum { BINS = 12 }; // a channel
#define BAND 0.12f  // of the picture's height above the horizon: where the trunk's colours are taken
#define AWAY 0.08f  // of its width beside the trunk: where the ground's are

typedef struct trunk {
  int x0, x1; // columns, half open; equal: none
} trunk;

static int bin_of(const uint8_t *p) {
  return (p[0] * BINS / 256 * BINS + p[1] * BINS / 256) * BINS + p[2] * BINS / 256;
}

static int horizon_at(const vt_sky *sky, int x) { // the first row of ground
  int y = (int)(sky->horizon[0] + (sky->horizon[1] - sky->horizon[0]) * ((double)x + 0.5) / (double)sky->width + 0.999);
  return y < 0 ? 0 : y > sky->height ? sky->height : y;
}

// The run of columns that are tree just above the horizon and have most tree above them.
static trunk find_trunk(const vt_sky *sky, const uint8_t *strength, uint8_t sure) {
  trunk best = {0, 0};
  int start = 0, near = (int)(0.02f * (float)sky->height) + 2;
  size_t most = 0, mass = 0;
  for (int x = 0; x <= sky->width; x++) {
    int h = x < sky->width ? horizon_at(sky, x) : 0, found = 0;
    size_t above = 0;
    for (int y = 0; y < h; y++) {
      bool is_tree = strength[(size_t)y * (size_t)sky->width + (size_t)x] >= sure;
      above += is_tree;
      found += is_tree && y >= h - near;
    }
    if (h > near && 2 * found > near) {
      mass += above;
      continue;
    }
    if (mass > most) most = mass, best = (trunk){start, x};
    mass = 0, start = x + 1;
  }
  return best;
}

// ln of how much likelier each colour is on the trunk than on the ground.
static void compare_colours(const vt_sky *sky, const vt_image *rgb, const uint8_t *strength, uint8_t sure, trunk t, float *ratio) {
  double on[BINS * BINS * BINS] = {0}, off[BINS * BINS * BINS] = {0}, all_on = 0, all_off = 0;
  int away = (int)(AWAY * (float)sky->width), band = (int)(BAND * (float)sky->height);
  for (int x = 0; x < sky->width; x++) {
    int h = horizon_at(sky, x);
    for (int y = h > band ? h - band : 0; y < h && x >= t.x0 && x < t.x1; y++) {
      size_t p = (size_t)y * (size_t)sky->width + (size_t)x;
      if (strength[p] >= sure) on[bin_of(rgb->pixels + 3 * p)]++, all_on++;
    }
    for (int y = h; y < sky->height && (x < t.x0 - away || x >= t.x1 + away); y++)
      off[bin_of(rgb->pixels + 3 * ((size_t)y * (size_t)sky->width + (size_t)x))]++, all_off++;
  }
  for (int i = 0; i < BINS * BINS * BINS; i++) {
    double a = (on[i] + 1e-3 * all_on / BINS + 1e-9) / (all_on + 1e-6), b = (off[i] + 1e-3 * all_off / BINS + 1e-9) / (all_off + 1e-6);
    ratio[i] = (float)fmax(fmin(log(a / b), 4), -4);
  }
}

// Sums over squares of the given radius; in place, one axis after the other, through a line.
static void smooth(float *values, int width, int height, int radius, float *line) {
  for (int pass = 0; pass < 2; pass++) {
    int length = pass ? height : width, lines = pass ? width : height;
    size_t step = pass ? (size_t)width : 1, next = pass ? 1 : (size_t)width;
    for (int l = 0; l < lines; l++) {
      float *v = values + (size_t)l * next;
      for (int i = 0; i < length; i++) {
        line[i] = 0;
        for (int k = i > radius ? i - radius : 0; k <= i + radius && k < length; k++) line[i] += v[(size_t)k * step];
      }
      for (int i = 0; i < length; i++) v[(size_t)i * step] = line[i];
    }
  }
}

static vt_status cut_trunk(vt_context *context, const vt_sky *sky, const vt_image *rgb, trunk t, const float *ratio, uint8_t sure,
                           uint8_t *strength) {
  int reach = (t.x1 - t.x0) / 2 + 2, x0 = t.x0 > reach ? t.x0 - reach : 0;
  int x1 = t.x1 + reach < sky->width ? t.x1 + reach : sky->width;
  int y0 = horizon_at(sky, x0) < horizon_at(sky, x1 - 1) ? horizon_at(sky, x0) : horizon_at(sky, x1 - 1);
  int width = x1 - x0, height = sky->height - y0, longer = width > height ? width : height;
  if (width < 1 || height < 1) return VT_OK;
  float *values = VT_NEW(context, float, (size_t)width *(size_t)height), *line = VT_NEW(context, float, (size_t)longer);
  for (int y = 0; y < height && values && line; y++)
    for (int x = 0; x < width; x++)
      values[(size_t)y * (size_t)width + (size_t)x] =
          ratio[bin_of(rgb->pixels + 3 * ((size_t)(y + y0) * (size_t)sky->width + (size_t)(x + x0)))];
  if (values && line) smooth(values, width, height, sky->width / 300 + 1, line);
  for (int y = 0; y < height && values && line; y++)
    for (int x = 0; x < width; x++)
      if (vt_is_ground(sky, x + x0, y + y0) && values[(size_t)y * (size_t)width + (size_t)x] > 0)
        strength[(size_t)(y + y0) * (size_t)sky->width + (size_t)(x + x0)] = sure;
  vt_status status = values && line ? VT_OK : VT_OUT_OF_MEMORY;
  vt_free(context, values);
  vt_free(context, line);
  return status;
}

vt_status vt_cut_ground(vt_context *context, const vt_sky *sky, const vt_image *rgb, uint8_t sure, uint8_t *strength) {
  if (sky->horizon[0] >= sky->height && sky->horizon[1] >= sky->height) return VT_OK;
  trunk t = find_trunk(sky, strength, sure);
  float ratio[BINS * BINS * BINS];
  compare_colours(sky, rgb, strength, sure, t, ratio);
  for (int y = 0; y < rgb->height; y++)
    for (int x = 0; x < rgb->width; x++)
      if (vt_is_ground(sky, x, y)) strength[(size_t)y * (size_t)rgb->width + (size_t)x] = 0;
  return t.x1 > t.x0 ? cut_trunk(context, sky, rgb, t, ratio, sure, strength) : VT_OK;
}
