// bench_matte.c - mattes of synthetic trees before sky and cloth against exact alpha, and of any one photograph
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_matte [SCENE...] [--backdrop sky|horizon|studio] [--size N] [--views N] [--noise X] [--blur X]
//                                 [--jpeg Q] [--encoded] [--slow] [--ours] [--pictures DIR]
//   build/bench/bench/bench_matte PHOTO [--sky|--plain] [-o OUT.png]
//   build/bench/bench/bench_matte PHOTO --strokes DRAWN.png [--matte MADE.png]
//
// A tree with exact alpha is laid before a backdrop as light adds up, in linear light (--encoded: as sRGB values), seen
// through a blurred lens, counted by a noisy sensor and packed as JPEG. Truth is the alpha, and the colour, of the tree
// behind the same blur. Printed for each method: mean squared error and bias of alpha over the whole picture, the error
// where truth is mixed, the share of holes found (pixels with true alpha below 1/2 where the crown around covers a
// third), the error of colours where truth is mixed over that of the photograph's own, processor seconds a megapixel and
// the highest memory of ours a pixel. --slow adds information flow, which takes
// minutes a megapixel; --ours leaves out all others.
//
// Where there is no truth but a user's strokes (green on what is tree, red on what is not): the share of both that GrabCut gets
// right, from a rectangle about the middle three quarters of the picture, and that a matte made before (RGBA) gets right. Where
// that was undistorted, it is some pixels off, which strokes along branches do not mind.

#include "base/image_file.h"
#include "bench/matte_peers.h"
#include "capture/masks.h"
#include "capture/matte.h"
#include "capture/situation.h"
#include "tests/matte_scenes.h"

#include <math.h>
#include <string.h>

typedef struct arguments {
  const char *scenes[16], *output, *pictures, *strokes, *matte;
  int scene_count, size, views;
  vt_backdrop backdrop;
  bool horizon, encoded, slow, alone, studio, sky; // sky: behind one photograph
  vt_damage_desc damage;
} arguments;

typedef struct score { // over the pictures of a scene
  double pixels, square, bias, mixed, mixed_square, solid, solid_lost, clear, clear_kept, holes, holes_found, colours, colour_error, naive_error, seconds;
  double bytes;
} score;

// ---- scenes

// Truth (RGBA, behind the lens) and photographs (opaque RGBA) of a scene.
static vt_status make_scene(vt_context *context, const arguments *a, const char *name, vt_views *truth, vt_views *photos) {
  matte_scene scene = {.backdrop = a->backdrop, .horizon = a->horizon, .encoded = a->encoded, .damage = a->damage};
  vt_synthetic_desc *tree = &scene.tree;
  if (!vt_find_scene(name, tree)) return vt_fail(context, VT_BAD_USAGE, "%s: no scene and no photograph; try oak", name);
  tree->width = tree->height = a->size;
  tree->train_count = a->views, tree->test_count = 0;
  tree->rig = VT_RIG_RING;
  if (a->size > 1500) tree->light_path = VT_RASTERISED, tree->supersample = 2;
  if (tree->light_path == VT_RAY_TRACED && !vt_can_trace_rays()) tree->light_path = VT_RASTERISED;
  return make_matte_scene(context, &scene, truth, photos);
}

// ---- methods

typedef enum method { OURS, CUT, AS_BACKDROP, REFINED, GUIDED, GRABCUT, FLOW } method;
static const char *const method_names[] = {"ours",          "the cut alone", "as plain backdrop", "ours, guided filter",
                                           "guided filter", "GrabCut",       "information flow"};

static vt_status ours(vt_context *context, bool sky, const vt_image *rgb, vt_image *out) {
  return sky ? vt_matte_sky(context, rgb, "photograph", out) : vt_matte_backdrop(context, rgb, "photograph", out);
}

// `alpha`, the picture's size, from what is certain and what others make of it.
static vt_status by_peer(vt_context *context, method m, bool sky, const vt_image *rgb, vt_image *alpha) {
  vt_image trimap = {0}, start = {0};
  size_t count = (size_t)rgb->width * (size_t)rgb->height;
  vt_status status = sky ? vt_cut_sky(context, rgb, &trimap) : vt_cut_backdrop(context, rgb, &trimap);
  if (!status) status = vt_make_image(context, rgb->width, rgb->height, 1, &start);
  for (size_t i = 0; i < count && !status; i++) start.pixels[i] = trimap.pixels[i] ? 255 : 0;
  if (!status && m == CUT) memcpy(alpha->pixels, start.pixels, count);
  if (!status && m == GUIDED) status = vt_peer_guided(context, rgb, &start, rgb->width / 200 + 3, 1e-5, alpha);
  if (!status && m == GRABCUT) status = vt_peer_grabcut(context, rgb, &trimap, alpha);
  if (!status && m == FLOW) status = vt_peer_information_flow(context, rgb, &trimap, alpha);
  vt_free_image(context, &trimap);
  vt_free_image(context, &start);
  return status;
}

