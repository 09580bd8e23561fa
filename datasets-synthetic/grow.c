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
//
// Nearness is searched in a grid of the nodes that the last turn made. A node at flat distance f and height difference h
// costs f^2 + (h - rise f)^2, so it betters a point's cost c only within c (1 + (1 + rise)^2) of squared distance: the
// search shrinks as the crown fills, and finds the same node as a comparison with all.

#include "datasets-synthetic/grow.h"
#include "datasets-synthetic/hang.h"
#include "datasets-synthetic/whorls.h"

enum { TURN_LIMIT = 400, NODE_LIMIT = 60000, CHILD_LIMIT = 3, CLUMP_LIMIT = 96, GRID_AXIS = 16 };

static const double grid_edge = 0.2, grid_corner[3] = {-1.6, -1.6, -0.4}; // world units

typedef struct envelope {   // what a seed decides about the shape of the whole
  const vt_crown *crown;
  double base, top;         // heights of the crown's envelope
  double radius;            // its greatest radius
  double skew, power;       // its profile: (sin(pi h^skew))^power over relative height h
  double wave[3], phase[3]; // its plan: 1 + sum wave cos((k + 1) azimuth + phase)
  double leader;            // how far up the crown the trunk is given, 0..1
  double lean_x, lean_y;    // of the trunk, per unit of height
  double rise;              // preference for lower nodes, 0: none
  double pipe;              // n of the pipe model
  double trunk_radius;      // world units
} envelope;

typedef struct attraction {
  vt_vec3 position;
  double cost; // squared distance to the nearest node so far, with the preference for lower ones
  int nearest; // that node; -1: none yet
} attraction;

static envelope draw_envelope(const vt_habit *habit, vt_rng *rng) {
  const vt_crown *c = &habit->crown;
  envelope e = {.crown = c, .top = 2};
  e.base = vt_draw(rng, c->base);
  e.radius = vt_draw(rng, c->radius);
  e.skew = vt_draw(rng, c->skew);
  e.power = vt_draw(rng, c->power);
  for (int k = 0; k < 3; k++) {
    e.wave[k] = vt_random_between(rng, 0.03, 0.12);
    e.phase[k] = vt_random_between(rng, 0, 2 * VT_PI);
  }
  e.leader = vt_draw(rng, c->leader);
  e.lean_x = vt_random_between(rng, -c->lean, c->lean);
  e.lean_y = vt_random_between(rng, -c->lean, c->lean);
  e.rise = vt_draw(rng, c->rise);
  e.pipe = vt_draw(rng, habit->wood.pipe);
  e.trunk_radius = vt_draw(rng, habit->wood.trunk_radius);
  return e;
}

static double envelope_radius(const envelope *h, double z, double azimuth) {
  double relative = (z - h->base) / (h->top - h->base);
  if (relative <= 0 || relative >= 1) return 0;
  double plan = 1;
  for (int k = 0; k < 3; k++) plan += h->wave[k] * cos((k + 1) * azimuth + h->phase[k]);
  return h->radius * plan * pow(sin(VT_PI * pow(relative, h->skew)), h->power);
}

vt_vec3 vt_random_in_ball(vt_rng *rng) {
  for (;;) {
    vt_vec3 p = {0, 0, 0};
    p.x = vt_random_between(rng, -1, 1);
    p.y = vt_random_between(rng, -1, 1);
    p.z = vt_random_between(rng, -1, 1);
    if (vt_dot(p, p) <= 1) return p;
  }
}

// A point of the envelope's inside, `depth` 0: its axis, 1: its surface.
static vt_vec3 random_in_envelope(vt_rng *rng, const envelope *h, double depth) {
  for (;;) { // heights in proportion to the slice's area
    double z = vt_random_between(rng, h->base, h->top), azimuth = vt_random_between(rng, 0, 2 * VT_PI);
    double radius = envelope_radius(h, z, azimuth), keep = radius / (1.5 * h->radius);
    if (vt_random_unit(rng) >= keep * keep) continue;
    return vt_v3(depth * radius * cos(azimuth) + h->lean_x * z, depth * radius * sin(azimuth) + h->lean_y * z, z);
  }
}

