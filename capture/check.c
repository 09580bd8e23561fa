// check.c - photographs looked at before the work: what is wrong with them, and what it would cost to go on
// SPDX-License-Identifier: BSD-3-Clause
//
// Nothing absolute is asked of a photograph: a dark backdrop is no fault, and a soft lens is soft in all of them. It is
// compared with those beside it in the list, which were taken just before and after: sharpness as a share of their median,
// brightness and white balance as a step away from it. A step that all the following photographs share is told once, where it
// happens, since medians of both sides move on. Doubles are thumbnails that agree to within the noise of JPEG.
#include "capture/check.h"
#include "base/image_file.h"
#include "capture/colmap_photos.h"
#include "capture/photo_measure.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NEIGHBOURS = 4, FEW = 20 }; // photographs to each side; fewer than this are too few for a tree
#define LEAST_SHARPNESS 0.7        // of the neighbours'
#define LARGEST_EXPOSURE_STEP 0.6  // stops
#define LARGEST_WHITE_STEP 0.3     // stops
#define DOUBLE_DIFFERENCE 0.6      // of 255, root mean square of thumbnails
#define LARGEST_GAP 45             // degrees between neighbours around the tree

// ---- sentences

vt_status vt_note_sentence(vt_context *context, int *count, char ***sentences, const char *format, ...) {
  char **items = vt_realloc(context, *sentences, (size_t)*count + 1, sizeof *items), text[1400];
  if (!items) return VT_OUT_OF_MEMORY;
  *sentences = items;
  va_list list;
  va_start(list, format);
  vsnprintf(text, sizeof text, format, list);
  va_end(list);
  items[*count] = vt_strdup(context, text);
  return items[(*count)++] ? VT_OK : VT_OUT_OF_MEMORY;
}

void vt_free_sentences(vt_context *context, int *count, char ***sentences) {
  for (int i = 0; i < *count; i++) vt_free(context, (*sentences)[i]);
  vt_free(context, *sentences);
  *sentences = NULL;
  *count = 0;
}

void vt_free_check_report(vt_context *context, vt_check_report *report) {
  for (int i = 0; i < report->count && report->photos; i++) vt_free(context, report->photos[i].name);
  vt_free(context, report->photos);
  vt_free_sentences(context, &report->warning_count, &report->warnings);
  *report = (vt_check_report){0};
}

// ---- measuring

typedef struct work {
  vt_context *context;
  const char *folder;
  const vt_names *names;
  vt_photo_measure *measures;
  vt_status *status;
} work;

static vt_status measure_one(work *w, size_t i) {
  char *path = vt_join(w->context, w->folder, w->names->items[i]);
  vt_image picture = {0};
  vt_status status = path ? vt_read_image(w->context, path, &picture) : VT_OUT_OF_MEMORY;
  if (!status) status = vt_measure_photo(w->context, &picture, &w->measures[i]);
  vt_free_image(w->context, &picture);
  vt_free(w->context, path);
  return status;
}

static void measure_block(void *user, size_t begin, size_t end, int worker) {
  work *w = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) w->status[i] = measure_one(w, i);
}

// Of several bad files the first by name is the one in the sentence.
static vt_status measure_all(work *w, bool strict, vt_check_report *out) {
  size_t count = (size_t)w->names->count;
  vt_status status = vt_parallel(w->context, count, 1, measure_block, w);
  for (size_t i = 0; i < count && !status; i++) {
    if (!w->status[i]) continue;
    vt_clear_error(w->context);
    vt_status again = measure_one(w, i); // what only lacked memory beside the others is there now
    if (again == VT_BAD_INPUT && !strict) {
      out->photos[i].troubles |= VT_PHOTO_UNREADABLE;
      out->unreadable_count++;
      status = vt_note_sentence(w->context, &out->warning_count, &out->warnings, "%s", vt_last_error(w->context));
      vt_clear_error(w->context);
    } else {
      status = again;
    }
  }
  return status;
}

// ---- comparing

static int compare_doubles(const void *a, const void *b) {
  double p = *(const double *)a, q = *(const double *)b;
  return p < q ? -1 : p > q;
}

typedef enum quantity { SHARPNESS, EXPOSURE, RED, BLUE } quantity;

static double value_of(const vt_photo_measure *m, quantity q) {
  return q == SHARPNESS ? m->sharpness : q == EXPOSURE ? m->exposure : q == RED ? m->red : m->blue;
}

