// backdrop_model.c - what the backdrop of one photograph looks like, place by place
// SPDX-License-Identifier: BSD-3-Clause
//
// Two steps. A first surface B(x,y), a quadratic polynomial per channel, is fitted by iteratively reweighted least
// squares with Tukey's weights. It starts from what is believed to be backdrop: the border of the picture. Then the picture is
// cut into tiles, and each tile holds the mean and covariance of those of its pixels that resemble its own or a neighbour's
// model. Repeated, that lets the backdrop follow folds, seams and soft glows from tile to tile, while it cannot step over the
// sharp edge of a plant. A crown that is no farther from the cloth than its folds are deep bends the surface to its own colour,
// and tiles begin in it: `careful` fits the surface to the border alone and begins at the border's tiles; but then whatever
// stands out from them stays, equipment too. The
// covariance says by itself which way a backdrop varies: cloth in lightness, hardly in chroma; so a plant as dark as
// the cloth is still far from it if its hue differs, and no hue has to be known beforehand.
// What goes wrong: a plant that covers most of the border is taken for the backdrop, and parts of a plant that have
// the colour of the backdrop are lost.
#include "capture/backdrop_model.h"
#include <math.h>
#include <string.h>

enum { TERMS = 6, ROUNDS = 12, MOST_ROUNDS = 200, FIT_ROUNDS = 12, PROBES = 12 }; // PROBES squared pixels of a tile are looked at
#define SEEDED 0.85f // of the way from the middle to the left, right and upper edge: from there on is backdrop
#define NOISE 1.6f    // of a camera, standard deviation in levels; floor of every covariance
#define SHADING 10.0f // levels by which folds change a cloth along its own colour, at most; as much as at the border
#define LEAST_SHADING 3.0f
#define INSIDE 3.0f     // a pixel within so many standard deviations is backdrop
#define NEW 2.2f        // of a tile that is to become known: dark leaves lie beside the cloth's colours, not among them
#define CORE 0.7        // share of a tile's backdrop that its model is drawn from
#define CORE_SCALE 1.7f // variance of a 3-D normal distribution over that of its likest 70 %
#define ENOUGH 0.3f     // share of a tile's pixels from which a model is drawn
#define PLAIN 36.0f     // levels by which folds and lamps move a plain backdrop off a smooth surface
#define MOSTLY 0.5f     // share from which a tile joins its neighbours' backdrop

typedef struct sample {
  float colour[3];
  float basis[TERMS];
  float weight;
  bool seed;
} sample;

// How much the backdrop varies as a whole, about its surface.
typedef struct variation {
  float covariance[6]; // xx xy xz yy yz zz, levels squared
  float inverse[6];    // of it with the camera's noise
  float shading;       // variance along a colour itself that folds may add anywhere
} variation;

void vt_free_backdrop(vt_context *context, vt_backdrop *backdrop) {
  vt_free(context, backdrop->tiles);
  memset(backdrop, 0, sizeof *backdrop);
}

// Place in the frame, -1..1.
static void place_of(const vt_backdrop *frame, float x, float y, float *u, float *v) {
  *u = fminf(fmaxf((x - (float)frame->x0) / (float)(frame->x1 - frame->x0) * 2 - 1, -1), 1);
  *v = fminf(fmaxf((y - (float)frame->y0) / (float)(frame->y1 - frame->y0) * 2 - 1, -1), 1);
}

static void fill_basis(float basis[TERMS], float u, float v) {
  float values[TERMS] = {1, u, v, u * u, u * v, v * v};
  memcpy(basis, values, sizeof values);
}

static void evaluate(const double coefficients[TERMS][3], const float basis[TERMS], float colour[3]) {
  for (int c = 0; c < 3; c++) {
    double sum = 0;
    for (int i = 0; i < TERMS; i++) sum += coefficients[i][c] * (double)basis[i];
    colour[c] = (float)(sum < 0 ? 0 : sum > 255 ? 255 : sum);
  }
}

static int compare_floats(const void *a, const void *b) {
  float x = *(const float *)a, y = *(const float *)b;
  return (x > y) - (x < y);
}