static vt_status make_matte(vt_context *context, method m, bool sky, const vt_image *rgb, vt_image *out) {
  if (m == OURS) return ours(context, sky, rgb, out);
  if (m == AS_BACKDROP) return vt_matte_backdrop(context, rgb, "photograph", out);
  vt_image alpha = {0}, start = {0};
  size_t count = (size_t)rgb->width * (size_t)rgb->height;
  vt_status status = vt_make_image(context, rgb->width, rgb->height, 1, &alpha);
  if (!status) status = vt_make_image(context, rgb->width, rgb->height, 1, &start);
  if (!status && m == REFINED) {
    status = ours(context, sky, rgb, out);
    for (size_t i = 0; i < count && !status; i++) start.pixels[i] = out->pixels[4 * i + 3];
    if (!status) status = vt_peer_guided(context, rgb, &start, 2, 1e-4, &alpha);
  } else if (!status) {
    status = by_peer(context, m, sky, rgb, &alpha);
    if (!status) status = vt_make_image(context, rgb->width, rgb->height, 4, out);
  }
  for (size_t i = 0; i < count && !status; i++) {
    memcpy(out->pixels + 4 * i, rgb->pixels + 3 * i, 3);
    out->pixels[4 * i + 3] = alpha.pixels[i];
  }
  vt_free_image(context, &alpha);
  vt_free_image(context, &start);
  return status ? status : vt_estimate_foreground(context, out);
}

// ---- judging

// Sums of true alpha over the rectangle from the corner; [height + 1][width + 1].
static double *integrate(vt_context *context, const vt_image *truth) {
  size_t width = (size_t)truth->width, height = (size_t)truth->height;
  double *sums = VT_NEW(context, double, (width + 1) * (height + 1));
  if (!sums) return NULL;
  for (size_t y = 0; y < height; y++) {
    double row = 0;
    for (size_t x = 0; x < width; x++) {
      row += truth->pixels[4 * (y * width + x) + 3] / 255.0;
      sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
    }
  }
  return sums;
}

static double mean_around(const double *sums, int width, int height, int x, int y, int radius) {
  int x0 = x > radius ? x - radius : 0, x1 = x + radius + 1 < width ? x + radius + 1 : width;
  int y0 = y > radius ? y - radius : 0, y1 = y + radius + 1 < height ? y + radius + 1 : height;
  size_t row = (size_t)width + 1;
  double sum = sums[(size_t)y1 * row + (size_t)x1] - sums[(size_t)y0 * row + (size_t)x1] - sums[(size_t)y1 * row + (size_t)x0] +
               sums[(size_t)y0 * row + (size_t)x0];
  return sum / ((double)(x1 - x0) * (double)(y1 - y0));
}

static void judge_pixel(const uint8_t *truth, const uint8_t *found, const uint8_t *photo, bool crown, score *s) {
  double alpha = truth[3] / 255.0, d = found[3] / 255.0 - alpha;
  s->pixels++, s->square += d * d, s->bias += d;
  if (alpha < 0.5 && crown) s->holes++, s->holes_found += found[3] < 128;
  if (alpha >= 0.95) s->solid++, s->solid_lost -= d;
  if (alpha <= 0.05) s->clear++, s->clear_kept += d;
  if (alpha <= 0.05 || alpha >= 0.95) return;
  s->mixed++, s->mixed_square += d * d;
  if (alpha < 0.1 || alpha > 0.9) return;
  s->colours++;
  for (int c = 0; c < 3; c++) {
    s->colour_error += abs(found[c] - truth[c]) / 3.0;
    s->naive_error += abs(photo[c] - truth[c]) / 3.0;
  }
}

