// bench_reconstruct.c - error of an uncompressed tree on held-out views, over seconds of reconstruction
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_reconstruct CAPTURE|SCENE [--method 2004|2006|best] [--preset draft|normal|high] [--level N]
//                                       [--views K] [--budget S] [--pictures DIR] [--every-level]
//
// A capture is a folder with cameras and mattes; a name that vt_find_scene knows is photographed. Views of role VT_TEST
// judge (every eighth, held out, if there are none). Printed: wall and processor seconds from mattes to the finest level, and means over
// the test views: PSNR over white, SSIM, PSNR of the foreground, alpha RMSE, mean alpha; the same for the photographs' own cameras.

#include "capture/capture.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/reconstruct.h"

#include "base/image_metrics.h"
#include "base/image_file.h"

#include <math.h>
#include <string.h>

typedef struct arguments {
  const char *source, *pictures;
  vt_method method;
  vt_preset preset;
  int level, views;
  double budget;
  bool every_level;
} arguments;

static int word_of(const char *word, const char *const *words, int count) {
  for (int i = 0; i < count; i++)
    if (!strcmp(word, words[i])) return i;
  return -1;
}

static bool read_arguments(int count, char **words, arguments *a) {
  static const char *const methods[] = {"2004", "2006", "best"}, *const presets[] = {"draft", "normal", "high"};
  *a = (arguments){.source = count > 1 ? words[1] : NULL, .method = VT_METHOD_BEST, .preset = VT_PRESET_NORMAL, .views = 4};
  if (!a->source) return false;
  for (int i = 2; i < count; i++) {
    const char *name = words[i];
    if (!strcmp(name, "--every-level")) {
      a->every_level = true;
      continue;
    }
    if (++i == count) return false;
    int method = word_of(words[i], methods, 3), preset = word_of(words[i], presets, 3);
    if (!strcmp(name, "--method") && method >= 0) a->method = (vt_method)method;
    else if (!strcmp(name, "--preset") && preset >= 0) a->preset = (vt_preset)preset;
    else if (!strcmp(name, "--level")) a->level = atoi(words[i]);
    else if (!strcmp(name, "--views")) a->views = atoi(words[i]);
    else if (!strcmp(name, "--budget")) a->budget = atof(words[i]);
    else if (!strcmp(name, "--pictures")) a->pictures = words[i];
    else return false;
  }
  return a->level >= 0 && a->level <= VT_MAX_LEVEL && a->views >= 1 && a->views <= VT_MAX_BLEND_VIEWS;
}

static vt_status get_views(vt_context *context, const char *source, vt_views *views) {
  vt_synthetic_desc scene;
  if (vt_find_scene(source, &scene)) return vt_make_synthetic_views(context, &scene, views);
  vt_capture_desc capture = vt_default_capture_desc();
  capture.source = source;
  vt_status status = vt_load_views(context, &capture, views, NULL);
  if (!status && !vt_count_views(views, VT_TEST)) vt_hold_out(views, 8);
  return status;
}

static vt_status write_picture(vt_context *context, const char *folder, const vt_view *view, const vt_fimage *picture) {
  static const float white[3] = {1, 1, 1};
  vt_image image = {0};
  char path[4096];
  const char *name = strrchr(view->name, '/');
  snprintf(path, sizeof path, "%s/%s", folder, name ? name + 1 : view->name);
  vt_status status = vt_flatten(context, picture, white, &image);
  if (!status) status = vt_write_image(context, path, &image);
  vt_free_image(context, &image);
  return status;
}

