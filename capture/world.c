// world.c - which way is up, and how long a unit is
// SPDX-License-Identifier: BSD-3-Clause
//
// A calibration knows the world up to a turn and a scale. Up is taken from how people hold cameras. Two things are measured:
//   level   the rows of pictures are level, so up is at right angles to all of them: the direction n with the least
//           sum (n . x_i)^2 over the cameras' x axes, whatever their pitch (for a photograph that its EXIF header calls
//           turned: over what is its row when it is upright)
//   plane   people walk on the ground: up is the normal of the best plane through the cameras' places
// Both are the eigenvector of the least eigenvalue l0 of a 3x3 matrix, and of both we know how well they are determined: the
// direction is off by about sqrt(l0 / (l1 n)) for n cameras. The better one is taken. Its sign, and all of it where
// neither is worth anything (three frontal views), comes from the mean of the cameras' own up vectors, which is biased by
// their pitch unless they stand all around.
//
// Photographs with a level sensor write no gravity into their EXIF headers (maker notes apart), so there is none to take.
//
// Files of NeRF, instant-ngp and nerfstudio have z up by convention. It is believed where the cameras do not contradict by
// more than 30 degrees: a Blender scene may well have been photographed by cameras that roll.

#include "capture/world.h"

#include <string.h>

#define DOUBTFUL (5 * VT_PI / 180) // error from which on a measured direction is no better than the mean
#define CONTRADICTS (30 * VT_PI / 180)

// Eigenvalues, ascending, and eigenvectors of a symmetric matrix, by Jacobi's rotations.
static void diagonalise(double a[3][3], double value[3], vt_vec3 vector[3]) {
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 60; sweep++) {
    int p = sweep % 3 == 2, q = sweep % 3 == 0 ? 1 : 2; // (0,1), (0,2), (1,2)
    if (fabs(a[p][q]) < 1e-300) continue;
    double theta = 0.5 * atan2(2 * a[p][q], a[q][q] - a[p][p]), c = cos(theta), s = sin(theta);
    for (int i = 0; i < 3; i++) {
      double x = a[i][p], y = a[i][q];
      a[i][p] = c * x - s * y, a[i][q] = s * x + c * y;
    }
    for (int i = 0; i < 3; i++) {
      double x = a[p][i], y = a[q][i];
      a[p][i] = c * x - s * y, a[q][i] = s * x + c * y;
      x = v[i][p], y = v[i][q];
      v[i][p] = c * x - s * y, v[i][q] = s * x + c * y;
    }
  }
  int order[3] = {0, 1, 2};
  for (int i = 0; i < 2; i++)
    for (int j = i + 1; j < 3; j++)
      if (a[order[j]][order[j]] < a[order[i]][order[i]]) {
        int swap = order[i];
        order[i] = order[j], order[j] = swap;
      }
  for (int i = 0; i < 3; i++) {
    value[i] = a[order[i]][order[i]];
    vector[i] = vt_v3(v[0][order[i]], v[1][order[i]], v[2][order[i]]);
  }
}

static void add_square(double a[3][3], vt_vec3 v) {
  double c[3] = {v.x, v.y, v.z};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) a[i][j] += c[i] * c[j];
}

// The eigenvector of the least eigenvalue, towards `side`, and about how far it is off.
static vt_up normal_of(double a[3][3], int count, vt_vec3 side, const char *by) {
  double value[3];
  vt_vec3 vector[3];
  diagonalise(a, value, vector);
  vt_up up = {vt_normalise(vector[0]), NAN, by};
  if (vt_dot(up.direction, side) < 0) up.direction = vt_scale(up.direction, -1);
  if (value[1] > 1e-12 * value[2]) up.error = sqrt(fmax(value[0], 0) / (value[1] * count));
  return up;
}

// Up and the level axis of an upright picture, in the camera's axes, by EXIF orientation 1..8 of the picture as stored.
static vt_vec3 up_of(const vt_photo *photo) {
  static const double ups[8][2] = {{0, -1}, {0, -1}, {0, 1}, {0, 1}, {-1, 0}, {-1, 0}, {1, 0}, {1, 0}};
  int upright = photo->upright >= 1 && photo->upright <= 8 ? photo->upright - 1 : 0;
  return vt_v3(ups[upright][0], ups[upright][1], 0);
}

vt_up vt_find_up(const vt_photos *photos) {
  double level[3][3] = {{0}}, plane[3][3] = {{0}};
  vt_vec3 sum = {0, 0, 0}, middle = {0, 0, 0};
  int count = photos->count;
  for (int i = 0; i < count; i++) {
    const vt_photo *p = &photos->items[i];
    middle = vt_add(middle, vt_scale(vt_mul_transposed(&p->rotation, p->translation), -1.0 / count));
  }
  for (int i = 0; i < count; i++) {
    const vt_photo *p = &photos->items[i];
    vt_vec3 up = up_of(p);
    sum = vt_add(sum, vt_mul_transposed(&p->rotation, up));
    add_square(level, vt_mul_transposed(&p->rotation, vt_v3(-up.y, up.x, 0)));
    add_square(plane, vt_sub(vt_scale(vt_mul_transposed(&p->rotation, p->translation), -1), middle));
  }
  vt_up mean = {vt_normalise(sum), NAN, "the mean of the cameras"};
  if (count < 1 || vt_length(sum) < 0.1 * count) return (vt_up){{0, 0, 0}, NAN, "nothing"};
  if (count < 3) return mean;
  vt_up best = normal_of(level, count, mean.direction, "the level of the cameras");
  vt_up other = normal_of(plane, count, mean.direction, "the plane of the cameras");
  if (!(best.error <= other.error)) best = other;
  return best.error < DOUBTFUL ? best : mean;
}

static vt_status find_scale(vt_context *context, const vt_capture_desc *desc, vt_photos *photos) {
  double scale = 0;
  vt_status status = VT_OK;
  if (desc->marks) {
    status = vt_scale_by_marks(context, desc->marks, photos, &scale);
  } else if (desc->marker_size > 0) {
    status = vt_scale_by_markers(context, desc->marker_size, desc->marker_cells, photos, &scale);
  } else if (desc->tree_height > 0) { // what the source says of its own goes behind what the user says
    photos->world.tree_height = desc->tree_height;
    photos->world.metres_per_unit = 0;
  }
  if (!status && scale > 0) photos->world.metres_per_unit = scale;
  return status;
}

vt_status vt_find_world(vt_context *context, const vt_capture_desc *desc, bool z_is_up, vt_photos *photos) {
  vt_world *world = &photos->world;
  if (!(vt_length(world->up) > 0)) {
    vt_up up = vt_find_up(photos);
    vt_vec3 z = vt_v3(0, 0, 1);
    bool contradicted = isfinite(up.error) && acos(fmin(1, fmax(-1, vt_dot(up.direction, z)))) > CONTRADICTS;
    if (z_is_up && !contradicted)
      up = (vt_up){z, NAN, "the custom of transforms.json, z"};
    world->up = up.direction;
    vt_log(context, VT_LOG_NORMAL, isfinite(up.error) ? "up: (%.4f, %.4f, %.4f) by %s, to about %.2f degrees" : "up: (%.4f, %.4f, %.4f) by %s",
           up.direction.x, up.direction.y, up.direction.z, up.by, up.error * 180 / VT_PI);
  }
  return find_scale(context, desc, photos);
}
