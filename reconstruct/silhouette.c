// silhouette.c - how a photograph's matte differs from a volume, and how that changes as its camera moves
// SPDX-License-Identifier: BSD-3-Clause
//
// A camera turned by w about its place and moved by d u, both in its own frame, sees at a pixel the world points
// X = C + R^T (d u + X_c - w x X_c), X_c = t D, D the pixel's direction in the camera. With g = R grad s (soft_volume.c)
//
//   d tau / du = d int g dt,   d tau / dw = -D x int t g dt,   d tau / d ln f = -(D_x G_x + D_y G_y), G = int t g dt
//   d alpha = exp(-tau) d tau
//
// Leaves are flat, and a crown stops more light from above than from the side. A volume that stops the same from everywhere is
// too thin for one view and too dense for another, and cameras would come nearer or climb to make up for it (0.2 % of the
// distance, on a tree). Two things take that up instead of them: the response, the mean of a view's matte at pixels of equal alpha
// in the volume, is what a pixel is compared with; and a factor of the depth that changes slowly over the picture.
//
// Most pixels of a photograph are empty or full whatever the camera does. Those near an edge of the matte are looked at, and
// a few others, in which a volume may show that should not.

#include "reconstruct/silhouette.h"
#include "base/rng.h"

#define LEAST_CONTRAST 0.03f // of alpha, among a pixel and its eight neighbours: an edge
#define OTHERS_SHARE 0.15    // of the pixels chosen

static float alpha_of(const vt_image *p, size_t i) { return (float)p->pixels[4 * i + 3] / 255.0f; }

typedef enum pixel_kind { PLAIN, EDGE, IGNORED } pixel_kind;

static pixel_kind kind_of(const vt_image *picture, const vt_image *ignored, int x, int y) {
  int width = picture->width, height = picture->height;
  float low = 1, high = 0;
  for (int b = y > 0 ? y - 1 : 0; b <= y + 1 && b < height; b++)
    for (int a = x > 0 ? x - 1 : 0; a <= x + 1 && a < width; a++) {
      size_t i = (size_t)b * (size_t)width + (size_t)a;
      float alpha = alpha_of(picture, i);
      if (ignored->pixels && ignored->pixels[i]) return IGNORED;
      low = fminf(low, alpha), high = fmaxf(high, alpha);
    }
  return high - low >= LEAST_CONTRAST ? EDGE : PLAIN;
}

// Picks pixels row by row; kind: a pixel_kind each.
static vt_status pick_pixels(vt_context *context, const vt_image *picture, const uint8_t *kind, size_t edges, int most,
                             uint64_t seed, vt_silhouette *out) {
  size_t width = (size_t)picture->width, all = width * (size_t)picture->height;
  double others = (double)(all - edges), wanted = fmin((double)edges, (1 - OTHERS_SHARE) * most);
  double edge_share = edges ? wanted / (double)edges : 0;
  double other_share = others > 0 ? fmin(1, wanted * OTHERS_SHARE / (1 - OTHERS_SHARE) / others) : 0;
  size_t room = (size_t)(1.2 * wanted / (1 - OTHERS_SHARE)) + 200;
  out->pixels = VT_NEW(context, vt_silhouette_pixel, room);
  if (!out->pixels) return VT_OUT_OF_MEMORY;
  vt_rng rng = vt_seed_rng(seed, 11);
  for (size_t i = 0; i < all; i++)
    if (vt_random_unit(&rng) < (kind[i] == EDGE ? edge_share : other_share) && kind[i] != IGNORED && (size_t)out->count < room)
      out->pixels[out->count++] = (vt_silhouette_pixel){(uint16_t)(i % width), (uint16_t)(i / width), alpha_of(picture, i)};
  return VT_OK;
}

vt_status vt_sample_silhouette(vt_context *context, const vt_image *picture, const vt_image *ignored, const vt_camera *camera,
                               int most, uint64_t seed, vt_silhouette *out) {
  size_t edges = 0, width = (size_t)picture->width, all = width * (size_t)picture->height;
  *out = (vt_silhouette){.camera = *camera};
  uint8_t *kind = VT_NEW(context, uint8_t, all);
  if (!kind) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < all; i++) {
    kind[i] = (uint8_t)kind_of(picture, ignored, (int)(i % width), (int)(i / width));
    edges += kind[i] == EDGE;
  }
  vt_status status = pick_pixels(context, picture, kind, edges, most, seed, out);
  vt_free(context, kind);
  return status;
}

void vt_free_silhouette(vt_context *context, vt_silhouette *s) {
  vt_free(context, s->pixels);
  *s = (vt_silhouette){0};
}

// ---- response

vt_response vt_no_response(void) {
  vt_response r = {{0}, {0}, {0}};
  for (int k = 0; k <= VT_RESPONSE_STEPS; k++) r.value[k] = (float)k / VT_RESPONSE_STEPS;
  return r;
}

