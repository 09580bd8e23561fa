// ray_walk.c - the occupied cells along a ray
// SPDX-License-Identifier: BSD-3-Clause
//
// Two nested walks of integer steps [Amanatides & Woo 1987, A fast voxel traversal algorithm]: over bricks, and within
// a brick that holds cells over its cells. Distances to planes are in double and begin anew from the planes' integer
// numbers in each brick, so errors do not grow along the ray; a cell ends where the next begins, so the chords of a ray
// add up to its clipped length. Empty bricks know how far the nearest cells are, and the walk jumps that far. An axis
// along which the ray does not move never gives the next plane (its distance is infinite by choice, not by 0/0), and a ray
// that starts on a plane belongs to the cell above it (half-open cells). Many rays are walked by ray_packet.c.

#include "octree/cells.h"

#include <math.h>

#define SMALLEST_CHORD 1e-5
#define LEAST_SKIP 3 // a jump costs about as much as so many steps

// The state of one walk over a grid, axes apart so that it stays in registers.
typedef struct stepper {
  double x, y, z;    // distance at which the ray leaves the current cell through each axis' plane
  double dx, dy, dz; // distance between two planes; infinite along an axis without movement
  int64_t at;         // linear number of the current cell
  int64_t sx, sy, sz; // what a step along each axis adds to it
} stepper;

typedef struct walker {
  double origin[3], direction[3], inverse[3]; // in cell edges; inverse 0 along an axis without movement
  int step[3];
  double rounding; // what distances summed along the whole ray may be off by, in cell edges, and more
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
    double low = t0 < t1 ? t0 : t1, high = t0 < t1 ? t1 : t0;
    if (low > *near) *near = low;
    if (high < *far) *far = high;
  }
  return *near < *far;
}

// Integer coordinate of the point at distance t along one axis, in units of `size` cells, kept within [low, high].
static inline int locate(const walker *w, int a, double t, double size, int low, int high) {
  int i = (int)((w->origin[a] + t * w->direction[a]) / size); // below zero `low` holds
  return i < low ? low : i > high ? high : i;
}

// Distance at which the ray leaves the cell (or brick) with coordinate i along axis a.
static inline double next_plane(const walker *w, int a, int i, double size) {
  if (!w->step[a]) return INFINITY;
  return ((i + (w->step[a] > 0)) * size - w->origin[a]) * w->inverse[a];
}

static inline stepper start_at(const walker *w, const int cell[3], double size, int64_t at, int64_t row,
                               int64_t slice) {
  double d[3];
  for (int a = 0; a < 3; a++) d[a] = w->step[a] ? size * fabs(w->inverse[a]) : INFINITY;
  return (stepper){next_plane(w, 0, cell[0], size), next_plane(w, 1, cell[1], size), next_plane(w, 2, cell[2], size),
                   d[0], d[1], d[2], at, w->step[0], w->step[1] * row, w->step[2] * slice};
}

static inline double next_exit(const stepper *s) {
  double t = s->x < s->y ? s->x : s->y;
  return t < s->z ? t : s->z;
}

// Into the next cell, without branches: which axis comes first is as good as chance.
static inline void step_on(stepper *s, double exit) {
  int64_t mx = -(s->x == exit), my = ~mx & -(s->y == exit), mz = ~(mx | my);
  s->at += (mx & s->sx) + (my & s->sy) + (mz & s->sz);
  s->x += mx ? s->dx : 0;
  s->y += my ? s->dy : 0;
  s->z += mz ? s->dz : 0;
}

// Morton number of the cell with linear number x + 4y + 16z (in the tri-grid's bricks they agree).
static const uint8_t morton_in_brick[64] = {
    0,  1,  8,  9,  2,  3,  10, 11, 16, 17, 24, 25, 18, 19, 26, 27, 4,  5,  12, 13, 6,  7,  14, 15, 20, 21, 28, 29, 22, 23, 30, 31,
    32, 33, 40, 41, 34, 35, 42, 43, 48, 49, 56, 57, 50, 51, 58, 59, 36, 37, 44, 45, 38, 39, 46, 47, 52, 53, 60, 61, 54, 55, 62, 63};