// Sorts. 0 of nothing.
static float quantile(float *values, size_t count, double share) {
  if (!count) return 0;
  qsort(values, count, sizeof *values, compare_floats);
  return values[(size_t)(share * (double)(count - 1))];
}

// True if the row (or column) `at` is one colour but for a few pixels, that of its first pixel.
static bool is_bar(const vt_image *rgb, bool row, int at, const uint8_t colour[3], int *other_count) {
  int length = row ? rgb->width : rgb->height, other = 0;
  for (int i = 0; i < length; i++) {
    size_t index = row ? (size_t)at * (size_t)rgb->width + (size_t)i : (size_t)i * (size_t)rgb->width + (size_t)at;
    const uint8_t *p = rgb->pixels + index * 3;
    other += abs(p[0] - colour[0]) > 4 || abs(p[1] - colour[1]) > 4 || abs(p[2] - colour[2]) > 4;
  }
  *other_count = other;
  return other * 50 < length;
}

// Width of the bar of one colour at one side: 0 unless it ends in a straight edge, because a bar that ends where the
// plant begins is the backdrop itself.
static int bar_width(const vt_image *rgb, bool row, bool from_end) {
  int size = row ? rgb->height : rgb->width, length = row ? rgb->width : rgb->height, other = 0, width = 0;
  int first = from_end ? size - 1 : 0, step = from_end ? -1 : 1;
  size_t corner = row ? (size_t)first * (size_t)rgb->width : (size_t)first;
  const uint8_t *colour = rgb->pixels + corner * 3;
  while (width < size / 2 && is_bar(rgb, row, first + step * width, colour, &other)) width++;
  if (width == 0 || width >= size / 2) return 0;
  int beyond = width + 3 < size ? width + 3 : size - 1; // the edge itself may be blurred
  is_bar(rgb, row, first + step * beyond, colour, &other);
  return other * 2 > length ? beyond : 0;
}

static void find_frame(const vt_image *rgb, vt_backdrop *out) {
  out->x0 = bar_width(rgb, false, false);
  out->x1 = rgb->width - bar_width(rgb, false, true);
  out->y0 = bar_width(rgb, true, false);
  out->y1 = rgb->height - bar_width(rgb, true, true);
  if (out->x1 - out->x0 < 1 || out->y1 - out->y0 < 1) {
    out->x0 = out->y0 = 0;
    out->x1 = rgb->width;
    out->y1 = rgb->height;
  }
}

// The pixels of a grid of about 20,000 points, with their places; marks those believed to be backdrop.
static vt_status take_samples(vt_context *context, const vt_image *rgb, const vt_backdrop *frame, sample **out,
                              size_t *count) {
  int width = frame->x1 - frame->x0, height = frame->y1 - frame->y0;
  int step = (int)sqrt((double)width * height / 20000.0);
  if (step < 1) step = 1;
  size_t columns = (size_t)((width + step - 1) / step), rows = (size_t)((height + step - 1) / step);
  sample *samples = VT_NEW(context, sample, columns * rows);
  *out = samples;
  *count = columns * rows;
  if (!samples) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < columns * rows; i++) {
    int x = frame->x0 + (int)(i % columns) * step, y = frame->y0 + (int)(i / columns) * step;
    const uint8_t *pixel = rgb->pixels + ((size_t)y * (size_t)rgb->width + (size_t)x) * 3;
    sample *s = &samples[i];
    for (int c = 0; c < 3; c++) s->colour[c] = pixel[c];
    float u, v;
    place_of(frame, (float)x + 0.5f, (float)y + 0.5f, &u, &v);
    fill_basis(s->basis, u, v);
    // the lower edge is where a plant is cut by the frame
    s->seed = fabsf(u) > SEEDED || v < -SEEDED;
  }
  return VT_OK;
}

