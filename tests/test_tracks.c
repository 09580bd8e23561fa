// test_tracks.c - tracks find their points, wrong ones are passed over, and cameras are held by them where mattes say little
// SPDX-License-Identifier: BSD-3-Clause
#include "base/adjust_camera.h"
#include "base/least_squares.h"
#include "reconstruct/refine_cameras.h"
#include "tests/invented_tracks.h"
#include "tests/mended_views.h"

static void the_motion_of_a_point_agrees_with_differences(void **state) {
  (void)state;
  vt_camera camera = vt_look_at(vt_v3(2.5, 1.5, 0.8), vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.8, 40, 32);
  double pose[6] = {0.1, -0.06, 0.08, 0.02, -0.01, 0.03}, by_pose[3][6], by_point[3][3], distance = 3, step = 1e-6;
  vt_vec3 point = vt_v3(0.3, -0.2, 0.4);
  vt_vec3 at = vt_adjusted_point(&camera, pose, distance, point, by_pose, by_point);
  vt_camera adjusted = vt_adjust_camera(&camera, pose, 0, distance);
  assert_true(vt_length(vt_sub(at, vt_to_camera(&adjusted, point))) < 1e-12);
  for (int k = 0; k < 9; k++) {
    double moved_pose[6], moved_point[3] = {point.x, point.y, point.z};
    memcpy(moved_pose, pose, sizeof pose);
    if (k < 6) moved_pose[k] += step;
    else moved_point[k - 6] += step;
    vt_vec3 next = vt_adjusted_point(&camera, moved_pose, distance, vt_v3(moved_point[0], moved_point[1], moved_point[2]), NULL, NULL);
    vt_vec3 slope = vt_scale(vt_sub(next, at), 1 / step);
    double s[3] = {slope.x, slope.y, slope.z};
    for (int i = 0; i < 3; i++) assert_close(k < 6 ? by_pose[i][k] : by_point[i][k - 6], s[i], 1e-5);
  }
}

static void a_softened_length_has_the_slopes_that_it_says(void **state) {
  (void)state;
  for (int trial = 0; trial < 4; trial++) {
    double r[2] = {0.4 * (trial + 1), -0.7 * trial}, soft[2] = {r[0], r[1]}, map[4], step = 1e-6;
    vt_huber_plane(soft, 1.5, map);
    double size = hypot(r[0], r[1]), loss = size <= 1.5 ? size * size : 1.5 * (2 * size - 1.5);
    assert_close(soft[0] * soft[0] + soft[1] * soft[1], loss, 1e-12);
    for (int k = 0; k < 2; k++) {
      double moved[2] = {r[0] + (k == 0) * step, r[1] + (k == 1) * step}, unused[4];
      vt_huber_plane(moved, 1.5, unused);
      for (int i = 0; i < 2; i++) assert_close(map[2 * i + k], (moved[i] - soft[i]) / step, 1e-5);
    }
  }
}

static void a_point_is_found_whatever_one_of_its_sights_says(void **state) {
  (void)state;
  vt_camera cameras[8];
  put_cameras(8, 400, cameras);
  vt_vec3 true_place = vt_v3(0.4, 0.2, -0.3);
  vt_sight sights[6];
  for (int i = 0; i < 6; i++) {
    double p[2];
    assert_true(vt_project(&cameras[i], true_place, p));
    sights[i] = (vt_sight){i, 0.5f, {(float)p[0], (float)p[1]}};
  }
  sights[3].pixel[0] += 60;
  double error;
  vt_vec3 place = vt_v3(NAN, 0, 0);
  assert_true(vt_settle_track(cameras, sights, 6, &place, &error));
  assert_true(vt_length(vt_sub(place, true_place)) < 0.005); // a pixel is 0.009 at this distance
  place = vt_v3(NAN, 0, 0);
  assert_false(vt_settle_track(cameras, sights, 1, &place, &error));
}

