// bench_refine.c - how well cameras are recovered: kinds of trees by errors that were put in
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/release/bench/bench_refine [--size N] [--views N] [--kind NAME] [--errors "T S F"] [--rig N] [--force]
//
// A synthetic tree is photographed with exact mattes, its cameras are turned by T degrees and moved by S of their distance
// (deviations, in per cent) and their focal lengths changed by F per cent, and vt_refine_views has them. The measure: cameras
// are laid onto the true ones by the best similarity (vt_align_cameras); then, root mean square over the cameras, the angle of
// the rotation between the two, the distance of the two places over the distance from the origin, and the distance in pixels
// of the projections of the corners of a cube of edge 1 about the origin (the tree is 2 high), which is what a volume notices,
// also as the angle at the camera that it subtends in the picture's middle.

#include "datasets-synthetic/synthetic.h"
#include "reconstruct/align_cameras.h"

#include <string.h>

typedef struct arguments {
  int size, views, rig;
  const char *kind;
  double turn, shift, focal; // degrees, per cent, per cent
  bool one_error, force;
} arguments;

typedef struct apart { double degrees, share, pixels, angle, focal; } apart;

static apart measure(const vt_camera *now, const vt_camera *truth, int count) {
  vt_vec3 origin = {0, 0, 0};
  vt_similarity laid = vt_align_cameras(count, now, truth, origin);
  apart out = {0, 0, 0, 0, 0};
  for (int i = 0; i < count; i++) {
    vt_camera c = vt_move_camera_by(&laid, &now[i]);
    double trace = 0, squares = 0;
    for (int k = 0; k < 9; k++) trace += c.rotation.m[k] * truth[i].rotation.m[k];
    double degrees = 180 / VT_PI * acos(fmax(-1, fmin(1, 0.5 * (trace - 1))));
    vt_vec3 place = vt_camera_centre(&truth[i]);
    double share = vt_length(vt_sub(vt_camera_centre(&c), place)) / vt_length(place);
    for (int k = 0; k < 8; k++) {
      double p[2] = {0, 0}, q[2] = {0, 0};
      vt_vec3 corner = vt_v3(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
      if (!vt_project(&c, corner, p) || !vt_project(&truth[i], corner, q)) continue;
      squares += ((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1])) / 8;
    }
    out.degrees += degrees * degrees / count, out.share += share * share / count;
    out.pixels += squares / count, out.angle += squares / (truth[i].fx * truth[i].fx) / count;
    out.focal += (now[i].fx / truth[i].fx - 1) / count;
  }
  return (apart){sqrt(out.degrees), 100 * sqrt(out.share), sqrt(out.pixels), 180 / VT_PI * sqrt(out.angle), 100 * out.focal};
}

static void print_row(const char *label, const apart *a) {
  printf("  %-8s %7.4f deg  %7.4f %%  %6.3f px = %6.4f deg  focal %+.3f %%\n", label, a->degrees, a->share, a->pixels, a->angle, a->focal);
}

static void copy_cameras(const vt_views *views, vt_camera *out) {
  for (int i = 0; i < views->count; i++) out[i] = views->items[i].camera;
}