// Weighted least squares by the normal equations, Gauss with pivots; a ridge keeps it regular for any samples.
static void solve_surface(const sample *samples, size_t count, int terms, double coefficients[TERMS][3]) {
  double a[TERMS][TERMS + 3] = {{0}}, total = 0;
  for (size_t s = 0; s < count; s++) {
    double w = (double)samples[s].weight;
    if (!(w > 0)) continue;
    total += w;
    for (int i = 0; i < terms; i++) {
      double wi = w * (double)samples[s].basis[i];
      for (int j = 0; j < terms; j++) a[i][j] += wi * (double)samples[s].basis[j];
      for (int c = 0; c < 3; c++) a[i][TERMS + c] += wi * (double)samples[s].colour[c];
    }
  }
  if (!(total > 0)) return;
  memset(coefficients, 0, sizeof(double[TERMS][3]));
  for (int i = 0; i < terms; i++) a[i][i] += (i ? 1e-3 : 1e-9) * total;
  for (int i = 0; i < terms; i++) { // symmetric positive definite: the diagonal is a pivot
    for (int k = i + 1; k < terms; k++) {
      double f = a[k][i] / a[i][i];
      for (int j = i; j < TERMS + 3; j++) a[k][j] -= f * a[i][j];
    }
  }
  for (int i = terms - 1; i >= 0; i--)
    for (int c = 0; c < 3; c++) {
      double sum = a[i][TERMS + c];
      for (int j = i + 1; j < terms; j++) sum -= a[i][j] * coefficients[j][c];
      coefficients[i][c] = sum / a[i][i];
    }
}

// Fits the surface. `scratch` holds count values.
static void fit_surface(sample *samples, size_t count, bool careful, float *scratch, double coefficients[TERMS][3]) {
  size_t seeds = 0;
  for (size_t i = 0; i < count; i++) seeds += samples[i].seed;
  memset(coefficients, 0, sizeof(double[TERMS][3]));
  for (int c = 0; c < 3; c++) {
    size_t n = 0;
    for (size_t i = 0; i < count; i++)
      if (samples[i].seed || !seeds) scratch[n++] = samples[i].colour[c];
    coefficients[0][c] = (double)quantile(scratch, n, 0.5);
  }
  float scale = 12;
  for (int round = 0; round < FIT_ROUNDS; round++) {
    size_t n = 0;
    for (size_t i = 0; i < count; i++) {
      float b[3], d2 = 0;
      evaluate(coefficients, samples[i].basis, b);
      for (int c = 0; c < 3; c++) d2 += (samples[i].colour[c] - b[c]) * (samples[i].colour[c] - b[c]);
      float t = d2 / (4.685f * 4.685f * scale * scale);
      bool seed = samples[i].seed || !seeds; // the others do not say how much a backdrop varies
      samples[i].weight = ((round > 2 && !careful) || seed) && t < 1 ? (1 - t) * (1 - t) : 0;
      if (t < 1 && seed) scratch[n++] = sqrtf(d2);
    }
    solve_surface(samples, count, round < 2 ? 1 : round < 5 ? 3 : TERMS, coefficients);
    float spread = quantile(scratch, n, 0.5) * 1.2f; // median length of a 3-D residual that varies mostly one way
    scale = spread < 3 ? 3 : spread > 24 ? 24 : spread;
  }
}

// Inverts a covariance (xx xy xz yy yz zz).
static void invert(const float s[6], float inverse[6]) {
  float a = s[3] * s[5] - s[4] * s[4], b = s[2] * s[4] - s[1] * s[5], c = s[1] * s[4] - s[2] * s[3];
  float determinant = s[0] * a + s[1] * b + s[2] * c, f = 1 / (determinant > 1e-6f ? determinant : 1e-6f);
  inverse[0] = a * f;
  inverse[1] = b * f;
  inverse[2] = c * f;
  inverse[3] = (s[0] * s[5] - s[2] * s[2]) * f;
  inverse[4] = (s[1] * s[2] - s[0] * s[4]) * f;
  inverse[5] = (s[0] * s[3] - s[1] * s[1]) * f;
}

