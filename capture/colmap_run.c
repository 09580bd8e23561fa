// colmap_run.c - calibration of photographs by the colmap program: a ladder of attempts, in a workspace that survives
// SPDX-License-Identifier: BSD-3-Clause
//
// Few photographs are matched each with each; many are taken for a walk around the tree and matched with their successors, at
// growing steps. Where too few get a place, the next rung tries harder, in the order of what helps vegetation for its price:
// more pairs; guided matching and an easier first pair (a small angle, few inliers), which thin plants before cloth need;
// photographs of half the size, on which leaves that move and repeat are smoothed over; features with affine shape and
// domain-size pooling (Dong, Soatto, "Domain-size pooling in local descriptors", CVPR 2015), the slowest. The model with most
// photographs of all rungs is kept.
//
// Wind and false matches leave a tail: one observation in twenty errs by three times the median, and least squares weigh it by
// the square of that. So what errs by more than 2 pixels is taken out of the model, all is adjusted again, and the
// result is kept if no photograph was lost: 60 photographs of an Arabidopsis then stand at .43 px, not .51, with 96 of 100
// observations left.
//
// Everything stands in files of the workspace, so that a run that was killed goes on: colmap itself keeps features and pairs
// that its database has, the mapper goes on from its last snapshot, a rung that is done has left a note, and the log says again
// which camera a photograph has. Each set of features has its own database and its own log.
#include "capture/colmap_run.h"
#include "base/folders.h"
#include "capture/colmap_model.h"
#include "capture/colmap_photos.h"
#include "capture/colmap_program.h"
#include "capture/masks.h"
#include "capture/unregistered.h"

#include <string.h>

#define LARGEST_ERROR 2 // pixels, of an observation in the model that is kept

enum { ALL_PAIRS = 150, MANY_PAIRS = 400, MOST_RUNGS = 5, USUAL_SIZE = 3200 };

typedef struct rung {
  const char *name, *features; // features: name of their set
  vt_colmap_effort effort;
  double below;           // it is tried where less than this share of the photographs has a place
  int registered;         // what it reached; -1: not tried
  double error, seconds;  // pixels; NAN unknown
  double polished_error;  // of the model without its outliers, pixels; NAN: there is none
} rung;

typedef struct ladder {
  vt_colmap c;
  const char *workspace;
  int *group, group_count;
  rung rungs[MOST_RUNGS];
  int rung_count, best; // best: -1 none
} ladder;

static char *in_workspace(const ladder *l, const char *name, int number, const char *ending) {
  char text[96];
  if (number < 0)
    snprintf(text, sizeof text, "%s%s", name, ending);
  else
    snprintf(text, sizeof text, "%s-%d%s", name, number, ending);
  return vt_join(l->c.context, l->workspace, text);
}

// ---- the rungs

static void add_rung(ladder *l, const char *name, const char *features, double below, vt_colmap_effort effort) {
  l->rungs[l->rung_count++] = (rung){name, features, effort, below, -1, NAN, 0, NAN};
}

// `longer`: the longest side of a photograph, pixels.
static void plan_rungs(ladder *l, int longer) {
  int count = l->c.names->count, size = longer < USUAL_SIZE ? longer : USUAL_SIZE;
  vt_colmap_effort e = {.max_image_size = USUAL_SIZE, .all_pairs = count <= ALL_PAIRS};
  add_rung(l, "the usual way", "features", 2, e);
  if (!e.all_pairs) {
    e.all_pairs = count <= MANY_PAIRS;
    e.transitive = !e.all_pairs;
    add_rung(l, "more pairs", "features", 0.9, e);
  }
  e.guided = e.easier = true;
  add_rung(l, "guided matching and an easier first pair", "features", 0.9, e);
  e.max_image_size = size / 2;
  if (size >= 1200) add_rung(l, "photographs of half the size", "small", 0.75, e);
  e.max_image_size = size > 1600 ? 1600 : size;
  e.affine = true;
  add_rung(l, "features of affine shape", "affine", 0.75, e);
}

// ---- models

