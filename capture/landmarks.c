// landmarks.c - the points of a COLMAP model with their tracks, text or binary
// SPDX-License-Identifier: BSD-3-Clause
//
// points3D lists for each point its position, colour, error and track; a track names images by number, and images says
// which name has which number (doc/format.rst of COLMAP). Poses and keypoints are passed over: where a point is in a
// photograph is its projection, and colmap_model.c has the cameras. Untrusted as everything that is read: no count is
// believed before its bytes are there.

#include "capture/landmarks.h"
#include "base/file.h"

#include <stdlib.h>
#include <string.h>

typedef struct image_number {
  uint32_t number;
  int photo; // -1: none of ours
} image_number;

typedef struct reader {
  vt_context *context;
  char *path; // of the file at hand, for messages
  uint8_t *bytes;
  size_t size, at;
  bool short_read;
  const char *const *names;
  int name_count;
  image_number *images; // sorted by number once all are there
  size_t image_count, image_capacity;
  vt_landmarks *out;
  size_t capacity, seen_capacity;
} reader;

static vt_status damaged(reader *r, const char *what) {
  return vt_fail(r->context, VT_BAD_INPUT, "%s: damaged, %s; copy or export the model again", r->path, what);
}

// ---- where both kinds meet

static int photo_of_name(const reader *r, const char *name) {
  int low = 0, high = r->name_count;
  while (low < high) {
    int middle = low + (high - low) / 2, order = strcmp(name, r->names[middle]);
    if (!order) return middle;
    if (order < 0)
      high = middle;
    else
      low = middle + 1;
  }
  return -1;
}

static int compare_numbers(const void *a, const void *b) {
  uint32_t p = ((const image_number *)a)->number, q = ((const image_number *)b)->number;
  return (p > q) - (p < q);
}

