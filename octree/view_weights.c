// view_weights.c - which photographs' textures are blended for an eye, and how much of each
// SPDX-License-Identifier: BSD-3-Clause
//
// Angles t_v between the eye's and the cameras' directions from the tree's centre. Of the k closest
//   w_v = (1/t_v) (1 - t_v / (b t_{k+1})),  normalised,  b = 1 + 10^-6
// [Buehler, Bosse, McMillan, Gortler, Cohen 2001, Unstructured lumigraph rendering, section 3.2]: the first factor lets
// an eye in a camera's direction see that photograph alone, the second takes a view's weight to (all but) zero where
// another takes its place, so nothing pops. b is above 1 only so that k + 1 equal angles still have weights; at 1.05,
// which is sometimes used, a view enters with 5 % at once, and with much more where all angles are similar.
// A view whose texture on the finest level that has some is empty is passed over: others say what it would (redundant.c).
// Angles come from atan2, for acos has no digits near 0. Equal angles go to the smaller index.

#include "octree/octree.h"

#define BORDER (1 + 1e-6)
#define SAME_DIRECTION 1e-12 // radians

static double angle_between(vt_vec3 a, vt_vec3 b) { return atan2(vt_length(vt_cross(a, b)), vt_dot(a, b)); }

// Of the finest level that has some; NULL where all are empty, and none is to be passed over.
static const vt_view_textures *finest_textures(const vt_tree *tree) {
  int level = VT_MAX_LEVEL;
  while (level > 0 && !tree->view_textures[level].view_count) level--;
  const vt_view_textures *textures = &tree->view_textures[level];
  for (int v = 0; v < textures->view_count; v++)
    if (textures->views[v].columns) return textures;
  return NULL;
}

// The `wanted` smallest angles, ascending, with their views but one; returns how many there are.
static int find_closest(const vt_tree *tree, vt_vec3 eye, int wanted, int left_out, int *view, double *angle) {
  double half = 0.5 * tree->octree.edge;
  vt_vec3 centre = vt_add(tree->octree.origin, vt_v3(half, half, half));
  vt_vec3 direction = vt_normalise(vt_sub(eye, centre));
  const vt_view_textures *textures = finest_textures(tree);
  int count = 0;
  for (int v = 0; v < tree->view_count; v++) {
    if (v == left_out || (textures && v < textures->view_count && !textures->views[v].columns)) continue;
    vt_vec3 camera = vt_normalise(vt_sub(vt_camera_centre(&tree->cameras[v]), centre));
    double t = angle_between(direction, camera);
    int place = count < wanted ? count++ : wanted;
    for (; place > 0 && t < angle[place - 1]; place--)
      if (place < wanted) {
        view[place] = view[place - 1];
        angle[place] = angle[place - 1];
      }
    if (place < wanted) {
      view[place] = v;
      angle[place] = t;
    }
  }
  return count;
}

vt_view_weights vt_choose_views(const vt_tree *tree, vt_vec3 eye, int k) { return vt_choose_views_but(tree, eye, k, -1); }

vt_view_weights vt_choose_views_but(const vt_tree *tree, vt_vec3 eye, int k, int left_out) {
  VT_ASSERT(k >= 1 && k <= VT_MAX_BLEND_VIEWS);
  int view[VT_MAX_BLEND_VIEWS + 1];
  double angle[VT_MAX_BLEND_VIEWS + 1], weight[VT_MAX_BLEND_VIEWS], sum = 0;
  int found = find_closest(tree, eye, k + 1, left_out, view, angle);
  vt_view_weights out = {.count = found < k ? found : k};
  if (found && angle[0] < SAME_DIRECTION) {
    out = (vt_view_weights){.count = 1, .view = {view[0]}, .weight = {1}};
    return out;
  }
  for (int i = 0; i < out.count; i++) {
    weight[i] = 1 / angle[i];
    if (found > k) weight[i] *= 1 - angle[i] / (BORDER * angle[k]);
    sum += weight[i];
  }
  for (int i = 0; i < out.count; i++) {
    out.view[i] = view[i];
    out.weight[i] = (float)(weight[i] / sum);
  }
  return out;
}
