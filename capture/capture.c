// capture.c - from what a user has to calibrated, matted views
// SPDX-License-Identifier: BSD-3-Clause
//
// A source is recognised by what lies in it, the most finished first: transforms*.json, then a COLMAP model with its
// pictures, then photographs alone. Each way ends in the same list of calibrated photographs (photos.h), which
// develop.c turns into views. What is there is used; what is missing is made.

#include "capture/capture.h"
#include "base/file.h"
#include "base/image_file.h"
#include "capture/bundler.h"
#include "capture/calibrate.h"
#include "capture/check.h"
#include "capture/colmap_model.h"
#include "capture/develop.h"
#include "capture/keep_lens.h"
#include "capture/keep_views.h"
#include "capture/masks.h"
#include "capture/photo_tracks.h"
#include "capture/transforms.h"
#include "capture/unregistered.h"
#include "capture/world.h"
#include "capture/write_cameras.h"

#include <string.h>

vt_capture_desc vt_default_capture_desc(void) {
  return (vt_capture_desc){.cookie = VT_COOKIE, .matte = VT_MATTE_AUTO, .marker_cells = 4, .colmap = "colmap"};
}

void vt_free_capture_report(vt_context *context, vt_capture_report *report) {
  vt_free_sentences(context, &report->left_out_count, &report->left_out);
  vt_free_sentences(context, &report->attempt_count, &report->attempts);
  vt_free_sentences(context, &report->warning_count, &report->warnings);
  *report = (vt_capture_report){.reprojection_error = NAN};
}

// folder/name if that is a file, NULL if not (or without memory, which shows soon enough).
static char *file_in(vt_context *context, const char *folder, const char *name) {
  char *path = vt_join(context, folder, name);
  if (path && vt_is_file(path)) return path;
  vt_free(context, path);
  return NULL;
}

static char *folder_in(vt_context *context, const char *folder, const char *name) {
  char *path = vt_join(context, folder, name);
  if (path && vt_is_folder(path)) return path;
  vt_free(context, path);
  return NULL;
}

// ---- transforms*.json

typedef struct split {
  char *all, *train, *test;
} split; // files that are there, else NULL

static void free_split(vt_context *context, split *s) {
  vt_free(context, s->all);
  vt_free(context, s->train);
  vt_free(context, s->test);
  *s = (split){0};
}

static split find_split(vt_context *context, const char *folder) {
  return (split){file_in(context, folder, "transforms.json"), file_in(context, folder, "transforms_train.json"),
                 file_in(context, folder, "transforms_test.json")};
}

// A folder with both kinds is read by its split, which says more.
static vt_status load_transforms(vt_context *context, const split *s, vt_photos *photos) {
  vt_status status = VT_OK;
  if (s->all && !(s->train && s->test)) return vt_read_transforms(context, s->all, VT_TRAIN, photos);
  if (s->train) status = vt_read_transforms(context, s->train, VT_TRAIN, photos);
  if (!status && s->test) status = vt_read_transforms(context, s->test, VT_TEST, photos);
  return status;
}

// The file that the user names; transforms_train.json brings its test views along.
static vt_status load_transforms_file(vt_context *context, const char *path, const char *folder, vt_photos *photos) {
  split s = {0};
  const char *name = vt_base_name(path);
  if (!strcmp(name, "transforms_train.json")) s = find_split(context, folder);
  vt_free(context, s.all);
  s.all = NULL;
  vt_status status =
      s.train ? load_transforms(context, &s, photos)
              : vt_read_transforms(context, path, strcmp(name, "transforms_test.json") ? VT_TRAIN : VT_TEST, photos);
  free_split(context, &s);
  return status;
}

// ---- COLMAP

