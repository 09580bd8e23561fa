// sky.c - alpha and colours of a tree before the sky
// SPDX-License-Identifier: BSD-3-Clause
//
// 0. chroma.c puts back the detail of colour that JPEG took, where it did.
// 1. sky_model.c gives B, the sky's colour behind each pixel, and how far a pixel is from it in standard deviations.
// 2. What hangs on enough pixels far from the sky is tree, and a pixel around it; the rest is sky.
// 3. Light mixes in linear light: I = alpha F + (1-alpha) B. B is known. F is one of the colours of the tree that occur
//    unmixed near by (palette.c); for each of them, with the variance v_c of a channel from sensor, palette and sky,
//      alpha_k = sum_c (I-B)_c (F_k-B)_c / v_c / sum_c (F_k-B)_c^2 / v_c,   r_k^2 = sum_c (I - B - alpha_k (F_k-B))_c^2 / v_c
//    and alpha is their mean with weights exp(-r_k^2/2): where two colours explain a pixel alike, neither is guessed.
//    (Ruzon, Tomasi, CVPR 2000; Chuang, Curless, Salesin, Szeliski, CVPR 2001, with B certain.)
// 4. 0 <= F <= 1 bounds alpha from below: alpha >= max_c max((I_c-B_c)/(1-B_c), (B_c-I_c)/B_c). Before a blue sky that is
//    most of the answer, since leaves leave no blue.
// 5. F = F_k + alpha (I - (1-alpha) B - alpha F_k) / (alpha^2 + lambda): the pixel's own colour where alpha is high, the
//    palette's where it is low. What has alpha 0 gets the colour near it.
//
// A dark leaf of linear .05 before a sky of .9 covering half a pixel has sRGB .71 there; solved on encoded values that
// is alpha .33. So the matte of a sky is solved in linear light, though voltree composites encoded values elsewhere.
//
// What goes wrong: what neither is sky nor tree stays (clutter: poles, houses), and is left to the hull of all views;
// below the horizon see ground.c.
#include "capture/chroma.h"
#include "capture/components.h"
#include "capture/ground.h"
#include "capture/matte.h"
#include "capture/palette.h"
#include "capture/sky_model.h"
#include "capture/spread.h"
#include "base/lab.h"
#include <math.h>
#include <string.h>

#define STEPS 4.0f    // of the distance, per standard deviation, in a byte
#define DOUBTFUL 3.0f // standard deviations from which a pixel that hangs on the tree is no sky
#define SURE 6.0f     // from which a pixel is tree
#define FEW 1e-6      // share of the picture below which a spot is a speck
#define UNMIXED 0.9f // lowest possible alpha from which a pixel's colour is the tree's
#define RIDGE 0.05f   // lambda
#define STRANGE 16.0f // r^2 from which a pixel is rather all tree, of a colour that the palette has not
enum { SKY = VT_PART_NONE, COARSE = 4 };

typedef struct sky_matte {
  const vt_image *photo;
  vt_image sharp;      // the photograph with the detail of colour that JPEG took
  const vt_image *rgb; // that
  int smear;           // how far it was smeared, 0..2 pixels
  vt_sky sky;
  int width, height;
  size_t count;
  uint8_t *strength; // [height][width] distance from the sky, STEPS per standard deviation; later alpha
  uint8_t *parts, *known;
  float linear[256], sensor[256]; // linear light of a byte; variance of light there
  vt_palette palette;
} sky_matte;

static void fill_tables(sky_matte *m) {
  vt_fill_srgb_table(m->linear);
  float noise = m->sky.noise + 1 + 0.5f * (float)m->smear; // what is put back is less sure
  for (int i = 0; i < 256; i++) {
    int low = i > 0 ? i - 1 : 0, high = i < 255 ? i + 1 : 255;
    float slope = (m->linear[high] - m->linear[low]) / (float)(high - low) * noise;
    m->sensor[i] = slope * slope + 4e-6f;
  }
}

static float linear_of(const sky_matte *m, float level) {
  int i = (int)level;
  if (i < 0) return 0;
  if (i >= 255) return m->linear[255];
  return m->linear[i] + (level - (float)i) * (m->linear[i + 1] - m->linear[i]);
}

