// leaf_shapes.c - outlines of leaves, and one leaf or cluster of needles as triangles
// SPDX-License-Identifier: BSD-3-Clause
//
// A broad leaf is a fan of triangles over half an outline and its mirror image, folded along the midrib and bent down
// towards the tip. The outline is geometry, so coverage is exact; veins and mottling are left to a texture.
//
// A cluster of needles is a brush: needles leave its foot in directions that spread evenly over a cap of the sphere (the
// golden angle again), each a thin kite of two triangles. Shading normals lean towards the brush's axis: with those of
// the blades alone every needle flickers by itself, while a real one is round and takes light as the brush does.

#include "datasets-synthetic/leaf_shapes.h"

// In the manner of beech, lime, maple, slender oak, pedunculate oak, silver birch and white willow.
static const vt_leaf_shape shapes[] = {
    {.45, 8, {{0, 0}, {.07, .1}, {.2, .21}, {.38, .275}, {.58, .26}, {.76, .175}, {.88, .07}, {1, 0}}, .8, 7},
    {.4, 8, {{.04, 0}, {0, .16}, {.12, .31}, {.3, .36}, {.5, .3}, {.7, .18}, {.86, .065}, {1, 0}}, .7, 6},
    {.45, 8, {{.2, 0}, {.08, .2}, {.27, .24}, {.3, .5}, {.5, .24}, {.66, .36}, {.7, .16}, {1, 0}}, .6, 4},
    {.5, 9, {{0, 0}, {.15, .06}, {.22, .17}, {.33, .11}, {.42, .25}, {.53, .15}, {.64, .28}, {.74, .15}, {1, 0}}, .6, 6},
    {.5, 8, {{0, 0}, {.22, .15}, {.36, .1}, {.5, .26}, {.6, .13}, {.76, .29}, {.94, .13}, {1, 0}}, .7, 6},
    {.35, 10, {{0, 0}, {.03, .14}, {.14, .35}, {.22, .32}, {.3, .35}, {.4, .26}, {.5, .265}, {.62, .16}, {.72, .155}, {1, 0}},
     .7, 7},
    {.45, 6, {{0, 0}, {.14, .045}, {.36, .072}, {.6, .064}, {.84, .028}, {1, 0}}, 1.6, 16},
};

// Needles, in units of their length.
static const double needle_width = 0.058, needle_shoulder = 0.4, needle_spread = 0.95; // spread: radians from the axis
enum { NEEDLE_VERTICES = 4, NEEDLE_TRIANGLES = 2, STALK_VERTICES = 3 };

const vt_leaf_shape *vt_shape_of(vt_leaf_form form) {
  VT_ASSERT(form < VT_LEAF_NEEDLES);
  return &shapes[form];
}

double vt_half_width(const vt_leaf_shape *shape) {
  double widest = 0;
  for (int k = 0; k < shape->count; k++) widest = fmax(widest, shape->outline[k][1]);
  return widest;
}

double vt_outline_at(const vt_leaf_shape *shape, double x) {
  double half = 0;
  for (int k = 0; k + 1 < shape->count; k++) {
    const double *a = shape->outline[k], *b = shape->outline[k + 1];
    double low = fmin(a[0], b[0]), high = fmax(a[0], b[0]);
    if (x < low || x > high || !(high > low)) continue;
    half = fmax(half, a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]));
  }
  return half;
}

double vt_leaf_area(vt_leaf_form form) { // shoelace, both halves
  if (form == VT_LEAF_NEEDLES) return VT_NEEDLE_COUNT * 0.5 * needle_width;
  const vt_leaf_shape *shape = vt_shape_of(form);
  double twice = 0;
  for (int k = 0; k + 1 < shape->count; k++) {
    const double *a = shape->outline[k], *b = shape->outline[k + 1];
    twice += fabs((a[0] - shape->centre) * b[1] - (b[0] - shape->centre) * a[1]);
  }
  return twice;
}

void vt_count_leaf(vt_leaf_form form, bool stalked, size_t *vertices, size_t *triangles) {
  if (form == VT_LEAF_NEEDLES) {
    *vertices = NEEDLE_VERTICES * VT_NEEDLE_COUNT, *triangles = NEEDLE_TRIANGLES * VT_NEEDLE_COUNT;
    return;
  }
  size_t rim = (size_t)(2 * (vt_shape_of(form)->count - 1));
  *vertices = rim + 1 + (stalked ? STALK_VERTICES : 0), *triangles = rim + (stalked ? 1 : 0);
}

typedef struct leaf {
  vt_mesh *mesh;
  const vt_leaf_frame *frame;
  double across; // texture units for each unit of y
} leaf;

