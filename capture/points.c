// points.c - where a point is that several photographs show, and the scale of the world from such points
// SPDX-License-Identifier: BSD-3-Clause
//
// The point whose pictures are nearest to where it was seen: the nearest point to the rays first (least squares), then Gauss
// and Newton on the pixels, through the lenses as they are, so that points are marked on photographs as they came from the
// camera. Two such points and the metres between them are a scale, s = metres / units; of several the median is taken.

#include "capture/world.h"

#include <stdlib.h>
#include <string.h>

static vt_ray ray_of(const vt_photo *photo, const double pixel[2], bool *there) {
  double xy[2];
  *there = vt_lens_unproject(&photo->lens, pixel, xy);
  vt_vec3 origin = vt_scale(vt_mul_transposed(&photo->rotation, photo->translation), -1);
  return (vt_ray){origin, vt_normalise(vt_mul_transposed(&photo->rotation, vt_v3(xy[0], xy[1], 1)))};
}

static bool place_of(const vt_photo *photo, vt_vec3 point, double pixel[2]) {
  vt_vec3 c = vt_add(vt_mul(&photo->rotation, point), photo->translation);
  if (!(c.z > 0)) return false;
  vt_lens_project(&photo->lens, c.x / c.z, c.y / c.z, pixel);
  return true;
}

static bool solve(double a[9], const double b[3], vt_vec3 *x) {
  vt_vec3 r0 = vt_v3(a[0], a[1], a[2]), r1 = vt_v3(a[3], a[4], a[5]), r2 = vt_v3(a[6], a[7], a[8]);
  vt_vec3 c12 = vt_cross(r1, r2), c20 = vt_cross(r2, r0), c01 = vt_cross(r0, r1);
  double determinant = vt_dot(r0, c12), size = vt_length(r0) * vt_length(r1) * vt_length(r2);
  if (!(fabs(determinant) > 1e-12 * size)) return false;
  *x = vt_scale(vt_add(vt_add(vt_scale(c12, b[0]), vt_scale(c20, b[1])), vt_scale(c01, b[2])), 1 / determinant);
  return true;
}

static bool nearest_to_rays(const vt_photos *photos, const vt_sighting *s, int count, vt_point *out) {
  double a[9] = {0}, b[3] = {0};
  bool there = true;
  vt_ray first = {{0, 0, 0}, {0, 0, 1}};
  for (int i = 0; i < count && there; i++) {
    vt_ray ray = ray_of(&photos->items[s[i].photo], s[i].pixel, &there);
    if (i == 0) first = ray;
    for (int j = 0; j < i && there; j++) {
      bool other_there;
      vt_ray other = ray_of(&photos->items[s[j].photo], s[j].pixel, &other_there);
      out->angle = fmax(out->angle, atan2(vt_length(vt_cross(ray.direction, other.direction)), vt_dot(ray.direction, other.direction)));
    }
    vt_vec3 from = vt_sub(ray.origin, first.origin); // near the origin sums are exact
    double d[3] = {ray.direction.x, ray.direction.y, ray.direction.z}, o[3] = {from.x, from.y, from.z};
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) {
        a[3 * r + c] += (r == c) - d[r] * d[c];
        b[r] += ((r == c) - d[r] * d[c]) * o[c];
      }
  }
  if (!there || count < 2 || !solve(a, b, &out->place)) return false;
  out->place = vt_add(out->place, first.origin);
  return true;
}

// The sum of squares of the pixels that the point is off, and what is wanted for the next step.
static bool look(const vt_photos *photos, const vt_sighting *s, int count, vt_vec3 at, double step, double a[9], double b[3],
                 double *sum) {
  *sum = 0;
  memset(a, 0, 9 * sizeof *a);
  memset(b, 0, 3 * sizeof *b);
  for (int i = 0; i < count; i++) {
    const vt_photo *photo = &photos->items[s[i].photo];
    double p[2], q[3][2];
    vt_vec3 around[3] = {vt_v3(at.x + step, at.y, at.z), vt_v3(at.x, at.y + step, at.z), vt_v3(at.x, at.y, at.z + step)};
    bool there = place_of(photo, at, p);
    for (int k = 0; k < 3; k++) there = there && place_of(photo, around[k], q[k]);
    if (!there) return false;
    for (int axis = 0; axis < 2; axis++) {
      double error = s[i].pixel[axis] - p[axis];
      *sum += error * error;
      for (int r = 0; r < 3; r++) {
        double gr = (q[r][axis] - p[axis]) / step;
        b[r] += gr * error;
        for (int c = 0; c < 3; c++) a[3 * r + c] += gr * (q[c][axis] - p[axis]) / step;
      }
    }
  }
  return isfinite(*sum);
}

bool vt_triangulate(const vt_photos *photos, const vt_sighting *s, int count, vt_point *out) {
  *out = (vt_point){0};
  if (!nearest_to_rays(photos, s, count, out)) return false;
  const vt_photo *first = &photos->items[s[0].photo];
  double distance = vt_length(vt_add(vt_mul(&first->rotation, out->place), first->translation));
  double a[9], b[3], sum, next;
  if (!look(photos, s, count, out->place, 1e-6 * distance, a, b, &sum)) return false;
  for (int turn = 0; turn < 20; turn++) {
    vt_vec3 move;
    double unused_a[9], unused_b[3];
    if (!solve(a, b, &move)) return false;
    vt_vec3 there = vt_add(out->place, move);
    if (!look(photos, s, count, there, 1e-6 * distance, unused_a, unused_b, &next) || !(next < sum)) break;
    out->place = there;
    sum = next;
    memcpy(a, unused_a, sizeof a);
    memcpy(b, unused_b, sizeof b);
  }
  for (int i = 0; i < count; i++) {
    double pixel[2] = {0, 0};
    (void)place_of(&photos->items[s[i].photo], out->place, pixel);
    double off = hypot(pixel[0] - s[i].pixel[0], pixel[1] - s[i].pixel[1]);
    if (off >= out->worst) out->worst = off, out->worst_sighting = i;
  }
  out->rms = sqrt(sum / count);
  return true;
}

static int compare_spans(const void *a, const void *b) {
  const vt_span *p = a, *q = b;
  double x = p->metres * q->units, y = q->metres * p->units;
  return (x > y) - (x < y);
}

double vt_scale_of_spans(vt_span *spans, int count, double *spread) {
  qsort(spans, (size_t)count, sizeof *spans, compare_spans);
  const vt_span *low = &spans[count / 4], *high = &spans[count - 1 - count / 4], *a = &spans[(count - 1) / 2], *b = &spans[count / 2];
  double median = 0.5 * (a->metres / a->units + b->metres / b->units);
  *spread = 0.5 * (high->metres / high->units - low->metres / low->units) / median;
  return median;
}
