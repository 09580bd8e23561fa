// write_cameras.c - cameras as the files that other programs of the field read
// SPDX-License-Identifier: BSD-3-Clause
//
// The counterpart of transforms.c and colmap_model.c, and what these read is what was written: numbers go out with all
// their digits (17 of a double), rotations as they are, or as the quaternion whose largest part is positive (Shepperd
// 1978: the part that is divided by is the largest one). A lens that a format has no place for is refused rather than
// rounded. transform_matrix is the inverse of the camera with columns 1 and 2 negated (transforms.c).
//
// COLMAP wants points3D to be there; ours is empty, which its point_triangulator fills.

#include "capture/write_cameras.h"
#include "base/file.h"
#include "base/folders.h"
#include "base/json.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

vt_lens vt_lens_of_camera(const vt_camera *c) {
  return (vt_lens){VT_LENS_PINHOLE, c->width, c->height, c->fx, c->fy, c->cx, c->cy, {0}};
}

// ---- transforms.json

static void put_matrix(vt_json_writer *json, const vt_listed *l) {
  const double *r = l->rotation.m;
  vt_vec3 centre = vt_scale(vt_mul_transposed(&l->rotation, l->translation), -1);
  double c[3] = {centre.x, centre.y, centre.z};
  vt_json_open_array(json, "transform_matrix");
  for (int i = 0; i < 4; i++) {
    double row[4] = {i < 3 ? r[i] : 0, i < 3 ? -r[3 + i] : 0, i < 3 ? -r[6 + i] : 0, i < 3 ? c[i] : 1};
    vt_json_open_array(json, NULL);
    for (int j = 0; j < 4; j++) vt_json_put_number(json, NULL, row[j] == 0 ? 0 : row[j]);
    vt_json_close_array(json);
  }
  vt_json_close_array(json);
}

static double angle_x(const vt_lens *lens) {
  return 2 * atan(0.5 * lens->width / lens->fx);
}

static const char *model_name(const vt_lens *lens) {
  return vt_lens_is_pinhole(lens) ? "PINHOLE" : lens->model == VT_LENS_FISHEYE ? "OPENCV_FISHEYE" : "OPENCV";
}

static void put_lens(vt_json_writer *json, const vt_lens *lens) {
  static const char *const opencv[] = {"k1", "k2", "p1", "p2", "k3"}, *const fisheye[] = {"k1", "k2", "k3", "k4"};
  vt_json_put_integer(json, "w", lens->width);
  vt_json_put_integer(json, "h", lens->height);
  vt_json_put_number(json, "fl_x", lens->fx);
  vt_json_put_number(json, "fl_y", lens->fy);
  vt_json_put_number(json, "cx", lens->cx);
  vt_json_put_number(json, "cy", lens->cy);
  bool is_fisheye = lens->model == VT_LENS_FISHEYE;
  for (int i = 0; i < (is_fisheye ? 4 : 5) && !vt_lens_is_pinhole(lens); i++)
    vt_json_put_number(json, is_fisheye ? fisheye[i] : opencv[i], lens->k[i]);
  if (!is_fisheye && lens->k[8] != 0) vt_json_put_number(json, "k4", lens->k[8]);
  vt_json_put_number(json, "camera_angle_x", angle_x(lens));
}

static void put_world(vt_json_writer *json, const vt_world *world) {
  double up[3] = {world->up.x, world->up.y, world->up.z};
  if (vt_length(world->up) > 0) {
    vt_json_open_array(json, "up");
    for (int i = 0; i < 3; i++) vt_json_put_number(json, NULL, up[i]);
    vt_json_close_array(json);
  }
  if (world->metres_per_unit > 0) vt_json_put_number(json, "metres_per_unit", world->metres_per_unit);
  if (world->tree_height > 0) vt_json_put_number(json, "tree_height_metres", world->tree_height);
  if (world->estimated) vt_json_put_bool(json, "estimated", true);
}

