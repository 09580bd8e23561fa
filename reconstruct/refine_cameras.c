// refine_cameras.c - cameras that fit the mattes of all photographs better
// SPDX-License-Identifier: BSD-3-Clause
//
// Structure from motion sees points on bark and ground; what it leaves (a tenth of a degree is five pixels at f = 3000) blurs
// every twig. Mattes say more: a crown has thousands of edge pixels, each of which knows its place to a fraction of a
// pixel. So (a) a volume from the mattes, (b) each camera so that it sees its matte in the volume, and again, coarse to fine
// [Hernandez, Schmitt & Cipolla 2007, silhouette coherence; METHODS 6]:
//
//   least of  sum_views sum_pixels huber(w (alpha(camera) - matte)) + |turn|^2 / s_turn^2 + |shift|^2 / s_shift^2
//             + (ln focal factor)^2 / s_focal^2  + what tracks say
//
// over six numbers a view and one a lens, by Levenberg and Marquardt (Ceres), with exact derivatives of the volume
// (silhouette.c). Can it be done? At 400 pixels and 40 degrees 0.05 degrees are half a pixel. A turn and a
// sideways step look the same in the middle of the picture; they differ where the tree is deep: with a crown of 0.3 of the
// distance, and by the perspective at the rim, by a quarter of that half pixel. A matte with 5,000 edge pixels, each wrong by
// one pixel and only one in a hundred independent, says 0.14 pixels: enough for where the tree falls, hardly for the rest.
//
// Turn and step are told apart by depth only, and there the volume's own faults are as large as what is looked for: the prior
// holds them (INDEPENDENT_PIXELS says how little the pixels are trusted; with five times as many, exact cameras wander by 0.08
// degrees, always so that the picture stays where it is). So what is recovered is where the tree falls in the photograph, from
// 1.9 pixels to 0.25 (pine, 400 pixels); a turn with the step that undoes it stays (0.16 to 0.09 degrees). Tried and
// dropped: blurring cells of a tomography instead of fitting corners (cells as blobs stand outside the mattes, focal lengths
// shrink by 6 % a round); volumes that leave a view's fold out, for solving (a hull of others is always a little larger: 0.4
// pixels of bias where one volume of all views has 0.3, at four times the cost). For judging they are right: refine_views.c.
//
// Where a calibration left tracks, these hold what mattes do not (refine_tracks.c), in the same sum.
//
// Place, turn and size of everything together are nobody's: after each round the cameras are laid back onto those that came
// (align_cameras.c). Lens distortion is adjusted before the photographs are developed (capture/adjust_lens.c): views are pinholes.

#include "reconstruct/refine_cameras.h"
#include "reconstruct/bounds.h"

#include <string.h>

#define HUBER_WIDTHS 1.5         // deviations
#define INDEPENDENT_PIXELS 40.0  // that a view's sampled pixels are worth, whatever their number
#define DENSEST 8.0f             // per cell edge, of the soft volume
#define SMOOTH_SCALE 2.0         // 1 over the deviation of the terms of the smooth factor
#define GROWTH 1.06              // of the cube: wrong cameras carve its rim

vt_refine_desc vt_default_refine_desc(void) {
  return (vt_refine_desc){.cookie = VT_COOKIE,
                          .mode = VT_REFINE_AUTO,
                          .fold_count = 4,
                          .turn_deviation = 0.2,
                          .shift_deviation = 0.002,
                          .focal_deviation = 0.003,
                          .most_pixels = 5000,
                          .rounds = {2, 2}};
}

// ---- what is known at the start

static void find_lenses(vt_refinement *r) {
  for (int i = 0; i < r->views.count; i++) {
    int other = 0;
    for (; other < i; other++) {
      const vt_camera *a = &r->input[i], *b = &r->input[other];
      if (a->width == b->width && a->height == b->height && fabs(a->fx - b->fx) <= 1e-6 * a->fx &&
          fabs(a->fy - b->fy) <= 1e-6 * a->fy)
        break;
    }
    r->lens[i] = other < i ? r->lens[other] : r->lens_count++;
  }
}

