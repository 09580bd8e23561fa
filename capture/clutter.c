// clutter.c - the tree told from what stands around it, by where it stands
// SPDX-License-Identifier: BSD-3-Clause
//
// In a hall or a garden nothing about a pixel says whether it is tree; where it stands does. All photographs are looked
// at together, reduced to about a megapixel:
//   1. the region: a sphere around the point that the cameras look at (clutter_region.c)
//   2. the landmarks of the calibration are judged: near it tree, far from it rest, the same colours alike
//   (clutter_points.c)
//   3. they are the seeds of every photograph; colours learned from them label the other pixels, by a random walk
//   within
//      edges                                                                     (clutter_colours.c, clutter_walk.c)
//   4. the photographs vote on a coarse grid which places are tree, and on the landmarks; back to 2, three rounds in
//   all
// A user's strokes (scribbles.c) go into 2, 3 and 4, and are never overruled where they are. The idea is that of
// Campbell, Vogiatzis, Hernandez, Cipolla ("Automatic 3D object segmentation in multiple views using volumetric
// graph-cuts", 2010): the cameras' fixation as the seed, colours learned from it, silhouettes made to agree. At the end
// each photograph is taken at its own size: within a narrow rim around the border alpha is the colour line between the
// surely tree and the surely rest around it, as in backdrop.c. What goes wrong: what touches the tree and has its
// colours comes along (ferns at its foot, a neighbour of the same kind within the region); what is as far away as the
// tree and white as a wall behind it (a pot) is cut off: say so by strokes.

#include "capture/clutter.h"
#include "capture/components.h"
#include "capture/masks.h"
#include "capture/matte.h"
#include "capture/scribbles.h"
#include "capture/spread.h"

#include <string.h>

enum { WORKING_SIDE = 1280, VOTES = 3 }; // pixels of the longer side; rounds

void vt_free_clutter(vt_context *context, vt_clutter *clutter) {
  for (int i = 0; i < clutter->count && clutter->photos; i++) {
    vt_clutter_photo *photo = &clutter->photos[i];
    vt_free_image(context, &photo->picture);
    vt_free_image(context, &photo->possible);
    vt_free_image(context, &photo->ignored);
    vt_free(context, photo->said);
    vt_free(context, photo->tree);
  }
  vt_free(context, clutter->photos);
  *clutter = (vt_clutter){0};
}

// ---- the photographs, reduced

typedef struct load_job {
  vt_context *context;
  const vt_photos *photos;
  vt_clutter *clutter;
  int factor;
  vt_status *status;
} load_job;

static vt_status reduce_rgb(vt_context *context, const vt_image *in, int factor, vt_image *out) {
  vt_status status =
      vt_make_image(context, (in->width + factor - 1) / factor, (in->height + factor - 1) / factor, 3, out);
  size_t channels = (size_t)in->channels;
  for (int y = 0; y < out->height && !status; y++)
    for (int x = 0; x < out->width; x++) {
      unsigned sum[3] = {0}, count = 0;
      for (int v = y * factor; v < (y + 1) * factor && v < in->height; v++)
        for (int u = x * factor; u < (x + 1) * factor && u < in->width; u++, count++)
          for (size_t c = 0; c < 3; c++)
            sum[c] += in->pixels[((size_t)v * (size_t)in->width + (size_t)u) * channels + c];
      for (size_t c = 0; c < 3; c++)
        out->pixels[((size_t)y * (size_t)out->width + (size_t)x) * 3 + c] = (uint8_t)((sum[c] + count / 2) / count);
    }
  return status;
}

static vt_status load_photo(load_job *job, int i) {
  const vt_photo *photo = &job->photos->items[i];
  vt_clutter_photo *out = &job->clutter->photos[i];
  vt_image picture = {0};
  vt_status status = vt_read_photo(job->context, photo, &picture);
  if (!status) status = reduce_rgb(job->context, &picture, job->factor, &out->picture);
  vt_free_image(job->context, &picture);
  if (!status && photo->ignored)
    status = vt_read_ignored(job->context, photo, out->picture.width, out->picture.height, &out->ignored);
  if (status) return status;
  out->lens = photo->lens;
  double f = job->factor; // exactly, as in develop.c
  out->lens.fx /= f, out->lens.fy /= f, out->lens.cx /= f, out->lens.cy /= f;
  out->lens.width = out->picture.width;
  out->lens.height = out->picture.height;
  out->rotation = photo->rotation;
  out->translation = photo->translation;
  out->tree = VT_NEW(job->context, uint8_t, (size_t)out->picture.width * (size_t)out->picture.height);
  return out->tree ? VT_OK : VT_OUT_OF_MEMORY;
}

