// landmarks.c - the points of a COLMAP model with their tracks, text or binary
// SPDX-License-Identifier: BSD-3-Clause
//
// points3D lists for each point its position, colour, error and track; a track names images and their keypoints by number, and
// images says which name has which number, and where its keypoints are (doc/format.rst of COLMAP). Poses are passed over:
// colmap_model.c has the cameras. Untrusted as everything that is read: no count is believed before its bytes are there.

#include "capture/landmarks.h"
#include "base/file.h"
#include "capture/model_bytes.h"

#include <stdlib.h>

typedef struct image_number {
  uint32_t number;
  int photo;           // -1: none of ours
  size_t first, count; // its keypoints
} image_number;

typedef struct reader {
  vt_context *context;
  char *path; // of the file at hand, for messages
  vt_cursor in;
  const char *const *names;
  int name_count;
  image_number *images; // sorted by number once all are there
  size_t image_count, image_capacity;
  float (*keypoints)[2]; // of our photographs, one behind the other
  size_t keypoint_count, keypoint_capacity;
  vt_landmarks *out;
  size_t capacity, seen_capacity;
} reader;

static vt_status damaged(reader *r, const char *what) {
  return vt_fail(r->context, VT_BAD_INPUT, "%s: damaged, %s; copy or export the model again", r->path, what);
}

// ---- where both kinds meet

static int compare_numbers(const void *a, const void *b) {
  uint32_t p = ((const image_number *)a)->number, q = ((const image_number *)b)->number;
  return (p > q) - (p < q);
}

static const image_number *image_of_number(const reader *r, double number) {
  image_number key = {number >= 0 && number <= UINT32_MAX ? (uint32_t)number : UINT32_MAX, -1, 0, 0};
  return r->image_count ? bsearch(&key, r->images, r->image_count, sizeof key, compare_numbers) : NULL;
}

// Room for one more item; false only without memory.
static bool make_room(vt_context *context, void **items, size_t count, size_t *capacity, size_t size) {
  if (count < *capacity) return true;
  size_t more = *capacity ? 2 * *capacity : 1024;
  void *bigger = vt_realloc(context, *items, more, size);
  if (!bigger) return false;
  *items = bigger;
  *capacity = more;
  return true;
}

static vt_status add_image(reader *r, double number, const char *name) {
  if (!make_room(r->context, (void **)&r->images, r->image_count, &r->image_capacity, sizeof *r->images))
    return VT_OUT_OF_MEMORY;
  r->images[r->image_count++] = (image_number){number >= 0 && number <= UINT32_MAX ? (uint32_t)number : UINT32_MAX,
                                               vt_find_sorted_name(r->names, r->name_count, name), r->keypoint_count, 0};
  return VT_OK;
}

// Of the last image. Nobody asks for those of photographs that are not ours.
static vt_status add_keypoint(reader *r, const double pixel[2]) {
  image_number *image = &r->images[r->image_count - 1];
  if (image->photo < 0) return VT_OK;
  if (!make_room(r->context, (void **)&r->keypoints, r->keypoint_count, &r->keypoint_capacity, sizeof *r->keypoints))
    return VT_OUT_OF_MEMORY;
  r->keypoints[r->keypoint_count][0] = (float)pixel[0], r->keypoints[r->keypoint_count][1] = (float)pixel[1];
  r->keypoint_count++, image->count++;
  return VT_OK;
}

static vt_status add_point(reader *r, const double position[3], double error) {
  vt_landmarks *out = r->out;
  if (!make_room(r->context, (void **)&out->items, out->count, &r->capacity, sizeof *out->items))
    return VT_OUT_OF_MEMORY;
  out->items[out->count++] =
      (vt_landmark){vt_v3(position[0], position[1], position[2]), (float)error, (uint32_t)out->seen_count, 0};
  return VT_OK;
}

// One photograph that sees the last point. A photograph may see a point twice, and counts once.
static vt_status add_sight(reader *r, double number, double keypoint) {
  vt_landmarks *out = r->out;
  vt_landmark *point = &out->items[out->count - 1];
  const image_number *image = image_of_number(r, number);
  int photo = image ? image->photo : -1;
  if (photo < 0) return VT_OK;
  for (uint32_t i = 0; i < point->count; i++)
    if (out->seen_by[point->first + i] == photo) return VT_OK;
  if (out->seen_count == UINT32_MAX) return damaged(r, "it has more than 4 billion sights of points");
  size_t same = r->seen_capacity;
  if (!make_room(r->context, (void **)&out->pixels, out->seen_count, &same, sizeof *out->pixels) ||
      !make_room(r->context, (void **)&out->seen_by, out->seen_count, &r->seen_capacity, sizeof *out->seen_by))
    return VT_OUT_OF_MEMORY;
  bool there = keypoint >= 0 && keypoint < (double)image->count;
  for (int k = 0; k < 2; k++) out->pixels[out->seen_count][k] = there ? r->keypoints[image->first + (size_t)keypoint][k] : NAN;
  out->seen_by[out->seen_count++] = photo;
  point->count++;
  return VT_OK;
}

// A point at no possible place is as good as none.
static void drop_impossible(reader *r) {
  vt_landmark *last = &r->out->items[r->out->count - 1];
  vt_vec3 p = last->position;
  if (isfinite(p.x) && isfinite(p.y) && isfinite(p.z)) return;
  r->out->seen_count = last->first;
  r->out->count--;
}