static int photo_of_number(const reader *r, double number) {
  image_number key = {number >= 0 && number <= UINT32_MAX ? (uint32_t)number : UINT32_MAX, -1};
  const image_number *found =
      r->image_count ? bsearch(&key, r->images, r->image_count, sizeof key, compare_numbers) : NULL;
  return found ? found->photo : -1;
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
  r->images[r->image_count++] =
      (image_number){number >= 0 && number <= UINT32_MAX ? (uint32_t)number : UINT32_MAX, photo_of_name(r, name)};
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
static vt_status add_sight(reader *r, double number) {
  vt_landmarks *out = r->out;
  vt_landmark *point = &out->items[out->count - 1];
  int photo = photo_of_number(r, number);
  if (photo < 0) return VT_OK;
  for (uint32_t i = 0; i < point->count; i++)
    if (out->seen_by[point->first + i] == photo) return VT_OK;
  if (out->seen_count == UINT32_MAX) return damaged(r, "it has more than 4 billion sights of points");
  if (!make_room(r->context, (void **)&out->seen_by, out->seen_count, &r->seen_capacity, sizeof *out->seen_by))
    return VT_OUT_OF_MEMORY;
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

static uint64_t take(reader *r, size_t bytes) { // little-endian, up to 8 bytes; 0 beyond the end
  uint64_t value = 0;
  if (r->size - r->at < bytes) {
    r->short_read = true;
    r->at = r->size;
    return 0;
  }
  for (size_t i = 0; i < bytes; i++) value |= (uint64_t)r->bytes[r->at + i] << (8 * i);
  r->at += bytes;
  return value;
}

static double take_double(reader *r) {
  uint64_t bits = take(r, 8);
  double value;
  memcpy(&value, &bits, 8);
  return value;
}

static void pass(reader *r, uint64_t count, uint64_t bytes) { // bytes is small
  if (count > (r->size - r->at) / bytes) {
    r->short_read = true;
    r->at = r->size;
  } else {
    r->at += (size_t)(count * bytes);
  }
}

static vt_status read_images_binary(reader *r) {
  uint64_t count = take(r, 8);
  for (uint64_t n = 0; n < count && !r->short_read; n++) {
    double number = (double)take(r, 4);
    pass(r, 60, 1); // pose and camera
    const char *name = (const char *)r->bytes + r->at;
    const uint8_t *end = memchr(name, 0, r->size - r->at);
    if (r->short_read || !end) return damaged(r, "it ends too early");
    r->at = (size_t)(end - r->bytes) + 1;
    pass(r, take(r, 8), 24); // the keypoints
    vt_status status = r->short_read ? VT_OK : add_image(r, number, name);
    if (status) return status;
  }
  return r->short_read ? damaged(r, "it ends too early") : VT_OK;
}

static vt_status read_points_binary(reader *r) {
  uint64_t count = take(r, 8);
  for (uint64_t n = 0; n < count && !r->short_read; n++) {
    double position[3];
    pass(r, 8, 1); // the point's number
    for (int i = 0; i < 3; i++) position[i] = take_double(r);
    pass(r, 3, 1); // colour
    double error = take_double(r);
    uint64_t length = take(r, 8);
    vt_status status = r->short_read ? VT_OK : add_point(r, position, error);
    for (uint64_t i = 0; i < length && !r->short_read && !status; i++) {
      double image = (double)take(r, 4);
      pass(r, 4, 1); // keypoint
      if (!r->short_read) status = add_sight(r, image);
    }
    if (status) return status;
    if (!r->short_read) drop_impossible(r);
  }
  return r->short_read ? damaged(r, "it ends too early") : VT_OK;
}

// ---- text

// The next line, cut at its end; NULL behind the last one.
static char *take_line(reader *r) {
  if (r->at >= r->size) return NULL;
  char *line = (char *)r->bytes + r->at, *end = memchr(line, '\n', r->size - r->at);
  r->at = end ? (size_t)(end - (char *)r->bytes) + 1 : r->size;
  if (!end) end = (char *)r->bytes + r->size; // where vt_read_file put a zero
  *end = 0;
  while (end > line && strchr(" \t\r", end[-1])) *--end = 0;
  return line + strspn(line, " \t");
}

static char *take_data_line(reader *r) {
  char *line;
  do line = take_line(r);
  while (line && (!*line || *line == '#'));
  return line;
}

static bool take_number(char **text, double *out) { // *text moves behind it
  char *end;
  *out = strtod(*text, &end);
  if (end == *text || (*end && *end != ' ' && *end != '\t')) return false;
  *text = end + strspn(end, " \t");
  return true;
}

static vt_status read_images_text(reader *r) {
  for (char *line; (line = take_data_line(r));) {
    double numbers[9]; // IMAGE_ID, QW QX QY QZ TX TY TZ, CAMERA_ID
    for (int i = 0; i < 9; i++)
      if (!take_number(&line, &numbers[i])) return damaged(r, "an image's line has too few numbers");
    vt_status status = add_image(r, numbers[0], line);
    if (status) return status;
    (void)take_line(r); // its keypoints
  }
  return VT_OK;
}

static vt_status read_points_text(reader *r) {
  for (char *line; (line = take_data_line(r));) {
    double numbers[8], track[2]; // POINT3D_ID, X Y Z, R G B, ERROR, then IMAGE_ID and keypoint of each sight
    for (int i = 0; i < 8; i++)
      if (!take_number(&line, &numbers[i])) return damaged(r, "a point has too few numbers");
    vt_status status = add_point(r, numbers + 1, numbers[7]);
    while (!status && *line) {
      if (!take_number(&line, &track[0]) || !take_number(&line, &track[1]))
        return damaged(r, "a point's track is no list of pairs");
      status = add_sight(r, track[0]);
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
    status = vt_read_file(r->context, r->path, &r->bytes, &r->size);
    r->at = 0;
    r->short_read = false;
    if (!status) status = read(r);
  }
  vt_free(r->context, r->bytes);
  vt_free(r->context, r->path);
  r->bytes = NULL;
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
  if (status) vt_free_landmarks(context, out);
  return status;
}

void vt_free_landmarks(vt_context *context, vt_landmarks *landmarks) {
  vt_free(context, landmarks->items);
  vt_free(context, landmarks->seen_by);
  *landmarks = (vt_landmarks){0};
}
