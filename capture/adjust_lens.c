// adjust_lens.c - lenses, and cameras with them, adjusted to the tracks that a calibration left
// SPDX-License-Identifier: BSD-3-Clause
//
// colmap is asked for one radial coefficient, since more of them drift while few photographs have places. Once all have, tracks hold
// more: here poses, points and each lens' ln f, k1, k2, p1, p2 are adjusted together,
//
//   least of  sum_sights huber(|lens(X_c / Z_c) - x| / s)^2  +  weak priors, which hold place, turn and size of the whole
//
// [Triggs et al. 2000, bundle adjustment], points eliminated. Before the photographs are developed, not together with the mattes
// (reconstruct/refine_cameras.c): a matte was straightened by some lens before anybody compared it with a volume, so a change of the
// lens would have to bend all mattes again at every step, or be a warp beside the camera; and mattes have little to say of it, since
// the tree stands in the middle of most photographs and a volume of all views bends with a wrong lens. Tracks reach into
// the corners. So what is developed is straight, once, and later stages know pinholes only.
//
// Is it better, or only more pliable? The cost must fall by what chance does not give, and points that were not adjusted to must be
// seen more nearly where they are: a third of them is held back, the photographs are adjusted to the others with the lens as it came,
// with k1, with k2, and with all terms free, and the points held back are placed by each; so each third in turn. The held-out error alone is
// a coin toss just where it matters (k1 = .01, 60 degrees, 7,000 sights: it should fall by .0008, which is about its own noise), the
// cost alone takes what a model gains by bending to errors that sights share.

#include "capture/adjust_lens.h"
#include "base/adjust_camera.h"
#include "base/least_squares.h"
#include "capture/photo_tracks.h"

#include <string.h>

enum { TERMS = 5, FREEDOMS = 4, FOLDS = 3, STEPS = 30 }; // TERMS: ln f, k1, k2, p1, p2
enum { SIGHTS_OF_A_PHOTO = 400, SIGHTS_OF_ALL = 40000, LEAST_SIGHTS = 30 }; // of a photo: 40 where there are a thousand
#define WIDTH 1.5         // deviations, of Huber's loss
#define LEAST_FALL 5.0    // of the cost, half of chi square: beyond three deviations for one term more
#define STAYS 1e7         // 1 over a deviation that is none
#define TURN 0.02         // deviations of the priors: radians
#define SHIFT 0.02        // share of the distance
// The focal length, as in the calibration that is to be beaten; k1 too; k2 too; all.
static const int freedoms[FREEDOMS] = {1, 2, 3, TERMS};
static const double term_deviation[TERMS] = {0.05, 0.1, 0.05, 0.003, 0.003};

typedef struct adjustment {
  vt_context *context;
  const vt_photos *photos;
  int lens_count, *lens;  // [photos] which lens: the first photograph's with the same
  vt_camera *came, *now;  // [photos] pinholes of the lenses that came; posed as they are after the adjustment
  double (*pose)[6];      // [photos]
  double (*term)[TERMS];  // [photos, of which lens_count count]
  double *distance;       // [photos] world
  int free_terms;         // the first ones of a lens; the others stay
  double (*kept_pose[FREEDOMS])[6], (*kept_term[FREEDOMS])[TERMS]; // after the adjustments to all points
  double width;           // of Huber's loss
  double cost;            // half the sum of squares that the last adjustment left
} adjustment;

typedef struct sight_block {
  const adjustment *a;
  int photo, groups[3]; // pose, lens, place
  double pixel[2], weight;
} sight_block;
typedef struct prior_block {
  int size, group;
  double scale[6];
} prior_block;

static vt_lens bent_lens(const vt_lens *lens, const double term[TERMS]) {
  vt_lens out = *lens;
  out.fx *= exp(term[0]), out.fy *= exp(term[0]);
  for (int k = 1; k < (lens->model == VT_LENS_FISHEYE ? 3 : TERMS); k++) out.k[k - 1] += term[k];
  return out;
}

