// backdrop.c - what stands behind the object: a sky, or a studio's cloth
// SPDX-License-Identifier: BSD-3-Clause
//
// The sky is a function of the direction in the world alone (it is infinitely far away), so that photographs of one
// part of it agree: a gradient with clouds above the horizon, haze at it, meadow below it. Clouds are fractal value
// noise over the sphere of directions, squeezed in height; laid out over a plane, as clouds are, they would be finer
// than a pixel at the horizon and shimmer. The cloth is a function of the place in the picture, as in a studio where
// the object turns and the backdrop does not: hanging folds, the lamp's falling off, and a weave that fades where it
// would be finer than pixels.
//
// Where the object covers a part of a pixel the two are mixed in linear light, as a camera does: I = alpha F + (1 - alpha) B
// before the sRGB curve. (Pictures with alpha are composited on encoded values everywhere else here.)

#include "base/rng.h"
#include "datasets-synthetic/encode.h"
#include "datasets-synthetic/sky.h"
#include "datasets-synthetic/synthetic.h"

typedef struct backdrop {
  vt_backdrop kind;
  uint32_t seed;
  vt_vec3 sun;
  double cover;         // of clouds: threshold of the noise
  double folds[6][3];   // of the cloth: waves over the width, phase, size
  double tint[3], lamp; // of the cloth, encoded; where the lamp's middle is over the width
} backdrop;

// ---- noise

static double lattice(uint32_t seed, int64_t x, int64_t y, int64_t z) { // 0..1
  uint64_t h =
      (uint64_t)x * 0x9e3779b97f4a7c15u ^ (uint64_t)y * 0xc2b2ae3d27d4eb4fu ^ (uint64_t)z * 0x165667b19e3779f9u;
  h = (h ^ seed) * 0xd6e8feb86659fd93u, h ^= h >> 32, h *= 0xd6e8feb86659fd93u, h ^= h >> 32;
  return (double)(h >> 11) * (1.0 / 9007199254740992.0);
}

static double value_noise(uint32_t seed, vt_vec3 p) { // 0..1, smooth
  double x = floor(p.x), y = floor(p.y), z = floor(p.z), f[3] = {p.x - x, p.y - y, p.z - z}, sum = 0;
  for (int k = 0; k < 3; k++) f[k] = f[k] * f[k] * f[k] * (f[k] * (f[k] * 6 - 15) + 10);
  for (int k = 0; k < 8; k++) {
    double weight = (k & 1 ? f[0] : 1 - f[0]) * (k & 2 ? f[1] : 1 - f[1]) * (k & 4 ? f[2] : 1 - f[2]);
    sum += weight * lattice(seed, (int64_t)x + (k & 1), (int64_t)y + (k >> 1 & 1), (int64_t)z + (k >> 2));
  }
  return sum;
}

static double fractal_noise(uint32_t seed, vt_vec3 p, int octaves) { // 0..1
  double sum = 0, size = 0.5, total = 0;
  for (int k = 0; k < octaves; k++) {
    sum += size * value_noise(seed + (uint32_t)k * 7919u, p), total += size;
    // Twice as fine and turned, so that the lattices of two octaves have no planes in common.
    p = vt_v3(1.6 * p.x + 1.2 * p.y + 3.1, -1.2 * p.x + 1.6 * p.y + 5.7, 2.03 * p.z + 1.3), size *= 0.52;
  }
  return sum / total;
}

static double smooth_step(double low, double high, double x) {
  double t = fmin(fmax((x - low) / (high - low), 0), 1);
  return t * t * (3 - 2 * t);
}

// ---- sky

static double encode(double linear) {
  double l = fmin(fmax(linear, 0), 1);
  return l <= 0.0031308 ? 12.92 * l : 1.055 * pow(l, 1 / 2.4) - 0.055;
}

static void look_at_sky(const backdrop *b, vt_vec3 d, double rgb[3]) {
  static const double zenith[3] = {0.10, 0.22, 0.52}, horizon[3] = {0.60, 0.71, 0.82}, cloud[3] = {0.93, 0.93, 0.95},
                      shade[3] = {0.50, 0.54, 0.62}, meadow[3] = {0.13, 0.17, 0.055}, soil[3] = {0.20, 0.16, 0.09};
  double glow = pow(fmax(vt_dot(d, b->sun), 0), 12) * 0.35, low = pow(1 - fmax(d.z, 0), 3.2);
  vt_vec3 at = vt_v3(2.6 * d.x, 2.6 * d.y, 6.5 * d.z);
  double here = fractal_noise(b->seed, at, 6), cover = smooth_step(b->cover, b->cover + 0.16, here);
  // A cloud is darker where there is more of it towards the sun.
  double there = fractal_noise(b->seed, vt_add(at, vt_scale(b->sun, 0.25)), 4);
  double lit = smooth_step(-0.12, 0.2, here - there + 0.05);
  double haze = 1 - smooth_step(0, 0.16, d.z), below = smooth_step(0.004, -0.004, d.z);
  double grass = fractal_noise(b->seed + 99, vt_v3(14 * d.x, 14 * d.y, 40 * d.z), 5);
  double patch = smooth_step(0.42, 0.62, fractal_noise(b->seed + 7, vt_v3(3 * d.x, 3 * d.y, 9 * d.z), 3));
  double far = exp(8 * fmin(d.z, 0)); // of the ground: how much of it is haze
  for (int k = 0; k < 3; k++) {
    double sky = zenith[k] + (horizon[k] - zenith[k]) * low + glow;
    double white = shade[k] + (cloud[k] - shade[k]) * lit + 0.3 * glow;
    sky += (white - sky) * cover * (1 - 0.75 * haze);
    double ground = (meadow[k] + (soil[k] - meadow[k]) * patch) * (0.45 + 1.1 * grass);
    ground += (0.8 * horizon[k] - ground) * far * 0.75;
    rgb[k] = encode(sky + (ground - sky) * below);
  }
}

