// backdrop.c - alpha of a plant before a plain backdrop
// SPDX-License-Identifier: BSD-3-Clause
//
// 1. backdrop_model.c says how far, in standard deviations, each pixel is from the backdrop around it.
// 2. Two thresholds, as Canny's, choose what is kept: what hangs on enough pixels beyond SURE counts from DOUBTFUL on.
//    Specks are dropped. What is far inside is certainly plant; the rest of it, and two pixels around, is solved.
// 3. There both ends of the colour line are known, spread from where they are seen unmixed (F from the plant, B from
//    the backdrop outside), and (Ruzon, Tomasi, "Alpha estimation in natural images", CVPR 2000, one colour a side)
//      alpha = <I-B, F-B> / |F-B|^2
//    It cannot be below what 0 <= F <= 1 demands with B known:
//      alpha >= max_c max((I_c-B_c)/(1-B_c), (B_c-I_c)/B_c)
//
// All depends on where F is taken. An edge is blurred over some pixels, and the chroma of a JPEG over some more, so the
// plant's rim is mixed; but a dark stem beside a bright leaf is not a mixture of the leaf. Unmixed is what lies inside
// of the line where the contrast is half of that beside it, or the ridge of a twig that has no inside.
//
// Propagation (closed-form, information flow) is not used: holes in a crown are islands that it does not reach, while
// the colour line needs no neighbours. Colours are the encoded ones, as everywhere in voltree: alpha and F put over B
// give the photograph back. F of the result comes from foreground.c.
//
// What goes wrong: parts of the plant in the colour of the backdrop are lost, above all the shade of a dense crown
// before black cloth; sharp-edged things that do not belong to the backdrop stay, and are left to the hull of all
// views.
#include "capture/backdrop_model.h"
#include "capture/components.h"
#include "capture/matte.h"
#include "capture/spread.h"
#include <math.h>
#include <string.h>

#define DOUBTFUL 3.5f // standard deviations from which a pixel that hangs on the plant is no backdrop
#define SURE 7.0f     // from which a pixel is plant
#define NEARLY 2.5f   // from which it is not much like the backdrop
#define FAINT 0.6     // share of what is kept that may be below SURE: rims, of a thin plant half of it
#define STEPS 4.0f    // of the distance, per standard deviation, in a byte
#define FEW 1e-5      // share of the picture below which a spot is a speck
#define WEAK 0.4      // of the plant's mean distance: a part that stands out less is a fold or a cable
enum {
  REACH = 3, // pixels over which an edge may be blurred
  LEAST = 7, // half levels of contrast below which a pixel may be a halo of blurred chroma
  PEAK = 85  // per cent of the highest contrast near it above which a pixel of a thin twig is its middle
};

enum { BACKDROP = VT_PART_NONE, MAYBE = VT_PART_DOUBTFUL, PLANT = VT_PART_SURE, INSIDE = 3, CORE = 4 }; // from MAYBE to INSIDE: colour line; CORE: certain

typedef struct matte {
  const vt_image *rgb;
  int width, height;
  size_t count;
  uint8_t *distance; // [height][width], STEPS per standard deviation; later alpha
  uint8_t *trimap;
  uint8_t *contrast;
  uint8_t *mask, *scratch;
  bool faint; // the plant hardly differs from the backdrop
} matte;

static void measure(const vt_backdrop *backdrop, matte *m) {
  for (int y = backdrop->y0; y < backdrop->y1; y++)
    for (int x = backdrop->x0; x < backdrop->x1; x++) {
      size_t p = (size_t)y * (size_t)m->width + (size_t)x;
      m->distance[p] = (uint8_t)(STEPS * vt_backdrop_distance(backdrop, m->rgb->pixels + p * 3, x, y));
    }
}

// What is kept and deeper than `depth` pixels becomes `class`.
static void mark_inside(matte *m, int depth, uint8_t class) {
  for (size_t i = 0; i < m->count; i++) m->mask[i] = m->trimap[i] == BACKDROP;
  vt_dilate(m->width, m->height, depth, m->mask, m->scratch);
  for (size_t i = 0; i < m->count; i++)
    if (m->trimap[i] != BACKDROP && !m->mask[i]) m->trimap[i] = class;
}

// From components to the trimap that is solved: MAYBE also two pixels around what is kept.
static void make_trimap(matte *m) {
  mark_inside(m, REACH + 1, INSIDE);
  mark_inside(m, 2 * REACH, CORE);
  for (size_t i = 0; i < m->count; i++) m->mask[i] = m->trimap[i] != BACKDROP;
  vt_dilate(m->width, m->height, 2, m->mask, m->scratch);
  for (size_t i = 0; i < m->count; i++)
    if (m->trimap[i] == BACKDROP && m->mask[i]) m->trimap[i] = MAYBE;
}