// Photographs in a model: the first number of images.bin. 0 if there is none.
static int count_registered(const char *model_folder, vt_context *context) {
  char *path = vt_join(context, model_folder, "images.bin");
  FILE *file = path ? fopen(path, "rb") : NULL;
  uint8_t bytes[8];
  uint64_t count = 0;
  if (file && fread(bytes, 1, 8, file) == 8)
    for (int i = 7; i >= 0; i--) count = count << 8 | bytes[i];
  if (file) fclose(file);
  vt_free(context, path);
  return count < 1000000 ? (int)count : 0;
}

// The model with most photographs of models itself, models/0, models/1, ...; *best stays NULL if there is none.
static vt_status choose_model(vt_context *context, const char *models, char **best, int *best_count) {
  *best = NULL;
  *best_count = 0;
  for (int i = -1;; i++) {
    char name[16] = "";
    if (i >= 0) snprintf(name, sizeof name, "%d", i);
    char *folder = i < 0 ? vt_strdup(context, models) : vt_join(context, models, name);
    if (!folder) return VT_OUT_OF_MEMORY;
    if (!vt_is_folder(folder)) {
      vt_free(context, folder);
      return VT_OK;
    }
    int count = count_registered(folder, context);
    if (count > *best_count) {
      char *swap = *best;
      *best = folder;
      *best_count = count;
      folder = swap;
    }
    vt_free(context, folder);
  }
}

// The newest snapshot that is whole, or NULL.
static char *find_snapshot(vt_context *context, const char *snapshots) {
  vt_names names = {0};
  char *found = NULL;
  if (!vt_is_folder(snapshots) || vt_list_folder(context, snapshots, false, &names)) {
    vt_clear_error(context);
    return NULL;
  }
  for (int i = names.count - 1; i >= 0 && !found; i--) {
    vt_colmap_model model = {0};
    found = vt_join(context, snapshots, names.items[i]);
    bool whole = found && vt_is_colmap_model(context, found) && !vt_read_colmap_model(context, found, &model);
    if (!whole || !(model.reprojection_error >= 0)) { // one that was cut short has no points, or cannot be read
      vt_free(context, found);
      found = NULL;
      vt_clear_error(context);
    }
    vt_free_colmap_model(context, &model);
  }
  vt_free_names(context, &names);
  return found;
}

// ---- one rung

// Opens the log of a set of features, after hearing again what it says of an earlier run.
static vt_status open_log(ladder *l, const char *features) {
  vt_colmap *c = &l->c;
  char *path = in_workspace(l, features, -1, ".log"), line[2048];
  if (!path) return VT_OUT_OF_MEMORY;
  if (c->log) fclose(c->log);
  for (int i = 0; i < c->names->count; i++) c->photos[i] = (vt_colmap_photo){l->group[i], 0, -1};
  c->heard = -1;
  int wanted = c->features_wanted;
  c->features_wanted = 0; // no progress
  FILE *before = fopen(path, "r");
  while (before && fgets(line, sizeof line, before)) {
    line[strcspn(line, "\n")] = 0;
    if (!strstr(line, "Registering image #")) vt_hear_colmap(c, line);
  }
  if (before) fclose(before);
  c->features_wanted = wanted;
  c->log = fopen(path, "a"); // without a log it works as well
  if (c->log) setvbuf(c->log, NULL, _IOLBF, 0); // a run that is killed has said all it knew
  vt_free(c->context, path);
  return VT_OK;
}

static vt_status find_features(ladder *l, const rung *r, const char *database) {
  vt_status status = VT_OK;
  l->c.features_before = 0;
  l->c.features_wanted = l->c.names->count;
  for (int g = 0; g < l->group_count && !status; g++) {
    char *list = in_workspace(l, "photographs", g, ".txt");
    status = list ? vt_write_photo_list(l->c.context, l->c.names, l->group, g, list) : VT_OUT_OF_MEMORY;
    if (!status) status = vt_extract_features(&l->c, &r->effort, database, list, g);
    vt_free(l->c.context, list);
  }
  return status;
}

// Matches that an easier rung left are forgotten once: a matcher would keep them.
static vt_status forget_once(ladder *l, const rung *r, const char *database) {
  char *note = in_workspace(l, r->features, -1, ".forgotten");
  vt_status status = note ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status && !vt_is_file(note)) {
    status = vt_forget_matches(&l->c, database);
    if (!status) status = vt_write_file(l->c.context, note, "", 0);
  }
  vt_free(l->c.context, note);
  return status;
}

