// sky_model.c - where a photograph shows sky, and what the sky looks like behind the tree
// SPDX-License-Identifier: BSD-3-Clause
//
// A sky is smooth against its noise, bright, not green, and comes in from the upper edge; but it is no low-order
// polynomial as soon as there are clouds. So it is modelled on a grid of small tiles:
// 1. Tiles whose pixels hardly vary are joined from the picture's upper edges inwards, while colours change by no
//    more than soft steps: that is sky seen free of the tree.
// 2. Every other tile gets a model from the sky around it: the mean by pull and push (spread.c), the covariance from the
//    smallest window of a pyramid that holds enough sky. The pixels that it explains are sky in a hole of the crown;
//    they join the model, and so on, HOLE_ROUNDS times. Near a cloud's edge the window varies from white to blue, and
//    so may what is seen through a hole; before a clear sky little may vary. Leaves are far from the line from blue to
//    white whatever its length: they take the blue out of the light.
// 3. Below the last sky on both sides there is ground.
//
// Means and covariances are of encoded values, in which a camera's noise is about the same everywhere; over the little
// by which a tile of sky varies, they are as good as linear ones. Light is made linear where it is mixed (sky.c).
//
// What goes wrong: a sky that the frame cuts into islands which do not touch its upper part is found only where it
// resembles the rest; white blossoms before a white sky, or a glossy leaf that mirrors it, are taken for sky.
#include "capture/sky_model.h"
#include "capture/spread.h"
#include <limits.h>
#include <math.h>
#include <string.h>

enum { LEVELS = 12, HOLE_ROUNDS = 3, MOMENTS = 10, ENOUGH = 48, FEWEST = 3 }; // ENOUGH, FEWEST: pixels of sky
enum { BINS = VT_SKY_BINS, DEEP = 2 }; // DEEP: levels of windows that look out of the crown
#define SMOOTH 1.5f    // times the noise: how much the pixels of a smooth tile vary
#define STEP 30.0f     // levels by which neighbouring tiles of clouds may differ
#define DARKEST 0.3f   // of the brightest tiles: darker is no sky
#define SLACK 2.2f     // levels by which JPEG moves colours even where there is no noise
#define NEAR 3.2f      // standard deviations within which a pixel is sky
#define SIDE 0.22      // of the width: what counts as beside the tree

typedef struct measured {
  float mean[3], luma, deviation;
} measured;

typedef struct moments { // weight, colours, products xx xy xz yy yz zz
  float m[MOMENTS];
} moments;

typedef struct level {
  int width, height;
  moments *cells;
} level;

void vt_free_sky(vt_context *context, vt_sky *sky) {
  vt_free(context, sky->tiles);
  memset(sky, 0, sizeof *sky);
}

static int compare_floats(const void *a, const void *b) {
  float x = *(const float *)a, y = *(const float *)b;
  return (x > y) - (x < y);
}

static float quantile(float *values, size_t count, double share) {
  if (!count) return 0;
  qsort(values, count, sizeof *values, compare_floats);
  return values[(size_t)(share * (double)(count - 1))];
}

// ---- 1: free sky

// Calls for the pixels of a tile: `p` runs over them.
#define FOR_TILE(sky, rgb, column, row, p)                                                                             \
  for (int y_ = (row) * (sky)->tile; y_ < ((row) + 1) * (sky)->tile && y_ < (sky)->height; y_++)                       \
    for (int x_ = (column) * (sky)->tile; x_ < ((column) + 1) * (sky)->tile && x_ < (sky)->width; x_++)                \
      for (const uint8_t *p = (rgb)->pixels + ((size_t)y_ * (size_t)(rgb)->width + (size_t)x_) * 3; p; p = NULL)

static measured measure_tile(const vt_sky *sky, const vt_image *rgb, int column, int row) {
  double sum[3] = {0}, square = 0, n = 0;
  FOR_TILE(sky, rgb, column, row, p) {
    for (int c = 0; c < 3; c++) sum[c] += p[c], square += (double)p[c] * p[c];
    n++;
  }
  measured t;
  for (int c = 0; c < 3; c++) {
    t.mean[c] = (float)(sum[c] / n);
    square -= sum[c] * sum[c] / n;
  }
  t.luma = 0.299f * t.mean[0] + 0.587f * t.mean[1] + 0.114f * t.mean[2];
  t.deviation = (float)sqrt(fmax(square / n / 3, 0));
  return t;
}

