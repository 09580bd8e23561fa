// field.c - opacity, colour and matte ratio in the middle of each of a ray's chords
// SPDX-License-Identifier: BSD-3-Clause
//
// A chord is short against what a photograph resolves, so one point stands for it: its middle. There the eight corners'
// values are interpolated [Kajiya & Von Herzen 1984], or the cell's constant is taken, and the chosen views' textures are
// looked up where they see that point. In cell edges from the root's lowest corner the ray is O + t D, t counted from
// where it enters the root; a chord begins at t = max_a (near plane_a - O_a) / D_a, so the middle needs nothing but the cell's
// integers. In view v the point stands at the homogeneous pixel A + t B, A and B made once per ray in double.
//
// The loops run over the chords of one ray with nothing between them, so a compiler can take them several at a time;
// nothing is fused, and the bits are the same however many it takes.

#include "octree/octree.h"

#include <math.h>

#define STILL 1e-12     // a direction's part below which a ray does not move along an axis
#define FAR_AWAY 1e30f
#define NEAREST 1e-6f   // smallest depth before a camera, in cell edges

typedef float float4 __attribute__((vector_size(16), aligned(4)));

typedef struct entered_ray { // in cell edges from the root's lowest corner
  double origin[3], direction[3];
} entered_ray;

static entered_ray enter_root(const vt_octree *octree, int level, const vt_ray *ray) {
  double scale = octree->levels[level].axis_cells / octree->edge, n = octree->levels[level].axis_cells, near = 0;
  vt_vec3 o = vt_scale(vt_sub(ray->origin, octree->origin), scale);
  entered_ray r = {{o.x, o.y, o.z}, {ray->direction.x, ray->direction.y, ray->direction.z}};
  for (int a = 0; a < 3; a++) {
    if (fabs(r.direction[a]) <= STILL) continue;
    double enter = ((r.direction[a] > 0 ? 0 : n) - r.origin[a]) / r.direction[a];
    if (enter > near) near = enter;
  }
  for (int a = 0; a < 3; a++) r.origin[a] += near * r.direction[a];
  return r;
}

static inline float larger(float a, float b) { return a > b ? a : b; }

static void find_middles(const vt_level *cells, const entered_ray *ray, const vt_chord *chords, size_t count,
                         vt_field_samples *out) {
  float o[3], d[3], inverse[3], ahead[3];
  for (int a = 0; a < 3; a++) {
    bool still = fabs(ray->direction[a]) <= STILL;
    o[a] = (float)ray->origin[a];
    d[a] = still ? 0 : (float)ray->direction[a];
    inverse[a] = still ? FAR_AWAY : (float)(1 / ray->direction[a]);
    ahead[a] = ray->direction[a] < 0 && !still ? 1 : 0; // the near plane is the cell's high one
  }
  for (size_t k = 0; k < count; k++) {
    size_t cell = chords[k].cell;
    float at[3] = {cells->x[cell], cells->y[cell], cells->z[cell]}, enter = 0;
    for (int a = 0; a < 3; a++) enter = larger(enter, (at[a] + ahead[a] - o[a]) * inverse[a]);
    float t = enter + 0.5f * chords[k].length;
    out->along[k] = t;
    for (int a = 0; a < 3; a++) {
      float inside = o[a] + t * d[a] - at[a];
      out->inside[k][a] = inside > 0 ? inside < 1 ? inside : 1 : 0;
    }
    out->inside[k][3] = 0;
  }
}

static inline float4 at_corner(const vt_level *cells, uint32_t corner) {
  return *(const float4 *)(const void *)(cells->corner_values + 4 * (size_t)corner);
}

static inline float4 mix(float4 a, float4 b, float share) { return a + (b - a) * share; }

static void interpolate(const vt_level *cells, const vt_chord *chords, size_t count, vt_field_samples *out) {
  for (size_t k = 0; k < count; k++) {
    const uint32_t *corner = cells->corner_of + 8 * (size_t)chords[k].cell;
    const float *f = out->inside[k];
    float4 x[4];
    for (int i = 0; i < 4; i++) x[i] = mix(at_corner(cells, corner[2 * i]), at_corner(cells, corner[2 * i + 1]), f[0]);
    *(float4 *)(void *)out->value[k] = mix(mix(x[0], x[1], f[1]), mix(x[2], x[3], f[1]), f[2]);
  }
}