static vt_status find_cube(vt_refinement *r, int votes) {
  r->cube.branching = 2;
  vt_status status = vt_find_bounds_by(r->context, &r->views, votes, &r->cube);
  if (status) return status;
  double grown = GROWTH * r->cube.edge, out = 0.5 * (grown - r->cube.edge), half = 0.5 * grown;
  r->cube.origin = vt_sub(r->cube.origin, vt_v3(out, out, out));
  r->cube.edge = grown;
  vt_vec3 middle = vt_add(r->cube.origin, vt_v3(half, half, half));
  for (int i = 0; i < r->views.count; i++) {
    double distance = vt_length(vt_sub(vt_camera_centre(&r->input[i]), middle));
    r->distance[i] = fmax(distance, half); // a camera within the tree
  }
  return vt_projected_size(r->context, &r->views, middle, grown, &r->root_pixels);
}

vt_status vt_begin_refinement(vt_context *context, const vt_refine_desc *desc, const vt_views *views, int votes, vt_refinement *r) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->fold_count >= 1 && desc->fold_count <= VT_MOST_FOLDS && desc->most_pixels >= 100);
  size_t count = (size_t)views->count;
  *r = (vt_refinement){.context = context, .desc = desc};
  r->views = (vt_views){.count = views->count, .items = VT_NEW(context, vt_view, count)};
  r->input = VT_NEW(context, vt_camera, count);
  r->pose = vt_alloc(context, count, sizeof *r->pose);
  r->smooth = vt_alloc(context, count, sizeof *r->smooth);
  r->distance = VT_NEW(context, double, count);
  r->lens = VT_NEW(context, int, count);
  r->log_focal = VT_NEW(context, double, count);
  r->silhouettes = VT_NEW(context, vt_silhouette, count);
  r->response = VT_NEW(context, vt_response, count);
  bool there = r->views.items && r->input && r->pose && r->smooth && r->distance && r->lens && r->log_focal && r->silhouettes && r->response;
  vt_status status = there ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < views->count && !status; i++) {
    r->views.items[i] = views->items[i];
    r->input[i] = views->items[i].camera;
    status = vt_check_camera(context, &r->input[i], views->items[i].name);
    r->lens[i] = i;
  }
  if (!status) status = vt_renumber_tracks(context, &views->tracks, views->count, r->lens, &r->tracks); // a copy
  if (!status) find_lenses(r);
  if (!status) status = find_cube(r, votes);
  if (status) vt_end_refinement(r);
  return status;
}

static void forget_level(vt_refinement *r) {
  for (int k = 0; k < r->fold_count; k++) vt_free_soft_volume(r->context, &r->volumes[k]);
  for (int i = 0; i < r->views.count && r->silhouettes; i++) vt_free_silhouette(r->context, &r->silhouettes[i]);
  if (r->smooth) memset(r->smooth, 0, (size_t)r->views.count * sizeof *r->smooth);
}

void vt_end_refinement(vt_refinement *r) {
  if (!r->context) return;
  forget_level(r);
  void *blocks[] = {r->response, r->silhouettes, r->log_focal, r->lens, r->distance, r->smooth, r->pose, r->input, r->views.items};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) vt_free(r->context, blocks[i]);
  vt_free_tracks(r->context, &r->tracks);
  *r = (vt_refinement){0};
}

// ---- volumes

int vt_finest_refinement_level(const vt_refinement *r) {
  int level = 5;
  while (level < 7 && r->root_pixels / (1 << level) > 5) level++;
  return level;
}

static vt_status sample_all(vt_refinement *r, int level) {
  int factor = (int)(r->root_pixels / (1 << level) / 2), most = r->desc->most_pixels; // two pixels a cell
  vt_reduced_views reduced;
  vt_status status = vt_reduce_views(r->context, &r->views, factor < 1 ? 1 : factor, &reduced);
  if (status) return status;
  if ((double)most * r->views.count > 4e5) most = (int)(4e5 / r->views.count) + 100; // a thousand views: fewer of each
  for (int i = 0; i < r->views.count && !status; i++) {
    status = vt_sample_silhouette(r->context, &reduced.pictures[i], &reduced.ignored[i], &reduced.cameras[i], most, (uint64_t)i,
                                  &r->silhouettes[i]);
    vt_camera *c = &r->silhouettes[i].camera; // the camera as it came: poses count from there
    c->rotation = r->input[i].rotation, c->translation = r->input[i].translation;
    c->fx = r->input[i].fx / reduced.factor, c->fy = r->input[i].fy / reduced.factor;
  }
  vt_free_reduced_views(r->context, &reduced);
  return status;
}

