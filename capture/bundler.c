// bundler.c - reading cameras of Bundler, and projection matrices
// SPDX-License-Identifier: BSD-3-Clause
//
// Bundler [Snavely et al. 2006] writes per camera f k1 k2, R and t, in the order of list.txt. Its cameras have y up and look
// along -z, its pixels count from the middle of the picture with y up:
//   p = -P_xy / P_z,   pixel = f (1 + k1 |p|^2 + k2 |p|^4) p
// With S = diag(1, -1, -1) our pose is (S R, S t), the centre w/2, h/2, and k1, k2 are the same coefficients.
//
// Twelve numbers are a projection P = K [R | t] up to a factor (PMVS, the sets of Oxford's VGG): the left 3x3 block is split
// into an upper triangle K and a rotation by Gram and Schmidt from the last row on; K's skew is left out if it is below a
// thousandth of the focal length, else the matrix is refused. Pixels are meant with the first one's centre at (0.5, 0.5).

#include "capture/bundler.h"

#include <stdlib.h>
#include <string.h>

// Numbers of a text, one after another.
typedef struct numbers {
  const char *at;
  bool failed;
} numbers;

static double take(numbers *n) {
  char *end;
  double value = strtod(n->at, &end);
  if (end == n->at || !isfinite(value)) n->failed = true;
  n->at = end;
  return n->failed ? 0 : value;
}

static vt_status read_text(vt_context *context, const char *path, char **out) {
  uint8_t *bytes = NULL;
  size_t size = 0;
  vt_status status = vt_read_file(context, path, &bytes, &size);
  *out = (char *)bytes; // a zero stands behind
  return status;
}

static char *folder_of(vt_context *context, const char *path) {
  char *folder = vt_strdup(context, path), *slash = folder ? strrchr(folder, '/') : NULL;
  if (slash)
    slash[slash == folder] = 0;
  else if (folder)
    folder[0] = 0;
  return folder;
}

// ---- Bundler

static vt_status add_bundler_camera(vt_context *context, numbers *n, const char *folder, const char *name, const char *where,
                                    vt_photos *photos, vt_capture_report *report) {
  double f = take(n), k1 = take(n), k2 = take(n), r[9], t[3];
  for (int i = 0; i < 9; i++) r[i] = take(n);
  for (int i = 0; i < 3; i++) t[i] = take(n);
  if (n->failed) return vt_fail(context, VT_BAD_INPUT, "%s: a camera has too few numbers; copy it again", where);
  report->photograph_count++;
  if (!(f > 0)) return vt_leave_out(context, report, name, "Bundler found no camera; it shows too little of what the others show");
  char *path = vt_join(context, folder, name);
  vt_photo *photo = path ? vt_add_photo(context, photos, name, path) : NULL;
  vt_free(context, path);
  if (!photo) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < 9; i++) photo->rotation.m[i] = i < 3 ? r[i] : -r[i];
  photo->translation = vt_v3(t[0], -t[1], -t[2]);
  vt_status status = vt_fit_photo(context, photo, where);
  if (status) return status;
  vt_lens lens = {VT_LENS_OPENCV, photo->width, photo->height, f, f, 0.5 * photo->width, 0.5 * photo->height, {k1, k2}};
  if (vt_lens_is_pinhole(&lens)) lens.model = VT_LENS_PINHOLE;
  photo->lens = lens;
  return VT_OK;
}

// The next line's first word, cut out. NULL at the end.
static char *take_name(char **text) {
  for (;;) {
    char *line = *text + strspn(*text, " \t\r\n");
    if (!*line) return NULL;
    size_t length = strcspn(line, "\r\n"), word = strcspn(line, " \t\r\n");
    *text = line + length + (line[length] != 0);
    line[word] = 0;
    if (*line != '#') return line[0] == '.' && line[1] == '/' ? line + 2 : line;
  }
}

vt_status vt_read_bundler(vt_context *context, const char *path, vt_photos *photos, vt_capture_report *report) {
  char *folder = folder_of(context, path), *list_path = folder ? vt_join(context, folder, "list.txt") : NULL;
  char *text = NULL, *list = NULL;
  vt_status status = list_path ? read_text(context, path, &text) : VT_OUT_OF_MEMORY;
  if (!status && !vt_is_file(list_path))
    status = vt_fail(context, VT_BAD_INPUT, "%s: %s, which names the photographs, is missing; put it beside it", path, list_path);
  if (!status) status = read_text(context, list_path, &list);
  if (!status) {
    numbers n = {.at = text};
    char *rest = list;
    if (*n.at == '#') n.at += strcspn(n.at, "\n");
    double count = take(&n);
    (void)take(&n); // points
    if (n.failed || !(count >= 1 && count <= 1e6) || count != floor(count))
      status = vt_fail(context, VT_BAD_INPUT, "%s: is no Bundler file with cameras; give bundle.out", path);
    for (int i = 0; i < count && !status; i++) {
      char *name = take_name(&rest);
      status = name ? add_bundler_camera(context, &n, folder, name, path, photos, report)
                    : vt_fail(context, VT_BAD_INPUT, "%s: %d cameras, and only %d photographs in %s; they belong to different runs",
                              path, (int)count, i, list_path);
    }
  }
  vt_free(context, text);
  vt_free(context, list);
  vt_free(context, list_path);
  vt_free(context, folder);
  return status;
}

