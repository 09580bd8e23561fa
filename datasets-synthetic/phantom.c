// phantom.c - balls, shells, blobs, boxes and ellipsoids of extinction whose line integrals are known
// SPDX-License-Identifier: BSD-3-Clause
//
// A ray x(s) = o + s d, |d| = 1, has the optical depth tau = integral of sigma(x(s)) ds and the alpha 1 - exp(-tau).
//   ball   sigma constant in a sphere: tau = sigma times the chord, s = -o.d -+ sqrt(r^2 - h^2), h the ray's distance
//   shell  a ball without a smaller one inside
//   blobs  sigma = sum_i p_i exp(-|x - c_i|^2 / (2 w_i^2)): with m = d.(c_i - o) and h = |c_i - o - m d| (not the root
//   of
//          |c_i - o|^2 - m^2, which cancels far away),
//          tau = sum_i p_i exp(-h^2 / (2 w_i^2)) w_i sqrt(pi/2) [erf((s - m) / (w_i sqrt 2))] from near to far
//   solids sigma = sum_i p_i [M_i (x - c_i) in the unit cube or ball]: M_i takes the ray to a ray, whose chord there is
//          that of three slabs or of a sphere, in the same s; sigma is then a row of steps along the ray
// The mean distance of what stops a ray is the sum over pieces on which tau is linear: a piece of depth delta stops a
// share 1 - exp(-delta) of what reaches it, on average at 1/delta - 1/(exp(delta) - 1) of its length. All phantoms but
// the blobs are linear between their surfaces; along these the pieces are short.

#include "datasets-synthetic/phantom.h"
#include "base/rng.h"

enum { BLOB_PIECES = 128 };

static void add_blobs(const vt_synthetic_desc *desc, vt_phantom *p) {
  vt_rng rng = vt_seed_rng(desc->seed, 5);
  p->blob_count = 6 + (int)(vt_random(&rng) % (VT_BLOB_LIMIT - 5));
  for (int i = 0; i < p->blob_count; i++) {
    vt_blob *blob = &p->blobs[i];
    double z = vt_random_between(&rng, -1, 1), angle = vt_random_between(&rng, 0, 2 * VT_PI), r = sqrt(1 - z * z);
    blob->deviation = vt_random_between(&rng, 0.1, 0.18);
    blob->peak = vt_random_between(&rng, 0.4, 1);
    double away = (1 - 3.2 * blob->deviation) * cbrt(vt_random_between(&rng, 0.15, 1));
    blob->centre = vt_v3(away * r * cos(angle), away * r * sin(angle), away * z);
  }
  double highest = 0; // where blobs overlap their sum counts
  for (int i = 0; i < p->blob_count; i++) highest = fmax(highest, vt_phantom_extinction(p, p->blobs[i].centre));
  for (int i = 0; i < p->blob_count; i++) p->blobs[i].peak *= desc->peak_extinction / highest;
}

vt_phantom vt_make_phantom(const vt_synthetic_desc *desc) {
  VT_ASSERT(desc->cookie == VT_COOKIE && vt_is_phantom(desc->kind));
  vt_phantom p = {.kind = desc->kind, .extinction = desc->peak_extinction, .radius = 1};
  if (desc->kind == VT_SYNTHETIC_SHELL) p.inner = 0.7;
  if (desc->kind == VT_SYNTHETIC_BLOBS) add_blobs(desc, &p);
  if (desc->kind == VT_SYNTHETIC_COMB) vt_add_comb(desc, &p);
  if (desc->kind == VT_SYNTHETIC_CROWN) vt_add_crown(desc, &p);
  return p;
}

static bool is_round(vt_synthetic_kind kind) {
  return kind == VT_SYNTHETIC_BALL || kind == VT_SYNTHETIC_SHELL;
}

static bool is_inside(const vt_solid *solid, vt_vec3 point) {
  vt_vec3 q = vt_mul(&solid->unit_from_world, vt_sub(point, solid->centre));
  return solid->box ? fabs(q.x) <= 1 && fabs(q.y) <= 1 && fabs(q.z) <= 1 : vt_dot(q, q) <= 1;
}

double vt_phantom_extinction(const vt_phantom *p, vt_vec3 point) {
  if (is_round(p->kind)) {
    double distance = vt_length(point);
    return distance <= p->radius && distance >= p->inner ? p->extinction : 0;
  }
  double sum = 0;
  for (int i = 0; i < p->blob_count; i++) {
    vt_vec3 away = vt_sub(point, p->blobs[i].centre);
    sum += p->blobs[i].peak * exp(-vt_dot(away, away) / (2 * p->blobs[i].deviation * p->blobs[i].deviation));
  }
  for (int i = 0; i < p->solid_count; i++)
    if (is_inside(&p->solids[i], point)) sum += p->solids[i].extinction;
  return sum;
}