// B: spread from what is three pixels away from anything kept.
static vt_status spread_backdrop(vt_context *context, matte *m, vt_image *out) {
  size_t known = 0;
  for (size_t i = 0; i < m->count; i++) m->mask[i] = m->trimap[i] != BACKDROP;
  vt_dilate(m->width, m->height, 1, m->mask, m->scratch);
  for (size_t i = 0; i < m->count; i++) known += m->mask[i] = !m->mask[i];
  if (!known)
    for (size_t i = 0; i < m->count; i++) m->mask[i] = m->trimap[i] == BACKDROP;
  return vt_spread_colours(context, m->rgb, m->mask, out);
}

// Place of a pixel on the line from B (0) to F (1); -1 where the two are too near each other to tell.
static float on_colour_line(const uint8_t *i, const uint8_t *b, const uint8_t *f) {
  float dot = 0, length2 = 0;
  for (int c = 0; c < 3; c++) {
    float d = (float)(f[c] - b[c]);
    dot += d * (float)(i[c] - b[c]);
    length2 += d * d;
  }
  return length2 < 12 * 12 ? -1 : fmaxf(dot / length2, 0);
}

// How far colours are from B, in half levels, where something is kept; into m->contrast.
static void measure_contrast(matte *m, const vt_image *b) {
  for (size_t p = 0; p < m->count; p++) {
    float d2 = 0;
    for (size_t c = 0; c < 3; c++) {
      float d = (float)(m->rgb->pixels[p * 3 + c] - b->pixels[p * 3 + c]);
      d2 += d * d;
    }
    m->contrast[p] = m->trimap[p] == BACKDROP ? 0 : (uint8_t)(0.5f * sqrtf(d2));
  }
}

// scratch = the highest contrast within REACH (a square); mask is overwritten.
static void find_peaks(matte *m) {
  for (int pass = 0; pass < 2; pass++) {
    const uint8_t *from = pass ? m->mask : m->contrast;
    uint8_t *to = pass ? m->scratch : m->mask;
    for (int y = 0; y < m->height; y++)
      for (int x = 0; x < m->width; x++) {
        size_t p = (size_t)y * (size_t)m->width + (size_t)x;
        uint8_t best = 0;
        int at = pass ? y : x, end = pass ? m->height : m->width;
        for (int i = at > REACH ? at - REACH : 0; i <= at + REACH && i < end; i++) {
          size_t q = pass ? (size_t)i * (size_t)m->width + (size_t)x : (size_t)y * (size_t)m->width + (size_t)i;
          if (from[q] > best) best = from[q];
        }
        to[p] = best;
      }
  }
}

// scratch = 1 where mask is 0 at the pixel and at all but two, at most, of its eight neighbours; an edge has three.
static void keep_insides(matte *m) {
  for (int y = 0; y < m->height; y++)
    for (int x = 0; x < m->width; x++) {
      size_t p = (size_t)y * (size_t)m->width + (size_t)x;
      int outside = 0;
      m->scratch[p] = 0;
      if (m->mask[p]) continue;
      for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < m->height; j++)
        for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < m->width; i++)
          outside += m->mask[(size_t)j * (size_t)m->width + (size_t)i];
      m->scratch[p] = outside <= 2;
    }
}

// A pixel darker than B, where B is bright: if it is near B it is a gap of the plant. (Before a dark backdrop it may
// as well be shade, which has to stay solid.)
static bool is_before_brightness(const uint8_t *i, const uint8_t *b) {
  int backdrop = b[0] + b[1] + b[2];
  return backdrop > 3 * 90 && i[0] + i[1] + i[2] < backdrop;
}

// A pixel darker than a dark B: a fold or a cable, not what a plant begins with.
static bool is_darker_than_dark(const uint8_t *i, const uint8_t *b) {
  int backdrop = b[0] + b[1] + b[2];
  return backdrop <= 3 * 90 && i[0] + i[1] + i[2] < backdrop;
}

