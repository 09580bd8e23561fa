// whorls.c - the wood of a tree that makes a whorl of branches every year
// SPDX-License-Identifier: BSD-3-Clause
//
// Pines grow from a fixed number of buds: each spring the leader makes one shoot, and around its foot a ring of buds
// makes branches, which do the same lying down, with a pair of side shoots a year (Rauh's model in Halle, Oldeman,
// Tomlinson, "Tropical Trees and Forests", 1978). The crown is written down as it stands, not simulated: branch length
// over relative height h of the crown is R (1 - h)^p, a little less at its foot where shade kills; branches leave the
// trunk steeply at the top and level at the foot, where the weight of years has pulled them down, and their ends turn up.
// What goes wrong without noise: whorls one above the other make a plastic fir, so every branch has its own length,
// height, azimuth and slope, and some are missing.

#include "datasets-synthetic/whorls.h"

enum { ORDER_LIMIT = 3, YEAR_LIMIT = 40 };

typedef struct whorl_job {
  vt_context *context;
  const vt_whorls *whorls;
  vt_rng *rng;
  vt_skeleton *skeleton;
} whorl_job;

// Side shoots spread in the plane of the branch that lies flattest, as those of a bough do, and a little upwards.
static vt_vec3 side_direction(const whorl_job *job, vt_vec3 along, int side) {
  vt_vec3 flat = vt_normalise(vt_cross(vt_v3(0, 0, 1), along));
  if (vt_dot(flat, flat) < 0.5) flat = vt_v3(1, 0, 0);
  double angle = job->whorls->fork * vt_random_between(job->rng, 0.75, 1.2), turn = side % 2 ? 1 : -1;
  vt_vec3 across = vt_add(vt_scale(flat, turn), vt_v3(0, 0, vt_random_between(job->rng, -0.25, 0.6)));
  return vt_normalise(vt_add(vt_scale(along, cos(angle)), vt_scale(vt_normalise(across), sin(angle))));
}

static vt_status grow_shoot(const whorl_job *job, int from, vt_vec3 direction, double length, int order) {
  const vt_whorls *w = job->whorls;
  vt_skeleton *s = job->skeleton;
  double gone = 0, next_fork = w->shoot * vt_random_between(job->rng, 0.5, 1);
  vt_status status = VT_OK;
  for (int node = from; gone < length && !status;) {
    direction.z += w->upturn * w->step * (order == 1 ? gone / length : 0.6);
    direction = vt_normalise(vt_add(direction, vt_scale(vt_random_in_ball(job->rng), 0.09)));
    status = vt_add_node(job->context, s, vt_add(s->nodes[node].position, vt_scale(direction, w->step)), node);
    node = s->count - 1, gone += w->step;
    if (status || gone < next_fork || gone >= length || order >= ORDER_LIMIT) continue;
    next_fork += w->shoot * vt_random_between(job->rng, 0.8, 1.2);
    for (int side = 0; side < 2 && !status; side++) {
      if (vt_random_unit(job->rng) < w->missing) continue;
      double share = vt_draw(job->rng, w->side), left = (length - gone) * share + 0.5 * w->shoot;
      vt_vec3 aside = side_direction(job, direction, side);
      status = grow_shoot(job, node, aside, fmin(left, 0.42 * length), order + 1);
    }
  }
  return status;
}

static vt_status grow_whorl(const whorl_job *job, int from, double h, double radius, double phase) {
  const vt_whorls *w = job->whorls;
  int count = w->branch_low + (int)(vt_random(job->rng) % (uint32_t)w->branch_range);
  double shade = 0.66 + 0.34 * fmin(1, h / 0.22); // at the crown's foot
  vt_status status = VT_OK;
  for (int b = 0; b < count && !status; b++) {
    double azimuth = phase + 2 * VT_PI * (b + vt_random_between(job->rng, -0.22, 0.22)) / count;
    double rise = w->low_rise + (w->high_rise - w->low_rise) * pow(h, 1.3) + vt_random_between(job->rng, -0.14, 0.14);
    double length = radius * pow(1 - h, w->taper) * shade * vt_random_between(job->rng, 0.72, 1.12);
    if (vt_random_unit(job->rng) < w->missing || length < 2 * w->step) continue;
    vt_vec3 direction = {cos(rise) * cos(azimuth), cos(rise) * sin(azimuth), sin(rise)};
    status = grow_shoot(job, from - (int)(vt_random(job->rng) % 2), direction, length, 1);
  }
  return status;
}

vt_status vt_grow_whorls(vt_context *ctx, const vt_whorls *whorls, vt_rng *rng, vt_skeleton *s) {
  whorl_job job = {ctx, whorls, rng, s};
  double base = vt_draw(rng, whorls->base), radius = vt_draw(rng, whorls->radius), top = 2, next = base, phase = 0;
  int years = whorls->years_low + (int)(vt_random(rng) % (uint32_t)whorls->years_range);
  vt_vec3 position = {0, 0, 0}, drift = {0, 0, 0};
  int trunk = 0;
  vt_status status = vt_add_node(ctx, s, position, -1);
  while (position.z < top && !status) {
    if (vt_cancelled(ctx)) return vt_fail(ctx, VT_CANCELLED, "interrupted: nothing was written; run it again");
    drift = vt_add(vt_scale(drift, 0.93), vt_scale(vt_random_in_ball(rng), 0.035));
    vt_vec3 upright = vt_v3(-0.6 * position.x, -0.6 * position.y, 1);
    position = vt_add(position, vt_scale(vt_normalise(vt_add(upright, drift)), whorls->step));
    status = vt_add_node(ctx, s, position, trunk);
    trunk = s->count - 1;
    if (status || position.z < next || position.z > top - whorls->step) continue;
    phase += VT_PI * (3 - sqrt(5)) + vt_random_between(rng, -0.3, 0.3);
    next += (top - base) / years * vt_random_between(rng, 0.8, 1.2);
    status = grow_whorl(&job, trunk, (position.z - base) / (top - base), radius, phase);
  }
  return status;
}
