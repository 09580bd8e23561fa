// orbit.c - cameras around a tree
// SPDX-License-Identifier: BSD-3-Clause
//
// Calibrated photographs have no up. People hold cameras level but tilt them, so the rows r_i of the pictures are
// horizontal where the columns are not vertical: up is the unit vector u that least violates r_i . u = 0, kept near the
// mean m of the cameras' own up vectors where the rows leave it open (all photographs from one side):
//   (1/n sum r_i r_i^T + lambda I) u = lambda m.
// Where the cameras' ups cancel (a flying orbit, upside down), the world's z is taken.
#include "programs/orbit.h"

#include "base/vector.h"

#define LAMBDA 0.01
#define DEGREE (VT_PI / 180)

static vt_vec3 row_of(const vt_camera *camera, int row) {
  const double *m = camera->rotation.m + 3 * row;
  return vt_v3(m[0], m[1], m[2]);
}

// Solves A x = b, A symmetric and positive definite, by Cramer's rule on its columns.
static vt_vec3 solve3(const double a[9], vt_vec3 b) {
  vt_vec3 c0 = vt_v3(a[0], a[3], a[6]), c1 = vt_v3(a[1], a[4], a[7]), c2 = vt_v3(a[2], a[5], a[8]);
  double determinant = vt_dot(c0, vt_cross(c1, c2));
  return vt_scale(vt_v3(vt_dot(b, vt_cross(c1, c2)), vt_dot(c0, vt_cross(b, c2)), vt_dot(c0, vt_cross(c1, b))),
                  1 / determinant);
}

static vt_vec3 find_up(const vt_tree *tree) {
  vt_vec3 mean = {0, 0, 0};
  double a[9] = {LAMBDA, 0, 0, 0, LAMBDA, 0, 0, 0, LAMBDA};
  for (int i = 0; i < tree->view_count; i++) {
    vt_vec3 right = row_of(&tree->cameras[i], 0), down = row_of(&tree->cameras[i], 1);
    mean = vt_sub(mean, vt_scale(down, 1.0 / tree->view_count));
    double r[3] = {right.x, right.y, right.z};
    for (int k = 0; k < 9; k++) a[k] += r[k / 3] * r[k % 3] / tree->view_count;
  }
  if (tree->view_count == 0 || vt_length(mean) < 0.3) return vt_v3(0, 0, 1);
  return vt_normalise(solve3(a, vt_scale(mean, LAMBDA)));
}

#define TRIMMED                                                                                                        \
  0.002 // share of the opacity that may lie outside, on each side of the box: haze must not make the tree small

// First and last cell along one axis between which all but TRIMMED of the opacity lies, by its histogram.
static void find_range(const vt_level *level, const uint16_t *at, int *first, int *last) {
  double histogram[1 << VT_MAX_LEVEL] = {0}, sum = 0;
  int size = level->axis_cells < 1 << VT_MAX_LEVEL ? level->axis_cells : 1 << VT_MAX_LEVEL;
  for (uint32_t i = 0; i < level->cell_count; i++) {
    double opacity = -expm1(-(double)level->optical_depth[i]);
    histogram[at[i] < size ? at[i] : size - 1] += opacity;
    sum += opacity;
  }
  *first = 0, *last = size - 1;
  double below = histogram[0], above = histogram[size - 1];
  while (*first < *last && below <= TRIMMED * sum) below += histogram[++*first];
  while (*last > *first && above <= TRIMMED * sum) above += histogram[--*last];
}

static void find_extent(const vt_tree *tree, vt_orbit *orbit) {
  const vt_octree *octree = &tree->octree;
  int finest = octree->level_count - 1, first[3], last[3];
  while (finest > 0 && octree->levels[finest].axis_cells > 1 << VT_MAX_LEVEL) finest--;
  const vt_level *level = &octree->levels[finest];
  find_range(level, level->x, &first[0], &last[0]);
  find_range(level, level->y, &first[1], &last[1]);
  find_range(level, level->z, &first[2], &last[2]);
  double edge = vt_cell_edge(octree, finest);
  vt_vec3 a = vt_scale(vt_v3(first[0], first[1], first[2]), edge);
  vt_vec3 b = vt_scale(vt_v3(last[0] + 1, last[1] + 1, last[2] + 1), edge);
  orbit->centre = vt_add(octree->origin, vt_scale(vt_add(a, b), 0.5));
  orbit->size = vt_length(vt_sub(b, a));
}

vt_orbit vt_find_orbit(const vt_tree *tree) {
  vt_orbit orbit = {.up = find_up(tree), .elevation = 15, .first_width = 800, .first_height = 800};
  find_extent(tree, &orbit);
  vt_vec3 first = fabs(orbit.up.x) < 0.9 ? vt_v3(1, 0, 0) : vt_v3(0, 1, 0);
  if (tree->view_count > 0) {
    orbit.first_width = tree->cameras[0].width;
    orbit.first_height = tree->cameras[0].height;
    orbit.elevation = 0;
    for (int i = 0; i < tree->view_count; i++) {
      vt_vec3 way = vt_normalise(vt_sub(vt_camera_centre(&tree->cameras[i]), orbit.centre));
      double sine = vt_dot(way, orbit.up);
      orbit.elevation += asin(sine < -1 ? -1 : sine > 1 ? 1 : sine) / DEGREE / tree->view_count;
      if (i == 0 && fabs(sine) < 0.99) first = way;
    }
  }
  orbit.ahead = vt_normalise(vt_sub(first, vt_scale(orbit.up, vt_dot(first, orbit.up))));
  orbit.aside = vt_cross(orbit.up, orbit.ahead);
  return orbit;
}

double vt_fitting_distance(double fov, int width, int height) {
  double half = fov * DEGREE / 2; // of the picture's height; the narrower direction decides
  if (width < height) half = atan(tan(half) * width / height);
  return 0.5 / sin(half);
}

vt_camera vt_orbit_camera(const vt_orbit *orbit, double azimuth, double elevation, double distance, double fov,
                          int width, int height) {
  double a = azimuth * DEGREE, e = elevation * DEGREE;
  if (distance <= 0) distance = vt_fitting_distance(fov, width, height);
  vt_vec3 level = vt_add(vt_scale(orbit->ahead, cos(a)), vt_scale(orbit->aside, sin(a)));
  vt_vec3 way = vt_add(vt_scale(level, cos(e)), vt_scale(orbit->up, sin(e)));
  vt_vec3 up = vt_sub(vt_scale(orbit->up, cos(e)), vt_scale(level, sin(e))); // also above the pole
  vt_vec3 eye = vt_add(orbit->centre, vt_scale(way, distance * orbit->size));
  return vt_look_at(eye, orbit->centre, up, fov * DEGREE, width, height);
}