static bool is_sky_like(const measured *t, float brightest) {
  float other = fmaxf(t->mean[0], t->mean[2]);
  return t->mean[1] <= other + 5 && t->luma >= fmaxf(DARKEST * brightest, 40);
}

static bool are_near(const measured *a, const measured *b) {
  float d2 = 0;
  for (int c = 0; c < 3; c++) d2 += (a->mean[c] - b->mean[c]) * (a->mean[c] - b->mean[c]);
  return d2 < STEP * STEP;
}

// Marks in tiles[].pixels what is joined from the upper edges.
static void join_free_sky(vt_sky *sky, const measured *m, float brightest, float smooth, uint32_t *stack) {
  size_t size = 0;
  int area = sky->tile * sky->tile;
  for (int row = 0; row < sky->rows; row++)
    for (int column = 0; column < sky->columns; column++) {
      bool edge = row == 0 || (row < (sky->rows + 1) / 2 && (column == 0 || column == sky->columns - 1));
      size_t i = (size_t)row * (size_t)sky->columns + (size_t)column;
      if (!edge || m[i].deviation > smooth || !is_sky_like(&m[i], brightest)) continue;
      sky->tiles[i].pixels = area;
      stack[size++] = (uint32_t)i;
    }
  while (size) {
    uint32_t at = stack[--size];
    int column = (int)(at % (uint32_t)sky->columns), row = (int)(at / (uint32_t)sky->columns);
    for (int k = 0; k < 4; k++) {
      int i = column + (k == 0) - (k == 1), j = row + (k == 2) - (k == 3);
      if (i < 0 || j < 0 || i >= sky->columns || j >= sky->rows) continue;
      size_t next = (size_t)j * (size_t)sky->columns + (size_t)i;
      if (sky->tiles[next].pixels || m[next].deviation > smooth || !is_sky_like(&m[next], brightest)) continue;
      if (!are_near(&m[at], &m[next])) continue;
      sky->tiles[next].pixels = area;
      stack[size++] = (uint32_t)next;
    }
  }
}

static vt_status find_free_sky(vt_context *context, const vt_image *rgb, vt_sky *sky) {
  size_t count = (size_t)sky->columns * (size_t)sky->rows;
  measured *m = VT_NEW(context, measured, count);
  float *sorted = VT_NEW(context, float, count);
  uint32_t *stack = VT_NEW(context, uint32_t, count);
  vt_status status = m && sorted && stack ? VT_OK : VT_OUT_OF_MEMORY;
  for (int row = 0; row < sky->rows && !status; row++)
    for (int column = 0; column < sky->columns; column++)
      m[(size_t)row * (size_t)sky->columns + (size_t)column] = measure_tile(sky, rgb, column, row);
  if (!status) {
    for (size_t i = 0; i < count; i++) sorted[i] = m[i].luma;
    float brightest = quantile(sorted, count, 0.98);
    for (size_t i = 0; i < count; i++) sorted[i] = m[i].deviation;
    sky->noise = fminf(fmaxf(quantile(sorted, count, 0.1), 0.8f), 6);
    join_free_sky(sky, m, brightest, SMOOTH * sky->noise + 1.5f, stack);
    size_t free_tiles = 0; // their median deviation is the noise of what is as bright as the sky
    for (size_t i = 0; i < count; i++)
      if (sky->tiles[i].pixels) sorted[free_tiles++] = m[i].deviation;
    if (free_tiles) sky->noise = fminf(fmaxf(quantile(sorted, free_tiles, 0.5), 0.8f), 8);
  }
  vt_free(context, m);
  vt_free(context, sorted);
  vt_free(context, stack);
  return status;
}

// ---- 2: sky behind the tree

static int bin_of(const uint8_t *p) {
  return (p[0] * BINS / 256 * BINS + p[1] * BINS / 256) * BINS + p[2] * BINS / 256;
}

// Which colours the free sky has anywhere: bins of encoded colours.
static void collect_colours(const vt_image *rgb, vt_sky *sky) {
  uint8_t seen[BINS * BINS * BINS] = {0};
  for (int row = 0; row < sky->rows; row++)
    for (int column = 0; column < sky->columns; column++) {
      if (!sky->tiles[(size_t)row * (size_t)sky->columns + (size_t)column].pixels) continue;
      FOR_TILE(sky, rgb, column, row, p) {
        uint8_t *bin = &seen[bin_of(p)];
        if (*bin < 255) ++*bin;
      }
    }
  for (int i = 0; i < BINS * BINS * BINS; i++) sky->colours[i] = seen[i] >= 20;
}