static vt_status map_fresh(ladder *l, const rung *r, const char *database, const char *models, const char *snapshots) {
  vt_remove_folder(l->c.context, models);
  vt_remove_folder(l->c.context, snapshots);
  vt_status status = vt_make_folder(l->c.context, models);
  if (!status) status = vt_make_folder(l->c.context, snapshots);
  return status ? status : vt_map_photographs(&l->c, &r->effort, database, models, NULL, snapshots);
}

static vt_status find_cameras(ladder *l, const rung *r, const char *database, const char *models, int number) {
  vt_context *context = l->c.context;
  char *snapshots = in_workspace(l, "snapshots", number, ""), *last = snapshots ? find_snapshot(context, snapshots) : NULL;
  vt_status status = snapshots ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status && last) {
    vt_log(context, VT_LOG_NORMAL, "colmap: the mapping goes on from %d photographs", count_registered(last, context));
    vt_remove_folder(context, models);
    status = vt_make_folder(context, models);
    if (!status) status = vt_map_photographs(&l->c, &r->effort, database, models, last, snapshots);
    if (status == VT_FAILED && !vt_cancelled(context)) { // a snapshot that it cannot take
      vt_clear_error(context);
      status = map_fresh(l, r, database, models, snapshots);
    }
  } else if (!status) {
    status = map_fresh(l, r, database, models, snapshots);
  }
  vt_free(context, snapshots);
  vt_free(context, last);
  return status;
}

// The error of a model; NAN where it cannot be read or has no points.
static double error_of(vt_context *context, const char *folder, int *count) {
  vt_colmap_model model = {0};
  double error = NAN;
  *count = 0;
  if (!vt_read_colmap_model(context, folder, &model)) error = model.reprojection_error, *count = model.count;
  vt_clear_error(context);
  vt_free_colmap_model(context, &model);
  return error;
}

static vt_status measure_rung(ladder *l, rung *r, const char *models) {
  vt_context *context = l->c.context;
  char *folder = NULL;
  int count;
  vt_status status = choose_model(context, models, &folder, &r->registered);
  if (!status && folder) r->error = error_of(context, folder, &count); // a damaged model is told when it is taken
  vt_free(context, folder);
  return status;
}

// Replaces *model by one without its outliers, where that is better. What goes wrong costs the improvement, not the run.
static vt_status polish(ladder *l, char **model) {
  vt_context *context = l->c.context;
  char *steps[3] = {0};
  rung *r = &l->rungs[l->best];
  int before = 0, after = 0;
  double error = error_of(context, *model, &before), better = NAN;
  if (!(error >= 0) || vt_cancelled(context)) return VT_OK;
  vt_status status = VT_OK;
  for (int i = 0; i < 3 && !status; i++) {
    steps[i] = in_workspace(l, "adjusted", i, "");
    status = steps[i] ? VT_OK : VT_OUT_OF_MEMORY;
    if (!status) vt_remove_folder(context, steps[i]);
    if (!status) status = vt_make_folder(context, steps[i]);
  }
  if (!status) status = vt_filter_model(&l->c, *model, steps[0], LARGEST_ERROR);
  if (!status) status = vt_adjust_model(&l->c, steps[0], steps[1]);
  if (!status) status = vt_filter_model(&l->c, steps[1], steps[2], LARGEST_ERROR); // which also measures the errors anew
  if (!status) better = error_of(context, steps[2], &after);
  if (!status && after == before && better < error) {
    char *swap = *model;
    *model = steps[2];
    steps[2] = swap;
    r->polished_error = better;
  } else if (status == VT_FAILED && !vt_cancelled(context)) {
    vt_log(context, VT_LOG_VERBOSE, "%s; the model stays as it is", vt_last_error(context));
    vt_clear_error(context);
    status = VT_OK;
  }
  for (int i = 0; i < 3; i++) vt_free(context, steps[i]);
  return status;
}