// A point of the leaf and its normal: height over the leaf's plane is fold (sqrt(y^2 + e^2) - e) - droop x^2.
static uint32_t add_leaf_vertex(const leaf *l, double x, double y, vt_vec3 colour) {
  const double soft = 0.06;
  const vt_leaf_frame *f = l->frame;
  double root = sqrt(y * y + soft * soft), height = f->fold * (root - soft) - f->droop * x * x;
  double slope_x = -2 * f->droop * x, slope_y = f->fold * y / root;
  vt_vec3 local = vt_add(vt_scale(f->along, x), vt_add(vt_scale(f->across, y), vt_scale(f->up, height)));
  vt_vec3 normal = vt_sub(f->up, vt_add(vt_scale(f->along, slope_x), vt_scale(f->across, slope_y)));
  vt_vec3 position = vt_add(f->origin, vt_scale(local, f->length));
  uint32_t vertex = vt_add_vertex(l->mesh, position, vt_normalise(normal), colour);
  float *uv = l->mesh->vertices[vertex].uv;
  uv[0] = (float)(0.5 + y * l->across), uv[1] = (float)fmin(fmax(x, 0), 1);
  return vertex;
}

void vt_add_leaf(vt_mesh *mesh, const vt_leaf_shape *shape, const vt_leaf_frame *frame, bool stalked, vt_vec3 colour) {
  leaf l = {mesh, frame, 0.49 / vt_half_width(shape)};
  vt_vec3 edge = vt_scale(colour, 0.92), rib = vt_scale(colour, 1.18);
  uint32_t hub = add_leaf_vertex(&l, shape->centre, 0, rib), ring = hub + 1;
  uint32_t count = (uint32_t)(2 * (shape->count - 1));
  for (int k = 0; k < shape->count; k++) add_leaf_vertex(&l, shape->outline[k][0], shape->outline[k][1], edge);
  for (int k = shape->count - 2; k > 0; k--) add_leaf_vertex(&l, shape->outline[k][0], -shape->outline[k][1], edge);
  // The outline runs from the stalk over +y to the tip: clockwise seen from above.
  for (uint32_t k = 0; k < count; k++) vt_add_triangle(mesh, hub, ring + (k + 1) % count, ring + k);
  if (!stalked) return;
  uint32_t stalk = add_leaf_vertex(&l, -frame->stalk, 0, rib);
  uint32_t left = add_leaf_vertex(&l, shape->outline[0][0] + .1, .016, rib);
  uint32_t right = add_leaf_vertex(&l, shape->outline[0][0] + .1, -.016, rib);
  vt_add_triangle(mesh, stalk, right, left);
}

static void add_needle(vt_mesh *mesh, vt_vec3 foot, vt_vec3 along, vt_vec3 axis, double length, double bend, double roll,
                       vt_vec3 colour) {
  vt_vec3 helper = fabs(along.z) < 0.8 ? vt_v3(0, 0, 1) : vt_v3(1, 0, 0);
  vt_vec3 u = vt_normalise(vt_cross(along, helper)), v = vt_cross(along, u);
  vt_vec3 across = vt_add(vt_scale(u, cos(roll)), vt_scale(v, sin(roll))), face = vt_cross(along, across);
  if (vt_dot(face, axis) < 0) across = vt_scale(across, -1), face = vt_scale(face, -1);
  vt_vec3 tip = vt_add(vt_scale(along, length), vt_scale(axis, bend * length));
  vt_vec3 middle = vt_add(foot, vt_scale(along, needle_shoulder * length));
  vt_vec3 side = vt_scale(across, 0.5 * needle_width * length);
  vt_vec3 normal = vt_normalise(vt_add(face, vt_scale(axis, 0.9)));
  vt_vec3 corners[4] = {foot, vt_sub(middle, side), vt_add(middle, side), vt_add(foot, tip)};
  const float u_of[4] = {0.5f, 0, 1, 0.5f}, v_of[4] = {0, (float)needle_shoulder, (float)needle_shoulder, 1};
  uint32_t first = (uint32_t)mesh->vertex_count;
  for (int k = 0; k < 4; k++) {
    uint32_t vertex = vt_add_vertex(mesh, corners[k], normal, vt_scale(colour, k == 0 ? 0.85 : 1.05));
    mesh->vertices[vertex].uv[0] = u_of[k], mesh->vertices[vertex].uv[1] = v_of[k];
  }
  vt_add_triangle(mesh, first, first + 1, first + 2);
  vt_add_triangle(mesh, first + 1, first + 3, first + 2);
}

void vt_add_needles(vt_mesh *mesh, const vt_leaf_frame *f, vt_vec3 colour, vt_rng *rng) {
  double phase = vt_random_between(rng, 0, 2 * VT_PI);
  for (int k = 0; k < VT_NEEDLE_COUNT; k++) {
    double from_axis = needle_spread * sqrt((k + vt_random_unit(rng)) / VT_NEEDLE_COUNT);
    double angle = phase + k * VT_PI * (3 - sqrt(5));
    vt_vec3 out = vt_add(vt_scale(f->across, cos(angle)), vt_scale(f->up, sin(angle)));
    vt_vec3 along = vt_add(vt_scale(f->along, cos(from_axis)), vt_scale(out, sin(from_axis)));
    double length = f->length * vt_random_between(rng, 0.8, 1.15), bend = vt_random_between(rng, 0, 0.16);
    add_needle(mesh, f->origin, along, f->along, length, bend, vt_random_between(rng, 0, 2 * VT_PI),
               vt_scale(colour, vt_random_between(rng, 0.9, 1.1)));
  }
}
