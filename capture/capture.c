// capture.c - from what a user has to calibrated, matted views
// SPDX-License-Identifier: BSD-3-Clause
//
// A source is recognised by what lies in it, the most finished first: transforms*.json, then a COLMAP model with its
// pictures, then photographs alone. Each way ends in the same list of calibrated photographs (photos.h), which
// develop.c turns into views. What is there is used; what is missing is made.

#include "capture/capture.h"
#include "base/file.h"
#include "capture/calibrate.h"
#include "capture/colmap_model.h"
#include "capture/develop.h"
#include "capture/masks.h"
#include "capture/transforms.h"
#include "capture/world.h"
#include "capture/write_cameras.h"

#include <string.h>

vt_capture_desc vt_default_capture_desc(void) {
  return (vt_capture_desc){.cookie = VT_COOKIE, .matte = VT_MATTE_AUTO, .marker_cells = 4, .colmap = "colmap"};
}

void vt_free_capture_report(vt_context *context, vt_capture_report *report) {
  for (int i = 0; i < report->left_out_count; i++) vt_free(context, report->left_out[i]);
  vt_free(context, report->left_out);
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

// Every image of the model becomes a photograph; pictures that the model does not have are named in the report.
static vt_status take_model(vt_context *context, const vt_colmap_model *model, const char *folder,
                            const vt_names *names, vt_photos *photos, vt_capture_report *report) {
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
  report->photograph_count = model->count;
  for (int i = 0; i < names->count && !status; i++) {
    if (has_image(model, names->items[i])) continue;
    report->photograph_count++;
    status = vt_leave_out(context, report, names->items[i],
                          "not registered; it shows too little of what the others show, or is blurred");
  }
  report->reprojection_error = model->reprojection_error;
  return status;
}

// ---- the flow

static vt_status calibrate_photos(vt_context *context, const vt_capture_desc *desc, const char *folder,
                                  const vt_names *names, vt_colmap_model *model, vt_capture_report *report) {
  if (!names->count)
    return vt_fail(context, VT_BAD_INPUT,
                   "%s: no photographs in it (jpg, png, tif, ...); give the folder where they are", desc->source);
  if (names->count < 3)
    return vt_fail(context, VT_TOO_FEW_VIEWS,
                   "%s: %d photograph%s, and at least 3 are needed to find the cameras; photograph the tree from all "
                   "around, 30 to 60 times, each photograph showing most of what its neighbours show",
                   desc->source, names->count, names->count == 1 ? "" : "s");
  double start = vt_seconds();
  vt_status status = vt_calibrate(context, desc, folder, names, model, &report->calibration_from_cache);
  report->seconds_calibration = vt_seconds() - start;
  if (!status && model->count < 3)
    status =
        vt_fail(context, VT_TOO_FEW_VIEWS,
                "%s: the cameras of only %d of %d photographs could be found, and at least 3 are needed; take more "
                "photographs with smaller steps between them",
                desc->source, model->count, names->count);
  return status;
}

static vt_status load_folder(vt_context *context, const vt_capture_desc *desc, vt_photos *photos,
                             vt_capture_report *report) {
  static const char *const bases[] = {"sparse", "colmap/sparse"};
  vt_colmap_model model = {0};
  vt_names names = {0};
  char *folder = NULL;
  bool found = false;
  split s = find_split(context, desc->source);
  vt_status status = VT_OK;
  if (s.all || s.train || s.test) {
    report->kind = VT_SOURCE_TRANSFORMS;
    status = load_transforms(context, &s, photos);
    report->photograph_count = photos->count;
    goto done;
  }
  status = find_photos(context, desc, &folder, &names);
  for (int i = 0; i < 2 && !status && !found; i++) {
    char *base = folder_in(context, desc->source, bases[i]);
    if (!base) continue;
    status = find_model(context, base, &model, &found);
    vt_free(context, base);
  }
  report->kind = found ? VT_SOURCE_COLMAP : VT_SOURCE_PHOTOS;
  if (!status && !found) status = calibrate_photos(context, desc, folder, &names, &model, report);
  if (!status) status = take_model(context, &model, folder, &names, photos, report);
done:
  free_split(context, &s);
  vt_free_colmap_model(context, &model);
  vt_free_names(context, &names);
  vt_free(context, folder);
  return status;
}

static bool is_json_name(const char *path) {
  size_t length = strlen(path);
  return length > 5 && !strcmp(path + length - 5, ".json");
}

// *root: the capture's folder, to be freed.
static vt_status load_source(vt_context *context, const vt_capture_desc *desc, char **root, vt_photos *photos,
                             vt_capture_report *report) {
  *root = vt_strdup(context, desc->source);
  if (!*root) return VT_OUT_OF_MEMORY;
  if (vt_is_folder(desc->source)) return load_folder(context, desc, photos, report);
  if (!vt_is_file(desc->source))
    return vt_fail(context, VT_BAD_INPUT,
                   "%s: no such folder; give a folder of photographs, a COLMAP workspace, or a "
                   "folder with transforms.json",
                   desc->source);
  if (!is_json_name(desc->source))
    return vt_fail(context, VT_BAD_INPUT, "%s: a file; give the folder of photographs, or a transforms.json",
                   desc->source);
  size_t folder_length = (size_t)(vt_base_name(desc->source) - desc->source);
  vt_free(context, *root);
  *root = vt_strdup(context, folder_length ? desc->source : ".");
  if (!*root) return VT_OUT_OF_MEMORY;
  if (folder_length) (*root)[folder_length > 1 ? folder_length - 1 : 1] = 0;
  report->kind = VT_SOURCE_TRANSFORMS;
  vt_status status = load_transforms_file(context, desc->source, *root, photos);
  report->photograph_count = photos->count;
  return status;
}

vt_status vt_convert_cameras(vt_context *context, const vt_capture_desc *desc, vt_camera_format format, const char *folder,
                             int *count) {
  VT_ASSERT(desc && desc->cookie == VT_COOKIE && desc->source);
  vt_capture_report report = {.reprojection_error = NAN};
  vt_photos photos = {0};
  char *root = NULL;
  vt_status status = load_source(context, desc, &root, &photos, &report);
  if (!status) status = vt_find_world(context, desc, report.kind == VT_SOURCE_TRANSFORMS, &photos);
  if (!status) status = vt_export_photos(context, &photos, true, format, folder);
  *count = photos.count;
  vt_free_photos(context, &photos);
  vt_free_capture_report(context, &report);
  vt_free(context, root);
  return status;
}

vt_status vt_load_views(vt_context *context, const vt_capture_desc *desc, vt_views *out, vt_capture_report *or_null) {
  VT_ASSERT(desc && desc->cookie == VT_COOKIE && desc->source && desc->max_image_size >= 0);
  static const char *const kinds[] = {"transforms.json", "the COLMAP model", "colmap"};
  vt_capture_report own = {0}, *report = or_null ? or_null : &own;
  vt_photos photos = {0};
  char *root = NULL;
  *report = (vt_capture_report){.reprojection_error = NAN};
  *out = (vt_views){0};
  vt_status status = load_source(context, desc, &root, &photos, report);
  for (int i = 0; i < photos.count && !status; i++) {
    vt_camera camera = vt_photo_camera(&photos.items[i]);
    status = vt_check_camera(context, &camera, photos.items[i].path);
  }
  if (!status) {
    vt_log(context, VT_LOG_NORMAL, "capture: %d photographs with cameras from %s%s", photos.count, kinds[report->kind],
           report->calibration_from_cache ? " (kept from before)" : "");
    status = vt_find_ignored(context, desc->ignore, &photos);
  }
  if (!status) status = vt_find_world(context, desc, report->kind == VT_SOURCE_TRANSFORMS, &photos);
  vt_world world = photos.world;
  if (!status) status = vt_choose_mattes(context, desc, root, &photos, report);
  if (!status) status = vt_develop_photos(context, desc, &photos, report, out);
  if (!status) out->world = world;
  for (int i = 0; i < report->left_out_count && !status; i++)
    vt_log(context, VT_LOG_NORMAL, "left out: %s", report->left_out[i]);
  vt_free_photos(context, &photos);
  vt_free(context, root);
  if (!or_null || status) vt_free_capture_report(context, report);
  return status;
}
