// phantom_photograph.c - pictures of extinction
// SPDX-License-Identifier: BSD-3-Clause
//
// A pixel's alpha is the mean of 1 - exp(-tau) over its samples; the mean of tau would be wrong where tau bends.
// Colour varies linearly through space, and a ray's colour is its emission-weighted mean. Ball, shell and blobs: the
// ray is cut into steps, each step weighs as much as transmittance drops over it (exact, from the closed form) and
// shows the colour of its middle. Comb and crown: the mean of a linear field is the field at the mean place, and that
// place has a closed form; a pixel takes the mean over its samples, since the ray of its centre may pass between two
// plates.

#include "datasets-synthetic/phantom.h"

enum { COLOUR_STEPS = 16 };

void vt_phantom_colour(vt_vec3 point, double colour[3]) {
  double values[3] = {0.42 + 0.22 * point.x, 0.55 + 0.2 * point.z, 0.34 + 0.2 * point.y};
  for (int k = 0; k < 3; k++) colour[k] = fmin(fmax(values[k], 0), 1);
}

// Of a ray whose origin is outside.
static void ray_colour(const vt_phantom *p, const vt_ray *ray, double colour[3]) {
  double middle = -vt_dot(ray->origin, ray->direction), near = middle - p->radius, step = 2 * p->radius / COLOUR_STEPS;
  double passed = 1, weight = 0, sum[3] = {0, 0, 0};
  vt_phantom_profile r;
  vt_make_profile(p, ray, &r);
  for (int k = 0; k < COLOUR_STEPS; k++) {
    double from = near + k * step;
    double left = exp(-vt_profile_depth(&r, -INFINITY, from + step)), here[3];
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

static void photograph_smooth_pixel(const phantom_job *job, const vt_camera *camera, int px, int py, uint8_t out[4]) {
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

static void photograph_solid_pixel(const phantom_job *job, const vt_camera *camera, int px, int py, uint8_t out[4]) {
  int s = job->supersample;
  double sum = 0, colours[3] = {0, 0, 0};
  for (int k = 0; k < s * s; k++) {
    double alpha, depth, colour[3];
    vt_ray ray = vt_camera_ray(camera, px + (k % s + 0.5) / s, py + (k / s + 0.5) / s);
    vt_phantom_first_moment(job->phantom, &ray, 0, INFINITY, &alpha, &depth);
    if (!(alpha > 0)) continue;
    vt_phantom_colour(vt_add(ray.origin, vt_scale(ray.direction, depth)), colour);
    for (int c = 0; c < 3; c++) colours[c] += alpha * colour[c];
    sum += alpha;
  }
  out[3] = byte_of(sum / (s * s));
  for (int c = 0; c < 3 && out[3]; c++) out[c] = byte_of(colours[c] / sum);
}

static void photograph_views(void *user, size_t begin, size_t end, int worker) {
  phantom_job *job = user;
  void (*photograph)(const phantom_job *, const vt_camera *, int, int, uint8_t *) =
      job->phantom->solid_count ? photograph_solid_pixel : photograph_smooth_pixel;
  for (size_t i = begin; i < end; i++) {
    vt_view *view = &job->views->items[i];
    size_t width = (size_t)view->picture.width;
    if (worker == 0) vt_progress(job->context, "photograph", (double)i / job->views->count);
    for (int y = 0; y < view->picture.height && !vt_cancelled(job->context); y++)
      for (int x = 0; x < view->picture.width; x++)
        photograph(job, &view->camera, x, y, view->picture.pixels + 4 * ((size_t)y * width + (size_t)x));
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
