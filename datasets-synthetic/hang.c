// hang.c - fine twigs that hang
// SPDX-License-Identifier: BSD-3-Clause
//
// The shoots of birch and weeping willow are too thin to carry themselves. Each sets out from thin wood, outwards and a
// little up, and gives way to gravity step by step: its direction d turns to d + k (g + drift), g straight down, drift a
// small slope of its own, so that the twigs of a curtain are not parallel. (A bending rod would do the same from its
// stiffness; nobody sees the difference, and k is a number one can choose by looking.) Twigs are spread evenly over the
// length of the thin wood, more of them far from the trunk, where there is light; some spring from other hanging twigs.

#include "datasets-synthetic/hang.h"

// Weight of thin wood that ends in each node, summed: where the k-th of evenly spread twigs springs from.
static double sum_wood(const vt_skeleton *s, const vt_hanging *hanging, double *sums) {
  double total = 0, thin = hanging->from * s->tip_radius;
  for (int n = 0; n < s->count; n++) {
    vt_vec3 p = s->nodes[n].position;
    if (s->nodes[n].parent >= 0 && s->nodes[n].radius < thin)
      total += pow(0.05 + sqrt(p.x * p.x + p.y * p.y), hanging->outward) * (s->nodes[n].child_count ? 1 : 3);
    sums[n] = total;
  }
  return total;
}

static vt_vec3 first_direction(const vt_skeleton *s, const vt_hanging *hanging, int from, vt_rng *rng) {
  vt_vec3 p = s->nodes[from].position, along = vt_normalise(vt_sub(p, s->nodes[s->nodes[from].parent].position));
  vt_vec3 out = vt_normalise(vt_v3(p.x, p.y, 0)), random = vt_random_in_ball(rng);
  vt_vec3 d = vt_add(vt_add(vt_scale(along, 0.7), vt_scale(out, 0.5)), vt_scale(random, 0.7));
  d.z += hanging->lift;
  return vt_normalise(d);
}

static vt_status hang_twig(vt_context *ctx, const vt_hanging *hanging, int from, double length, vt_rng *rng, vt_skeleton *s) {
  vt_vec3 d = first_direction(s, hanging, from, rng), rest = vt_scale(vt_random_in_ball(rng), hanging->drift);
  vt_vec3 out = vt_normalise(vt_v3(d.x, d.y, 0));
  rest = vt_add(rest, vt_scale(out, 0.6 * hanging->drift));
  rest.z = -1;
  double floor = hanging->clearance * vt_random_between(rng, 1, 2.6), gone = 0;
  vt_status status = VT_OK;
  for (int node = from; gone < length && !status; gone += hanging->step) {
    d = vt_add(d, vt_add(vt_scale(rest, hanging->limp), vt_scale(vt_random_in_ball(rng), hanging->wander)));
    d = vt_normalise(d);
    vt_vec3 position = vt_add(s->nodes[node].position, vt_scale(d, hanging->step));
    if (position.z < floor) break;
    status = vt_add_node(ctx, s, position, node);
    node = s->count - 1;
  }
  return status;
}

vt_status vt_hang_twigs(vt_context *ctx, const vt_hanging *hanging, vt_rng *rng, vt_skeleton *s) {
  int old_count = s->count, side_count = (int)(hanging->count * hanging->side_share);
  double *sums = VT_NEW(ctx, double, (size_t)old_count);
  vt_status status = sums ? VT_OK : VT_OUT_OF_MEMORY;
  if (status) return status;
  double total = sum_wood(s, hanging, sums);
  int main_count = total > 0 ? hanging->count - side_count : 0;
  for (int k = 0, n = 0; k < main_count && !status; k++) {
    if (k % 256 == 0 && vt_cancelled(ctx))
      status = vt_fail(ctx, VT_CANCELLED, "interrupted: nothing was written; run it again");
    double target = total * (k + vt_random_unit(rng)) / main_count;
    while (n + 1 < old_count && sums[n] <= target) n++;
    if (!status && s->nodes[n].parent >= 0) status = hang_twig(ctx, hanging, n, vt_draw(rng, hanging->length), rng, s);
  }
  int hung = s->count - old_count;
  for (int k = 0; k < side_count && hung && !status; k++) {
    int from = old_count + (int)(vt_random(rng) % (uint32_t)hung);
    status = hang_twig(ctx, hanging, from, 0.5 * vt_draw(rng, hanging->length), rng, s);
  }
  vt_free(ctx, sums);
  return status;
}
