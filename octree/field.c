// field.c - opacity, colour and matte ratio in the middle of each of a ray's chords
// SPDX-License-Identifier: BSD-3-Clause
//
// A chord is short against what a photograph resolves, so one point stands for it: its middle. There the eight corners'
// values are interpolated [Kajiya & Von Herzen 1984], or the cell's constant is taken, and the chosen views' textures are
// looked up where they see that point. In cell edges from the root's lowest corner the ray is O + t D, t counted from
// where it enters the root; a chord begins at t = max_a (near plane_a - O_a) / D_a, so the middle needs nothing but the cell's
// integers. In doubles: a ray nearly parallel to a plane meets it as much less exactly as 1 / D_a is large, and a float's last
// bit would shift chords by whole cells. In view v the point stands at the homogeneous pixel A + t B, A and B made once per ray.
//
// field_plain.c and field_avx2.c loop over the chords. Nothing is fused, and both give the same bits.

#include "octree/field.h"

#include <math.h>

#define STILL 1e-12 // a direction's part below which a ray does not move along an axis
#define FAR_AWAY 1e30

vt_field_ray vt_enter_root(const vt_octree *octree, int level, const vt_ray *ray) {
  double n = octree->levels[level].axis_cells, scale = n / octree->edge, near = 0;
  vt_vec3 o = vt_scale(vt_sub(ray->origin, octree->origin), scale);
  vt_field_ray r = {.origin = {o.x, o.y, o.z}, .direction = {ray->direction.x, ray->direction.y, ray->direction.z}};
  for (int a = 0; a < 3; a++) {
    bool still = fabs(r.direction[a]) <= STILL;
    r.direction[a] = still ? 0 : r.direction[a];
    r.inverse[a] = still ? FAR_AWAY : 1 / r.direction[a];
    r.ahead[a] = r.direction[a] < 0;
    double enter = still ? 0 : (r.ahead[a] * n - r.origin[a]) * r.inverse[a];
    near = enter > near ? enter : near;
  }
  for (int a = 0; a < 3; a++) r.origin[a] += near * r.direction[a];
  return r;
}

void vt_sample_field(const vt_octree *octree, int level, const vt_ray *ray, const vt_chord *chords, size_t count,
                     vt_field_samples *out) {
  vt_field_ray entered = vt_enter_root(octree, level, ray);
  vt_field_sampler *sample = vt_best_walk_path() >= VT_WALK_AVX2 ? vt_sample_field_avx2 : vt_sample_field_plain;
  sample(&octree->levels[level], &entered, chords, count, out);
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

int vt_aim_sights(const vt_field_ray *ray, const vt_field_view *views, int view_count, vt_field_sight *out) {
  int count = 0;
  for (int v = 0; v < view_count; v++) {
    const vt_view_texture *t = views[v].texture;
    if (t->columns <= 0 || t->rows <= 0) continue; // has nothing to say
    vt_field_sight *s = &out[count++];
    *s = (vt_field_sight){.weight = views[v].weight, .width = (float)t->width, .height = (float)t->height,
                          .left = (float)t->left + 0.5f, .top = (float)t->top + 0.5f, .right = (float)(t->columns - 1),
                          .bottom = (float)(t->rows - 1), .columns = t->columns, .rows = t->rows, .codes = t->codes,
                          .linear = t->linear};
    for (int i = 0; i < 3; i++) {
      const double *m = views[v].m + 3 * i, *o = ray->origin, *d = ray->direction;
      s->a[i] = (float)(m[0] * o[0] + m[1] * o[1] + m[2] * o[2] + views[v].b[i]);
      s->b[i] = (float)(m[0] * d[0] + m[1] * d[1] + m[2] * d[2]);
    }
  }
  return count;
}

void vt_sample_ratios(const vt_octree *octree, int level, const vt_ray *ray, const vt_field_view *views, int view_count,
                      size_t count, vt_field_samples *out) {
  VT_ASSERT(view_count >= 0 && view_count <= VT_MAX_BLEND_VIEWS);
  vt_field_ray entered = vt_enter_root(octree, level, ray);
  vt_field_sight sights[VT_MAX_BLEND_VIEWS];
  int sight_count = vt_aim_sights(&entered, views, view_count, sights);
  vt_ratio_sampler *sample = vt_best_walk_path() >= VT_WALK_AVX2 ? vt_sample_ratios_avx2 : vt_sample_ratios_plain;
  sample(sights, sight_count, out->along, count, out->log_ratio);
}
