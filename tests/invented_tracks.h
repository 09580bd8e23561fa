// invented_tracks.h - points around the origin and what cameras that look at it see of them
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_INVENTED_TRACKS_H
#define VT_TESTS_INVENTED_TRACKS_H

#include "base/rng.h"
#include "base/tracks.h"
#include "tests/unit.h"

#define FOV (60 * VT_PI / 180)

// A loop of cameras, some higher than others, whose pictures the points fill.
static inline void put_cameras(int count, int size, vt_camera *out) {
  for (int i = 0; i < count; i++) {
    double a = 2 * VT_PI * i / count, distance = 3.2;
    vt_vec3 eye = vt_v3(distance * cos(a), distance * sin(a), 0.9 * sin(2.3 * a));
    out[i] = vt_look_at(eye, vt_v3(0, 0, 0), vt_v3(0, 0, 1), FOV, size, size);
  }
}

static inline double normal_number(vt_rng *rng) {
  double sum = -6;
  for (int k = 0; k < 12; k++) sum += vt_random_unit(rng);
  return sum;
}

// Points of a ball of radius 1.3, each seen by the cameras on its side of the world, with noise in pixels and a share that is
// anywhere. Bent by k1. Nobody has found their places.
static inline vt_tracks invent_tracks(vt_context *context, const vt_camera *cameras, int camera_count, int count, double noise,
                                      double outlier_share, double k1) {
  vt_tracks out = {.items = VT_NEW(context, vt_track, (size_t)count), .sights = VT_NEW(context, vt_sight, (size_t)(count * camera_count))};
  assert_true(out.items && out.sights);
  vt_rng rng = vt_seed_rng(9, 3);
  for (int k = 0; k < count; k++) {
    double v[3];
    do
      for (int c = 0; c < 3; c++) v[c] = vt_random_between(&rng, -1.3, 1.3);
    while (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] > 1.69);
    vt_vec3 point = vt_v3(v[0], v[1], v[2]);
    vt_track *track = &out.items[out.count++];
    *track = (vt_track){vt_v3(NAN, NAN, NAN), (uint32_t)out.sight_count, 0};
    for (int i = 0; i < camera_count; i++) {
      const vt_camera *c = &cameras[i];
      vt_vec3 side = vt_normalise(vt_camera_centre(c));
      double p[2], off[2] = {noise * normal_number(&rng), noise * normal_number(&rng)}, wrong = vt_random_unit(&rng);
      if (vt_dot(vt_normalise(point), side) < 0.6 || !vt_project(c, point, p)) continue;
      double x = (p[0] - c->cx) / c->fx, y = (p[1] - c->cy) / c->fy, bend = 1 + k1 * (x * x + y * y);
      p[0] = c->cx + c->fx * x * bend + off[0], p[1] = c->cy + c->fy * y * bend + off[1];
      if (p[0] < 0 || p[1] < 0 || p[0] > c->width || p[1] > c->height) continue;
      if (wrong < outlier_share) p[0] = vt_random_between(&rng, 0, c->width), p[1] = vt_random_between(&rng, 0, c->height);
      out.sights[out.sight_count++] = (vt_sight){i, (float)fmax(noise, 0.01), {(float)p[0], (float)p[1]}};
      track->count++;
    }
  }
  return out;
}

#endif
