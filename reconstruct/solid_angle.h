// solid_angle.h - how much each photograph counts
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_SOLID_ANGLE_H
#define VT_RECONSTRUCT_SOLID_ANGLE_H

#include "octree/octree.h"
#include "reconstruct/pyramid.h"

#ifdef __cplusplus
extern "C" {
#endif

// weight[views], mean 1: the solid angle whose lines are nearer to the view's own line (to the middle of the root cube) than
// to any other view's, within a quarter and four times the mean. by_solid_angle false, or fewer than 3 or more than 1024
// views: all 1.
void vt_weigh_views(const vt_octree *, const vt_reduced_views *, bool by_solid_angle, float *weight);

#ifdef __cplusplus
}
#endif
#endif