static void scatter_points(vt_rng *rng, const envelope *h, attraction *points) {
  vt_vec3 centres[CLUMP_LIMIT];
  double radii[CLUMP_LIMIT], volume = 0;
  const vt_crown *crown = h->crown;
  int clump_count = crown->clump_low + (int)(vt_random(rng) % (uint32_t)crown->clump_range);
  VT_ASSERT(clump_count <= CLUMP_LIMIT);
  for (int c = 0; c < clump_count; c++) {
    centres[c] = random_in_envelope(rng, h, vt_random_between(rng, 0.55, 0.95));
    radii[c] = vt_draw(rng, crown->clump_radius) * h->radius / 0.75;
    volume += radii[c] * radii[c] * radii[c];
  }
  for (int i = 0; i < crown->point_count; i++) {
    points[i].cost = INFINITY, points[i].nearest = -1;
    if (vt_random_unit(rng) < crown->stray_share) {
      points[i].position = random_in_envelope(rng, h, sqrt(vt_random_between(rng, 0.05, 0.9)));
      continue;
    }
    double pick = vt_random_unit(rng) * volume;
    int c = 0;
    while (c + 1 < clump_count && pick >= radii[c] * radii[c] * radii[c]) pick -= radii[c] * radii[c] * radii[c], c++;
    points[i].position = vt_add(centres[c], vt_scale(vt_random_in_ball(rng), radii[c]));
    points[i].position.z = fmax(points[i].position.z, h->base);
  }
}