void vt_phantom_near(const vt_phantom *p, vt_vec3 centre, double radius, vt_phantom *out) {
  out->kind = p->kind, out->extinction = p->extinction, out->inner = p->inner, out->radius = p->radius;
  out->blob_count = out->solid_count = 0;
  for (int i = 0; i < p->blob_count; i++) // beyond 9 deviations a blob is below 1e-17 of its peak
    if (vt_length(vt_sub(centre, p->blobs[i].centre)) < radius + 9 * p->blobs[i].deviation)
      out->blobs[out->blob_count++] = p->blobs[i];
  for (int i = 0; i < p->solid_count; i++)
    if (vt_length(vt_sub(centre, p->solids[i].centre)) < radius + p->solids[i].reach)
      out->solids[out->solid_count++] = p->solids[i];
}

// ---- along a ray

static double half_chord(double radius, double distance_squared) {
  double square = radius * radius - distance_squared;
  return square > 0 ? sqrt(square) : 0;
}

// Where a ray, taken to a solid's own space, is within the unit ball or cube. False if nowhere.
static bool cross_ball(vt_vec3 q, vt_vec3 d, double *from, double *to) {
  double square = vt_dot(d, d), middle = -vt_dot(q, d) / square;
  vt_vec3 closest = vt_add(q, vt_scale(d, middle));
  double half = half_chord(1, vt_dot(closest, closest)) / sqrt(square);
  *from = middle - half, *to = middle + half;
  return half > 0;
}

static bool cross_cube(vt_vec3 q, vt_vec3 d, double *from, double *to) {
  double place[3] = {q.x, q.y, q.z}, slope[3] = {d.x, d.y, d.z};
  *from = -INFINITY, *to = INFINITY;
  for (int k = 0; k < 3; k++) {
    if (slope[k] == 0 && fabs(place[k]) > 1) return false;
    if (slope[k] == 0) continue;
    double a = (-1 - place[k]) / slope[k], b = (1 - place[k]) / slope[k];
    *from = fmax(*from, fmin(a, b)), *to = fmin(*to, fmax(a, b));
  }
  return *to > *from;
}

static void put_step(vt_phantom_profile *r, double at, double change) {
  int k = r->step_count++;
  for (; k > 0 && r->steps[k - 1].at > at; k--) r->steps[k] = r->steps[k - 1];
  r->steps[k] = (vt_phantom_step){at, change};
}

static void cross_solid(const vt_solid *solid, const vt_ray *ray, vt_phantom_profile *out) {
  vt_vec3 to_origin = vt_sub(ray->origin, solid->centre);
  vt_vec3 off = vt_sub(to_origin, vt_scale(ray->direction, vt_dot(to_origin, ray->direction)));
  if (vt_dot(off, off) > solid->reach * solid->reach) return;
  // From the point nearest to the centre: far away, small differences of large distances would be lost.
  double nearest = -vt_dot(to_origin, ray->direction), from, to;
  vt_vec3 q = vt_mul(&solid->unit_from_world, off), d = vt_mul(&solid->unit_from_world, ray->direction);
  if (!(solid->box ? cross_cube(q, d, &from, &to) : cross_ball(q, d, &from, &to))) return;
  put_step(out, nearest + from, solid->extinction);
  put_step(out, nearest + to, -solid->extinction);
}

void vt_make_profile(const vt_phantom *p, const vt_ray *ray, vt_phantom_profile *out) {
  out->kind = p->kind, out->lobe_count = out->step_count = 0, out->radius = p->radius;
  out->middle = -vt_dot(ray->origin, ray->direction);
  if (is_round(p->kind)) {
    out->extinction = p->extinction;
    vt_vec3 closest = vt_add(ray->origin, vt_scale(ray->direction, out->middle));
    double distance_squared = vt_dot(closest, closest);
    out->outer = half_chord(p->radius, distance_squared), out->inner = half_chord(p->inner, distance_squared);
    return;
  }
  for (int i = 0; i < p->solid_count; i++) cross_solid(&p->solids[i], ray, out);
  for (int i = 0; i < p->blob_count; i++) {
    const vt_blob *blob = &p->blobs[i];
    vt_vec3 to_centre = vt_sub(blob->centre, ray->origin);
    double middle = vt_dot(ray->direction, to_centre), width = 1 / (blob->deviation * sqrt(2));
    vt_vec3 off = vt_sub(to_centre, vt_scale(ray->direction, middle));
    double exponent = vt_dot(off, off) * width * width;
    if (exponent > 40) continue; // less than 1e-17 of its peak
    double half_depth = blob->peak * exp(-exponent) * blob->deviation * sqrt(VT_PI / 2);
    out->lobes[out->lobe_count++] = (vt_phantom_lobe){half_depth, middle, width};
  }
}

