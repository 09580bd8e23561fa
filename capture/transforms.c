// transforms.c - reading transforms.json of NeRF, instant-ngp and nerfstudio
// SPDX-License-Identifier: BSD-3-Clause
//
// Three programs write files of this name; they differ in where the lens stands:
//   NeRF          one camera_angle_x for all, f = w / (2 tan(camera_angle_x / 2)), square pixels, centre w/2, h/2;
//                 file_path without ending
//   instant-ngp   fl_x fl_y cx cy w h k1 k2 p1 p2, is_fisheye, for all frames or in each
//   nerfstudio    the same with camera_model, k3, k4, mask_path, test_filenames
// What a frame says goes before what the file says. w and h that are not the picture's scale the lens (photos.c).
//
// transform_matrix is world_from_camera with OpenGL axes (y up, looking along -z). With M = (A | c) its upper three
// rows and S = diag(1, -1, -1):  cam_from_world rotation R = (A S)^T,  translation t = -R c.  Scene scaling by some
// exporters leaves A = s Q with a rotation Q; exporters that round to six digits leave it slightly sheared. A is
// therefore replaced by its nearest rotation (the polar factor, by Newton's iteration Q <- (Q + Q^-T) / 2; Higham
// 1986), so that what we write and read again is the same camera; a matrix that is far from every rotation is refused.
//
// cx and cy are continuous pixels, the first pixel's centre at (0.5, 0.5), as COLMAP has them and cx = w/2 says.

#include "capture/transforms.h"
#include "base/file.h"
#include "base/json.h"

#include <string.h>

typedef struct frame_source {
  const vt_json *frame, *root;
  const char *where; // "file: frame 3 (name)"
} frame_source;

static const vt_json *find(const frame_source *s, const char *key) {
  const vt_json *value = vt_json_member(s->frame, key);
  return value ? value : vt_json_member(s->root, key);
}

static vt_status get_number(vt_context *context, const frame_source *s, const char *key, double *inout) {
  const vt_json *value = find(s, key);
  if (!value) return VT_OK;
  *inout = vt_json_number(value, NAN);
  if (isfinite(*inout)) return VT_OK;
  return vt_fail(context, VT_BAD_INPUT, "%s: %s is no number; export the cameras again", s->where, key);
}

static vt_status read_size(vt_context *context, const frame_source *s, vt_lens *lens) {
  double w = 0, h = 0;
  vt_status status = get_number(context, s, "w", &w);
  if (!status) status = get_number(context, s, "h", &h);
  if (status || (w == 0 && h == 0)) return status;
  if (w < 1 || h < 1 || w > 65535 || h > 65535)
    return vt_fail(context, VT_BAD_INPUT, "%s: w and h (%g x %g) are no picture size; write both, in pixels", s->where,
                   w, h);
  lens->width = (int)lround(w);
  lens->height = (int)lround(h);
  return VT_OK;
}

// The focal length along one axis: of the frame if it says one in either way, else of the file. 0 if nobody does.
static vt_status read_focal(vt_context *context, const frame_source *s, const char *key, const char *angle_key,
                            int size, double *out) {
  const vt_json *owner = s->frame;
  if (!vt_json_member(owner, key) && !vt_json_member(owner, angle_key)) owner = s->root;
  frame_source only = {owner, owner, s->where};
  double angle = 0;
  *out = 0;
  vt_status status = get_number(context, &only, key, out);
  if (status || *out > 0) return status;
  if (vt_json_member(owner, key))
    return vt_fail(context, VT_BAD_INPUT, "%s: %s is %g, a focal length is above 0; export the cameras again", s->where,
                   key, *out);
  status = get_number(context, &only, angle_key, &angle);
  if (status || !vt_json_member(owner, angle_key)) return status;
  if (!(angle > 0 && angle < VT_PI))
    return vt_fail(context, VT_BAD_INPUT, "%s: %s is %g, an angle of view is between 0 and pi; it must be in radians",
                   s->where, angle_key, angle);
  *out = 0.5 * size / tan(0.5 * angle);
  return VT_OK;
}

