// balance_views.c - exposure and white balance of each photograph, from how the others show the same tree
// SPDX-License-Identifier: BSD-3-Clause
//
// A coarse volume with colours is the mean of what the photographs show. Of view i and channel c, in linear light, over the pixels
// that both show as tree and that are neither black nor clipped,
//
//   e_ic = ln (sum of the volume's light / sum of the photograph's)
//
// is the gain that is missing, and the light: the side in the sun is brighter than the mean of both, from all cameras there
// alike. Exposure jumps from photograph to photograph, light changes smoothly with direction. So what a constant and three
// directions (a ridge: light of LIGHT_DEVIATION is expected) (from 20 views on: and a quadric) say of e is left in the photographs and the rest g is taken for the gain; its
// mean over the views is 0. Nothing is done unless what no quadric explains at all deviates by more than LEAST_DEVIATION: photographs of one exposure stay as they are, byte for byte.
//
// What was clipped stays clipped. A second pass, with a volume of the balanced photographs, takes what the first one's mean hid.

#include "reconstruct/bounds.h"
#include "reconstruct/run.h"

#include <string.h>

#define LEVEL 5
#define LEAST_VIEWS 8
#define TERMS 10 // 1, x, y, z, and six of second order, of which one is no news on a sphere and only costs a ridge
#define LIGHT_DEVIATION 0.15
#define LEAST_DEVIATION 0.08
#define LEAST_PIXELS 20
#define SOLID 0.8f
#define PASSES 2

static double linear_of(double v) { return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4); }
static double encoded_of(double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055; }

// ---- what is missing

// e of one view; false where too few pixels say anything.
static bool missing_gain(const vt_fimage *shown, const vt_image *photo, double gain[3]) {
  double volume[3] = {0}, own[3] = {0};
  int pixels = 0;
  for (size_t i = 0; i < (size_t)photo->width * (size_t)photo->height; i++) {
    const uint8_t *p = photo->pixels + 4 * i;
    const float *v = shown->pixels + 4 * i;
    bool usable = v[3] > SOLID && (float)p[3] > 255 * SOLID;
    for (int c = 0; c < 3; c++) usable = usable && p[c] > 5 && p[c] < 250;
    if (!usable) continue;
    pixels++;
    for (int c = 0; c < 3; c++) volume[c] += linear_of((double)(v[c] / v[3])), own[c] += linear_of(p[c] / 255.0);
  }
  if (pixels < LEAST_PIXELS) return false;
  for (int c = 0; c < 3; c++) gain[c] = log((volume[c] + 1e-6) / (own[c] + 1e-6));
  return true;
}

// A volume with colours.
static vt_status colour_volume(vt_context *context, const vt_views *views, vt_tree *out) {
  vt_reconstruct_desc how = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_DRAFT);
  vt_reconstruct_report report = {0};
  *out = (vt_tree){0};
  vt_run r = {context, &how, vt_recipe_of(&how), views, out, &report, .start = vt_seconds(), .leaf = LEVEL, .bare_epochs = 1};
  vt_status status = vt_solve_opacity_levels(&r);
  if (!status && !out->octree.levels[LEVEL].cell_count) status = vt_fail(context, VT_BAD_INPUT, "mattes: nothing is left of the tree");
  return status;
}

static vt_status find_missing(vt_context *context, const vt_views *views, double (*gain)[3], uint8_t *known, vt_vec3 *middle) {
  vt_tree tree;
  vt_reduced_views reduced = {0};
  double pixels = 0;
  vt_status status = colour_volume(context, views, &tree);
  double half = 0.5 * tree.octree.edge;
  *middle = vt_add(tree.octree.origin, vt_v3(half, half, half));
  if (!status) status = vt_projected_size(context, views, *middle, vt_cell_edge(&tree.octree, LEVEL), &pixels);
  if (!status) status = vt_reduce_views(context, views, pixels < 2 ? 1 : (int)(pixels / 2), &reduced);
  for (int i = 0; i < views->count && !status; i++) {
    vt_fimage shown = {0};
    status = vt_composite(context, &tree, LEVEL, NULL, VT_BLEND_SUM, true, &reduced.cameras[i], &shown);
    if (!status) known[i] = missing_gain(&shown, &reduced.pictures[i], gain[i]);
    vt_free_fimage(context, &shown);
  }
  vt_free_reduced_views(context, &reduced);
  vt_free_tree(context, &tree);
  return status;
}

// ---- what of it is light

static void terms_of(vt_vec3 u, double out[TERMS]) {
  const double terms[TERMS] = {1, u.x, u.y, u.z, u.x * u.x, u.x * u.y, u.x * u.z, u.y * u.y, u.y * u.z, u.z * u.z};
  memcpy(out, terms, sizeof terms);
}

