// phantom.c - balls, shells and blobs of extinction whose line integrals are known
// SPDX-License-Identifier: BSD-3-Clause
//
// A ray x(s) = o + s d, |d| = 1, has the optical depth tau = integral of sigma(x(s)) ds and the alpha 1 - exp(-tau).
//   ball   sigma constant in a sphere: tau = sigma times the chord, s = -o.d -+ sqrt(r^2 - h^2), h the ray's distance
//   shell  a ball without a smaller one inside
//   blobs  sigma = sum_i p_i exp(-|x - c_i|^2 / (2 w_i^2)): with m = d.(c_i - o) and h = |c_i - o - m d| (not the root
//   of
//          |c_i - o|^2 - m^2, which cancels far away),
//          tau = sum_i p_i exp(-h^2 / (2 w_i^2)) w_i sqrt(pi/2) [erf((s - m) / (w_i sqrt 2))] from near to far
// A pixel's alpha is the mean of 1 - exp(-tau) over its samples; the mean of tau would be wrong where tau bends.
// Colour varies linearly through space, and a ray's colour is its emission-weighted mean: the ray is cut into steps,
// each step weighs as much as transmittance drops over it (exact, from the closed form) and shows the colour of its
// middle.

#include "datasets-synthetic/phantom.h"
#include "base/rng.h"

enum { COLOUR_STEPS = 16 };

vt_phantom vt_make_phantom(const vt_synthetic_desc *desc) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->kind != VT_SYNTHETIC_TREE);
  vt_phantom p = {.kind = desc->kind, .extinction = desc->peak_extinction, .radius = 1};
  if (desc->kind == VT_SYNTHETIC_SHELL) p.inner = 0.7;
  if (desc->kind != VT_SYNTHETIC_BLOBS) return p;
  vt_rng rng = vt_seed_rng(desc->seed, 5);
  p.blob_count = 6 + (int)(vt_random(&rng) % (VT_BLOB_LIMIT - 5));
  for (int i = 0; i < p.blob_count; i++) {
    vt_blob *blob = &p.blobs[i];
    double z = vt_random_between(&rng, -1, 1), angle = vt_random_between(&rng, 0, 2 * VT_PI), r = sqrt(1 - z * z);
    blob->deviation = vt_random_between(&rng, 0.1, 0.18);
    blob->peak = vt_random_between(&rng, 0.4, 1);
    double away = (1 - 3.2 * blob->deviation) * cbrt(vt_random_between(&rng, 0.15, 1));
    blob->centre = vt_v3(away * r * cos(angle), away * r * sin(angle), away * z);
  }
  double highest = 0; // where blobs overlap their sum counts
  for (int i = 0; i < p.blob_count; i++) highest = fmax(highest, vt_phantom_extinction(&p, p.blobs[i].centre));
  for (int i = 0; i < p.blob_count; i++) p.blobs[i].peak *= desc->peak_extinction / highest;
  return p;
}

double vt_phantom_extinction(const vt_phantom *p, vt_vec3 point) {
  if (p->kind != VT_SYNTHETIC_BLOBS) {
    double distance = vt_length(point);
    return distance <= p->radius && distance >= p->inner ? p->extinction : 0;
  }
  double sum = 0;
  for (int i = 0; i < p->blob_count; i++) {
    vt_vec3 away = vt_sub(point, p->blobs[i].centre);
    sum += p->blobs[i].peak * exp(-vt_dot(away, away) / (2 * p->blobs[i].deviation * p->blobs[i].deviation));
  }
  return sum;
}

typedef struct lobe { // a blob along a ray: its depth up to s is half_depth (1 + erf((s - middle) width))
  double half_depth, middle, width;
} lobe;

typedef struct profile {                   // the phantom along a ray
  double extinction, middle, outer, inner; // ball and shell: between middle -+ outer, but not between middle -+ inner
  int lobe_count;
  lobe lobes[VT_BLOB_LIMIT];
} profile;

static double half_chord(double radius, double distance_squared) {
  double square = radius * radius - distance_squared;
  return square > 0 ? sqrt(square) : 0;
}

static void make_profile(const vt_phantom *p, const vt_ray *ray, profile *out) {
  out->lobe_count = 0;
  if (p->kind != VT_SYNTHETIC_BLOBS) {
    out->middle = -vt_dot(ray->origin, ray->direction), out->extinction = p->extinction;
    vt_vec3 closest = vt_add(ray->origin, vt_scale(ray->direction, out->middle));
    double distance_squared = vt_dot(closest, closest);
    out->outer = half_chord(p->radius, distance_squared), out->inner = half_chord(p->inner, distance_squared);
    return;
  }
  for (int i = 0; i < p->blob_count; i++) {
    const vt_blob *blob = &p->blobs[i];
    vt_vec3 to_centre = vt_sub(blob->centre, ray->origin);
    double middle = vt_dot(ray->direction, to_centre), width = 1 / (blob->deviation * sqrt(2));
    vt_vec3 off = vt_sub(to_centre, vt_scale(ray->direction, middle));
    double exponent = vt_dot(off, off) * width * width;
    if (exponent > 40) continue; // less than 1e-17 of its peak
    double half_depth = blob->peak * exp(-exponent) * blob->deviation * sqrt(VT_PI / 2);
    out->lobes[out->lobe_count++] = (lobe){half_depth, middle, width};
  }
}