static vt_status read_model(vt_context *context, const frame_source *s, vt_lens *lens) {
  static const char *const plain[] = {"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE"};
  const vt_json *value = find(s, "camera_model");
  const char *name = vt_json_string(value, value ? "" : "OPENCV");
  bool known = false;
  for (size_t i = 0; i < sizeof plain / sizeof plain[0]; i++) known = known || !strcmp(name, plain[i]);
  lens->model = VT_LENS_OPENCV;
  if (!strcmp(name, "OPENCV_FISHEYE") || vt_json_bool(find(s, "is_fisheye"), false)) lens->model = VT_LENS_FISHEYE;
  if (known || lens->model == VT_LENS_FISHEYE) return VT_OK;
  return vt_fail(
      context, VT_BAD_INPUT,
      "%s: the camera_model \"%s\" is not known; undistort the pictures to PINHOLE, OPENCV or OPENCV_FISHEYE", s->where,
      name);
}

static vt_status read_distortion(vt_context *context, const frame_source *s, vt_lens *lens) {
  static const char *const opencv[] = {"k1", "k2", "p1", "p2", "k3"}, *const fisheye[] = {"k1", "k2", "k3", "k4"};
  bool is_fisheye = lens->model == VT_LENS_FISHEYE;
  const char *const *keys = is_fisheye ? fisheye : opencv;
  int count = is_fisheye ? 4 : 5;
  for (int i = 0; i < count; i++) {
    vt_status status = get_number(context, s, keys[i], &lens->k[i]);
    if (status) return status;
  }
  vt_status status = is_fisheye ? VT_OK : get_number(context, s, "k4", &lens->k[8]); // of r^8; OpenCV's k4 is another
  if (!status && vt_lens_is_pinhole(lens)) lens->model = VT_LENS_PINHOLE;
  return status;
}

// The lens as the source says it, for a picture of lens->width x lens->height.
static vt_status read_lens(vt_context *context, const frame_source *s, vt_lens *lens) {
  vt_status status = read_focal(context, s, "fl_x", "camera_angle_x", lens->width, &lens->fx);
  if (!status) status = read_focal(context, s, "fl_y", "camera_angle_y", lens->height, &lens->fy);
  if (status) return status;
  if (!(lens->fx > 0)) lens->fx = lens->fy;
  if (!(lens->fy > 0)) lens->fy = lens->fx;
  if (!(lens->fx > 0))
    return vt_fail(context, VT_BAD_INPUT, "%s: no focal length; write fl_x (pixels) or camera_angle_x (radians)",
                   s->where);
  lens->cx = 0.5 * lens->width;
  lens->cy = 0.5 * lens->height;
  status = get_number(context, s, "cx", &lens->cx);
  if (!status) status = get_number(context, s, "cy", &lens->cy);
  if (!status) status = read_model(context, s, lens);
  return status ? status : read_distortion(context, s, lens);
}

static double invert_transposed(const double a[9], double out[9]) { // returns the determinant; out is garbage if 0
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int r = (i + 1) % 3, q = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      out[3 * i + j] = a[3 * r + c] * a[3 * q + d] - a[3 * r + d] * a[3 * q + c];
    }
  double determinant = a[0] * out[0] + a[1] * out[1] + a[2] * out[2];
  for (int i = 0; i < 9; i++) out[i] /= determinant;
  return determinant;
}

// False if `a` (row-major) is not a rotation times a positive number; else `a` becomes the nearest rotation.
static bool make_rotation(double a[9]) {
  double size = 0, q[9], inverse[9];
  for (int i = 0; i < 9; i++) size = fmax(size, fabs(a[i]));
  if (!(size > 1e-30 && size < 1e30)) return false;
  for (int i = 0; i < 9; i++) a[i] /= size;
  double determinant = invert_transposed(a, inverse);
  if (!(determinant > 1e-6)) return false;
  for (int i = 0; i < 9; i++) q[i] = a[i] /= cbrt(determinant);
  for (int turn = 0; turn < 20; turn++) {
    double change = 0;
    if (!(invert_transposed(q, inverse) > 0)) return false;
    for (int i = 0; i < 9; i++) {
      double next = 0.5 * (q[i] + inverse[i]);
      change = fmax(change, fabs(next - q[i]));
      q[i] = next;
    }
    if (change < 1e-15) break;
  }
  double worst = 0;
  for (int i = 0; i < 9; i++) worst = fmax(worst, fabs(q[i] - a[i]));
  memcpy(a, q, sizeof q);
  return worst < 5e-3;
}