static void add_pixel(moments *to, const uint8_t *p) {
  float r = p[0], g = p[1], b = p[2], one[MOMENTS] = {1, r, g, b, r * r, r * g, r * b, g * g, g * b, b * b};
  for (int k = 0; k < MOMENTS; k++) to->m[k] += one[k];
}

// How much a colour is a sky's and not mixed with a leaf's or a twig's, which take blue away first.
static int blueness(const uint8_t *p) {
  return 2 * p[2] - (p[0] + p[1]) / 2;
}

// A hole far from all sky that is known: of the pixels whose colours the sky has somewhere, the bluest. How blue they are at
// least; INT_MAX where there are none.
static int least_blueness(const vt_image *rgb, const vt_sky *sky, int column, int row) {
  int most = INT_MIN;
  for (int j = row > 0 ? row - 1 : 0; j <= row + 1 && j < sky->rows; j++)
    for (int i = column > 0 ? column - 1 : 0; i <= column + 1 && i < sky->columns; i++)
      FOR_TILE(sky, rgb, i, j, p) {
        if (blueness(p) > most && sky->colours[bin_of(p)]) most = blueness(p);
      }
  return most > INT_MIN ? most - (int)(9 * sky->noise) - 4 : INT_MAX;
}

// Moments of the sky's pixels in each tile: all of a tile of free sky, and in the others what the model explains.
static void gather(const vt_image *rgb, vt_sky *sky, bool first, moments *cells) {
  for (int row = 0; row < sky->rows; row++)
    for (int column = 0; column < sky->columns; column++) {
      size_t i = (size_t)row * (size_t)sky->columns + (size_t)column;
      vt_sky_tile *tile = &sky->tiles[i];
      cells[i] = (moments){{0}};
      if (first && !tile->pixels) continue;
      int all = 0;
      bool deep = tile->window >= DEEP;
      int least = deep ? least_blueness(rgb, sky, column, row) : INT_MIN;
      FOR_TILE(sky, rgb, column, row, p) {
        bool is_sky = first || (blueness(p) >= least && ((deep && sky->colours[bin_of(p)]) || vt_sky_distance(sky, p, x_, y_) < NEAR));
        if (is_sky) add_pixel(&cells[i], p);
        all++;
      }
      if (cells[i].m[0] < FEWEST && cells[i].m[0] < (float)all) cells[i] = (moments){{0}};
      tile->pixels = (int)cells[i].m[0];
    }
}

static void sum_up(const level *down, level *up) {
  memset(up->cells, 0, (size_t)up->width * (size_t)up->height * sizeof *up->cells);
  for (int y = 0; y < down->height; y++)
    for (int x = 0; x < down->width; x++) {
      const moments *from = &down->cells[(size_t)y * (size_t)down->width + (size_t)x];
      moments *to = &up->cells[(size_t)(y / 2) * (size_t)up->width + (size_t)(x / 2)];
      for (int k = 0; k < MOMENTS; k++) to->m[k] += from->m[k];
    }
}

// The three by three cells around a place of a level.
static moments window_of(const level *l, int x, int y) {
  moments sum = {{0}};
  for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < l->height; j++)
    for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < l->width; i++)
      for (int k = 0; k < MOMENTS; k++) sum.m[k] += l->cells[(size_t)j * (size_t)l->width + (size_t)i].m[k];
  return sum;
}

// Inverts a covariance (xx xy xz yy yz zz).
static void invert(const double s[6], float inverse[6]) {
  double a = s[3] * s[5] - s[4] * s[4], b = s[2] * s[4] - s[1] * s[5], c = s[1] * s[4] - s[2] * s[3];
  double f = 1 / fmax(s[0] * a + s[1] * b + s[2] * c, 1e-6);
  double all[6] = {a, b, c, s[0] * s[5] - s[2] * s[2], s[1] * s[2] - s[0] * s[4], s[0] * s[3] - s[1] * s[1]};
  for (int k = 0; k < 6; k++) inverse[k] = (float)(all[k] * f);
}

// The covariance of the free sky in a window, times `scale`, above that of noise.
static void set_covariance(const vt_sky *sky, const moments *w, double scale, vt_sky_tile *tile) {
  double n = fmax((double)w->m[0], 1), s[6], floor = (double)(sky->noise * sky->noise + SLACK * SLACK);
  for (int i = 0, k = 0; i < 3; i++)
    for (int j = i; j < 3; j++, k++)
      s[k] = scale * ((double)w->m[4 + k] / n - (double)w->m[1 + i] / n * (double)w->m[1 + j] / n) + (i == j ? floor : 0);
  invert(s, tile->inverse);
}

