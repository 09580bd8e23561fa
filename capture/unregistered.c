// unregistered.c - why photographs have no place, and what to do about it
// SPDX-License-Identifier: BSD-3-Clause
//
// Three things are measured: how many features a photograph has, how sharp it is beside its neighbours in the list
// (photo_measure.c), and how many points it has in common with which others (inliers of the pairs in colmap's database). The
// first cause that fits is told, in the order in which one follows from the other: a blurred photograph has few features, and
// one with few features has few points in common.
#include "capture/unregistered.h"
#include "base/image_file.h"
#include "capture/colmap_model.h"
#include "capture/match_table.h"
#include "capture/photo_measure.h"

#include <stdlib.h>
#include <string.h>

enum { NEIGHBOURS = 3, ENOUGH = 30 }; // photographs to each side; inliers that the mapper asks for

typedef struct link {
  int inliers, partner;                 // the best of all photographs
  int placed_inliers, placed_partner;   // and of those in the model; partner -1: none
} link;

typedef struct search {
  vt_colmap *c;
  const char *folder;
  const bool *placed;
  link *links;
  bool pairs_known;
  int median_features;
} search;

static void take_link(search *s, int from, int to, int inliers) {
  link *l = &s->links[from];
  if (inliers > l->inliers) l->inliers = inliers, l->partner = to;
  if (s->placed[to] && inliers > l->placed_inliers) l->placed_inliers = inliers, l->placed_partner = to;
}

static void hear_pair(void *user, const char *name_a, const char *name_b, int inliers) {
  search *s = user;
  int a = vt_find_sorted_name((const char *const *)s->c->names->items, s->c->names->count, name_a), b = vt_find_sorted_name((const char *const *)s->c->names->items, s->c->names->count, name_b);
  if (a < 0 || b < 0) return;
  take_link(s, a, b, inliers);
  take_link(s, b, a, inliers);
}

static int compare_ints(const void *a, const void *b) {
  int p = *(const int *)a, q = *(const int *)b;
  return p < q ? -1 : p > q;
}

static int compare_doubles(const void *a, const void *b) {
  double p = *(const double *)a, q = *(const double *)b;
  return p < q ? -1 : p > q;
}

static vt_status find_median_features(search *s) {
  int *all = VT_NEW(s->c->context, int, (size_t)s->c->names->count), count = 0;
  if (!all) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < s->c->names->count; i++)
    if (s->c->photos[i].features >= 0) all[count++] = s->c->photos[i].features;
  if (count) qsort(all, (size_t)count, sizeof *all, compare_ints);
  s->median_features = count ? all[count / 2] : 0;
  vt_free(s->c->context, all);
  return VT_OK;
}

static double sharpness_of(search *s, int i) { // NAN: not known
  vt_context *context = s->c->context;
  char *path = vt_join(context, s->folder, s->c->names->items[i]);
  vt_image picture = {0};
  vt_photo_measure measure = {.sharpness = NAN};
  if (!path || vt_read_image(context, path, &picture) || vt_measure_photo(context, &picture, &measure))
    vt_clear_error(context);
  vt_free_image(context, &picture);
  vt_free(context, path);
  return measure.sharpness;
}

// Sharpness beside the median of the neighbours; 1 where it is not known.
static double relative_sharpness(search *s, int i) {
  double around[2 * NEIGHBOURS], own = sharpness_of(s, i);
  size_t count = 0;
  for (int k = i - NEIGHBOURS; k <= i + NEIGHBOURS; k++) {
    if (k < 0 || k >= s->c->names->count || k == i) continue;
    around[count] = sharpness_of(s, k);
    count += around[count] > 0;
  }
  if (!(own >= 0) || !count) return 1;
  qsort(around, count, sizeof *around, compare_doubles);
  return own / around[count / 2];
}