// ---- binary

static vt_status read_images_binary(reader *r) {
  uint64_t count = vt_take(&r->in, 8);
  for (uint64_t n = 0; n < count && !r->in.short_read; n++) {
    double number = (double)vt_take(&r->in, 4);
    vt_pass(&r->in, 60, 1); // pose and camera
    const char *name = vt_take_name(&r->in);
    if (!name) return damaged(r, "it ends too early");
    uint64_t keypoints = vt_take(&r->in, 8);
    vt_status status = r->in.short_read ? VT_OK : add_image(r, number, name);
    for (uint64_t i = 0; i < keypoints && !r->in.short_read && !status; i++) {
      double pixel[2] = {vt_take_double(&r->in), 0};
      pixel[1] = vt_take_double(&r->in);
      vt_pass(&r->in, 8, 1); // the point, which has it in its track
      if (!r->in.short_read) status = add_keypoint(r, pixel);
    }
    if (status) return status;
  }
  return r->in.short_read ? damaged(r, "it ends too early") : VT_OK;
}

static vt_status read_points_binary(reader *r) {
  uint64_t count = vt_take(&r->in, 8);
  for (uint64_t n = 0; n < count && !r->in.short_read; n++) {
    double position[3];
    vt_pass(&r->in, 8, 1); // the point's number
    for (int i = 0; i < 3; i++) position[i] = vt_take_double(&r->in);
    vt_pass(&r->in, 3, 1); // colour
    double error = vt_take_double(&r->in);
    uint64_t length = vt_take(&r->in, 8);
    vt_status status = r->in.short_read ? VT_OK : add_point(r, position, error);
    for (uint64_t i = 0; i < length && !r->in.short_read && !status; i++) {
      double image = (double)vt_take(&r->in, 4), keypoint = (double)vt_take(&r->in, 4);
      if (!r->in.short_read) status = add_sight(r, image, keypoint);
    }
    if (status) return status;
    if (!r->in.short_read) drop_impossible(r);
  }
  return r->in.short_read ? damaged(r, "it ends too early") : VT_OK;
}

// ---- text

static vt_status read_images_text(reader *r) {
  for (char *line; (line = vt_take_data_line(&r->in));) {
    double numbers[9], keypoint[3]; // IMAGE_ID, QW QX QY QZ TX TY TZ, CAMERA_ID; X, Y, POINT3D_ID
    if (!vt_take_numbers(&line, 9, numbers)) return damaged(r, "an image's line has too few numbers");
    vt_status status = add_image(r, numbers[0], line);
    for (line = vt_take_line(&r->in); line && !status && vt_take_numbers(&line, 3, keypoint);) status = add_keypoint(r, keypoint);
    if (status) return status;
  }
  return VT_OK;
}

static vt_status read_points_text(reader *r) {
  for (char *line; (line = vt_take_data_line(&r->in));) {
    double numbers[8], track[2]; // POINT3D_ID, X Y Z, R G B, ERROR, then IMAGE_ID and keypoint of each sight
    if (!vt_take_numbers(&line, 8, numbers)) return damaged(r, "a point has too few numbers");
    vt_status status = add_point(r, numbers + 1, numbers[7]);
    while (!status && *line) {
      if (!vt_take_numbers(&line, 2, track))
        return damaged(r, "a point's track is no list of pairs");
      status = add_sight(r, track[0], track[1]);
    }
    if (status) return status;
    drop_impossible(r);
  }
  return VT_OK;
}

// ---- the folder

static vt_status read_part(reader *r, const char *folder, const char *name, vt_status (*read)(reader *)) {
  r->path = vt_join(r->context, folder, name);
  if (!r->path) return VT_OUT_OF_MEMORY;
  vt_status status = VT_OK;
  if (vt_is_file(r->path)) {
    status = vt_read_file(r->context, r->path, &r->in.bytes, &r->in.size);
    r->in.at = 0;
    r->in.short_read = false;
    if (!status) status = read(r);
  }
  vt_free(r->context, r->in.bytes);
  vt_free(r->context, r->path);
  r->in.bytes = NULL;
  r->path = NULL;
  return status;
}

vt_status vt_read_landmarks(vt_context *context, const char *folder, bool binary, const char *const *names,
                            int name_count, vt_landmarks *out) {
  *out = (vt_landmarks){0};
  reader r = {.context = context, .names = names, .name_count = name_count, .out = out};
  vt_status status =
      read_part(&r, folder, binary ? "images.bin" : "images.txt", binary ? read_images_binary : read_images_text);
  if (r.image_count) qsort(r.images, r.image_count, sizeof *r.images, compare_numbers);
  if (!status)
    status =
        read_part(&r, folder, binary ? "points3D.bin" : "points3D.txt", binary ? read_points_binary : read_points_text);
  vt_free(context, r.images);
  vt_free(context, r.keypoints);
  if (status) vt_free_landmarks(context, out);
  return status;
}

void vt_free_landmarks(vt_context *context, vt_landmarks *landmarks) {
  vt_free(context, landmarks->items);
  vt_free(context, landmarks->seen_by);
  vt_free(context, landmarks->pixels);
  *landmarks = (vt_landmarks){0};
}