// The smallest window around a tile that holds enough sky: its level, and its moments.
static int look_around(const level levels[LEVELS], int level_count, int column, int row, moments *w) {
  int l = 0;
  *w = window_of(&levels[0], column, row);
  while (w->m[0] < ENOUGH && l + 1 < level_count) l++, *w = window_of(&levels[l], column >> l, row >> l);
  return l;
}

// Means and covariances of all tiles from the moments of the known ones. Covariances are those of the free sky: pixels
// in holes were chosen by them. Where a hole tells the mean near by, the window of free sky is wider than what
// is asked, and a sky varies by about the root of the distance.
static vt_status model_tiles(vt_context *context, vt_sky *sky, const level free_sky[LEVELS], level levels[LEVELS], int level_count) {
  size_t count = (size_t)sky->columns * (size_t)sky->rows;
  vt_image means = {0}, filled = {0};
  uint8_t *known = VT_NEW(context, uint8_t, count);
  vt_status status = known ? vt_make_image(context, sky->columns, sky->rows, 3, &means) : VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && !status; i++) {
    const float *m = levels[0].cells[i].m;
    known[i] = m[0] > 0;
    for (size_t c = 0; c < 3 && known[i]; c++) means.pixels[3 * i + c] = (uint8_t)(m[1 + c] / m[0] + 0.5f);
  }
  if (!status) status = vt_spread_colours(context, &means, known, &filled);
  for (int row = 0; row < sky->rows && !status; row++)
    for (int column = 0; column < sky->columns; column++) {
      size_t i = (size_t)row * (size_t)sky->columns + (size_t)column;
      const float *m = levels[0].cells[i].m;
      for (size_t c = 0; c < 3; c++)
        sky->tiles[i].mean[c] = known[i] ? m[1 + c] / m[0] : (float)filled.pixels[3 * i + c];
      moments w;
      int near = look_around(levels, level_count, column, row, &w), far = look_around(free_sky, level_count, column, row, &w);
      sky->tiles[i].window = (uint8_t)far;
      set_covariance(sky, &w, exp2(near - far), &sky->tiles[i]);
    }
  vt_free(context, known);
  vt_free_image(context, &means);
  vt_free_image(context, &filled);
  return status;
}

static vt_status make_levels(vt_context *context, const vt_sky *sky, level levels[LEVELS], int *count) {
  *count = 0;
  for (int w = sky->columns, h = sky->rows; *count < LEVELS; w = (w + 1) / 2, h = (h + 1) / 2) {
    levels[*count] = (level){w, h, VT_NEW(context, moments, (size_t)w *(size_t)h)};
    if (!levels[(*count)++].cells) return VT_OUT_OF_MEMORY;
    if (w == 1 && h == 1) break;
  }
  return VT_OK;
}

static vt_status find_holes(vt_context *context, const vt_image *rgb, vt_sky *sky) {
  level levels[LEVELS] = {{0}}, free_sky[LEVELS] = {{0}};
  int count = 0;
  collect_colours(rgb, sky);
  vt_status status = make_levels(context, sky, free_sky, &count);
  if (!status) status = make_levels(context, sky, levels, &count);
  for (int round = 0; round <= HOLE_ROUNDS && !status; round++) {
    gather(rgb, sky, round == 0, levels[0].cells);
    for (int l = 1; l < count; l++) sum_up(&levels[l - 1], &levels[l]);
    for (int l = 0; l < count && round == 0; l++)
      memcpy(free_sky[l].cells, levels[l].cells, (size_t)levels[l].width * (size_t)levels[l].height * sizeof(moments));
    status = model_tiles(context, sky, free_sky, levels, count);
  }
  for (int l = 0; l < LEVELS; l++) {
    vt_free(context, levels[l].cells);
    vt_free(context, free_sky[l].cells);
  }
  return status;
}

static float distance2(const vt_sky_tile *tile, const uint8_t colour[3]) {
  const float *s = tile->inverse;
  float x = (float)colour[0] - tile->mean[0], y = (float)colour[1] - tile->mean[1], z = (float)colour[2] - tile->mean[2];
  return x * (s[0] * x + 2 * (s[1] * y + s[2] * z)) + y * (s[3] * y + 2 * s[4] * z) + s[5] * z * z;
}

bool vt_is_sky_colour(const vt_sky *sky, const uint8_t colour[3]) {
  return sky->colours[bin_of(colour)];
}