static void put_frame(vt_json_writer *json, const vt_listed *l, bool model) {
  vt_json_open_object(json, NULL);
  vt_json_put_string(json, "file_path", l->name);
  if (l->mask) vt_json_put_string(json, "mask_path", l->mask);
  if (l->ignored) vt_json_put_string(json, "ignore_path", l->ignored);
  if (model) vt_json_put_string(json, "camera_model", model_name(&l->lens));
  put_lens(json, &l->lens);
  put_matrix(json, l);
  vt_json_close_object(json);
}

vt_status vt_write_transforms(vt_context *context, const vt_listed *list, int count, const vt_world *world, const char *path) {
  vt_json_writer json = vt_begin_json(context);
  bool mixed = false;
  for (int i = 0; i < count; i++) {
    const vt_lens *lens = &list[i].lens;
    mixed = mixed || strcmp(model_name(lens), model_name(&list[0].lens));
    if (lens->model == VT_LENS_OPENCV && (lens->k[5] != 0 || lens->k[6] != 0 || lens->k[7] != 0)) {
      vt_drop_json(&json);
      return vt_fail(context, VT_BAD_INPUT,
                     "%s: transforms.json has no place for the coefficients k4 k5 k6 of FULL_OPENCV; write a COLMAP model",
                     list[i].name);
    }
  }
  vt_json_open_object(&json, NULL);
  vt_json_put_string(&json, "generator", "voltree");
  vt_json_put_string(&json, "camera_model", count ? model_name(&list[0].lens) : "PINHOLE");
  put_world(&json, world);
  if (count) vt_json_put_number(&json, "camera_angle_x", angle_x(&list[0].lens));
  vt_json_open_array(&json, "frames");
  for (int i = 0; i < count; i++) put_frame(&json, &list[i], mixed);
  vt_json_close_array(&json);
  vt_json_close_object(&json);
  char *text = NULL;
  size_t size = 0;
  vt_status status = vt_end_json(&json, &text, &size);
  if (!status) status = vt_write_file(context, path, text, size);
  vt_free(context, text);
  return status;
}

// ---- COLMAP

typedef struct bytes {
  vt_context *context;
  char *items;
  size_t size, capacity;
  bool failed;
} bytes;

static void add_bytes(bytes *b, const void *from, size_t size) {
  if (b->failed) return;
  if (b->size + size > b->capacity) {
    size_t capacity = 2 * (b->size + size) + 4096;
    char *bigger = vt_realloc(b->context, b->items, capacity, 1);
    b->failed = !bigger;
    if (!bigger) return;
    b->items = bigger;
    b->capacity = capacity;
  }
  memcpy(b->items + b->size, from, size);
  b->size += size;
}

static void add_number(bytes *b, uint64_t value, int count) { // little-endian on every machine
  for (int i = 0; i < count; i++) add_bytes(b, &(uint8_t){(uint8_t)(value >> 8 * i)}, 1);
}

static void add_double(bytes *b, double value) {
  uint64_t bits;
  memcpy(&bits, &value, sizeof bits);
  add_number(b, bits, 8);
}

#ifdef __GNUC__
__attribute__((format(printf, 2, 3)))
#endif
static void add_text(bytes *b, const char *format, ...) {
  char line[512];
  va_list list;
  va_start(list, format);
  int length = vsnprintf(line, sizeof line, format, list);
  va_end(list);
  VT_ASSERT(length >= 0 && (size_t)length < sizeof line);
  add_bytes(b, line, (size_t)length);
}

typedef struct kind { // of a camera, as COLMAP numbers and names them
  int id, count;
  const char *name;
} kind;

