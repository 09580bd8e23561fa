// photos.c - the list of calibrated photographs, and how a lens meets its file
// SPDX-License-Identifier: BSD-3-Clause
//
// A source gives a lens for a picture of w x h pixels; the file may be a reduced copy of that picture (images_4, a
// resized upload). In continuous pixel coordinates, whose origin is the corner of the picture, the reduced copy has
// fx' = fx w'/w and cx' = cx w'/w, and likewise for y; distortion coefficients act on normalised coordinates and stay.
// With coordinates that have the origin at the first pixel's centre this would be wrong by half a pixel.
//
// A file of another shape than its camera belongs to another camera. One case is harmless: the program that calibrated
// turned the picture upright as its EXIF header says. Then it is turned here too.

#include "capture/photos.h"
#include "base/file.h"
#include "base/image_file.h"

#include <string.h>

char *vt_concat(vt_context *context, const char *a, const char *b, const char *c) {
  size_t na = strlen(a), nb = strlen(b), nc = strlen(c);
  char *out = vt_alloc(context, na + nb + nc + 1, 1);
  if (!out) return NULL;
  memcpy(out, a, na);
  memcpy(out + na, b, nb);
  memcpy(out + na + nb, c, nc);
  return out;
}

vt_photo *vt_add_photo(vt_context *context, vt_photos *photos, const char *name, const char *path) {
  if (photos->count == photos->capacity) {
    int capacity = photos->capacity ? 2 * photos->capacity : 64;
    vt_photo *items = vt_realloc(context, photos->items, (size_t)capacity, sizeof *items);
    if (!items) return NULL;
    photos->items = items;
    photos->capacity = capacity;
  }
  vt_photo *photo = &photos->items[photos->count];
  photo->name = vt_strdup(context, name);
  photo->path = vt_strdup(context, path);
  photo->orientation = 1;
  photos->count++;
  return photo->name && photo->path ? photo : NULL;
}

void vt_free_photo(vt_context *context, vt_photo *photo) {
  vt_free(context, photo->name);
  vt_free(context, photo->path);
  vt_free(context, photo->mask);
  vt_free(context, photo->ignored);
  *photo = (vt_photo){0};
}

void vt_free_photos(vt_context *context, vt_photos *photos) {
  for (int i = 0; i < photos->count; i++) vt_free_photo(context, &photos->items[i]);
  vt_free(context, photos->items);
  vt_free_landmarks(context, &photos->landmarks);
  *photos = (vt_photos){0};
}

// Reducing cuts up to one pixel off a side.
static bool same_shape(int w, int h, int file_w, int file_h) {
  double sx = (double)w / file_w, sy = (double)h / file_h;
  return fabs(sx - sy) <= 1.5 * fmax(sx, sy) / (file_w < file_h ? file_w : file_h);
}

vt_status vt_fit_photo(vt_context *context, vt_photo *photo, const char *where) {
  if (!vt_is_file(photo->path))
    return vt_fail(context, VT_BAD_INPUT, "%s: the picture %s is missing; put it there, or take it out of the list",
                   where, photo->path);
  vt_image_info info;
  vt_status status = vt_read_image_info(context, photo->path, &info);
  if (status) return status;
  vt_lens *lens = &photo->lens;
  photo->has_alpha = info.channels == 2 || info.channels == 4;
  photo->width = info.width;
  photo->height = info.height;
  photo->upright = info.orientation;
  if (!lens->width) {
    lens->width = info.width;
    lens->height = info.height;
    return VT_OK;
  }
  if (!same_shape(lens->width, lens->height, info.width, info.height)) {
    if (info.orientation < 5 || !same_shape(lens->width, lens->height, info.height, info.width))
      return vt_fail(context, VT_BAD_INPUT,
                     "%s: %s has %d x %d pixels and its camera %d x %d, which is another shape; calibrate with these "
                     "pictures, each size with a camera of its own",
                     where, photo->path, info.width, info.height, lens->width, lens->height);
    photo->orientation = info.orientation;
    photo->upright = 1;
    photo->width = info.height;
    photo->height = info.width;
  }
  double sx = (double)photo->width / lens->width, sy = (double)photo->height / lens->height;
  lens->fx *= sx;
  lens->cx *= sx;
  lens->fy *= sy;
  lens->cy *= sy;
  lens->width = photo->width;
  lens->height = photo->height;
  return VT_OK;
}

vt_status vt_turn_picture(vt_context *context, int orientation, vt_image *picture) {
  vt_image out = {0};
  vt_status status = vt_make_image(context, picture->height, picture->width, picture->channels, &out);
  if (status) return status;
  size_t channels = (size_t)picture->channels;
  for (int y = 0; y < out.height; y++)
    for (int x = 0; x < out.width; x++) {
      int from_x = orientation == 5 || orientation == 6 ? y : out.height - 1 - y;
      int from_y = orientation == 5 || orientation == 8 ? x : out.width - 1 - x;
      memcpy(out.pixels + ((size_t)y * (size_t)out.width + (size_t)x) * channels,
             picture->pixels + ((size_t)from_y * (size_t)picture->width + (size_t)from_x) * channels, channels);
    }
  vt_free_image(context, picture);
  *picture = out;
  return VT_OK;
}

vt_status vt_read_photo(vt_context *context, const vt_photo *photo, vt_image *out) {
  vt_status status = vt_read_image(context, photo->path, out);
  if (!status && photo->orientation > 1) status = vt_turn_picture(context, photo->orientation, out);
  if (!status && (out->width != photo->width || out->height != photo->height))
    status = vt_fail(context, VT_BAD_INPUT, "%s: changed while it was read; run again", photo->path);
  if (status) vt_free_image(context, out);
  return status;
}

vt_camera vt_photo_camera(const vt_photo *photo) {
  const vt_lens *lens = &photo->lens;
  return (vt_camera){lens->width, lens->height, lens->fx,        lens->fy,
                     lens->cx,    lens->cy,     photo->rotation, photo->translation};
}


vt_status vt_leave_out(vt_context *context, vt_capture_report *report, const char *name, const char *why) {
  char **items = vt_realloc(context, report->left_out, (size_t)report->left_out_count + 1, sizeof *items);
  if (!items) return VT_OUT_OF_MEMORY;
  report->left_out = items;
  items[report->left_out_count] = vt_concat(context, name, ": ", why);
  return items[report->left_out_count++] ? VT_OK : VT_OUT_OF_MEMORY;
}