// The model in base/0, base/1, ... with most images, else the one in base itself. *found is false if there is none.
static vt_status find_model(vt_context *context, const char *base, vt_colmap_model *best, bool *found) {
  vt_status status = VT_OK;
  *found = false;
  for (int n = 0; n < 1000 && !status; n++) {
    char number[16];
    snprintf(number, sizeof number, "%d", n);
    char *folder = folder_in(context, base, number);
    if (!folder) break;
    vt_colmap_model model = {0};
    status = vt_read_colmap_model(context, folder, &model);
    if (!status && (!*found || model.count > best->count)) {
      vt_free_colmap_model(context, best);
      *best = model;
      *found = true;
    } else {
      vt_free_colmap_model(context, &model);
    }
    vt_free(context, folder);
  }
  if (status || *found || !vt_is_colmap_model(context, base)) return status;
  *found = true;
  return vt_read_colmap_model(context, base, best);
}

// The folder of photographs in a source: images/ if there are any in it, else the source itself.
static vt_status find_photos(vt_context *context, const vt_capture_desc *desc, char **folder, vt_names *names) {
  *folder = folder_in(context, desc->source, "images");
  if (*folder) {
    vt_status status = vt_list_photos(context, *folder, desc->masks, names);
    if (!status && desc->ignore) vt_drop_inside(context, *folder, desc->ignore, names);
    if (status || names->count) return status;
    vt_free_names(context, names);
    vt_free(context, *folder);
  }
  *folder = vt_strdup(context, desc->source);
  vt_status status = *folder ? vt_list_photos(context, *folder, desc->masks, names) : VT_OUT_OF_MEMORY;
  if (!status && desc->ignore) vt_drop_inside(context, *folder, desc->ignore, names);
  return status;
}

static bool has_image(const vt_colmap_model *model, const char *name) {
  int low = 0, high = model->count;
  while (low < high) {
    int middle = low + (high - low) / 2, order = strcmp(name, model->items[middle].name);
    if (!order) return true;
    if (order < 0)
      high = middle;
    else
      low = middle + 1;
  }
  return false;
}

// Every image of the model becomes a photograph; pictures that the model does not have are named in the report, with the reason
// in `explanations` (or NULL).
static vt_status take_model(vt_context *context, vt_colmap_model *model, const char *folder, const vt_names *names,
                            const char *explanations, vt_photos *photos, vt_capture_report *report) {
  vt_status status = VT_OK;
  for (int i = 0; i < model->count && !status; i++) {
    const vt_colmap_image *image = &model->items[i];
    char *path = vt_join(context, folder, image->name);
    vt_photo *photo = path ? vt_add_photo(context, photos, image->name, path) : NULL;
    vt_free(context, path);
    if (!photo) return VT_OUT_OF_MEMORY;
    photo->lens = image->lens;
    photo->rotation = image->rotation;
    photo->translation = image->translation;
    status = vt_fit_photo(context, photo, image->name);
  }
  for (size_t k = 0; k < model->landmarks.seen_count && !status && model->landmarks.pixels; k++) { // as the lens: of the file's size
    int i = model->landmarks.seen_by[k];
    model->landmarks.pixels[k][0] *= (float)photos->items[i].lens.width / (float)model->items[i].lens.width;
    model->landmarks.pixels[k][1] *= (float)photos->items[i].lens.height / (float)model->items[i].lens.height;
  }
  report->photograph_count = model->count;
  for (int i = 0; i < names->count && !status; i++) {
    if (has_image(model, names->items[i])) continue;
    report->photograph_count++;
    char *why = vt_find_explanation(context, explanations, names->items[i]);
    status = vt_leave_out(context, report, names->items[i],
                          why ? why : "not registered; it shows too little of what the others show, or is blurred");
    vt_free(context, why);
  }
  report->reprojection_error = model->reprojection_error;
  photos->landmarks = model->landmarks; // the photographs stand in the model's order
  model->landmarks = (vt_landmarks){0};
  return status;
}

// ---- the flow

// What a source is made of, before any picture is read.
typedef struct source {
  bool look_only;          // no search for cameras: only what is there or kept is taken
  bool known, begun;       // cameras; begun: an interrupted search for them is in the cache
  vt_photos photos;        // where cameras are known
  char *root, *folder;     // the capture's folder; the photographs', where they were looked for
  vt_names names;          // in `folder`
} source;

static void free_source(vt_context *context, source *s) {
  vt_free_photos(context, &s->photos);
  vt_free_names(context, &s->names);
  vt_free(context, s->root);
  vt_free(context, s->folder);
}

