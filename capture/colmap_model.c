// colmap_model.c - reading a COLMAP sparse model, text or binary
// SPDX-License-Identifier: BSD-3-Clause
//
// COLMAP's output format (doc/format.rst of COLMAP): cameras, images, points3D; since 3.12 also rigs and frames, which
// say nothing that images does not say, and are looked at only for images without a pose of their own (NaN or a quaternion
// of no length): cam_from_world = cam_from_rig rig_from_world, and the rig's first camera is the rig. Little-endian. cam_from_world as a quaternion (w, x, y, z),
// Hamilton's convention, and a translation; the first pixel's centre is (0.5, 0.5). All of it is untrusted: the reader
// moves a cursor that never passes the end of the file, and no count is believed before its bytes are there.

#include "capture/colmap_model.h"
#include "base/file.h"
#include "capture/model_bytes.h"

#include <stdint.h>
#include <string.h>

#define MAX_SIDE 65535

typedef struct camera_model {
  const char *name;
  int parameter_count; // their number in COLMAP's order is the id
  bool usable;
} camera_model;
static const camera_model camera_models[] = {{"SIMPLE_PINHOLE", 3, true},
                                             {"PINHOLE", 4, true},
                                             {"SIMPLE_RADIAL", 4, true},
                                             {"RADIAL", 5, true},
                                             {"OPENCV", 8, true},
                                             {"OPENCV_FISHEYE", 8, true},
                                             {"FULL_OPENCV", 12, true},
                                             {"FOV", 5, false},
                                             {"SIMPLE_RADIAL_FISHEYE", 4, true},
                                             {"RADIAL_FISHEYE", 5, true},
                                             {"THIN_PRISM_FISHEYE", 12, false},
                                             {"RAD_TAN_THIN_PRISM_FISHEYE", 16, false}};
#define MODEL_COUNT ((int)(sizeof camera_models / sizeof camera_models[0]))

typedef struct camera {
  uint32_t id;
  int model;
  vt_lens lens;
} camera;

typedef struct pose {
  vt_mat3 rotation;
  vt_vec3 translation;
} pose; // target_from_source

typedef struct rig_camera { // cam_from_rig
  uint32_t rig, camera;
  pose from_rig;
} rig_camera;
typedef struct frame_image { // rig_from_world of an image's frame
  uint32_t rig;
  uint64_t image;
  pose from_world;
} frame_image;

typedef struct reader {
  vt_context *context;
  char *path; // of the file at hand, for messages
  vt_cursor in;
  bool binary;
  camera *cameras;
  int camera_count, camera_capacity;
  int image_capacity;
  const char *folder;
  bool asked_rigs; // rigs and frames were read, or are not there
  rig_camera *rig_cameras;
  int rig_camera_count, rig_camera_capacity;
  frame_image *frame_images;
  int frame_image_count, frame_image_capacity;
} reader;

static vt_status damaged(reader *r, const char *what) {
  return vt_fail(r->context, VT_BAD_INPUT, "%s: damaged, %s; copy or export the model again", r->path, what);
}

// The items with room for one more. NULL only without memory.
static void *grow(reader *r, void *items, int count, int *capacity, size_t size) {
  if (count < *capacity) return items;
  int more = *capacity ? 2 * *capacity : 64;
  void *bigger = vt_realloc(r->context, items, (size_t)more, size);
  if (bigger) *capacity = more;
  return bigger;
}

// ---- where both kinds meet

static vt_status make_lens(reader *r, int model, double width, double height, const double *p, vt_lens *out) {
  for (int i = 0; i < camera_models[model].parameter_count; i++)
    if (!isfinite(p[i])) return damaged(r, "a camera has NaN or infinity");
  if (!(width >= 1 && width <= MAX_SIDE && height >= 1 && height <= MAX_SIDE))
    return damaged(r, "a camera has no possible picture size");
  *out = (vt_lens){VT_LENS_OPENCV, (int)width, (int)height, p[0], p[0], p[1], p[2], {0}};
  switch (model) {
  case 0:
    break;
  case 8:
    out->model = VT_LENS_FISHEYE; // fall through
  case 2:
    out->k[0] = p[3];
    break;
  case 9:
    out->model = VT_LENS_FISHEYE; // fall through
  case 3:
    out->k[0] = p[3], out->k[1] = p[4];
    break;
  default:
    out->fy = p[1], out->cx = p[2], out->cy = p[3];
    for (int i = 4; i < camera_models[model].parameter_count && i < 12; i++) out->k[i - 4] = p[i];
    if (model == 5) out->model = VT_LENS_FISHEYE;
  }
  if (vt_lens_is_pinhole(out)) out->model = VT_LENS_PINHOLE;
  return VT_OK;
}

