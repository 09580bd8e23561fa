// leaves.c - foliage on the twigs
// SPDX-License-Identifier: BSD-3-Clause
//
// Leaves are spread evenly over the length of the twigs, with more at their ends, each turned by the golden angle from
// the last one (phyllotaxis). A leaf points along its twig and outwards, sags a little, and turns its upper side to the
// sky (planophile, as broad leaves mostly are); leaves of hanging twigs hang. Their total area is given by the crown, not
// by their number: fewer leaves are larger ones. Clusters of needles are placed by the same rules.

#include "datasets-synthetic/leaves.h"
#include "datasets-synthetic/leaf_shapes.h"

typedef struct foliage { // what a seed decides about all leaves
  const vt_foliage *kind;
  vt_leaf_form form;
  double length;   // world, mean
  vt_vec3 colour;  // linear light
  double patch[9]; // three slow waves of colour through the crown
  double uprightness;
} foliage;

vt_leaf_form vt_form_of_seed(const vt_foliage *kind, uint32_t seed) {
  return (vt_leaf_form)((uint32_t)kind->form + seed % (uint32_t)kind->form_count);
}

static foliage draw_foliage(const vt_foliage *kind, uint32_t seed, int leaf_count, vt_rng *rng) {
  foliage f = {.kind = kind, .form = vt_form_of_seed(kind, seed)};
  uint32_t pick = vt_random(rng) % 11;
  f.colour = pick == 10 && kind->autumn.x > 0 ? kind->autumn : kind->greens[pick % (uint32_t)kind->green_count];
  double area = vt_draw(rng, kind->area);
  f.length = sqrt(area / (leaf_count * vt_leaf_area(f.form)));
  f.length = fmin(fmax(f.length, kind->length.low), kind->length.high);
  for (int k = 0; k < 9; k++) f.patch[k] = vt_random_between(rng, k % 3 ? -4 : -5, k % 3 ? 4 : 5);
  f.uprightness = vt_draw(rng, kind->uprightness);
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

static vt_vec3 random_direction(vt_rng *rng) {
  double z = vt_random_between(rng, -1, 1), angle = vt_random_between(rng, 0, 2 * VT_PI), r = sqrt(1 - z * z);
  return vt_v3(r * cos(angle), r * sin(angle), z);
}

// A frame on the twig from `from` to `to`, a share of the way up, turned round the twig by `azimuth`.
static vt_leaf_frame place_leaf(const foliage *f, vt_vec3 from, vt_vec3 to, double share, double azimuth, vt_rng *rng) {
  vt_vec3 twig = vt_normalise(vt_sub(to, from)), helper = fabs(twig.z) < 0.8 ? vt_v3(0, 0, 1) : vt_v3(1, 0, 0);
  vt_vec3 u = vt_normalise(vt_cross(twig, helper)), v = vt_cross(twig, u);
  vt_vec3 outwards = vt_add(vt_scale(u, cos(azimuth)), vt_scale(v, sin(azimuth)));
  vt_leaf_frame l = {.length = f->length * vt_random_between(rng, 0.72, 1.22)};
  l.stalk = fmax(f->kind->least_stalk, vt_draw(rng, f->kind->stand_off) / l.length); // small leaves stand off too
  l.fold = vt_draw(rng, f->kind->fold), l.droop = vt_draw(rng, f->kind->droop);
  vt_vec3 along = vt_add(vt_scale(outwards, f->kind->outward), vt_scale(twig, f->kind->forward));
  along = vt_add(along, vt_scale(random_direction(rng), f->kind->scatter));
  along.z -= f->kind->sag;
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
static double sum_twigs(const vt_skeleton *s, const vt_foliage *kind, double *sums) {
  double total = 0;
  for (int n = 0; n < s->count; n++) {
    const vt_skeleton_node *node = &s->nodes[n];
    if (node->parent >= 0 && node->radius < kind->leafy * s->tip_radius) {
      double length = vt_length(vt_sub(node->position, s->nodes[node->parent].position));
      total += length * (node->child_count ? 1 : kind->tip_weight);
    }
    sums[n] = total;
  }
  return total;
}

vt_status vt_add_leaves(vt_context *ctx, const vt_foliage *kind, const vt_skeleton *s, uint32_t seed, int leaf_count,
                        int material, vt_mesh *mesh) {
  if (leaf_count <= 0) return VT_OK;
  vt_rng rng = vt_seed_rng(seed, 3);
  foliage f = draw_foliage(kind, seed, leaf_count, &rng);
  size_t vertices, triangles, leaves = (size_t)leaf_count, first = mesh->triangle_count;
  vt_count_leaf(f.form, kind->stalked, &vertices, &triangles);
  double *sums = VT_NEW(ctx, double, (size_t)s->count);
  vt_status status = sums ? vt_reserve_mesh(ctx, mesh, leaves * vertices, leaves * triangles) : VT_OUT_OF_MEMORY;
  double total = status ? 0 : sum_twigs(s, kind, sums);
  for (int k = 0, n = 0; k < leaf_count && total > 0; k++) {
    double target = total * (k + vt_random_unit(&rng)) / leaf_count;
    while (n + 1 < s->count && sums[n] <= target) n++;
    if (s->nodes[n].parent < 0) continue;
    double share = vt_random_unit(&rng), azimuth = k * VT_PI * (3 - sqrt(5)) + vt_random_between(&rng, -0.5, 0.5);
    vt_vec3 to = s->nodes[n].position, from = s->nodes[s->nodes[n].parent].position;
    vt_leaf_frame l = place_leaf(&f, from, to, share, azimuth, &rng);
    vt_vec3 colour = leaf_colour(&f, l.origin, &rng);
    if (f.form == VT_LEAF_NEEDLES)
      vt_add_needles(mesh, &l, colour, &rng);
    else
      vt_add_leaf(mesh, vt_shape_of(f.form), &l, kind->stalked, colour);
  }
  for (size_t t = first; t < mesh->triangle_count; t++) mesh->triangle_materials[t] = (uint16_t)material;
  vt_free(ctx, sums);
  return status;
}