static void load_block(void *user, size_t begin, size_t end, int worker) {
  load_job *job = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) job->status[i] = load_photo(job, (int)i);
}

// About a megapixel, less where all together would take a quarter of the memory.
static int choose_factor(vt_context *context, const vt_photos *photos) {
  int longest = 1;
  uint64_t pixels = 0, bound = vt_memory_bound(context) / 4;
  for (int i = 0; i < photos->count; i++) {
    const vt_photo *photo = &photos->items[i];
    longest = photo->width > longest ? photo->width : photo->height > longest ? photo->height : longest;
    pixels += (uint64_t)photo->width * (uint64_t)photo->height;
  }
  int factor = (longest + WORKING_SIDE - 1) / WORKING_SIDE;
  while (bound && 5 * pixels / ((uint64_t)factor * (uint64_t)factor) > bound) factor++;
  return factor;
}

static vt_status load_photos(vt_context *context, const vt_photos *photos, vt_clutter *out) {
  size_t count = (size_t)photos->count;
  *out = (vt_clutter){.count = photos->count, .photos = VT_NEW(context, vt_clutter_photo, count)};
  load_job job = {context, photos, out, choose_factor(context, photos), VT_NEW(context, vt_status, count)};
  vt_status status = out->photos && job.status ? vt_parallel(context, count, 1, load_block, &job) : VT_OUT_OF_MEMORY;
  for (int i = 0; i < photos->count && !status; i++) {
    if (!job.status[i]) continue;
    vt_clear_error(context); // of several bad files the first is the one in the sentence
    vt_free_image(context, &out->photos[i].picture);
    vt_free_image(context, &out->photos[i].ignored);
    status = load_photo(&job, i);
  }
  vt_free(context, job.status);
  return status;
}

// ---- strokes

static vt_status read_strokes(vt_context *context, const vt_photos *photos, char *const *files, vt_clutter *out) {
  size_t tree = 0, rest = 0;
  int drawn = 0;
  vt_status status = VT_OK;
  for (int i = 0; i < photos->count && !status; i++) {
    vt_clutter_photo *photo = &out->photos[i];
    size_t own_tree = 0, own_rest = 0;
    if (!files[i]) continue;
    photo->said = VT_NEW(context, uint8_t, (size_t)photo->picture.width * (size_t)photo->picture.height);
    status = photo->said ? vt_read_scribble(context, files[i], &photos->items[i], photo->picture.width,
                                            photo->picture.height, photo->said, &own_tree, &own_rest)
                         : VT_OUT_OF_MEMORY;
    tree += own_tree, rest += own_rest;
    drawn++;
  }
  if (status) return status;
  vt_log(context, VT_LOG_NORMAL, "scribbles: on %d photographs, %zu pixels of tree and %zu of what is not", drawn, tree,
         rest);
  if (!tree)
    vt_log(context, VT_LOG_NORMAL,
           "scribbles: no stroke says what is tree; draw some in green or white if the tree is not found");
  if (!rest)
    vt_log(context, VT_LOG_NORMAL,
           "scribbles: no stroke says what is not tree; draw some in red or black if too much is taken along");
  return VT_OK;
}

static vt_status load_strokes(vt_context *context, const vt_photos *photos, const char *folder, vt_clutter *out) {
  char **files = VT_NEW(context, char *, (size_t)photos->count);
  if (!files) return VT_OUT_OF_MEMORY;
  vt_status status = vt_find_scribbles(context, folder, photos, files);
  if (!status) status = read_strokes(context, photos, files, out);
  for (int i = 0; i < photos->count; i++) vt_free(context, files[i]);
  vt_free(context, files);
  return status;
}

// ---- all photographs together

