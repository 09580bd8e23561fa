// jpeg_loss.c - what a JPEG of a given quality leaves of a picture
// SPDX-License-Identifier: BSD-3-Clause
//
// ITU-T T.81: colours to luma and two chromas (JFIF), chroma halved both ways by the mean of four, blocks of 8x8 to
// their cosine transform, each coefficient rounded to a multiple of its step, and all of it back. Entropy coding loses
// nothing and is left out. Steps are the tables of annex K, scaled by quality as the Independent JPEG Group's library
// does, whose decoder also fixes how chroma is spread again: 3/4 of the nearer sample and 1/4 of the farther, in both
// directions. Samples are rounded to bytes where a file's would be.

#include "datasets-synthetic/jpeg_loss.h"
#include "base/vector.h"

static const uint8_t luma_steps[64] = {16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,
                                       14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,
                                       18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,
                                       49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};
static const uint8_t chroma_steps[64] = {17, 18, 24, 47, 99, 99, 99, 99, 18, 21, 26, 66, 99, 99, 99, 99,
                                         24, 26, 56, 99, 99, 99, 99, 99, 47, 66, 99, 99, 99, 99, 99, 99,
                                         99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
                                         99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99};

typedef struct plane {
  int width, height; // whole blocks
  float *samples;    // 0..255
} plane;

static float round_byte(float v) {
  return floorf(fminf(fmaxf(v, 0), 255) + 0.5f);
}

static void make_cosines(float cosines[8][8]) { // [frequency][place]
  for (int u = 0; u < 8; u++)
    for (int x = 0; x < 8; x++) cosines[u][x] = (float)((u ? 0.5 : sqrt(0.125)) * cos((2 * x + 1) * u * VT_PI / 16));
}

static void lose_block(float *at, size_t row, const float steps[64], float cosines[8][8]) {
  float half[8][8], whole[8][8];
  for (int y = 0; y < 8; y++)
    for (int u = 0; u < 8; u++) {
      half[y][u] = 0;
      for (int x = 0; x < 8; x++) half[y][u] += cosines[u][x] * (at[(size_t)y * row + (size_t)x] - 128);
    }
  for (int v = 0; v < 8; v++)
    for (int u = 0; u < 8; u++) {
      float sum = 0;
      for (int y = 0; y < 8; y++) sum += cosines[v][y] * half[y][u];
      whole[v][u] = roundf(sum / steps[8 * v + u]) * steps[8 * v + u];
    }
  for (int v = 0; v < 8; v++)
    for (int x = 0; x < 8; x++) {
      half[v][x] = 0;
      for (int u = 0; u < 8; u++) half[v][x] += cosines[u][x] * whole[v][u];
    }
  for (int y = 0; y < 8; y++)
    for (int x = 0; x < 8; x++) {
      float sum = 128;
      for (int v = 0; v < 8; v++) sum += cosines[v][y] * half[v][x];
      at[(size_t)y * row + (size_t)x] = round_byte(sum);
    }
}

static void lose_plane(const plane *p, const uint8_t *table, int quality) {
  float cosines[8][8], steps[64];
  int scale = quality < 50 ? 5000 / quality : 200 - 2 * quality;
  for (int i = 0; i < 64; i++) steps[i] = fminf(fmaxf((float)((table[i] * scale + 50) / 100), 1), 255);
  make_cosines(cosines);
  for (int y = 0; y < p->height; y += 8)
    for (int x = 0; x < p->width; x += 8)
      lose_block(p->samples + (size_t)y * (size_t)p->width + (size_t)x, (size_t)p->width, steps, cosines);
}

// Luma, blue and red of pixels that repeat beyond the frame.
static void split_pixel(const uint8_t *rgba, int width, int height, int x, int y, float out[3]) {
  x = x < width ? x : width - 1, y = y < height ? y : height - 1;
  const uint8_t *p = rgba + 4 * ((size_t)y * (size_t)width + (size_t)x);
  out[0] = round_byte(0.299f * p[0] + 0.587f * p[1] + 0.114f * p[2]);
  out[1] = round_byte(128 - 0.168735892f * p[0] - 0.331264108f * p[1] + 0.5f * p[2]);
  out[2] = round_byte(128 + 0.5f * p[0] - 0.418687589f * p[1] - 0.081312411f * p[2]);
}

static void split_picture(const uint8_t *rgba, int width, int height, plane planes[3]) {
  for (int y = 0; y < planes[0].height; y += 2)
    for (int x = 0; x < planes[0].width; x += 2) {
      float sums[2] = {0, 0};
      for (int k = 0; k < 4; k++) {
        float parts[3];
        int px = x + k % 2, py = y + k / 2;
        split_pixel(rgba, width, height, px, py, parts);
        planes[0].samples[(size_t)py * (size_t)planes[0].width + (size_t)px] = parts[0];
        sums[0] += parts[1], sums[1] += parts[2];
      }
      size_t at = (size_t)(y / 2) * (size_t)planes[1].width + (size_t)(x / 2);
      for (int c = 0; c < 2; c++) planes[1 + c].samples[at] = round_byte(sums[c] / 4);
    }
}

// Of a picture of width x height chroma samples that count; beyond them the last is repeated.
static float spread_chroma(const plane *p, int width, int height, int x, int y) {
  int near_x = x / 2, near_y = y / 2, far_x = near_x + (x % 2 ? 1 : -1), far_y = near_y + (y % 2 ? 1 : -1);
  far_x = far_x < 0 ? 0 : far_x >= width ? width - 1 : far_x;
  far_y = far_y < 0 ? 0 : far_y >= height ? height - 1 : far_y;
  const float *near_row = p->samples + (size_t)near_y * (size_t)p->width;
  const float *far_row = p->samples + (size_t)far_y * (size_t)p->width;
  return round_byte((9 * near_row[near_x] + 3 * near_row[far_x] + 3 * far_row[near_x] + far_row[far_x]) / 16);
}

void vt_lose_jpeg(uint8_t *rgba, int width, int height, int quality, float *scratch) {
  int wide = (width + 15) / 16 * 16, high = (height + 15) / 16 * 16;
  size_t quarter = (size_t)(wide / 2) * (size_t)(high / 2);
  plane planes[3] = {
      {wide, high, scratch}, {wide / 2, high / 2, scratch + 4 * quarter}, {wide / 2, high / 2, scratch + 5 * quarter}};
  split_picture(rgba, width, height, planes);
  for (int c = 0; c < 3; c++) lose_plane(&planes[c], c ? chroma_steps : luma_steps, quality);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      uint8_t *out = rgba + 4 * ((size_t)y * (size_t)width + (size_t)x);
      float luma = planes[0].samples[(size_t)y * (size_t)wide + (size_t)x];
      float blue = spread_chroma(&planes[1], (width + 1) / 2, (height + 1) / 2, x, y) - 128;
      float red = spread_chroma(&planes[2], (width + 1) / 2, (height + 1) / 2, x, y) - 128;
      out[0] = (uint8_t)round_byte(luma + 1.402f * red);
      out[1] = (uint8_t)round_byte(luma - 0.344136286f * blue - 0.714136286f * red);
      out[2] = (uint8_t)round_byte(luma + 1.772f * blue);
    }
}
