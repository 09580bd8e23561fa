// grow.c - the skeleton of a tree, by space colonisation
// SPDX-License-Identifier: BSD-3-Clause
//
// Runions, Lane, Prusinkiewicz, "Modeling trees with a space colonization algorithm", Eurographics Workshop on Natural
// Phenomena 2007. A cloud of attraction points fills the crown. In every turn each point pulls at its nearest node, if
// that is closer than the influence distance d_i; a node v that is pulled gets a child at v + D n, n the normalised sum
// of the directions to its points; points closer than the kill distance d_k to a node are gone. Radii follow the pipe
// model (section 2.4): r^n = r_1^n + r_2^n where branches meet.
//
// Changes: points stand in clumps near the envelope, since a real crown is lumpy and hollow; "nearest" favours nodes
// that lie lower than the point, so that branches rise from the trunk instead of leaving it at right angles; the trunk
// branches at every fourth node only, so that it carries a few strong boughs and not a brush of thin ones; growth has
// noise, so that branches are not straight. What goes wrong without care: a node between two points on opposite sides
// has n near zero or grows the same child for ever (such a child is refused, and turns without a child end growth).

#include "datasets-synthetic/grow.h"
#include "base/rng.h"

enum { POINT_COUNT = 4200, TURN_LIMIT = 400, NODE_LIMIT = 60000, CHILD_LIMIT = 3, CLUMP_LIMIT = 48, BUD_SPACING = 4 };

static const double step = 0.028, kill_distance = 0.05, influence_distance = 0.42; // D, d_k, d_i, world units

typedef struct habit {      // what a seed decides about the shape of the whole
  double base, top;         // heights of the crown's envelope
  double radius;            // its greatest radius
  double skew, power;       // its profile: (sin(pi h^skew))^power over relative height h
  double wave[3], phase[3]; // its plan: 1 + sum wave cos((k + 1) azimuth + phase)
  double leader;            // how far up the crown the trunk is given, 0..1
  double lean_x, lean_y;    // of the trunk, per unit of height
  double rise;              // preference for lower nodes, 0: none
  double pipe;              // n of the pipe model
  double trunk_radius;      // world units
} habit;

typedef struct attraction {
  vt_vec3 position;
  double cost; // squared distance to the nearest node so far, with the preference for lower ones
  int nearest; // that node; -1: none yet
} attraction;

static habit draw_habit(vt_rng *rng) {
  habit h = {.top = 2};
  h.base = vt_random_between(rng, 0.48, 0.74);
  h.radius = vt_random_between(rng, 0.58, 0.92);
  h.skew = vt_random_between(rng, 0.62, 1.15);
  h.power = vt_random_between(rng, 0.45, 0.8);
  for (int k = 0; k < 3; k++) {
    h.wave[k] = vt_random_between(rng, 0.03, 0.12);
    h.phase[k] = vt_random_between(rng, 0, 2 * VT_PI);
  }
  h.leader = vt_random_between(rng, 0.15, 0.7);
  h.lean_x = vt_random_between(rng, -0.09, 0.09);
  h.lean_y = vt_random_between(rng, -0.09, 0.09);
  h.rise = vt_random_between(rng, 0.35, 0.75);
  h.pipe = vt_random_between(rng, 2.05, 2.3);
  h.trunk_radius = vt_random_between(rng, 0.042, 0.062);
  return h;
}

static double envelope_radius(const habit *h, double z, double azimuth) {
  double relative = (z - h->base) / (h->top - h->base);
  if (relative <= 0 || relative >= 1) return 0;
  double plan = 1;
  for (int k = 0; k < 3; k++) plan += h->wave[k] * cos((k + 1) * azimuth + h->phase[k]);
  return h->radius * plan * pow(sin(VT_PI * pow(relative, h->skew)), h->power);
}

static vt_vec3 random_in_ball(vt_rng *rng) {
  for (;;) {
    vt_vec3 p = {0, 0, 0};
    p.x = vt_random_between(rng, -1, 1);
    p.y = vt_random_between(rng, -1, 1);
    p.z = vt_random_between(rng, -1, 1);
    if (vt_dot(p, p) <= 1) return p;
  }
}

// A point of the envelope's inside, `depth` 0: its axis, 1: its surface.
static vt_vec3 random_in_envelope(vt_rng *rng, const habit *h, double depth) {
  for (;;) { // heights in proportion to the slice's area
    double z = vt_random_between(rng, h->base, h->top), azimuth = vt_random_between(rng, 0, 2 * VT_PI);
    double radius = envelope_radius(h, z, azimuth), keep = radius / (1.5 * h->radius);
    if (vt_random_unit(rng) >= keep * keep) continue;
    return vt_v3(depth * radius * cos(azimuth) + h->lean_x * z, depth * radius * sin(azimuth) + h->lean_y * z, z);
  }
}