static void sights_that_mean_nothing_are_passed_over(void **state) {
  (void)state;
  vt_context *context = open_mending(2);
  vt_camera cameras[8];
  put_cameras(8, 400, cameras);
  vt_tracks tracks = invent_tracks(context, cameras, 8, 60, 0.3, 0, 0), chosen;
  fails_never(context, vt_choose_tracks(context, &tracks, cameras, 8, 1000, &chosen, NULL));
  assert_true(chosen.count > 30);
  size_t before = chosen.count;
  vt_free_tracks(context, &chosen);
  // one of each evil, each in a track of its own: none of these may be chosen, or the sight must be gone
  for (uint32_t i = 0; i < tracks.items[0].count; i++) tracks.sights[tracks.items[0].first + i].pixel[0] = NAN;
  for (uint32_t i = 0; i < tracks.items[1].count; i++) tracks.sights[tracks.items[1].first + i].view = 8;
  for (uint32_t i = 0; i < tracks.items[2].count; i++) tracks.sights[tracks.items[2].first + i].view = -1;
  for (uint32_t i = 0; i < tracks.items[3].count; i++) tracks.sights[tracks.items[3].first + i].deviation = 0;
  for (uint32_t i = 0; i < tracks.items[4].count; i++) // one view alone
    tracks.sights[tracks.items[4].first + i].view = tracks.sights[tracks.items[4].first].view;
  tracks.items[5].place = vt_v3(1e300, INFINITY, NAN);
  tracks.items[6].place = vt_v3(100, 100, 100); // behind most cameras
  tracks.items[7].count = 1, tracks.items[8].count = 0;
  fails_never(context, vt_choose_tracks(context, &tracks, cameras, 8, 1000, &chosen, NULL));
  assert_true(chosen.count < before && chosen.count > before - 8);
  for (size_t k = 0; k < chosen.count; k++) {
    const vt_track *track = &chosen.items[k];
    assert_true(track->count >= 2 && vt_length(track->place) < 2);
    for (uint32_t i = 0; i < track->count; i++) {
      const vt_sight *sight = &chosen.sights[track->first + i];
      assert_true(sight->view >= 0 && sight->view < 8);
      assert_true(vt_sight_distance(&cameras[sight->view], sight, track->place) < 2);
    }
  }
  vt_free_tracks(context, &chosen);
  vt_free_tracks(context, &tracks);
  vt_destroy_context(context);
}

static void longest_tracks_are_chosen_until_each_view_has_enough(void **state) {
  (void)state;
  vt_context *context = open_mending(1);
  vt_camera cameras[12];
  int seen[12] = {0};
  put_cameras(12, 400, cameras);
  vt_tracks tracks = invent_tracks(context, cameras, 12, 600, 0.3, 0.02, 0), chosen;
  fails_never(context, vt_choose_tracks(context, &tracks, cameras, 12, 20, &chosen, NULL));
  for (size_t k = 0; k < chosen.sight_count; k++) seen[chosen.sights[k].view]++;
  for (int i = 0; i < 12; i++) assert_in_range(seen[i], 15, 60);
  assert_true(chosen.sight_count < tracks.sight_count / 4);
  vt_free_tracks(context, &chosen);
  vt_free_tracks(context, &tracks);
  vt_destroy_context(context);
}

static void need_ceres(void) {
  if (!vt_can_solve_least_squares()) skip();
}

// Root mean square of the angle between two rotations, degrees, and of places, per cent of the distance, after the best similarity.
static void apart(const vt_views *views, const vt_camera *truth, double *degrees, double *share) {
  vt_camera now[64];
  for (int i = 0; i < views->count; i++) now[i] = views->items[i].camera;
  vt_similarity laid = vt_align_cameras(views->count, now, truth, vt_v3(0, 0, 0));
  *degrees = *share = 0;
  for (int i = 0; i < views->count; i++) {
    vt_camera c = vt_move_camera_by(&laid, &now[i]);
    double trace = 0, off = vt_length(vt_sub(vt_camera_centre(&c), vt_camera_centre(&truth[i]))) / vt_length(vt_camera_centre(&truth[i]));
    for (int k = 0; k < 9; k++) trace += c.rotation.m[k] * truth[i].rotation.m[k];
    double angle = 180 / VT_PI * acos(fmax(-1, fmin(1, 0.5 * (trace - 1))));
    *degrees += angle * angle / views->count, *share += 1e4 * off * off / views->count;
  }
  *degrees = sqrt(*degrees), *share = sqrt(*share);
}

