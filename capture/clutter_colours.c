// clutter_colours.c - which pixels look like the tree, by colours learned where it is known
// SPDX-License-Identifier: BSD-3-Clause
//
// Landmarks and strokes say of some thousand pixels of a photograph what they are, and smooth areas are rest
// (clutter_texture.c). From these, from what drawn photographs carry over (clutter_teach.c), and from the second round
// on from all pixels as they were labelled last, each colour learns how often it is tree, near here and in general:
//   p(c, x) = (T(c, x) + kappa g(c)) / (T(c, x) + R(c, x) + kappa)
// T and R are masses of tree and rest in cells of CIELab, roughness and position (clutter_grid.c), and g is the same
// over all photographs, without position and with equal masses of both: what nobody labelled nearby is judged by the
// colours of the whole capture. The nearness matters: the same green is tree in the middle and a neighbour's leaf at
// the side. p becomes the prior of a random walk (clutter_walk.c), less sure where p is near a half; where the other
// photographs do not allow a tree (clutter_region.c), p falls.

#include "capture/clutter.h"
#include "base/lab.h"
#include "capture/clutter_grid.h"
#include "capture/clutter_teach.h"
#include "capture/scribbles.h"

#include <string.h>

enum { LANES = 16 };
#define KAPPA 5.0f       // pixels of one colour at one place, after blurring
#define SEED_WEIGHT 4.0f // of a pixel at a landmark, beside one that only was labelled so
#define UNTAUGHT 0.3f    // weight of what a photograph thinks itself where others were drawn on
#define FEWER 0.7f       // odds of tree where nothing is known
#define MOST_SMOOTH 0.8f
#define STROKE_CONFIDENCE 1000.0f
#define PRIOR_CONFIDENCE 1.0f
#define SEED_CONFIDENCE 1.0f

typedef struct label_job {
  vt_context *context;
  vt_clutter *clutter;
  const vt_landmarks *landmarks;
  const float *log_odds;
  int round;
  size_t *first;    // [count + 1] of the landmarks that a photograph sees
  uint32_t *points; // [seen_count]
  float linear[256];
  float *lanes[LANES]; // grids over all photographs, of one place; the first becomes their blurred sum
  float balance;       // rest over tree, of all masses
  vt_lesson *lessons;  // of the photographs that the user drew on
  int lesson_count;
  vt_status *status; // [count]
} label_job;

// ---- learning

static vt_spot spot_of(const vt_clutter_photo *photo, const float *lab, const float *steps, size_t at) {
  size_t width = (size_t)photo->picture.width;
  return (vt_spot){{lab[3 * at], lab[3 * at + 1], lab[3 * at + 2]},
                   steps[at],
                   (float)(at % width) / (float)width,
                   (float)(at / width) / (float)photo->picture.height};
}

static float chance(float log_odds) {
  return 1 / (1 + expf(-log_odds));
}

// Calls for every pixel that something is known of: 3 x 3 around landmarks, strokes, and labelled ones after the first
// round.
static void learn_photo(const label_job *job, int i, const float *lab, const float *steps, float *grid, int places) {
  const vt_clutter_photo *photo = &job->clutter->photos[i];
  int width = photo->picture.width, height = photo->picture.height;
  for (size_t s = job->first[i]; s < job->first[i + 1]; s++) {
    uint32_t k = job->points[s];
    double pixel[2];
    if (!vt_clutter_project(photo, job->landmarks->items[k].position, pixel)) continue;
    float p = chance(job->log_odds[k]), sure = fabsf(2 * p - 1);
    for (int y = (int)pixel[1] - 1; y <= (int)pixel[1] + 1; y++)
      for (int x = (int)pixel[0] - 1; x <= (int)pixel[0] + 1; x++) {
        if (x < 0 || y < 0 || x >= width || y >= height) continue;
        size_t at = (size_t)y * (size_t)width + (size_t)x;
        vt_spot spot = spot_of(photo, lab, steps, at);
        vt_add_to_grid(grid, places, &spot, p, SEED_WEIGHT * sure);
      }
  }
  float own = job->round && job->lesson_count && !photo->said ? UNTAUGHT : 1;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      size_t at = (size_t)y * (size_t)width + (size_t)x;
      bool said = photo->said && photo->said[at] != VT_SAID_NOTHING;
      float p = said ? (photo->said[at] == VT_SAID_TREE ? 1 : 0) : job->round ? (float)photo->tree[at] / 255 : 0;
      float sure = job->round ? fabsf(2 * p - 1) : vt_smoothness(lab + 3 * at, steps[at]);
      if (!said && (sure < 0.2f || (photo->ignored.pixels && photo->ignored.pixels[at]))) continue;
      vt_spot spot = spot_of(photo, lab, steps, at);
      vt_add_to_grid(grid, places, &spot, p, said ? VT_SAID_WEIGHT : own * sure);
    }
}