// The pixel of X_c and its slopes: by X_c, and by the terms, in which it is linear (but for the first, which is known).
static void look(const vt_lens *came, const double term[TERMS], vt_vec3 p, double pixel[2], double by_point[2][3], double by_term[2][TERMS]) {
  const double h = 1e-5, step = 1e-3;
  double x = p.x / p.z, y = p.y / p.z, low[2], high[2];
  vt_lens lens = bent_lens(came, term);
  vt_lens_project(&lens, x, y, pixel);
  if (!by_point) return;
  for (int axis = 0; axis < 2; axis++) {
    vt_lens_project(&lens, x - (axis ? 0 : h), y - (axis ? h : 0), low);
    vt_lens_project(&lens, x + (axis ? 0 : h), y + (axis ? h : 0), high);
    for (int r = 0; r < 2; r++) by_point[r][axis] = (high[r] - low[r]) / (2 * h) / p.z;
  }
  for (int r = 0; r < 2; r++) by_point[r][2] = -(x * by_point[r][0] + y * by_point[r][1]);
  by_term[0][0] = pixel[0] - came->cx, by_term[1][0] = pixel[1] - came->cy;
  for (int k = 1; k < TERMS; k++) {
    double other[TERMS];
    memcpy(other, term, sizeof other);
    other[k] += step;
    vt_lens moved = bent_lens(came, other);
    vt_lens_project(&moved, x, y, high);
    for (int r = 0; r < 2; r++) by_term[r][k] = (high[r] - pixel[r]) / step;
  }
}

static bool evaluate(void *user, const double *const *parameters, double *residuals, double **jacobians) {
  const sight_block *b = user;
  const adjustment *a = b->a;
  double by_pose[3][6], by_place[3][3], by_point[2][3], by_term[2][TERMS], map[4], pixel[2];
  vt_vec3 place = vt_v3(parameters[2][0], parameters[2][1], parameters[2][2]);
  vt_vec3 p = vt_adjusted_point(&a->came[b->photo], parameters[0], a->distance[b->photo], place, by_pose, by_place);
  if (!(p.z > 1e-9 * a->distance[b->photo])) return false;
  look(&a->photos->items[b->photo].lens, parameters[1], p, pixel, jacobians ? by_point : NULL, by_term);
  for (int r = 0; r < 2; r++) residuals[r] = b->weight * (pixel[r] - b->pixel[r]);
  if (!isfinite(residuals[0] + residuals[1])) return false;
  vt_huber_plane(residuals, a->width, map);
  for (int r = 0; r < 2 && jacobians; r++) {
    double m[2] = {b->weight * map[2 * r], b->weight * map[2 * r + 1]}, row[3];
    for (int k = 0; k < 3; k++) row[k] = m[0] * by_point[0][k] + m[1] * by_point[1][k];
    for (int k = 0; k < 6 && jacobians[0]; k++)
      jacobians[0][6 * r + k] = row[0] * by_pose[0][k] + row[1] * by_pose[1][k] + row[2] * by_pose[2][k];
    for (int k = 0; k < TERMS && jacobians[1]; k++) jacobians[1][TERMS * r + k] = m[0] * by_term[0][k] + m[1] * by_term[1][k];
    for (int k = 0; k < 3 && jacobians[2]; k++)
      jacobians[2][3 * r + k] = row[0] * by_place[0][k] + row[1] * by_place[1][k] + row[2] * by_place[2][k];
  }
  return true;
}

static bool prior(void *user, const double *const *parameters, double *residuals, double **jacobians) {
  const prior_block *b = user;
  for (int i = 0; i < b->size; i++) {
    residuals[i] = b->scale[i] * parameters[0][i];
    for (int k = 0; k < b->size && jacobians && jacobians[0]; k++) jacobians[0][b->size * i + k] = i == k ? b->scale[i] : 0;
  }
  return true;
}

// ---- one adjustment

static bool same_lens(const vt_lens *a, const vt_lens *b) {
  if (a->model != b->model || a->width != b->width || a->height != b->height) return false;
  for (int k = 0; k < 9; k++)
    if (a->k[k] != b->k[k]) return false;
  return a->fx == b->fx && a->fy == b->fy && a->cx == b->cx && a->cy == b->cy;
}

static void end_adjustment(adjustment *a) {
  void *blocks[] = {a->lens, a->came, a->now, a->pose, a->term, a->distance};
  if (!a->context) return;
  for (int f = 0; f < FREEDOMS; f++) vt_free(a->context, a->kept_pose[f]), vt_free(a->context, a->kept_term[f]);
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) vt_free(a->context, blocks[i]);
}

