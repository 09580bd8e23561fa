// refine_views.c - whether cameras need refinement, and whether it was worth it
// SPDX-License-Identifier: BSD-3-Clause
//
// A look first: one coarse volume of all views, and one solution of all poses in it. Cameras that are exact lower the mattes'
// error by 0.3 (pine) to 1.5 % (maple) then, for noise is always fitted a little, and cameras that are one to two pixels off by
// 3 to 9 %; below NEEDED nothing more is done, unless the tracks lie much better after it. That costs about what the coarse levels of a
// draft cost. A calibration's cameras are where its tracks lie best, so there this says nothing new; cameras that somebody rounded or
// moved show at once.
//
// Judged by views that a volume has not seen: the views are dealt to folds, each fold's poses are fitted to the volume of the
// others, and the error of its mattes there is taken; once with volumes from the cameras that came, once from the refined ones.
// Both times the judging views may move. So it is the volumes that are compared, and a camera cannot look better just because
// it was moved towards its own matte. Cameras are kept as they came unless that error falls.

#include "base/least_squares.h"
#include "reconstruct/refine_cameras.h"

#include <string.h>

#define NEEDED 0.025    // share by which a first solution must lower the error of the mattes
#define TRACKS_NEEDED 0.1 // or that of the tracks, which a calibration leaves where it is least
#define LEAST_GAIN 0.01 // and by which that of mattes not seen must have fallen in the end
#define LEAST_VIEWS 6
#define VOTES 2
#define STEPS 8 // of Levenberg and Marquardt, on each volume

static vt_status pose_round(vt_refinement *r, int level, int folds, double *before, double *after) {
  vt_status status = vt_renew_volumes(r, level, VOTES, folds);
  *before = r->deviation;
  if (!status) status = vt_solve_poses(r, STEPS);
  return status ? status : vt_refinement_error(r, after, NULL);
}

// The error of mattes in volumes without them; the cameras are afterwards what they were. Without tracks: they would hold the
// judging cameras where the volume's are not.
static vt_status judge(vt_refinement *r, int level, double *error) {
  size_t views = (size_t)r->views.count, bytes = views * sizeof *r->pose;
  double (*pose)[6] = vt_alloc(r->context, views, sizeof *pose), *focal = VT_NEW(r->context, double, views), before;
  vt_status status = pose && focal ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) {
    memcpy(pose, r->pose, bytes), memcpy(focal, r->log_focal, views * sizeof *focal);
    r->without_tracks = true;
    status = pose_round(r, level, r->desc->fold_count, &before, error);
    vt_set_poses(r, pose, focal);
    r->without_tracks = false;
  }
  vt_free(r->context, focal);
  vt_free(r->context, pose);
  return status;
}

static vt_status refine(vt_refinement *r, vt_refine_report *report) {
  int top = vt_finest_refinement_level(r);
  double before, after;
  vt_status status = vt_refinement_track_error(r, &report->track_before, &report->sight_count);
  if (!status) status = pose_round(r, top - 1, 1, &before, &after);
  if (!status) status = vt_refinement_track_error(r, &report->track_after, &report->sight_count);
  if (status) return status;
  bool wanted = r->desc->mode == VT_REFINE_ON || report->track_after < (1 - TRACKS_NEEDED) * report->track_before;
  vt_log(r->context, VT_LOG_VERBOSE, "cameras: a first look lowers the error of the mattes from %.4f to %.4f", before, after);
  report->first_gain = before > 0 ? 1 - after / before : 0;
  if (!wanted && !(report->first_gain > NEEDED)) {
    report->why = "the mattes agree with the cameras as they are";
    return VT_OK;
  }
  report->tried = true;
  vt_fix_gauge(r);
  for (int round = 1; round < r->desc->rounds[0] + r->desc->rounds[1] && !status; round++) {
    status = pose_round(r, round < r->desc->rounds[0] ? top - 1 : top, 1, &before, &after);
    if (!status) vt_fix_gauge(r);
    vt_progress(r->context, "cameras", 0.2 + 0.5 * round / (r->desc->rounds[0] + r->desc->rounds[1]));
  }
  if (!status) status = judge(r, top - 1, &report->alpha_after);
  vt_refinement came = {0};
  vt_views as_came = r->views; // names and pictures are the same
  for (int i = 0; i < as_came.count; i++) as_came.items[i].camera = r->input[i];
  if (!status) status = vt_begin_refinement(r->context, r->desc, &as_came, VOTES, &came);
  if (!status) status = judge(&came, top - 1, &report->alpha_before);
  vt_end_refinement(&came);
  vt_set_poses(r, NULL, NULL);
  if (!status) status = vt_refinement_track_error(r, &report->track_after, &report->sight_count);
  report->kept = !status && report->alpha_after < (1 - LEAST_GAIN) * report->alpha_before;
  report->why = report->kept ? "mattes that a volume has not seen fit better" : "mattes that a volume has not seen fit no better";
  return status;
}