static void scatter_points(vt_rng *rng, const habit *h, attraction *points) {
  vt_vec3 centres[CLUMP_LIMIT];
  double radii[CLUMP_LIMIT], volume = 0;
  int clump_count = 26 + (int)(vt_random(rng) % (CLUMP_LIMIT - 26));
  for (int c = 0; c < clump_count; c++) {
    centres[c] = random_in_envelope(rng, h, vt_random_between(rng, 0.55, 0.95));
    radii[c] = vt_random_between(rng, 0.15, 0.29) * h->radius / 0.75;
    volume += radii[c] * radii[c] * radii[c];
  }
  for (int i = 0; i < POINT_COUNT; i++) {
    points[i].cost = INFINITY, points[i].nearest = -1;
    if (vt_random_unit(rng) < 0.22) {
      points[i].position = random_in_envelope(rng, h, sqrt(vt_random_between(rng, 0.05, 0.9)));
      continue;
    }
    double pick = vt_random_unit(rng) * volume;
    int c = 0;
    while (c + 1 < clump_count && pick >= radii[c] * radii[c] * radii[c]) pick -= radii[c] * radii[c] * radii[c], c++;
    points[i].position = vt_add(centres[c], vt_scale(random_in_ball(rng), radii[c]));
    points[i].position.z = fmax(points[i].position.z, h->base);
  }
}

static vt_status add_node(vt_context *ctx, vt_skeleton *s, vt_vec3 position, int parent) {
  if (s->count == s->capacity) {
    int capacity = s->capacity ? 2 * s->capacity : 4096;
    vt_skeleton_node *grown = vt_realloc(ctx, s->nodes, (size_t)capacity, sizeof *grown);
    if (!grown) return VT_OUT_OF_MEMORY;
    s->nodes = grown, s->capacity = capacity;
  }
  s->nodes[s->count++] = (vt_skeleton_node){.position = position, .parent = parent};
  if (parent >= 0) s->nodes[parent].child_count++;
  return VT_OK;
}

static vt_status grow_trunk(vt_context *ctx, vt_rng *rng, const habit *h, vt_skeleton *s) {
  double height = h->base + h->leader * (h->top - h->base) * 0.85;
  vt_vec3 position = {0, 0, 0}, drift = {0, 0, 0};
  vt_status status = add_node(ctx, s, position, -1);
  while (!status && position.z < height) {
    drift = vt_add(vt_scale(drift, 0.94), vt_scale(random_in_ball(rng), 0.07));
    vt_vec3 pull = vt_scale(vt_v3(h->lean_x * position.z - position.x, h->lean_y * position.z - position.y, 0), 1.2);
    vt_vec3 direction = vt_normalise(vt_add(vt_v3(h->lean_x, h->lean_y, 1), vt_add(drift, pull)));
    position = vt_add(position, vt_scale(direction, step));
    status = add_node(ctx, s, position, s->count - 1);
  }
  return status;
}

// Tells the points of the nodes from `first` on; points that one of them reaches are removed. Returns how many are
// left.
static int meet_nodes(const vt_skeleton *s, int first, int trunk_top, double rise, attraction *points, int count) {
  int left = 0;
  for (int i = 0; i < count; i++) {
    attraction point = points[i];
    bool reached = false;
    for (int n = first; n < s->count && !reached; n++) {
      vt_vec3 d = vt_sub(point.position, s->nodes[n].position);
      double flat = d.x * d.x + d.y * d.y, distance = flat + d.z * d.z;
      reached = distance < kill_distance * kill_distance;
      if (distance > influence_distance * influence_distance || (n < trunk_top && n % BUD_SPACING)) continue;
      double up = d.z - rise * sqrt(flat), cost = flat + up * up;
      if (cost < point.cost) point.cost = cost, point.nearest = n;
    }
    if (!reached) points[left++] = point;
  }
  return left;
}

static bool repeats_child(const vt_skeleton *s, int parent, int first_child_possible, vt_vec3 position) {
  for (int n = first_child_possible; n < s->count; n++)
    if (s->nodes[n].parent == parent && vt_length(vt_sub(s->nodes[n].position, position)) < 0.35 * step) return true;
  return false;
}