void vt_learn_response(vt_response *r, const vt_silhouette *silhouette, const float *error) {
  for (int i = 0; i < silhouette->count; i++) {
    double matte = (double)silhouette->pixels[i].alpha, at = (matte + (double)error[i]) * VT_RESPONSE_STEPS;
    int k = at < 0 ? 0 : at >= VT_RESPONSE_STEPS ? VT_RESPONSE_STEPS - 1 : (int)at;
    double share = at - k;
    r->weight[k] += 1 - share, r->sum[k] -= (1 - share) * (double)error[i];
    r->weight[k + 1] += share, r->sum[k + 1] -= share * (double)error[i];
  }
}

// Few pixels move a knot little; it never falls.
void vt_finish_response(vt_response *r) {
  for (int k = 0; k <= VT_RESPONSE_STEPS; k++) {
    double v = (double)k / VT_RESPONSE_STEPS + r->sum[k] / (r->weight[k] + 20);
    r->value[k] = (float)(v < 0 ? 0 : v > 1 ? 1 : v);
    if (k && r->value[k] < r->value[k - 1]) r->value[k] = r->value[k - 1];
  }
}

static double respond(const vt_response *r, double alpha, double *slope) {
  double at = alpha * VT_RESPONSE_STEPS;
  int k = at >= VT_RESPONSE_STEPS ? VT_RESPONSE_STEPS - 1 : (int)at;
  double low = (double)r->value[k], rise = (double)r->value[k + 1] - low;
  *slope = rise * VT_RESPONSE_STEPS;
  return low + (at - k) * rise;
}

// ---- comparison

typedef struct compare_job {
  const vt_silhouette *silhouette;
  const vt_soft_volume *volume;
  const vt_response *response;
  const double *smooth;
  const vt_camera *camera;
  double distance;
  float *error, (*by_motion)[VT_SILHOUETTE_COLUMNS];
} compare_job;

static double smooth_factor(const vt_camera *camera, const vt_silhouette_pixel *pixel, const double *smooth,
                            double term[VT_SMOOTH_TERMS]) {
  double half = 0.5 * (camera->width > camera->height ? camera->width : camera->height);
  double x = (pixel->x + 0.5 - 0.5 * camera->width) / half, y = (pixel->y + 0.5 - 0.5 * camera->height) / half, sum = 0;
  const double terms[VT_SMOOTH_TERMS] = {1, x, y, x * x, x * y, y * y};
  for (int k = 0; k < VT_SMOOTH_TERMS; k++) term[k] = terms[k], sum += smooth[k] * terms[k];
  return exp(sum);
}

static void compare_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  const compare_job *job = user;
  const vt_camera *camera = job->camera;
  for (size_t i = begin; i < end; i++) {
    const vt_silhouette_pixel *pixel = &job->silhouette->pixels[i];
    vt_ray ray = vt_camera_ray(camera, pixel->x + 0.5, pixel->y + 0.5);
    double sum[6], slope, term[VT_SMOOTH_TERMS], factor = smooth_factor(camera, pixel, job->smooth, term);
    double tau = factor * vt_trace_soft_ray(job->volume, &ray, job->by_motion ? sum : NULL), left = exp(-tau);
    job->error[i] = (float)respond(job->response, 1 - left, &slope) - pixel->alpha;
    if (!job->by_motion) continue;
    vt_vec3 g = vt_mul(&camera->rotation, vt_v3(sum[0], sum[1], sum[2]));
    vt_vec3 tg = vt_mul(&camera->rotation, vt_v3(sum[3], sum[4], sum[5])), d = vt_mul(&camera->rotation, ray.direction);
    vt_vec3 turn = vt_cross(tg, d);
    g = vt_sub(g, vt_scale(d, vt_dot(g, d))); // along the ray the integral is 0, and only its rounding would be seen
    double row[7] = {turn.x, turn.y, turn.z, job->distance * g.x, job->distance * g.y, job->distance * g.z,
                                         -(d.x * tg.x + d.y * tg.y)};
    for (int k = 0; k < 7; k++) job->by_motion[i][k] = (float)(slope * left * factor * row[k]);
    for (int k = 0; k < VT_SMOOTH_TERMS; k++) job->by_motion[i][7 + k] = (float)(slope * left * tau * term[k]);
  }
}

vt_status vt_compare_silhouette(vt_context *context, const vt_silhouette *silhouette, const vt_soft_volume *volume,
                                const vt_response *response, const double smooth[VT_SMOOTH_TERMS], const vt_camera *camera,
                                double distance, float *error, float (*by_motion)[VT_SILHOUETTE_COLUMNS]) {
  compare_job job = {silhouette, volume, response, smooth, camera, distance, error, by_motion};
  return vt_parallel(context, (size_t)silhouette->count, 128, compare_some, &job);
}