// ---- cloth

static void look_at_cloth(const backdrop *b, double x, double y, double height_pixels,
                          double rgb[3]) { // x, y in heights
  double slack = 0.04 * sin(5 * y + 2) + 0.02 * sin(11 * y + 5 * x), fold = 0;
  for (int k = 0; k < 6; k++) {
    double wave = sin(2 * VT_PI * b->folds[k][0] * (x + slack * (0.4 + 0.6 * y)) + b->folds[k][1]);
    fold += b->folds[k][2] * (wave - 0.35 * wave * wave); // rounded ridges, sharper valleys
  }
  double lamp = exp(-1.1 * ((x - b->lamp) * (x - b->lamp) + 0.6 * (y - 0.38) * (y - 0.38)));
  double threads = 150, fine = smooth_step(1.9, 3.2, height_pixels / threads); // pixels a thread
  double weave = 0.012 * fine * sin(2 * VT_PI * threads * x) * sin(2 * VT_PI * threads * y);
  double fuzz = 0.02 * (fractal_noise(b->seed + 3, vt_v3(40 * x, 40 * y, 0), 3) - 0.5);
  double light = (0.35 + 0.95 * lamp) * (1 + 0.42 * fold);
  for (int k = 0; k < 3; k++) rgb[k] = b->tint[k] * light + weave + fuzz;
}

static backdrop make_backdrop(const vt_synthetic_desc *desc) {
  backdrop b = {
      .kind = desc->backdrop, .seed = desc->seed * 2654435761u + 17, .sun = vt_sun_direction(desc->seed, desc->sun)};
  vt_rng rng = vt_seed_rng(desc->seed, 5);
  b.cover = vt_random_between(&rng, 0.46, 0.56);
  for (int k = 0; k < 6; k++) {
    b.folds[k][0] = vt_random_between(&rng, 1.5, 2.5) * (1 + k);
    b.folds[k][1] = vt_random_between(&rng, 0, 2 * VT_PI);
    b.folds[k][2] = vt_random_between(&rng, 0.3, 0.7) / (1 + 0.8 * k);
  }
  double grey = vt_random_between(&rng, 0.15, 0.19), blue = vt_random_between(&rng, -0.02, 0.04);
  b.tint[0] = grey - blue, b.tint[1] = grey, b.tint[2] = grey + 1.3 * blue;
  b.lamp = vt_random_between(&rng, 0.3, 0.7);
  return b;
}

typedef struct backdrop_job {
  vt_context *context;
  backdrop backdrop;
  vt_encode_table encode;
  vt_views *views;
} backdrop_job;

static double linear_of(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

static uint8_t mix(const vt_encode_table *encode, double alpha, double object, double behind) { // both encoded, 0..1
  if (!(alpha > 0)) return vt_byte_of(behind);
  double light = alpha * linear_of(object) + (1 - alpha) * linear_of(behind);
  return vt_byte_of((double)vt_encode(encode, (float)light));
}

static void fill_views(void *user, size_t begin, size_t end, int worker) {
  backdrop_job *job = user;
  for (size_t i = begin; i < end; i++) {
    vt_view *view = &job->views->items[i];
    vt_image *p = &view->picture;
    if (worker == 0) vt_progress(job->context, "backdrop", (double)i / job->views->count);
    for (int y = 0; y < p->height && !vt_cancelled(job->context); y++)
      for (int x = 0; x < p->width; x++) {
        uint8_t *pixel = p->pixels + 4 * ((size_t)y * (size_t)p->width + (size_t)x);
        double rgb[3], alpha = pixel[3] / 255.0;
        if (pixel[3] == 255) continue;
        if (job->backdrop.kind == VT_BACKDROP_SKY)
          look_at_sky(&job->backdrop, vt_camera_ray(&view->camera, x + 0.5, y + 0.5).direction, rgb);
        else
          look_at_cloth(&job->backdrop, (x + 0.5) / p->height, (y + 0.5) / p->height, p->height, rgb);
        for (int c = 0; c < 3; c++)
          pixel[c] = mix(&job->encode, alpha, pixel[c] / 255.0, fmin(fmax(rgb[c], 0), 1));
        pixel[3] = 255;
      }
  }
}

vt_status vt_put_before_backdrop(vt_context *ctx, const vt_synthetic_desc *desc, vt_views *views) {
  VT_ASSERT(desc->cookie == VT_COOKIE);
  if (desc->backdrop == VT_BACKDROP_NONE) return VT_OK;
  for (int i = 0; i < views->count; i++) VT_ASSERT(views->items[i].picture.channels == 4);
  backdrop_job job = {.context = ctx, .backdrop = make_backdrop(desc), .views = views};
  vt_make_encode_table(&job.encode);
  vt_status status = vt_parallel(ctx, (size_t)views->count, 1, fill_views, &job);
  vt_progress(ctx, "backdrop", 1);
  return status;
}
