// clutter_points.c - which landmarks stand on the tree
// SPDX-License-Identifier: BSD-3-Clause
//
// A landmark's log odds are a sum of what is known of it:
//   place    it is near the focus, or far from it: from +2 in the middle to -0.4 at four fifths of the
//            radius, then falling fast
//   colour   log of how often its colour is found on landmarks that are tree, over how often on the others, both by the
//            odds of the round before (a classifier that learns from its own labels, [Scudder 1965]): what stands
//            inside the region and looks like what stands outside, a floor, a wall, a pot of the house's concrete, is
//            not tree
//   strokes  where a photograph that the user drew on sees it: on a stroke nothing else counts; beside strokes those
//   count that
//            are near in the picture and in colour, exp(-D^2) of the nearest tree stroke less that of the nearest other
//            one, D^2 = |xy|^2 / (width/12)^2 + |Lab|^2 / 15^2: so a stroke speaks for the leaf or the trunk that it
//            lies on
//   mattes   how much tree the photographs that see it show there, once they have mattes
// What goes wrong: another plant of the same green inside the region; only strokes tell that.

#include "capture/clutter.h"
#include "base/lab.h"
#include "capture/scribbles.h"

#include <string.h>

enum { L_BINS = 10, C_BINS = 14, BINS = L_BINS * C_BINS * C_BINS, ROUNDS = 5, SIGHTS = 8 };
#define MOST_COLOUR 2.5f
#define FAR (-12.0f)
#define SAID 12.0f
#define BESIDE 6.0f
#define DRAWN 8.0f

enum { MOST_STROKES = 1500 }; // samples of a photograph
typedef struct stroke {
  float x, y, lab[3]; // pixels, CIELab
  bool tree;
} stroke;

typedef struct judge_job {
  const vt_clutter *clutter;
  const vt_landmarks *landmarks;
  bool with_mattes;
  stroke **strokes; // [photographs] NULL where the user did not draw
  int *stroke_counts;
  float *lab;   // [count][3]
  float *fixed; // [count] place, strokes and mattes
  bool *seen;   // [count] in at least one picture
} judge_job;

static float by_place(const vt_clutter *clutter, vt_vec3 position) {
  double d = vt_length(vt_sub(position, clutter->focus)) / clutter->radius;
  return d > 1.2 ? FAR : (float)(2.2 - 3.3 * d - 6 * fmax(0, d - 0.8));
}

// The mean of 3 x 3 pixels, which a landmark's patch covers at least.
static void patch_colour(const vt_image *picture, int x, int y, float out[3]) {
  float sum[3] = {0};
  int count = 0;
  for (int v = y > 0 ? y - 1 : 0; v <= y + 1 && v < picture->height; v++)
    for (int u = x > 0 ? x - 1 : 0; u <= x + 1 && u < picture->width; u++, count++)
      for (size_t c = 0; c < 3; c++)
        sum[c] += picture->pixels[((size_t)v * (size_t)picture->width + (size_t)u) * 3 + c];
  for (int c = 0; c < 3; c++) out[c] = sum[c] / (255 * (float)count);
}

// Evenly spaced samples of what the user drew on a photograph.
static vt_status sample_strokes(vt_context *context, const vt_clutter_photo *photo, stroke **out, int *count) {
  size_t pixels = (size_t)photo->picture.width * (size_t)photo->picture.height, said = 0, passed = 0;
  for (size_t i = 0; i < pixels; i++) said += photo->said[i] != VT_SAID_NOTHING;
  size_t step = said / MOST_STROKES + 1;
  *out = VT_NEW(context, stroke, said / step + 1);
  if (!*out) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < pixels; i++) {
    if (photo->said[i] == VT_SAID_NOTHING || passed++ % step) continue;
    stroke *s = &(*out)[(*count)++];
    int x = (int)(i % (size_t)photo->picture.width), y = (int)(i / (size_t)photo->picture.width);
    float colour[3];
    patch_colour(&photo->picture, x, y, colour);
    s->x = (float)x, s->y = (float)y;
    s->tree = photo->said[i] == VT_SAID_TREE;
    vt_lab_from_srgb(colour, s->lab);
  }
  return VT_OK;
}

static float by_strokes(const judge_job *job, int photo, float x, float y, const float rgb[3]) {
  float lab[3], nearest[2] = {99, 99}, near_by = (float)job->clutter->photos[photo].picture.width / 12;
  vt_lab_from_srgb(rgb, lab);
  for (int i = 0; i < job->stroke_counts[photo]; i++) {
    const stroke *s = &job->strokes[photo][i];
    float dx = (s->x - x) / near_by, dy = (s->y - y) / near_by, d = dx * dx + dy * dy;
    for (int c = 0; c < 3; c++) d += (s->lab[c] - lab[c]) * (s->lab[c] - lab[c]) / (15 * 15);
    nearest[s->tree] = fminf(nearest[s->tree], d);
  }
  return BESIDE * (expf(-nearest[1]) - expf(-nearest[0]));
}

