// paint.c - small textures for leaves and bark
// SPDX-License-Identifier: BSD-3-Clause
//
// A painting is a ratio r(u, v) in linear light around 1: a leaf's pale midrib and side veins, mottling, a darker rim; the
// ridges and cracks of bark, a pine's plates, a birch's lenticels. A texture can only darken (8 bits end at 1), so it
// keeps r / max r, and the material's albedo is 1 / mean of what the rounded texels say: the product has mean 1, and what
// draws without textures loses detail but not brightness. Bark repeats along v: its noise and its marks wrap there.
//
// Noise is value noise: random numbers on a lattice, blended smoothly (Perlin, "An image synthesizer", SIGGRAPH 1985,
// explains the family). Plates are the cells of scattered points (Worley, "A cellular texture basis function", 1996).

#include "datasets-synthetic/paint.h"

enum { SIZE = VT_PAINT_SIZE, LATTICE_LIMIT = 64 };

typedef struct noise { // -1..1, over the unit square
  int columns, rows;   // of the lattice; the last row is followed by the first
  float values[LATTICE_LIMIT][LATTICE_LIMIT];
} noise;

typedef struct painting {
  float ratio[SIZE][SIZE][3]; // row 0 at v = 1
  bool used[SIZE][SIZE];
} painting;

static void draw_noise(noise *n, int columns, int rows, vt_rng *rng) {
  VT_ASSERT(columns < LATTICE_LIMIT && rows <= LATTICE_LIMIT);
  n->columns = columns, n->rows = rows;
  for (int y = 0; y < rows; y++)
    for (int x = 0; x <= columns; x++) n->values[y][x] = (float)vt_random_between(rng, -1, 1);
}

static double noise_at(const noise *n, double u, double v) {
  double x = fmin(fmax(u, 0), 0.999999) * n->columns, y = (v - floor(v)) * n->rows;
  int x0 = (int)x, y0 = (int)y % n->rows, y1 = (y0 + 1) % n->rows;
  double s = x - x0, t = y - floor(y);
  s = s * s * (3 - 2 * s), t = t * t * (3 - 2 * t);
  double low = n->values[y0][x0] * (1 - s) + n->values[y0][x0 + 1] * s;
  double high = n->values[y1][x0] * (1 - s) + n->values[y1][x0 + 1] * s;
  return low * (1 - t) + high * t;
}

static double bump(double x, double width) { return exp(-(x * x) / (width * width)); }

static double encode_srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}
static double decode_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

static vt_status keep_painting(vt_context *ctx, const painting *p, vt_material *material) {
  double highest = 0, sum[3] = {0, 0, 0}, count = 0;
  vt_status status = vt_make_image(ctx, SIZE, SIZE, 4, &material->texture);
  if (status) return status;
  for (int y = 0; y < SIZE; y++)
    for (int x = 0; x < SIZE; x++)
      for (int c = 0; c < 3; c++) highest = fmax(highest, p->ratio[y][x][c]);
  for (int y = 0; y < SIZE; y++)
    for (int x = 0; x < SIZE; x++) {
      uint8_t *texel = material->texture.pixels + 4 * (y * SIZE + x);
      for (int c = 0; c < 3; c++) {
        texel[c] = (uint8_t)(255 * encode_srgb(fmax(p->ratio[y][x][c], 0) / highest) + 0.5);
        if (p->used[y][x]) sum[c] += decode_srgb(texel[c] / 255.0);
      }
      texel[3] = 255, count += p->used[y][x];
    }
  for (int c = 0; c < 3; c++) material->albedo[c] = (float)(count / sum[c]);
  return VT_OK;
}

// ---- leaves

typedef struct leaf_brush {
  const vt_leaf_shape *shape; // NULL: needles
  double across;              // y for each u
  noise coarse, fine;
} leaf_brush;

static void paint_blade_texel(const leaf_brush *b, double u, double v, float ratio[3], bool *used) {
  const vt_leaf_shape *s = b->shape;
  double y = fabs(u - 0.5) * b->across, half = vt_outline_at(s, v), widest = 0.5 * b->across;
  double rib = bump(y, widest * (0.07 - 0.045 * v)), along = (v - s->vein_rise * y) * s->vein_count;
  double from_vein = (along - floor(along + 0.5)) / s->vein_count; // midrib units to the nearest side vein
  double fade = fmax(0, 1 - y / (half + 1e-6)), vein = bump(from_vein, 0.013) * (0.35 + 0.4 * fade) * (y > 0.06 * widest);
  double rim = half > 0 ? bump(fmax(half - y, 0), 0.14 * widest) : 0;
  double tone = 1 + 0.1 * noise_at(&b->coarse, u, v) + 0.06 * noise_at(&b->fine, u, v) - 0.12 * rim;
  double pale = fmax(rib, vein);
  ratio[0] = (float)(tone * (1 + 0.75 * pale)), ratio[1] = (float)(tone * (1 + 0.45 * pale)),
  ratio[2] = (float)(tone * (1 + 0.7 * pale));
  *used = y <= half;
}

