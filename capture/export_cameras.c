// export_cameras.c - cameras alone, as other programs name and read them
// SPDX-License-Identifier: BSD-3-Clause
//
// A COLMAP model names pictures as they lie in its folder of images, so all up to "images/" is left out. transforms.json names
// them by their way from where it stands: both paths are made absolute, and what they share is left out.

#define _XOPEN_SOURCE 700 // realpath
#include "capture/write_cameras.h"
#include "base/file.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// The way from one folder to a file, "../photos/a.jpg"; the file's own path where one of both cannot be found. NULL only
// without memory. Free with vt_free.
static char *way_to(vt_context *context, const char *folder, const char *file) {
  char from[PATH_MAX], to[PATH_MAX];
  if (!realpath(*folder ? folder : ".", from) || !realpath(file, to)) return vt_strdup(context, file);
  size_t shared = 0, ups = 0;
  for (size_t i = 0; to[i] && (to[i] == from[i] || (!from[i] && to[i] == '/')); i++) {
    if (to[i] == '/') shared = i + 1;
    if (!from[i]) break;
  }
  for (size_t i = shared; shared <= strlen(from) && from[i]; i++) ups += from[i] == '/' || i == shared;
  size_t length = strlen(to + shared);
  char *out = VT_NEW(context, char, 3 * ups + length + 1);
  if (!out) return NULL;
  for (size_t i = 0; i < ups; i++) memcpy(out + 3 * i, "../", 3);
  memcpy(out + 3 * ups, to + shared, length + 1);
  return out;
}

typedef struct listing {
  vt_listed *items;
  char **ways; // owned
  int count;
} listing;

static vt_status list_photos(vt_context *context, const vt_photos *photos, int role, bool by_path, const char *folder,
                             listing *out) {
  *out = (listing){.items = VT_NEW(context, vt_listed, (size_t)photos->count),
                   .ways = VT_NEW(context, char *, (size_t)photos->count)};
  if (!out->items || !out->ways) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < photos->count; i++) {
    const vt_photo *photo = &photos->items[i];
    if (role >= 0 && photo->role != (vt_role)role) continue;
    char *way = by_path ? way_to(context, folder, photo->path) : NULL;
    if (by_path && !way) return VT_OUT_OF_MEMORY;
    const char *name = photo->name;
    for (const char *at = name; role < 0 && (at = strstr(at, "images/")); at += 7)
      if (at == photo->name || at[-1] == '/') name = at + 7;
    out->ways[out->count] = way;
    out->items[out->count++] = (vt_listed){way ? way : name, NULL, NULL, photo->lens, photo->rotation, photo->translation};
  }
  return VT_OK;
}

static void free_listing(vt_context *context, listing *l) {
  for (int i = 0; i < l->count && l->ways; i++) vt_free(context, l->ways[i]);
  vt_free(context, l->ways);
  vt_free(context, l->items);
  *l = (listing){0};
}

static vt_status write_transforms(vt_context *context, const vt_photos *photos, int role, bool by_path, const char *folder,
                                  const char *name) {
  listing list = {0};
  char *path = vt_join(context, folder, name);
  vt_status status = path ? vt_make_folder(context, folder) : VT_OUT_OF_MEMORY;
  if (!status && !access(path, F_OK))
    status = vt_fail(context, VT_FAILED, "%s: is there already; choose another folder, or remove it", path);
  if (!status) status = list_photos(context, photos, role, by_path, folder, &list);
  if (!status) status = vt_write_transforms(context, list.items, list.count, &photos->world, path);
  free_listing(context, &list);
  vt_free(context, path);
  return status;
}

vt_status vt_export_photos(vt_context *context, const vt_photos *photos, bool by_path, vt_camera_format format,
                           const char *folder) {
  if (format == VT_CAMERAS_TRANSFORMS) {
    int test = 0;
    for (int i = 0; i < photos->count; i++) test += photos->items[i].role == VT_TEST;
    vt_status status = VT_OK;
    if (test < photos->count)
      status = write_transforms(context, photos, VT_TRAIN, by_path, folder, test ? "transforms_train.json" : "transforms.json");
    if (!status && test) status = write_transforms(context, photos, VT_TEST, by_path, folder, "transforms_test.json");
    return status;
  }
  listing list = {0};
  vt_status status = list_photos(context, photos, -1, false, folder, &list);
  if (!status) status = vt_write_colmap_model(context, list.items, list.count, format == VT_CAMERAS_COLMAP_BINARY, folder);
  free_listing(context, &list);
  return status;
}

vt_status vt_export_cameras(vt_context *context, const vt_views *views, vt_camera_format format, const char *folder) {
  vt_photos photos = {.world = views->world};
  vt_status status = VT_OK;
  for (int i = 0; i < views->count && !status; i++) {
    const vt_view *view = &views->items[i];
    vt_photo *photo = vt_add_photo(context, &photos, view->name, view->name);
    if (!photo) {
      status = VT_OUT_OF_MEMORY;
      break;
    }
    photo->role = view->role;
    photo->lens = vt_lens_of_camera(&view->camera);
    photo->rotation = view->camera.rotation;
    photo->translation = view->camera.translation;
  }
  if (!status) status = vt_export_photos(context, &photos, false, format, folder);
  vt_free_photos(context, &photos);
  return status;
}
