// damage_matte.c - mattes cut badly
// SPDX-License-Identifier: BSD-3-Clause
//
// Erosion by a fraction of a pixel: the smallest of the matte's values within a disc, where values between pixels are
// read bilinearly. A straight soft edge then moves by exactly the radius, in any direction: reading the ramp at a
// distance r along its normal shifts it by r. The disc is a set of rings a pixel apart, two points to a pixel of
// their length.
//
// Colours of transparent pixels are unknown (zero). Where a matte grows, or a JPEG mixes neighbours, they must not be
// black: a pyramid of alpha-weighted sums gives each the mean colour of the smallest square around it that shows
// anything.

#include "datasets-synthetic/damage_matte.h"
#include "base/vector.h"

// ---- colours under nothing

typedef struct floor_level {
  int width, height;
  float *sums; // [height][width][4]: alpha-weighted colour and alpha
} floor_level;

static void sum_up(const floor_level *fine, const floor_level *coarse) {
  for (int y = 0; y < coarse->height; y++)
    for (int x = 0; x < coarse->width; x++) {
      float *out = coarse->sums + 4 * ((size_t)y * (size_t)coarse->width + (size_t)x);
      for (int c = 0; c < 4; c++) out[c] = 0;
      for (int j = 2 * y; j < 2 * y + 2 && j < fine->height; j++)
        for (int i = 2 * x; i < 2 * x + 2 && i < fine->width; i++)
          for (int c = 0; c < 4; c++)
            out[c] += fine->sums[4 * ((size_t)j * (size_t)fine->width + (size_t)i) + (size_t)c];
    }
}

static void hand_down(const floor_level *coarse, const floor_level *fine) {
  for (int y = 0; y < fine->height; y++)
    for (int x = 0; x < fine->width; x++) {
      float *out = fine->sums + 4 * ((size_t)y * (size_t)fine->width + (size_t)x);
      const float *from = coarse->sums + 4 * ((size_t)(y / 2) * (size_t)coarse->width + (size_t)(x / 2));
      for (int c = 0; c < 4 && !(out[3] > 0); c++) out[c] = c < 3 ? from[c] / fmaxf(from[3], 1e-20f) : 1;
    }
}

void vt_fill_transparent(uint8_t *rgba, int width, int height, float *scratch) {
  floor_level levels[20] = {{width, height, scratch}};
  size_t count = (size_t)width * (size_t)height;
  int top = 0;
  for (size_t i = 0; i < count; i++) {
    float alpha = (float)rgba[4 * i + 3] / 255;
    for (size_t c = 0; c < 3; c++) scratch[4 * i + c] = alpha * (float)rgba[4 * i + c];
    scratch[4 * i + 3] = alpha;
  }
  for (; levels[top].width > 1 || levels[top].height > 1; top++) {
    const floor_level *l = &levels[top];
    levels[top + 1] =
        (floor_level){(l->width + 1) / 2, (l->height + 1) / 2, l->sums + 4 * (size_t)l->width * (size_t)l->height};
    sum_up(l, &levels[top + 1]);
  }
  if (!(levels[top].sums[3] > 0)) return; // there is no colour at all
  for (; top > 0; top--) hand_down(&levels[top], &levels[top - 1]);
  for (size_t i = 0; i < count; i++)
    for (size_t c = 0; c < 3 && !rgba[4 * i + 3]; c++)
      rgba[4 * i + c] = (uint8_t)fminf(fmaxf(scratch[4 * i + c] + 0.5f, 0), 255);
}

// ---- erosion

enum { POINT_LIMIT = 2048 };

typedef struct reading { // bilinear, at an offset
  int x, y;
  float fx, fy;
} reading;

static int make_disc(double radius, reading *points) {
  int count = 0;
  for (double r = radius; r > 1e-9; r -= 1) {
    int around = (int)fmax(16, ceil(4 * VT_PI * r));
    for (int k = 0; k < around; k++) {
      double x = r * cos(2 * VT_PI * k / around), y = r * sin(2 * VT_PI * k / around);
      VT_ASSERT(count < POINT_LIMIT);
      reading *p = &points[count++];
      p->x = (int)floor(x), p->y = (int)floor(y), p->fx = (float)(x - p->x), p->fy = (float)(y - p->y);
    }
  }
  return count;
}

static float read_matte(const float *alpha, int width, int height, int x, int y) {
  x = x < 0 ? 0 : x >= width ? width - 1 : x, y = y < 0 ? 0 : y >= height ? height - 1 : y;
  return alpha[(size_t)y * (size_t)width + (size_t)x];
}

static float lowest_around(const float *alpha, int width, int height, int x, int y, const reading *points, int count) {
  float lowest = alpha[(size_t)y * (size_t)width + (size_t)x];
  for (int k = 0; k < count && lowest > 0; k++) {
    const reading *p = &points[k];
    int px = x + p->x, py = y + p->y;
    float upper =
        (1 - p->fx) * read_matte(alpha, width, height, px, py) + p->fx * read_matte(alpha, width, height, px + 1, py);
    float lower = (1 - p->fx) * read_matte(alpha, width, height, px, py + 1) +
                  p->fx * read_matte(alpha, width, height, px + 1, py + 1);
    lowest = fminf(lowest, (1 - p->fy) * upper + p->fy * lower);
  }
  return lowest;
}

void vt_erode_matte(float *alpha, int width, int height, double pixels, float *scratch) {
  reading points[POINT_LIMIT];
  size_t size = (size_t)width * (size_t)height;
  int count = make_disc(fabs(pixels), points);
  for (size_t i = 0; i < size && pixels < 0; i++) alpha[i] = 1 - alpha[i]; // to grow is to erode what is not there
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      scratch[(size_t)y * (size_t)width + (size_t)x] = lowest_around(alpha, width, height, x, y, points, count);
  for (size_t i = 0; i < size; i++) alpha[i] = pixels < 0 ? 1 - scratch[i] : scratch[i];
}

// ---- holes

// What is lost by a hole around (x, y).
static double punch(float *alpha, int width, int height, double x, double y, double radius) {
  double lost = 0;
  int reach = (int)ceil(radius + 1);
  for (int j = (int)y - reach; j <= (int)y + reach; j++)
    for (int i = (int)x - reach; i <= (int)x + reach; i++) {
      if (i < 0 || j < 0 || i >= width || j >= height) continue;
      double open = fmin(fmax(radius + 0.5 - hypot(i + 0.5 - x, j + 0.5 - y), 0), 1);
      float *a = &alpha[(size_t)j * (size_t)width + (size_t)i];
      lost += open * (double)*a;
      *a *= (float)(1 - open);
    }
  return lost;
}

void vt_punch_matte(float *alpha, int width, int height, double share, vt_rng *rng) {
  size_t size = (size_t)width * (size_t)height;
  double area = 0, lost = 0;
  for (size_t i = 0; i < size; i++) area += (double)alpha[i];
  for (size_t turn = 0; turn < 400 * size && lost < share * area; turn++) {
    double x = vt_random_between(rng, 0, width), y = vt_random_between(rng, 0, height);
    double radius = vt_random_between(rng, 1, 2);
    if (alpha[(size_t)y * (size_t)width + (size_t)x] > 0.25f) lost += punch(alpha, width, height, x, y, radius);
  }
}