// Calls for the errors of each view's pixels, with the response or without one.
typedef void (*error_visitor)(vt_refinement *, int view, const float *error, void *user);
static vt_status visit_errors(vt_refinement *r, bool plain, error_visitor visit, void *user) {
  vt_response none = vt_no_response();
  vt_status status = VT_OK;
  for (int i = 0; i < r->views.count && !status; i++) {
    const vt_silhouette *s = &r->silhouettes[i];
    float *error = VT_NEW(r->context, float, (size_t)s->count);
    if (!error) return VT_OUT_OF_MEMORY;
    vt_camera camera = vt_adjust_camera(&s->camera, r->pose[i], r->log_focal[r->lens[i]], r->distance[i]);
    status = vt_compare_silhouette(r->context, s, &r->volumes[i % r->fold_count], plain ? &none : &r->response[i], r->smooth[i], &camera, r->distance[i], error, NULL);
    if (!status) visit(r, i, error, user);
    vt_free(r->context, error);
  }
  return status;
}

static void learn(vt_refinement *r, int view, const float *error, void *user) {
  (void)user;
  r->response[view] = (vt_response){{0}, {0}, {0}};
  vt_learn_response(&r->response[view], &r->silhouettes[view], error);
  vt_finish_response(&r->response[view]);
}

typedef struct error_sums {
  double sum, pixels, *view_error;
} error_sums;

static void add_errors(vt_refinement *r, int view, const float *error, void *user) {
  error_sums *sums = user;
  double own = 0;
  int count = r->silhouettes[view].count;
  for (int k = 0; k < count; k++) own += (double)error[k] * (double)error[k];
  if (sums->view_error) sums->view_error[view] = count ? sqrt(own / count) : -1;
  sums->sum += own, sums->pixels += count;
}

vt_status vt_refinement_error(vt_refinement *r, double *error, double *view_error) {
  error_sums sums = {0, 0, view_error};
  vt_status status = visit_errors(r, false, add_errors, &sums);
  *error = sums.pixels > 0 ? sqrt(sums.sum / sums.pixels) : 0;
  return status;
}

vt_status vt_renew_volumes(vt_refinement *r, int level, int votes, int fold_count) {
  VT_ASSERT(fold_count >= 1 && fold_count <= VT_MOST_FOLDS);
  forget_level(r);
  r->fold_count = fold_count;
  vt_soft_volume_desc desc = {level, DENSEST, votes};
  vt_views others = {.items = VT_NEW(r->context, vt_view, (size_t)r->views.count)};
  vt_status status = others.items ? sample_all(r, level) : VT_OUT_OF_MEMORY;
  for (int k = 0; k < fold_count && !status; k++) {
    others.count = 0;
    for (int i = 0; i < r->views.count; i++)
      if (fold_count == 1 || i % fold_count != k) others.items[others.count++] = r->views.items[i];
    status = vt_make_soft_volume(r->context, &others, r->cube.origin, r->cube.edge, &desc, &r->volumes[k]);
  }
  vt_free(r->context, others.items);
  if (!status) status = visit_errors(r, true, learn, NULL);
  if (!status) status = vt_refinement_error(r, &r->deviation, NULL);
  r->deviation = fmax(r->deviation, 0.003);
  return status;
}

// ---- poses

// One view's residuals: its pixels, then its priors.
typedef struct view_block {
  vt_context *context;
  const vt_silhouette *silhouette;
  const vt_soft_volume *volume;
  const vt_response *response;
  double distance, weight, width, turn_scale, shift_scale;
  float *error, (*by_motion)[VT_SILHOUETTE_COLUMNS]; // of the pixels; shared by all blocks, which are asked one by one
} view_block;