static void probe_tree(vt_context *context, const vt_clutter *clutter, int round) {
  for (int i = 0; i < clutter->count && vt_wants_probes(context); i++) {
    const vt_clutter_photo *photo = &clutter->photos[i];
    vt_fimage image = {0};
    char name[64];
    if (vt_make_fimage(context, photo->picture.width, photo->picture.height, 1, &image)) return;
    size_t count = (size_t)image.width * (size_t)image.height;
    for (size_t p = 0; p < count; p++) image.pixels[p] = (float)photo->tree[p] / 255;
    snprintf(name, sizeof name, "clutter-%04d-round-%d", i, round);
    vt_probe(context, name, &image);
    vt_free_fimage(context, &image);
  }
}

typedef struct speck_job {
  vt_context *context;
  vt_clutter *clutter;
  vt_status *status;
} speck_job;

// Islands of less than 1/5000 of the picture are leaves of nothing; those that the user drew on stay.
static void drop_specks(void *user, size_t begin, size_t end, int worker) {
  speck_job *job = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    vt_clutter_photo *photo = &job->clutter->photos[i];
    int width = photo->picture.width, height = photo->picture.height;
    size_t count = (size_t)width * (size_t)height;
    uint8_t *parts = VT_NEW(job->context, uint8_t, count);
    job->status[i] = parts
                         ? vt_find_parts(job->context, width, height, photo->tree, 128, 128, count / 5000 + 1, 0, parts)
                         : VT_OUT_OF_MEMORY;
    for (size_t p = 0; p < count && !job->status[i]; p++)
      if (photo->tree[p] >= 128 && parts[p] == VT_PART_NONE && !(photo->said && photo->said[p] == VT_SAID_TREE))
        photo->tree[p] = 0;
    vt_free(job->context, parts);
  }
}

static vt_status tidy(vt_context *context, vt_clutter *clutter) {
  size_t count = (size_t)clutter->count;
  speck_job job = {context, clutter, VT_NEW(context, vt_status, count)};
  vt_status status = job.status ? vt_parallel(context, count, 1, drop_specks, &job) : VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && !status; i++) status = job.status[i];
  vt_free(context, job.status);
  return status;
}

static vt_status run_rounds(vt_context *context, const vt_landmarks *landmarks, vt_clutter *clutter) {
  float *log_odds = VT_NEW(context, float, landmarks->count + 1);
  vt_status status = log_odds ? VT_OK : VT_OUT_OF_MEMORY;
  for (int round = 0; round < VOTES && !status; round++) {
    status = vt_judge_landmarks(context, clutter, landmarks, round > 0, log_odds);
    if (!status) status = vt_label_pixels(context, clutter, landmarks, log_odds, round);
    if (!status && round + 1 < VOTES) status = vt_vote_clutter(context, clutter);
    if (!status) probe_tree(context, clutter, round);
    vt_progress(context, "clutter", (double)(round + 1) / VOTES);
  }
  size_t tree = 0;
  for (size_t k = 0; k < landmarks->count && !status; k++) tree += log_odds[k] > 0;
  if (!status && landmarks->count)
    vt_log(context, VT_LOG_NORMAL, "clutter: %zu of %zu landmarks stand on the tree", tree, landmarks->count);
  vt_free(context, log_odds);
  return status;
}

vt_status vt_separate_clutter(vt_context *context, const vt_photos *photos, const char *scribbles, vt_clutter *out) {
  *out = (vt_clutter){0};
  vt_status status = load_photos(context, photos, out);
  if (!status && scribbles) status = load_strokes(context, photos, scribbles, out);
  if (!status) status = vt_find_clutter_region(context, &photos->landmarks, out);
  if (!status) status = run_rounds(context, &photos->landmarks, out);
  if (!status) status = tidy(context, out);
  if (status) vt_free_clutter(context, out);
  return status;
}

// ---- one photograph at its own size

static float tree_at(const vt_clutter_photo *photo, int x, int y, double sx, double sy) { // bilinear, 0..1
  double u = fmax(0, (x + 0.5) * sx - 0.5), v = fmax(0, (y + 0.5) * sy - 0.5);
  int width = photo->picture.width, height = photo->picture.height;
  int u0 = (int)u < width ? (int)u : width - 1, v0 = (int)v < height ? (int)v : height - 1;
  int u1 = u0 + 1 < width ? u0 + 1 : u0, v1 = v0 + 1 < height ? v0 + 1 : v0;
  double a = fmin(u - u0, 1), b = fmin(v - v0, 1);
  const uint8_t *t = photo->tree;
  double top = (1 - a) * t[(size_t)v0 * (size_t)width + (size_t)u0] + a * t[(size_t)v0 * (size_t)width + (size_t)u1];
  double low = (1 - a) * t[(size_t)v1 * (size_t)width + (size_t)u0] + a * t[(size_t)v1 * (size_t)width + (size_t)u1];
  return (float)(((1 - b) * top + b * low) / 255);
}