// Each line of a text becomes a sentence of a list.
static vt_status take_lines(vt_context *context, const char *text, int *count, char ***sentences) {
  vt_status status = VT_OK;
  while (text && *text && !status) {
    int length = (int)strcspn(text, "\n");
    status = vt_note_sentence(context, count, sentences, "%.*s", length, text);
    text += length + (text[length] == '\n');
  }
  return status;
}

static vt_status calibrate_photos(vt_context *context, const vt_capture_desc *desc, source *s, vt_calibration *out,
                                  vt_capture_report *report) {
  const vt_names *names = &s->names;
  if (!names->count)
    return vt_fail(context, VT_BAD_INPUT,
                   "%s: no photographs in it (jpg, png, tif, ...); give the folder where they are", desc->source);
  if (s->look_only) return vt_find_calibration(context, desc, s->folder, names, out, &s->known, &s->begun);
  if (names->count < 3)
    return vt_fail(context, VT_TOO_FEW_VIEWS,
                   "%s: %d photograph%s, and at least 3 are needed to find the cameras; photograph the tree from all "
                   "around, 30 to 60 times, each photograph showing most of what its neighbours show",
                   desc->source, names->count, names->count == 1 ? "" : "s");
  double start = vt_seconds();
  vt_status status = vt_calibrate(context, desc, s->folder, names, out);
  report->seconds_calibration = vt_seconds() - start;
  report->calibration_from_cache = out->from_cache;
  if (!status) status = take_lines(context, out->attempts, &report->attempt_count, &report->attempts);
  if (!status) status = take_lines(context, out->warnings, &report->warning_count, &report->warnings);
  s->known = true;
  if (!status && out->model.count < 3)
    status =
        vt_fail(context, VT_TOO_FEW_VIEWS,
                "%s: the cameras of only %d of %d photographs could be found, and at least 3 are needed; take more "
                "photographs with smaller steps between them",
                desc->source, out->model.count, names->count);
  return status;
}

static vt_status load_folder(vt_context *context, const vt_capture_desc *desc, source *out, vt_capture_report *report) {
  static const char *const bases[] = {"sparse", "colmap/sparse"};
  vt_calibration calibration = {0};
  bool found = false;
  split s = find_split(context, desc->source);
  vt_status status = VT_OK;
  if (s.all || s.train || s.test) {
    report->kind = VT_SOURCE_TRANSFORMS;
    status = load_transforms(context, &s, &out->photos);
    report->photograph_count = out->photos.count;
    out->known = true;
    goto done;
  }
  status = find_photos(context, desc, &out->folder, &out->names);
  for (int i = 0; i < 2 && !status && !found; i++) {
    char *base = folder_in(context, desc->source, bases[i]);
    if (!base) continue;
    status = find_model(context, base, &calibration.model, &found);
    vt_free(context, base);
  }
  report->kind = found ? VT_SOURCE_COLMAP : VT_SOURCE_PHOTOS;
  report->photograph_count = out->names.count;
  out->known = found;
  if (!status && !found) {
    char *bundle = file_in(context, desc->source, "bundle.out");
    if (bundle || vt_has_projections(context, out->folder, &out->names)) {
      report->kind = bundle ? VT_SOURCE_BUNDLER : VT_SOURCE_PROJECTIONS;
      out->known = true;
      report->photograph_count = 0; // counted by the readers
      status = bundle ? vt_read_bundler(context, bundle, &out->photos, report)
                      : vt_read_projections(context, out->folder, &out->names, &out->photos, report);
      vt_free(context, bundle);
      goto done;
    }
    status = calibrate_photos(context, desc, out, &calibration, report);
  }
  if (!status && out->known)
    status = take_model(context, &calibration.model, out->folder, &out->names, calibration.left_out, &out->photos, report);
done:
  free_split(context, &s);
  vt_free_calibration(context, &calibration);
  return status;
}

static bool ends_with(const char *path, const char *ending) {
  size_t length = strlen(path), n = strlen(ending);
  return length > n && !strcmp(path + length - n, ending);
}