// Means over the views of a role.
static vt_status judge(vt_context *context, const vt_tree *tree, const vt_views *views, vt_role role, int level,
                       const arguments *a, const char *label) {
  static const float white[3] = {1, 1, 1};
  vt_metrics sum = {0}, m;
  double mass = 0;
  int count = 0, stride = role == VT_TRAIN ? 6 : 1;
  vt_status status = VT_OK;
  for (int i = 0; i < views->count && !status; i++) {
    const vt_view *view = &views->items[i];
    if (view->role != role || (role == VT_TRAIN && i % stride)) continue;
    vt_fimage picture = {0};
    vt_view_weights weights = vt_choose_views(tree, vt_camera_centre(&view->camera), a->views);
    status = vt_composite(context, tree, level, &weights, VT_BLEND_GEOMETRIC, false, &view->camera, &picture);
    if (!status) status = vt_measure(context, &picture, &view->picture, white, &m);
    if (!status && a->pictures && role == VT_TEST) status = write_picture(context, a->pictures, view, &picture);
    for (int p = 0; p < picture.width * picture.height && !status; p++)
      mass += picture.pixels[4 * p + 3] / ((double)picture.width * picture.height);
    vt_free_fimage(context, &picture);
    if (status) break;
    sum.psnr += m.psnr, sum.ssim += m.ssim, sum.psnr_foreground += m.psnr_foreground, sum.alpha_rmse += m.alpha_rmse;
    sum.sharpness += m.sharpness;
    count++;
  }
  if (count && !status)
    printf("%-16s level %d: PSNR %6.2f  SSIM %.4f  foreground %6.2f  alpha RMSE %.4f  sharpness %.2f  mean alpha %.4f\n", label, level,
           sum.psnr / count, sum.ssim / count, sum.psnr_foreground / count, sum.alpha_rmse / count, sum.sharpness / count, mass / count);
  fflush(stdout);
  return status;
}

static vt_status run(vt_context *context, const arguments *a) {
  vt_views views = {0};
  vt_tree tree = {0};
  vt_reconstruct_report r;
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(a->method, a->preset);
  desc.leaf_level = a->level;
  desc.time_budget = a->budget;
  vt_status status = get_views(context, a->source, &views);
  double wall = vt_seconds(), processor = vt_cpu_seconds();
  vt_reset_peak(context);
  if (!status) status = vt_reconstruct(context, &desc, &views, &tree, &r);
  if (!status)
    printf("%s: %.1f s, %.1f processor s (hull %.1f rays %.1f opacity %.1f colour %.1f fit %.1f textures %.1f), peak %.2f GB, "
           "textures %.1f MB\n", a->source, vt_seconds() - wall, vt_cpu_seconds() - processor, r.seconds_hull, r.seconds_rays,
           r.seconds_opacity, r.seconds_colour, r.seconds_refinement, r.seconds_tiles, (double)vt_peak_bytes(context) * 1e-9,
           (double)vt_texture_bytes(&tree) * 1e-6);
  for (int level = a->every_level ? 3 : r.leaf_level; level <= r.leaf_level && !status; level++) {
    status = judge(context, &tree, &views, VT_TEST, level, a, "test views");
    if (!status && level == r.leaf_level) status = judge(context, &tree, &views, VT_TRAIN, level, a, "own cameras");
  }
  vt_free_tree(context, &tree);
  vt_free_views(context, &views);
  return status;
}

int main(int count, char **words) {
  arguments a;
  if (!read_arguments(count, words, &a)) {
    fprintf(stderr, "bench_reconstruct CAPTURE|SCENE [--method M] [--preset P] [--level N] [--views K] [--budget S] [--pictures DIR] "
                    "[--every-level]\n");
    return VT_BAD_USAGE;
  }
  vt_context_desc desc = vt_default_context_desc();
  if (!getenv("VT_VERBOSE")) desc.log_level = VT_LOG_QUIET;
  else desc.log_level = VT_LOG_VERBOSE;
  vt_context *context = vt_create_context(&desc);
  vt_status status = context ? run(context, &a) : VT_OUT_OF_MEMORY;
  if (status && context) fprintf(stderr, "bench_reconstruct: %s\n", vt_last_error(context));
  vt_destroy_context(context);
  return (int)status;
}