static vt_status read_pose(vt_context *context, const frame_source *s, vt_photo *photo) {
  const vt_json *matrix = vt_json_member(s->frame, "transform_matrix");
  size_t rows = vt_json_count(matrix);
  bool shaped = vt_json_is_array(matrix) && (rows == 3 || rows == 4);
  double m[16] = {[15] = 1};
  for (size_t i = 0; i < rows && shaped; i++) {
    const vt_json *row = vt_json_item(matrix, i);
    shaped = vt_json_is_array(row) && vt_json_count(row) == 4;
    for (size_t j = 0; j < 4 && shaped; j++) {
      m[4 * i + j] = vt_json_number(vt_json_item(row, j), NAN);
      shaped = isfinite(m[4 * i + j]);
    }
  }
  if (!shaped || fabs(m[12]) > 1e-6 || fabs(m[13]) > 1e-6 || fabs(m[14]) > 1e-6 || fabs(m[15] - 1) > 1e-6)
    return vt_fail(context, VT_BAD_INPUT,
                   "%s: transform_matrix is not 4 x 4 numbers with the last row 0 0 0 1; export the cameras again",
                   s->where);
  double a[9] = {m[0], -m[1], -m[2], m[4], -m[5], -m[6], m[8], -m[9], -m[10]};
  if (!make_rotation(a))
    return vt_fail(
        context, VT_BAD_INPUT,
        "%s: transform_matrix is singular, mirrored or sheared, no camera stands like that; export the cameras "
        "again",
        s->where);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) photo->rotation.m[3 * i + j] = a[3 * j + i];
  photo->translation = vt_scale(vt_mul(&photo->rotation, vt_v3(m[3], m[7], m[11])), -1);
  return VT_OK;
}

// The name with the ending that the file has; NeRF leaves the ending out. Free with vt_free; NULL only without memory.
static char *find_picture(vt_context *context, const char *folder, const char *name) {
  static const char *const endings[] = {"",      ".png", ".jpg", ".jpeg", ".PNG", ".JPG",
                                        ".JPEG", ".tif", ".exr", ".webp", ".pam"};
  for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
    char *whole = vt_concat(context, name, endings[i], "");
    char *path = whole ? vt_join(context, folder, whole) : NULL;
    bool found = path && vt_is_file(path);
    vt_free(context, path);
    if (found || !path) return path ? whole : (vt_free(context, whole), NULL);
    vt_free(context, whole);
  }
  return vt_strdup(context, name); // vt_fit_photo says that it is missing
}

// A path out of the file, with forward slashes and without "./" in front.
static char *clean_path(vt_context *context, const char *text) {
  while (text[0] == '.' && (text[1] == '/' || text[1] == '\\'))
    for (text += 2; *text == '/' || *text == '\\';) text++;
  char *out = vt_strdup(context, text);
  for (char *p = out; p && *p; p++)
    if (*p == '\\') *p = '/';
  return out;
}

static bool is_listed(const vt_json *names, const char *name) {
  for (size_t i = 0; i < vt_json_count(names); i++)
    if (!strcmp(vt_json_string(vt_json_item(names, i), ""), name)) return true;
  return false;
}

// A file that a frame may name, in its folder; NULL if it does not.
static vt_status read_path(vt_context *context, const frame_source *s, const char *key, const char *folder, char **out) {
  const vt_json *value = vt_json_member(s->frame, key);
  const char *text = vt_json_string(value, NULL);
  if (!text && (vt_json_is_number(value) || vt_json_count(value)))
    return vt_fail(context, VT_BAD_INPUT, "%s: %s is no text; write the mask's name there, or take it out", s->where, key);
  if (!text) return VT_OK; // null, as some exporters write it
  char *clean = clean_path(context, text);
  *out = clean ? vt_join(context, folder, clean) : NULL;
  vt_free(context, clean);
  return *out ? VT_OK : VT_OUT_OF_MEMORY;
}

