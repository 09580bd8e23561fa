// hull.c - which cells the mattes leave standing
// SPDX-License-Identifier: BSD-3-Clause
//
// The visual hull, coarse to fine: a cell is carved when photographs that have its whole projection within their frame
// see nothing but backdrop there. The projection of a cube lies within a rectangle (footprint.c), asked of a
// summed-area table in four reads. Conservative in every step: pixels pooled by maximum, the rectangle grown by one
// pixel, a photograph that cuts the cell off says nothing, and where mattes are estimated several photographs must agree
// (they miss thin twigs now and then).
//
// A photograph is first asked about a whole block of 8^3 cells, then of 4^3, 2^3: if it sees that block full of tree, or not
// at all, or empty, all cells in it are answered at once, and inside a crown or far from it most are. Blocks
// and cells are runs in Morton order, and a photograph is asked about a run of them before the next photograph is: so the
// part of its table that they touch stays in the cache.

#include "reconstruct/hull.h"
#include "reconstruct/footprint.h"

typedef struct silhouette_job {
  const vt_views *views;
  vt_silhouettes *out;
  int threshold;
} silhouette_job;

// What is ignored counts as set: it cannot carve.
static bool pooled_pixel_set(const vt_view *view, int factor, int threshold, int px, int py) {
  const vt_image *picture = &view->picture;
  const uint8_t *ignored = view->ignored.pixels;
  for (int y = py * factor; y < (py + 1) * factor && y < picture->height; y++)
    for (int x = px * factor; x < (px + 1) * factor && x < picture->width; x++)
    {
      size_t i = (size_t)y * (size_t)picture->width + (size_t)x;
      if (picture->pixels[4 * i + 3] > threshold || (ignored && ignored[i])) return true;
    }
  return false;
}

static void sum_silhouettes(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  silhouette_job *job = user;
  for (size_t i = begin; i < end; i++) {
    const vt_camera *camera = &job->out->cameras[i];
    uint32_t *sums = job->out->sums[i];
    size_t stride = (size_t)camera->width + 1;
    for (int y = 0; y < camera->height; y++) {
      uint32_t row = 0;
      for (int x = 0; x < camera->width; x++) {
        row += pooled_pixel_set(&job->views->items[i], job->out->factor, job->threshold, x, y);
        sums[(size_t)(y + 1) * stride + (size_t)x + 1] = sums[(size_t)y * stride + (size_t)x + 1] + row;
      }
    }
  }
}

vt_status vt_make_silhouettes(vt_context *context, const vt_views *views, int factor, int threshold,
                              vt_silhouettes *out) {
  size_t count = (size_t)views->count;
  *out = (vt_silhouettes){.count = views->count, .factor = factor, .votes = 1};
  int tenth = views->count / 10;
  out->least_seen = views->count < 3 ? views->count : tenth > 3 ? tenth : 3;
  out->cameras = VT_NEW(context, vt_camera, count);
  out->sums = VT_NEW(context, uint32_t *, count);
  vt_status status = out->cameras && out->sums ? VT_OK : VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && !status; i++) {
    vt_camera c = views->items[i].camera;
    c.fx /= factor, c.fy /= factor, c.cx /= factor, c.cy /= factor;
    c.width = (c.width + factor - 1) / factor;
    c.height = (c.height + factor - 1) / factor;
    out->cameras[i] = c;
    out->sums[i] = VT_NEW(context, uint32_t, (size_t)(c.width + 1) * (size_t)(c.height + 1));
    if (!out->sums[i]) status = VT_OUT_OF_MEMORY;
  }
  if (!status) status = vt_parallel(context, count, 1, sum_silhouettes, &(silhouette_job){views, out, threshold});
  if (status) vt_free_silhouettes(context, out);
  return status;
}

void vt_free_silhouettes(vt_context *context, vt_silhouettes *s) {
  for (int i = 0; i < s->count && s->sums; i++) vt_free(context, s->sums[i]);
  vt_free(context, s->sums);
  vt_free(context, s->cameras);
  *s = (vt_silhouettes){0};
}

typedef enum sight { OUTSIDE, CUT, EMPTY, MIXED, FULL } sight;

typedef struct rectangle { float left, top, right, bottom; } rectangle; // pixels

