// level_mass.h - coarse levels show as much of the tree as the next finer one
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_LEVEL_MASS_H
#define VT_RECONSTRUCT_LEVEL_MASS_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

// For every level but the finest, from fine to coarse: its field is made denser or thinner by one factor, at most twofold, so
// that pictures from between the photographs are as opaque on the whole as those of the next finer level. `blend`: views that
// a picture is drawn from.
// factors: [VT_MAX_LEVEL + 1] or NULL. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_match_level_mass(vt_context *, vt_tree *, int blend, float *factors);

// 1 - (1 - a)^g of a picture's alphas, summed; the factor in [1/2, 2] for which that is `wanted`.
double vt_mass_with_factor(const vt_fimage *, double g);
double vt_factor_for_mass(const vt_fimage *pictures, int count, double wanted);

#ifdef __cplusplus
}
#endif
#endif
