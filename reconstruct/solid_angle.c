// solid_angle.c - how much each photograph counts
// SPDX-License-Identifier: BSD-3-Clause
//
// Ten photographs from one spot say no more than one, but in a sum over pixels they count ten times, and what only the
// others can see is outvoted. So each view counts by its Voronoi cell among the directions of lines (a line seen from
// its other end integrates the same): the share of some thousand lines, evenly spread by the golden angle, that are nearest
// to it. Lines farther from every view than views usually are from each other are nobody's: the rim of a loop or a dome
// would get all the empty sky beyond it. The bounds keep a lonely view from deciding alone.

#include "reconstruct/solid_angle.h"

#include <math.h>
#include <stdlib.h>

enum { LINE_COUNT = 8192, MOST_VIEWS = 1024 };

// The view nearest to a line; views of equal direction take turns. -1: none is within `reach` (a cosine).
static int nearest_view(const vt_vec3 *directions, int count, vt_vec3 line, double reach, int turn) {
  int equal[8], equals = 0;
  double most = reach;
  for (int v = 0; v < count; v++) {
    double cosine = fabs(vt_dot(directions[v], line));
    if (cosine > most + 1e-9) most = cosine, equals = 0;
    if (cosine >= most - 1e-9 && equals < 8) equal[equals++] = v;
  }
  return equals ? equal[turn % equals] : -1;
}

static int compare_cosines(const void *a, const void *b) {
  double p = *(const double *)a, q = *(const double *)b;
  return (p > q) - (p < q);
}

// Cosine of the median angle between a view and its nearest other one, at least a degree.
static double usual_reach(const vt_vec3 *directions, int count) {
  double nearest[MOST_VIEWS];
  for (int v = 0; v < count; v++) {
    nearest[v] = 0;
    for (int w = 0; w < count; w++) {
      double cosine = fabs(vt_dot(directions[v], directions[w]));
      if (w != v && cosine > nearest[v]) nearest[v] = cosine;
    }
  }
  qsort(nearest, (size_t)count, sizeof *nearest, compare_cosines);
  return fmin(nearest[count / 2], cos(VT_PI / 180));
}

void vt_weigh_views(const vt_octree *octree, const vt_reduced_views *views, bool by_solid_angle, float *weight) {
  int count = views->count, lines[MOST_VIEWS] = {0}, shared = 0;
  for (int v = 0; v < count; v++) weight[v] = 1;
  if (!by_solid_angle || count < 3 || count > MOST_VIEWS) return;
  vt_vec3 directions[MOST_VIEWS];
  vt_vec3 middle = vt_add(octree->origin, vt_v3(octree->edge / 2, octree->edge / 2, octree->edge / 2));
  for (int v = 0; v < count; v++) directions[v] = vt_normalise(vt_sub(vt_camera_centre(&views->cameras[v]), middle));
  double reach = usual_reach(directions, count), sum = 0;
  for (int i = 0; i < LINE_COUNT; i++) {
    double z = (i + 0.5) / LINE_COUNT, r = sqrt(1 - z * z), angle = i * VT_PI * (3 - sqrt(5));
    int v = nearest_view(directions, count, vt_v3(r * cos(angle), r * sin(angle), z), reach, i);
    if (v >= 0) lines[v]++, shared++;
  }
  for (int v = 0; v < count && shared; v++) {
    double share = (double)lines[v] * count / shared;
    weight[v] = (float)(share < 0.25 ? 0.25 : share > 4 ? 4 : share);
    sum += (double)weight[v];
  }
  for (int v = 0; v < count && shared; v++) weight[v] = (float)((double)weight[v] * count / sum);
}