static vt_status climb(ladder *l, int number) {
  vt_context *context = l->c.context;
  rung *r = &l->rungs[number];
  double start = vt_seconds();
  char *database = in_workspace(l, r->features, -1, ".db"), *models = in_workspace(l, "models", number, "");
  char *note = in_workspace(l, "rung", number, ".txt"), line[64];
  bool first_of_set = number == 0 || strcmp(l->rungs[number - 1].features, r->features) != 0;
  vt_status status = database && models && note ? VT_OK : VT_OUT_OF_MEMORY;
  FILE *done = status ? NULL : fopen(note, "r");
  bool known = done && fscanf(done, "%d %lf %lf", &r->registered, &r->error, &r->seconds) == 3;
  if (done) fclose(done);
  if (status || known) goto done;
  status = open_log(l, r->features);
  if (!status) status = find_features(l, r, database);
  if (!status && r->effort.guided && !first_of_set) status = forget_once(l, r, database);
  if (!status) status = vt_match_features(&l->c, &r->effort, database);
  if (!status) status = find_cameras(l, r, database, models, number);
  if (!status) status = measure_rung(l, r, models);
  if (status) goto done;
  r->seconds = vt_seconds() - start;
  snprintf(line, sizeof line, "%d %.6f %.1f\n", r->registered, r->error, r->seconds);
  status = vt_write_file(context, note, line, strlen(line));
done:
  vt_free(context, database);
  vt_free(context, models);
  vt_free(context, note);
  return status;
}

// ---- all

static vt_status climb_all(ladder *l) {
  int count = l->c.names->count, reached = 0;
  l->best = -1;
  for (int i = 0; i < l->rung_count; i++) {
    rung *r = &l->rungs[i];
    if (!(reached < r->below * count)) continue;
    vt_status status = climb(l, i);
    if (status) return status;
    if (r->registered > reached) {
      reached = r->registered;
      l->best = i;
    }
    char error[32] = "";
    if (r->error >= 0) snprintf(error, sizeof error, " at %.2f px", r->error);
    bool harder = i + 1 < l->rung_count && reached < l->rungs[i + 1].below * count;
    vt_log(l->c.context, i || harder ? VT_LOG_NORMAL : VT_LOG_VERBOSE, "colmap: %s: %d of %d photographs registered%s, %.0f s%s",
           r->name, r->registered, count, error, r->seconds, harder ? "; too few, it tries harder" : "");
  }
  return VT_OK;
}

// What the rungs reached, for the report: a line each.
static vt_status write_notes(ladder *l, const char *sparse) {
  vt_context *context = l->c.context;
  char text[MOST_RUNGS * 240 + 64], *end = text, *path = vt_join(context, sparse, "rungs.txt");
  if (!path) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < l->rung_count; i++) {
    const rung *r = &l->rungs[i];
    if (r->registered < 0) continue;
    end += sprintf(end, "%s: %d of %d photographs, ", r->name, r->registered, l->c.names->count);
    if (r->error >= 0) end += sprintf(end, "%.2f px, ", r->error);
    end += sprintf(end, "%.0f s", r->seconds);
    if (r->polished_error >= 0) end += sprintf(end, "; %.2f px without what erred by more than %d px", r->polished_error, LARGEST_ERROR);
    *end++ = '\n';
    *end = 0;
  }
  vt_status status = vt_write_file(context, path, text, (size_t)(end - text));
  vt_free(context, path);
  return status;
}

// The best model becomes sparse/0, with what is known of the photographs that are not in it beside it.
static vt_status keep_model(ladder *l, const char *image_folder) {
  vt_context *context = l->c.context;
  const rung *r = &l->rungs[l->best];
  char *sparse = in_workspace(l, "sparse", -1, ""), *target = sparse ? vt_join(context, sparse, "0") : NULL;
  char *models = in_workspace(l, "models", l->best, ""), *database = in_workspace(l, r->features, -1, ".db"), *model = NULL;
  int count = 0;
  vt_status status = target && models && database ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) status = choose_model(context, models, &model, &count);
  if (!status && model) status = polish(l, &model);
  if (!status && model) vt_remove_folder(context, sparse);
  if (!status && model) status = vt_make_folder(context, sparse);
  if (!status && !model && !vt_is_folder(target)) // moved there by a run that was killed then
    status = vt_fail(context, VT_FAILED, "%s: the model is gone that an earlier run made; run it again", models);
  if (!status && model && rename(model, target))
    status = vt_fail(context, VT_FAILED, "%s: could not be renamed to %s; is the folder writable?", model, target);
  if (!status) status = write_notes(l, sparse);
  if (!status && r->registered < l->c.names->count) {
    status = open_log(l, r->features); // of the set that the model is made of
    if (!status) status = vt_explain_unregistered(&l->c, image_folder, database, target, sparse);
  }
  vt_free(context, model);
  vt_free(context, models);
  vt_free(context, database);
  vt_free(context, sparse);
  vt_free(context, target);
  return status;
}