// ---- projections

bool vt_split_projection(const double p[12], vt_lens *lens, vt_mat3 *rotation, vt_vec3 *translation) {
  vt_vec3 a = vt_v3(p[0], p[1], p[2]), b = vt_v3(p[4], p[5], p[6]), c = vt_v3(p[8], p[9], p[10]);
  double size = vt_length(c), determinant = vt_dot(a, vt_cross(b, c));
  if (!(size > 0) || !isfinite(determinant) || !(fabs(determinant) > 1e-12 * vt_length(a) * vt_length(b) * size)) return false;
  double scale = (determinant > 0 ? 1 : -1) / size; // K[2][2] is 1, and rotations have determinant 1
  vt_vec3 z = vt_scale(c, scale);
  a = vt_scale(a, scale), b = vt_scale(b, scale);
  double cx = vt_dot(a, z), cy = vt_dot(b, z);
  vt_vec3 down = vt_sub(b, vt_scale(z, cy));
  double fy = vt_length(down);
  if (!(fy > 0)) return false;
  vt_vec3 y = vt_scale(down, 1 / fy);
  double skew = vt_dot(a, y);
  vt_vec3 across = vt_sub(vt_sub(a, vt_scale(z, cx)), vt_scale(y, skew));
  double fx = vt_length(across);
  if (!(fx > 0) || fabs(skew) > 1e-3 * fx) return false;
  vt_vec3 x = vt_scale(across, 1 / fx);
  *rotation = (vt_mat3){{x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z}};
  double tz = scale * p[11], ty = (scale * p[7] - cy * tz) / fy, tx = (scale * p[3] - cx * tz - skew * ty) / fx;
  *translation = vt_v3(tx, ty, tz);
  *lens = (vt_lens){.model = VT_LENS_PINHOLE, .fx = fx, .fy = fy, .cx = cx, .cy = cy};
  return vt_dot(vt_cross(x, y), z) > 0; // else the matrix is mirrored
}

// The file of a photograph's matrix; NULL if there is none or no memory.
static char *projection_of(vt_context *context, const char *folder, const char *name) {
  static const char *const places[][2] = {{"", ".P"}, {"", ".txt"}, {"txt/", ".txt"}, {"../txt/", ".txt"}};
  char *stem = vt_without_ending(context, name), *found = NULL;
  for (size_t i = 0; stem && !found && i < sizeof places / sizeof places[0]; i++) {
    char *inner = vt_concat(context, places[i][0], stem, places[i][1]), *path = inner ? vt_join(context, folder, inner) : NULL;
    if (path && vt_is_file(path))
      found = path;
    else
      vt_free(context, path);
    vt_free(context, inner);
  }
  vt_free(context, stem);
  return found;
}

// Twelve numbers and nothing else. False if the text is another.
static bool parse_projection(const char *text, double p[12]) {
  numbers n = {.at = text + strspn(text, " \t\r\n")};
  if (!strncmp(n.at, "CONTOUR", 7)) n.at += 7;
  for (int i = 0; i < 12; i++) p[i] = take(&n);
  return !n.failed && !n.at[strspn(n.at, " \t\r\n")];
}

bool vt_has_projections(vt_context *context, const char *folder, const vt_names *names) {
  bool found = false;
  for (int i = 0; i < names->count && !found; i++) {
    char *path = projection_of(context, folder, names->items[i]), *text = NULL;
    double p[12];
    found = path && !read_text(context, path, &text) && parse_projection(text, p);
    vt_free(context, text);
    vt_free(context, path);
  }
  return found;
}

static vt_status add_projection(vt_context *context, const char *folder, const char *name, const char *path, vt_photos *photos) {
  char *text = NULL, *file = vt_join(context, folder, name);
  double p[12];
  vt_lens lens = {0};
  vt_photo *photo = file ? vt_add_photo(context, photos, name, file) : NULL;
  vt_status status = photo ? read_text(context, path, &text) : VT_OUT_OF_MEMORY;
  if (!status && !parse_projection(text, p))
    status = vt_fail(context, VT_BAD_INPUT, "%s: is not twelve numbers, the rows of a 3x4 matrix; correct it, or take it away", path);
  if (!status && !vt_split_projection(p, &lens, &photo->rotation, &photo->translation))
    status = vt_fail(context, VT_BAD_INPUT,
                     "%s: no camera has this matrix (singular, mirrored, or with slanted pixels); export it again", path);
  if (!status) status = vt_fit_photo(context, photo, path);
  if (!status) {
    lens.width = photo->width, lens.height = photo->height;
    photo->lens = lens;
  }
  vt_free(context, text);
  vt_free(context, file);
  return status;
}

vt_status vt_read_projections(vt_context *context, const char *folder, const vt_names *names, vt_photos *photos,
                              vt_capture_report *report) {
  vt_status status = VT_OK;
  report->photograph_count = names->count;
  for (int i = 0; i < names->count && !status; i++) {
    char *path = projection_of(context, folder, names->items[i]);
    status = path ? add_projection(context, folder, names->items[i], path, photos)
                  : vt_leave_out(context, report, names->items[i], "no projection matrix, which the others have");
    vt_free(context, path);
  }
  return status;
}
