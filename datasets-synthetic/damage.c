// damage.c - photographs and cameras made worse by known amounts
// SPDX-License-Identifier: BSD-3-Clause
//
// How much a method loses by noise, blur, wrong mattes or wrong cameras can only be said where each amount is known.
// Light meets things in this order: the lens bends and blurs it, the shutter lets more or less of it through, the
// sensor counts it, the camera's processor applies a white balance and packs a JPEG; then someone cuts a matte out of
// the picture, and someone computes where the camera stood. Each draw has a random generator of its own (seed, view,
// purpose), so that changing one amount does not change what another draws.
//
// Pose: the camera turns by an angle of normal distribution about an axis of any direction and moves by a distance of
// normal distribution in any direction, so that the root mean square of the angle is what was asked for. With R' = dR R
// and c' = c + dc, t' = -R' c'.

#include "datasets-synthetic/damage_matte.h"
#include "datasets-synthetic/damage_picture.h"
#include "datasets-synthetic/jpeg_loss.h"
#include "datasets-synthetic/synthetic.h"

typedef enum purpose { OF_EXPOSURE, OF_BALANCE, OF_SENSOR, OF_POSE, OF_HOLES, OF_MATTE } purpose;

typedef struct damage_job {
  vt_context *context;
  const vt_damage_desc *desc;
  vt_views *views;
  size_t scratch_size;
  float *scratch; // [worker][scratch_size]
} damage_job;

vt_damage_desc vt_default_damage_desc(void) {
  return (vt_damage_desc){.cookie = VT_COOKIE};
}

static vt_status check_desc(vt_context *ctx, const vt_damage_desc *d) {
  const struct {
    const char *name;
    double value, low, high;
  } amounts[] = {{"noise", d->noise, 0, 0.5},
                 {"blur", d->blur, 0, 50},
                 {"jpeg_quality", d->jpeg_quality, 0, 100},
                 {"exposure", d->exposure, 0, 4},
                 {"white_balance", d->white_balance, 0, 1},
                 {"distortion", d->distortion, -0.5, 0.5},
                 {"pose_degrees", d->pose_degrees, 0, 90},
                 {"pose_share", d->pose_share, 0, 0.5},
                 {"focal_share", d->focal_share, -0.5, 0.5},
                 {"matte_erosion", d->matte_erosion, -16, 16},
                 {"matte_blur", d->matte_blur, 0, 50},
                 {"matte_holes", d->matte_holes, 0, 0.9},
                 {"matte_noise", d->matte_noise, 0, 1}};
  for (size_t i = 0; i < sizeof amounts / sizeof *amounts; i++)
    if (!(amounts[i].value >= amounts[i].low && amounts[i].value <= amounts[i].high))
      return vt_fail(ctx, VT_BAD_INPUT, "damage: %s is %g; give %g to %g", amounts[i].name, amounts[i].value,
                     amounts[i].low, amounts[i].high);
  return VT_OK;
}

static vt_rng generator(const damage_job *job, size_t view, purpose what) {
  uint64_t z = job->desc->seed + 0x9e3779b97f4a7c15ull * (view + 1); // splitmix64: neighbours become strangers
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return vt_seed_rng(z ^ (z >> 31), (uint64_t)what);
}

// ---- picture

static void damage_light(const damage_job *job, size_t i, float *scratch) {
  const vt_damage_desc *d = job->desc;
  if (d->distortion == 0 && d->blur <= 0 && d->exposure <= 0 && d->noise <= 0 && d->white_balance <= 0) return;
  vt_view *view = &job->views->items[i];
  int width = view->picture.width, height = view->picture.height;
  size_t count = (size_t)width * (size_t)height;
  float *light = scratch, *other = scratch + 4 * count;
  vt_linear_from_bytes(view->picture.pixels, count, light);
  if (d->distortion != 0) {
    vt_bend_picture(&view->camera, d->distortion, light, other);
    float *bent = other;
    other = light, light = bent;
  }
  if (d->blur > 0) vt_blur_picture(light, width, height, 4, d->blur, other);
  vt_rng exposure = generator(job, i, OF_EXPOSURE), balance = generator(job, i, OF_BALANCE);
  vt_rng sensor = generator(job, i, OF_SENSOR);
  double gain = exp2(d->exposure * vt_random_normal(&exposure)), gains[3] = {1, 1, 1};
  gains[0] = exp(d->white_balance * vt_random_normal(&balance));
  gains[2] = exp(d->white_balance * vt_random_normal(&balance));
  vt_bytes_from_light(light, count, gain, d->noise, gains, &sensor, view->picture.pixels);
}

static bool is_opaque(const vt_image *picture) {
  for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; i++)
    if (picture->pixels[4 * i + 3] != 255) return false;
  return true;
}

