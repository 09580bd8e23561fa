// level_mass.c - coarse levels show as much of the tree as the next finer one
// SPDX-License-Identifier: BSD-3-Clause
//
// Between photographs a pixel's R is the geometric mean of what some photographs say. Where one looks through a gap and another
// at a leaf, that is nearer to the gap: the mean of the logarithms lies below the logarithm of the mean by half their variance.
// The coarser a level, the more its R have to say, and the more they disagree: each level showed up to a tenth less of a crown
// than the next finer one, and the crown grew thicker as the eye came near.
// A fit cannot mend it: R is made anew from the fitted field, and takes back what the field gained.
// One factor g on all depths of a level, once its R are made, mends the mean. Optical depths on every ray grow by g and a
// pixel's opacity becomes 1 - (1 - a)^g: one picture of a level tells its mass for every g, and g is found by halving. The
// pictures are taken from between each photograph and its two nearest neighbours. The finest level is left alone: it has the
// photographs' own depths at their cameras. There a coarser level is now too opaque by what it lacked between them; both
// cannot be had with one factor, and an eye is between photographs as a rule.
// Small oak, 48 photographs, levels 3 to 6 against level 7 on views never seen: -8.5, -4.6, -1.2, +3.1 % of the opacity without,
// -0.3, +0.2, +0.5, +0.1 % with the factors, and 0.06, 0.02, 0, 0.05 dB more; pine and birch within 0.4 % on each.

#include "reconstruct/level_mass.h"
#include "base/rng.h"

#include <math.h>

#define CAMERAS 24
#define LEAST_HEIGHT 48 // of a picture, pixels
#define MOST 2.0 // factor

double vt_mass_with_factor(const vt_fimage *picture, double g) {
  double sum = 0;
  for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; i++) {
    double left = 1 - (double)picture->pixels[4 * i + 3];
    sum += left > 0 ? 1 - pow(left, g) : 1;
  }
  return sum;
}

double vt_factor_for_mass(const vt_fimage *pictures, int count, double wanted) {
  double low = 1 / MOST, high = MOST;
  for (int step = 0; step < 24; step++) {
    double middle = 0.5 * (low + high), mass = 0;
    for (int i = 0; i < count; i++) mass += vt_mass_with_factor(&pictures[i], middle);
    if (mass < wanted) low = middle;
    else high = middle;
  }
  return 0.5 * (low + high);
}

// From between a photograph and its two nearest neighbours, towards the tree's centre, a cell of the level about a pixel.
static vt_camera camera_between(const vt_tree *tree, int level, int view) {
  const vt_camera *own = &tree->cameras[view];
  double half = 0.5 * tree->octree.edge;
  vt_vec3 centre = vt_add(tree->octree.origin, vt_v3(half, half, half)), eye = vt_camera_centre(own);
  vt_view_weights nearest = vt_choose_views_but(tree, eye, 2, view);
  vt_rng rng = vt_seed_rng((uint64_t)view, 0);
  vt_vec3 a = vt_sub(eye, centre), way = vt_scale(vt_normalise(a), 0.05 + vt_random_unit(&rng));
  double distance = vt_length(a);
  for (int i = 0; i < nearest.count; i++) {
    vt_vec3 b = vt_normalise(vt_sub(vt_camera_centre(&tree->cameras[nearest.view[i]]), centre));
    way = vt_add(way, vt_scale(b, vt_random_unit(&rng)));
  }
  if (vt_length(way) < 1e-3) way = a; // opposite
  double cells = own->fy * vt_cell_edge(&tree->octree, level) / fmax(distance, 1e-9 * half); // pixels of a cell
  double shrink = fmin(1, fmax(1 / fmax(cells, 1e-9), (double)LEAST_HEIGHT / own->height));
  int width = (int)ceil(own->width * shrink), height = (int)ceil(own->height * shrink);
  vt_vec3 up = vt_v3(-own->rotation.m[3], -own->rotation.m[4], -own->rotation.m[5]);
  eye = vt_add(centre, vt_scale(vt_normalise(way), distance));
  return vt_look_at(eye, centre, up, 2 * atan(0.5 * own->height / own->fy), width, height);
}

static vt_status draw(vt_context *context, const vt_tree *tree, int level, int blend, const vt_camera *camera, vt_fimage *out) {
  vt_view_weights weights = vt_choose_views(tree, vt_camera_centre(camera), blend);
  return vt_composite(context, tree, level, &weights, VT_BLEND_GEOMETRIC, false, camera, out);
}

static void scale_level(vt_level *cells, float g) {
  for (size_t i = 0; i < cells->cell_count; i++) cells->optical_depth[i] *= g;
  for (size_t i = 0; i < cells->corner_count; i++) cells->corner_values[4 * i] *= g;
}

static vt_status match_level(vt_context *context, vt_tree *tree, int level, int blend, float *factor) {
  vt_fimage coarse[CAMERAS] = {{0}}, fine = {0};
  int count = tree->view_count < CAMERAS ? tree->view_count : CAMERAS;
  double wanted = 0;
  vt_status status = VT_OK;
  for (int i = 0; i < count && !status; i++) {
    vt_camera camera = camera_between(tree, level, i * tree->view_count / count);
    status = draw(context, tree, level, blend, &camera, &coarse[i]);
    if (!status) status = draw(context, tree, level + 1, blend, &camera, &fine);
    if (!status) wanted += vt_mass_with_factor(&fine, 1);
    vt_free_fimage(context, &fine);
  }
  *factor = 1;
  if (!status && wanted > 0) *factor = (float)vt_factor_for_mass(coarse, count, wanted);
  if (!status) scale_level(&tree->octree.levels[level], *factor);
  for (int i = 0; i < count; i++) vt_free_fimage(context, &coarse[i]);
  return status;
}

vt_status vt_match_level_mass(vt_context *context, vt_tree *tree, int blend, float *factors) {
  vt_status status = VT_OK;
  for (int level = tree->octree.level_count - 2; level >= 0 && !status; level--) {
    float factor = 1;
    if (tree->view_textures[level].view_count && tree->view_textures[level + 1].view_count)
      status = match_level(context, tree, level, blend, &factor);
    if (factors) factors[level] = factor;
  }
  return status;
}