// Gives a tile its covariance. It gets floors, and must not vary more than the backdrop as a whole does in any way:
// it would grow into leaves, whose colours are spread evenly.
static void set_covariance(vt_backdrop_tile *tile, const float covariance[6], const variation *whole) {
  const float *m = tile->mean, *w = whole->inverse;
  float length = sqrtf(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]) + 1, s[6];
  float ratio = (w[0] * covariance[0] + w[3] * covariance[3] + w[5] * covariance[5] +
                 2 * (w[1] * covariance[1] + w[2] * covariance[2] + w[4] * covariance[4])) /
                3;
  float shrink = ratio > 1 ? 1 / ratio : 1;
  for (int i = 0, k = 0; i < 3; i++)
    for (int j = i; j < 3; j++, k++) {
      float along = (m[i] + 0.577f) / length * (m[j] + 0.577f) / length;
      s[k] =
          shrink * covariance[k] + 0.1f * whole->covariance[k] + whole->shading * along + (i == j ? NOISE * NOISE : 0);
    }
  invert(s, tile->inverse);
}

static inline float tile_distance2(const vt_backdrop_tile *tile, float r, float g, float b) {
  const float *s = tile->inverse;
  float x = r - tile->mean[0], y = g - tile->mean[1], z = b - tile->mean[2];
  return x * (s[0] * x + 2 * (s[1] * y + s[2] * z)) + y * (s[3] * y + 2 * s[4] * z) + s[5] * z * z;
}

static float nearest_distance2(const vt_backdrop *backdrop, const uint8_t colour[3], int column, int row,
                               bool only_known) {
  float r = colour[0], g = colour[1], b = colour[2], best = VT_FAR * VT_FAR;
  int left = column > 0 ? column - 1 : 0, right = column + 1 < backdrop->columns ? column + 1 : column;
  int top = row > 0 ? row - 1 : 0, bottom = row + 1 < backdrop->rows ? row + 1 : row;
  for (int j = top; j <= bottom; j++)
    for (int i = left; i <= right; i++) {
      const vt_backdrop_tile *tile = &backdrop->tiles[(size_t)j * (size_t)backdrop->columns + (size_t)i];
      if (only_known && !tile->known) continue;
      float d2 = tile_distance2(tile, r, g, b);
      if (d2 < best) best = d2;
    }
  return best > 0 ? best : 0;
}

float vt_backdrop_distance(const vt_backdrop *backdrop, const uint8_t colour[3], int x, int y) {
  return sqrtf(nearest_distance2(backdrop, colour, x / backdrop->tile, y / backdrop->tile, false));
}

// Draws a tile's next model from those pixels, in it and a quarter around, that the present models explain, of
// these the likest CORE: a thin stem that crosses a tile is a minority there, and must not stretch the covariance until
// it fits.
static void update_tile(const vt_backdrop *now, const vt_image *rgb, const variation *whole, int column, int row,
                        vt_backdrop_tile *out) {
  const vt_backdrop_tile *old = &now->tiles[(size_t)row * (size_t)now->columns + (size_t)column];
  *out = *old;
  if (old->rounds >= ROUNDS) return; // it has settled
  float bound2 = old->known || !now->careful ? INSIDE * INSIDE : NEW * NEW;
  int margin = now->tile / 4, x0 = column * now->tile - margin, y0 = row * now->tile - margin,
      edge = now->tile + 2 * margin;
  int x1 = x0 + edge < now->x1 ? x0 + edge : now->x1, y1 = y0 + edge < now->y1 ? y0 + edge : now->y1;
  if (x0 < now->x0) x0 = now->x0;
  if (y0 < now->y0) y0 = now->y0;
  float distances[PROBES * PROBES], sorted[PROBES * PROBES];
  const uint8_t *pixels[PROBES * PROBES];
  int step = (edge + PROBES - 1) / PROBES, count = 0;
  size_t inside = 0;
  for (int y = y0; y < y1; y += step)
    for (int x = x0; x < x1; x += step, count++) {
      const uint8_t *p = rgb->pixels + ((size_t)y * (size_t)rgb->width + (size_t)x) * 3;
      float d2 = nearest_distance2(now, p, column, row, true);
      if (d2 > bound2) continue;
      distances[inside] = sorted[inside] = d2;
      pixels[inside++] = p;
    }
  float share = (float)inside / (float)(count ? count : 1);
  out->known = inside >= 4 && share >= (old->known ? ENOUGH : MOSTLY);
  out->rounds = (uint8_t)(out->known ? old->rounds + 1 : 0);
  if (!out->known) return;
  float bound = quantile(sorted, inside, CORE);
  double sum[3] = {0}, square[6] = {0}, n = 0;
  for (size_t s = 0; s < inside; s++) {
    if (distances[s] > bound) continue;
    n++;
    for (int i = 0, k = 0; i < 3; i++) {
      sum[i] += pixels[s][i];
      for (int j = i; j < 3; j++, k++) square[k] += (double)pixels[s][i] * pixels[s][j];
    }
  }
  for (int i = 0; i < 3; i++) out->mean[i] = (float)(sum[i] / n);
  float covariance[6]; // of the core of a normal distribution, scaled to the whole of it
  for (int i = 0, k = 0; i < 3; i++)
    for (int j = i; j < 3; j++, k++) covariance[k] = CORE_SCALE * (float)(square[k] / n - sum[i] * sum[j] / (n * n));
  set_covariance(out, covariance, whole);
}

