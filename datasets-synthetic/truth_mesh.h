// truth_mesh.h - what a mesh really is, asked by rays
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_TRUTH_MESH_H
#define VT_DATASETS_SYNTHETIC_TRUTH_MESH_H

#include "datasets-synthetic/synthetic.h"

typedef struct vt_mesh_truth vt_mesh_truth;

// The mesh is borrowed until it is destroyed. VT_MISSING_PROGRAM in builds without Embree, VT_BAD_INPUT for a vertex that is no
// number, VT_OUT_OF_MEMORY.
vt_status vt_create_mesh_truth(vt_context *, const vt_mesh *, vt_mesh_truth **out);
void vt_destroy_mesh_truth(vt_context *, vt_mesh_truth *); // NULL is allowed
// The meshes' half of vt_true_optical_depth and vt_true_view (synthetic.h). supersample 1..32.
double vt_mesh_optical_depth(const vt_mesh_truth *, const vt_ray *, double near, double far, double radius);
vt_status vt_mesh_view(vt_context *, const vt_mesh_truth *, const vt_camera *, int supersample, vt_fimage *alpha,
                       vt_fimage *depth_or_null);

#endif
