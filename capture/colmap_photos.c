// colmap_photos.c - photographs as colmap wants them: readable, and grouped by their camera
// SPDX-License-Identifier: BSD-3-Clause
//
// Photographs share a camera (one focal length, one distortion, found from all of them) where the header says that they were
// taken alike: make, model, focal length and size of the stored picture. The EXIF turn is no part of it: the sensor stays the
// same. What goes wrong: headers that were stripped leave the size alone to tell, so photographs of one size and different
// lenses share a camera; and a zoom that writes no focal length.
#include "capture/colmap_photos.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

// ---- cameras

static bool near(double a, double b) {
  return fabs(a - b) <= 0.005 * fmax(fabs(a), fabs(b));
}

static bool same_camera(const vt_image_info *a, const vt_image_info *b) {
  return a->width == b->width && a->height == b->height && near(a->focal_mm, b->focal_mm) &&
         near(a->focal_35mm, b->focal_35mm) && !strcmp(a->make, b->make) && !strcmp(a->model, b->model);
}

vt_status vt_read_headers(vt_context *context, const char *folder, const vt_names *names, bool strict, vt_image_info *infos) {
  vt_status status = VT_OK;
  for (int i = 0; i < names->count && !status; i++) {
    char *path = vt_join(context, folder, names->items[i]);
    status = path ? vt_read_image_info(context, path, &infos[i]) : VT_OUT_OF_MEMORY;
    vt_free(context, path);
    if (status != VT_BAD_INPUT || strict) continue;
    infos[i] = (vt_image_info){.orientation = 1};
    vt_clear_error(context);
    status = VT_OK;
  }
  return status;
}

int vt_group_photographs(const vt_image_info *infos, int count, int *group) {
  int groups = 0;
  for (int i = 0; i < count; i++) {
    int k = 0;
    while (k < i && !same_camera(&infos[i], &infos[k])) k++;
    group[i] = k < i ? group[k] : groups++;
  }
  return groups;
}

vt_status vt_write_photo_list(vt_context *context, const vt_names *names, const int *group, int which, const char *path) {
  size_t size = 1;
  for (int i = 0; i < names->count; i++) size += strlen(names->items[i]) + 1;
  char *text = VT_NEW(context, char, size), *end = text;
  if (!text) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < names->count; i++) {
    if (group[i] != which || strchr(names->items[i], '\n')) continue; // such a name cannot stand in a list
    end += sprintf(end, "%s\n", names->items[i]);
  }
  vt_status status = vt_write_file(context, path, text, (size_t)(end - text));
  vt_free(context, text);
  return status;
}

// ---- files

// Kinds that COLMAP reads in every version.
static bool is_plain(const char *name) {
  static const char *const endings[] = {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp"};
  const char *dot = strrchr(name, '.');
  for (size_t i = 0; dot && i < sizeof endings / sizeof endings[0]; i++)
    if (!strcasecmp(dot, endings[i])) return true;
  return false;
}

// A folder with the same names where COLMAP can read them all: links, and PNG (known by its content) for other kinds.
static vt_status convert_photos(vt_context *context, const char *folder, const vt_names *names, const char *workspace,
                                char **out) {
  char here[4096]; // links need an absolute path
  if (!getcwd(here, sizeof here)) return vt_fail(context, VT_FAILED, "%s: the working folder has no path", folder);
  char *images = vt_join(context, workspace, "images"), *real = vt_join(context, here, folder);
  vt_status status = images && real ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; status == VT_OK && i < names->count; i++) {
    char *from = vt_join(context, real, names->items[i]), *to = vt_join(context, images, names->items[i]);
    char *parent = to ? vt_strdup(context, to) : NULL, *png = to ? VT_NEW(context, char, strlen(to) + 5) : NULL;
    vt_image picture = {0};
    if (!from || !parent || !png) status = VT_OUT_OF_MEMORY;
    if (status == VT_OK) {
      *strrchr(parent, '/') = 0;
      snprintf(png, strlen(to) + 5, "%s.png", to);
      status = vt_make_folder(context, parent);
    }
    bool there = status == VT_OK && vt_is_file(to); // of an interrupted run
    if (status == VT_OK && !there && is_plain(names->items[i])) {
      if (symlink(from, to)) status = vt_fail(context, VT_FAILED, "%s: the link could not be made", to);
    } else if (status == VT_OK && !there) {
      status = vt_read_image(context, from, &picture);
      if (status == VT_OK) status = vt_write_image(context, png, &picture);
      if (status == VT_OK && rename(png, to)) status = vt_fail(context, VT_FAILED, "%s: could not be written", to);
    }
    vt_free_image(context, &picture);
    vt_free(context, from);
    vt_free(context, to);
    vt_free(context, parent);
    vt_free(context, png);
    if (status == VT_OK && vt_cancelled(context)) status = vt_fail(context, VT_CANCELLED, "colmap: interrupted");
  }
  vt_free(context, real);
  *out = images;
  return status;
}

vt_status vt_make_readable(vt_context *context, const char *folder, const vt_names *names, const char *workspace,
                           char **images) {
  bool plain = true;
  for (int i = 0; i < names->count; i++) plain = plain && is_plain(names->items[i]);
  if (!plain) return convert_photos(context, folder, names, workspace, images);
  *images = vt_strdup(context, folder);
  return *images ? VT_OK : VT_OUT_OF_MEMORY;
}
