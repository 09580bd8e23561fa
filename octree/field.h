// field.h - a ray and the views made ready for sampling a field, and the two instances of the loops over chords
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_FIELD_H
#define VT_OCTREE_FIELD_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VT_NEAREST_DEPTH 1e-6f // smallest depth before a view's camera, in cell edges

// In cell edges from the root's lowest corner, from where the ray enters the root.
typedef struct vt_field_ray {
  double origin[3], direction[3];
  double inverse[3]; // 1 / direction; huge where the ray does not move
  double ahead[3];   // where a cell's near plane is from its integers: 0, or 1 where the ray goes down
} vt_field_ray;

// A view that has something to say, on one ray: homogeneous pixel at distance t = a + t b.
typedef struct vt_field_sight {
  float a[3], b[3], weight;
  float width, height, left, top, right, bottom; // left, top: centre of the first pixel kept; right, bottom: from there to
                                                 // the centre of the last
  int32_t columns, rows;
  const uint8_t *codes;
  bool linear; // R is interpolated between pixels
} vt_field_sight;

// Both instances give the same bits; on another processor or compiler that of AVX2 is the plain one.
typedef void vt_field_sampler(const vt_level *, const vt_field_ray *, const vt_chord *, size_t count, vt_field_samples *);
typedef void vt_ratio_sampler(const vt_field_sight *, int sight_count, const float *along, size_t count, float *log_ratio);
vt_field_sampler vt_sample_field_plain, vt_sample_field_avx2;
vt_ratio_sampler vt_sample_ratios_plain, vt_sample_ratios_avx2;

vt_field_ray vt_enter_root(const vt_octree *, int level, const vt_ray *);
// The views on that ray; returns how many have something kept.
int vt_aim_sights(const vt_field_ray *, const vt_field_view *views, int view_count, vt_field_sight *out);

#ifdef __cplusplus
}
#endif
#endif