// Walks the cells of one brick between distances near and far. Planes are summed over at most 3 edge steps here, so
// the end of the brick is met within rounding: closer than that to `far` is the end.
static size_t walk_brick(const walker *w, int edge, const vt_brick *brick, const int brick_at[3], double near, double far,
                         vt_segment *out) {
  int cell[3], local[3];
  for (int a = 0; a < 3; a++) {
    int corner = brick_at[a] * edge;
    cell[a] = locate(w, a, near, 1, corner, corner + edge - 1);
    local[a] = cell[a] - corner;
  }
  stepper s = start_at(w, cell, 1, local[0] + 4 * (local[1] + 4 * local[2]), 4, 16);
  double t = near, last = far - w->rounding;
  size_t count = 0;
  while (s.at >= 0 && s.at < 64) { // whatever is rounded
    double exit = next_exit(&s), end = exit < far ? exit : far;
    uint64_t bit = 1ull << (edge == 4 ? morton_in_brick[s.at] : s.at);
    if (brick->mask & bit) {
      out[count] = (vt_segment){brick->first + vt_count_bits(brick->mask & (bit - 1)), (float)t, (float)(end - t)};
      count += end - t >= SMALLEST_CHORD;
    }
    if (exit >= last) break;
    t = end > t ? end : t;
    step_on(&s, exit);
  }
  return count;
}

static inline stepper start_in_brick(const walker *w, double t, int edge, int n) {
  int brick[3];
  for (int a = 0; a < 3; a++) brick[a] = locate(w, a, t, edge, 0, n - 1);
  return start_at(w, brick, edge, brick[0] + n * (brick[1] + (int64_t)n * brick[2]), n, (int64_t)n * n);
}

static inline void split_number(int64_t number, int n, int at[3]) {
  at[0] = (int)(number % n), at[1] = (int)(number / n % n), at[2] = (int)(number / n / n);
}

// vt_find_brick by linear number, without the divisions where the map has an entry for each brick.
static inline int32_t find_here(const vt_level *level, int64_t number, int *skip) {
  if (level->map.depth) {
    int at[3];
    split_number(number, level->axis_bricks, at);
    return vt_find_brick(level, at, skip);
  }
  int32_t entry = level->map.entries[number];
  *skip = entry < 0 ? -entry : 0;
  return entry < 0 ? -1 : entry;
}

size_t vt_walk_ray(const vt_octree *octree, int level_number, const vt_ray *ray, vt_segment *out) {
  const vt_level *level = &octree->levels[level_number];
  int n = level->axis_bricks, edge = vt_brick_edge(octree->branching);
  double scale = level->axis_cells / octree->edge, near, far;
  vt_vec3 o = vt_scale(vt_sub(ray->origin, octree->origin), scale), d = ray->direction;
  walker w = {.origin = {o.x, o.y, o.z}, .direction = {d.x, d.y, d.z}, .rounding = 1e-9 + 1e-12 * level->axis_cells};
  for (int a = 0; a < 3; a++)
    if (fabs(w.direction[a]) > 1e-12) {
      w.inverse[a] = 1 / w.direction[a];
      w.step[a] = w.direction[a] > 0 ? 1 : -1;
    }
  if (!level->cell_count || !clip_to_root(&w, level->axis_cells, &near, &far)) return 0;
  double before = near; // the walk begins where the ray enters: distances stay small however far the eye
  for (int a = 0; a < 3 && near > 0; a++) w.origin[a] += near * w.direction[a];
  far -= near;
  near = 0;

  stepper s = start_in_brick(&w, near, edge, n);
  double t = near, last = far - w.rounding;
  size_t count = 0;
  while (s.at >= 0 && s.at < (int64_t)n * n * n) { // or past the last brick by rounding, after thousands of planes
    int skip;
    int32_t number = find_here(level, s.at, &skip);
    if (skip > LEAST_SKIP) { // nothing within skip - 1 bricks on any side
      t += (skip - 1) * (double)edge;
      if (t >= last) break;
      s = start_in_brick(&w, t, edge, n);
      continue;
    }
    double exit = next_exit(&s), end = exit < far ? exit : far;
    if (number >= 0 && end > t) {
      int at[3];
      split_number(s.at, n, at);
      count += walk_brick(&w, edge, &level->bricks[number], at, t, end, out + count);
    }
    if (exit >= last) break;
    t = end > t ? end : t;
    step_on(&s, exit);
  }
  for (size_t k = 0; k < count && before > 0; k++) out[k].entry = (float)(out[k].entry + before);
  return count;
}