static sight look_at_rectangle(const vt_camera *c, const uint32_t *sums, rectangle f) {
  float width = (float)c->width, height = (float)c->height;
  if (!(f.right > 0 && f.bottom > 0 && f.left < width && f.top < height)) return OUTSIDE;
  if (f.left < 0 || f.top < 0 || f.right > width || f.bottom > height) return CUT;
  int x0 = (int)f.left - 1, y0 = (int)f.top - 1, x1 = (int)f.right + 2, y1 = (int)f.bottom + 2;
  if (x0 < 0) x0 = 0;
  if (y0 < 0) y0 = 0;
  if (x1 > c->width) x1 = c->width;
  if (y1 > c->height) y1 = c->height;
  size_t stride = (size_t)c->width + 1;
  const uint32_t *high = sums + (size_t)y0 * stride, *low = sums + (size_t)y1 * stride;
  uint32_t filled = low[x1] - high[x1] - low[x0] + high[x0];
  return !filled ? EMPTY : filled == (uint32_t)(x1 - x0) * (uint32_t)(y1 - y0) ? FULL : MIXED;
}

#define RUN_CELLS 2048
#define FIRST_BLOCK 8 // cells along an edge of the blocks that are asked about first

typedef struct carve_job {
  const vt_silhouettes *silhouettes;
  const vt_octree *octree;
  int level, stride; // stride: the order of views jumps around, so that an empty cell is found out early
  uint8_t *keep;
} carve_job;

// What one run of cells has been told so far.
typedef struct run {
  const carve_job *job;
  const vt_camera *camera;
  const uint32_t *sums;
  vt_vec3 corner;           // of the cell (0, 0, 0), world
  double edge;              // of a cell
  size_t first;             // cell of votes[0]
  int waiting_count;        // cells that are asked about one by one
  uint32_t waiting[RUN_CELLS];
  uint16_t votes[RUN_CELLS], seen[RUN_CELLS];
} run;

static void note(run *r, size_t cell, sight what) {
  r->votes[cell - r->first] = (uint16_t)(r->votes[cell - r->first] + (what == EMPTY));
  r->seen[cell - r->first] = (uint16_t)(r->seen[cell - r->first] + (what != OUTSIDE));
}

static sight look_at_block(const run *r, const int at[3], int size) {
  double half = 0.5 * size * r->edge;
  vt_vec3 offset = vt_v3(at[0] * r->edge + half, at[1] * r->edge + half, at[2] * r->edge + half);
  vt_footprint f = vt_footprint_of(r->camera, vt_add(r->corner, offset), half);
  if (f.kind != VT_IN_FRONT) return f.kind == VT_BEHIND ? OUTSIDE : CUT;
  return look_at_rectangle(r->camera, r->sums, (rectangle){(float)f.left, (float)f.top, (float)f.right, (float)f.bottom});
}