// a x = b by elimination; a is symmetric and positive definite.
static void solve(double a[TERMS][TERMS], double b[TERMS], int n) {
  for (int k = 0; k < n; k++)
    for (int i = k + 1; i < n; i++) {
      double f = a[i][k] / a[k][k];
      for (int j = k; j < n; j++) a[i][j] -= f * a[k][j];
      b[i] -= f * b[k];
    }
  for (int k = n - 1; k >= 0; k--) {
    for (int j = k + 1; j < n; j++) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
}

// value[i] (i known) minus its fit by the first `terms` of the views' directions; ridge: of all but the constant.
static void take_smooth_away(int count, const uint8_t *known, const vt_vec3 *direction, int terms, double ridge, double *value) {
  double a[TERMS][TERMS] = {{0}}, b[TERMS] = {0}, t[TERMS];
  for (int i = 0; i < count; i++) {
    if (!known[i]) continue;
    terms_of(direction[i], t);
    for (int j = 0; j < terms; j++) {
      b[j] += t[j] * value[i];
      for (int k = 0; k < terms; k++) a[j][k] += t[j] * t[k];
    }
  }
  for (int j = 0; j < terms; j++) a[j][j] += j ? ridge : 1e-9;
  solve(a, b, terms);
  for (int i = 0; i < count; i++) {
    terms_of(direction[i], t);
    for (int j = 0; j < terms && known[i]; j++) value[i] -= b[j] * t[j];
  }
}

static double deviation_of(int count, const uint8_t *known, const double *value, int taken) {
  double squares = 0;
  int good = 0;
  for (int i = 0; i < count; i++)
    if (known[i]) squares += value[i] * value[i], good++;
  return good > taken ? sqrt(squares / (good - taken)) : 0;
}

// gain: in, what is missing; out, without the light. Returns the deviation of what cannot be light.
static double separate(int count, const uint8_t *known, const vt_vec3 *direction, double (*gain)[3], double *scratch) {
  int good = 0;
  double deviation = 0;
  for (int i = 0; i < count; i++) good += known[i];
  int terms = good >= 20 ? TERMS : good >= 8 ? 4 : 1;
  for (int c = 0; c < 3; c++) {
    for (int i = 0; i < count; i++) scratch[i] = gain[i][c];
    take_smooth_away(count, known, direction, terms, 1e-3, scratch);
    double own = deviation_of(count, known, scratch, terms == TERMS ? TERMS - 1 : terms);
    deviation = fmax(deviation, own);
    for (int i = 0; i < count; i++) scratch[i] = gain[i][c];
    take_smooth_away(count, known, direction, terms, own * own / (LIGHT_DEVIATION * LIGHT_DEVIATION), scratch);
    for (int i = 0; i < count; i++) gain[i][c] = known[i] ? scratch[i] : 0;
  }
  return deviation;
}

// ---- doing it

static void apply_gain(vt_image *picture, const double gain[3]) {
  uint8_t table[3][256];
  for (int c = 0; c < 3; c++)
    for (int v = 0; v < 256; v++)
      table[c][v] = (uint8_t)(255 * encoded_of(fmin(1, linear_of(v / 255.0) * exp(gain[c]))) + 0.5);
  for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; i++)
    for (int c = 0; c < 3; c++) picture->pixels[4 * i + (size_t)c] = table[c][picture->pixels[4 * i + (size_t)c]];
}

static vt_status balance(vt_context *context, vt_views *train, vt_balance_report *report) {
  size_t count = (size_t)train->count;
  double (*gain)[3] = vt_alloc(context, count, sizeof *gain), *scratch = VT_NEW(context, double, count);
  uint8_t *known = VT_NEW(context, uint8_t, count);
  vt_vec3 *direction = VT_NEW(context, vt_vec3, count), middle = {0, 0, 0};
  vt_status status = gain && scratch && known && direction ? VT_OK : VT_OUT_OF_MEMORY;
  for (int pass = 0; pass < PASSES && !status; pass++) {
    status = find_missing(context, train, gain, known, &middle);
    if (status) break;
    for (int i = 0; i < train->count; i++)
      direction[i] = vt_normalise(vt_sub(vt_camera_centre(&train->items[i].camera), middle));
    double deviation = separate(train->count, known, direction, gain, scratch);
    if (!pass) report->deviation = deviation;
    if (!pass && !(deviation > LEAST_DEVIATION)) break;
    report->changed = true;
    for (int i = 0; i < train->count; i++) {
      if (known[i]) apply_gain(&train->items[i].picture, gain[i]);
      for (int c = 0; c < 3 && !pass; c++) report->most_gain = fmax(report->most_gain, fabs(gain[i][c]));
    }
  }
  vt_free(context, direction);
  vt_free(context, known);
  vt_free(context, scratch);
  vt_free(context, gain);
  return status;
}

vt_status vt_balance_views(vt_context *context, vt_views *views, vt_balance_report *or_null) {
  vt_balance_report report = {0};
  double start = vt_seconds();
  vt_views train;
  vt_status status = vt_select_views(context, views, VT_TRAIN, &train);
  if (status) return status;
  if (train.count >= LEAST_VIEWS) status = balance(context, &train, &report); // pictures are the same memory
  if (status == VT_BAD_INPUT) { // no volume in common: the reconstruction says so
    vt_clear_error(context);
    status = VT_OK;
  }
  report.seconds = vt_seconds() - start;
  vt_free(context, train.items);
  if (or_null) *or_null = report;
  return status;
}