// Marks in mask, and counts, what is unmixed by its place: a blurred edge has half of the contrast beside it where the
// plant ends, and unmixed is what lies a pixel inside of that line, whatever its colour, and the shade in the inside.
// Marks in contrast the peaks of what may be too thin for an inside.
static size_t mark_thick(matte *m, const vt_image *b) {
  size_t count = 0;
  measure_contrast(m, b);
  find_peaks(m);
  for (size_t p = 0; p < m->count; p++) {
    const uint8_t *i = m->rgb->pixels + p * 3, *back = b->pixels + p * 3;
    bool gap = is_before_brightness(i, back);
    int here = m->contrast[p] < LEAST || is_darker_than_dark(i, back) ? 0 : m->contrast[p], peak = m->scratch[p];
    m->mask[p] = !here || 100 * here < (gap ? 80 : 50) * peak;
    if (gap && m->mask[p] && m->trimap[p] == CORE) m->trimap[p] = INSIDE;
    bool shade = !gap && here && 4 * here >= peak && m->trimap[p] >= INSIDE;
    m->contrast[p] = (uint8_t)((here && 100 * here >= PEAK * peak) | shade << 1);
  }
  keep_insides(m);
  for (size_t p = 0; p < m->count; p++) {
    count += m->mask[p] = m->scratch[p] || (m->contrast[p] & 2);
    m->contrast[p] &= 1;
  }
  return count;
}

// F: the plant's unmixed colours, spread. A twig too thin for an inside is unmixed at its peak if that is far enough
// on the line to the colour of the thick parts near it.
static vt_status spread_plant(vt_context *context, matte *m, const vt_image *b, vt_image *out) {
  vt_image thick = {0};
  size_t count = mark_thick(m, b);
  vt_status status = count ? vt_spread_colours(context, m->rgb, m->mask, &thick) : VT_OK;
  if (status != VT_OK) return status;
  for (size_t p = 0; p < m->count; p++) {
    if (m->mask[p] || m->trimap[p] != PLANT || !m->contrast[p]) continue;
    const uint8_t *i = m->rgb->pixels + p * 3, *back = b->pixels + p * 3;
    float enough = is_before_brightness(i, back) ? 0.8f : 0.55f;
    m->mask[p] = !count || on_colour_line(i, back, thick.pixels + p * 3) > enough;
  }
  vt_free_image(context, &thick);
  return vt_spread_colours(context, m->rgb, m->mask, out);
}

// What 0 <= F <= 255 demands, with a margin for what B is not known to.
static float lowest_alpha(const uint8_t *i, const uint8_t *b) {
  float least = 0;
  for (int c = 0; c < 3; c++) {
    float d = (float)(i[c] - b[c]), margin = 24;
    float bound = d > 0 ? (d - margin) / (256 - (float)b[c]) : (-d - margin) / (1 + (float)b[c]);
    least = fmaxf(least, bound);
  }
  return least;
}

// Alpha into m->distance.
static void solve_alpha(matte *m, const vt_image *b, const vt_image *f) {
  for (size_t p = 0; p < m->count; p++) {
    float alpha = m->trimap[p] == BACKDROP ? 0 : 1;
    if (m->trimap[p] != BACKDROP && m->trimap[p] != CORE) {
      const uint8_t *i = m->rgb->pixels + p * 3, *bp = b->pixels + p * 3;
      alpha = on_colour_line(i, bp, f->pixels + p * 3);
      if (alpha < 0) alpha = ((float)m->distance[p] / STEPS - DOUBTFUL) / (2 * (SURE - DOUBTFUL));
      alpha = fmaxf(alpha, lowest_alpha(i, bp));
      alpha = alpha < 0.03f ? 0 : alpha > 0.98f ? 1 : alpha;
    }
    m->distance[p] = (uint8_t)(alpha * 255 + 0.5f);
  }
}

static void show_trimap(vt_context *context, const matte *m, const char *name) {
  vt_fimage image = {0};
  char title[96];
  snprintf(title, sizeof title, "trimap-%s", name);
  for (char *c = title; *c; c++)
    if (*c == '/' || *c == '.') *c = '-';
  if (vt_make_fimage(context, m->width, m->height, 1, &image) != VT_OK) return;
  for (size_t i = 0; i < m->count; i++) image.pixels[i] = (float)m->trimap[i] / 3;
  vt_probe(context, title, &image);
  vt_free_fimage(context, &image);
}

// True where most of what is kept is hardly kept, or nearly as much is nearly kept.
static bool is_faint(const matte *m) {
  size_t kept = 0, faint = 0, nearly = 0;
  for (size_t i = 0; i < m->count; i++) {
    bool keeps = m->trimap[i] != BACKDROP;
    kept += keeps, faint += keeps && m->distance[i] < (uint8_t)(SURE * STEPS);
    nearly += !keeps && m->distance[i] >= (uint8_t)(NEARLY * STEPS);
  }
  return (double)faint >= FAINT * (double)kept || 2 * nearly >= kept;
}