static vt_status load_source(vt_context *context, const vt_capture_desc *desc, source *out, vt_capture_report *report) {
  out->root = vt_strdup(context, desc->source);
  if (!out->root) return VT_OUT_OF_MEMORY;
  if (vt_is_folder(desc->source)) return load_folder(context, desc, out, report);
  if (!vt_is_file(desc->source))
    return vt_fail(context, VT_BAD_INPUT,
                   "%s: no such folder; give a folder of photographs, a COLMAP workspace, or a "
                   "folder with transforms.json",
                   desc->source);
  if (ends_with(desc->source, ".out")) {
    report->kind = VT_SOURCE_BUNDLER;
    out->known = true;
    return vt_read_bundler(context, desc->source, &out->photos, report);
  }
  if (!ends_with(desc->source, ".json"))
    return vt_fail(context, VT_BAD_INPUT, "%s: a file; give the folder of photographs, or a transforms.json",
                   desc->source);
  size_t folder_length = (size_t)(vt_base_name(desc->source) - desc->source);
  vt_free(context, out->root);
  out->root = vt_strdup(context, folder_length ? desc->source : ".");
  if (!out->root) return VT_OUT_OF_MEMORY;
  if (folder_length) out->root[folder_length > 1 ? folder_length - 1 : 1] = 0;
  report->kind = VT_SOURCE_TRANSFORMS;
  vt_status status = load_transforms_file(context, desc->source, out->root, &out->photos);
  report->photograph_count = out->photos.count;
  out->known = true;
  return status;
}

static vt_status check_cameras(vt_context *context, const vt_photos *photos) {
  vt_status status = VT_OK;
  for (int i = 0; i < photos->count && !status; i++) {
    vt_camera camera = vt_photo_camera(&photos->items[i]);
    status = vt_check_camera(context, &camera, photos->items[i].path);
  }
  return status;
}

// The coverage of the photographs' cameras, and a sentence where it leaves something unknown.
static vt_status look_around(vt_context *context, const vt_photos *photos, vt_coverage *out, int *warning_count,
                             char ***warnings) {
  vt_camera *cameras = VT_NEW(context, vt_camera, (size_t)photos->count);
  if (!cameras) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < photos->count; i++) cameras[i] = vt_photo_camera(&photos->items[i]);
  vt_capture_coverage(cameras, photos->count, out);
  vt_free(context, cameras);
  if (!out->count) return VT_OK;
  return vt_warn_of_coverage(context, out, photos->items[out->gap_begin].name, photos->items[out->gap_end].name, warning_count,
                             warnings);
}

vt_status vt_convert_cameras(vt_context *context, const vt_capture_desc *desc, vt_camera_format format, const char *folder,
                             int *count) {
  VT_ASSERT(desc && desc->cookie == VT_COOKIE && desc->source);
  vt_capture_report report = {.reprojection_error = NAN};
  source s = {0};
  vt_status status = load_source(context, desc, &s, &report);
  if (!status) status = vt_find_world(context, desc, report.kind == VT_SOURCE_TRANSFORMS, &s.photos);
  if (!status) status = vt_export_photos(context, &s.photos, true, format, folder);
  *count = s.photos.count;
  free_source(context, &s);
  vt_free_capture_report(context, &report);
  return status;
}

static vt_status adjust_lenses(vt_context *context, const vt_capture_desc *desc, bool keep, vt_photos *photos, vt_capture_report *report) {
  vt_lens_report lens;
  if (desc->keep_lens) return VT_OK;
  double start = vt_seconds();
  vt_status status = vt_adjust_lenses_or_take(context, desc->cache, keep, photos, &lens);
  report->lens_adjusted = !status && lens.kept;
  report->lens_before = lens.before, report->lens_after = lens.after;
  report->lens_corner = lens.corner_pixels, report->lens_focal = lens.focal_share;
  if (!status && lens.kept)
    vt_log(context, VT_LOG_NORMAL, "lens: adjusted to %zu sights of points; corners move by %.2f pixels, the focal length by %+.3f %%; points held back "
           "are off by %.4f deviations instead of %.4f", lens.sight_count, lens.corner_pixels, 100 * lens.focal_share, lens.after, lens.before);
  vt_log(context, VT_LOG_VERBOSE, "lens: %s (%.1f s)", lens.why, vt_seconds() - start);
  return status;
}