static void light_behind(const sky_matte *m, int x, int y, float light[3]) {
  float level[3];
  vt_sky_colour(&m->sky, x, y, level);
  for (int c = 0; c < 3; c++) light[c] = linear_of(m, level[c]);
}

// What 0 <= F <= 1 demands, with a margin for noise and for what B is not known to.
static float lowest_alpha(const sky_matte *m, const uint8_t *pixel, const float b[3]) {
  float least = 0;
  for (int c = 0; c < 3; c++) {
    float i = m->linear[pixel[c]], d = i - b[c], margin = 2 * sqrtf(m->sensor[pixel[c]]) + 0.02f;
    if (pixel[c] >= 254 && d > 0) continue; // clipped: it may be any brighter
    float bound = d > 0 ? (d - margin) / fmaxf(1 - b[c], 0.1f) : (-d - margin) / fmaxf(b[c], 0.02f);
    least = fmaxf(least, bound);
  }
  return fminf(least, 1);
}

// Tree, sky, and what is a speck.
static vt_status cut(vt_context *context, sky_matte *m) {
  if (!(m->sky.share > 0)) {
    memset(m->parts, VT_PART_SURE, m->count);
    return VT_OK;
  }
  for (int y = 0; y < m->height; y++)
    for (int x = 0; x < m->width; x++) {
      size_t p = (size_t)y * (size_t)m->width + (size_t)x;
      m->strength[p] = (uint8_t)(STEPS * vt_sky_distance(&m->sky, m->rgb->pixels + 3 * p, x, y));
    }
  vt_status status = vt_cut_ground(context, &m->sky, m->rgb, (uint8_t)(SURE * STEPS), m->strength);
  if (status) return status;
  status = vt_find_parts(context, m->width, m->height, m->strength, (uint8_t)(DOUBTFUL * STEPS), (uint8_t)(SURE * STEPS),
                         (size_t)(FEW * (double)m->count) + 3, 0, m->parts);
  for (size_t p = 0; p < m->count && !status; p++) m->known[p] = m->parts[p] == VT_PART_SURE;
  if (!status) vt_dilate(m->width, m->height, 1, m->known, m->strength);
  for (size_t p = 0; p < m->count && !status; p++)
    if (m->parts[p] == SKY && m->known[p]) m->parts[p] = VT_PART_DOUBTFUL;
  return status;
}

// Marks in `known` what shows the tree's colour unmixed.
static void find_unmixed(sky_matte *m) {
  for (int y = 0; y < m->height; y++)
    for (int x = 0; x < m->width; x++) {
      size_t p = (size_t)y * (size_t)m->width + (size_t)x;
      m->known[p] = 0;
      if (m->parts[p] != VT_PART_SURE) continue;
      float b[3];
      light_behind(m, x, y, b);
      bool inside = x > 0 && y > 0 && x + 1 < m->width && y + 1 < m->height && m->parts[p - 1] == VT_PART_SURE &&
                    m->parts[p + 1] == VT_PART_SURE && m->parts[p - (size_t)m->width] == VT_PART_SURE &&
                    m->parts[p + (size_t)m->width] == VT_PART_SURE;
      float lowest = lowest_alpha(m, m->rgb->pixels + 3 * p, b);
      m->known[p] = lowest > UNMIXED || (inside && lowest > 0.9f * UNMIXED);
    }
}