// Tiles inside a crown get the mean of the known ones beside them, ring by ring, and the covariance of the whole.
static void fill_unknown(vt_backdrop *backdrop, vt_backdrop_tile *scratch, const variation *whole) {
  size_t count = (size_t)backdrop->columns * (size_t)backdrop->rows;
  for (bool missing = true, found = true; missing && found;) {
    missing = found = false;
    memcpy(scratch, backdrop->tiles, count * sizeof *scratch);
    for (int row = 0; row < backdrop->rows; row++)
      for (int column = 0; column < backdrop->columns; column++) {
        vt_backdrop_tile *tile = &backdrop->tiles[(size_t)row * (size_t)backdrop->columns + (size_t)column];
        if (tile->known) continue;
        float sum[3] = {0}, n = 0;
        for (int j = row - 1; j <= row + 1; j++)
          for (int i = column - 1; i <= column + 1; i++) {
            if (i < 0 || j < 0 || i >= backdrop->columns || j >= backdrop->rows) continue;
            const vt_backdrop_tile *other = &scratch[(size_t)j * (size_t)backdrop->columns + (size_t)i];
            if (!other->known) continue;
            for (int c = 0; c < 3; c++) sum[c] += other->mean[c];
            n++;
          }
        missing = missing || n == 0;
        if (n == 0) continue;
        found = tile->known = true;
        for (int c = 0; c < 3; c++) tile->mean[c] = sum[c] / n;
        set_covariance(tile, whole->covariance, whole);
      }
  }
}

// Tiles that follow the first surface, all with the covariance of its residuals.
static void start_tiles(vt_backdrop *backdrop, const double coefficients[TERMS][3], const variation *whole) {
  bool careful = backdrop->careful;
  for (int row = 0; row < backdrop->rows; row++)
    for (int column = 0; column < backdrop->columns; column++) {
      vt_backdrop_tile *tile = &backdrop->tiles[(size_t)row * (size_t)backdrop->columns + (size_t)column];
      float basis[TERMS], u, v, edge = (float)backdrop->tile;
      place_of(backdrop, ((float)column + 0.5f) * edge, ((float)row + 0.5f) * edge, &u, &v);
      fill_basis(basis, u, v);
      evaluate(coefficients, basis, tile->mean);
      set_covariance(tile, whole->covariance, whole);
      tile->known = !careful || fabsf(u) > SEEDED || v < -SEEDED;
    }
}