// Points of the tree for the motion in pixels: the corners of a cube half as wide as it.
static double pixel_motion(const vt_refinement *r, const vt_camera *a, const vt_camera *b) {
  double sum = 0, edge = r->cube.edge;
  int count = 0;
  for (int k = 0; k < 8; k++) {
    double p[2], q[2];
    vt_vec3 at = vt_v3(k & 1 ? 0.75 : 0.25, k & 2 ? 0.75 : 0.25, k & 4 ? 0.75 : 0.25);
    vt_vec3 point = vt_add(r->cube.origin, vt_scale(at, edge));
    if (vt_project(a, point, p) && vt_project(b, point, q)) sum += hypot(p[0] - q[0], p[1] - q[1]), count++;
  }
  return count ? sum / count : 0;
}

static void report_motion(const vt_refinement *r, vt_refine_report *report) {
  for (int i = 0; i < r->views.count; i++) {
    const vt_camera *now = &r->views.items[i].camera, *was = &r->input[i];
    const double *p = r->pose[i];
    double degrees = 180 / VT_PI * sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    double share = sqrt(p[3] * p[3] + p[4] * p[4] + p[5] * p[5]), pixels = pixel_motion(r, was, now);
    report->mean_degrees += degrees / r->views.count, report->most_degrees = fmax(report->most_degrees, degrees);
    report->mean_share += share / r->views.count, report->most_share = fmax(report->most_share, share);
    report->mean_pixels += pixels / r->views.count, report->most_pixels = fmax(report->most_pixels, pixels);
    report->focal_share += (now->fx / was->fx - 1) / r->views.count;
  }
}

// The tracks' sights in the views that are refined, by their places among these. Free with vt_free_tracks.
static vt_status select_tracks(vt_context *context, const vt_views *views, vt_tracks *out) {
  int *number = VT_NEW(context, int, (size_t)views->count + 1), count = 0;
  if (!number) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < views->count; i++) number[i] = views->items[i].role == VT_TRAIN ? count++ : -1;
  vt_status status = vt_renumber_tracks(context, &views->tracks, views->count, number, out);
  vt_free(context, number);
  return status;
}

static const char *reason_against(const vt_refine_desc *desc, const vt_views *train) {
  if (desc->mode == VT_REFINE_OFF) return "not asked for";
  if (train->count < LEAST_VIEWS) return "too few photographs";
  if (!vt_can_solve_least_squares()) return "this build has no Ceres";
  return NULL;
}

// Trouble with the mattes is the reconstruction's to report, in its own words: here it only means that nothing is refined.
static bool is_harmless(vt_status status) { return status == VT_BAD_INPUT || status == VT_FAILED; }

vt_status vt_refine_views(vt_context *context, const vt_refine_desc *desc, vt_views *views, vt_refine_report *or_null) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->fold_count >= 2 && desc->rounds[0] >= 1 && desc->rounds[1] >= 0);
  vt_refine_report report = {.alpha_before = (double)NAN, .alpha_after = (double)NAN};
  double start = vt_seconds();
  vt_views train;
  vt_status status = vt_select_views(context, views, VT_TRAIN, &train);
  if (status) return status;
  report.why = reason_against(desc, &train);
  vt_refinement r = {0};
  if (report.why && desc->mode == VT_REFINE_ON && !vt_can_solve_least_squares())
    status = vt_fail(context, VT_MISSING_PROGRAM, "cameras: this build cannot refine them; build voltree with Ceres");
  if (!report.why && !status) {
    if (views->tracks.count) status = select_tracks(context, views, &train.tracks);
    if (!status) status = vt_begin_refinement(context, desc, &train, VOTES, &r);
    if (!status) status = refine(&r, &report);
    if (is_harmless(status)) {
      vt_clear_error(context);
      status = VT_OK, report.kept = false, report.why = "the mattes have no volume in common";
    }
  }
  if (!status && report.kept) {
    report_motion(&r, &report);
    for (int i = 0, k = 0; i < views->count; i++)
      if (views->items[i].role == VT_TRAIN) views->items[i].camera = r.views.items[k++].camera;
  }
  report.seconds = vt_seconds() - start;
  vt_end_refinement(&r);
  vt_free(context, train.items);
  vt_free_tracks(context, &train.tracks);
  if (or_null) *or_null = report;
  return status;
}