// Below the horizon nothing is judged: what stands there is before a meadow, not before the sky.
static vt_status judge(vt_context *context, const vt_image *truth, const vt_image *found, const vt_image *photo, int last_row,
                       score *s) {
  double *sums = integrate(context, truth);
  if (!sums) return VT_OUT_OF_MEMORY;
  for (int y = 0; y < last_row; y++)
    for (int x = 0; x < truth->width; x++) {
      size_t p = (size_t)y * (size_t)truth->width + (size_t)x;
      bool crown = mean_around(sums, truth->width, truth->height, x, y, truth->width / 50 + 2) > 1.0 / 3;
      judge_pixel(truth->pixels + 4 * p, found->pixels + 4 * p, photo->pixels + 3 * p, crown, s);
    }
  vt_free(context, sums);
  return VT_OK;
}

// The photograph, the truth and the matte over magenta, and the error of alpha: red where it is too high, blue where it is
// too low.
static vt_status show(vt_context *context, const char *path, const vt_image *rgb, const vt_image *truth, const vt_image *found) {
  vt_image out = {0};
  vt_status status = vt_make_image(context, rgb->width * (truth ? 4 : 2), rgb->height, 3, &out);
  for (int y = 0; y < rgb->height && !status; y++)
    for (int x = 0; x < rgb->width; x++) {
      size_t p = (size_t)y * (size_t)rgb->width + (size_t)x, panel = 3 * (size_t)rgb->width;
      uint8_t *to = out.pixels + 3 * ((size_t)y * (size_t)out.width + (size_t)x);
      memcpy(to, rgb->pixels + 3 * p, 3);
      for (int k = truth ? 0 : 1; k < 2; k++) {
        const uint8_t *from = (k ? found : truth)->pixels + 4 * p;
        to += panel;
        for (int c = 0; c < 3; c++) to[c] = (uint8_t)((from[c] * from[3] + (c == 1 ? 40 : 220) * (255 - from[3]) + 127) / 255);
      }
      if (!truth) continue;
      int d = found->pixels[4 * p + 3] - truth->pixels[4 * p + 3];
      to += panel;
      to[0] = (uint8_t)(d > 0 ? 255 : 255 + d), to[1] = (uint8_t)(255 - abs(d)), to[2] = (uint8_t)(d < 0 ? 255 : 255 - d);
    }
  if (!status) status = vt_write_image(context, path, &out);
  vt_free_image(context, &out);
  return status;
}

static vt_status run_method(vt_context *context, const arguments *a, const char *name, method m, const vt_views *truth,
                            const vt_views *photos) {
  score s = {0};
  vt_status status = VT_OK;
  for (int i = 0; i < truth->count && !status; i++) {
    const vt_image *exact = &truth->items[i].picture;
    vt_image rgb = {0}, found = {0};
    status = drop_picture_alpha(context, &photos->items[i].picture, &rgb);
    vt_reset_peak(context);
    double start = vt_cpu_seconds(), bytes = (double)vt_bytes_in_use(context);
    if (!status) status = make_matte(context, m, !a->studio, &rgb, &found);
    s.seconds += vt_cpu_seconds() - start;
    s.bytes = fmax(s.bytes, (double)vt_peak_bytes(context) - bytes);
    if (!status) status = judge(context, exact, &found, &rgb, a->horizon ? (int)(0.82 * exact->height) : exact->height, &s);
    if (!status && a->pictures && i == 0) {
      char path[4096];
      snprintf(path, sizeof path, "%s/%s-%d.png", a->pictures, name, (int)m);
      status = show(context, path, &rgb, exact, &found);
    }
    vt_free_image(context, &rgb);
    vt_free_image(context, &found);
  }
  if (!status)
    printf("%-10s %-20s MSE %.5f  bias %+.4f  mixed %.4f  solid -%.3f  clear +%.4f  holes %.3f  colour %4.1f / %4.1f = %.2f  %6.2f s/MP  %5.1f B/px\n", name,
           method_names[m], s.square / s.pixels, s.bias / s.pixels, s.mixed_square / s.mixed,
           s.solid_lost / s.solid, s.clear_kept / s.clear, s.holes_found / s.holes,
           s.colour_error / s.colours, s.naive_error / s.colours, s.colour_error / s.naive_error,
           s.seconds / s.pixels * 1e6, s.bytes / s.pixels * truth->count);
  fflush(stdout);
  return status;
}