// The footprints (footprint.c) of many cells of one edge, in float: two pixels in ten thousand are its error where the
// rectangle is grown by a whole one. Camera coordinates come from the run's first cell, so that nothing large cancels.
static void ask_waiting(run *r) {
  enum { AT_ONCE = 64 };
  const vt_level *cells = &r->job->octree->levels[r->job->level];
  const vt_camera *c = r->camera;
  const double *m = c->rotation.m;
  double e = r->edge;
  int x0 = cells->x[r->first], y0 = cells->y[r->first], z0 = cells->z[r->first];
  vt_vec3 p = vt_to_camera(c, vt_add(r->corner, vt_v3((x0 + 0.5) * e, (y0 + 0.5) * e, (z0 + 0.5) * e)));
  float base[3] = {(float)p.x, (float)p.y, (float)p.z}, axes[9], half[3], fx = (float)c->fx, fy = (float)c->fy,
        cx = (float)c->cx, cy = (float)c->cy;
  for (int i = 0; i < 9; i++) axes[i] = (float)(m[i] * e);
  for (int i = 0; i < 3; i++) half[i] = 0.5f * (fabsf(axes[3 * i]) + fabsf(axes[3 * i + 1]) + fabsf(axes[3 * i + 2]));
  for (int done = 0; done < r->waiting_count; done += AT_ONCE) {
    float x[AT_ONCE] = {0}, y[AT_ONCE] = {0}, z[AT_ONCE] = {0}, depth[AT_ONCE];
    rectangle f[AT_ONCE];
    int count = r->waiting_count - done < AT_ONCE ? r->waiting_count - done : AT_ONCE;
    for (int k = 0; k < count; k++) {
      uint32_t cell = r->waiting[done + k];
      x[k] = (float)(cells->x[cell] - x0), y[k] = (float)(cells->y[cell] - y0), z[k] = (float)(cells->z[cell] - z0);
    }
    for (int k = 0; k < AT_ONCE; k++) {
      float px = base[0] + axes[0] * x[k] + axes[1] * y[k] + axes[2] * z[k];
      float py = base[1] + axes[3] * x[k] + axes[4] * y[k] + axes[5] * z[k];
      float pz = base[2] + axes[6] * x[k] + axes[7] * y[k] + axes[8] * z[k];
      float inverse = 1 / pz, nearest = 1 / (pz - half[2]), shear = half[2] * inverse;
      float u = fx * px * inverse + cx, v = fy * py * inverse + cy;
      float ru = fx * (half[0] + fabsf(px) * shear) * nearest, rv = fy * (half[1] + fabsf(py) * shear) * nearest;
      depth[k] = pz;
      f[k] = (rectangle){u - ru, v - rv, u + ru, v + rv};
    }
    for (int k = 0; k < count; k++)
      note(r, r->waiting[done + k], depth[k] + half[2] <= 0   ? OUTSIDE
                                    : depth[k] - half[2] <= 0 ? CUT
                                                              : look_at_rectangle(c, r->sums, f[k]));
  }
  r->waiting_count = 0;
}

// Asks about the cells [begin, end), which lie in one block of size^3 cells, or in several.
static void ask(run *r, size_t begin, size_t end, int size) {
  const vt_level *cells = &r->job->octree->levels[r->job->level];
  uint16_t most = (uint16_t)r->job->silhouettes->votes;
  while (begin < end) {
    int x = cells->x[begin], y = cells->y[begin], z = cells->z[begin];
    int at[3] = {x & -size, y & -size, z & -size}; // a power of two
    size_t last = begin + 1;
    bool open = r->votes[begin - r->first] < most;
    for (; last < end && ((cells->x[last] ^ x) | (cells->y[last] ^ y) | (cells->z[last] ^ z)) < size; last++)
      open = open || r->votes[last - r->first] < most;
    sight what = !open ? OUTSIDE : size > 1 ? look_at_block(r, at, size) : MIXED;
    if (size > 1 && (what == CUT || what == MIXED))
      ask(r, begin, last, size / 2);
    else if (open && size == 1)
      r->waiting[r->waiting_count++] = (uint32_t)begin;
    else
      for (size_t i = begin; i < last; i++) note(r, i, what);
    begin = last;
  }
}

static void carve_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  carve_job *job = user;
  const vt_silhouettes *s = job->silhouettes;
  run r = {.job = job, .corner = job->octree->origin, .edge = vt_cell_edge(job->octree, job->level), .first = begin};
  for (int i = 0, view = 0; i < s->count; i++, view = (view + job->stride) % s->count) {
    r.camera = &s->cameras[view];
    r.sums = s->sums[view];
    ask(&r, begin, end, job->octree->branching == 2 ? FIRST_BLOCK : 1);
    ask_waiting(&r);
  }
  for (size_t cell = begin; cell < end; cell++)
    job->keep[cell] = r.votes[cell - begin] < s->votes && r.seen[cell - begin] >= s->least_seen;
}

static int greatest_common_divisor(int a, int b) { return b ? greatest_common_divisor(b, a % b) : a; }

vt_status vt_carve(vt_context *context, const vt_silhouettes *silhouettes, const vt_octree *octree, int level,
                   uint8_t *keep) {
  int stride = (int)(0.382 * silhouettes->count) + 1;
  while (greatest_common_divisor(stride, silhouettes->count) != 1) stride++;
  return vt_parallel(context, octree->levels[level].cell_count, RUN_CELLS, carve_some,
                     &(carve_job){silhouettes, octree, level, stride, keep});
}