static bool evaluate(void *user, const double *const *parameters, double *residuals, double **jacobians) {
  const view_block *b = user;
  int count = b->silhouette->count, rows = count + 6 + VT_SMOOTH_TERMS;
  const double *pose = parameters[0], *smooth = parameters[1];
  static const int sizes[3] = {6, VT_SMOOTH_TERMS, 1}, columns[3] = {0, 7, 6}; // of the groups; their first column
  for (int k = 0; k < 6; k++)
    if (!(fabs(pose[k]) < 0.2) || !(fabs(smooth[k]) < 3)) return false;
  vt_camera camera = vt_adjust_camera(&b->silhouette->camera, pose, parameters[2][0], b->distance);
  if (vt_compare_silhouette(b->context, b->silhouette, b->volume, b->response, smooth, &camera, b->distance, b->error,
                            jacobians ? b->by_motion : NULL))
    return false;
  for (int g = 0; g < 3 && jacobians; g++)
    for (int i = count * sizes[g]; i < rows * sizes[g] && jacobians[g]; i++) jacobians[g][i] = 0;
  for (int i = 0; i < count; i++) {
    double slope;
    residuals[i] = b->weight * vt_huber((double)b->error[i], b->width, &slope);
    slope *= b->weight;
    for (int g = 0; g < 3 && jacobians; g++)
      for (int k = 0; k < sizes[g] && jacobians[g]; k++)
        jacobians[g][sizes[g] * i + k] = slope * (double)b->by_motion[i][columns[g] + k];
  }
  const double scales[6] = {b->turn_scale, b->turn_scale, b->turn_scale, b->shift_scale, b->shift_scale, b->shift_scale};
  for (int k = 0; k < 6; k++) {
    residuals[count + k] = scales[k] * pose[k], residuals[count + 6 + k] = SMOOTH_SCALE * smooth[k];
    if (jacobians && jacobians[0]) jacobians[0][6 * (count + k) + k] = scales[k];
    if (jacobians && jacobians[1]) jacobians[1][6 * (count + 6 + k) + k] = SMOOTH_SCALE;
  }
  return true;
}

static bool focal_prior(void *user, const double *const *parameters, double *residuals, double **jacobians) {
  double scale = *(const double *)user;
  residuals[0] = scale * parameters[0][0];
  if (jacobians && jacobians[0]) jacobians[0][0] = scale;
  return true;
}

static void set_cameras(vt_refinement *r) {
  for (int i = 0; i < r->views.count; i++)
    r->views.items[i].camera = vt_adjust_camera(&r->input[i], r->pose[i], r->log_focal[r->lens[i]], r->distance[i]);
}

void vt_set_poses(vt_refinement *r, double (*pose_or_null)[6], const double *log_focal_or_null) {
  if (pose_or_null) memcpy(r->pose, pose_or_null, (size_t)r->views.count * sizeof *r->pose);
  if (log_focal_or_null) memcpy(r->log_focal, log_focal_or_null, (size_t)r->views.count * sizeof *r->log_focal);
  set_cameras(r);
}

typedef struct problem {
  vt_parameter_group *groups;  // [2 views + lenses + tracks]
  vt_residual_block *blocks;   // [views + lenses + sights]
  view_block *views;
  int (*of_view)[3], *of_lens; // numbers of groups
  double focal_scale;
  float *error, (*by_motion)[VT_SILHOUETTE_COLUMNS];
  int block_count;
  vt_tracks tracks;            // with which they are solved, their places
  vt_sight_block *sights;
} problem;

static void free_problem(vt_context *context, problem *p) {
  void *blocks[] = {p->groups, p->blocks, p->views, p->of_view, p->of_lens, p->error, p->by_motion, p->sights};
  vt_free_tracks(context, &p->tracks);
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) vt_free(context, blocks[i]);
}

static vt_status make_problem(vt_refinement *r, problem *p) {
  int views = r->views.count, lenses = r->lens_count, most = 1;
  vt_tracks tracks;
  double usual;
  vt_status status = vt_choose_refinement_tracks(r, &tracks, &usual);
  size_t all = (size_t)(2 * views + lenses) + tracks.count + tracks.sight_count;
  for (int i = 0; i < views; i++) most = r->silhouettes[i].count > most ? r->silhouettes[i].count : most;
  *p = (problem){VT_NEW(r->context, vt_parameter_group, all), VT_NEW(r->context, vt_residual_block, all),
                 VT_NEW(r->context, view_block, (size_t)views), vt_alloc(r->context, (size_t)views, sizeof(int[3])),
                 VT_NEW(r->context, int, (size_t)lenses), 1 / r->desc->focal_deviation, VT_NEW(r->context, float, (size_t)most),
                 vt_alloc(r->context, (size_t)most, sizeof(float[VT_SILHOUETTE_COLUMNS])), 0, tracks,
                 VT_NEW(r->context, vt_sight_block, tracks.sight_count + 1)};
  if (status || !p->sights || !p->groups || !p->blocks || !p->views || !p->of_view || !p->of_lens || !p->error || !p->by_motion) return VT_OUT_OF_MEMORY;
  double degree = VT_PI / 180;
  for (int i = 0; i < views; i++) {
    p->groups[i] = (vt_parameter_group){.values = r->pose[i], .size = 6};
    p->groups[views + i] = (vt_parameter_group){.values = r->smooth[i], .size = VT_SMOOTH_TERMS};
    p->of_view[i][0] = i, p->of_view[i][1] = views + i, p->of_view[i][2] = 2 * views + r->lens[i];
    int count = r->silhouettes[i].count;
    if (!count && !tracks.count) continue; // nothing to see: the camera stays
    double weight = sqrt(fmin(1, INDEPENDENT_PIXELS / (count ? count : 1))) / r->deviation;
    p->views[i] = (view_block){r->context, &r->silhouettes[i], &r->volumes[i % r->fold_count], &r->response[i], r->distance[i], weight, HUBER_WIDTHS * r->deviation,
                               1 / (r->desc->turn_deviation * degree), 1 / r->desc->shift_deviation, p->error, p->by_motion};
    p->blocks[p->block_count++] = (vt_residual_block){evaluate, &p->views[i], count + 6 + VT_SMOOTH_TERMS, 3, p->of_view[i]};
  }
  for (int l = 0; l < lenses; l++) {
    p->of_lens[l] = 2 * views + l;
    p->groups[2 * views + l] = (vt_parameter_group){.values = &r->log_focal[l], .size = 1};
    p->blocks[p->block_count++] = (vt_residual_block){focal_prior, &p->focal_scale, 1, 1, &p->of_lens[l]};
  }
  vt_add_sights(r, &p->tracks, usual, 2 * views, 2 * views + lenses, p->groups + 2 * views + lenses, p->sights, p->blocks + p->block_count);
  p->block_count += (int)tracks.sight_count;
  return VT_OK;
}

