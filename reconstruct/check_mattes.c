// check_mattes.c - mattes that contradict those of the other photographs
// SPDX-License-Identifier: BSD-3-Clause
//
// A matte with a hole carves the tree, a matte of another tree carves most of it: one photograph that sees a cell empty is
// enough. So each matte is compared with what a volume of the other photographs shows from its camera. The views are dealt to
// folds, a coarse volume for each is made of the others with several votes a cell, and at one pixel a cell
//
//   disagreement of a view = sum (alpha_volume - alpha_matte)^2 / sum max(alpha_volume, alpha_matte)
//
// How large it is depends on the tree; that of one view is judged among those of all. Logarithms, their median, and 1.4826 times
// the median distance from it for a deviation that bad views cannot move [Hampel 1974]: a view SUSPICIOUS deviations above the
// median, and at least twice it, is doubtful. What the worst views do to the volumes hides the next: so they are taken out, the
// volumes are made anew, and it is asked again. A matte that is shifted or belongs to another photograph, or a camera that is
// far off, looks the same from here; it would harm the tree as much.

#include "reconstruct/refine_cameras.h"

#include <stdlib.h>
#include <string.h>

#define LEVEL 5
#define FOLDS 4
#define ROUNDS 3
#define LEAST_VIEWS 8
#define SUSPICIOUS 5.0
#define LEAST_DEVIATION 0.08 // of the logarithm: where all views agree equally well, little differences mean nothing
#define LEAST_RATIO 2.0
#define LEAST_DISAGREEMENT 0.02 // what is below this harms nothing
#define MOST_SHARE 0.25

void vt_free_matte_report(vt_context *context, vt_matte_report *report) {
  vt_free(context, report->disagreement);
  *report = (vt_matte_report){0};
}

static int compare_doubles(const void *a, const void *b) {
  double p = *(const double *)a, q = *(const double *)b;
  return (p > q) - (p < q);
}

