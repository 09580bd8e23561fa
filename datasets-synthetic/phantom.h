// phantom.h - extinction that has closed forms
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_PHANTOM_H
#define VT_DATASETS_SYNTHETIC_PHANTOM_H

#include "datasets-synthetic/synthetic.h"

enum { VT_BLOB_LIMIT = 9 };

typedef struct vt_blob {
  vt_vec3 centre;
  double deviation, peak; // world units; per world unit
} vt_blob;

typedef struct vt_phantom {
  vt_synthetic_kind kind;
  double extinction;    // ball and shell, per world unit
  double inner, radius; // ball and shell; of the blobs, beyond `radius` nothing shows in 8 bits
  int blob_count;
  vt_blob blobs[VT_BLOB_LIMIT];
} vt_phantom;

vt_phantom vt_make_phantom(const vt_synthetic_desc *);
double vt_phantom_extinction(const vt_phantom *, vt_vec3 point);
double vt_phantom_depth(const vt_phantom *, const vt_ray *, double near, double far);
void vt_phantom_colour(vt_vec3 point, double colour[3]); // sRGB-encoded, 0..1

// Photographs it from every view's camera into a new picture of the view. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_photograph_phantom(vt_context *, const vt_phantom *, int supersample, vt_views *);

#endif