// Alpha, and the tree's colour in linear light, of a mixed pixel.
static float solve_pixel(const sky_matte *m, const vt_palette_cell *cell, const uint8_t *pixel, float distance, const float b[3],
                         float f[3]) {
  float weights = 1e-20f, alpha = 0, sum[3] = {0}, least = lowest_alpha(m, pixel, b);
  for (int k = 0; k < cell->count; k++) {
    float dot = 0, length2 = 0, v[3], r2 = 0;
    for (int c = 0; c < 3; c++) {
      v[c] = 1 / (m->sensor[pixel[c]] + cell->variance[k][c] + 4e-5f);
      float d = cell->light[k][c] - b[c];
      dot += (m->linear[pixel[c]] - b[c]) * d * v[c];
      length2 += d * d * v[c];
    }
    float a = fminf(fmaxf(dot / (length2 + 1e-6f), least), 1);
    for (int c = 0; c < 3; c++) {
      float r = m->linear[pixel[c]] - b[c] - a * (cell->light[k][c] - b[c]);
      r2 += r * r * v[c];
    }
    float w = expf(-0.5f * fminf(r2, 60)) * (length2 > 1 ? 1 : length2);
    weights += w, alpha += w * a;
    for (int c = 0; c < 3; c++) sum[c] += w * cell->light[k][c];
  }
  float colours = weights;
  weights += expf(-0.5f * fminf(distance * distance, 60)); // all sky
  bool may_be_sky = vt_is_sky_colour(&m->sky, pixel) || (pixel[2] > pixel[0] + 8 && pixel[2] > pixel[1] + 8);
  float strange = may_be_sky ? 0 : expf(-0.5f * STRANGE);
  weights += strange, colours += strange, alpha += strange;
  for (int c = 0; c < 3; c++) sum[c] += strange * m->linear[pixel[c]];
  alpha = fmaxf(alpha / weights, least);
  for (int c = 0; c < 3; c++) {
    float palette = sum[c] / colours, rest = m->linear[pixel[c]] - (1 - alpha) * b[c] - alpha * palette;
    f[c] = palette + alpha * rest / (alpha * alpha + RIDGE);
  }
  return alpha;
}

static uint8_t encode(float light) {
  float l = fminf(fmaxf(light, 0), 1);
  return (uint8_t)(255 * (l <= 0.0031308f ? 12.92f * l : 1.055f * powf(l, 1 / 2.4f) - 0.055f) + 0.5f);
}

static void solve(const sky_matte *m, vt_image *out) {
  for (int y = 0; y < m->height; y++)
    for (int x = 0; x < m->width; x++) {
      size_t p = (size_t)y * (size_t)m->width + (size_t)x;
      const uint8_t *pixel = m->rgb->pixels + 3 * p;
      const vt_palette_cell *cell = vt_palette_at(&m->palette, x, y);
      memcpy(out->pixels + 4 * p, m->photo->pixels + 3 * p, 3);
      bool tree = m->parts[p] != SKY;
      out->pixels[4 * p + 3] = tree ? 255 : 0;
      if (!tree || !cell->count || !(m->sky.share > 0) || vt_is_ground(&m->sky, x, y)) continue;
      float b[3], f[3];
      light_behind(m, x, y, b);
      float alpha = solve_pixel(m, cell, pixel, vt_sky_distance(&m->sky, pixel, x, y), b, f);
      alpha = alpha < 0.03f ? 0 : alpha > 0.97f ? 1 : alpha;
      out->pixels[4 * p + 3] = (uint8_t)(alpha * 255 + 0.5f);
      for (int c = 0; c < 3 && alpha < 1; c++) out->pixels[4 * p + (size_t)c] = encode(f[c]);
    }
}

// Mean colours of the tree in blocks of COARSE pixels, and which have any.
static void reduce_tree(const vt_image *rgba, vt_image *blocks, uint8_t *known) {
  for (int row = 0; row < blocks->height; row++)
    for (int column = 0; column < blocks->width; column++) {
      unsigned sum[3] = {0}, n = 0;
      size_t block = (size_t)row * (size_t)blocks->width + (size_t)column;
      for (int y = row * COARSE; y < (row + 1) * COARSE && y < rgba->height; y++)
        for (int x = column * COARSE; x < (column + 1) * COARSE && x < rgba->width; x++) {
          const uint8_t *p = rgba->pixels + 4 * ((size_t)y * (size_t)rgba->width + (size_t)x);
          if (p[3] <= 25) continue;
          for (int c = 0; c < 3; c++) sum[c] += p[c];
          n++;
        }
      known[block] = n > 0;
      for (size_t c = 0; c < 3 && n; c++) blocks->pixels[3 * block + c] = (uint8_t)((sum[c] + n / 2) / n);
    }
}