// The harmonic mean of the depths of what a photograph sees.
static double usual_depth(int photo, const vt_tracks *tracks, const vt_camera *camera) {
  double sum = 0; // of 1 / z: one point far away does not count
  size_t count = 0;
  for (size_t k = 0; k < tracks->count; k++)
    for (uint32_t i = 0; i < tracks->items[k].count; i++) {
      if (tracks->sights[tracks->items[k].first + i].view != photo) continue;
      double z = vt_to_camera(camera, tracks->items[k].place).z;
      if (z > 0) sum += 1 / z, count++;
    }
  return count ? (double)count / sum : 1;
}

static vt_status begin_adjustment(vt_context *context, const vt_photos *photos, const vt_tracks *tracks, adjustment *a) {
  size_t count = (size_t)photos->count;
  *a = (adjustment){context, photos, 0, VT_NEW(context, int, count), VT_NEW(context, vt_camera, count), VT_NEW(context, vt_camera, count),
                    vt_alloc(context, count, sizeof *a->pose), vt_alloc(context, count, sizeof *a->term), VT_NEW(context, double, count), 1, {NULL}, {NULL}, WIDTH, 0};
  bool there = a->lens && a->came && a->now && a->pose && a->term && a->distance;
  for (int f = 0; f < FREEDOMS; f++) {
    a->kept_pose[f] = vt_alloc(context, count, sizeof *a->pose), a->kept_term[f] = vt_alloc(context, count, sizeof *a->term);
    there = there && a->kept_pose[f] && a->kept_term[f];
  }
  if (!there) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < photos->count; i++) {
    int other = 0;
    while (other < i && !same_lens(&photos->items[i].lens, &photos->items[other].lens)) other++;
    a->lens[i] = other < i ? a->lens[other] : a->lens_count++;
    a->came[i] = a->now[i] = vt_photo_camera(&photos->items[i]);
    a->distance[i] = usual_depth(i, tracks, &a->came[i]);
  }
  return VT_OK;
}

// A sight in the pinhole picture of the lens that came, as it was in the photograph.
static void bent_pixel(const vt_lens *came, const vt_sight *sight, double pixel[2]) {
  vt_lens_project(came, ((double)sight->pixel[0] - came->cx) / came->fx, ((double)sight->pixel[1] - came->cy) / came->fy, pixel);
}

typedef struct problem {
  vt_parameter_group *groups; // poses, lenses, places
  vt_residual_block *blocks;
  sight_block *sights;
  prior_block *priors;
} problem;

static void fill_problem(adjustment *a, vt_tracks *tracks, problem *p, int *block_count) {
  int photos = a->photos->count, lenses = a->lens_count, blocks = 0;
  for (int i = 0; i < photos + lenses; i++) {
    bool pose = i < photos;
    p->groups[i] = (vt_parameter_group){.values = pose ? a->pose[i] : a->term[i - photos], .size = pose ? 6 : TERMS};
    p->priors[i] = (prior_block){.size = p->groups[i].size, .group = i};
    for (int k = 0; k < p->groups[i].size; k++) p->priors[i].scale[k] = 1 / (pose ? k < 3 ? TURN : SHIFT : term_deviation[k]);
    for (int k = a->free_terms; k < TERMS && !pose; k++) p->priors[i].scale[k] = STAYS;
    p->blocks[blocks++] = (vt_residual_block){prior, &p->priors[i], p->groups[i].size, 1, &p->priors[i].group};
  }
  for (size_t k = 0; k < tracks->count; k++) {
    vt_track *track = &tracks->items[k];
    p->groups[photos + lenses + (int)k] = (vt_parameter_group){.values = &track->place.x, .size = 3, .eliminated = true};
    for (uint32_t i = track->first; i < track->first + track->count; i++) {
      const vt_sight *s = &tracks->sights[i];
      sight_block *b = &p->sights[i];
      *b = (sight_block){.a = a, .photo = s->view, .groups = {s->view, photos + a->lens[s->view], photos + lenses + (int)k},
                         .weight = 1 / (double)s->deviation};
      bent_pixel(&a->photos->items[s->view].lens, s, b->pixel);
      p->blocks[blocks++] = (vt_residual_block){evaluate, b, 2, 3, b->groups};
    }
  }
  *block_count = blocks;
}