#define EVEN 0.5f
#define LINE_NOISE 30.0f // of 255; where tree and rest differ by less, the colour line says little

// Alpha where all around are alike; -1 in the rim between.
static float settled(const float *tree, int width, int height, int x, int y) {
  float own = tree[(size_t)y * (size_t)width + (size_t)x], least = own, most = own;
  for (int v = y > 0 ? y - 1 : 0; v <= y + 1 && v < height; v++)
    for (int u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; u++) {
      float t = tree[(size_t)v * (size_t)width + (size_t)u];
      least = fminf(least, t), most = fmaxf(most, t);
    }
  return least > EVEN ? 1 : most < EVEN ? 0 : -1;
}

static float on_colour_line(const uint8_t *i, const uint8_t *f, const uint8_t *b, float guess) {
  float along = 0, length = 0;
  for (int c = 0; c < 3; c++) {
    float d = (float)f[c] - (float)b[c];
    along += d * ((float)i[c] - (float)b[c]);
    length += d * d;
  }
  float line = length > 0 ? fmaxf(0, fminf(1, along / length)) : guess;
  float trust = length / (length + LINE_NOISE * LINE_NOISE);
  return trust * line + (1 - trust) * guess;
}

static vt_status make_alpha(vt_context *context, const vt_image *rgb, const float *tree, vt_image *rgba) {
  size_t count = (size_t)rgb->width * (size_t)rgb->height;
  uint8_t *sure_tree = VT_NEW(context, uint8_t, count), *sure_rest = VT_NEW(context, uint8_t, count);
  vt_image f = {0}, b = {0};
  vt_status status = sure_tree && sure_rest ? VT_OK : VT_OUT_OF_MEMORY;
  for (int y = 0; y < rgb->height && !status; y++)
    for (int x = 0; x < rgb->width; x++) {
      size_t p = (size_t)y * (size_t)rgb->width + (size_t)x;
      float alpha = settled(tree, rgb->width, rgb->height, x, y);
      sure_tree[p] = alpha > 0.5f;
      sure_rest[p] = alpha > -0.5f && alpha < 0.5f;
    }
  if (!status) status = vt_spread_colours(context, rgb, sure_tree, &f);
  if (!status) status = vt_spread_colours(context, rgb, sure_rest, &b);
  for (size_t p = 0; p < count && !status; p++) {
    memcpy(rgba->pixels + 4 * p, rgb->pixels + 3 * p, 3);
    float guess = fmaxf(0, fminf(1, 0.5f + 2 * (tree[p] - EVEN)));
    float alpha = sure_tree[p]   ? 1
                  : sure_rest[p] ? 0
                                 : on_colour_line(rgb->pixels + 3 * p, f.pixels + 3 * p, b.pixels + 3 * p, guess);
    rgba->pixels[4 * p + 3] = (uint8_t)(255 * alpha + 0.5f);
  }
  vt_free_image(context, &f);
  vt_free_image(context, &b);
  vt_free(context, sure_tree);
  vt_free(context, sure_rest);
  return status;
}

vt_status vt_matte_clutter(vt_context *context, const vt_clutter *clutter, int photo, const vt_image *rgb,
                           vt_image *out_rgba) {
  const vt_clutter_photo *from = &clutter->photos[photo];
  double factor = round((double)rgb->width / from->picture.width);
  float *tree = VT_NEW(context, float, (size_t)rgb->width *(size_t)rgb->height);
  vt_status status = tree ? vt_make_image(context, rgb->width, rgb->height, 4, out_rgba) : VT_OUT_OF_MEMORY;
  for (int y = 0; y < rgb->height && !status; y++)
    for (int x = 0; x < rgb->width; x++)
      tree[(size_t)y * (size_t)rgb->width + (size_t)x] = tree_at(from, x, y, 1 / factor, 1 / factor);
  if (!status) status = make_alpha(context, rgb, tree, out_rgba);
  if (!status) status = vt_estimate_foreground(context, out_rgba);
  vt_free(context, tree);
  if (status) vt_free_image(context, out_rgba);
  return status;
}