vt_status vt_add_node(vt_context *ctx, vt_skeleton *s, vt_vec3 position, int parent) {
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

static vt_status grow_trunk(vt_context *ctx, vt_rng *rng, const envelope *h, vt_skeleton *s) {
  double height = h->base + h->leader * (h->top - h->base) * 0.85;
  vt_vec3 position = {0, 0, 0}, drift = {0, 0, 0};
  vt_status status = vt_add_node(ctx, s, position, -1);
  while (!status && position.z < height) {
    drift = vt_add(vt_scale(drift, 0.94), vt_scale(vt_random_in_ball(rng), 0.07));
    vt_vec3 pull = vt_scale(vt_v3(h->lean_x * position.z - position.x, h->lean_y * position.z - position.y, 0), 1.2);
    vt_vec3 direction = vt_normalise(vt_add(vt_v3(h->lean_x, h->lean_y, 1), vt_add(drift, pull)));
    position = vt_add(position, vt_scale(direction, h->crown->step));
    status = vt_add_node(ctx, s, position, s->count - 1);
  }
  return status;
}

// The nodes from `first` on, by cell: those of cell c are items[start[c]] .. items[start[c + 1] - 1], in rising order.
typedef struct node_grid {
  int *start; // [GRID_AXIS^3 + 1]
  int *items; // [NODE_LIMIT]
} node_grid;

static int grid_cell(double at, int axis) {
  double cell = floor((at - grid_corner[axis]) / grid_edge);
  return cell < 0 ? 0 : cell > GRID_AXIS - 1 ? GRID_AXIS - 1 : (int)cell;
}

static int cell_of(vt_vec3 p) {
  return (grid_cell(p.z, 2) * GRID_AXIS + grid_cell(p.y, 1)) * GRID_AXIS + grid_cell(p.x, 0);
}

static void fill_grid(const vt_skeleton *s, int first, node_grid *grid) {
  const int cells = GRID_AXIS * GRID_AXIS * GRID_AXIS;
  for (int c = 0; c <= cells; c++) grid->start[c] = 0;
  for (int n = first; n < s->count; n++) grid->start[cell_of(s->nodes[n].position) + 1]++;
  for (int c = 0; c < cells; c++) grid->start[c + 1] += grid->start[c];
  for (int n = s->count - 1; n >= first; n--) { // each start is moved to the end of its cell and back
    int c = cell_of(s->nodes[n].position);
    grid->items[--grid->start[c + 1]] = n;
  }
  for (int c = 0; c < cells; c++) grid->start[c] = grid->start[c + 1];
  grid->start[cells] = s->count - first;
}

// Compares the point with the nodes of one cell; true if one of them reaches it. Of equally near ones the first counts.
static bool meet_cell(const vt_skeleton *s, const node_grid *grid, int cell, int trunk_top, const envelope *h,
                      attraction *point) {
  const vt_crown *crown = h->crown;
  bool reached = false;
  for (int i = grid->start[cell]; i < grid->start[cell + 1] && !reached; i++) {
    int n = grid->items[i];
    vt_vec3 d = vt_sub(point->position, s->nodes[n].position);
    double flat = d.x * d.x + d.y * d.y, distance = flat + d.z * d.z;
    reached = distance < crown->kill * crown->kill;
    if (distance > crown->influence * crown->influence || (n < trunk_top && n % crown->bud_spacing)) continue;
    double up = d.z - h->rise * sqrt(flat), cost = flat + up * up;
    if (cost < point->cost || (cost == point->cost && n < point->nearest)) point->cost = cost, point->nearest = n;
  }
  return reached;
}

// Tells the points of the nodes in the grid; points that one of them reaches are removed. Returns how many are left.
static int meet_nodes(const vt_skeleton *s, const node_grid *grid, int trunk_top, const envelope *h, attraction *points,
                      int count) {
  const vt_crown *crown = h->crown;
  double stretch = sqrt(1 + (1 + h->rise) * (1 + h->rise));
  int left = 0;
  for (int i = 0; i < count; i++) {
    attraction point = points[i];
    double reach = fmax(crown->kill, fmin(crown->influence, sqrt(point.cost) * stretch)) * 1.0001;
    vt_vec3 p = point.position;
    int x0 = grid_cell(p.x - reach, 0), x1 = grid_cell(p.x + reach, 0), y0 = grid_cell(p.y - reach, 1),
        y1 = grid_cell(p.y + reach, 1), z0 = grid_cell(p.z - reach, 2), z1 = grid_cell(p.z + reach, 2);
    bool reached = false;
    for (int z = z0; z <= z1 && !reached; z++)
      for (int y = y0; y <= y1 && !reached; y++)
        for (int x = x0; x <= x1 && !reached; x++)
          reached = meet_cell(s, grid, (z * GRID_AXIS + y) * GRID_AXIS + x, trunk_top, h, &point);
    if (!reached) points[left++] = point;
  }
  return left;
}

typedef struct siblings { // children of the nodes as lists
  int *newest; // [NODE_LIMIT]; the node's last child, 0: none
  int *older;  // [NODE_LIMIT]; the node's elder sibling, 0: none
} siblings;

static bool repeats_child(const vt_skeleton *s, const siblings *kin, int parent, vt_vec3 position, double step) {
  for (int n = kin->newest[parent]; n; n = kin->older[n])
    if (vt_length(vt_sub(s->nodes[n].position, position)) < 0.35 * step) return true;
  return false;
}

static vt_status grow_child(vt_context *ctx, vt_rng *rng, const vt_crown *crown, int n, vt_vec3 pull, siblings *kin,
                            vt_skeleton *s) {
  vt_vec3 direction = vt_add(vt_normalise(pull), vt_scale(vt_random_in_ball(rng), crown->wander));
  if (s->nodes[n].parent >= 0) { // wood bends, it does not snap
    vt_vec3 along = vt_normalise(vt_sub(s->nodes[n].position, s->nodes[s->nodes[n].parent].position));
    direction = vt_add(direction, vt_scale(along, crown->keep));
  }
  vt_vec3 position = vt_add(s->nodes[n].position, vt_scale(vt_normalise(direction), crown->step));
  if (s->nodes[n].child_count && repeats_child(s, kin, n, position, crown->step)) return VT_OK;
  vt_status status = vt_add_node(ctx, s, position, n);
  if (status) return status;
  int child = s->count - 1;
  kin->older[child] = kin->newest[n], kin->newest[n] = child;
  return VT_OK;
}

typedef struct growth { // scratch of colonise
  vt_vec3 *pull; // [NODE_LIMIT]
  siblings kin;
  node_grid grid;
} growth;

static vt_status colonise(vt_context *ctx, vt_rng *rng, const envelope *h, attraction *points, growth *g, vt_skeleton *s) {
  vt_status status = VT_OK;
  int left = h->crown->point_count, first = 0, trunk_top = s->count - 1;
  for (int n = 1; n < s->count; n++) g->kin.newest[n - 1] = n; // the trunk
  for (int turn = 0; !status && turn < TURN_LIMIT && left; turn++) {
    if (vt_cancelled(ctx)) status = vt_fail(ctx, VT_CANCELLED, "interrupted: nothing was written; run it again");
    fill_grid(s, first, &g->grid);
    left = meet_nodes(s, &g->grid, trunk_top, h, points, left);
    first = s->count;
    for (int n = 0; n < first; n++) g->pull[n] = vt_v3(0, 0, 0);
    for (int i = 0; i < left; i++) {
      int n = points[i].nearest;
      if (n >= 0) g->pull[n] = vt_add(g->pull[n], vt_normalise(vt_sub(points[i].position, s->nodes[n].position)));
    }
    for (int n = 0; n < first && s->count < NODE_LIMIT && !status; n++)
      if (vt_dot(g->pull[n], g->pull[n]) >= 1e-6 && s->nodes[n].child_count < CHILD_LIMIT)
        status = grow_child(ctx, rng, h->crown, n, g->pull[n], &g->kin, s);
    if (s->count == first) break;
  }
  return status;
}

static vt_status grow_crown(vt_context *ctx, vt_rng *rng, const envelope *h, vt_skeleton *out) {
  growth g = {0};
  attraction *points = VT_NEW(ctx, attraction, (size_t)h->crown->point_count);
  g.pull = VT_NEW(ctx, vt_vec3, NODE_LIMIT);
  g.kin.newest = VT_NEW(ctx, int, NODE_LIMIT);
  g.kin.older = VT_NEW(ctx, int, NODE_LIMIT);
  g.grid.start = VT_NEW(ctx, int, GRID_AXIS *GRID_AXIS *GRID_AXIS + 1);
  g.grid.items = VT_NEW(ctx, int, NODE_LIMIT);
  vt_status status = VT_OUT_OF_MEMORY;
  if (!points || !g.pull || !g.kin.newest || !g.kin.older || !g.grid.start || !g.grid.items) goto done;
  scatter_points(rng, h, points);
  status = grow_trunk(ctx, rng, h, out);
  if (!status) status = colonise(ctx, rng, h, points, &g, out);
done:
  vt_free(ctx, points);
  vt_free(ctx, g.pull);
  vt_free(ctx, g.kin.newest);
  vt_free(ctx, g.kin.older);
  vt_free(ctx, g.grid.start);
  vt_free(ctx, g.grid.items);
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

static void set_radii(const envelope *h, double tip_floor, vt_skeleton *s) {
  const double stretch = 1.006; // unbranched wood tapers a little too
  for (int n = 0; n < s->count; n++) s->nodes[n].radius = s->nodes[n].child_count ? 0 : 1;
  for (int n = s->count - 1; n > 0; n--) { // r^n in .radius
    s->nodes[s->nodes[n].parent].radius += s->nodes[n].radius * stretch;
  }
  double root = pow(s->nodes[0].radius, 1 / h->pipe);
  s->tip_radius = fmax(h->trunk_radius / root, tip_floor);
  for (int n = 0; n < s->count; n++) s->nodes[n].radius = s->tip_radius * pow(s->nodes[n].radius, 1 / h->pipe);
}

vt_status vt_grow_skeleton(vt_context *ctx, const vt_habit *habit, uint32_t seed, vt_skeleton *out) {
  *out = (vt_skeleton){0};
  vt_rng rng = vt_seed_rng(seed, 1);
  envelope h = draw_envelope(habit, &rng);
  vt_status status = habit->whorls.years_low ? vt_grow_whorls(ctx, &habit->whorls, &rng, out)
                                             : grow_crown(ctx, &rng, &h, out);
  if (!status) status = smooth_branches(ctx, out);
  if (!status) set_radii(&h, habit->wood.tip_floor, out);
  if (!status && habit->hanging.count) {
    status = vt_hang_twigs(ctx, &habit->hanging, &rng, out);
    if (!status) set_radii(&h, habit->wood.tip_floor, out);
  }
  if (status) vt_free_skeleton(ctx, out);
  return status;
}

void vt_free_skeleton(vt_context *ctx, vt_skeleton *s) {
  vt_free(ctx, s->nodes);
  *s = (vt_skeleton){0};
}
