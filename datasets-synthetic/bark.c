// bark.c - trunk and branches as tapered tubes
// SPDX-License-Identifier: BSD-3-Clause
//
// The skeleton is cut into branches: from a fork a branch goes on into the thickest child, every other child starts a
// branch of its own. A branch is a row of rings whose frames are carried along without twist (each frame is the last
// one, made orthogonal to the new direction), closed by a point at the tip. A side branch begins at the fork's node,
// inside the thicker wood, so that no gap shows. Both ends are capped: every tube is a closed solid, and faces seen
// from behind need not be drawn.

#include "datasets-synthetic/bark.h"

typedef struct tube {
  vt_mesh *mesh;
  vt_rng rng;
  const vt_wood *wood;
  int bark_material;
  vt_vec3 bark;   // linear light, of this tree
  vt_vec3 colour; // of the last ring
  double length, girth; // along the branch so far; half the circumference at its foot; world units
  int sides;
  double fissures[16]; // brightness of each side's strip
  vt_vec3 across;      // of the last ring
  uint32_t last;       // first vertex of the last ring
} tube;

static int count_sides(const vt_wood *wood, double radius) {
  return radius < 0.006 ? wood->twig_sides : radius < 0.012 ? 6 : radius < 0.03 ? 9 : 16;
}

static double smooth_step(double low, double high, double x) {
  double t = fmin(fmax((x - low) / (high - low), 0), 1);
  return t * t * (3 - 2 * t);
}

static vt_vec3 mix(vt_vec3 a, vt_vec3 b, double share) {
  return vt_add(vt_scale(a, 1 - share), vt_scale(b, share));
}

static vt_vec3 colour_at(const tube *t, vt_vec3 at, double radius) {
  vt_vec3 colour = t->bark;
  if (t->wood->high.x > 0) colour = mix(colour, t->wood->high, smooth_step(0.5, 1.2, at.z));
  if (t->wood->twig.x > 0)
    colour = mix(colour, t->wood->twig, 1 - smooth_step(0.6 * t->wood->twig_radius, 1.6 * t->wood->twig_radius, radius));
  return colour;
}

static void put_uv(tube *t, uint32_t vertex, double u) {
  float *uv = t->mesh->vertices[vertex].uv;
  uv[0] = (float)u, uv[1] = (float)(t->length / t->girth);
}

static void add_side(tube *t, uint32_t a, uint32_t b, uint32_t c, double radius) {
  vt_add_triangle(t->mesh, a, b, c);
  int material = t->bark_material + (radius < t->wood->twig_radius);
  t->mesh->triangle_materials[t->mesh->triangle_count - 1] = (uint16_t)material;
}

// `length`: of the piece of wood between the last ring and this one.
static void add_ring(tube *t, vt_vec3 centre, vt_vec3 along, double radius, double length, bool first) {
  if (first) {
    vt_vec3 helper = fabs(along.x) < 0.7 ? vt_v3(1, 0, 0) : vt_v3(0, 1, 0);
    t->across = vt_cross(along, helper);
  }
  t->across = vt_normalise(vt_sub(t->across, vt_scale(along, vt_dot(t->across, along))));
  vt_vec3 third = vt_cross(along, t->across);
  uint32_t ring = (uint32_t)t->mesh->vertex_count;
  t->colour = colour_at(t, centre, radius);
  t->length += length;
  for (int k = 0; k < t->sides; k++) {
    double angle = 2 * VT_PI * k / t->sides;
    vt_vec3 normal = vt_add(vt_scale(t->across, cos(angle)), vt_scale(third, sin(angle)));
    double bulge = t->sides > 6 ? 1 + 0.09 * (t->fissures[k] - 1) : 1;
    double shade = t->fissures[k] * vt_draw(&t->rng, t->wood->speckle);
    vt_vec3 colour = vt_scale(t->colour, shade);
    uint32_t vertex = vt_add_vertex(t->mesh, vt_add(centre, vt_scale(normal, radius * bulge)), normal, colour);
    put_uv(t, vertex, 1 - fabs(1 - 2.0 * k / t->sides));
  }
  for (int k = 0; !first && k < t->sides; k++) {
    uint32_t next = (uint32_t)((k + 1) % t->sides), here = (uint32_t)k;
    add_side(t, t->last + here, t->last + next, ring + next, radius);
    add_side(t, t->last + here, ring + next, ring + here, radius);
  }
  t->last = ring;
}