// The tracks through the pictures as they were developed.
static vt_status take_tracks(vt_context *context, const vt_photos *photos, vt_views *views) {
  vt_camera *cameras = VT_NEW(context, vt_camera, (size_t)views->count + 1);
  if (!cameras) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < views->count; i++) cameras[i] = views->items[i].camera;
  vt_status status = vt_photo_tracks(context, photos, cameras, &views->tracks);
  vt_free(context, cameras);
  if (status) vt_free_views(context, views);
  return status;
}

vt_status vt_load_views(vt_context *context, const vt_capture_desc *desc, vt_views *out, vt_capture_report *or_null) {
  VT_ASSERT(desc && desc->cookie == VT_COOKIE && desc->source && desc->max_image_size >= 0);
  static const char *const kinds[] = {"transforms.json", "the COLMAP model", "colmap", "Bundler", "matrices"};
  vt_capture_report own = {0}, *report = or_null ? or_null : &own;
  source s = {0};
  *report = (vt_capture_report){.reprojection_error = NAN};
  *out = (vt_views){0};
  vt_status status = load_source(context, desc, &s, report);
  if (!status) status = check_cameras(context, &s.photos);
  if (!status) {
    vt_log(context, VT_LOG_NORMAL, "capture: %d photographs with cameras from %s%s", s.photos.count, kinds[report->kind],
           report->calibration_from_cache ? " (kept from before)" : "");
    status = vt_find_ignored(context, desc->ignore, &s.photos);
  }
  if (!status) status = adjust_lenses(context, desc, true, &s.photos, report);
  if (!status) status = vt_find_world(context, desc, report->kind == VT_SOURCE_TRANSFORMS, &s.photos);
  vt_world world = s.photos.world;
  if (!status) status = vt_choose_mattes(context, desc, s.root, &s.photos, report);
  world.estimated = world.estimated || report->kind != VT_SOURCE_TRANSFORMS || report->matte != VT_MATTE_ALPHA;
  if (!status) status = look_around(context, &s.photos, &report->coverage, &report->warning_count, &report->warnings);
  double start = vt_seconds();
  if (!status) status = vt_develop_or_take(context, desc, &s.photos, report, out);
  report->seconds_developing = vt_seconds() - start;
  if (!status) out->world = world;
  if (!status) status = take_tracks(context, &s.photos, out);
  for (int i = 0; i < report->left_out_count && !status; i++)
    vt_log(context, VT_LOG_NORMAL, "left out: %s", report->left_out[i]);
  free_source(context, &s);
  if (!or_null || status) vt_free_capture_report(context, report);
  return status;
}

// ---- before the work

static double megapixels_of(const vt_photos *photos) {
  double sum = 0;
  for (int i = 0; i < photos->count; i++) sum += 1e-6 * photos->items[i].width * photos->items[i].height;
  return sum;
}

// Bytes of a view, after reduction.
static uint64_t view_bytes(const vt_capture_desc *desc, int width, int height) {
  int longer = width > height ? width : height, bound = desc->max_image_size;
  uint64_t factor = bound > 0 && longer > bound ? (uint64_t)((longer + bound - 1) / bound) : 1;
  return 4 * ((uint64_t)width / factor) * ((uint64_t)height / factor);
}

// Pixels of photographs without cameras, by their headers.
static vt_status measure_headers(vt_context *context, const vt_capture_desc *desc, const source *s, double *megapixels,
                                 uint64_t *bytes) {
  vt_status status = VT_OK;
  *megapixels = 0;
  *bytes = 0;
  for (int i = 0; i < s->names.count && !status; i++) {
    vt_image_info info;
    char *path = vt_join(context, s->folder, s->names.items[i]);
    status = path ? vt_read_image_info(context, path, &info) : VT_OUT_OF_MEMORY;
    vt_free(context, path);
    if (status) break;
    *megapixels += 1e-6 * info.width * info.height;
    *bytes += view_bytes(desc, info.width, info.height);
  }
  return status;
}