static vt_status kind_of(vt_context *context, const vt_listed *l, kind *out, double p[12]) {
  const vt_lens *lens = &l->lens;
  double head[4] = {lens->fx, lens->fy, lens->cx, lens->cy};
  for (int i = 0; i < 12; i++) p[i] = i < 4 ? head[i] : lens->k[i - 4];
  *out = (kind){1, 4, "PINHOLE"};
  if (vt_lens_is_pinhole(lens)) return VT_OK;
  if (lens->model == VT_LENS_FISHEYE) {
    *out = (kind){5, 8, "OPENCV_FISHEYE"};
  } else {
    bool full = lens->k[4] != 0 || lens->k[5] != 0 || lens->k[6] != 0 || lens->k[7] != 0;
    *out = full ? (kind){6, 12, "FULL_OPENCV"} : (kind){4, 8, "OPENCV"};
    if (lens->k[8] != 0)
      return vt_fail(context, VT_BAD_INPUT,
                     "%s: COLMAP has no lens with the r^8 (k4) of this one; write transforms, or calibrate without k4", l->name);
  }
  return VT_OK;
}

// Which camera each photograph has: equal lenses share one. *camera_count of them; first[c] is a photograph of camera c.
static void share_cameras(const vt_listed *list, int count, int *camera, int *first, int *camera_count) {
  *camera_count = 0;
  for (int i = 0; i < count; i++) {
    const vt_lens *a = &list[i].lens;
    camera[i] = -1;
    for (int c = 0; c < *camera_count && camera[i] < 0; c++) {
      const vt_lens *b = &list[first[c]].lens;
      bool same = a->model == b->model && a->width == b->width && a->height == b->height && a->fx == b->fx &&
                  a->fy == b->fy && a->cx == b->cx && a->cy == b->cy && !memcmp(a->k, b->k, sizeof a->k);
      if (same) camera[i] = c;
    }
    if (camera[i] >= 0) continue;
    camera[i] = *camera_count;
    first[(*camera_count)++] = i;
  }
}

// W X Y Z of a rotation.
static void quaternion_of(const vt_mat3 *rotation, double q[4]) {
  const double *m = rotation->m;
  double squares[4] = {1 + m[0] + m[4] + m[8], 1 + m[0] - m[4] - m[8], 1 - m[0] + m[4] - m[8], 1 - m[0] - m[4] + m[8]};
  int most = 0;
  for (int i = 1; i < 4; i++)
    if (squares[i] > squares[most]) most = i;
  double wx = m[7] - m[5], wy = m[2] - m[6], wz = m[3] - m[1], xy = m[1] + m[3], xz = m[2] + m[6], yz = m[5] + m[7];
  double rows[4][4] = {{squares[0], wx, wy, wz}, {wx, squares[1], xy, xz}, {wy, xy, squares[2], yz}, {wz, xz, yz, squares[3]}};
  double norm = 0;
  for (int i = 0; i < 4; i++) norm += rows[most][i] * rows[most][i];
  for (int i = 0; i < 4; i++) q[i] = rows[most][i] / sqrt(norm);
}

static void add_pose(bytes *b, const vt_listed *l, bool binary) {
  double p[7] = {0, 0, 0, 0, l->translation.x, l->translation.y, l->translation.z};
  quaternion_of(&l->rotation, p);
  for (int i = 0; i < 7; i++) {
    if (binary)
      add_double(b, p[i]);
    else
      add_text(b, " %.17g", p[i]);
  }
}

