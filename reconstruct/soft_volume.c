// soft_volume.c - a coarse volume whose silhouettes have derivatives
// SPDX-License-Identifier: BSD-3-Clause
//
// Cameras move where a silhouette's slope tells them to, and the sharp edge of a cell has none. So the coarse level's corners are
// fitted to the mattes (fit.c, without view textures) and put on a dense grid: trilinear, continuous, with a slope of a cell's
// width. (Blurring cells that were solved as cells instead makes every silhouette stand outside its matte, by as much as the
// depth is clumped; focal lengths then take up 6 %.) Along a ray X = C + t d, in steps of one cell,
//
//   tau = int s(X) dt,   d tau = int grad s . dX dt,   alpha = 1 - exp(-tau)
//
// and every motion of a camera moves the points of its rays by some dX = a + t b (a, b of the ray, not of the point). So two
// vectors, int grad s dt and int t grad s dt, hold all derivatives of a pixel, with the depth of what it sees in them: twigs
// before and behind the trunk pull each with their own leverage, which an image gradient and one depth a pixel cannot say.
// (The gradient along the ray itself integrates to nothing.) What the chord gains where a ray turns is of second order.
//
// Dense, because steps of one length are then all it takes; level 7 is 8 MB. Blocks without anything in them are jumped over.

#include "reconstruct/soft_volume.h"
#include "reconstruct/run.h"

#include <string.h>

#define LEAST_DEPTH 1e-5f // of what counts as something
#define HIDDEN 12.0       // optical depth at which a ray ends

// ---- making it

static size_t index_of(const vt_soft_volume *v, int x, int y, int z) {
  return ((size_t)z * (size_t)v->cells + (size_t)y) * (size_t)v->cells + (size_t)x;
}

static vt_status mark_filled(vt_context *context, vt_soft_volume *v) {
  v->blocks = (v->cells + VT_SOFT_BLOCK - 1) / VT_SOFT_BLOCK;
  size_t b = (size_t)v->blocks;
  v->filled = VT_NEW(context, uint8_t, b * b * b);
  if (!v->filled) return VT_OUT_OF_MEMORY;
  for (int z = 0; z < v->cells; z++)
    for (int y = 0; y < v->cells; y++)
      for (int x = 0; x < v->cells; x++) {
        if (!(v->depth[index_of(v, x, y, z)] > LEAST_DEPTH)) continue;
        for (int i = 0; i < 8; i++) { // a cell counts for the points between it and its neighbours
          int at[3] = {(x - (i & 1)) / VT_SOFT_BLOCK, (y - (i >> 1 & 1)) / VT_SOFT_BLOCK, (z - (i >> 2)) / VT_SOFT_BLOCK};
          v->filled[((size_t)at[2] * b + (size_t)at[1]) * b + (size_t)at[0]] = 1;
        }
      }
  return VT_OK;
}

static vt_status soften(vt_context *context, const vt_octree *octree, const vt_soft_volume_desc *desc, vt_soft_volume *v) {
  const vt_level *level = &octree->levels[desc->level];
  const int rim = 1;
  v->edge = vt_cell_edge(octree, desc->level);
  v->cells = level->axis_cells + 1 + 2 * rim;
  double shift = -rim * v->edge;
  v->origin = vt_add(octree->origin, vt_v3(shift, shift, shift));
  v->depth = VT_NEW(context, float, (size_t)v->cells * (size_t)v->cells * (size_t)v->cells);
  if (!v->depth) return VT_OUT_OF_MEMORY;
  for (uint32_t i = 0; i < level->cell_count; i++) {
    for (int c = 0; c < 8; c++) {
      float s = level->corner_values[4 * (size_t)level->corner_of[8 * (size_t)i + (size_t)c]];
      int x = level->x[i] + (c & 1), y = level->y[i] + (c >> 1 & 1), z = level->z[i] + (c >> 2);
      v->depth[index_of(v, x + rim, y + rim, z + rim)] = s < desc->densest ? s : desc->densest;
    }
  }
  return mark_filled(context, v);
}

vt_status vt_make_soft_volume(vt_context *context, const vt_views *views, vt_vec3 origin, double edge,
                              const vt_soft_volume_desc *desc, vt_soft_volume *out) {
  VT_ASSERT(desc->level >= 0 && desc->level <= 8 && desc->votes >= 1);
  vt_reconstruct_desc how = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_DRAFT);
  vt_reconstruct_report report = {0};
  vt_tree tree = {.octree = {.origin = origin, .edge = edge}};
  how.hull_votes = desc->votes;
  *out = (vt_soft_volume){0};
  vt_run r = {context, &how, vt_recipe_of(&how), views, &tree, &report, .start = vt_seconds(), .leaf = desc->level};
  r.bare_epochs = 2;
  vt_status status = vt_solve_opacity_levels(&r);
  bool there = !status && tree.octree.level_count > desc->level && tree.octree.levels[desc->level].cell_count > 0;
  if (!status && !there) status = vt_fail(context, VT_BAD_INPUT, "mattes: nothing is left of the tree; check the masks");
  if (!status) status = soften(context, &tree.octree, desc, out);
  vt_free_tree(context, &tree);
  if (status) vt_free_soft_volume(context, out);
  return status;
}