// Poses and lenses for these tracks (of pinholes by the lenses that came), whose places move.
static vt_status adjust(adjustment *a, vt_tracks *tracks, int free_terms) {
  int photos = a->photos->count, block_count = 0;
  size_t small = (size_t)(photos + a->lens_count);
  a->free_terms = free_terms;
  problem p = {VT_NEW(a->context, vt_parameter_group, small + tracks->count), VT_NEW(a->context, vt_residual_block, small + tracks->sight_count),
               VT_NEW(a->context, sight_block, tracks->sight_count + 1), VT_NEW(a->context, prior_block, small)};
  vt_status status = p.groups && p.blocks && p.sights && p.priors ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) fill_problem(a, tracks, &p, &block_count);
  vt_least_squares_desc how = vt_default_least_squares_desc();
  how.iterations = STEPS, how.function_tolerance = 1e-8;
  vt_least_squares_report report = {0};
  if (!status)
    status = vt_solve_least_squares(a->context, &how, "lens", (int)(small + tracks->count), p.groups, block_count, p.blocks, &report);
  a->cost = report.final_cost;
  if (!status)
    vt_log(a->context, VT_LOG_VERBOSE, "lens: cost %.1f -> %.1f in %d steps, ln f %+.5f, k1 %+.5f, k2 %+.5f, p1 %+.6f, p2 %+.6f", report.initial_cost,
           report.final_cost, report.iterations, a->term[0][0], a->term[0][1], a->term[0][2], a->term[0][3], a->term[0][4]);
  for (int i = 0; i < photos && !status; i++) a->now[i] = vt_adjust_camera(&a->came[i], a->pose[i], a->term[a->lens[i]][0], a->distance[i]);
  void *blocks[] = {p.groups, p.blocks, p.sights, p.priors};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) vt_free(a->context, blocks[i]);
  return status;
}

// ---- points held back

// The tracks of number k with k % FOLDS == fold, or the others.
static vt_status deal(vt_context *context, const vt_tracks *all, size_t fold, bool held, vt_tracks *out) {
  *out = (vt_tracks){.items = VT_NEW(context, vt_track, all->count + 1), .sights = VT_NEW(context, vt_sight, all->sight_count + 1)};
  if (!out->items || !out->sights) return VT_OUT_OF_MEMORY;
  for (size_t k = 0; k < all->count; k++) {
    if ((k % FOLDS == fold) != held) continue;
    vt_track track = all->items[k];
    memcpy(out->sights + out->sight_count, all->sights + track.first, track.count * sizeof *all->sights);
    track.first = (uint32_t)out->sight_count;
    out->sight_count += track.count, out->items[out->count++] = track;
  }
  return VT_OK;
}

// A sight in the pinhole picture of the lens that came, in that of the lens as it is adjusted.
static vt_sight straightened(const adjustment *a, const vt_sight *sight) {
  const vt_camera *now = &a->now[sight->view];
  const vt_lens *came = &a->photos->items[sight->view].lens;
  vt_lens lens = bent_lens(came, a->term[a->lens[sight->view]]);
  double pixel[2], ray[2];
  vt_sight out = *sight;
  bent_pixel(came, sight, pixel);
  if (!vt_lens_unproject(&lens, pixel, ray)) ray[0] = ray[1] = 1e3; // as wrong as can be
  out.pixel[0] = (float)(now->cx + now->fx * ray[0]), out.pixel[1] = (float)(now->cy + now->fy * ray[1]);
  return out;
}

// The squared distance of a place from where the photograph was seen to have it, in deviations, softened. In the photograph as it was
// taken: straightening stretches errors, and more of one lens than of another.
static double squared_error(const adjustment *a, const vt_sight *sight, vt_vec3 place) {
  const vt_lens *came = &a->photos->items[sight->view].lens;
  double seen[2], pixel[2], lost = 100;
  vt_vec3 p = vt_to_camera(&a->now[sight->view], place);
  bent_pixel(came, sight, seen);
  if (p.z > 0) look(came, a->term[a->lens[sight->view]], p, pixel, NULL, NULL);
  double r = p.z > 0 ? hypot(pixel[0] - seen[0], pixel[1] - seen[1]) / (double)sight->deviation : lost;
  r = r < lost ? r : lost; // and not where it is no number
  return r <= WIDTH ? r * r : WIDTH * (2 * r - WIDTH);
}