static vt_status run(vt_context *context, const arguments *a, vt_synthetic_kind kind, const double error[3]) {
  vt_synthetic_desc scene = vt_default_synthetic_desc();
  scene.kind = kind, scene.rig = (vt_rig)a->rig;
  scene.train_count = a->views, scene.test_count = 0, scene.width = scene.height = a->size, scene.supersample = 4;
  scene.leaf_count = kind == VT_SYNTHETIC_TREE ? 4000 : -1;
  if (vt_is_phantom(kind)) scene.peak_extinction = 4;
  vt_damage_desc damage = vt_default_damage_desc();
  damage.seed = 1, damage.pose_degrees = error[0], damage.pose_share = error[1] / 100, damage.focal_share = error[2] / 100;
  vt_refine_desc desc = vt_default_refine_desc();
  if (a->force) desc.mode = VT_REFINE_ON;
  vt_views views = {0};
  vt_refine_report report = {.why = ""};
  size_t count = (size_t)a->views;
  vt_camera *truth = VT_NEW(context, vt_camera, count), *now = VT_NEW(context, vt_camera, count);
  vt_status status = truth && now ? vt_make_synthetic_views(context, &scene, &views) : VT_OUT_OF_MEMORY;
  if (!status) copy_cameras(&views, truth);
  if (!status) status = vt_damage_views(context, &damage, &views);
  if (!status) {
    copy_cameras(&views, now);
    printf("%s, %d views of %d pixels, errors %.2f deg %.2f %% focal %.2f %%\n", vt_synthetic_name(kind), a->views, a->size, error[0],
           error[1], error[2]);
    apart before = measure(now, truth, a->views);
    print_row("before", &before);
    double start = vt_cpu_seconds();
    status = vt_refine_views(context, &desc, &views, &report);
    copy_cameras(&views, now);
    apart after = measure(now, truth, a->views);
    print_row("after", &after);
    printf("  first look %.2f %%, alpha %.4f -> %.4f, %s: %s; %.1f processor seconds\n", 100 * report.first_gain, report.alpha_before,
           report.alpha_after, report.kept ? "kept" : report.tried ? "not kept" : "not tried", report.why, vt_cpu_seconds() - start);
    fflush(stdout);
  }
  vt_free(context, now);
  vt_free(context, truth);
  vt_free_views(context, &views);
  return status;
}

static bool read_arguments(int count, char **words, arguments *a) {
  *a = (arguments){.size = 400, .views = 32};
  for (int i = 1; i < count; i++) {
    if (!strcmp(words[i], "--force")) {
      a->force = true;
      continue;
    }
    if (i + 1 == count) return false;
    const char *name = words[i++], *value = words[i];
    if (!strcmp(name, "--size")) a->size = atoi(value);
    else if (!strcmp(name, "--views")) a->views = atoi(value);
    else if (!strcmp(name, "--kind")) a->kind = value;
    else if (!strcmp(name, "--rig")) a->rig = atoi(value);
    else if (!strcmp(name, "--errors")) a->one_error = sscanf(value, "%lf %lf %lf", &a->turn, &a->shift, &a->focal) == 3;
    else return false;
  }
  return a->size >= 16 && a->size <= 8192 && a->views >= 1 && a->views <= 1000 && a->rig >= 0 && a->rig <= VT_RIG_HANDHELD;
}

int main(int count, char **words) {
  static const vt_synthetic_kind kinds[] = {VT_SYNTHETIC_TREE, VT_SYNTHETIC_SMALL_OAK, VT_SYNTHETIC_PINE, VT_SYNTHETIC_BIRCH,
                                            VT_SYNTHETIC_CROWN};
  static const double errors[][3] = {{0, 0, 0}, {0.2, 0.2, 0}, {0.1, 0.1, 0.2}};
  arguments a;
  if (!read_arguments(count, words, &a)) {
    fprintf(stderr, "bench_refine [--size N] [--views N] [--kind NAME] [--errors \"T S F\"] [--rig 0..5] [--force]\n");
    return VT_BAD_USAGE;
  }
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = getenv("VT_VERBOSE") ? VT_LOG_VERBOSE : VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  vt_status status = context ? VT_OK : VT_OUT_OF_MEMORY;
  for (size_t k = 0; k < sizeof kinds / sizeof *kinds && !status; k++) {
    if (a.kind && strcmp(a.kind, vt_synthetic_name(kinds[k]))) continue;
    const double given[3] = {a.turn, a.shift, a.focal};
    for (size_t e = 0; e < (a.one_error ? 1 : sizeof errors / sizeof *errors) && !status; e++)
      status = run(context, &a, kinds[k], a.one_error ? given : errors[e]);
  }
  if (status && context) fprintf(stderr, "bench_refine: %s\n", vt_last_error(context));
  vt_destroy_context(context);
  return (int)status;
}