void vt_sample_field(const vt_octree *octree, int level, const vt_ray *ray, const vt_chord *chords, size_t count,
                     vt_field_samples *out) {
  const vt_level *cells = &octree->levels[level];
  entered_ray entered = enter_root(octree, level, ray);
  find_middles(cells, &entered, chords, count, out);
  if (cells->corner_count) {
    interpolate(cells, chords, count, out);
    return;
  }
  for (size_t k = 0; k < count; k++) {
    size_t cell = chords[k].cell;
    out->value[k][0] = cells->optical_depth[cell];
    for (size_t c = 0; c < 3; c++) out->value[k][c + 1] = cells->colour[3 * cell + c];
  }
}

// ---- the views' textures

// K (R (origin + edge X) + t) / edge, in pixels of the reduced photograph
vt_field_view vt_aim_field_view(const vt_octree *octree, int level, const vt_camera *camera, int factor,
                                const vt_view_texture *texture, float weight) {
  double edge = vt_cell_edge(octree, level), fx = camera->fx / factor, fy = camera->fy / factor;
  double cx = camera->cx / factor, cy = camera->cy / factor;
  vt_vec3 c = vt_scale(vt_to_camera(camera, octree->origin), 1 / edge);
  const double *r = camera->rotation.m;
  vt_field_view out = {.texture = texture, .weight = weight, .b = {fx * c.x + cx * c.z, fy * c.y + cy * c.z, c.z}};
  for (int i = 0; i < 3; i++) {
    out.m[i] = fx * r[i] + cx * r[6 + i];
    out.m[3 + i] = fy * r[3 + i] + cy * r[6 + i];
    out.m[6 + i] = r[6 + i];
  }
  return out;
}

// Code between four pixels' centres, (x, y) in pixels of the reduced photograph.
static inline float code_at(const vt_view_texture *t, float x, float y) {
  float right = (float)(t->columns - 1), bottom = (float)(t->rows - 1);
  x -= (float)t->left + 0.5f, y -= (float)t->top + 0.5f;
  x = x > 0 ? x < right ? x : right : 0;
  y = y > 0 ? y < bottom ? y : bottom : 0;
  int column = (int)x, row = (int)y;
  float u = x - (float)column, v = y - (float)row;
  const uint8_t *p = t->codes + (size_t)row * (size_t)t->columns + (size_t)column;
  int next = column + 1 < t->columns, below = row + 1 < t->rows ? t->columns : 0;
  float above = (float)p[0] + u * (float)(p[next] - p[0]);
  float under = (float)p[below] + u * (float)(p[below + next] - p[below]);
  return above + v * (under - above);
}

void vt_sample_ratios(const vt_octree *octree, int level, const vt_ray *ray, const vt_field_view *views, int view_count,
                      size_t count, vt_field_samples *out) {
  entered_ray r = enter_root(octree, level, ray);
  float a[VT_MAX_BLEND_VIEWS][3], b[VT_MAX_BLEND_VIEWS][3];
  for (int v = 0; v < view_count; v++)
    for (int i = 0; i < 3; i++) {
      const double *m = views[v].m + 3 * i;
      a[v][i] = (float)(m[0] * r.origin[0] + m[1] * r.origin[1] + m[2] * r.origin[2] + views[v].b[i]);
      b[v][i] = (float)(m[0] * r.direction[0] + m[1] * r.direction[1] + m[2] * r.direction[2]);
    }
  for (size_t k = 0; k < count; k++) {
    float t = out->along[k], sum = 0, weights = 0;
    for (int v = 0; v < view_count; v++) {
      const vt_view_texture *texture = views[v].texture;
      if (!texture->columns) continue;
      float z = a[v][2] + t * b[v][2], inverse = 1 / (z > NEAREST ? z : NEAREST);
      float x = (a[v][0] + t * b[v][0]) * inverse, y = (a[v][1] + t * b[v][1]) * inverse;
      if (!(z > NEAREST && x >= 0 && y >= 0 && x <= (float)texture->width && y <= (float)texture->height)) continue;
      weights += views[v].weight;
      sum += views[v].weight * code_at(texture, x, y);
    }
    out->log_ratio[k] = weights > 0 ? VT_LEAST_LOG_RATIO + VT_LOG_RATIO_STEP * (sum / weights) : 0;
  }
}