vt_status vt_solve_poses(vt_refinement *r, int iterations) {
  problem p;
  vt_status status = make_problem(r, &p);
  vt_least_squares_desc how = vt_default_least_squares_desc();
  how.iterations = iterations;
  how.function_tolerance = p.tracks.count ? 1e-8 : 1e-5; // a thousand sights hide what the rest still gains
  vt_least_squares_report report = {0};
  if (!status)
    status = vt_solve_least_squares(r->context, &how, "cameras", 2 * r->views.count + r->lens_count + (int)p.tracks.count, p.groups,
                                    p.block_count, p.blocks, &report);
  if (!status)
    vt_log(r->context, VT_LOG_VERBOSE, "cameras: cost %.1f -> %.1f in %d steps, focal length %+.3f %%, %zu sights of %zu points",
           report.initial_cost, report.final_cost, report.iterations, 100 * r->log_focal[0], p.tracks.sight_count, p.tracks.count);
  free_problem(r->context, &p);
  if (!status) set_cameras(r);
  return status;
}

// ---- gauge

// The pose that leads from one camera to another.
static void pose_between(const vt_camera *from, const vt_camera *to, double distance, double pose[6]) {
  const double *f = from->rotation.m, *t = to->rotation.m;
  double e[9];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) e[3 * i + j] = t[3 * i] * f[3 * j] + t[3 * i + 1] * f[3 * j + 1] + t[3 * i + 2] * f[3 * j + 2];
  vt_vec3 w = {e[7] - e[5], e[2] - e[6], e[3] - e[1]}; // 2 sin(angle) axis
  double sine = 0.5 * vt_length(w), angle = atan2(sine, 0.5 * (e[0] + e[4] + e[8] - 1));
  w = vt_scale(w, sine > 1e-12 ? 0.5 * angle / sine : 0.5);
  vt_vec3 moved = vt_scale(vt_mul(&from->rotation, vt_sub(vt_camera_centre(to), vt_camera_centre(from))), 1 / distance);
  double out[6] = {w.x, w.y, w.z, moved.x, moved.y, moved.z};
  memcpy(pose, out, sizeof out);
}

void vt_fix_gauge(vt_refinement *r) {
  double half = 0.5 * r->cube.edge;
  vt_vec3 middle = vt_add(r->cube.origin, vt_v3(half, half, half));
  vt_camera *now = VT_NEW(r->context, vt_camera, (size_t)r->views.count);
  if (!now) return; // without it the gauge stays where it is
  for (int i = 0; i < r->views.count; i++) now[i] = r->views.items[i].camera;
  vt_similarity back = vt_align_cameras(r->views.count, now, r->input, middle);
  for (int i = 0; i < r->views.count; i++) {
    vt_camera moved = vt_move_camera_by(&back, &now[i]);
    pose_between(&r->input[i], &moved, r->distance[i], r->pose[i]);
  }
  set_cameras(r);
  vt_free(r->context, now);
}
