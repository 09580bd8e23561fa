// bark.c - trunk and branches as tapered tubes
// SPDX-License-Identifier: BSD-3-Clause
//
// The skeleton is cut into branches: from a fork a branch goes on into the thickest child, every other child starts a
// branch of its own. A branch is a row of rings whose frames are carried along without twist (each frame is the last
// one, made orthogonal to the new direction), closed by a point at the tip. A side branch begins at the fork's node,
// inside the thicker wood, so that no gap shows. Both ends are capped: every tube is a closed solid, and faces seen
// from behind need not be drawn.

#include "datasets-synthetic/bark.h"
#include "base/rng.h"

typedef struct tube {
  vt_mesh *mesh;
  vt_rng rng;
  vt_vec3 colour; // linear light
  int sides;
  double fissures[16]; // brightness of each side's strip
  vt_vec3 across;      // of the last ring
  uint32_t last;       // first vertex of the last ring
} tube;

static int count_sides(double radius) {
  return radius < 0.006 ? 4 : radius < 0.012 ? 6 : radius < 0.03 ? 9 : 16;
}

static void add_ring(tube *t, vt_vec3 centre, vt_vec3 along, double radius, bool first) {
  if (first) {
    vt_vec3 helper = fabs(along.x) < 0.7 ? vt_v3(1, 0, 0) : vt_v3(0, 1, 0);
    t->across = vt_cross(along, helper);
  }
  t->across = vt_normalise(vt_sub(t->across, vt_scale(along, vt_dot(t->across, along))));
  vt_vec3 third = vt_cross(along, t->across);
  uint32_t ring = (uint32_t)t->mesh->vertex_count;
  for (int k = 0; k < t->sides; k++) {
    double angle = 2 * VT_PI * k / t->sides;
    vt_vec3 normal = vt_add(vt_scale(t->across, cos(angle)), vt_scale(third, sin(angle)));
    double bulge = t->sides > 6 ? 1 + 0.09 * (t->fissures[k] - 1) : 1;
    double shade = t->fissures[k] * vt_random_between(&t->rng, 0.8, 1.2);
    vt_add_vertex(t->mesh, vt_add(centre, vt_scale(normal, radius * bulge)), normal, vt_scale(t->colour, shade));
  }
  for (int k = 0; !first && k < t->sides; k++) {
    uint32_t next = (uint32_t)((k + 1) % t->sides), here = (uint32_t)k;
    vt_add_triangle(t->mesh, t->last + here, t->last + next, ring + next);
    vt_add_triangle(t->mesh, t->last + here, ring + next, ring + here);
  }
  t->last = ring;
}

// Closes the last ring by a fan around `point`; turned round for the foot of a branch.
static void add_point(tube *t, vt_vec3 point, vt_vec3 normal, bool foot) {
  uint32_t apex = vt_add_vertex(t->mesh, point, normal, t->colour);
  for (int k = 0; k < t->sides; k++) {
    uint32_t here = t->last + (uint32_t)k, next = t->last + (uint32_t)((k + 1) % t->sides);
    if (foot)
      vt_add_triangle(t->mesh, next, here, apex);
    else
      vt_add_triangle(t->mesh, here, next, apex);
  }
}

static double surface_radius(const vt_skeleton_node *node) { // the foot of a trunk spreads into its roots
  return node->radius * (1 + 0.5 * exp(-node->position.z / 0.08));
}

static vt_status add_branch(vt_context *ctx, const vt_skeleton *s, const int *main_child, int start, tube *t) {
  const vt_skeleton_node *nodes = s->nodes;
  int before = nodes[start].parent;
  double radius = surface_radius(&nodes[start]);
  t->sides = count_sides(radius);
  size_t rings = 1; // one more at the fork, but for the trunk
  for (int n = start; n >= 0; n = main_child[n]) rings++;
  vt_status status = vt_reserve_mesh(ctx, t->mesh, rings * (size_t)t->sides + 2, (rings + 1) * 2 * (size_t)t->sides);
  if (status) return status;
  for (int k = 0; k < t->sides; k++) t->fissures[k] = vt_random_between(&t->rng, 0.65, 1.3);
  vt_vec3 from = before >= 0 ? nodes[before].position : nodes[start].position, along = {0, 0, 1};
  if (before >= 0) {
    along = vt_normalise(vt_sub(nodes[start].position, from));
    add_ring(t, from, along, radius, true);
    add_point(t, from, vt_scale(along, -1), true);
  }
  for (int n = start, next; n >= 0; n = next) {
    next = main_child[n];
    vt_vec3 ahead = next >= 0 ? nodes[next].position : nodes[n].position;
    vt_vec3 direction = vt_sub(ahead, from);
    if (vt_dot(direction, direction) > 0) along = vt_normalise(direction);
    radius = surface_radius(&nodes[n]) * (next >= 0 ? 1 : 0.6);
    bool first = n == start && before < 0;
    add_ring(t, nodes[n].position, along, radius, first);
    if (first) add_point(t, nodes[n].position, vt_scale(along, -1), true);
    from = nodes[n].position;
  }
  add_point(t, vt_add(from, vt_scale(along, 2 * radius)), along, false);
  return VT_OK;
}

static vt_vec3 draw_colour(vt_rng *rng) { // from grey beech to brown oak
  double light = vt_random_between(rng, 0.75, 1.35), brown = vt_random_unit(rng);
  return vt_scale(vt_v3(0.135 + 0.02 * brown, 0.118 - 0.008 * brown, 0.1 - 0.032 * brown), light);
}

vt_status vt_add_bark(vt_context *ctx, const vt_skeleton *s, uint32_t seed, vt_mesh *mesh) {
  vt_status status = VT_OK;
  int *main_child = VT_NEW(ctx, int, (size_t)s->count);
  if (!main_child) return VT_OUT_OF_MEMORY;
  for (int n = 0; n < s->count; n++) main_child[n] = -1;
  for (int n = 1; n < s->count; n++) {
    int *main = &main_child[s->nodes[n].parent];
    if (*main < 0 || s->nodes[n].radius > s->nodes[*main].radius) *main = n;
  }
  vt_rng rng = vt_seed_rng(seed, 2);
  tube t = {.mesh = mesh, .colour = draw_colour(&rng), .rng = rng};
  for (int n = 0; n < s->count && !status; n++)
    if (n == 0 || main_child[s->nodes[n].parent] != n) status = add_branch(ctx, s, main_child, n, &t);
  mesh->solid_count = mesh->triangle_count;
  vt_free(ctx, main_child);
  return status;
}