// Adds the squared errors of points, each placed by the photographs as adjusted.
static vt_status judge(const adjustment *a, const vt_tracks *held, double *sum) {
  vt_sight *sights = VT_NEW(a->context, vt_sight, held->sight_count + 1);
  if (!sights) return VT_OUT_OF_MEMORY;
  for (size_t k = 0; k < held->sight_count; k++) sights[k] = straightened(a, &held->sights[k]);
  for (size_t k = 0; k < held->count; k++) {
    const vt_track *track = &held->items[k];
    vt_vec3 place = track->place;
    double unused;
    if (!vt_settle_track(a->now, sights + track->first, track->count, &place, &unused)) place = vt_v3((double)NAN, 0, 0);
    for (uint32_t i = track->first; i < track->first + track->count; i++) *sum += squared_error(a, &held->sights[i], place);
  }
  vt_free(a->context, sights);
  return VT_OK;
}

static void keep_state(adjustment *a, int freedom) {
  memcpy(a->kept_pose[freedom], a->pose, (size_t)a->photos->count * sizeof *a->pose);
  memcpy(a->kept_term[freedom], a->term, (size_t)a->photos->count * sizeof *a->term);
}

static void restore_state(adjustment *a, int freedom) {
  memcpy(a->pose, a->kept_pose[freedom], (size_t)a->photos->count * sizeof *a->pose);
  memcpy(a->term, a->kept_term[freedom], (size_t)a->photos->count * sizeof *a->term);
}

// The error of all points, each held back once, with so many terms free. Each adjustment starts where that to all points ended, which
// saves steps and changes nothing else.
static vt_status judge_freedom(adjustment *a, const vt_tracks *chosen, int freedom, double *error) {
  vt_status status = VT_OK;
  *error = 0;
  for (size_t fold = 0; fold < FOLDS && !status; fold++) {
    vt_tracks fitted = {0}, held = {0};
    status = deal(a->context, chosen, fold, false, &fitted);
    if (!status) status = deal(a->context, chosen, fold, true, &held);
    restore_state(a, freedom);
    if (!status) status = adjust(a, &fitted, freedoms[freedom]);
    if (!status) status = judge(a, &held, error);
    vt_free_tracks(a->context, &fitted);
    vt_free_tracks(a->context, &held);
    if (!status && vt_cancelled(a->context)) status = vt_fail(a->context, VT_CANCELLED, "lens: interrupted");
  }
  *error = sqrt(*error / (double)chosen->sight_count);
  return status;
}

// How many terms are best left free: the adjustment to all points with these is what `a` holds afterwards.
static vt_status compare(adjustment *a, vt_tracks *chosen, vt_lens_report *report) {
  double cost[FREEDOMS] = {0}, error[FREEDOMS] = {0}, least = 0;
  vt_status status = VT_OK;
  int best = 0;
  for (int f = 0; f < FREEDOMS && !status; f++) {
    status = adjust(a, chosen, freedoms[f]);
    cost[f] = a->cost, least = f ? fmin(least, a->cost) : a->cost;
    keep_state(a, f);
  }
  bool promising = cost[0] - least > LEAST_FALL;
  if (!status && promising) status = judge_freedom(a, chosen, 0, &error[0]);
  for (int f = 1; f < FREEDOMS && !status && promising; f++) {
    if (!(cost[best] - cost[f] > LEAST_FALL)) continue;
    status = judge_freedom(a, chosen, f, &error[f]);
    if (!status && error[f] < error[best]) best = f;
  }
  report->before = error[0], report->after = error[best];
  report->tried = !status && promising, report->kept = !status && best > 0;
  if (!report->kept) return status;
  restore_state(a, best);
  return adjust(a, chosen, freedoms[best]);
}

// ---- what is kept

