// bench_refine.c - how well cameras are recovered: kinds of trees by errors that were put in
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/release/bench/bench_refine [--size N] [--views N] [--kind NAME] [--errors "T S F"] [--rig N] [--force]
//                                    [--tracks N] [--photograph N] [--fov N] [--seed N] [--k1 K] [--lens-only]
//
// --tracks: with so many points of the tree, looked for as a matcher would (vt_make_synthetic_tracks: unoccluded in three views at
// least, 2 % that are anywhere), each known to half a pixel of a photograph of --photograph pixels, of which the picture is a
// reduced copy, as captures are. --k1: the photographs are bent by a lens with this k1, which the cameras
// believe to be 0; it is looked for before (vt_adjust_lenses, on the tracks), and the photographs are straightened by what was found.
// A synthetic tree is photographed with exact mattes, its cameras are turned by T degrees and moved by S of their distance
// (deviations, in per cent) and their focal lengths changed by F per cent, and vt_refine_views has them. The measure: cameras
// are laid onto the true ones by the best similarity (vt_align_cameras); then, root mean square over the cameras, the angle of
// the rotation between the two, the distance of the two places over the distance from the origin, and the distance in pixels
// of the projections of the corners of a cube of edge 1 about the origin (the tree is 2 high), which is what a volume notices,
// also as the angle at the camera that it subtends in the picture's middle.

#include "capture/adjust_lens.h"
#include "capture/photo_tracks.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/align_cameras.h"

#include <string.h>