static vt_status add_camera(reader *r, uint32_t id, int model, double width, double height, const double *parameters) {
  camera *bigger = grow(r, r->cameras, r->camera_count, &r->camera_capacity, sizeof *bigger);
  if (!bigger) return VT_OUT_OF_MEMORY;
  r->cameras = bigger;
  camera *c = &r->cameras[r->camera_count++];
  *c = (camera){.id = id, .model = model};
  return camera_models[model].usable ? make_lens(r, model, width, height, parameters, &c->lens) : VT_OK;
}

// q: QW QX QY QZ TX TY TZ. False if that is no pose.
static bool make_pose(const double q[7], pose *out) {
  double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int i = 0; i < 7; i++)
    if (!isfinite(q[i])) return false;
  if (!(norm > 1e-6 && norm < 1e6)) return false;
  double w = q[0] / norm, x = q[1] / norm, y = q[2] / norm, z = q[3] / norm;
  out->rotation = (vt_mat3){{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
                             1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
                             1 - 2 * (x * x + y * y)}};
  out->translation = vt_v3(q[4], q[5], q[6]);
  return true;
}

static vt_status read_rigs(reader *r, vt_colmap_model *model);

// The pose of an image that has none of its own, by its frame and rig. *found is false if they do not say it either.
static vt_status pose_by_rig(reader *r, vt_colmap_model *model, uint64_t image, uint32_t camera_id, pose *out, bool *found) {
  vt_status status = r->asked_rigs ? VT_OK : read_rigs(r, model);
  const frame_image *frame = NULL;
  const rig_camera *member = NULL;
  for (int i = 0; i < r->frame_image_count && !status && !frame; i++)
    if (r->frame_images[i].image == image) frame = &r->frame_images[i];
  for (int i = 0; i < r->rig_camera_count && frame && !member; i++)
    if (r->rig_cameras[i].rig == frame->rig && r->rig_cameras[i].camera == camera_id) member = &r->rig_cameras[i];
  *found = member != NULL;
  if (!member) return status;
  const double *a = member->from_rig.rotation.m, *b = frame->from_world.rotation.m;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      out->rotation.m[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  out->translation = vt_add(vt_mul(&member->from_rig.rotation, frame->from_world.translation), member->from_rig.translation);
  return VT_OK;
}

// `q` holds QW QX QY QZ TX TY TZ. An image that nobody gives a pose is left out where there are frames: not registered.
static vt_status add_image(reader *r, vt_colmap_model *model, double id, const double q[7], double camera_id,
                           const char *name) {
  if (!*name) return damaged(r, "an image has no name");
  const camera *found = NULL;
  for (int i = 0; i < r->camera_count && !found; i++)
    if (r->cameras[i].id == camera_id) found = &r->cameras[i];
  if (!found) return damaged(r, "an image has a camera that is not in cameras");
  pose own = {0};
  bool posed = make_pose(q, &own);
  vt_status status = posed || !(id >= 0 && id < 1e15) ? VT_OK : pose_by_rig(r, model, (uint64_t)id, found->id, &own, &posed);
  if (status) return status;
  if (!posed)
    return r->frame_image_count ? VT_OK : damaged(r, "a pose has NaN or a quaternion of no length, and no frames say it");
  if (!camera_models[found->model].usable)
    return vt_fail(
        r->context, VT_BAD_INPUT,
        "%s: %s has the camera model %s, which is not read; run colmap image_undistorter and give its output "
        "folder",
        r->path, name, camera_models[found->model].name);
  vt_colmap_image *bigger = grow(r, model->items, model->count, &r->image_capacity, sizeof *bigger);
  if (!bigger) return VT_OUT_OF_MEMORY;
  model->items = bigger;
  vt_colmap_image *image = &model->items[model->count];
  *image = (vt_colmap_image){vt_strdup(r->context, name), found->lens, own.rotation, own.translation};
  if (!image->name) return VT_OUT_OF_MEMORY;
  model->count++;
  return VT_OK;
}

static vt_status add_rig_camera(reader *r, double rig, double camera_id, const double *q_or_null) {
  rig_camera one = {(uint32_t)rig, (uint32_t)camera_id, {{{1, 0, 0, 0, 1, 0, 0, 0, 1}}, {0, 0, 0}}};
  if (!(rig >= 0 && rig <= UINT32_MAX && camera_id >= 0 && camera_id <= UINT32_MAX)) return damaged(r, "a rig has no number");
  if (q_or_null && !make_pose(q_or_null, &one.from_rig)) return damaged(r, "a camera's pose in its rig makes no sense");
  rig_camera *bigger = grow(r, r->rig_cameras, r->rig_camera_count, &r->rig_camera_capacity, sizeof one);
  if (!bigger) return VT_OUT_OF_MEMORY;
  r->rig_cameras = bigger;
  r->rig_cameras[r->rig_camera_count++] = one;
  return VT_OK;
}

static vt_status add_frame_image(reader *r, double rig, double image, const pose *from_world) {
  if (!(rig >= 0 && rig <= UINT32_MAX && image >= 0 && image < 1e15)) return damaged(r, "a frame has no number");
  frame_image *bigger = grow(r, r->frame_images, r->frame_image_count, &r->frame_image_capacity, sizeof *bigger);
  if (!bigger) return VT_OUT_OF_MEMORY;
  r->frame_images = bigger;
  r->frame_images[r->frame_image_count++] = (frame_image){(uint32_t)rig, (uint64_t)image, *from_world};
  return VT_OK;
}

// ---- binary

static vt_status read_cameras_binary(reader *r, vt_colmap_model *model) {
  (void)model;
  uint64_t count = vt_take(&r->in, 8);
  for (uint64_t n = 0; n < count && !r->in.short_read; n++) {
    double parameters[16] = {0};
    uint32_t id = (uint32_t)vt_take(&r->in, 4), kind = (uint32_t)vt_take(&r->in, 4);
    double width = (double)vt_take(&r->in, 8), height = (double)vt_take(&r->in, 8);
    if (r->in.short_read) break;
    if (kind >= (uint32_t)MODEL_COUNT) // its length is not known, so nothing behind it can be read
      return vt_fail(
          r->context, VT_BAD_INPUT,
          "%s: camera %u has a model of number %u, which is not known; run colmap image_undistorter and give "
          "its output folder",
          r->path, id, kind);
    for (int i = 0; i < camera_models[kind].parameter_count; i++) parameters[i] = vt_take_double(&r->in);
    if (r->in.short_read) break;
    vt_status status = add_camera(r, id, (int)kind, width, height, parameters);
    if (status) return status;
  }
  return r->in.short_read ? damaged(r, "it ends too early") : VT_OK;
}

static vt_status read_images_binary(reader *r, vt_colmap_model *model) {
  uint64_t count = vt_take(&r->in, 8);
  for (uint64_t n = 0; n < count && !r->in.short_read; n++) {
    double q[7], id = (double)vt_take(&r->in, 4);
    for (int i = 0; i < 7; i++) q[i] = vt_take_double(&r->in);
    double camera_id = (double)vt_take(&r->in, 4);
    const char *name = vt_take_name(&r->in);
    if (!name) return damaged(r, "it ends too early");
    vt_pass(&r->in, vt_take(&r->in, 8), 24); // the keypoints: x, y, point
    if (r->in.short_read) break;
    vt_status status = add_image(r, model, id, q, camera_id, name);
    if (status) return status;
  }
  return r->in.short_read ? damaged(r, "it ends too early") : VT_OK;
}

// The mean over points, as COLMAP's model_analyzer says it.
static vt_status read_points_binary(reader *r, vt_colmap_model *model) {
  uint64_t count = vt_take(&r->in, 8), measured = 0;
  double sum = 0;
  for (uint64_t n = 0; n < count && !r->in.short_read; n++) {
    vt_pass(&r->in, 35, 1); // id, position, colour
    double error = vt_take_double(&r->in);
    vt_pass(&r->in, vt_take(&r->in, 8), 8); // the track: image, keypoint
    if (isfinite(error) && error >= 0) sum += error, measured++;
  }
  if (r->in.short_read) return damaged(r, "it ends too early");
  model->reprojection_error = measured ? sum / (double)measured : NAN;
  return VT_OK;
}

enum { CAMERA_SENSOR = 0 }; // COLMAP's number of the kind of sensor that is a camera

static vt_status read_rigs_binary(reader *r, vt_colmap_model *model) {
  (void)model;
  uint64_t count = vt_take(&r->in, 8);
  for (uint64_t n = 0; n < count && !r->in.short_read; n++) {
    double rig = (double)vt_take(&r->in, 4), q[7];
    uint64_t sensors = vt_take(&r->in, 4);
    for (uint64_t i = 0; i < sensors && !r->in.short_read; i++) {
      uint64_t kind = vt_take(&r->in, 4);
      double id = (double)vt_take(&r->in, 4);
      bool posed = i == 0 || vt_take(&r->in, 1) != 0;
      for (int j = 0; i > 0 && posed && j < 7; j++) q[j] = vt_take_double(&r->in);
      if (r->in.short_read || kind != CAMERA_SENSOR || !posed) continue;
      vt_status status = add_rig_camera(r, rig, id, i ? q : NULL);
      if (status) return status;
    }
  }
  return r->in.short_read ? damaged(r, "it ends too early") : VT_OK;
}

static vt_status read_frames_binary(reader *r, vt_colmap_model *model) {
  (void)model;
  uint64_t count = vt_take(&r->in, 8);
  for (uint64_t n = 0; n < count && !r->in.short_read; n++) {
    double q[7], rig;
    pose from_world = {0};
    (void)vt_take(&r->in, 4); // the frame's id
    rig = (double)vt_take(&r->in, 4);
    for (int i = 0; i < 7; i++) q[i] = vt_take_double(&r->in);
    bool posed = make_pose(q, &from_world);
    uint64_t data = vt_take(&r->in, 4);
    for (uint64_t i = 0; i < data && !r->in.short_read; i++) {
      uint64_t kind = vt_take(&r->in, 4);
      (void)vt_take(&r->in, 4); // the camera, which the image says too
      double image = (double)vt_take(&r->in, 8);
      if (r->in.short_read || kind != CAMERA_SENSOR || !posed) continue;
      vt_status status = add_frame_image(r, rig, image, &from_world);
      if (status) return status;
    }
  }
  return r->in.short_read ? damaged(r, "it ends too early") : VT_OK;
}

// ---- text

static vt_status read_cameras_text(reader *r, vt_colmap_model *model) {
  (void)model;
  for (char *line; (line = vt_take_data_line(&r->in));) {
    double id, size[2], parameters[16] = {0};
    char name[40] = "";
    int kind = 0;
    if (!vt_take_numbers(&line, 1, &id) || !(id >= 0 && id <= UINT32_MAX)) return damaged(r, "a camera has no number");
    size_t length = strcspn(line, " \t");
    memcpy(name, line, length < sizeof name ? length : sizeof name - 1);
    line += length;
    line += strspn(line, " \t");
    while (kind < MODEL_COUNT && strcmp(name, camera_models[kind].name)) kind++;
    if (kind == MODEL_COUNT)
      return vt_fail(
          r->context, VT_BAD_INPUT,
          "%s: the camera model \"%s\" is not known; run colmap image_undistorter and give its output folder", r->path,
          name);
    if (!vt_take_numbers(&line, 2, size) || !vt_take_numbers(&line, camera_models[kind].parameter_count, parameters))
      return damaged(r, "a camera has too few parameters");
    vt_status status = add_camera(r, (uint32_t)id, kind, size[0], size[1], parameters);
    if (status) return status;
  }
  return VT_OK;
}

// A line behind each image lists its keypoints and may be empty; files without these lines would be misread silently.
static bool is_keypoint_line(const char *line) {
  size_t words = 0;
  for (const char *p = line; *p; words++) {
    p += strcspn(p, " \t");
    p += strspn(p, " \t");
  }
  return words % 3 == 0;
}

static vt_status read_images_text(reader *r, vt_colmap_model *model) {
  for (char *line; (line = vt_take_data_line(&r->in));) {
    double numbers[9]; // IMAGE_ID, QW QX QY QZ TX TY TZ, CAMERA_ID
    if (!vt_take_numbers(&line, 9, numbers)) return damaged(r, "an image's line has too few numbers");
    vt_status status = add_image(r, model, numbers[0], numbers + 1, numbers[8], line);
    if (status) return status;
    line = vt_take_line(&r->in);
    if (line && !is_keypoint_line(line)) return damaged(r, "an image's line of keypoints (it may be empty) is missing");
  }
  return VT_OK;
}

static vt_status read_points_text(reader *r, vt_colmap_model *model) {
  double sum = 0;
  long measured = 0;
  for (char *line; (line = vt_take_data_line(&r->in));) {
    double numbers[8]; // POINT3D_ID, X Y Z, R G B, ERROR
    if (!vt_take_numbers(&line, 8, numbers)) return damaged(r, "a point has too few numbers");
    if (isfinite(numbers[7]) && numbers[7] >= 0) sum += numbers[7], measured++;
  }
  model->reprojection_error = measured ? sum / (double)measured : NAN;
  return VT_OK;
}

static bool take_word(char **text, char *out, size_t size) { // true if it fits and is not empty
  size_t length = strcspn(*text, " \t");
  bool fits = length > 0 && length < size;
  if (fits) memcpy(out, *text, length);
  out[fits ? length : 0] = 0;
  *text += length;
  *text += strspn(*text, " \t");
  return fits;
}

static vt_status read_rigs_text(reader *r, vt_colmap_model *model) {
  (void)model;
  for (char *line; (line = vt_take_data_line(&r->in));) {
    double head[2], id, posed = 1, q[7]; // RIG_ID, NUM_SENSORS, then TYPE ID [HAS_POSE [pose]] of each
    if (!vt_take_numbers(&line, 2, head)) return damaged(r, "a rig has no number");
    for (int i = 0; i < head[1]; i++) {
      char kind[32];
      if (!take_word(&line, kind, sizeof kind) || !vt_take_numbers(&line, 1, &id) || (i && !vt_take_numbers(&line, 1, &posed)) ||
          (i && posed != 0 && !vt_take_numbers(&line, 7, q)))
        return damaged(r, "a rig has fewer cameras than it says");
      vt_status status = strcmp(kind, "CAMERA") || posed == 0 ? VT_OK : add_rig_camera(r, head[0], id, i ? q : NULL);
      if (status) return status;
    }
  }
  return VT_OK;
}

static vt_status read_frames_text(reader *r, vt_colmap_model *model) {
  (void)model;
  for (char *line; (line = vt_take_data_line(&r->in));) {
    double head[10], ids[2]; // FRAME_ID, RIG_ID, pose, NUM_DATA_IDS, then TYPE SENSOR_ID DATA_ID of each
    pose from_world;
    if (!vt_take_numbers(&line, 10, head)) return damaged(r, "a frame's line has too few numbers");
    bool posed = make_pose(head + 2, &from_world);
    for (int i = 0; i < head[9]; i++) {
      char kind[32];
      if (!take_word(&line, kind, sizeof kind) || !vt_take_numbers(&line, 2, ids))
        return damaged(r, "a frame has fewer images than it says");
      vt_status status = strcmp(kind, "CAMERA") || !posed ? VT_OK : add_frame_image(r, head[1], ids[1], &from_world);
      if (status) return status;
    }
  }
  return VT_OK;
}

// ---- the folder

// Path of folder/NAME.bin or .txt if that is a file, else NULL.
static char *model_file(vt_context *context, const char *folder, const char *name, bool binary) {
  char whole[32];
  snprintf(whole, sizeof whole, "%s.%s", name, binary ? "bin" : "txt");
  char *path = vt_join(context, folder, whole);
  if (path && vt_is_file(path)) return path;
  vt_free(context, path);
  return NULL;
}

static bool has_model(vt_context *context, const char *folder, bool binary) {
  char *cameras = model_file(context, folder, "cameras", binary),
       *images = model_file(context, folder, "images", binary);
  bool both = cameras && images;
  vt_free(context, cameras);
  vt_free(context, images);
  return both;
}

bool vt_is_colmap_model(vt_context *context, const char *folder) {
  return has_model(context, folder, true) || has_model(context, folder, false);
}

static vt_status read_part(reader *r, const char *folder, const char *name,
                           vt_status (*read)(reader *, vt_colmap_model *), vt_colmap_model *model) {
  r->path = model_file(r->context, folder, name, r->binary);
  if (!r->path) return VT_OK; // cameras and images are there, the others may be absent
  vt_status status = vt_read_file(r->context, r->path, &r->in.bytes, &r->in.size);
  r->in.at = 0;
  r->in.short_read = false;
  if (!status) status = read(r, model);
  vt_free(r->context, r->in.bytes);
  vt_free(r->context, r->path);
  r->in.bytes = NULL;
  r->path = NULL;
  return status;
}

// In the middle of images: a reader of its own for the two files.
static vt_status read_rigs(reader *r, vt_colmap_model *model) {
  reader inner = {.context = r->context, .binary = r->binary, .folder = r->folder};
  vt_status status = read_part(&inner, r->folder, "rigs", r->binary ? read_rigs_binary : read_rigs_text, model);
  if (!status) status = read_part(&inner, r->folder, "frames", r->binary ? read_frames_binary : read_frames_text, model);
  r->asked_rigs = true;
  r->rig_cameras = inner.rig_cameras;
  r->rig_camera_count = inner.rig_camera_count;
  r->frame_images = inner.frame_images;
  r->frame_image_count = inner.frame_image_count;
  return status;
}

static int compare_names(const void *a, const void *b) {
  return strcmp(((const vt_colmap_image *)a)->name, ((const vt_colmap_image *)b)->name);
}

// The points once more, with who sees them: only now the images have their places.
static vt_status read_landmarks(reader *r, vt_colmap_model *model) {
  const char **names = VT_NEW(r->context, const char *, (size_t)model->count);
  if (!names) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < model->count; i++) names[i] = model->items[i].name;
  vt_status status = vt_read_landmarks(r->context, r->folder, r->binary, names, model->count, &model->landmarks);
  vt_free(r->context, names);
  return status;
}