// Two pale bands of stomata along each needle, a yellow tip.
static void paint_needle_texel(const leaf_brush *b, double u, double v, float ratio[3], bool *used) {
  double band = bump(fabs(u - 0.5) - 0.22, 0.09), tip = v > 0.92 ? (v - 0.92) / 0.08 : 0;
  double tone = 1 + 0.08 * noise_at(&b->coarse, u, v) - 0.15 * bump(u - 0.5, 0.06);
  ratio[0] = (float)(tone * (1 + 0.22 * band + 0.5 * tip)), ratio[1] = (float)(tone * (1 + 0.22 * band + 0.1 * tip)),
  ratio[2] = (float)(tone * (1 + 0.4 * band - 0.2 * tip));
  *used = fabs(u - 0.5) <= 0.5 * (v < 0.4 ? v / 0.4 : (1 - v) / 0.6);
}

vt_status vt_paint_leaf(vt_context *ctx, vt_leaf_form form, uint32_t seed, vt_material *material) {
  vt_rng rng = vt_seed_rng(seed, 11);
  painting *p = VT_NEW(ctx, painting, 1);
  leaf_brush *b = VT_NEW(ctx, leaf_brush, 1);
  vt_status status = p && b ? VT_OK : VT_OUT_OF_MEMORY;
  if (status) goto done;
  bool needles = form == VT_LEAF_NEEDLES;
  b->shape = needles ? NULL : vt_shape_of(form);
  b->across = needles ? 1 : 2 * vt_half_width(b->shape) * 0.5 / 0.49; // as vt_add_leaf lays it out
  draw_noise(&b->coarse, 7, 9, &rng);
  draw_noise(&b->fine, 30, 34, &rng);
  for (int y = 0; y < SIZE; y++)
    for (int x = 0; x < SIZE; x++) {
      double u = (x + 0.5) / SIZE, v = 1 - (y + 0.5) / SIZE;
      if (needles)
        paint_needle_texel(b, u, v, p->ratio[y][x], &p->used[y][x]);
      else
        paint_blade_texel(b, u, v, p->ratio[y][x], &p->used[y][x]);
    }
  status = keep_painting(ctx, p, material);
done:
  vt_free(ctx, b);
  vt_free(ctx, p);
  return status;
}

// ---- bark

enum { PLATE_COLUMNS = 5, PLATE_ROWS = 4, MARK_COUNT = 14 };

typedef struct mark { double u, v, half_width, half_height; } mark; // a dark one, an ellipse

typedef struct bark_brush {
  vt_bark_pattern pattern;
  noise broad, middle, fine;
  double plates[PLATE_ROWS][PLATE_COLUMNS][3]; // place in its square, tone
  mark marks[MARK_COUNT];
} bark_brush;

static double wrap(double v) { return v - floor(v + 0.5); } // -0.5..0.5

static double fissured(const bark_brush *b, double u, double v, double tint[3]) {
  double bent = u + 0.016 * noise_at(&b->fine, u, v) + 0.03 * noise_at(&b->broad, u, v);
  double ridge = noise_at(&b->middle, bent, v), tone = 1.1 + 0.3 * fabs(ridge) + 0.2 * noise_at(&b->fine, u, v);
  double crack = bump(ridge, 0.24);
  double moss = fmax(0, noise_at(&b->broad, u, v)) * 0.2; // a breath of green on the ridges
  tint[0] = 1 - 0.5 * moss, tint[2] = 1 - 0.7 * moss;
  return tone * (1 - 0.78 * crack);
}

