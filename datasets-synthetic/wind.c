// wind.c - branches sway and leaves flutter
// SPDX-License-Identifier: BSD-3-Clause
//
// A vertex at x moves by
//     d(x) = g(h) sum_k a_k sin(w_k . x + p_k)  +  f(h) sum_j b_j sin(v_j . x + q_j)     (the second for leaves only)
// with h its height over the foot, 0..1. The first sum is long waves (a tree's width and half of it), mostly sideways,
// and g = h^1.5 leaves the foot of the trunk where it is. The second is waves of a few leaves' lengths in all
// directions. All |a_k| and |b_j| sum to the amplitude. Normals turn by the inverse transpose of I + dd/dx, which is
// known in closed form: a leaf's light and shade change with it. What goes wrong: short waves with a large amplitude
// tear leaves to shreds, so that each b_j is bounded by a slope.

#include "datasets-synthetic/wind.h"
#include "base/rng.h"

enum { SWAYS = 3, FLUTTERS = 3, WAVES = SWAYS + FLUTTERS };

static const double steepest = 0.3; // of one wave of flutter

typedef struct wave {
  vt_vec3 move, number; // world units; radians per world unit
  double phase;
} wave;

static vt_vec3 draw_direction(vt_rng *rng, double flatness) {
  double z = vt_random_between(rng, -1, 1) * flatness, angle = vt_random_between(rng, 0, 2 * VT_PI),
         r = sqrt(1 - z * z);
  return vt_v3(r * cos(angle), r * sin(angle), z);
}

static void draw_waves(const vt_wind *wind, uint64_t gust, wave waves[WAVES]) {
  vt_rng rng = vt_seed_rng(wind->seed + (gust << 32), 0x77696e64 + (gust >> 32));
  double span = wind->crown - wind->foot;
  for (int k = 0; k < WAVES; k++) {
    bool sway = k < SWAYS;
    double length = sway ? span * vt_random_between(&rng, 0.4, 1.6) : vt_random_between(&rng, 0.07, 0.16);
    double size = wind->amplitude * (sway ? 0.75 / SWAYS : 0.25 / FLUTTERS), number = 2 * VT_PI / length;
    if (!sway) size = fmin(size, steepest / number);
    waves[k].move = vt_scale(draw_direction(&rng, sway ? 0.25 : 1), size);
    waves[k].number = vt_scale(draw_direction(&rng, 1), number);
    waves[k].phase = vt_random_between(&rng, 0, 2 * VT_PI);
  }
}

// Adds share * wave to the displacement, and its gradient to the columns: column[j] = d displacement / d x_j.
static void add_wave(const wave *w, vt_vec3 at, double share, double slope, vt_vec3 *displacement, vt_vec3 column[3]) {
  double angle = vt_dot(w->number, at) + w->phase, s = sin(angle), c = cos(angle) * share;
  *displacement = vt_add(*displacement, vt_scale(w->move, share * s));
  column[0] = vt_add(column[0], vt_scale(w->move, c * w->number.x));
  column[1] = vt_add(column[1], vt_scale(w->move, c * w->number.y));
  column[2] = vt_add(column[2], vt_scale(w->move, c * w->number.z + slope * s));
}

static void blow_vertex(const vt_wind *wind, const wave waves[WAVES], bool flutters, vt_vertex *v) {
  vt_vec3 at = {v->position[0], v->position[1], v->position[2]}, displacement = {0, 0, 0};
  vt_vec3 column[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  double span = wind->crown - wind->foot, h = fmin(fmax((at.z - wind->foot) / span, 0), 1), root = sqrt(h);
  for (int k = 0; k < SWAYS; k++) add_wave(&waves[k], at, h * root, 1.5 * root / span, &displacement, column);
  for (int k = SWAYS; k < WAVES && flutters; k++)
    add_wave(&waves[k], at, 0.3 + 0.7 * h, 0.7 / span, &displacement, column);
  vt_vec3 n = {v->normal[0], v->normal[1], v->normal[2]};
  // The cofactors of a matrix are its determinant times its inverse transpose.
  n = vt_add(vt_add(vt_scale(vt_cross(column[1], column[2]), n.x), vt_scale(vt_cross(column[2], column[0]), n.y)),
             vt_scale(vt_cross(column[0], column[1]), n.z));
  n = vt_normalise(n), at = vt_add(at, displacement);
  v->position[0] = (float)at.x, v->position[1] = (float)at.y, v->position[2] = (float)at.z;
  v->normal[0] = (float)n.x, v->normal[1] = (float)n.y, v->normal[2] = (float)n.z;
}

vt_status vt_make_wind(vt_context *ctx, const vt_mesh *mesh, uint32_t seed, double amplitude, vt_wind *out) {
  *out = (vt_wind){.seed = seed, .amplitude = amplitude, .foot = INFINITY, .crown = -INFINITY};
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    double z = mesh->vertices[v].position[2];
    out->foot = fmin(out->foot, z), out->crown = fmax(out->crown, z);
  }
  if (!(out->crown > out->foot)) out->foot = -1, out->crown = 1; // nothing that could sway
  out->flutters = VT_NEW(ctx, bool, mesh->vertex_count);
  if (!out->flutters) return VT_OUT_OF_MEMORY;
  for (size_t t = mesh->solid_count; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++) out->flutters[mesh->triangles[t][k]] = true;
  return VT_OK;
}

void vt_free_wind(vt_context *ctx, vt_wind *wind) {
  vt_free(ctx, wind->flutters);
  *wind = (vt_wind){0};
}

void vt_blow(const vt_wind *wind, const vt_mesh *mesh, uint64_t gust, vt_vertex *out) {
  wave waves[WAVES];
  draw_waves(wind, gust, waves);
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    out[v] = mesh->vertices[v];
    if (wind->amplitude > 0) blow_vertex(wind, waves, wind->flutters[v], &out[v]);
  }
}

uint64_t vt_gust_of(const vt_views *views, int view) {
  uint64_t before = 0;
  for (int i = 0; i < view; i++) before += views->items[i].role == views->items[view].role;
  return before | (uint64_t)views->items[view].role << 32;
}