// From the samples that are believed to be backdrop and that the surface explains.
static variation measure_variation(const sample *samples, size_t count, const double coefficients[TERMS][3]) {
  double sum[6] = {0}, total = 1e-9;
  for (size_t s = 0; s < count; s++) {
    float b[3];
    if (!samples[s].seed) continue;
    evaluate(coefficients, samples[s].basis, b);
    total += (double)samples[s].weight;
    for (int i = 0, k = 0; i < 3; i++)
      for (int j = i; j < 3; j++, k++)
        sum[k] +=
            (double)samples[s].weight * (double)(samples[s].colour[i] - b[i]) * (double)(samples[s].colour[j] - b[j]);
  }
  variation whole;
  float padded[6];
  for (int k = 0; k < 6; k++) whole.covariance[k] = (float)(sum[k] / total);
  for (int k = 0; k < 6; k++) padded[k] = whole.covariance[k] + (k == 0 || k == 3 || k == 5 ? NOISE * NOISE : 0);
  invert(padded, whole.inverse);
  float trace = whole.covariance[0] + whole.covariance[3] + whole.covariance[5];
  whole.shading = fminf(fmaxf(trace, LEAST_SHADING * LEAST_SHADING), SHADING * SHADING);
  return whole;
}

vt_status vt_measure_plainness(vt_context *context, const vt_image *rgb, double *share) {
  vt_backdrop frame = {0};
  sample *samples = NULL;
  size_t count = 0, seeds = 0, near = 0;
  find_frame(rgb, &frame);
  vt_status status = take_samples(context, rgb, &frame, &samples, &count);
  float *scratch = VT_NEW(context, float, count);
  if (status == VT_OK && !scratch) status = VT_OUT_OF_MEMORY;
  if (status == VT_OK) {
    double coefficients[TERMS][3];
    fit_surface(samples, count, false, scratch, coefficients);
    for (size_t i = 0; i < count; i++) {
      float b[3], d2 = 0;
      if (!samples[i].seed) continue;
      evaluate(coefficients, samples[i].basis, b);
      for (int c = 0; c < 3; c++) d2 += (samples[i].colour[c] - b[c]) * (samples[i].colour[c] - b[c]);
      seeds++, near += d2 < PLAIN * PLAIN;
    }
    *share = seeds ? (double)near / (double)seeds : 0;
  }
  vt_free(context, samples);
  vt_free(context, scratch);
  return status;
}

vt_status vt_model_backdrop(vt_context *context, const vt_image *rgb, bool careful, vt_backdrop *out) {
  memset(out, 0, sizeof *out);
  int longer = rgb->width > rgb->height ? rgb->width : rgb->height;
  out->careful = careful;
  out->tile = longer / 90 > 8 ? longer / 90 : 8;
  out->columns = (rgb->width + out->tile - 1) / out->tile;
  out->rows = (rgb->height + out->tile - 1) / out->tile;
  find_frame(rgb, out);
  size_t tiles = (size_t)out->columns * (size_t)out->rows, sample_count = 0;
  sample *samples = NULL;
  vt_status status = take_samples(context, rgb, out, &samples, &sample_count);
  float *scratch = VT_NEW(context, float, sample_count);
  vt_backdrop_tile *next = VT_NEW(context, vt_backdrop_tile, tiles);
  out->tiles = VT_NEW(context, vt_backdrop_tile, tiles);
  if (status != VT_OK || !scratch || !next || !out->tiles) {
    status = VT_OUT_OF_MEMORY;
    goto done;
  }
  double coefficients[TERMS][3];
  fit_surface(samples, sample_count, careful, scratch, coefficients);
  variation whole = measure_variation(samples, sample_count, coefficients);
  start_tiles(out, coefficients, &whole);
  for (int round = 0, grown = 1; round < ROUNDS || (careful && grown && round < MOST_ROUNDS); round++) {
    grown = 0;
    for (int row = 0; row < out->rows; row++)
      for (int column = 0; column < out->columns; column++)
        update_tile(out, rgb, &whole, column, row, &next[(size_t)row * (size_t)out->columns + (size_t)column]);
    for (size_t i = 0; i < tiles; i++) grown += next[i].known && !out->tiles[i].known;
    vt_backdrop_tile *swap = out->tiles;
    out->tiles = next;
    next = swap;
  }
  fill_unknown(out, next, &whole);
done:
  vt_free(context, samples);
  vt_free(context, scratch);
  vt_free(context, next);
  if (status != VT_OK) vt_free_backdrop(context, out);
  return status;
}