// The median over the neighbours [from, to] of photograph i, without itself; NAN where there is none.
static double median_around(const work *w, const vt_check_report *r, int i, int from, int to, quantity q) {
  double values[2 * NEIGHBOURS + 1];
  size_t count = 0;
  for (int k = from; k <= to; k++) {
    if (k < 0 || k >= r->count || k == i || r->photos[k].troubles & VT_PHOTO_UNREADABLE) continue;
    if (r->photos[k].group != r->photos[i].group) continue; // another camera sees otherwise
    values[count] = value_of(&w->measures[k], q);
    count += values[count] == values[count];
  }
  if (!count) return NAN;
  qsort(values, count, sizeof *values, compare_doubles);
  return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

// How far photograph i is from those before it and from those after it: the nearer side counts, so that the photographs on
// both sides of a step are not blamed for it.
static double step_of(const work *w, const vt_check_report *r, int i, quantity q) {
  double own = value_of(&w->measures[i], q);
  double before = own - median_around(w, r, i, i - NEIGHBOURS, i - 1, q);
  double after = own - median_around(w, r, i, i + 1, i + NEIGHBOURS, q);
  if (!(before == before)) return after == after ? after : 0;
  if (!(after == after)) return before;
  return fabs(before) < fabs(after) ? before : after;
}

static double thumb_difference(const vt_photo_measure *a, const vt_photo_measure *b) {
  double sum = 0;
  for (int i = 0; i < VT_THUMB * VT_THUMB; i++)
    for (int k = 0; k < 3; k++) {
      double d = (double)a->thumb[i][k] - (double)b->thumb[i][k];
      sum += d * d;
    }
  return sqrt(sum / (3.0 * VT_THUMB * VT_THUMB));
}

static void judge_photo(const work *w, vt_check_report *r, int i) {
  vt_checked_photo *p = &r->photos[i];
  p->twin = -1;
  p->sharpness = NAN;
  if (p->troubles & VT_PHOTO_UNREADABLE) return;
  p->sharpness = w->measures[i].sharpness / median_around(w, r, i, i - NEIGHBOURS, i + NEIGHBOURS, SHARPNESS);
  p->exposure_step = step_of(w, r, i, EXPOSURE);
  double red = step_of(w, r, i, RED), blue = step_of(w, r, i, BLUE);
  p->white_step = fabs(red) > fabs(blue) ? red : blue;
  for (int k = 0; k < i && p->twin < 0; k++)
    if (!(r->photos[k].troubles & VT_PHOTO_UNREADABLE) && r->photos[k].width == p->width &&
        thumb_difference(&w->measures[k], &w->measures[i]) < DOUBLE_DIFFERENCE)
      p->twin = k;
  if (p->sharpness < LEAST_SHARPNESS) p->troubles |= VT_PHOTO_BLURRED;
  if (fabs(p->exposure_step) > LARGEST_EXPOSURE_STEP) p->troubles |= VT_PHOTO_EXPOSURE;
  if (fabs(p->white_step) > LARGEST_WHITE_STEP) p->troubles |= VT_PHOTO_WHITE;
  if (p->twin >= 0) p->troubles |= VT_PHOTO_DOUBLE;
}

// ---- saying

static vt_status warn_of_photo(vt_context *context, vt_check_report *r, int i) {
  const vt_checked_photo *p = &r->photos[i];
  int *count = &r->warning_count;
  char ***out = &r->warnings;
  vt_status status = VT_OK;
  if (p->troubles & VT_PHOTO_BLURRED)
    status = vt_note_sentence(context, count, out, "%s: blurred (%.0f %% as sharp as its neighbours); take it again, or leave it out",
                             p->name, 100 * p->sharpness);
  if (!status && p->troubles & VT_PHOTO_EXPOSURE)
    status = vt_note_sentence(context, count, out,
                             "%s: %.1f stops %s than its neighbours; set the exposure by hand, the same for all", p->name,
                             fabs(p->exposure_step), p->exposure_step > 0 ? "brighter" : "darker");
  if (!status && p->troubles & VT_PHOTO_WHITE)
    status = vt_note_sentence(context, count, out,
                             "%s: another white balance than its neighbours (%.1f stops); set it by hand, the same for all",
                             p->name, fabs(p->white_step));
  if (!status && p->troubles & VT_PHOTO_DOUBLE)
    status = vt_note_sentence(context, count, out, "%s: shows the same as %s; leave one of them out", p->name,
                             r->photos[p->twin].name);
  return status;
}

static vt_status warn_of_all(vt_context *context, vt_check_report *r) {
  int sizes = 0, turned = 0, lenses = 0;
  vt_status status = VT_OK;
  for (int i = 1; i < r->count; i++) {
    const vt_checked_photo *p = &r->photos[i], *first = &r->photos[0];
    sizes += p->width != first->width || p->height != first->height;
    turned += p->orientation != first->orientation;
    lenses += fabs(p->focal_35mm - first->focal_35mm) > 0.005 * first->focal_35mm;
  }
  if (r->count < FEW)
    status = vt_note_sentence(context, &r->warning_count, &r->warnings,
                             "%d photograph%s: few for a tree; take 30 to 60 all around it, each showing most of what its "
                             "neighbours show",
                             r->count, r->count == 1 ? "" : "s");
  if (!status && r->group_count > 1)
    status = vt_note_sentence(context, &r->warning_count, &r->warnings,
                             "%d kinds of photographs (%s%s%s), which get a camera each; one camera at one focal length is found "
                             "more exactly",
                             r->group_count, sizes ? "sizes" : "", sizes && lenses ? " and " : "",
                             lenses ? "focal lengths" : sizes ? "" : "cameras");
  if (!status && turned && !sizes)
    status = vt_note_sentence(context, &r->warning_count, &r->warnings,
                             "%d of %d photographs are turned otherwise than the first; that is allowed, hold the camera one "
                             "way where you can",
                             turned, r->count);
  for (int i = 0; i < r->count && !status; i++) status = warn_of_photo(context, r, i);
  return status;
}

vt_status vt_warn_of_coverage(vt_context *context, const vt_coverage *c, const char *name_begin, const char *name_end,
                              int *warning_count, char ***warnings) {
  if (c->count < 2 || c->largest_gap < LARGEST_GAP) return VT_OK;
  if (c->around < 200)
    return vt_note_sentence(context, warning_count, warnings,
                           "the photographs cover %.0f degrees around the tree; what is behind and beside it stays unknown: "
                           "take photographs from there, from %s on to %s",
                           c->around, name_begin, name_end);
  return vt_note_sentence(context, warning_count, warnings,
                         "a gap of %.0f degrees in the loop, between %s and %s; what is seen only from there stays unknown: take "
                         "photographs in between",
                         c->largest_gap, name_begin, name_end);
}

double vt_guess_calibration(int photographs, double megapixels, int threads) {
  double n = photographs, pairs = n <= 150 ? n * (n - 1) / 2 : 15 * n;
  return (2.5 * megapixels + 0.6 * pairs + 1.5 * n) / threads; // processor seconds, measured on 20 photographs
}

double vt_guess_developing(double megapixels, int threads, bool mattes) {
  return (mattes ? 1.0 : 0.08) * megapixels / threads;
}

// ---- all

static vt_status take_headers(vt_context *context, const char *folder, const vt_names *names, bool strict,
                              vt_check_report *out) {
  size_t count = (size_t)names->count;
  int *group = VT_NEW(context, int, count);
  vt_image_info *infos = VT_NEW(context, vt_image_info, count);
  vt_status status = group && infos ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) status = vt_read_headers(context, folder, names, strict, infos);
  if (!status) out->group_count = vt_group_photographs(infos, names->count, group);
  for (size_t i = 0; i < count && !status; i++) {
    vt_checked_photo *p = &out->photos[i];
    p->name = vt_strdup(context, names->items[i]);
    if (!p->name) status = VT_OUT_OF_MEMORY;
    p->width = infos[i].width;
    p->height = infos[i].height;
    p->orientation = infos[i].orientation;
    p->focal_35mm = infos[i].focal_35mm;
    p->group = group[i];
    out->megapixels += 1e-6 * infos[i].width * infos[i].height;
    if (p->width > out->longest) out->longest = p->width;
    if (p->height > out->longest) out->longest = p->height;
  }
  vt_free(context, group);
  vt_free(context, infos);
  return status;
}

vt_status vt_check_photographs(vt_context *context, const char *folder, const vt_names *names, bool strict,
                               vt_check_report *out) {
  size_t count = (size_t)names->count;
  *out = (vt_check_report){.photos = VT_NEW(context, vt_checked_photo, count)};
  if (!out->photos) return VT_OUT_OF_MEMORY;
  out->count = names->count;
  work w = {context, folder, names, VT_NEW(context, vt_photo_measure, count), VT_NEW(context, vt_status, count)};
  vt_status status = w.measures && w.status ? take_headers(context, folder, names, strict, out) : VT_OUT_OF_MEMORY;
  if (!status) status = measure_all(&w, strict, out);
  for (int i = 0; i < out->count && !status; i++) judge_photo(&w, out, i);
  if (!status) status = warn_of_all(context, out);
  vt_free(context, w.measures);
  vt_free(context, w.status);
  return status;
}
