// phantom_solids.c - a comb of thin plates, and a crown of ellipsoids
// SPDX-License-Identifier: BSD-3-Clause
//
// Comb: teeth and back are plates of 0.008, thinner than a cell of level 7 of any root that holds the comb (1.2 / 128).
// What no cell can hold a tree must smear, and how much it smears is what the comb shows. It is turned, so that plates
// do not lie along cells.
//
// Crown: after the head phantom of Shepp and Logan ("The Fourier reconstruction of a head section", IEEE Trans. Nucl.
// Sci. 1974): ellipsoids of constant value add up, negative ones hollow out. A thin envelope whose middle is almost
// empty, dense clumps near its surface as boughs make them, each hollow within, and a stem. Every negative ellipsoid
// lies wholly in one of larger positive value, so the sum is never negative: the core in the envelope, the hollow of a
// clump in its clump.

#include "base/rng.h"
#include "datasets-synthetic/phantom.h"

static vt_vec3 row(const vt_mat3 *m, int i) {
  return vt_v3(m->m[3 * i], m->m[3 * i + 1], m->m[3 * i + 2]);
}

static void add_solid(vt_phantom *p, const vt_mat3 *axes, vt_vec3 centre, vt_vec3 half, double extinction, bool box) {
  VT_ASSERT(p->solid_count < VT_SOLID_LIMIT);
  vt_solid *solid = &p->solids[p->solid_count++];
  double size[3] = {half.x, half.y, half.z};
  *solid = (vt_solid){.centre = centre, .extinction = extinction, .box = box};
  solid->reach = box ? vt_length(half) : fmax(half.x, fmax(half.y, half.z));
  for (int i = 0; i < 9; i++) solid->unit_from_world.m[i] = axes->m[i] / size[i / 3];
}

// Rows: the axes of a frame whose third leans away from z by `lean` towards `azimuth`, turned about it by `turn`.
static vt_mat3 make_frame(double azimuth, double lean, double turn) {
  vt_vec3 up = {sin(lean) * cos(azimuth), sin(lean) * sin(azimuth), cos(lean)};
  vt_vec3 side = vt_normalise(vt_cross(up, vt_v3(-sin(turn), cos(turn), 0.1)));
  vt_vec3 third = vt_cross(up, side);
  return (vt_mat3){{side.x, side.y, side.z, third.x, third.y, third.z, up.x, up.y, up.z}};
}

void vt_add_comb(const vt_synthetic_desc *desc, vt_phantom *p) {
  enum { TEETH = 9 };
  const double thickness = 0.008, gap = 0.15, bottom = -0.59, top = 0.6;
  vt_rng rng = vt_seed_rng(desc->seed, 6);
  double turn = vt_random_between(&rng, 0, VT_PI), azimuth = vt_random_between(&rng, 0, 2 * VT_PI);
  vt_mat3 frame = make_frame(azimuth, vt_random_between(&rng, 0.1, 0.25), turn);
  for (int k = 0; k < TEETH; k++) {
    vt_vec3 local = {gap * (k - TEETH / 2), 0, 0.5 * (bottom + top)};
    add_solid(p, &frame, vt_mul_transposed(&frame, local), vt_v3(0.5 * thickness, 0.5, 0.5 * (top - bottom)),
              desc->peak_extinction, true);
  }
  add_solid(p, &frame, vt_scale(row(&frame, 2), -0.6), vt_v3(0.61, 0.5, 0.5 * thickness), desc->peak_extinction, true);
}

// The extinction just inside each surface, everywhere on it: where solids overlap their sum counts.
static double find_highest(const vt_phantom *p) {
  enum { POINTS = 96 };
  double highest = 0;
  for (int i = 0; i < p->solid_count; i++)
    for (int k = 0; k < POINTS; k++) {
      double z = 2 * (k + 0.5) / POINTS - 1, r = sqrt(1 - z * z), angle = k * VT_PI * (3 - sqrt(5));
      double unit[3] = {0.999 * r * cos(angle), 0.999 * r * sin(angle), 0.999 * z};
      vt_vec3 point = p->solids[i].centre;
      for (int j = 0; j < 3; j++) { // rows of M are orthogonal, each 1 / half the axis long
        vt_vec3 axis = row(&p->solids[i].unit_from_world, j);
        point = vt_add(point, vt_scale(axis, unit[j] / vt_dot(axis, axis)));
      }
      highest = fmax(highest, vt_phantom_extinction(p, point));
    }
  return highest;
}

void vt_add_crown(const vt_synthetic_desc *desc, vt_phantom *p) {
  enum { CLUMPS = 20 };
  const vt_vec3 middle = {0, 0, 0.2}, half = {0.74, 0.74, 0.6};
  vt_rng rng = vt_seed_rng(desc->seed, 6);
  vt_mat3 upright = make_frame(0, 0, 0);
  add_solid(p, &upright, middle, half, 0.12, false);
  add_solid(p, &upright, vt_v3(0, 0, 0.14), vt_v3(0.42, 0.42, 0.34), -0.1, false);
  add_solid(p, &upright, vt_v3(0, 0, -0.5), vt_v3(0.055, 0.055, 0.48), 1.2, false);
  for (int k = 0; k < CLUMPS; k++) {
    double z = -0.6 + 1.58 * (k + vt_random_between(&rng, 0.2, 0.8)) / CLUMPS, r = sqrt(1 - z * z);
    double angle = k * VT_PI * (3 - sqrt(5)) + vt_random_between(&rng, -0.4, 0.4);
    double depth = vt_random_between(&rng, 0.66, 0.8), size = vt_random_between(&rng, 0.13, 0.22);
    vt_vec3 away = {half.x * r * cos(angle), half.y * r * sin(angle), half.z * z};
    double azimuth = vt_random_between(&rng, 0, 2 * VT_PI), lean = vt_random_between(&rng, 0, 0.7);
    vt_mat3 frame = make_frame(azimuth, lean, vt_random_between(&rng, 0, 2 * VT_PI));
    vt_vec3 centre = vt_add(middle, vt_scale(away, depth)),
            axes = {size, size * vt_random_between(&rng, 0.7, 1), size * 0.7};
    double extinction = vt_random_between(&rng, 0.6, 1);
    add_solid(p, &frame, centre, axes, extinction, false);
    add_solid(p, &frame, centre, vt_scale(axes, 0.5), -0.6 * extinction, false);
  }
  double scale = desc->peak_extinction / find_highest(p);
  for (int i = 0; i < p->solid_count; i++) p->solids[i].extinction *= scale;
}
