// bounds.c - the root cube from cameras and mattes alone
// SPDX-License-Identifier: BSD-3-Clause
//
// First guess: the point nearest to the rays through the centroids of the mattes (least squares), and the farthest
// extent of any matte at that distance. Then the guess is carved on 64^3 cells and shrunk to what stands, until it
// shrinks no more. Mattes with stray pixels inflate the guess only, not the result, since strays do not agree.

#include "reconstruct/bounds.h"
#include "reconstruct/hull.h"

#include <float.h>

#define SOLID 64 // alpha in 1/255 that counts as tree for the guess
#define BOUNDS_LEVEL 6

// Centroid and count of the solid pixels.
static size_t centroid_of(const vt_image *picture, double centroid[2]) {
  double sx = 0, sy = 0;
  size_t count = 0;
  for (int y = 0; y < picture->height; y++)
    for (int x = 0; x < picture->width; x++)
      if (picture->pixels[4 * ((size_t)y * (size_t)picture->width + (size_t)x) + 3] >= SOLID) {
        sx += x + 0.5;
        sy += y + 0.5;
        count++;
      }
  if (count) centroid[0] = sx / (double)count, centroid[1] = sy / (double)count;
  return count;
}

// Largest distance of a solid pixel from the projection of `centre`, in units of the world at that depth.
static double extent_of(const vt_view *view, vt_vec3 centre) {
  double pixel[2], worst = 0;
  if (!vt_project(&view->camera, centre, pixel)) return 0;
  const vt_image *picture = &view->picture;
  for (int y = 0; y < picture->height; y++)
    for (int x = 0; x < picture->width; x++)
      if (picture->pixels[4 * ((size_t)y * (size_t)picture->width + (size_t)x) + 3] >= SOLID) {
        double dx = (x + 0.5 - pixel[0]) / view->camera.fx, dy = (y + 0.5 - pixel[1]) / view->camera.fy;
        worst = fmax(worst, dx * dx + dy * dy);
      }
  return sqrt(worst) * vt_to_camera(&view->camera, centre).z;
}

// Adds I - d d^T and (I - d d^T) o of a ray to the normal equations of the nearest point.
static void add_ray(double a[9], double b[3], vt_ray ray) {
  double d[3] = {ray.direction.x, ray.direction.y, ray.direction.z}, o[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      double p = (i == j) - d[i] * d[j];
      a[3 * i + j] += p;
      b[i] += p * o[j];
    }
}

static bool solve_3x3(const double a[9], const double b[3], vt_vec3 *x) {
  vt_vec3 r0 = vt_v3(a[0], a[1], a[2]), r1 = vt_v3(a[3], a[4], a[5]), r2 = vt_v3(a[6], a[7], a[8]);
  vt_vec3 c12 = vt_cross(r1, r2), c20 = vt_cross(r2, r0), c01 = vt_cross(r0, r1);
  double det = vt_dot(r0, c12), size = vt_length(r0) * vt_length(r1) * vt_length(r2);
  if (!(fabs(det) > 1e-6 * size)) return false;
  *x = vt_scale(vt_add(vt_add(vt_scale(c12, b[0]), vt_scale(c20, b[1])), vt_scale(c01, b[2])), 1 / det);
  return true;
}

static vt_status guess_volume(vt_context *context, const vt_views *views, vt_vec3 *centre, double *radius) {
  double a[9] = {0}, b[3] = {0};
  vt_vec3 shift = vt_camera_centre(&views->items[0].camera), mean = {0, 0, 0}; // near the origin sums are exact
  vt_ray last = {{0, 0, 0}, {0, 0, 1}};
  int seeing = 0;
  for (int i = 0; i < views->count; i++) {
    double centroid[2];
    if (!centroid_of(&views->items[i].picture, centroid)) continue;
    last = vt_camera_ray(&views->items[i].camera, centroid[0], centroid[1]);
    last.origin = vt_sub(last.origin, shift);
    mean = vt_add(mean, last.origin);
    add_ray(a, b, last);
    seeing++;
  }
  if (!seeing)
    return vt_fail(context, VT_BAD_INPUT, "mattes: no photograph shows any tree (alpha above 0.25); check the masks, or "
                   "choose another --matte");
  if (!solve_3x3(a, b, centre)) { // one view, or all rays parallel: the distance is unknown, take one unit or the scene's
    double distance = vt_length(vt_sub(vt_scale(mean, 1.0 / seeing), vt_v3(0, 0, 0)));
    *centre = vt_add(last.origin, vt_scale(last.direction, distance > 0 ? distance : 1));
  }
  *centre = vt_add(*centre, shift);
  *radius = 0;
  for (int i = 0; i < views->count; i++) *radius = fmax(*radius, extent_of(&views->items[i], *centre));
  if (*radius > 0) return VT_OK;
  return vt_fail(context, VT_BAD_INPUT, "cameras: the photographs do not look at one point in front of them; check the "
                 "calibration");
}