static vt_status read_world(vt_context *context, const char *path, const vt_json *root, vt_world *world) {
  const vt_json *up = vt_json_member(root, "up");
  if (up) {
    world->up = vt_v3(vt_json_number(vt_json_item(up, 0), NAN), vt_json_number(vt_json_item(up, 1), NAN),
                      vt_json_number(vt_json_item(up, 2), NAN));
    world->up = vt_normalise(world->up);
    if (!(fabs(vt_length(world->up) - 1) < 1e-6))
      return vt_fail(context, VT_BAD_INPUT, "%s: up is not three numbers that are a direction; correct it, or take it out", path);
  }
  world->estimated = vt_json_bool(vt_json_member(root, "estimated"), false);
  frame_source s = {root, root, path};
  vt_status status = get_number(context, &s, "metres_per_unit", &world->metres_per_unit);
  if (!status) status = get_number(context, &s, "tree_height_metres", &world->tree_height);
  if (!status && (world->metres_per_unit < 0 || world->tree_height < 0))
    status = vt_fail(context, VT_BAD_INPUT, "%s: metres_per_unit and tree_height_metres are above 0; correct them", path);
  return status;
}

static vt_status read_frame(vt_context *context, frame_source *s, const char *path, const char *folder, size_t number,
                            vt_role role, vt_photos *photos) {
  char where[512];
  snprintf(where, sizeof where, "%s: frame %zu", path, number);
  s->where = where;
  const char *text = vt_json_string(vt_json_member(s->frame, "file_path"), "");
  if (!*text) return vt_fail(context, VT_BAD_INPUT, "%s: no file_path; write the picture's name there", where);
  snprintf(where, sizeof where, "%s: frame %zu (%s)", path, number, text);
  char *clean = clean_path(context, text), *name = clean ? find_picture(context, folder, clean) : NULL;
  char *file = name ? vt_join(context, folder, name) : NULL;
  vt_photo *photo = file ? vt_add_photo(context, photos, name, file) : NULL;
  vt_status status = photo ? VT_OK : VT_OUT_OF_MEMORY;
  vt_free(context, clean);
  vt_free(context, name);
  vt_free(context, file);
  if (!status) status = read_path(context, s, "mask_path", folder, &photo->mask);
  if (!status) status = read_path(context, s, "ignore_path", folder, &photo->ignored);
  if (!status && photo->ignored && !vt_is_file(photo->ignored))
    status = vt_fail(context, VT_BAD_INPUT, "%s: the mask %s (ignore_path) is missing; put it there, or take it out", where,
                     photo->ignored);
  if (status) return status;
  photo->role = is_listed(vt_json_member(s->root, "test_filenames"), text) ? VT_TEST : role;
  status = read_pose(context, s, photo);
  if (!status) status = read_size(context, s, &photo->lens);
  bool sized = photo->lens.width > 0;
  if (!status && !sized) status = vt_fit_photo(context, photo, where); // the file's size is the camera's
  if (!status) status = read_lens(context, s, &photo->lens);
  if (!status && sized) status = vt_fit_photo(context, photo, where);
  return status;
}

vt_status vt_read_transforms(vt_context *context, const char *path, vt_role role, vt_photos *photos) {
  vt_json *root = NULL;
  vt_status status = vt_read_json(context, path, &root);
  if (status) return status;
  char *folder = vt_strdup(context, path);
  if (!folder) status = VT_OUT_OF_MEMORY;
  if (folder) {
    char *slash = strrchr(folder, '/');
    if (slash)
      slash[slash == folder] = 0;
    else
      folder[0] = 0;
  }
  const vt_json *frames = vt_json_member(root, "frames");
  size_t count = vt_json_is_array(frames) ? vt_json_count(frames) : 0;
  if (!status && (count == 0 || count > 1000000))
    status = vt_fail(context, VT_BAD_INPUT, "%s: no \"frames\" with cameras in it; export the cameras again", path);
  if (!status) status = read_world(context, path, root, &photos->world);
  for (size_t i = 0; i < count && !status; i++) {
    frame_source s = {vt_json_item(frames, i), root, NULL};
    status = read_frame(context, &s, path, folder, i, role, photos);
  }
  vt_free(context, folder);
  vt_free_json(context, root);
  return status;
}