vt_status vt_read_colmap_model(vt_context *context, const char *folder, vt_colmap_model *out) {
  *out = (vt_colmap_model){.reprojection_error = NAN};
  reader r = {.context = context, .binary = has_model(context, folder, true), .folder = folder};
  if (!r.binary && !has_model(context, folder, false))
    return vt_fail(context, VT_BAD_INPUT, "%s: no COLMAP model; cameras and images must be there, as .bin or as .txt",
                   folder);
  vt_status status = read_part(&r, folder, "cameras", r.binary ? read_cameras_binary : read_cameras_text, out);
  if (!status) status = read_part(&r, folder, "images", r.binary ? read_images_binary : read_images_text, out);
  if (!status) status = read_part(&r, folder, "points3D", r.binary ? read_points_binary : read_points_text, out);
  vt_free(context, r.cameras);
  vt_free(context, r.rig_cameras);
  vt_free(context, r.frame_images);
  if (!status && !out->count)
    status = vt_fail(context, VT_BAD_INPUT, "%s: a COLMAP model without images; calibrate again", folder);
  if (!status) qsort(out->items, (size_t)out->count, sizeof *out->items, compare_names);
  for (int i = 1; i < out->count && !status; i++)
    if (!strcmp(out->items[i - 1].name, out->items[i].name))
      status = vt_fail(context, VT_BAD_INPUT, "%s: the image %s is there twice; calibrate again", folder,
                       out->items[i].name);
  if (!status) status = read_landmarks(&r, out);
  if (status) vt_free_colmap_model(context, out);
  return status;
}

void vt_free_colmap_model(vt_context *context, vt_colmap_model *model) {
  for (int i = 0; i < model->count; i++) vt_free(context, model->items[i].name);
  vt_free(context, model->items);
  vt_free_landmarks(context, &model->landmarks);
  *model = (vt_colmap_model){.reprojection_error = NAN};
}