// Closes the last ring by a fan around `point`; turned round for the foot of a branch.
static void add_point(tube *t, vt_vec3 point, vt_vec3 normal, double radius, bool foot) {
  uint32_t apex = vt_add_vertex(t->mesh, point, normal, t->colour);
  put_uv(t, apex, 0.5);
  for (int k = 0; k < t->sides; k++) {
    uint32_t here = t->last + (uint32_t)k, next = t->last + (uint32_t)((k + 1) % t->sides);
    if (foot)
      add_side(t, next, here, apex, radius);
    else
      add_side(t, here, next, apex, radius);
  }
}

static double surface_radius(const vt_skeleton_node *node) { // the foot of a trunk spreads into its roots
  return node->radius * (1 + 0.5 * exp(-node->position.z / 0.08));
}

static vt_status add_branch(vt_context *ctx, const vt_skeleton *s, const int *main_child, int start, tube *t) {
  const vt_skeleton_node *nodes = s->nodes;
  int before = nodes[start].parent;
  double radius = surface_radius(&nodes[start]);
  t->sides = count_sides(t->wood, radius);
  t->length = 0, t->girth = VT_PI * radius;
  size_t rings = 1; // one more at the fork, but for the trunk
  for (int n = start; n >= 0; n = main_child[n]) rings++;
  vt_status status = vt_reserve_mesh(ctx, t->mesh, rings * (size_t)t->sides + 2, (rings + 1) * 2 * (size_t)t->sides);
  if (status) return status;
  for (int k = 0; k < t->sides; k++) t->fissures[k] = vt_draw(&t->rng, t->wood->ridge);
  vt_vec3 from = before >= 0 ? nodes[before].position : nodes[start].position, along = {0, 0, 1};
  if (before >= 0) {
    along = vt_normalise(vt_sub(nodes[start].position, from));
    add_ring(t, from, along, radius, 0, true);
    add_point(t, from, vt_scale(along, -1), radius, true);
  }
  for (int n = start, next; n >= 0; n = next) {
    next = main_child[n];
    vt_vec3 ahead = next >= 0 ? nodes[next].position : nodes[n].position;
    vt_vec3 direction = vt_sub(ahead, from);
    if (vt_dot(direction, direction) > 0) along = vt_normalise(direction);
    radius = surface_radius(&nodes[n]) * (next >= 0 ? 1 : 0.6);
    bool first = n == start && before < 0;
    add_ring(t, nodes[n].position, along, radius, vt_length(vt_sub(nodes[n].position, from)), first);
    if (first) add_point(t, nodes[n].position, vt_scale(along, -1), radius, true);
    from = nodes[n].position;
  }
  add_point(t, vt_add(from, vt_scale(along, 2 * radius)), along, radius, false);
  return VT_OK;
}

static vt_vec3 draw_colour(const vt_wood *wood, vt_rng *rng) {
  double light = vt_draw(rng, wood->light), brown = vt_random_unit(rng);
  vt_vec3 bark = wood->bark, browner = wood->browner;
  return vt_scale(vt_v3(bark.x + browner.x * brown, bark.y + browner.y * brown, bark.z + browner.z * brown), light);
}

vt_status vt_add_bark(vt_context *ctx, const vt_habit *habit, const vt_skeleton *s, uint32_t seed, int bark_material,
                      vt_mesh *mesh) {
  vt_status status = VT_OK;
  int *main_child = VT_NEW(ctx, int, (size_t)s->count);
  if (!main_child) return VT_OUT_OF_MEMORY;
  for (int n = 0; n < s->count; n++) main_child[n] = -1;
  for (int n = 1; n < s->count; n++) {
    int *main = &main_child[s->nodes[n].parent];
    if (*main < 0 || s->nodes[n].radius > s->nodes[*main].radius) *main = n;
  }
  vt_rng rng = vt_seed_rng(seed, 2);
  tube t = {.mesh = mesh, .wood = &habit->wood, .bark_material = bark_material};
  t.rng = rng; // before the colour is drawn: the two share numbers, and always have
  t.bark = draw_colour(&habit->wood, &rng);
  for (int n = 0; n < s->count && !status; n++)
    if (n == 0 || main_child[s->nodes[n].parent] != n) status = add_branch(ctx, s, main_child, n, &t);
  mesh->solid_count = mesh->triangle_count;
  vt_free(ctx, main_child);
  return status;
}