// What --ignore marks has no features. Photographs that have none marked need no mask.
static vt_status write_masks(ladder *l, const vt_capture_desc *desc, const char *folder) {
  int written = 0;
  if (!desc->ignore) return VT_OK;
  l->c.masks = in_workspace(l, "masks", -1, "");
  if (!l->c.masks) return VT_OUT_OF_MEMORY;
  return vt_write_colmap_masks(l->c.context, desc->ignore, folder, l->c.names, l->c.masks, &written);
}

static vt_status prepare(ladder *l, const vt_capture_desc *desc, const char *folder) {
  vt_colmap *c = &l->c;
  size_t count = (size_t)c->names->count;
  int longer = 0;
  c->photos = VT_NEW(c->context, vt_colmap_photo, count);
  l->group = VT_NEW(c->context, int, count);
  vt_image_info *infos = VT_NEW(c->context, vt_image_info, count);
  vt_status status = c->photos && l->group && infos ? vt_probe_colmap(c) : VT_OUT_OF_MEMORY;
  if (!status) status = vt_read_headers(c->context, folder, c->names, true, infos);
  if (!status) l->group_count = vt_group_photographs(infos, c->names->count, l->group);
  for (size_t i = 0; i < count && !status; i++) {
    if (infos[i].width > longer) longer = infos[i].width;
    if (infos[i].height > longer) longer = infos[i].height;
  }
  vt_free(c->context, infos);
  if (!status) status = vt_make_readable(c->context, folder, c->names, l->workspace, &c->images);
  if (!status) status = write_masks(l, desc, folder);
  if (!status)
    vt_log(c->context, VT_LOG_VERBOSE, "colmap %s: %d photographs of %d camera%s, on the CPU",
           c->version[0] ? c->version : "of unknown version", c->names->count, l->group_count, l->group_count == 1 ? "" : "s");
  plan_rungs(l, longer);
  return status;
}

vt_status vt_run_colmap(vt_context *context, const vt_capture_desc *desc, const char *image_folder,
                        const vt_names *names, const char *workspace) {
  VT_ASSERT(desc->cookie == VT_COOKIE);
  if (names->count < 3)
    return vt_fail(context, VT_TOO_FEW_VIEWS,
                   "%s: %d photographs; give at least 3, better 40 or more all around the tree", image_folder,
                   names->count);
  ladder l = {.workspace = workspace, .best = -1};
  l.c = (vt_colmap){.context = context, .program = desc->colmap ? desc->colmap : "colmap", .names = names, .heard = -1};
  snprintf(l.c.seed, sizeof l.c.seed, "%u", desc->seed & 0x7fffffffu);
  snprintf(l.c.threads, sizeof l.c.threads, "%d", vt_thread_count(context));
  vt_status status = prepare(&l, desc, image_folder);
  if (status == VT_OK) status = climb_all(&l);
  int best_count = l.best < 0 ? 0 : l.rungs[l.best].registered;
  if (status == VT_OK && best_count < 3)
    status =
        vt_fail(context, VT_TOO_FEW_VIEWS,
                "%s: only %d of %d photographs could be related to each other; take more of them, with more overlap "
                "(a step of at most 10 degrees), sharp, and with something textured that stands still beside the tree",
                image_folder, best_count, names->count);
  if (status == VT_OK) status = keep_model(&l, image_folder);
  if (l.c.log) fclose(l.c.log);
  vt_free(context, l.c.images);
  vt_free(context, l.c.masks);
  vt_free(context, l.c.photos);
  vt_free(context, l.group);
  return status;
}