static void hear_lessons(const label_job *job, int i, float *grid) {
  const vt_clutter_photo *photo = &job->clutter->photos[i];
  int chosen[VT_MOST_LESSONS], count = vt_choose_lessons(job->clutter, job->lessons, job->lesson_count, i, chosen);
  for (int n = 0; n < count; n++) {
    const vt_lesson *lesson = &job->lessons[chosen[n]];
    for (size_t k = 0; k < lesson->count && lesson->teacher != i; k++) {
      const vt_sample *sample = &lesson->samples[k];
      double pixel[2];
      if (!vt_clutter_project(photo, sample->world, pixel)) continue;
      vt_spot spot = {{sample->lab[0], sample->lab[1], sample->lab[2]},
                      sample->step,
                      (float)pixel[0] / (float)photo->lens.width,
                      (float)pixel[1] / (float)photo->lens.height};
      vt_add_to_grid(grid, VT_GRID_PLACES, &spot, sample->tree, sample->weight / (float)count);
    }
  }
}

static vt_status look_at_photo(const label_job *job, const vt_image *picture, float **lab, float **steps) {
  size_t count = (size_t)picture->width * (size_t)picture->height;
  *lab = VT_NEW(job->context, float, 3 * count);
  *steps = VT_NEW(job->context, float, count);
  if (!*lab || !*steps) return VT_OUT_OF_MEMORY;
  vt_lab_from_bytes(job->linear, picture->pixels, 3, count, *lab);
  return vt_find_steps(job->context, picture->width, picture->height, *lab, *steps);
}

// Photographs go to fixed lanes, which are added in their order: the same sums for any number of threads.
static void learn_lane(void *user, size_t begin, size_t end, int worker) {
  label_job *job = user;
  (void)worker;
  for (size_t lane = begin; lane < end; lane++)
    for (int i = (int)lane; i < job->clutter->count; i += LANES) {
      float *lab = NULL, *steps = NULL;
      job->status[i] = look_at_photo(job, &job->clutter->photos[i].picture, &lab, &steps);
      if (!job->status[i]) learn_photo(job, i, lab, steps, job->lanes[lane], 1);
      vt_free(job->context, lab);
      vt_free(job->context, steps);
    }
}

static void finish_general(label_job *job) {
  float *general = job->lanes[0], sums[2] = {0};
  for (int lane = 1; lane < LANES; lane++)
    for (size_t i = 0; i < 2 * VT_GRID_COLOURS; i++) general[i] += job->lanes[lane][i];
  vt_blur_grid(general, 1);
  for (size_t i = 0; i < 2 * VT_GRID_COLOURS; i++) sums[i & 1] += general[i];
  job->balance = sums[0] > 0 && sums[1] > 0 ? sums[1] / sums[0] : 1;
  float least = 1e-5f * (sums[0] + sums[1]) + 1e-6f; // a colour that nobody has seen is as likely one as the other
  for (size_t i = 0; i < 2 * VT_GRID_COLOURS; i++)
    general[i] = (i & 1 ? general[i] : general[i] * job->balance) + least;
}

// ---- labelling