// Carves the cube down to BOUNDS_LEVEL and gives the box of the cells that stand, in cells; count 0 if none.
static vt_status carve_box(vt_context *context, const vt_silhouettes *silhouettes, vt_octree *cube, int low[3],
                           int high[3], size_t *count) {
  const uint16_t root[1][3] = {{0, 0, 0}};
  vt_status status = vt_make_level(context, 2, 0, 1, root, &cube->levels[0]);
  for (int level = 0; level <= BOUNDS_LEVEL && !status; level++) {
    vt_level *cells = &cube->levels[level];
    uint8_t *keep = VT_NEW(context, uint8_t, cells->cell_count);
    status = keep ? vt_carve(context, silhouettes, cube, level, keep) : VT_OUT_OF_MEMORY;
    if (!status && level < BOUNDS_LEVEL) status = vt_split_level(context, 2, level, cells, keep, &cells[1]);
    for (uint32_t i = 0; i < cells->cell_count && level == BOUNDS_LEVEL && !status; i++) {
      if (!keep[i]) continue;
      int p[3] = {cells->x[i], cells->y[i], cells->z[i]};
      for (int a = 0; a < 3; a++) {
        if (!*count || p[a] < low[a]) low[a] = p[a];
        if (!*count || p[a] > high[a]) high[a] = p[a];
      }
      ++*count;
    }
    vt_free(context, keep);
  }
  for (int level = 0; level <= BOUNDS_LEVEL; level++) vt_free_level(context, &cube->levels[level]);
  return status;
}

// One round: the cube shrunk (or kept) around what stands in it. *share: new edge over old.
static vt_status shrink(vt_context *context, const vt_silhouettes *silhouettes, vt_octree *cube, double *share) {
  int low[3] = {0}, high[3] = {0};
  size_t count = 0;
  vt_status status = carve_box(context, silhouettes, cube, low, high, &count);
  if (status) return status;
  if (!count)
    return vt_fail(context, VT_BAD_INPUT, "mattes: the photographs have no volume in common (of %d); check that masks are "
                   "white on the tree and that cameras and photographs belong together", silhouettes->count);
  double cell = cube->edge / (1 << BOUNDS_LEVEL), edge = 0, origin[3] = {cube->origin.x, cube->origin.y, cube->origin.z};
  for (int a = 0; a < 3; a++) edge = fmax(edge, (high[a] - low[a] + 1) * cell);
  edge += 0.5 * cell;
  for (int a = 0; a < 3; a++) origin[a] += 0.5 * (low[a] + high[a] + 1) * cell - 0.5 * edge;
  *share = edge / cube->edge;
  cube->origin = vt_v3(origin[0], origin[1], origin[2]);
  cube->edge = edge;
  return VT_OK;
}

vt_status vt_find_bounds(vt_context *context, const vt_views *views, vt_octree *octree) {
  return vt_find_bounds_by(context, views, 1, octree);
}

vt_status vt_find_bounds_by(vt_context *context, const vt_views *views, int votes, vt_octree *octree) {
  vt_vec3 centre;
  double radius = 0;
  vt_status status = guess_volume(context, views, &centre, &radius);
  if (status) return status;
  int longest = 1;
  for (int i = 0; i < views->count; i++) {
    const vt_camera *c = &views->items[i].camera;
    longest = c->width > longest ? c->width : longest;
    longest = c->height > longest ? c->height : longest;
  }
  vt_silhouettes silhouettes;
  status = vt_make_silhouettes(context, views, (longest + 399) / 400, 8, &silhouettes);
  if (status) return status;
  silhouettes.votes = votes;
  radius *= 1.1;
  vt_octree cube = {.origin = vt_sub(centre, vt_v3(radius, radius, radius)), .edge = 2 * radius, .branching = 2,
                    .level_count = BOUNDS_LEVEL + 1};
  double share = 0;
  for (int round = 0; round < 4 && share < 0.95 && !status; round++) status = shrink(context, &silhouettes, &cube, &share);
  vt_free_silhouettes(context, &silhouettes);
  if (status) return status;
  octree->origin = cube.origin;
  octree->edge = cube.edge;
  vt_log(context, VT_LOG_VERBOSE, "bounds: cube of edge %g around (%g, %g, %g)", cube.edge, centre.x, centre.y, centre.z);
  return VT_OK;
}