// How far a corner of the photograph moves, focal lengths apart.
static double corner_motion(const vt_lens *came, const double term[TERMS]) {
  double bend_only[TERMS], was[2], is[2], x = came->cx / came->fx, y = came->cy / came->fy;
  memcpy(bend_only, term, sizeof bend_only);
  bend_only[0] = 0;
  vt_lens lens = bent_lens(came, bend_only);
  vt_lens_project(came, -x, -y, was), vt_lens_project(&lens, -x, -y, is);
  return hypot(is[0] - was[0], is[1] - was[1]);
}

static vt_status take_over(const adjustment *a, vt_photos *photos, vt_lens_report *report) {
  vt_tracks tracks;
  for (int i = 0; i < photos->count; i++) {
    vt_photo *photo = &photos->items[i];
    const double *term = a->term[a->lens[i]];
    report->focal_share += expm1(term[0]) / photos->count;
    report->corner_pixels += corner_motion(&photo->lens, term) / photos->count;
    photo->lens = bent_lens(&photo->lens, term);
    photo->rotation = a->now[i].rotation, photo->translation = a->now[i].translation;
  }
  vt_status status = vt_photo_tracks(a->context, photos, a->now, &tracks);
  for (size_t k = 0; k < tracks.count && !status; k++) { // a sight without a pixel spoils its point: it stays where it is
    double error;
    vt_vec3 place = tracks.items[k].place;
    if (vt_settle_track(a->now, tracks.sights + tracks.items[k].first, tracks.items[k].count, &place, &error))
      photos->landmarks.items[k].position = place;
  }
  vt_free_tracks(a->context, &tracks);
  return status;
}

static bool has_bent_lens(const vt_photos *photos) {
  for (int i = 0; i < photos->count; i++)
    if (photos->items[i].lens.model == VT_LENS_PINHOLE) return false;
  return photos->count > 0;
}

static vt_status choose(vt_context *context, const vt_photos *photos, vt_tracks *out, double *usual) {
  vt_tracks all = {0};
  vt_camera *cameras = VT_NEW(context, vt_camera, (size_t)photos->count + 1);
  if (!cameras) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < photos->count; i++) cameras[i] = vt_photo_camera(&photos->items[i]);
  int most = SIGHTS_OF_ALL / (photos->count + 1);
  most = most > SIGHTS_OF_A_PHOTO ? SIGHTS_OF_A_PHOTO : most < LEAST_SIGHTS + 10 ? LEAST_SIGHTS + 10 : most;
  vt_status status = vt_photo_tracks(context, photos, cameras, &all);
  if (!status) status = vt_choose_tracks(context, &all, cameras, photos->count, most, out, usual);
  vt_free_tracks(context, &all);
  vt_free(context, cameras);
  return status;
}

vt_status vt_adjust_lenses(vt_context *context, vt_photos *photos, vt_lens_report *report) {
  *report = (vt_lens_report){0};
  report->why = !photos->landmarks.count || !photos->landmarks.pixels ? "there are no tracks"
                : !has_bent_lens(photos)                              ? "the pictures are straight"
                : !vt_can_solve_least_squares()                       ? "this build has no Ceres"
                                                                      : NULL;
  if (report->why) return VT_OK;
  vt_tracks chosen = {0};
  adjustment a = {0};
  double usual = 1;
  vt_status status = choose(context, photos, &chosen, &usual);
  report->sight_count = chosen.sight_count;
  if (!status && chosen.sight_count < (size_t)LEAST_SIGHTS * (size_t)photos->count) report->why = "too few tracks";
  if (!status && !report->why) {
    status = begin_adjustment(context, photos, &chosen, &a);
    a.width = WIDTH * usual; // where cameras are wrong, plain squares first: Huber's bend costs steps
    if (!status && usual > 1.5) status = adjust(&a, &chosen, freedoms[0]);
    a.width = WIDTH;
    if (!status) status = compare(&a, &chosen, report);
    if (report->kept && !status) status = take_over(&a, photos, report);
    report->why = report->kept ? "points held back are seen more nearly where they are" : "points held back are seen no more nearly where they are";
  }
  if (status == VT_FAILED || status == VT_BAD_INPUT) { // of the least squares: the lens stays
    vt_clear_error(context);
    status = VT_OK, report->kept = false, report->why = "it cannot be adjusted";
  }
  end_adjustment(&a);
  vt_free_tracks(context, &chosen);
  return status;
}