static float possible_at(const vt_image *possible, float x, float y) { // x, y: share of the picture
  float u = x * (float)possible->width - 0.5f, v = y * (float)possible->height - 0.5f, sum = 0;
  int u0 = (int)floorf(u), v0 = (int)floorf(v);
  for (int k = 0; k < 4; k++) {
    int a = u0 + (k & 1), b = v0 + (k >> 1);
    float w = (k & 1 ? u - (float)u0 : 1 - u + (float)u0) * (k >> 1 ? v - (float)v0 : 1 - v + (float)v0);
    a = a < 0 ? 0 : a >= possible->width ? possible->width - 1 : a;
    b = b < 0 ? 0 : b >= possible->height ? possible->height - 1 : b;
    sum += w * (float)possible->pixels[(size_t)b * (size_t)possible->width + (size_t)a];
  }
  return sum / 255;
}

static void judge_pixels(const label_job *job, const vt_clutter_photo *photo, const float *lab, const float *steps,
                         const float *grid, float *prior, float *confidence) {
  int width = photo->picture.width, height = photo->picture.height;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      size_t at = (size_t)y * (size_t)width + (size_t)x;
      float near[2], general[2];
      vt_spot spot = spot_of(photo, lab, steps, at);
      vt_read_grids(grid, job->lanes[0], &spot, near, general);
      float p = (near[0] + KAPPA * general[0] / (general[0] + general[1])) / (near[0] + near[1] + KAPPA);
      float odds = FEWER * (1 - MOST_SMOOTH * vt_smoothness(lab + 3 * at, steps[at]));
      if (photo->possible.pixels) {
        float allowed = fminf(1, 2 * possible_at(&photo->possible, spot.x, spot.y));
        odds *= allowed * allowed;
      }
      p = p * odds / (p * odds + (1 - p));
      prior[at] = p;
      confidence[at] = PRIOR_CONFIDENCE * (fabsf(2 * p - 1) + 0.02f);
      if (!photo->said || photo->said[at] == VT_SAID_NOTHING) continue;
      prior[at] = photo->said[at] == VT_SAID_TREE ? 1 : 0;
      confidence[at] = STROKE_CONFIDENCE;
    }
}

static void seed_pixels(const label_job *job, int i, float *prior, float *confidence) {
  const vt_clutter_photo *photo = &job->clutter->photos[i];
  for (size_t s = job->first[i]; s < job->first[i + 1]; s++) {
    uint32_t k = job->points[s];
    double pixel[2];
    if (!vt_clutter_project(photo, job->landmarks->items[k].position, pixel)) continue;
    size_t at = (size_t)pixel[1] * (size_t)photo->picture.width + (size_t)pixel[0];
    if (confidence[at] >= STROKE_CONFIDENCE) continue;
    float p = chance(job->log_odds[k]), sure = (2 * p - 1) * (2 * p - 1) * SEED_CONFIDENCE;
    prior[at] = (prior[at] * confidence[at] + p * sure) / (confidence[at] + sure + 1e-6f);
    confidence[at] += sure;
  }
}

static vt_status label_photo(label_job *job, int i) {
  vt_clutter_photo *photo = &job->clutter->photos[i];
  vt_context *context = job->context;
  size_t count = (size_t)photo->picture.width * (size_t)photo->picture.height;
  float *grid = VT_NEW(context, float, 2 * (size_t)VT_GRID_PLACES * VT_GRID_COLOURS);
  float *lab = NULL, *steps = NULL, *prior = VT_NEW(context, float, count), *confidence = VT_NEW(context, float, count);
  float *tree = VT_NEW(context, float, count);
  vt_status status = grid && prior && confidence && tree ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) status = look_at_photo(job, &photo->picture, &lab, &steps);
  if (!status) {
    learn_photo(job, i, lab, steps, grid, VT_GRID_PLACES);
    if (!photo->said) hear_lessons(job, i, grid);
    vt_blur_grid(grid, VT_GRID_PLACES);
    judge_pixels(job, photo, lab, steps, grid, prior, confidence);
    seed_pixels(job, i, prior, confidence);
    memcpy(tree, prior, count * sizeof *tree);
    status = vt_walk_labels(context, photo->picture.width, photo->picture.height, lab, prior, confidence, tree);
  }
  for (size_t at = 0; at < count && !status; at++) photo->tree[at] = (uint8_t)(255 * tree[at] + 0.5f);
  vt_free(context, grid);
  vt_free(context, lab);
  vt_free(context, steps);
  vt_free(context, prior);
  vt_free(context, confidence);
  vt_free(context, tree);
  return status;
}