vt_status vt_plan_capture(vt_context *context, const vt_capture_desc *desc, vt_capture_plan *out) {
  VT_ASSERT(desc && desc->cookie == VT_COOKIE && desc->source);
  vt_capture_report report = {0};
  source s = {.look_only = true};
  int threads = vt_thread_count(context);
  double megapixels = 0;
  *out = (vt_capture_plan){0};
  vt_status status = load_source(context, desc, &s, &report);
  out->kind = report.kind;
  out->photograph_count = report.photograph_count;
  if (!status && s.known) {
    status = vt_find_ignored(context, desc->ignore, &s.photos);
    if (!status) status = adjust_lenses(context, desc, false, &s.photos, &report); // what is kept of views depends on them
    if (!status) status = vt_choose_mattes(context, desc, s.root, &s.photos, &report);
    if (!status) status = vt_find_developed(context, desc, &s.photos, &report, &out->views_kept, &out->views_cheap);
    megapixels = megapixels_of(&s.photos);
    for (int i = 0; i < s.photos.count; i++) out->view_bytes += view_bytes(desc, s.photos.items[i].width, s.photos.items[i].height);
  } else if (!status) {
    status = measure_headers(context, desc, &s, &megapixels, &out->view_bytes);
    out->seconds_calibration = vt_guess_calibration(s.names.count, megapixels, threads);
  }
  out->calibration_kept = s.known && report.kind == VT_SOURCE_PHOTOS;
  out->calibration_begun = s.begun;
  out->seconds_developing = vt_guess_developing(megapixels, threads, !out->views_kept && !out->views_cheap);
  free_source(context, &s);
  vt_free_capture_report(context, &report);
  return status;
}

// The photographs of a source whose cameras and files are listed elsewhere, by their paths.
static vt_status list_paths(vt_context *context, const vt_photos *photos, vt_names *out) {
  out->items = VT_NEW(context, char *, (size_t)photos->count);
  if (!out->items) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < photos->count; i++) {
    out->items[i] = vt_strdup(context, photos->items[i].path);
    if (!out->items[i]) return VT_OUT_OF_MEMORY;
    out->count++;
  }
  return VT_OK;
}

vt_status vt_check_capture(vt_context *context, const vt_capture_desc *desc, vt_check_report *out) {
  VT_ASSERT(desc && desc->cookie == VT_COOKIE && desc->source);
  vt_capture_report report = {0};
  source s = {.look_only = true};
  vt_names paths = {0};
  int threads = vt_thread_count(context);
  *out = (vt_check_report){0};
  vt_status status = load_source(context, desc, &s, &report);
  bool listed = !status && !s.folder; // by transforms.json
  if (listed) status = list_paths(context, &s.photos, &paths);
  if (!status) status = vt_check_photographs(context, listed ? "" : s.folder, listed ? &paths : &s.names, false, out);
  if (!status && s.known)
    status = look_around(context, &s.photos, &out->coverage, &out->warning_count, &out->warnings);
  for (int i = 0; i < report.left_out_count && !status; i++)
    status = vt_note_sentence(context, &out->warning_count, &out->warnings, "%s", report.left_out[i]);
  if (!status) {
    out->cameras_known = s.known;
    out->calibration_wanted = report.kind == VT_SOURCE_PHOTOS;
    for (int i = 0; i < out->count; i++) out->view_bytes += view_bytes(desc, out->photos[i].width, out->photos[i].height);
    if (!s.known) out->seconds_calibration = vt_guess_calibration(out->count, out->megapixels, threads);
    if (!s.known) out->calibration_bytes = (uint64_t)out->count * 1500000; // features and matches
    out->seconds_developing = vt_guess_developing(out->megapixels, threads, true);
  }
  free_source(context, &s);
  vt_free_names(context, &paths);
  vt_free_capture_report(context, &report);
  if (status) vt_free_check_report(context, out);
  return status;
}
