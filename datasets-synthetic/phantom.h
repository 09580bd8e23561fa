// phantom.h - extinction that has closed forms
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_PHANTOM_H
#define VT_DATASETS_SYNTHETIC_PHANTOM_H

#include "datasets-synthetic/synthetic.h"

enum { VT_BLOB_LIMIT = 9, VT_SOLID_LIMIT = 44 };

typedef struct vt_blob {
  vt_vec3 centre;
  double deviation, peak; // world units; per world unit
} vt_blob;

// A box or an ellipsoid of constant extinction: where M (x - centre) is within the unit cube or the unit ball. Where
// solids overlap their extinctions add; a negative one makes a hollow in what it lies in.
typedef struct vt_solid {
  vt_mat3 unit_from_world; // M
  vt_vec3 centre;
  double reach, extinction; // bounding radius; per world unit
  bool box;
} vt_solid;

typedef struct vt_phantom {
  vt_synthetic_kind kind;
  double extinction;    // ball and shell, per world unit
  double inner, radius; // ball and shell; of the others, beyond `radius` nothing shows in 8 bits
  int blob_count, solid_count;
  vt_blob blobs[VT_BLOB_LIMIT];
  vt_solid solids[VT_SOLID_LIMIT];
} vt_phantom;

vt_phantom vt_make_phantom(const vt_synthetic_desc *);
void vt_add_comb(const vt_synthetic_desc *, vt_phantom *);
void vt_add_crown(const vt_synthetic_desc *, vt_phantom *);
double vt_phantom_extinction(const vt_phantom *, vt_vec3 point);
double vt_phantom_depth(const vt_phantom *, const vt_ray *, double near, double far);
// The opacity between near and far, and the mean distance along the ray of what makes it: integral of s sigma T over
// alpha, INFINITY where alpha is 0.
void vt_phantom_first_moment(const vt_phantom *, const vt_ray *, double near, double far, double *alpha, double *mean);
// What of the phantom a ball can meet: the same phantom inside of it, with fewer parts.
void vt_phantom_near(const vt_phantom *, vt_vec3 centre, double radius, vt_phantom *out);
void vt_phantom_colour(vt_vec3 point, double colour[3]); // sRGB-encoded, 0..1

// ---- the phantom along one ray, when its depth is asked for more than once

typedef struct vt_phantom_lobe { // a blob: its depth up to s is half_depth (1 + erf((s - middle) width))
  double half_depth, middle, width;
} vt_phantom_lobe;
typedef struct vt_phantom_step { // from `at` on, extinction is larger by `change`
  double at, change;
} vt_phantom_step;

typedef struct vt_phantom_profile {
  vt_synthetic_kind kind;
  double extinction, middle, outer, inner; // ball and shell: between middle -+ outer, but not between middle -+ inner
  double radius;                           // nothing beyond middle -+ radius
  int lobe_count, step_count;
  vt_phantom_lobe lobes[VT_BLOB_LIMIT];
  vt_phantom_step steps[2 * VT_SOLID_LIMIT]; // in their order
} vt_phantom_profile;
void vt_make_profile(const vt_phantom *, const vt_ray *, vt_phantom_profile *out);
double vt_profile_depth(const vt_phantom_profile *, double near, double far);

// Photographs it from every view's camera into a new picture of the view. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_photograph_phantom(vt_context *, const vt_phantom *, int supersample, vt_views *);

#endif