static void label_block(void *user, size_t begin, size_t end, int worker) {
  label_job *job = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) job->status[i] = label_photo(job, (int)i);
}

// ---- all

static vt_status list_sights(vt_context *context, label_job *job) {
  const vt_landmarks *landmarks = job->landmarks;
  size_t count = (size_t)job->clutter->count;
  job->first = VT_NEW(context, size_t, count + 2);
  job->points = VT_NEW(context, uint32_t, landmarks->seen_count + 1);
  if (!job->first || !job->points) return VT_OUT_OF_MEMORY;
  for (size_t s = 0; s < landmarks->seen_count; s++) job->first[landmarks->seen_by[s] + 2]++;
  for (size_t i = 2; i < count + 2; i++) job->first[i] += job->first[i - 1];
  for (size_t k = 0; k < landmarks->count; k++)
    for (uint32_t s = 0; s < landmarks->items[k].count; s++)
      job->points[job->first[landmarks->seen_by[landmarks->items[k].first + s] + 1]++] = (uint32_t)k;
  return VT_OK;
}

static vt_status make_lessons(label_job *job) {
  vt_status status = VT_OK;
  job->lessons = VT_NEW(job->context, vt_lesson, (size_t)job->clutter->count);
  if (!job->lessons) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < job->clutter->count && !status; i++) {
    const vt_clutter_photo *photo = &job->clutter->photos[i];
    float *lab = NULL, *steps = NULL;
    if (!photo->said) continue;
    status = look_at_photo(job, &photo->picture, &lab, &steps);
    if (!status)
      status = vt_make_lesson(job->context, job->clutter, i, job->landmarks, job->points + job->first[i],
                              job->first[i + 1] - job->first[i], lab, steps, job->round > 0,
                              &job->lessons[job->lesson_count++]);
    vt_free(job->context, lab);
    vt_free(job->context, steps);
  }
  return status;
}

vt_status vt_label_pixels(vt_context *context, vt_clutter *clutter, const vt_landmarks *landmarks,
                          const float *log_odds, int round) {
  size_t count = (size_t)clutter->count;
  label_job job = {
      .context = context, .clutter = clutter, .landmarks = landmarks, .log_odds = log_odds, .round = round};
  vt_fill_srgb_table(job.linear);
  float *lanes = VT_NEW(context, float, 2 * LANES * (size_t)VT_GRID_COLOURS);
  job.status = VT_NEW(context, vt_status, count);
  vt_status status = lanes && job.status ? list_sights(context, &job) : VT_OUT_OF_MEMORY;
  for (int lane = 0; lane < LANES && lanes; lane++) job.lanes[lane] = lanes + 2 * (size_t)lane * VT_GRID_COLOURS;
  if (!status) status = make_lessons(&job);
  if (!status) status = vt_parallel(context, LANES, 1, learn_lane, &job);
  for (size_t i = 0; i < count && !status; i++) status = job.status[i];
  if (!status) finish_general(&job);
  if (!status) status = vt_parallel(context, count, 1, label_block, &job);
  for (size_t i = 0; i < count && !status; i++) status = job.status[i];
  for (int i = 0; i < job.lesson_count; i++) vt_free(context, job.lessons[i].samples);
  vt_free(context, job.lessons);
  vt_free(context, lanes);
  vt_free(context, job.status);
  vt_free(context, job.first);
  vt_free(context, job.points);
  return status;
}