typedef struct arguments {
  int size, views, rig, tracks, seed, photograph;
  const char *kind;
  double turn, shift, focal, k1, fov; // degrees, per cent, per cent
  bool one_error, force, lens, lens_only;
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

static vt_status add_tracks(vt_context *context, const arguments *a, const vt_synthetic_desc *scene, const vt_camera *truth,
                            vt_views *views) {
  vt_track_desc desc = vt_default_track_desc();
  desc.count = a->tracks, desc.distortion = a->k1, desc.noise = 0.5 * a->size / a->photograph, desc.seed = (uint64_t)a->seed;
  vt_status status = vt_make_synthetic_tracks(context, scene, &desc, truth, a->views, &views->tracks);
  if (!status)
    printf("%zu points, %.1f views see each, %.0f sights a view\n", views->tracks.count,
           (double)views->tracks.sight_count / (double)(views->tracks.count + !views->tracks.count),
           (double)views->tracks.sight_count / a->views);
  return status;
}

// Photographs as a calibration would hand them on: one lens for all, its k1 believed to be 0, and the tracks as landmarks.
static vt_status take_photos(vt_context *context, double noise, const vt_views *views, vt_photos *out) {
  vt_landmarks *l = &out->landmarks;
  size_t sights = views->tracks.sight_count;
  for (int i = 0; i < views->count; i++) {
    const vt_camera *c = &views->items[i].camera;
    vt_photo *photo = vt_add_photo(context, out, views->items[i].name, "");
    if (!photo) return VT_OUT_OF_MEMORY;
    photo->lens = (vt_lens){VT_LENS_OPENCV, c->width, c->height, c->fx, c->fy, c->cx, c->cy, {0}};
    photo->rotation = c->rotation, photo->translation = c->translation;
  }
  *l = (vt_landmarks){views->tracks.count, sights, VT_NEW(context, vt_landmark, views->tracks.count + 1), VT_NEW(context, int, sights + 1),
                      vt_alloc(context, sights + 1, sizeof *l->pixels)};
  if (!l->items || !l->seen_by || !l->pixels) return VT_OUT_OF_MEMORY;
  for (size_t k = 0; k < l->count; k++)
    l->items[k] = (vt_landmark){views->tracks.items[k].place, (float)noise, views->tracks.items[k].first, views->tracks.items[k].count};
  for (size_t k = 0; k < sights; k++) {
    l->seen_by[k] = views->tracks.sights[k].view;
    for (int c = 0; c < 2; c++) l->pixels[k][c] = views->tracks.sights[k].pixel[c];
  }
  return VT_OK;
}

// The lens by the tracks, and the photographs straightened by it.
static vt_status straighten(vt_context *context, const arguments *a, vt_views *views, vt_camera *truth) {
  double k1 = a->k1, noise = 0.5 * a->size / a->photograph;
  vt_photos photos = {0};
  vt_lens_report report = {.why = ""};
  vt_status status = take_photos(context, noise, views, &photos);
  if (!status) status = vt_adjust_lenses(context, &photos, &report);
  const double *k = photos.items[0].lens.k;
  if (!status)
    printf("  lens     %s; %zu sights, %.4f -> %.4f deviations; k1 off by %+.5f -> %+.5f (k2 %+.5f p1 %+.5f p2 %+.5f), focal %+.3f %%\n", report.why,
           report.sight_count, report.before, report.after, -k1, k[0] - k1, k[1], k[2], k[3], 100 * report.focal_share);
  vt_camera *cameras = VT_NEW(context, vt_camera, (size_t)views->count);
  if (!cameras) status = VT_OUT_OF_MEMORY;
  for (int i = 0; i < views->count && !status; i++) {
    vt_image straight = {0};
    vt_camera camera = vt_photo_camera(&photos.items[i]);
    status = vt_undistort_image(context, &photos.items[i].lens, &views->items[i].picture, &camera, &straight);
    if (status) break;
    vt_free_image(context, &views->items[i].picture);
    views->items[i].picture = straight, views->items[i].camera = cameras[i] = camera;
    truth[i].fx *= camera.fx / photos.items[i].lens.fx, truth[i].fy *= camera.fy / photos.items[i].lens.fy; // narrowed
  }
  vt_free_tracks(context, &views->tracks);
  if (!status) status = vt_photo_tracks(context, &photos, cameras, &views->tracks);
  vt_free(context, cameras);
  vt_free_photos(context, &photos);
  return status;
}

static vt_status refine(vt_context *context, const arguments *a, const vt_camera *truth, vt_camera *now, vt_views *views, double start) {
  vt_refine_desc desc = vt_default_refine_desc();
  vt_refine_report report = {.why = ""};
  if (a->force) desc.mode = VT_REFINE_ON;
  vt_status status = vt_refine_views(context, &desc, views, &report);
  copy_cameras(views, now);
  apart after = measure(now, truth, a->views);
  print_row("after", &after);
  printf("  first look %.2f %%, alpha %.4f -> %.4f, %s: %s; %.1f processor seconds\n", 100 * report.first_gain, report.alpha_before,
         report.alpha_after, report.kept ? "kept" : report.tried ? "not kept" : "not tried", report.why, vt_cpu_seconds() - start);
  if (report.sight_count)
    printf("  %zu sights, mean distance %.3f -> %.3f px\n", report.sight_count, report.track_before, report.track_after);
  return status;
}

static vt_status run(vt_context *context, const arguments *a, vt_synthetic_kind kind, const double error[3]) {
  vt_synthetic_desc scene = vt_default_synthetic_desc();
  scene.kind = kind, scene.rig = (vt_rig)a->rig;
  scene.train_count = a->views, scene.test_count = 0, scene.width = scene.height = a->size, scene.supersample = 4;
  if (a->fov > 0) scene.fov_y = a->fov * VT_PI / 180;
  scene.leaf_count = kind == VT_SYNTHETIC_TREE ? 4000 : -1;
  if (vt_is_phantom(kind)) scene.peak_extinction = 4;
  vt_damage_desc damage = vt_default_damage_desc();
  damage.seed = (uint64_t)a->seed, damage.pose_degrees = error[0], damage.pose_share = error[1] / 100, damage.focal_share = error[2] / 100;
  damage.distortion = a->k1;
  vt_views views = {0};
  size_t count = (size_t)a->views;
  vt_camera *truth = VT_NEW(context, vt_camera, count), *now = VT_NEW(context, vt_camera, count);
  vt_status status = truth && now ? vt_make_synthetic_views(context, &scene, &views) : VT_OUT_OF_MEMORY;
  if (!status) copy_cameras(&views, truth);
  if (!status && a->tracks) status = add_tracks(context, a, &scene, truth, &views);
  if (!status) status = vt_damage_views(context, &damage, &views);
  if (!status) {
    copy_cameras(&views, now);
    printf("%s, %d views of %d pixels, errors %.2f deg %.2f %% focal %.2f %%\n", vt_synthetic_name(kind), a->views, a->size, error[0],
           error[1], error[2]);
    apart before = measure(now, truth, a->views);
    print_row("before", &before);
    double start = vt_cpu_seconds();
    if (a->lens) status = straighten(context, a, &views, truth);
    if (a->lens && !status) {
      copy_cameras(&views, now);
      apart straight = measure(now, truth, a->views);
      print_row("lens", &straight);
    }
    if (!status && !a->lens_only) status = refine(context, a, truth, now, &views, start);
    fflush(stdout);
  }
  vt_free(context, now);
  vt_free(context, truth);
  vt_free_views(context, &views);
  return status;
}

static bool read_arguments(int count, char **words, arguments *a) {
  *a = (arguments){.size = 400, .views = 32, .seed = 1, .photograph = 1600};
  for (int i = 1; i < count; i++) {
    if (!strcmp(words[i], "--force") || !strcmp(words[i], "--lens-only")) {
      *(strcmp(words[i], "--force") ? &a->lens_only : &a->force) = true;
      continue;
    }
    if (i + 1 == count) return false;
    const char *name = words[i++], *value = words[i];
    if (!strcmp(name, "--size")) a->size = atoi(value);
    else if (!strcmp(name, "--views")) a->views = atoi(value);
    else if (!strcmp(name, "--kind")) a->kind = value;
    else if (!strcmp(name, "--tracks")) a->tracks = atoi(value);
    else if (!strcmp(name, "--k1")) a->k1 = atof(value), a->lens = true;
    else if (!strcmp(name, "--photograph")) a->photograph = atoi(value);
    else if (!strcmp(name, "--fov")) a->fov = atof(value);
    else if (!strcmp(name, "--seed")) a->seed = atoi(value);
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
    fprintf(stderr, "bench_refine [--size N] [--views N] [--kind NAME] [--errors \"T S F\"] [--rig 0..5] [--force] [--tracks N] [--photograph N] [--fov N] [--seed N] [--k1 K [--lens-only]]\n");
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