static double erf_at(double x) {
  return x > 6 ? 1 : x < -6 ? -1 : erf(x);
} // the same doubles, sooner

static double overlap(double near, double far, double from, double to) {
  return fmax(0, fmin(far, to) - fmax(near, from));
}

static double profile_depth(const vt_phantom *p, const profile *r, double near, double far) {
  if (!(far > near)) return 0;
  if (p->kind != VT_SYNTHETIC_BLOBS) {
    double whole = overlap(near, far, r->middle - r->outer, r->middle + r->outer);
    return r->extinction * (whole - overlap(near, far, r->middle - r->inner, r->middle + r->inner));
  }
  double sum = 0;
  for (int i = 0; i < r->lobe_count; i++) {
    const lobe *l = &r->lobes[i];
    sum += l->half_depth * (erf_at((far - l->middle) * l->width) - erf_at((near - l->middle) * l->width));
  }
  return sum;
}

double vt_phantom_depth(const vt_phantom *p, const vt_ray *ray, double near, double far) {
  profile r;
  make_profile(p, ray, &r);
  return profile_depth(p, &r, near, far);
}

void vt_phantom_colour(vt_vec3 point, double colour[3]) {
  double values[3] = {0.42 + 0.22 * point.x, 0.55 + 0.2 * point.z, 0.34 + 0.2 * point.y};
  for (int k = 0; k < 3; k++) colour[k] = fmin(fmax(values[k], 0), 1);
}

// Of a ray whose origin is outside.
static void ray_colour(const vt_phantom *p, const vt_ray *ray, double colour[3]) {
  double middle = -vt_dot(ray->origin, ray->direction), near = middle - p->radius, step = 2 * p->radius / COLOUR_STEPS;
  double passed = 1, weight = 0, sum[3] = {0, 0, 0};
  profile r;
  make_profile(p, ray, &r);
  for (int k = 0; k < COLOUR_STEPS; k++) {
    double from = near + k * step;
    double left = exp(-profile_depth(p, &r, -INFINITY, from + step)), here[3];
    vt_phantom_colour(vt_add(ray->origin, vt_scale(ray->direction, from + 0.5 * step)), here);
    for (int c = 0; c < 3; c++) sum[c] += (passed - left) * here[c];
    weight += passed - left, passed = left;
  }
  for (int c = 0; c < 3; c++) colour[c] = weight > 0 ? sum[c] / weight : 0;
}

typedef struct phantom_job {
  vt_context *context;
  const vt_phantom *phantom;
  int supersample;
  vt_views *views;
} phantom_job;

static uint8_t byte_of(double unit) {
  return (uint8_t)(unit <= 0 ? 0 : unit >= 1 ? 255 : unit * 255 + 0.5);
}

static void photograph_pixel(const phantom_job *job, const vt_camera *camera, int px, int py, uint8_t out[4]) {
  int s = job->supersample;
  double sum = 0, sum_x = 0, sum_y = 0;
  for (int j = 0; j < s; j++)
    for (int i = 0; i < s; i++) {
      double x = px + (i + 0.5) / s, y = py + (j + 0.5) / s;
      vt_ray ray = vt_camera_ray(camera, x, y);
      double alpha = -expm1(-vt_phantom_depth(job->phantom, &ray, 0, INFINITY));
      sum += alpha, sum_x += alpha * x, sum_y += alpha * y;
    }
  out[3] = byte_of(sum / (s * s));
  if (!out[3]) return;
  double colour[3]; // of the ray where the pixel's alpha is: at an edge its centre may miss the phantom
  vt_ray ray = vt_camera_ray(camera, sum_x / sum, sum_y / sum);
  ray_colour(job->phantom, &ray, colour);
  for (int k = 0; k < 3; k++) out[k] = byte_of(colour[k]);
}

static void photograph_views(void *user, size_t begin, size_t end, int worker) {
  phantom_job *job = user;
  for (size_t i = begin; i < end; i++) {
    vt_view *view = &job->views->items[i];
    size_t width = (size_t)view->picture.width;
    if (worker == 0) vt_progress(job->context, "photograph", (double)i / job->views->count);
    for (int y = 0; y < view->picture.height && !vt_cancelled(job->context); y++)
      for (int x = 0; x < view->picture.width; x++)
        photograph_pixel(job, &view->camera, x, y, view->picture.pixels + 4 * ((size_t)y * width + (size_t)x));
  }
}

vt_status vt_photograph_phantom(vt_context *ctx, const vt_phantom *phantom, int supersample, vt_views *views) {
  phantom_job job = {ctx, phantom, supersample, views};
  vt_status status = VT_OK;
  for (int i = 0; i < views->count && !status; i++) {
    const vt_camera *camera = &views->items[i].camera;
    status = vt_make_image(ctx, camera->width, camera->height, 4, &views->items[i].picture);
  }
  if (!status) status = vt_parallel(ctx, (size_t)views->count, 1, photograph_views, &job);
  vt_progress(ctx, "photograph", 1);
  return status;
}