static vt_views wrong_tree(vt_context *context, double outlier_share, vt_camera *truth) {
  vt_views views = photograph_tree(context, VT_SYNTHETIC_TREE, 1, 20, 0, 96);
  for (int i = 0; i < views.count; i++) truth[i] = views.items[i].camera;
  views.tracks = invent_tracks(context, truth, views.count, 800, 0.03, outlier_share, 0); // half a pixel of 1,600
  vt_damage_desc damage = vt_default_damage_desc();
  damage.seed = 3, damage.pose_degrees = 0.4, damage.pose_share = 0.004, damage.focal_share = 0.002;
  fails_never(context, vt_damage_views(context, &damage, &views));
  return views;
}

static void tracks_bring_back_turn_and_place_with_a_tenth_of_them_wrong(void **state) {
  (void)state;
  need_ceres();
  vt_context *context = open_mending(2);
  vt_camera truth[64];
  vt_views views = wrong_tree(context, 0.1, truth);
  double degrees[2], share[2];
  apart(&views, truth, &degrees[0], &share[0]);
  vt_refine_desc desc = vt_default_refine_desc();
  vt_refine_report report;
  desc.fold_count = 2, desc.rounds[0] = 1, desc.rounds[1] = 1, desc.turn_deviation = 0.4, desc.shift_deviation = 0.004;
  fails_never(context, vt_refine_views(context, &desc, &views, &report));
  apart(&views, truth, &degrees[1], &share[1]);
  printf("turn %.3f -> %.3f degrees, place %.3f -> %.3f %%, %zu sights off by %.3f -> %.3f pixels, alpha %.4f -> %.4f\n", degrees[0],
         degrees[1], share[0], share[1], report.sight_count, report.track_before, report.track_after, report.alpha_before, report.alpha_after);
  assert_true(report.tried && report.kept && report.sight_count > 1000);
  assert_true(degrees[0] > 0.25 && degrees[1] < 0.05 && share[1] < 0.05);
  assert_true(report.track_after < 0.2 * report.track_before && report.alpha_after < report.alpha_before);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

// Refined once; the cameras.
static void refine_blobs(int threads, bool with_tracks, bool bad, vt_camera *out) {
  vt_context *context = open_mending(threads);
  vt_views views = photograph_tree(context, VT_SYNTHETIC_BLOBS, 1, 8, 0, 48);
  for (int i = 0; i < 8; i++) out[i] = views.items[i].camera;
  if (with_tracks) views.tracks = invent_tracks(context, out, 8, 150, 0.05, 0.05, 0);
  for (size_t k = 0; k < views.tracks.sight_count && bad; k++) views.tracks.sights[k].pixel[k % 2] = NAN;
  vt_refine_report report;
  damage_and_refine(context, &views, &report);
  assert_true(report.kept && (report.sight_count > 0) == (with_tracks && !bad));
  for (int i = 0; i < 8; i++) out[i] = views.items[i].camera;
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

static void tracks_of_which_none_is_sound_change_no_bit(void **state) {
  (void)state;
  need_ceres();
  vt_camera without[8], with[8];
  refine_blobs(2, false, false, without);
  refine_blobs(2, true, true, with);
  assert_memory_equal(without, with, sizeof with);
}

static void any_number_of_threads_gives_the_same_cameras_with_tracks(void **state) {
  (void)state;
  need_ceres();
  static const int thread_counts[] = {1, 2, 7};
  vt_camera first[8], other[8];
  for (int t = 0; t < 3; t++) {
    refine_blobs(thread_counts[t], true, false, t ? other : first);
    if (t) assert_memory_equal(first, other, sizeof first);
  }
}

static void views_that_only_judge_have_no_say(void **state) {
  (void)state;
  need_ceres();
  vt_camera cameras[2][10];
  for (int trial = 0; trial < 2; trial++) {
    vt_context *context = open_mending(2);
    vt_views views = photograph_tree(context, VT_SYNTHETIC_BLOBS, 1, 10, 0, 48);
    for (int i = 0; i < 10; i++) cameras[trial][i] = views.items[i].camera;
    views.tracks = invent_tracks(context, cameras[trial], 10, 150, 0.05, 0, 0);
    views.items[2].role = views.items[7].role = VT_TEST;
    for (size_t k = 0; k < views.tracks.sight_count && trial; k++) // what these two saw is nonsense the second time
      if (views.tracks.sights[k].view == 2 || views.tracks.sights[k].view == 7) views.tracks.sights[k].pixel[0] = 3;
    vt_refine_desc desc = vt_default_refine_desc();
    vt_refine_report report;
    desc.mode = VT_REFINE_ON, desc.fold_count = 2, desc.rounds[0] = 1, desc.rounds[1] = 0;
    fails_never(context, vt_refine_views(context, &desc, &views, &report));
    for (int i = 0; i < 10; i++) cameras[trial][i] = views.items[i].camera;
    assert_true(report.sight_count > 0);
    vt_free_views(context, &views);
    vt_destroy_context(context);
  }
  assert_memory_equal(cameras[0], cameras[1], sizeof cameras[0]);
}

static void points_of_a_synthetic_tree_lie_on_it_and_are_seen(void **state) {
  (void)state;
  if (!vt_can_trace_rays()) skip();
  vt_context *context = open_mending(2);
  vt_synthetic_desc scene = vt_default_synthetic_desc();
  scene.train_count = 24, scene.test_count = 0, scene.width = scene.height = 200, scene.leaf_count = 1500;
  vt_views views;
  fails_never(context, vt_make_synthetic_views(context, &scene, &views));
  vt_camera cameras[24];
  for (int i = 0; i < 24; i++) cameras[i] = views.items[i].camera;
  vt_track_desc desc = vt_default_track_desc();
  desc.count = 300, desc.noise = 0, desc.outlier_share = 0;
  vt_tracks tracks;
  fails_never(context, vt_make_synthetic_tracks(context, &scene, &desc, cameras, 24, &tracks));
  assert_true(tracks.count > 100);
  for (size_t k = 0; k < tracks.count; k++) {
    const vt_sight *sights = tracks.sights + tracks.items[k].first;
    vt_vec3 place = tracks.items[k].place;
    double error;
    assert_true(tracks.items[k].count >= 3 && isnan(place.x));
    assert_true(vt_settle_track(cameras, sights, tracks.items[k].count, &place, &error)); // their rays meet in one point
    assert_true(error < 1 && vt_length(place) < 1.6);
    for (uint32_t i = 0; i < tracks.items[k].count; i++) { // and the photograph shows the tree there, or its edge
      const vt_image *p = &views.items[sights[i].view].picture;
      int alpha = 0;
      for (int c = 0; c < 9; c++) {
        int x = (int)sights[i].pixel[0] + c % 3 - 1, y = (int)sights[i].pixel[1] + c / 3 - 1;
        if (x >= 0 && y >= 0 && x < p->width && y < p->height && p->pixels[4 * (y * p->width + x) + 3] > alpha)
          alpha = p->pixels[4 * (y * p->width + x) + 3];
      }
      assert_true(alpha > 0);
    }
  }
  vt_free_tracks(context, &tracks);
  vt_free_views(context, &views);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(the_motion_of_a_point_agrees_with_differences),
                                     cmocka_unit_test(a_softened_length_has_the_slopes_that_it_says),
                                     cmocka_unit_test(a_point_is_found_whatever_one_of_its_sights_says),
                                     cmocka_unit_test(sights_that_mean_nothing_are_passed_over),
                                     cmocka_unit_test(longest_tracks_are_chosen_until_each_view_has_enough),
                                     cmocka_unit_test(tracks_bring_back_turn_and_place_with_a_tenth_of_them_wrong),
                                     cmocka_unit_test(tracks_of_which_none_is_sound_change_no_bit),
                                     cmocka_unit_test(any_number_of_threads_gives_the_same_cameras_with_tracks),
                                     cmocka_unit_test(views_that_only_judge_have_no_say),
                                     cmocka_unit_test(points_of_a_synthetic_tree_lie_on_it_and_are_seen)};
  only_threads_for_the_thread_sanitizer();
  return cmocka_run_group_tests(tests, NULL, NULL);
}