// Colours of the tree where nothing of it is seen, from those near by; blocks save the memory of a whole picture.
static vt_status fill_clear(vt_context *context, vt_image *rgba) {
  vt_image blocks = {0}, filled = {0};
  int columns = (rgba->width + COARSE - 1) / COARSE, rows = (rgba->height + COARSE - 1) / COARSE;
  uint8_t *known = VT_NEW(context, uint8_t, (size_t)columns *(size_t)rows);
  vt_status status = known ? vt_make_image(context, columns, rows, 3, &blocks) : VT_OUT_OF_MEMORY;
  if (!status) {
    reduce_tree(rgba, &blocks, known);
    status = vt_spread_colours(context, &blocks, known, &filled);
  }
  for (int y = 0; y < rgba->height && !status; y++)
    for (int x = 0; x < rgba->width; x++) {
      uint8_t *p = rgba->pixels + 4 * ((size_t)y * (size_t)rgba->width + (size_t)x);
      if (p[3] == 0) memcpy(p, filled.pixels + 3 * ((size_t)(y / COARSE) * (size_t)columns + (size_t)(x / COARSE)), 3);
    }
  vt_free(context, known);
  vt_free_image(context, &blocks);
  vt_free_image(context, &filled);
  return status;
}

static void show_trimap(vt_context *context, const sky_matte *m, const char *name) {
  vt_fimage image = {0};
  char title[96];
  snprintf(title, sizeof title, "trimap-%s", name);
  for (char *c = title; *c; c++)
    if (*c == '/' || *c == '.') *c = '-';
  if (vt_make_fimage(context, m->width, m->height, 1, &image) != VT_OK) return;
  for (size_t i = 0; i < m->count; i++) image.pixels[i] = m->parts[i] == SKY ? 0 : m->known[i] ? 1 : 0.5f;
  vt_probe(context, title, &image);
  vt_free_fimage(context, &image);
}

static void free_sky_matte(vt_context *context, sky_matte *m) {
  vt_free_palette(context, &m->palette);
  vt_free(context, m->strength);
  vt_free(context, m->parts);
  vt_free(context, m->known);
  vt_free_sky(context, &m->sky);
  vt_free_image(context, &m->sharp);
}

// Up to what is certain: parts, and in `known` what is unmixed.
static vt_status prepare(vt_context *context, const vt_image *rgb, sky_matte *m) {
  VT_ASSERT(rgb->channels == 3 && rgb->width > 0 && rgb->height > 0);
  *m = (sky_matte){.photo = rgb, .width = rgb->width, .height = rgb->height, .smear = vt_measure_smear(rgb)};
  m->count = (size_t)rgb->width * (size_t)rgb->height;
  m->rgb = &m->sharp;
  vt_status status = vt_sharpen_chroma(context, rgb, m->smear, &m->sharp);
  if (!status) status = vt_model_sky(context, m->rgb, &m->sky);
  m->strength = VT_NEW(context, uint8_t, m->count);
  m->parts = VT_NEW(context, uint8_t, m->count);
  m->known = VT_NEW(context, uint8_t, m->count);
  if (!status && (!m->strength || !m->parts || !m->known)) status = VT_OUT_OF_MEMORY;
  if (status) return status;
  fill_tables(m);
  status = cut(context, m);
  if (!status) find_unmixed(m);
  return status;
}

vt_status vt_cut_sky(vt_context *context, const vt_image *rgb, vt_image *out) {
  sky_matte m;
  vt_status status = prepare(context, rgb, &m);
  if (!status) status = vt_make_image(context, rgb->width, rgb->height, 1, out);
  for (size_t i = 0; i < m.count && !status; i++) out->pixels[i] = m.parts[i] == SKY ? 0 : m.known[i] ? 255 : 128;
  free_sky_matte(context, &m);
  return status;
}

vt_status vt_matte_sky(vt_context *context, const vt_image *rgb, const char *name, vt_image *out_rgba) {
  sky_matte m;
  vt_status status = prepare(context, rgb, &m);
  if (!status && !(m.sky.share > 0)) vt_log(context, VT_LOG_NORMAL, "%s: no sky is seen in it; all of it counts as tree", name);
  if (!status && vt_wants_probes(context)) show_trimap(context, &m, name);
  if (!status) status = vt_make_palette(context, m.rgb, m.known, &m.palette);
  if (!status) status = vt_make_image(context, rgb->width, rgb->height, 4, out_rgba);
  if (!status) solve(&m, out_rgba);
  vt_free_palette(context, &m.palette);
  if (!status) status = fill_clear(context, out_rgba);
  free_sky_matte(context, &m);
  if (status) vt_free_image(context, out_rgba);
  return status;
}