// Distance to the border between the two nearest plates, and the nearer one's tone.
static double plates(const bark_brush *b, double u, double v, double tint[3]) {
  double x = (u + 0.03 * noise_at(&b->middle, u, v)) * PLATE_COLUMNS, y = (v - floor(v)) * PLATE_ROWS;
  double nearest = 1e9, second = 1e9, tone = 1;
  for (int j = (int)y - 1; j <= (int)y + 1; j++)
    for (int i = (int)floor(x) - 1; i <= (int)floor(x) + 1; i++) {
      const double *plate = b->plates[(j + PLATE_ROWS) % PLATE_ROWS][(i + PLATE_COLUMNS) % PLATE_COLUMNS];
      double dx = i + plate[0] - x, dy = j + plate[1] - y, d = sqrt(dx * dx + dy * dy);
      if (d < nearest)
        second = nearest, nearest = d, tone = plate[2];
      else if (d < second)
        second = d;
    }
  double crack = bump(second - nearest, 0.16);
  tint[0] = 1 + 0.1 * (1 - crack), tint[2] = 0.92 + 0.1 * crack;
  return tone * (1 + 0.16 * noise_at(&b->fine, u, v)) * (1 - 0.7 * crack);
}

static double birch_marks(const bark_brush *b, double u, double v, double tint[3]) {
  double dark = 0, ragged = 1 + 0.5 * noise_at(&b->fine, u, v);
  for (int k = 0; k < MARK_COUNT; k++) {
    const mark *m = &b->marks[k];
    double x = (u - m->u) / m->half_width, y = wrap(v - m->v) / (m->half_height * ragged);
    double out = sqrt(x * x + y * y);
    dark = fmax(dark, fmin(fmax((1.25 - out) / 0.5, 0), 1));
  }
  double band = 0.07 * noise_at(&b->broad, u, v) + 0.04 * noise_at(&b->middle, u, v);
  tint[0] = 1 + 0.4 * band, tint[2] = 1 - 0.6 * band; // where it peels it is warmer
  return (1 + band) * (1 - 0.86 * dark);
}

static void draw_bark(bark_brush *b, vt_rng *rng) {
  static const int lattice[3][6] = {{4, 6, 16, 3, 40, 20}, {3, 3, 9, 7, 36, 36}, {3, 22, 6, 44, 16, 40}};
  const int *n = lattice[b->pattern];
  draw_noise(&b->broad, n[0], n[1], rng);
  draw_noise(&b->middle, n[2], n[3], rng);
  draw_noise(&b->fine, n[4], n[5], rng);
  for (int j = 0; j < PLATE_ROWS; j++)
    for (int i = 0; i < PLATE_COLUMNS; i++) {
      double *plate = b->plates[j][i];
      plate[0] = vt_random_between(rng, 0.15, 0.85), plate[1] = vt_random_between(rng, 0.15, 0.85);
      plate[2] = vt_random_between(rng, 0.8, 1.2);
    }
  for (int k = 0; k < MARK_COUNT; k++) {
    bool scar = k < 2; // where a branch was: black and high
    b->marks[k] = (mark){vt_random_unit(rng), (k + vt_random_unit(rng)) / MARK_COUNT,
                         scar ? vt_random_between(rng, 0.08, 0.14) : vt_random_between(rng, 0.06, 0.3),
                         scar ? vt_random_between(rng, 0.05, 0.09) : vt_random_between(rng, 0.009, 0.022)};
  }
}

vt_status vt_paint_bark(vt_context *ctx, vt_bark_pattern pattern, uint32_t seed, vt_material *material) {
  vt_rng rng = vt_seed_rng(seed, 12);
  painting *p = VT_NEW(ctx, painting, 1);
  bark_brush *b = VT_NEW(ctx, bark_brush, 1);
  vt_status status = p && b ? VT_OK : VT_OUT_OF_MEMORY;
  if (status) goto done;
  b->pattern = pattern;
  draw_bark(b, &rng);
  for (int y = 0; y < SIZE; y++)
    for (int x = 0; x < SIZE; x++) {
      double u = (x + 0.5) / SIZE, v = 1 - (y + 0.5) / SIZE, tint[3] = {1, 1, 1};
      double tone = pattern == VT_BARK_FISSURED ? fissured(b, u, v, tint)
                    : pattern == VT_BARK_PLATES ? plates(b, u, v, tint)
                                                : birch_marks(b, u, v, tint);
      for (int c = 0; c < 3; c++) p->ratio[y][x][c] = (float)(fmax(tone, 0.05) * tint[c]);
      p->used[y][x] = true;
    }
  status = keep_painting(ctx, p, material);
done:
  vt_free(ctx, b);
  vt_free(ctx, p);
  return status;
}
