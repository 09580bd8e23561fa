// foreground.c - colours of the plant where the backdrop shines through
// SPDX-License-Identifier: BSD-3-Clause
//
// Given I and alpha, finds F and B of I = alpha F + (1-alpha) B that are smooth where alpha changes: they minimise
// over the pixels i with 0 < alpha < 1 and their four neighbours j
//   (alpha_i F_i + (1-alpha_i) B_i - I_i)^2 + sum_j (epsilon + omega |alpha_i - alpha_j|) ((F_i-F_j)^2 + (B_i-B_j)^2)
// per channel, each pixel in turn a 2x2 system (Germer, Uelwer, Conrad, Harmeling, "Fast multi-level foreground
// estimation", ICPR 2020). They solve it on a pyramid of reduced pictures; for thin twigs the upper levels have alpha
// near 0 everywhere, and F there is noise divided by alpha. Here the far range comes from spreading the colours of
// opaque pixels (F) and of clear ones (B) by pull and push instead, and only the pixels between are iterated.
// The colour of an opaque pixel is never changed. Pixels of alpha 0 get the colour of the plant near them, so that
// bilinear sampling later never meets the backdrop. What goes wrong: a mask that is too large keeps its rim of backdrop.
#include "capture/matte.h"
#include "capture/spread.h"
#include <string.h>

enum { ROUNDS = 8 };
#define EPSILON 0.01f
#define OMEGA 1.0f

typedef struct blend {
  int width, height;
  const uint8_t *rgba; // I and alpha
  uint8_t *f, *b;      // [height][width][3]
} blend;

// The 2x2 system of one pixel; its matrix is the same for the three channels.
static void solve_pixel(const blend *m, int x, int y) {
  size_t p = (size_t)y * (size_t)m->width + (size_t)x, neighbours[4];
  int n = 0, alpha = m->rgba[p * 4 + 3];
  if (x > 0) neighbours[n++] = p - 1;
  if (x + 1 < m->width) neighbours[n++] = p + 1;
  if (y > 0) neighbours[n++] = p - (size_t)m->width;
  if (y + 1 < m->height) neighbours[n++] = p + (size_t)m->width;
  float a = (float)alpha / 255, o = 1 - a, weight = 0, f[3] = {0}, b[3] = {0};
  for (int k = 0; k < n; k++) {
    size_t q = neighbours[k];
    int difference = alpha - m->rgba[q * 4 + 3];
    float w = EPSILON + OMEGA / 255 * (float)(difference < 0 ? -difference : difference);
    weight += w;
    for (size_t c = 0; c < 3; c++) {
      f[c] += w * m->f[q * 3 + c];
      b[c] += w * m->b[q * 3 + c];
    }
  }
  if (weight <= 0) return; // a picture of one pixel
  float ff = a * a + weight, bb = o * o + weight, fb = a * o, scale = 1 / (ff * bb - fb * fb);
  for (size_t c = 0; c < 3; c++) {
    float i = m->rgba[p * 4 + c], rf = a * i + f[c], rb = o * i + b[c];
    float new_f = (rf * bb - rb * fb) * scale, new_b = (rb * ff - rf * fb) * scale;
    m->f[p * 3 + c] = (uint8_t)(new_f < 0 ? 0 : new_f > 255 ? 255 : new_f + 0.5f);
    m->b[p * 3 + c] = (uint8_t)(new_b < 0 ? 0 : new_b > 255 ? 255 : new_b + 0.5f);
  }
}

// The colours of the pixels with lowest <= alpha <= highest, spread over the picture.
static vt_status spread_between(vt_context *context, const vt_image *rgba, const vt_image *rgb, uint8_t lowest,
                                uint8_t highest, vt_image *out) {
  size_t count = (size_t)rgba->width * (size_t)rgba->height;
  uint8_t *known = VT_NEW(context, uint8_t, count);
  if (!known) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count; i++) known[i] = rgba->pixels[i * 4 + 3] >= lowest && rgba->pixels[i * 4 + 3] <= highest;
  vt_status status = vt_spread_colours(context, rgb, known, out);
  vt_free(context, known);
  return status;
}

vt_status vt_estimate_foreground(vt_context *context, vt_image *rgba) {
  VT_ASSERT(rgba->channels == 4 && rgba->width > 0 && rgba->height > 0);
  size_t count = (size_t)rgba->width * (size_t)rgba->height;
  uint8_t least = 255, most = 0;
  for (size_t i = 0; i < count; i++) {
    uint8_t alpha = rgba->pixels[i * 4 + 3];
    if (alpha < least) least = alpha;
    if (alpha > most) most = alpha;
  }
  if (most == 0 || least == 255) return VT_OK;
  vt_image rgb = {0}, f = {0}, b = {0};
  vt_status status = vt_make_image(context, rgba->width, rgba->height, 3, &rgb);
  if (status != VT_OK) goto done;
  for (size_t i = 0; i < count; i++) memcpy(rgb.pixels + i * 3, rgba->pixels + i * 4, 3);
  // a mask that is nowhere opaque, or nowhere clear, is taken at its ends
  status = spread_between(context, rgba, &rgb, most >= 250 ? 250 : (uint8_t)(most - most / 8), 255, &f);
  if (status == VT_OK) status = spread_between(context, rgba, &rgb, 0, least <= 5 ? 5 : least, &b);
  if (status != VT_OK) goto done;
  blend m = {rgba->width, rgba->height, rgba->pixels, f.pixels, b.pixels};
  for (int round = 0; round < ROUNDS; round++)
    for (int y = 0; y < m.height; y++)
      for (int x = 0; x < m.width; x++) {
        uint8_t alpha = rgba->pixels[((size_t)y * (size_t)m.width + (size_t)x) * 4 + 3];
        if (alpha > 0 && alpha < 255) solve_pixel(&m, x, y);
      }
  for (size_t i = 0; i < count; i++)
    if (rgba->pixels[i * 4 + 3] < 255) memcpy(rgba->pixels + i * 4, f.pixels + i * 3, 3);
done:
  vt_free_image(context, &rgb);
  vt_free_image(context, &f);
  vt_free_image(context, &b);
  return status;
}