static double erf_at(double x) {
  return x > 6 ? 1 : x < -6 ? -1 : erf(x);
} // the same doubles, sooner

static double overlap(double near, double far, double from, double to) {
  return fmax(0, fmin(far, to) - fmax(near, from));
}

double vt_profile_depth(const vt_phantom_profile *r, double near, double far) {
  if (!(far > near)) return 0;
  if (is_round(r->kind)) {
    double whole = overlap(near, far, r->middle - r->outer, r->middle + r->outer);
    return r->extinction * (whole - overlap(near, far, r->middle - r->inner, r->middle + r->inner));
  }
  double sum = 0, extinction = 0;
  for (int i = 0; i < r->lobe_count; i++) {
    const vt_phantom_lobe *l = &r->lobes[i];
    sum += l->half_depth * (erf_at((far - l->middle) * l->width) - erf_at((near - l->middle) * l->width));
  }
  for (int i = 0; i + 1 < r->step_count; i++) {
    extinction += r->steps[i].change;
    sum += extinction * overlap(near, far, r->steps[i].at, r->steps[i + 1].at);
  }
  return fmax(sum, 0);
}

double vt_phantom_depth(const vt_phantom *p, const vt_ray *ray, double near, double far) {
  vt_phantom_profile r;
  vt_make_profile(p, ray, &r);
  return vt_profile_depth(&r, near, far);
}

// ---- the mean distance

typedef struct integral { // so far
  double depth, passed;   // optical depth, exp of minus it
  double stopped, first;  // share stopped, and its first moment
} integral;

// Where on a piece of linear tau what it stops is stopped on average, 0..1.
static double mean_place(double depth) {
  return depth > 1e-3 ? 1 / depth - 1 / expm1(depth) : 0.5 - depth / 12;
}

static void add_piece(integral *sum, double from, double length, double depth) {
  double stopped = -sum->passed * expm1(-depth);
  sum->stopped += stopped, sum->first += stopped * (from + length * mean_place(depth));
  sum->depth += depth, sum->passed = exp(-sum->depth);
}

// Adds the piece up to `to`, if it begins before.
static void go_on(const vt_phantom_profile *r, double *from, double to, integral *sum) {
  if (!(to > *from)) return;
  add_piece(sum, *from, to - *from, vt_profile_depth(r, *from, to));
  *from = to;
}

void vt_phantom_first_moment(const vt_phantom *p, const vt_ray *ray, double near, double far, double *alpha,
                             double *mean) {
  vt_phantom_profile r;
  integral sum = {.passed = 1};
  vt_make_profile(p, ray, &r);
  if (r.step_count) { // close round what there is: rays are long
    near = fmax(near, r.steps[0].at), far = fmin(far, r.steps[r.step_count - 1].at);
  } else {
    near = fmax(near, r.middle - r.radius), far = fmin(far, r.middle + r.radius);
  }
  double at = near, extinction = 0;
  if (is_round(r.kind)) {
    double ends[4] = {r.middle - r.outer, r.middle - r.inner, r.middle + r.inner, r.middle + r.outer};
    for (int k = 0; k < 4; k++) go_on(&r, &at, fmin(ends[k], far), &sum);
  }
  for (int k = 1; k <= BLOB_PIECES && r.lobe_count; k++)
    go_on(&r, &at, fmin(r.middle + r.radius * (2.0 * k / BLOB_PIECES - 1), far), &sum);
  for (int i = 0; i < r.step_count; i++) {
    double to = fmin(r.steps[i].at, far);
    if (to > at) add_piece(&sum, at, to - at, fmax(extinction, 0) * (to - at)), at = to;
    extinction += r.steps[i].change;
  }
  go_on(&r, &at, far, &sum);
  *alpha = -expm1(-sum.depth);
  *mean = sum.stopped > 0 ? sum.first / sum.stopped : INFINITY;
}