void vt_free_soft_volume(vt_context *context, vt_soft_volume *v) {
  vt_free(context, v->depth);
  vt_free(context, v->filled);
  *v = (vt_soft_volume){0};
}

// ---- rays

static inline double mix(double a, double b, double share) { return a + (b - a) * share; }

// Depth at a point of the grid, and what it grows by along each axis.
static double sample(const vt_soft_volume *v, const double p[3], double gradient[3]) {
  int x = (int)p[0], y = (int)p[1], z = (int)p[2];
  double u = p[0] - x, w = p[1] - y, q = p[2] - z;
  size_t n = (size_t)v->cells, i = index_of(v, x, y, z);
  const float *a = v->depth + i, *b = a + n, *c = a + n * n, *d = c + n;
  double near0 = mix((double)a[0], (double)a[1], u), near1 = mix((double)b[0], (double)b[1], u);
  double far0 = mix((double)c[0], (double)c[1], u), far1 = mix((double)d[0], (double)d[1], u);
  double near = mix(near0, near1, w), far = mix(far0, far1, w);
  gradient[0] = mix(mix((double)(a[1] - a[0]), (double)(b[1] - b[0]), w), mix((double)(c[1] - c[0]), (double)(d[1] - d[0]), w), q);
  gradient[1] = mix(near1 - near0, far1 - far0, q);
  gradient[2] = far - near;
  return mix(near, far, q);
}

// The part of a ray within the grid, in cells from its origin; false if there is none.
static bool clip(const vt_soft_volume *v, const double o[3], const double d[3], double *from, double *to) {
  double low = 0, high = 1e30, top = v->cells - 1 - 1e-9;
  for (int a = 0; a < 3; a++) {
    if (fabs(d[a]) < 1e-12) {
      if (o[a] < 0 || o[a] > top) return false;
      continue;
    }
    double s = (0 - o[a]) / d[a], t = (top - o[a]) / d[a];
    low = fmax(low, fmin(s, t)), high = fmin(high, fmax(s, t));
  }
  *from = low, *to = high;
  return low < high;
}

// Steps from `t` on that stay within the block of p, at least one.
static double steps_in_block(const double p[3], const double d[3]) {
  double least = 1e9;
  for (int a = 0; a < 3; a++) {
    double low = floor(p[a] / VT_SOFT_BLOCK) * VT_SOFT_BLOCK, plane = d[a] > 0 ? low + VT_SOFT_BLOCK : low;
    if (fabs(d[a]) > 1e-12) least = fmin(least, (plane - p[a]) / d[a]);
  }
  return fmax(1, ceil(least));
}

double vt_trace_soft_ray(const vt_soft_volume *v, const vt_ray *ray, double sum[6]) {
  double scale = 1 / v->edge, from, to, tau = 0;
  vt_vec3 start = vt_scale(vt_sub(ray->origin, v->origin), scale);
  double o[3] = {start.x, start.y, start.z}, d[3] = {ray->direction.x, ray->direction.y, ray->direction.z};
  if (sum) memset(sum, 0, 6 * sizeof *sum);
  if (!isfinite(o[0] + o[1] + o[2] + d[0] + d[1] + d[2]) || !clip(v, o, d, &from, &to)) return 0;
  size_t b = (size_t)v->blocks;
  for (double t = from + 0.5; t < to && tau < HIDDEN; t += 1) {
    double p[3], g[3];
    for (int a = 0; a < 3; a++) p[a] = fmin(fmax(o[a] + t * d[a], 0), v->cells - 1 - 1e-9);
    size_t block = ((size_t)(p[2] / VT_SOFT_BLOCK) * b + (size_t)(p[1] / VT_SOFT_BLOCK)) * b + (size_t)(p[0] / VT_SOFT_BLOCK);
    if (!v->filled[block]) {
      t += steps_in_block(p, d) - 1;
      continue;
    }
    tau += sample(v, p, g);
    for (int a = 0; a < 3 && sum; a++) sum[a] += g[a], sum[3 + a] += t * g[a];
  }
  for (int a = 0; a < 3 && sum; a++) sum[a] *= scale; // int t g: a world length by a world length
  return tau;
}

typedef struct draw_job {
  const vt_soft_volume *volume;
  const vt_camera *camera;
  float *alpha;
} draw_job;

static void draw_rows(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  const draw_job *job = user;
  for (size_t y = begin; y < end; y++)
    for (int x = 0; x < job->camera->width; x++) {
      vt_ray ray = vt_camera_ray(job->camera, x + 0.5, (double)y + 0.5);
      job->alpha[y * (size_t)job->camera->width + (size_t)x] = (float)(1 - exp(-vt_trace_soft_ray(job->volume, &ray, NULL)));
    }
}

vt_status vt_draw_soft_volume(vt_context *context, const vt_soft_volume *volume, const vt_camera *camera, float *alpha) {
  return vt_parallel(context, (size_t)camera->height, 8, draw_rows, &(draw_job){volume, camera, alpha});
}
