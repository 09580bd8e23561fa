// truth.c - what the synthetic object really is
// SPDX-License-Identifier: BSD-3-Clause

#include "datasets-synthetic/phantom.h"

struct vt_truth {
  vt_phantom phantom;
};

vt_status vt_create_truth(vt_context *ctx, const vt_synthetic_desc *desc, vt_truth **out) {
  VT_ASSERT(desc->cookie == VT_COOKIE && vt_is_phantom(desc->kind));
  *out = VT_NEW(ctx, vt_truth, 1);
  if (!*out) return VT_OUT_OF_MEMORY;
  (*out)->phantom = vt_make_phantom(desc);
  return VT_OK;
}

void vt_destroy_truth(vt_context *ctx, vt_truth *truth) {
  vt_free(ctx, truth);
}

double vt_true_optical_depth(const vt_truth *truth, const vt_ray *ray, double near, double far, double radius) {
  (void)radius;
  return vt_phantom_depth(&truth->phantom, ray, near, far);
}

double vt_true_extinction(const vt_truth *truth, vt_vec3 point) {
  return vt_phantom_extinction(&truth->phantom, point);
}