float vt_sky_distance(const vt_sky *sky, const uint8_t colour[3], int x, int y) {
  const vt_sky_tile *tile = &sky->tiles[(size_t)(y / sky->tile) * (size_t)sky->columns + (size_t)(x / sky->tile)];
  float d2 = distance2(tile, colour);
  return d2 >= VT_SKY_FAR * VT_SKY_FAR ? VT_SKY_FAR : sqrtf(fmaxf(d2, 0));
}

void vt_sky_colour(const vt_sky *sky, int x, int y, float colour[3]) {
  float u = ((float)x + 0.5f) / (float)sky->tile - 0.5f, v = ((float)y + 0.5f) / (float)sky->tile - 0.5f;
  u = fminf(fmaxf(u, 0), (float)(sky->columns - 1)), v = fminf(fmaxf(v, 0), (float)(sky->rows - 1));
  int i = (int)u, j = (int)v, right = i + 1 < sky->columns, down = j + 1 < sky->rows ? sky->columns : 0;
  float s = u - (float)i, t = v - (float)j;
  const vt_sky_tile *a = &sky->tiles[(size_t)j * (size_t)sky->columns + (size_t)i];
  for (int c = 0; c < 3; c++) {
    float top = a->mean[c] + s * (a[right].mean[c] - a->mean[c]);
    float bottom = a[down].mean[c] + s * (a[down + right].mean[c] - a[down].mean[c]);
    colour[c] = top + t * (bottom - top);
  }
}

// ---- 3: ground

// Lowest row, in pixels, under sky in the columns from..to: their median; height where that is the picture's end.
static double lowest_sky(const vt_sky *sky, int from, int to, float *scratch) {
  size_t count = 0;
  for (int column = from; column < to; column++) {
    int row = sky->rows;
    while (row > 0 && 2 * sky->tiles[(size_t)(row - 1) * (size_t)sky->columns + (size_t)column].pixels < sky->tile * sky->tile / 2)
      row--;
    scratch[count++] = (float)(row * sky->tile);
  }
  float median = quantile(scratch, count, 0.5);
  return median >= 0.97f * (float)sky->height - (float)sky->tile ? sky->height : (double)median;
}

static void measure_extent(vt_sky *sky, float *scratch) {
  int top = 0, side = (int)(SIDE * sky->columns) + 1;
  double pixels = 0;
  if (side > sky->columns) side = sky->columns;
  for (int i = 0; i < sky->columns * sky->rows; i++) pixels += sky->tiles[i].pixels;
  for (int i = 0; i < sky->columns; i++) top += sky->tiles[i].pixels > 0;
  sky->share = pixels / ((double)sky->width * sky->height);
  sky->top_share = (double)top / sky->columns;
  double left = lowest_sky(sky, 0, side, scratch), right = lowest_sky(sky, sky->columns - side, sky->columns, scratch);
  left -= left < sky->height ? sky->tile : 0, right -= right < sky->height ? sky->tile : 0; // no row that is half ground
  double slope = (right - left) / (1 - SIDE); // medians stand in the middles of the sides
  bool none = left >= sky->height || right >= sky->height || !(sky->share > 0);
  sky->horizon[0] = none ? sky->height : left - slope * SIDE / 2;
  sky->horizon[1] = none ? sky->height : right + slope * SIDE / 2;
}

vt_status vt_model_sky(vt_context *context, const vt_image *rgb, vt_sky *out) {
  VT_ASSERT(rgb->channels == 3 && rgb->width > 0 && rgb->height > 0);
  int longer = rgb->width > rgb->height ? rgb->width : rgb->height, tile = longer / 320 > 4 ? longer / 320 : 4;
  *out = (vt_sky){.width = rgb->width, .height = rgb->height, .tile = tile};
  out->columns = (rgb->width + tile - 1) / tile, out->rows = (rgb->height + tile - 1) / tile;
  out->tiles = VT_NEW(context, vt_sky_tile, (size_t)out->columns * (size_t)out->rows);
  float *scratch = VT_NEW(context, float, (size_t)out->columns);
  vt_status status = out->tiles && scratch ? find_free_sky(context, rgb, out) : VT_OUT_OF_MEMORY;
  bool found = false;
  for (int i = 0; i < out->columns * out->rows && !status; i++) found = found || out->tiles[i].pixels;
  if (!status && found) status = find_holes(context, rgb, out);
  if (!status) measure_extent(out, scratch);
  vt_free(context, scratch);
  if (status) vt_free_sky(context, out);
  return status;
}
