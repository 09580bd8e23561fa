// leaves.c - small cut-out shapes on the twigs
// SPDX-License-Identifier: BSD-3-Clause
//
// Leaves are spread evenly over the length of the twigs, with more at their ends, each turned by the golden angle from
// the last one (phyllotaxis). A leaf points along its twig and outwards, sags a little, and turns its upper side to the
// sky (planophile, as broad leaves mostly are). It is a fan of triangles over half an outline and its mirror image,
// folded along the midrib and bent down towards the tip. Their total area is given by the crown, not by their number:
// fewer leaves are larger ones.

#include "datasets-synthetic/leaves.h"
#include "base/rng.h"

enum { OUTLINE_LIMIT = 12 };

typedef struct leaf_shape { // in units of the leaf's length; x along the midrib, y across
  double centre;            // x of the fan's hub: sees the whole outline
  int count;
  double outline[OUTLINE_LIMIT][2]; // the half with y >= 0, from the stalk to the tip, both on the midrib
} leaf_shape;

// In the manner of beech, lime, maple and oak.
static const leaf_shape shapes[] = {
    {.45, 8, {{0, 0}, {.07, .1}, {.2, .21}, {.38, .275}, {.58, .26}, {.76, .175}, {.88, .07}, {1, 0}}},
    {.4, 8, {{.04, 0}, {0, .16}, {.12, .31}, {.3, .36}, {.5, .3}, {.7, .18}, {.86, .065}, {1, 0}}},
    {.45, 8, {{.2, 0}, {.08, .2}, {.27, .24}, {.3, .5}, {.5, .24}, {.66, .36}, {.7, .16}, {1, 0}}},
    {.5, 9, {{0, 0}, {.15, .06}, {.22, .17}, {.33, .11}, {.42, .25}, {.53, .15}, {.64, .28}, {.74, .15}, {1, 0}}},
};

typedef struct foliage { // what a seed decides about all leaves
  const leaf_shape *shape;
  double length;   // world, mean
  vt_vec3 colour;  // linear light
  double patch[9]; // three slow waves of colour through the crown
  double uprightness;
} foliage;

static double shape_area(const leaf_shape *shape) { // of the whole leaf of length 1 (shoelace, both halves)
  double twice = 0;
  for (int k = 0; k + 1 < shape->count; k++) {
    const double *a = shape->outline[k], *b = shape->outline[k + 1];
    twice += fabs((a[0] - shape->centre) * b[1] - (b[0] - shape->centre) * a[1]);
  }
  return twice;
}

static foliage draw_foliage(uint32_t seed, int leaf_count, vt_rng *rng) {
  static const vt_vec3 colours[] = {{.068, .155, .030}, {.098, .185, .032}, {.045, .112, .030}, {.072, .132, .052},
                                    {.060, .150, .024}, {.250, .140, .022}}; // five greens and an October
  foliage f = {.shape = &shapes[seed % (sizeof shapes / sizeof *shapes)]};
  uint32_t pick = vt_random(rng) % 11;
  f.colour = colours[pick == 10 ? 5 : pick % 5];
  double area = vt_random_between(rng, 6.5, 8.5); // square units of leaf in the crown
  f.length = sqrt(area / (leaf_count * shape_area(f.shape)));
  f.length = fmin(fmax(f.length, 0.004), 0.16);
  for (int k = 0; k < 9; k++) f.patch[k] = vt_random_between(rng, k % 3 ? -4 : -5, k % 3 ? 4 : 5);
  f.uprightness = vt_random_between(rng, 0.6, 1.1);
  return f;
}

static vt_vec3 leaf_colour(const foliage *f, vt_vec3 at, vt_rng *rng) {
  double slow = 0;
  for (int k = 0; k < 3; k++)
    slow += sin(f->patch[3 * k] * at.x + f->patch[3 * k + 1] * at.y + f->patch[3 * k + 2] * at.z);
  double light = exp(vt_random_between(rng, -0.32, 0.3) + 0.07 * slow);
  double yellow = vt_random_between(rng, -0.14, 0.2) + 0.06 * slow;
  if (vt_random_unit(rng) < 0.02) yellow += 0.7, light *= 1.15; // a few turn early
  return vt_scale(vt_v3(f->colour.x * (1 + yellow), f->colour.y * (1 + 0.15 * yellow), f->colour.z), light);
}

typedef struct leaf_frame {
  vt_vec3 origin, along, across, up;
  double length;             // world
  double fold, droop, stalk; // in units of the length
} leaf_frame;

// A point of the leaf and its normal: height over the leaf's plane is fold (sqrt(y^2 + e^2) - e) - droop x^2.
static uint32_t add_leaf_vertex(vt_mesh *mesh, const leaf_frame *l, double x, double y, vt_vec3 colour) {
  const double soft = 0.06;
  double root = sqrt(y * y + soft * soft), height = l->fold * (root - soft) - l->droop * x * x;
  double slope_x = -2 * l->droop * x, slope_y = l->fold * y / root;
  vt_vec3 local = vt_add(vt_scale(l->along, x), vt_add(vt_scale(l->across, y), vt_scale(l->up, height)));
  vt_vec3 normal = vt_sub(l->up, vt_add(vt_scale(l->along, slope_x), vt_scale(l->across, slope_y)));
  return vt_add_vertex(mesh, vt_add(l->origin, vt_scale(local, l->length)), vt_normalise(normal), colour);
}