static void judge_one(judge_job *job, size_t k) {
  const vt_landmark *point = &job->landmarks->items[k];
  float colour[3] = {0}, mattes = 0, said = 0, looked = 0;
  int count = 0;
  for (uint32_t s = 0; s < point->count; s++) {
    const vt_clutter_photo *photo = &job->clutter->photos[job->landmarks->seen_by[point->first + s]];
    double pixel[2];
    if (!vt_clutter_project(photo, point->position, pixel)) continue;
    int x = (int)pixel[0], y = (int)pixel[1];
    size_t at = (size_t)y * (size_t)photo->picture.width + (size_t)x;
    if (photo->said && photo->said[at] != VT_SAID_NOTHING) said += photo->said[at] == VT_SAID_TREE ? SAID : -SAID;
    float trust = photo->said ? DRAWN : 1; // a matte with strokes in it is better than one without
    if (job->with_mattes) mattes += trust * (float)photo->tree[at] / 255, looked += trust;
    if (count >= SIGHTS && !photo->said) continue;
    float one[3];
    patch_colour(&photo->picture, x, y, one);
    if (photo->said)
      said += by_strokes(job, job->landmarks->seen_by[point->first + s], (float)pixel[0], (float)pixel[1], one);
    for (int c = 0; c < 3; c++) colour[c] += one[c];
    count++;
  }
  job->seen[k] = count > 0;
  for (int c = 0; c < 3; c++) colour[c] /= count ? (float)count : 1;
  vt_lab_from_srgb(colour, job->lab + 3 * k);
  job->fixed[k] = by_place(job->clutter, point->position) + said + (looked > 0 ? 6 * (mattes / looked - 0.5f) : 0);
}

static void judge_block(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  for (size_t k = begin; k < end; k++) judge_one(user, k);
}

static int bin_of(float value, float low, float high, int bins) {
  int bin = (int)((value - low) / (high - low) * (float)bins);
  return bin < 0 ? 0 : bin >= bins ? bins - 1 : bin;
}

static size_t colour_bin(const float *lab) {
  return ((size_t)bin_of(lab[0], 0, 100, L_BINS) * C_BINS + (size_t)bin_of(lab[1], -50, 50, C_BINS)) * C_BINS +
         (size_t)bin_of(lab[2], -50, 60, C_BINS);
}

// [1 2 1] along one axis of the histogram.
static void blur_axis(float *bins, size_t stride, int length, float *scratch) {
  for (size_t i = 0; i < BINS; i++) {
    int at = (int)(i / stride) % length;
    scratch[i] = 2 * bins[i] + (at > 0 ? bins[i - stride] : bins[i]) + (at + 1 < length ? bins[i + stride] : bins[i]);
  }
  memcpy(bins, scratch, BINS * sizeof *bins);
}

static void learn_colours(const judge_job *job, const float *log_odds, float *histograms, float *scratch) {
  float *tree = histograms, *rest = histograms + BINS, sums[2] = {0};
  memset(histograms, 0, 2 * BINS * sizeof *histograms);
  for (size_t k = 0; k < job->landmarks->count; k++) {
    if (!job->seen[k]) continue;
    float p = 1 / (1 + expf(-log_odds[k]));
    tree[colour_bin(job->lab + 3 * k)] += p;
    rest[colour_bin(job->lab + 3 * k)] += 1 - p;
  }
  for (int h = 0; h < 2; h++) {
    float *bins = histograms + (size_t)h * BINS;
    blur_axis(bins, 1, C_BINS, scratch);
    blur_axis(bins, C_BINS, C_BINS, scratch);
    blur_axis(bins, C_BINS * C_BINS, L_BINS, scratch);
    for (size_t i = 0; i < BINS; i++) sums[h] += bins[i];
  }
  // a colour that hardly one landmark has says nothing
  float least = 2 * (sums[0] + sums[1]) / (float)(job->landmarks->count + 1);
  for (size_t i = 0; i < BINS; i++) {
    float ratio = sums[1] > 0 && sums[0] > 0 ? sums[1] / sums[0] : 1;
    tree[i] = logf((tree[i] * ratio + least) / (rest[i] + least));
  }
}

vt_status vt_judge_landmarks(vt_context *context, const vt_clutter *clutter, const vt_landmarks *landmarks,
                             bool with_mattes, float *log_odds) {
  size_t count = landmarks->count;
  if (!count) return VT_OK;
  judge_job job = {.clutter = clutter, .landmarks = landmarks, .with_mattes = with_mattes};
  job.lab = VT_NEW(context, float, 3 * count);
  job.fixed = VT_NEW(context, float, count);
  job.seen = VT_NEW(context, bool, count);
  float *histograms = VT_NEW(context, float, 2 * BINS), *scratch = VT_NEW(context, float, BINS);
  job.strokes = VT_NEW(context, stroke *, (size_t)clutter->count);
  job.stroke_counts = VT_NEW(context, int, (size_t)clutter->count);
  vt_status status = job.lab && job.fixed && job.seen && histograms && scratch && job.strokes && job.stroke_counts
                         ? VT_OK
                         : VT_OUT_OF_MEMORY;
  for (int i = 0; i < clutter->count && !status; i++)
    if (clutter->photos[i].said)
      status = sample_strokes(context, &clutter->photos[i], &job.strokes[i], &job.stroke_counts[i]);
  if (!status) status = vt_parallel(context, count, 1024, judge_block, &job);
  if (!status) memcpy(log_odds, job.fixed, count * sizeof *log_odds);
  for (int round = 0; round < ROUNDS && !status; round++) {
    learn_colours(&job, log_odds, histograms, scratch);
    for (size_t k = 0; k < count; k++) {
      float colour = histograms[colour_bin(job.lab + 3 * k)];
      log_odds[k] = job.fixed[k] + fmaxf(-MOST_COLOUR, fminf(MOST_COLOUR, colour));
    }
  }
  for (int i = 0; i < clutter->count && job.strokes; i++) vt_free(context, job.strokes[i]);
  vt_free(context, job.strokes);
  vt_free(context, job.stroke_counts);
  vt_free(context, job.lab);
  vt_free(context, job.fixed);
  vt_free(context, job.seen);
  vt_free(context, histograms);
  vt_free(context, scratch);
  return status;
}