static void explain(search *s, int i, char *why, size_t size) {
  const link *l = &s->links[i];
  int features = s->c->photos[i].features;
  double sharpness = relative_sharpness(s, i);
  const char *const *names = (const char *const *)s->c->names->items;
  if (sharpness < 0.7)
    snprintf(why, size, "not registered: blurred (%.0f %% as sharp as its neighbours); take it again, or leave it out",
             100 * sharpness);
  else if (features >= 0 && (features < 100 || 4 * features < s->median_features))
    snprintf(why, size,
             "not registered: too few features (%d, the others have %d): too dark, too bright or too plain; take it again with "
             "something textured that stands still in sight",
             features, s->median_features);
  else if (s->pairs_known && l->partner < 0)
    snprintf(why, size,
             "not registered: no overlap, it has nothing in common with any other photograph; take photographs between it and "
             "the others, in steps of at most 10 degrees");
  else if (s->pairs_known && l->placed_partner < 0)
    snprintf(why, size,
             "not registered: it fits to %s, but both to none of the rest; take photographs between these and the others",
             names[l->partner]);
  else if (s->pairs_known && l->placed_inliers < ENOUGH)
    snprintf(why, size,
             "not registered: too little overlap (at most %d points in common, with %s); take photographs between the two",
             l->placed_inliers, names[l->placed_partner]);
  else if (s->pairs_known)
    snprintf(why, size,
             "not registered: it has %d points in common with %s, but they fit no place; something moved, or repeats: take "
             "photographs nearby, with more that stands still in sight",
             l->placed_inliers, names[l->placed_partner]);
  else
    snprintf(why, size, "not registered; it shows too little of what the others show: take photographs between");
}

static vt_status mark_placed(vt_colmap *c, const char *model_folder, bool *placed) {
  vt_colmap_model model = {0};
  vt_status status = vt_read_colmap_model(c->context, model_folder, &model);
  for (int i = 0; i < model.count && !status; i++) {
    int at = vt_find_sorted_name((const char *const *)c->names->items, c->names->count, model.items[i].name);
    if (at >= 0) placed[at] = true;
  }
  vt_free_colmap_model(c->context, &model);
  return status;
}

static vt_status write_lines(search *s, const char *path) {
  vt_context *context = s->c->context;
  size_t size = 1;
  for (int i = 0; i < s->c->names->count; i++)
    if (!s->placed[i]) size += strlen(s->c->names->items[i]) + 1100;
  char *text = VT_NEW(context, char, size), *end = text;
  if (!text) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < s->c->names->count; i++) {
    char why[1000];
    if (s->placed[i] || vt_cancelled(context)) continue;
    explain(s, i, why, sizeof why);
    end += sprintf(end, "%s\t%s\n", s->c->names->items[i], why);
  }
  vt_status status = vt_cancelled(context) ? vt_fail(context, VT_CANCELLED, "colmap: interrupted")
                                           : vt_write_file(context, path, text, (size_t)(end - text));
  vt_free(context, text);
  return status;
}

vt_status vt_explain_unregistered(vt_colmap *c, const char *image_folder, const char *database, const char *model,
                                  const char *folder) {
  size_t count = (size_t)c->names->count;
  bool *placed = VT_NEW(c->context, bool, count);
  link *links = VT_NEW(c->context, link, count);
  char *path = vt_join(c->context, folder, "left-out.txt");
  search s = {c, image_folder, placed, links, false, 0};
  vt_status status = placed && links && path ? mark_placed(c, model, placed) : VT_OUT_OF_MEMORY;
  if (status == VT_BAD_INPUT) { // who takes the model tells what is wrong with it
    vt_clear_error(c->context);
    goto done;
  }
  for (size_t i = 0; i < count && !status; i++) links[i].partner = links[i].placed_partner = -1;
  if (!status) status = find_median_features(&s);
  if (!status) s.pairs_known = vt_read_match_table(database, hear_pair, &s);
  if (!status) status = write_lines(&s, path);
done:
  vt_free(c->context, placed);
  vt_free(c->context, links);
  vt_free(c->context, path);
  return status == VT_BAD_INPUT ? VT_OK : status;
}

char *vt_find_explanation(vt_context *context, const char *text, const char *name) {
  size_t length = strlen(name);
  for (const char *line = text; line && *line; line = strchr(line, '\n') ? strchr(line, '\n') + 1 : NULL) {
    if (strncmp(line, name, length) || line[length] != '\t') continue;
    char *why = vt_strdup(context, line + length + 1);
    if (why) why[strcspn(why, "\n")] = 0;
    return why;
  }
  return NULL;
}