static void add_leaf(vt_mesh *mesh, const leaf_shape *shape, const leaf_frame *l, vt_vec3 colour) {
  vt_vec3 edge = vt_scale(colour, 0.92), rib = vt_scale(colour, 1.18);
  uint32_t hub = add_leaf_vertex(mesh, l, shape->centre, 0, rib), ring = hub + 1;
  uint32_t count = (uint32_t)(2 * (shape->count - 1));
  for (int k = 0; k < shape->count; k++) add_leaf_vertex(mesh, l, shape->outline[k][0], shape->outline[k][1], edge);
  for (int k = shape->count - 2; k > 0; k--)
    add_leaf_vertex(mesh, l, shape->outline[k][0], -shape->outline[k][1], edge);
  // The outline runs from the stalk over +y to the tip: clockwise seen from above.
  for (uint32_t k = 0; k < count; k++) vt_add_triangle(mesh, hub, ring + (k + 1) % count, ring + k);
  uint32_t stalk = add_leaf_vertex(mesh, l, -l->stalk, 0, rib);
  uint32_t left = add_leaf_vertex(mesh, l, shape->outline[0][0] + .1, .016, rib);
  uint32_t right = add_leaf_vertex(mesh, l, shape->outline[0][0] + .1, -.016, rib);
  vt_add_triangle(mesh, stalk, right, left);
}

static vt_vec3 random_direction(vt_rng *rng) {
  double z = vt_random_between(rng, -1, 1), angle = vt_random_between(rng, 0, 2 * VT_PI), r = sqrt(1 - z * z);
  return vt_v3(r * cos(angle), r * sin(angle), z);
}

// A frame on the twig from `from` to `to`, a share of the way up, turned round the twig by `azimuth`.
static leaf_frame place_leaf(const foliage *f, vt_vec3 from, vt_vec3 to, double share, double azimuth, vt_rng *rng) {
  vt_vec3 twig = vt_normalise(vt_sub(to, from)), helper = fabs(twig.z) < 0.8 ? vt_v3(0, 0, 1) : vt_v3(1, 0, 0);
  vt_vec3 u = vt_normalise(vt_cross(twig, helper)), v = vt_cross(twig, u);
  vt_vec3 outwards = vt_add(vt_scale(u, cos(azimuth)), vt_scale(v, sin(azimuth)));
  leaf_frame l = {.length = f->length * vt_random_between(rng, 0.72, 1.22)};
  l.stalk = fmax(0.4, vt_random_between(rng, 0.005, 0.03) / l.length); // small leaves stand off the twig too
  l.fold = vt_random_between(rng, 0.1, 0.6), l.droop = vt_random_between(rng, 0.03, 0.34);
  vt_vec3 along = vt_add(vt_add(vt_scale(outwards, 0.85), vt_scale(twig, 0.5)), vt_scale(random_direction(rng), 0.35));
  along.z -= 0.22;
  l.along = vt_normalise(along);
  vt_vec3 side = vt_normalise(vt_v3(from.x, from.y, 0)); // out of the crown
  vt_vec3 up = vt_add(vt_v3(0, 0, f->uprightness), vt_add(vt_scale(side, 0.4), vt_scale(random_direction(rng), 0.65)));
  l.across = vt_normalise(vt_cross(up, l.along));
  l.up = vt_cross(l.along, l.across);
  vt_vec3 foot = vt_add(from, vt_scale(vt_sub(to, from), share));
  l.origin = vt_add(foot, vt_scale(l.along, l.stalk * l.length));
  return l;
}

// Length of leafy twig that ends in each node, summed: where the k-th of evenly spread leaves goes.
static double sum_twigs(const vt_skeleton *s, double *sums) {
  double total = 0;
  for (int n = 0; n < s->count; n++) {
    const vt_skeleton_node *node = &s->nodes[n];
    if (node->parent >= 0 && node->radius < 4 * s->tip_radius) {
      double length = vt_length(vt_sub(node->position, s->nodes[node->parent].position));
      total += length * (node->child_count ? 1 : 2.6);
    }
    sums[n] = total;
  }
  return total;
}

vt_status vt_add_leaves(vt_context *ctx, const vt_skeleton *s, uint32_t seed, int leaf_count, vt_mesh *mesh) {
  if (leaf_count <= 0) return VT_OK;
  vt_rng rng = vt_seed_rng(seed, 3);
  foliage f = draw_foliage(seed, leaf_count, &rng);
  double *sums = VT_NEW(ctx, double, (size_t)s->count);
  vt_status status = sums ? VT_OK : VT_OUT_OF_MEMORY;
  if (status) goto done;
  double total = sum_twigs(s, sums);
  size_t rim = (size_t)(2 * (f.shape->count - 1)), leaves = (size_t)leaf_count;
  status = vt_reserve_mesh(ctx, mesh, leaves * (rim + 4), leaves * (rim + 1));
  if (status || !(total > 0)) goto done;
  for (int k = 0, n = 0; k < leaf_count; k++) {
    double target = total * (k + vt_random_unit(&rng)) / leaf_count;
    while (n + 1 < s->count && sums[n] <= target) n++;
    if (s->nodes[n].parent < 0) continue;
    double share = vt_random_unit(&rng), azimuth = k * VT_PI * (3 - sqrt(5)) + vt_random_between(&rng, -0.5, 0.5);
    vt_vec3 to = s->nodes[n].position, from = s->nodes[s->nodes[n].parent].position;
    leaf_frame l = place_leaf(&f, from, to, share, azimuth, &rng);
    add_leaf(mesh, f.shape, &l, leaf_colour(&f, l.origin, &rng));
  }
done:
  vt_free(ctx, sums);
  return status;
}
