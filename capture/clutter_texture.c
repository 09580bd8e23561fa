// clutter_texture.c - how rough a picture is, and where it is as smooth as no tree is
// SPDX-License-Identifier: BSD-3-Clause
//
// Landmarks stand on corners, so walls, floors, ceilings and skies have hardly any, and nothing would speak for them.
// But leaves and bark are rough everywhere: where CIELab changes by less than a little from pixel to pixel, over a
// square wider than a leaf, there is no tree. The mean step over the square is compared with that of noise and JPEG.
// The dark says nothing, for it is smooth inside crowns as well. How rough a place is also is a fourth axis beside the
// colour's three (clutter_colours.c): brown bark is told from a brown wall.

#include "capture/clutter.h"

enum { REACH = 6 };      // pixels, half the square's side
#define SMOOTH_STEP 2.2f // mean CIELab distance of neighbours at which smooth ends
#define DARK 12.0f       // L

// Sums of each row's squares' width, then of columns, by running sums.
static void box_sum(int width, int height, float *values, float *line) {
  for (int y = 0; y < height; y++) {
    float *row = values + (size_t)y * (size_t)width, sum = 0;
    for (int x = 0; x < width; x++) line[x] = row[x];
    for (int x = -REACH; x < width; x++) {
      if (x + REACH < width) sum += line[x + REACH];
      if (x - REACH - 1 >= 0) sum -= line[x - REACH - 1];
      if (x >= 0) row[x] = sum;
    }
  }
  for (int x = 0; x < width; x++) {
    float sum = 0;
    for (int y = 0; y < height; y++) line[y] = values[(size_t)y * (size_t)width + (size_t)x];
    for (int y = -REACH; y < height; y++) {
      if (y + REACH < height) sum += line[y + REACH];
      if (y - REACH - 1 >= 0) sum -= line[y - REACH - 1];
      if (y >= 0) values[(size_t)y * (size_t)width + (size_t)x] = sum;
    }
  }
}

static float covered(int at, int size) { // pixels of the square's side that lie in the picture
  int low = at - REACH < 0 ? 0 : at - REACH, high = at + REACH >= size ? size - 1 : at + REACH;
  return (float)(high - low + 1);
}

float vt_smoothness(const float lab[3], float step) {
  return fmaxf(0, 1 - step / SMOOTH_STEP) * fminf(1, lab[0] / DARK);
}

vt_status vt_find_steps(vt_context *context, int width, int height, const float *lab, float *steps) {
  float *line = VT_NEW(context, float, (size_t)(width > height ? width : height));
  if (!line) return VT_OUT_OF_MEMORY;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      size_t p = (size_t)y * (size_t)width + (size_t)x, right = x + 1 < width ? p + 1 : p,
             below = y + 1 < height ? p + (size_t)width : p;
      float sum = 0;
      for (size_t c = 0; c < 3; c++)
        sum += fabsf(lab[3 * right + c] - lab[3 * p + c]) + fabsf(lab[3 * below + c] - lab[3 * p + c]);
      steps[p] = sum;
    }
  box_sum(width, height, steps, line);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      steps[(size_t)y * (size_t)width + (size_t)x] /= covered(x, width) * covered(y, height);
  vt_free(context, line);
  return VT_OK;
}
