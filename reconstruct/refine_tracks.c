// refine_tracks.c - what a calibration's tracks say of the cameras, beside the mattes
// SPDX-License-Identifier: BSD-3-Clause
//
// A point X with a place of its own is seen by camera i at x_i, known to s_i (half a pixel: what calibration left):
//
//   sum_i huber(|f exp(a) (X_c, Y_c) / Z_c + c - x_i| / s_i),   X_c by vt_adjusted_point
//
// Mattes know where the tree falls in each picture, and hardly a turn from the step that undoes it (refine_cameras.c); points before
// and behind the trunk know that, each for itself. Points do not know the tree: where leaves match badly, or the calibration is
// dragged by the background, mattes hold. Both kinds of residuals stand in one sum in units of their deviations. Sights are taken for
// independent, unlike a matte's pixels: each is another patch of bark, and a wrong one is thrown out, or pulls no more than Huber lets
// it. Places are eliminated (Schur), since each belongs to few sights, and found anew from the cameras before each solution: they
// follow every turn and scale of the whole by themselves, and who was thrown out by bad cameras is heard again with better ones. While
// cameras are many deviations off, Huber's bend is as far out as the sights usually are: within it steps are those of plain squares, and
// beyond it they are short (from 20 deviations, eight of them ended half way).

#include "reconstruct/refine_cameras.h"

#define WIDTH 1.5          // deviations, of Huber's loss
#define SIGHTS_OF_A_VIEW 400
#define SIGHTS_OF_ALL 150000

vt_status vt_choose_refinement_tracks(vt_refinement *r, vt_tracks *out, double *usual) {
  *out = (vt_tracks){0}, *usual = 1;
  if (r->without_tracks || !r->tracks.count) return VT_OK;
  int most = SIGHTS_OF_ALL / r->views.count;
  vt_camera *now = VT_NEW(r->context, vt_camera, (size_t)r->views.count);
  if (!now) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < r->views.count; i++) now[i] = r->views.items[i].camera;
  vt_status status = vt_choose_tracks(r->context, &r->tracks, now, r->views.count, most < SIGHTS_OF_A_VIEW ? most : SIGHTS_OF_A_VIEW, out, usual);
  vt_free(r->context, now);
  return status;
}

vt_status vt_refinement_track_error(vt_refinement *r, double *pixels, size_t *sight_count) {
  vt_tracks tracks;
  double usual;
  vt_status status = vt_choose_refinement_tracks(r, &tracks, &usual);
  *pixels = 0, *sight_count = tracks.sight_count;
  for (size_t k = 0; k < tracks.count && !status; k++)
    for (uint32_t i = 0; i < tracks.items[k].count; i++) {
      const vt_sight *sight = &tracks.sights[tracks.items[k].first + i];
      *pixels += vt_sight_distance(&r->views.items[sight->view].camera, sight, tracks.items[k].place) / (double)tracks.sight_count;
    }
  vt_free_tracks(r->context, &tracks);
  return status;
}

static void fill_rows(double *jacobian, int columns, const double by_pixel[2][3], const double (*by)[6], const double (*by3)[3]) {
  for (int row = 0; row < 2; row++)
    for (int k = 0; k < columns; k++) {
      double sum = 0;
      for (int j = 0; j < 3; j++) sum += by_pixel[row][j] * (by ? by[j][k] : by3[j][k]);
      jacobian[row * columns + k] = sum;
    }
}

static bool evaluate(void *user, const double *const *parameters, double *residuals, double **jacobians) {
  const vt_sight_block *b = user;
  double by_pose[3][6], by_point[3][3], map[4];
  vt_vec3 place = vt_v3(parameters[2][0], parameters[2][1], parameters[2][2]);
  vt_vec3 p = vt_adjusted_point(b->came, parameters[0], b->distance, place, jacobians ? by_pose : NULL, jacobians ? by_point : NULL);
  if (!(p.z > 1e-9 * b->distance)) return false;
  double fx = b->came->fx * exp(parameters[1][0]), fy = b->came->fy * exp(parameters[1][0]), x = fx * p.x / p.z, y = fy * p.y / p.z;
  residuals[0] = b->weight * (x + b->came->cx - b->pixel[0]), residuals[1] = b->weight * (y + b->came->cy - b->pixel[1]);
  if (!isfinite(residuals[0] + residuals[1])) return false;
  vt_huber_plane(residuals, b->width, map);
  if (!jacobians) return true;
  double w = b->weight / p.z, plain[2][3] = {{w * fx, 0, -w * x}, {0, w * fy, -w * y}}, by_pixel[2][3];
  for (int k = 0; k < 3; k++)
    for (int row = 0; row < 2; row++) by_pixel[row][k] = map[2 * row] * plain[0][k] + map[2 * row + 1] * plain[1][k];
  if (jacobians[0]) fill_rows(jacobians[0], 6, by_pixel, by_pose, NULL);
  for (int row = 0; row < 2 && jacobians[1]; row++) jacobians[1][row] = b->weight * (map[2 * row] * x + map[2 * row + 1] * y);
  if (jacobians[2]) fill_rows(jacobians[2], 3, by_pixel, NULL, by_point);
  return true;
}

void vt_add_sights(vt_refinement *r, vt_tracks *chosen, double usual, int first_lens, int first_group, vt_parameter_group *groups,
                   vt_sight_block *sights, vt_residual_block *blocks) {
  for (size_t k = 0; k < chosen->count; k++) {
    vt_track *track = &chosen->items[k];
    groups[k] = (vt_parameter_group){.values = &track->place.x, .size = 3, .eliminated = true};
    for (uint32_t i = track->first; i < track->first + track->count; i++) {
      const vt_sight *s = &chosen->sights[i];
      sights[i] = (vt_sight_block){&r->input[s->view], r->distance[s->view], 1 / (double)s->deviation, WIDTH * usual,
                                   {(double)s->pixel[0], (double)s->pixel[1]}, {s->view, first_lens + r->lens[s->view], first_group + (int)k}};
      blocks[i] = (vt_residual_block){evaluate, &sights[i], 2, 3, sights[i].groups};
    }
  }
}
