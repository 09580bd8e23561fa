// ray_walk.c - the occupied cells along a ray
// SPDX-License-Identifier: BSD-3-Clause
//
// Two nested walks of integer steps [Amanatides & Woo 1987, A fast voxel traversal algorithm]: over bricks, and within
// a brick that holds cells over its cells. The distance to the next plane is computed from the plane's integer number,
// never summed up, so errors do not grow along the ray; a cell ends where the next begins, so the chords of a ray add
// up to its clipped length. An axis along which the ray does not move never gives the next plane (its distance is
// infinite by choice, not by 0/0), and a ray that starts on a plane belongs to the cell above it (half-open cells).

#include "octree/cells.h"

#include <math.h>

#define SMALLEST_CHORD 1e-5

typedef struct walker {
  double origin[3], inverse[3]; // in cell edges; inverse direction, 0 along an axis without movement
  double direction[3];
  int step[3];
} walker;

size_t vt_max_segments(const vt_level *level) { return 3 * (size_t)level->axis_cells + 4; }

// Clips the ray to the cube [0, n]^3. False if they do not meet.
static bool clip_to_root(const walker *w, double n, double *near, double *far) {
  *near = 0;
  *far = INFINITY;
  for (int a = 0; a < 3; a++) {
    if (!w->step[a]) {
      if (!(w->origin[a] >= 0 && w->origin[a] < n)) return false;
      continue;
    }
    double t0 = (0 - w->origin[a]) * w->inverse[a], t1 = (n - w->origin[a]) * w->inverse[a];
    *near = fmax(*near, fmin(t0, t1));
    *far = fmin(*far, fmax(t0, t1));
  }
  return *near < *far;
}

// Integer coordinate of the point at distance t along one axis, in units of `size` cells, kept within [low, high].
static inline int locate(const walker *w, int a, double t, double size, int low, int high) {
  double p = (w->origin[a] + t * w->direction[a]) / size;
  int i = (int)p; // p >= -tiny here; truncation and floor differ only below zero, where `low` holds
  return i < low ? low : i > high ? high : i;
}

// Distance at which the ray leaves the cell (or brick) with coordinate i along axis a.
static inline double next_plane(const walker *w, int a, int i, double size) {
  if (!w->step[a]) return INFINITY;
  return ((i + (w->step[a] > 0)) * size - w->origin[a]) * w->inverse[a];
}

static inline int smallest(const double t[3]) { return t[0] <= t[1] ? (t[0] <= t[2] ? 0 : 2) : (t[1] <= t[2] ? 1 : 2); }

// Walks the cells of one brick between distances near and far.
static size_t walk_brick(const walker *w, int branching, const vt_brick *brick, const int corner[3], double near,
                         double far, vt_segment *out) {
  int edge = vt_brick_edge(branching), cell[3];
  double plane[3], t = near;
  for (int a = 0; a < 3; a++) {
    cell[a] = locate(w, a, near, 1, corner[a], corner[a] + edge - 1);
    plane[a] = next_plane(w, a, cell[a], 1);
  }
  size_t count = 0;
  for (;;) {
    int a = smallest(plane);
    double end = plane[a] < far ? plane[a] : far;
    uint64_t bit = 1ull << vt_brick_bit(branching, (unsigned)(cell[0] - corner[0]), (unsigned)(cell[1] - corner[1]),
                                        (unsigned)(cell[2] - corner[2]));
    if ((brick->mask & bit) && end - t >= SMALLEST_CHORD)
      out[count++] = (vt_segment){brick->first + vt_count_bits(brick->mask & (bit - 1)), (float)t, (float)(end - t)};
    if (plane[a] >= far) return count;
    if (end > t) t = end;
    cell[a] += w->step[a];
    if (cell[a] < corner[a] || cell[a] >= corner[a] + edge) return count;
    plane[a] = next_plane(w, a, cell[a], 1);
  }
}

size_t vt_walk_ray(const vt_octree *octree, int level_number, const vt_ray *ray, vt_segment *out) {
  const vt_level *level = &octree->levels[level_number];
  int n = level->axis_bricks, edge = vt_brick_edge(octree->branching);
  double scale = level->axis_cells / octree->edge, near, far;
  vt_vec3 o = vt_scale(vt_sub(ray->origin, octree->origin), scale), d = ray->direction;
  walker w = {.origin = {o.x, o.y, o.z}, .direction = {d.x, d.y, d.z}};
  for (int a = 0; a < 3; a++)
    if (fabs(w.direction[a]) > 1e-12) {
      w.inverse[a] = 1 / w.direction[a];
      w.step[a] = w.direction[a] > 0 ? 1 : -1;
    }
  if (!level->cell_count || !clip_to_root(&w, level->axis_cells, &near, &far)) return 0;

  int brick[3];
  double plane[3], t = near, size = edge;
  for (int a = 0; a < 3; a++) {
    brick[a] = locate(&w, a, near, size, 0, n - 1);
    plane[a] = next_plane(&w, a, brick[a], size);
  }
  size_t count = 0;
  for (;;) {
    int a = smallest(plane);
    double end = plane[a] < far ? plane[a] : far;
    const vt_brick *here = &level->bricks[(size_t)brick[0] + (size_t)n * ((size_t)brick[1] + (size_t)n * (size_t)brick[2])];
    if (here->mask && end > t) {
      int corner[3] = {brick[0] * edge, brick[1] * edge, brick[2] * edge};
      count += walk_brick(&w, octree->branching, here, corner, t, end, out + count);
    }
    if (plane[a] >= far) return count;
    if (end > t) t = end;
    brick[a] += w.step[a];
    if (brick[a] < 0 || brick[a] >= n) return count;
    plane[a] = next_plane(&w, a, brick[a], size);
  }
}