static vt_status write_cameras(vt_context *context, const vt_listed *list, const int *first, int camera_count, bool binary,
                               bytes *b) {
  if (binary) add_number(b, (uint64_t)camera_count, 8);
  if (!binary) add_text(b, "# voltree\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
  for (int c = 0; c < camera_count; c++) {
    const vt_lens *lens = &list[first[c]].lens;
    kind k;
    double p[12];
    vt_status status = kind_of(context, &list[first[c]], &k, p);
    if (status) return status;
    if (binary) {
      add_number(b, (uint64_t)c + 1, 4), add_number(b, (uint64_t)k.id, 4);
      add_number(b, (uint64_t)lens->width, 8), add_number(b, (uint64_t)lens->height, 8);
    } else {
      add_text(b, "%d %s %d %d", c + 1, k.name, lens->width, lens->height);
    }
    for (int i = 0; i < k.count; i++) {
      if (binary)
        add_double(b, p[i]);
      else
        add_text(b, " %.17g", p[i]);
    }
    if (!binary) add_text(b, "\n");
  }
  return b->failed ? VT_OUT_OF_MEMORY : VT_OK;
}

static vt_status write_images(vt_context *context, const vt_listed *list, int count, const int *camera, bool binary, bytes *b) {
  if (binary) add_number(b, (uint64_t)count, 8);
  if (!binary) add_text(b, "# voltree\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[]\n");
  for (int i = 0; i < count; i++) {
    const char *name = list[i].name;
    if (strchr(name, '\n') || (!binary && (*name == ' ' || *name == '\t')))
      return vt_fail(context, VT_BAD_INPUT, "%s: such a name cannot stand in images.txt; rename the photograph", name);
    if (binary)
      add_number(b, (uint64_t)i + 1, 4);
    else
      add_text(b, "%d", i + 1);
    add_pose(b, &list[i], binary);
    if (binary)
      add_number(b, (uint64_t)camera[i] + 1, 4);
    else
      add_text(b, " %d ", camera[i] + 1);
    add_bytes(b, name, strlen(name) + binary);
    if (binary)
      add_number(b, 0, 8);
    else
      add_text(b, "\n\n");
  }
  return b->failed ? VT_OUT_OF_MEMORY : VT_OK;
}

static vt_status keep_part(vt_context *context, const char *folder, const char *name, bool binary, const bytes *b) {
  char *whole = vt_concat(context, name, binary ? ".bin" : ".txt", ""), *path = whole ? vt_join(context, folder, whole) : NULL;
  vt_status status = path ? vt_write_file(context, path, b->items, b->size) : VT_OUT_OF_MEMORY;
  vt_free(context, whole);
  vt_free(context, path);
  return status;
}

static vt_status write_parts(vt_context *context, const vt_listed *list, int count, bool binary, const char *folder) {
  int *camera = VT_NEW(context, int, (size_t)count), *first = VT_NEW(context, int, (size_t)count), camera_count = 0;
  bytes parts[3] = {{.context = context}, {.context = context}, {.context = context}};
  static const char *const names[] = {"cameras", "images", "points3D"};
  vt_status status = camera && first ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) share_cameras(list, count, camera, first, &camera_count);
  if (!status) status = write_cameras(context, list, first, camera_count, binary, &parts[0]);
  if (!status) status = write_images(context, list, count, camera, binary, &parts[1]);
  if (binary)
    add_number(&parts[2], 0, 8);
  else
    add_text(&parts[2], "# voltree\n#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]\n");
  if (parts[2].failed) status = VT_OUT_OF_MEMORY;
  for (int i = 0; i < 3; i++) {
    if (!status) status = keep_part(context, folder, names[i], binary, &parts[i]);
    vt_free(context, parts[i].items);
  }
  vt_free(context, camera);
  vt_free(context, first);
  return status;
}

vt_status vt_write_colmap_model(vt_context *context, const vt_listed *list, int count, bool binary, const char *folder) {
  char *target = vt_strdup(context, folder), *made = NULL;
  vt_names inside = {0};
  vt_status status = target ? VT_OK : VT_OUT_OF_MEMORY;
  for (size_t n = target ? strlen(target) : 0; n > 1 && target[n - 1] == '/'; n--) target[n - 1] = 0;
  if (!status && vt_is_folder(target)) status = vt_list_folder(context, target, false, &inside);
  if (!status && (inside.count || (!vt_is_folder(target) && !access(target, F_OK))))
    status = vt_fail(context, VT_FAILED, "%s: there is something already; name a folder that is new or empty", folder);
  if (!status) status = vt_make_folder_beside(context, target, &made);
  if (!status) status = write_parts(context, list, count, binary, made);
  if (!status && ((vt_is_folder(target) && rmdir(target)) || rename(made, target)))
    status = vt_fail(context, VT_FAILED, "%s: cannot be written (%s); choose another folder", folder, strerror(errno));
  if (status && made) vt_remove_folder(context, made);
  vt_free_names(context, &inside);
  vt_free(context, made);
  vt_free(context, target);
  return status;
}