// Distances and parts. careful: see backdrop_model.c.
static vt_status cut(vt_context *context, bool careful, matte *m) {
  vt_backdrop backdrop;
  vt_status status = vt_model_backdrop(context, m->rgb, careful, &backdrop);
  if (status != VT_OK) return status;
  measure(&backdrop, m);
  vt_free_backdrop(context, &backdrop);
  return vt_find_parts(context, m->width, m->height, m->distance, (uint8_t)(DOUBTFUL * STEPS), (uint8_t)(SURE * STEPS),
                       (size_t)(FEW * (double)m->count) + 2, WEAK, m->trimap);
}

static vt_status make_matte(vt_context *context, const vt_image *rgb, matte *m) {
  m->rgb = rgb;
  m->width = rgb->width;
  m->height = rgb->height;
  m->count = (size_t)rgb->width * (size_t)rgb->height;
  m->distance = VT_NEW(context, uint8_t, m->count);
  m->trimap = VT_NEW(context, uint8_t, m->count);
  m->contrast = VT_NEW(context, uint8_t, m->count);
  m->mask = VT_NEW(context, uint8_t, m->count);
  m->scratch = VT_NEW(context, uint8_t, m->count);
  if (!m->distance || !m->trimap || !m->contrast || !m->mask || !m->scratch) return VT_OUT_OF_MEMORY;
  vt_status status = cut(context, false, m);
  if (!status && is_faint(m)) {
    memset(m->distance, 0, m->count);
    status = cut(context, true, m);
    m->faint = !status && is_faint(m);
  }
  if (status != VT_OK) return status;
  make_trimap(m);
  return VT_OK;
}

static void free_matte(vt_context *context, matte *m) {
  vt_free(context, m->distance);
  vt_free(context, m->trimap);
  vt_free(context, m->contrast);
  vt_free(context, m->mask);
  vt_free(context, m->scratch);
  *m = (matte){0};
}

vt_status vt_cut_backdrop(vt_context *context, const vt_image *rgb, vt_image *out) {
  matte m = {0};
  vt_status status = make_matte(context, rgb, &m);
  if (status == VT_OK) status = vt_make_image(context, rgb->width, rgb->height, 1, out);
  for (size_t i = 0; status == VT_OK && i < m.count; i++)
    out->pixels[i] = m.trimap[i] == BACKDROP ? 0 : m.trimap[i] == CORE ? 255 : 128;
  free_matte(context, &m);
  return status;
}

vt_status vt_matte_backdrop(vt_context *context, const vt_image *rgb, const char *name, vt_image *out_rgba) {
  VT_ASSERT(rgb->channels == 3 && rgb->width > 0 && rgb->height > 0);
  VT_ASSERT((uint64_t)rgb->width * (uint64_t)rgb->height < UINT32_MAX);
  memset(out_rgba, 0, sizeof *out_rgba);
  matte m = {0};
  vt_image b = {0}, f = {0};
  vt_status status = make_matte(context, rgb, &m);
  if (status != VT_OK) goto done;
  if (m.faint) // not to be had from one photograph; who knows it can hang up another cloth
    vt_log(context, VT_LOG_NORMAL,
           "%s: the plant hardly differs from the backdrop, and parts of it are lost; a cloth much lighter or darker, or of another "
           "colour, or masks (--masks) are the cure",
           name);
  if (vt_wants_probes(context)) show_trimap(context, &m, name);
  status = spread_backdrop(context, &m, &b);
  if (status != VT_OK) goto done;
  status = spread_plant(context, &m, &b, &f);
  if (status != VT_OK) goto done;
  solve_alpha(&m, &b, &f);
  status = vt_make_image(context, rgb->width, rgb->height, 4, out_rgba);
  if (status != VT_OK) goto done;
  for (size_t i = 0; i < m.count; i++) {
    memcpy(out_rgba->pixels + i * 4, rgb->pixels + i * 3, 3);
    out_rgba->pixels[i * 4 + 3] = m.distance[i];
  }
  free_matte(context, &m); // the next step needs as much
  vt_free_image(context, &b);
  vt_free_image(context, &f);
  status = vt_estimate_foreground(context, out_rgba);
done:
  free_matte(context, &m);
  vt_free_image(context, &b);
  vt_free_image(context, &f);
  if (status != VT_OK) vt_free_image(context, out_rgba);
  return status;
}