static vt_status run_scene(vt_context *context, const arguments *a, const char *name) {
  vt_views truth = {0}, photos = {0};
  vt_status status = make_scene(context, a, name, &truth, &photos);
  int last = a->alone ? OURS : !vt_has_matte_peers() ? AS_BACKDROP : a->slow ? FLOW : GRABCUT;
  for (int m = 0; m <= last && !status; m++)
    if (m != AS_BACKDROP || !a->studio) status = run_method(context, a, name, (method)m, &truth, &photos);
  vt_free_views(context, &truth);
  vt_free_views(context, &photos);
  return status;
}

// ---- one photograph

static vt_status run_photograph(vt_context *context, const arguments *a, const char *path) {
  vt_image picture = {0}, rgb = {0}, found = {0};
  vt_status status = vt_read_image(context, path, &picture);
  if (!status && picture.channels == 4) {
    status = drop_picture_alpha(context, &picture, &rgb);
  } else {
    rgb = picture;
    picture = (vt_image){0};
  }
  vt_free_image(context, &picture);
  vt_evidence e = {0};
  if (!status) status = vt_judge_situation(context, &rgb, &e);
  if (!status)
    printf("%s: %s (border %.2f plain; sky %.2f of the picture, %.2f of the upper edge, luma %.2f, blue %.2f; ground %.2f)\n", path,
           e.situation == VT_SITUATION_SKY ? "sky" : e.situation == VT_SITUATION_PLAIN ? "plain backdrop" : "clutter", e.plain, e.sky,
           e.sky_top, e.brightness, e.blue, e.ground);
  double start = vt_cpu_seconds(), bytes = (double)vt_bytes_in_use(context);
  vt_reset_peak(context);
  if (!status) status = ours(context, a->sky, &rgb, &found);
  double megapixels = (double)rgb.width * rgb.height * 1e-6;
  if (!status)
    printf("%s: %.1f megapixels, %.2f s (%.2f a megapixel), %.0f MB beside it (%.1f bytes a pixel)\n", path, megapixels,
           vt_cpu_seconds() - start, (vt_cpu_seconds() - start) / megapixels, ((double)vt_peak_bytes(context) - bytes) * 1e-6,
           ((double)vt_peak_bytes(context) - bytes) * 1e-6 / megapixels);
  if (!status && a->output) status = show(context, a->output, &rgb, NULL, &found);
  vt_free_image(context, &rgb);
  vt_free_image(context, &found);
  return status;
}

// ---- one photograph with strokes

// Shares of the strokes that alpha gets right. alpha: `step` bytes a pixel.
static void judge_strokes(const char *name, const vt_image *strokes, const uint8_t *alpha, size_t step) {
  double count[2] = {1e-9, 1e-9}, right[2] = {0};
  for (size_t i = 0; i < (size_t)strokes->width * (size_t)strokes->height; i++) {
    const uint8_t *s = strokes->pixels + 4 * i;
    bool tree = s[1] > 128 && s[0] < 100, rest = s[0] > 128 && s[1] < 100;
    if (s[3] < 128 || (!tree && !rest)) continue;
    count[tree]++, right[tree] += tree == (alpha[step * i] >= 128);
  }
  printf("%-16s of the tree's strokes %.3f, of the others %.3f, mean %.3f\n", name, right[1] / count[1], right[0] / count[0],
         0.5 * (right[1] / count[1] + right[0] / count[0]));
}

static vt_status cut_rectangle(vt_context *context, const vt_image *rgb, vt_image *alpha) {
  vt_image trimap = {0};
  vt_status status = vt_make_image(context, rgb->width, rgb->height, 1, &trimap);
  if (!status) status = vt_make_image(context, rgb->width, rgb->height, 1, alpha);
  for (int y = rgb->height / 8; y < rgb->height - rgb->height / 8 && !status; y++)
    memset(trimap.pixels + (size_t)y * (size_t)rgb->width + rgb->width / 8, 128, (size_t)(rgb->width - rgb->width / 8 * 2));
  if (!status) status = vt_peer_grabcut(context, rgb, &trimap, alpha);
  vt_free_image(context, &trimap);
  return status;
}