static double median(double *values, int count) { // sorts them
  qsort(values, (size_t)count, sizeof *values, compare_doubles);
  return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

static double disagreement_of(const float *shown, const vt_image *matte, const uint8_t *ignored_or_null) {
  double difference = 0, either = 0;
  for (size_t i = 0; i < (size_t)matte->width * (size_t)matte->height; i++) {
    if (ignored_or_null && ignored_or_null[i]) continue;
    double a = (double)shown[i], b = matte->pixels[4 * i + 3] / 255.0;
    difference += (a - b) * (a - b), either += fmax(a, b);
  }
  return either > 0 ? difference / either : 0;
}

// Of each view, doubtful ones too, in the volumes of those that are not.
static vt_status measure(vt_refinement *r, const vt_reduced_views *reduced, const uint8_t *doubtful, double *disagreement) {
  vt_views others = {.items = VT_NEW(r->context, vt_view, (size_t)r->views.count)};
  vt_status status = others.items ? VT_OK : VT_OUT_OF_MEMORY;
  const vt_soft_volume_desc desc = {LEVEL, 8, r->views.count >= 16 ? 3 : 2};
  for (int k = 0; k < FOLDS && !status; k++) {
    vt_soft_volume volume = {0};
    others.count = 0;
    for (int i = 0; i < r->views.count; i++)
      if (i % FOLDS != k && !doubtful[i]) others.items[others.count++] = r->views.items[i];
    status = vt_make_soft_volume(r->context, &others, r->cube.origin, r->cube.edge, &desc, &volume);
    for (int i = k; i < r->views.count && !status; i += FOLDS) {
      const vt_image *matte = &reduced->pictures[i];
      float *shown = VT_NEW(r->context, float, (size_t)matte->width * (size_t)matte->height);
      status = shown ? vt_draw_soft_volume(r->context, &volume, &reduced->cameras[i], shown) : VT_OUT_OF_MEMORY;
      if (!status) disagreement[i] = disagreement_of(shown, matte, reduced->ignored[i].pixels);
      vt_free(r->context, shown);
    }
    vt_free_soft_volume(r->context, &volume);
  }
  vt_free(r->context, others.items);
  return status;
}

// Marks those far above the others; returns how many are new. scratch: [count].
static int mark(const double *disagreement, int count, uint8_t *doubtful, double *scratch, double *usual) {
  int good = 0, found = 0, all = 0;
  for (int i = 0; i < count; i++)
    if (!doubtful[i]) scratch[good++] = log(disagreement[i] + 1e-6);
  double middle = median(scratch, good);
  for (int i = 0; i < good; i++) scratch[i] = fabs(scratch[i] - middle);
  double deviation = fmax(1.4826 * median(scratch, good), LEAST_DEVIATION);
  double bound = fmax(middle + fmax(SUSPICIOUS * deviation, log(LEAST_RATIO)), log(LEAST_DISAGREEMENT));
  *usual = exp(middle);
  for (int i = 0; i < count; i++) all += doubtful[i] || log(disagreement[i] + 1e-6) > bound;
  if (all > MOST_SHARE * count) return 0; // so many are not the exception
  for (int i = 0; i < count; i++)
    if (!doubtful[i] && log(disagreement[i] + 1e-6) > bound) doubtful[i] = 1, found++;
  return found;
}

static vt_status find_doubtful(vt_refinement *r, uint8_t *doubtful, double *disagreement, double *usual) {
  int count = r->views.count, factor = (int)(r->root_pixels / (1 << LEVEL));
  vt_reduced_views reduced;
  double *scratch = VT_NEW(r->context, double, (size_t)count);
  if (!scratch) return VT_OUT_OF_MEMORY;
  vt_status status = vt_reduce_views(r->context, &r->views, factor < 1 ? 1 : factor, &reduced);
  for (int round = 0; round < ROUNDS && !status; round++) {
    status = measure(r, &reduced, doubtful, disagreement);
    if (!status && !mark(disagreement, count, doubtful, scratch, usual)) break;
  }
  vt_free_reduced_views(r->context, &reduced);
  vt_free(r->context, scratch);
  return status;
}

static vt_status check(vt_context *context, const vt_views *train, vt_views *views, vt_matte_report *report) {
  size_t count = (size_t)train->count;
  vt_refine_desc desc = vt_default_refine_desc();
  vt_refinement r = {0};
  uint8_t *doubtful = VT_NEW(context, uint8_t, count);
  double *disagreement = VT_NEW(context, double, count);
  vt_status status = doubtful && disagreement ? vt_begin_refinement(context, &desc, train, 3, &r) : VT_OUT_OF_MEMORY;
  if (!status) status = find_doubtful(&r, doubtful, disagreement, &report->usual);
  report->tried = !status;
  for (int i = 0, k = 0; i < views->count && !status; i++) {
    if (views->items[i].role != VT_TRAIN) continue;
    report->disagreement[i] = disagreement[k];
    if (doubtful[k++]) views->items[i].role = VT_DOUBTFUL, report->doubtful_count++;
  }
  vt_end_refinement(&r);
  vt_free(context, disagreement);
  vt_free(context, doubtful);
  if (status != VT_BAD_INPUT) return status;
  vt_clear_error(context); // no volume in common: the reconstruction says so
  return VT_OK;
}

vt_status vt_check_mattes(vt_context *context, vt_views *views, vt_matte_report *or_null) {
  vt_matte_report report = {.disagreement = VT_NEW(context, double, (size_t)views->count)};
  double start = vt_seconds();
  vt_views train = {0};
  vt_status status = report.disagreement ? vt_select_views(context, views, VT_TRAIN, &train) : VT_OUT_OF_MEMORY;
  for (int i = 0; i < views->count && !status; i++) report.disagreement[i] = -1;
  report.view_count = train.count;
  if (!status && train.count >= LEAST_VIEWS) status = check(context, &train, views, &report);
  report.seconds = vt_seconds() - start;
  vt_free(context, train.items);
  if (or_null && !status) *or_null = report;
  else vt_free_matte_report(context, &report);
  if (or_null && status) *or_null = report;
  return status;
}