static void damage_matte(const damage_job *job, size_t i, float *scratch) {
  const vt_damage_desc *d = job->desc;
  vt_image *picture = &job->views->items[i].picture;
  if (d->matte_erosion == 0 && d->matte_blur <= 0 && d->matte_holes <= 0 && d->matte_noise <= 0) return;
  if (is_opaque(picture)) return;
  int width = picture->width, height = picture->height;
  size_t count = (size_t)width * (size_t)height;
  vt_fill_transparent(picture->pixels, width, height, scratch); // what becomes visible has a neighbour's colour
  float *alpha = scratch, *other = scratch + count;
  for (size_t k = 0; k < count; k++) alpha[k] = (float)picture->pixels[4 * k + 3] / 255;
  if (d->matte_erosion != 0) vt_erode_matte(alpha, width, height, d->matte_erosion, other);
  if (d->matte_blur > 0) vt_blur_picture(alpha, width, height, 1, d->matte_blur, other);
  vt_rng holes = generator(job, i, OF_HOLES), noise = generator(job, i, OF_MATTE);
  if (d->matte_holes > 0) vt_punch_matte(alpha, width, height, d->matte_holes, &holes);
  for (size_t k = 0; k < count && d->matte_noise > 0; k++)
    alpha[k] += (float)(d->matte_noise * vt_random_normal(&noise));
  for (size_t k = 0; k < count; k++) {
    float a = alpha[k];
    picture->pixels[4 * k + 3] = (uint8_t)(a <= 0 ? 0 : a >= 1 ? 255 : a * 255 + 0.5f);
  }
}

static void clear_transparent(vt_image *picture) {
  for (size_t k = 0; k < (size_t)picture->width * (size_t)picture->height; k++) {
    uint8_t *p = picture->pixels + 4 * k;
    if (!p[3]) p[0] = p[1] = p[2] = 0;
  }
}

// ---- camera

static vt_vec3 random_direction(vt_rng *rng) {
  double z = vt_random_between(rng, -1, 1), angle = vt_random_between(rng, 0, 2 * VT_PI), r = sqrt(1 - z * z);
  return vt_v3(r * cos(angle), r * sin(angle), z);
}

// dR R, dR the turn by `angle` about `axis`.
static vt_mat3 turn_rotation(const vt_mat3 *rotation, vt_vec3 axis, double angle) {
  vt_mat3 out;
  for (int column = 0; column < 3; column++) { // Rodrigues' formula for each column
    vt_vec3 v = {rotation->m[column], rotation->m[3 + column], rotation->m[6 + column]};
    vt_vec3 turned = vt_add(vt_scale(v, cos(angle)), vt_scale(vt_cross(axis, v), sin(angle)));
    turned = vt_add(turned, vt_scale(axis, vt_dot(axis, v) * (1 - cos(angle))));
    out.m[column] = turned.x, out.m[3 + column] = turned.y, out.m[6 + column] = turned.z;
  }
  return out;
}

static void damage_camera(const damage_job *job, size_t i) {
  const vt_damage_desc *d = job->desc;
  vt_camera *camera = &job->views->items[i].camera;
  camera->fx *= 1 + d->focal_share, camera->fy *= 1 + d->focal_share;
  if (d->pose_degrees <= 0 && d->pose_share <= 0) return;
  vt_rng rng = generator(job, i, OF_POSE);
  vt_vec3 centre = vt_camera_centre(camera), axis = random_direction(&rng), way = random_direction(&rng);
  double angle = d->pose_degrees * VT_PI / 180 * vt_random_normal(&rng);
  double distance = d->pose_share * vt_length(centre) * vt_random_normal(&rng);
  camera->rotation = turn_rotation(&camera->rotation, axis, angle);
  centre = vt_add(centre, vt_scale(way, distance));
  camera->translation = vt_scale(vt_mul(&camera->rotation, centre), -1);
}

// ---- all of it

static void damage_views(void *user, size_t begin, size_t end, int worker) {
  damage_job *job = user;
  float *scratch = job->scratch + (size_t)worker * job->scratch_size;
  for (size_t i = begin; i < end && !vt_cancelled(job->context); i++) {
    vt_image *picture = &job->views->items[i].picture;
    if (worker == 0) vt_progress(job->context, "damage", (double)i / job->views->count);
    damage_light(job, i, scratch);
    if (job->desc->jpeg_quality > 0) {
      vt_fill_transparent(picture->pixels, picture->width, picture->height, scratch);
      vt_lose_jpeg(picture->pixels, picture->width, picture->height, job->desc->jpeg_quality, scratch);
    }
    damage_matte(job, i, scratch);
    clear_transparent(picture);
    damage_camera(job, i);
  }
}

vt_status vt_damage_views(vt_context *ctx, const vt_damage_desc *desc, vt_views *views) {
  VT_ASSERT(desc->cookie == VT_COOKIE);
  damage_job job = {.context = ctx, .desc = desc, .views = views};
  vt_status status = check_desc(ctx, desc);
  if (status) return status;
  for (int i = 0; i < views->count; i++) { // two pictures of four channels; every other use takes less, with its rims
    const vt_image *picture = &views->items[i].picture;
    VT_ASSERT(picture->channels == 4);
    size_t size = 8 * ((size_t)picture->width + 32) * ((size_t)picture->height + 32);
    if (size > job.scratch_size) job.scratch_size = size;
  }
  job.scratch = VT_NEW(ctx, float, (size_t)vt_thread_count(ctx) * job.scratch_size);
  if (!job.scratch) return VT_OUT_OF_MEMORY;
  status = vt_parallel(ctx, (size_t)views->count, 1, damage_views, &job);
  vt_progress(ctx, "damage", 1);
  vt_free(ctx, job.scratch);
  return status;
}