static vt_status run_strokes(vt_context *context, const arguments *a, const char *path) {
  vt_image picture = {0}, rgb = {0}, strokes = {0}, matte = {0}, alpha = {0};
  vt_status status = vt_read_image(context, path, &picture);
  if (!status) status = vt_make_opaque(context, &picture);
  if (!status) status = drop_picture_alpha(context, &picture, &rgb);
  if (!status) status = vt_read_image(context, a->strokes, &strokes);
  if (!status && a->matte) status = vt_read_image(context, a->matte, &matte);
  bool fits = strokes.width == rgb.width && strokes.height == rgb.height && strokes.channels == 4;
  if (!status && (!fits || (a->matte && (matte.width != rgb.width || matte.height != rgb.height || matte.channels != 4))))
    status = vt_fail(context, VT_BAD_INPUT, "%s: strokes and matte have to be RGBA of the photograph's size", path);
  if (!status && a->matte) judge_strokes("the matte", &strokes, matte.pixels + 3, 4);
  if (!status) status = cut_rectangle(context, &rgb, &alpha);
  if (!status) judge_strokes("GrabCut", &strokes, alpha.pixels, 1);
  vt_free_image(context, &picture);
  vt_free_image(context, &rgb);
  vt_free_image(context, &strokes);
  vt_free_image(context, &matte);
  vt_free_image(context, &alpha);
  return status;
}

// ---- command line

static bool read_flag(const char *word, arguments *a) {
  if (!strcmp(word, "--encoded")) a->encoded = true;
  else if (!strcmp(word, "--slow")) a->slow = true;
  else if (!strcmp(word, "--ours")) a->alone = true;
  else if (!strcmp(word, "--sky")) a->sky = true;
  else if (!strcmp(word, "--plain")) a->sky = false;
  else return false;
  return true;
}

static bool read_value(const char *name, const char *value, arguments *a) {
  if (!strcmp(name, "--size")) a->size = atoi(value);
  else if (!strcmp(name, "--views")) a->views = atoi(value);
  else if (!strcmp(name, "--noise")) a->damage.noise = atof(value);
  else if (!strcmp(name, "--blur")) a->damage.blur = atof(value);
  else if (!strcmp(name, "--jpeg")) a->damage.jpeg_quality = atoi(value);
  else if (!strcmp(name, "--pictures")) a->pictures = value;
  else if (!strcmp(name, "-o")) a->output = value;
  else if (!strcmp(name, "--strokes")) a->strokes = value;
  else if (!strcmp(name, "--matte")) a->matte = value;
  else if (!strcmp(name, "--backdrop")) {
    a->horizon = !strcmp(value, "horizon"), a->studio = !strcmp(value, "studio");
    a->backdrop = a->studio ? VT_BACKDROP_STUDIO : VT_BACKDROP_SKY;
    return a->horizon || a->studio || !strcmp(value, "sky");
  } else return false;
  return a->size >= 8 && a->size <= 8192 && a->views >= 1 && a->views <= 100;
}

static bool read_arguments(int count, char **words, arguments *a) {
  *a = (arguments){.size = 800, .views = 2, .backdrop = VT_BACKDROP_SKY, .sky = true, .damage = vt_default_damage_desc()};
  a->damage.noise = 0.012, a->damage.blur = 0.7, a->damage.jpeg_quality = 92;
  for (int i = 1; i < count; i++) {
    if (words[i][0] != '-') {
      if (a->scene_count == 16) return false;
      a->scenes[a->scene_count++] = words[i];
    } else if (!read_flag(words[i], a)) {
      if (i + 1 == count || !read_value(words[i], words[i + 1], a)) return false;
      i++;
    }
  }
  static const char *const usual[] = {"small_oak", "oak", "pine", "birch"};
  for (size_t i = 0; !a->scene_count && i < 4; i++) a->scenes[i] = usual[i];
  if (!a->scene_count) a->scene_count = 4;
  return true;
}

int main(int count, char **words) {
  arguments a;
  if (!read_arguments(count, words, &a)) {
    fprintf(stderr, "bench_matte [SCENE...] [--backdrop sky|horizon|studio] [--size N] [--views N] [--noise X] [--blur X] [--jpeg Q] "
                    "[--encoded] [--slow] [--ours] [--pictures DIR]\nbench_matte PHOTO [--sky|--plain] [-o OUT.png]\n"
                    "bench_matte PHOTO --strokes DRAWN.png [--matte MADE.png]\n");
    return VT_BAD_USAGE;
  }
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = getenv("VT_VERBOSE") ? VT_LOG_VERBOSE : VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  vt_status status = context ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < a.scene_count && !status; i++)
    status = a.strokes ? run_strokes(context, &a, a.scenes[i])
             : vt_is_image_name(a.scenes[i]) ? run_photograph(context, &a, a.scenes[i]) : run_scene(context, &a, a.scenes[i]);
  if (status && context) fprintf(stderr, "bench_matte: %s\n", vt_last_error(context));
  vt_destroy_context(context);
  return (int)status;
}