static vt_status colonise(vt_context *ctx, vt_rng *rng, const habit *h, attraction *points, vt_skeleton *s) {
  vt_vec3 *pull = VT_NEW(ctx, vt_vec3, NODE_LIMIT);
  vt_status status = pull ? VT_OK : VT_OUT_OF_MEMORY;
  int left = POINT_COUNT, first = 0, trunk_top = s->count - 1;
  for (int turn = 0; !status && turn < TURN_LIMIT && left; turn++) {
    if (vt_cancelled(ctx)) status = vt_fail(ctx, VT_CANCELLED, "interrupted: nothing was written; run it again");
    left = meet_nodes(s, first, trunk_top, h->rise, points, left);
    first = s->count;
    for (int n = 0; n < first; n++) pull[n] = vt_v3(0, 0, 0);
    for (int i = 0; i < left; i++) {
      int n = points[i].nearest;
      if (n >= 0) pull[n] = vt_add(pull[n], vt_normalise(vt_sub(points[i].position, s->nodes[n].position)));
    }
    for (int n = 0; n < first && s->count < NODE_LIMIT && !status; n++) {
      if (vt_dot(pull[n], pull[n]) < 1e-6 || s->nodes[n].child_count >= CHILD_LIMIT) continue;
      vt_vec3 direction = vt_add(vt_normalise(pull[n]), vt_scale(random_in_ball(rng), 0.22));
      if (s->nodes[n].parent >= 0) { // wood bends, it does not snap
        vt_vec3 along = vt_normalise(vt_sub(s->nodes[n].position, s->nodes[s->nodes[n].parent].position));
        direction = vt_add(direction, vt_scale(along, 0.35));
      }
      vt_vec3 position = vt_add(s->nodes[n].position, vt_scale(vt_normalise(direction), step));
      if (s->nodes[n].child_count && repeats_child(s, n, n + 1, position)) continue;
      status = add_node(ctx, s, position, n);
    }
    if (s->count == first) break;
  }
  vt_free(ctx, pull);
  return status;
}

// Removes the zigzag of growth from the nodes between forks; forks and tips stay.
static vt_status smooth_branches(vt_context *ctx, vt_skeleton *s) {
  vt_vec3 *smoothed = VT_NEW(ctx, vt_vec3, (size_t)s->count);
  if (!smoothed) return VT_OUT_OF_MEMORY;
  for (int pass = 0; pass < 3; pass++) {
    for (int n = 0; n < s->count; n++) smoothed[n] = s->nodes[n].position;
    for (int n = 1; n < s->count; n++) {
      int parent = s->nodes[n].parent, above = s->nodes[parent].parent;
      if (s->nodes[parent].child_count != 1 || above < 0) continue;
      vt_vec3 ends = vt_scale(vt_add(s->nodes[n].position, s->nodes[above].position), 0.25);
      smoothed[parent] = vt_add(vt_scale(s->nodes[parent].position, 0.5), ends);
    }
    for (int n = 0; n < s->count; n++) s->nodes[n].position = smoothed[n];
  }
  vt_free(ctx, smoothed);
  return VT_OK;
}

static void set_radii(const habit *h, vt_skeleton *s) {
  const double stretch = 1.006; // unbranched wood tapers a little too
  for (int n = 0; n < s->count; n++) s->nodes[n].radius = s->nodes[n].child_count ? 0 : 1;
  for (int n = s->count - 1; n > 0; n--) { // r^n in .radius
    s->nodes[s->nodes[n].parent].radius += s->nodes[n].radius * stretch;
  }
  double root = pow(s->nodes[0].radius, 1 / h->pipe);
  s->tip_radius = fmax(h->trunk_radius / root, 0.0016);
  for (int n = 0; n < s->count; n++) s->nodes[n].radius = s->tip_radius * pow(s->nodes[n].radius, 1 / h->pipe);
}

vt_status vt_grow_skeleton(vt_context *ctx, uint32_t seed, vt_skeleton *out) {
  *out = (vt_skeleton){0};
  vt_rng rng = vt_seed_rng(seed, 1);
  habit h = draw_habit(&rng);
  attraction *points = VT_NEW(ctx, attraction, POINT_COUNT);
  vt_status status = points ? VT_OK : VT_OUT_OF_MEMORY;
  if (status) goto done;
  scatter_points(&rng, &h, points);
  status = grow_trunk(ctx, &rng, &h, out);
  if (!status) status = colonise(ctx, &rng, &h, points, out);
  if (!status) status = smooth_branches(ctx, out);
  if (!status) set_radii(&h, out);
done:
  vt_free(ctx, points);
  if (status) vt_free_skeleton(ctx, out);
  return status;
}

void vt_free_skeleton(vt_context *ctx, vt_skeleton *s) {
  vt_free(ctx, s->nodes);
  *s = (vt_skeleton){0};
}
