// grow.h - the skeleton of a tree
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_GROW_H
#define VT_DATASETS_SYNTHETIC_GROW_H

#include "base/context.h"
#include "base/rng.h"
#include "base/vector.h"
#include "datasets-synthetic/habits.h"

typedef struct vt_skeleton_node {
  vt_vec3 position; // world; the trunk stands on z = 0
  int parent;       // -1: the root, node 0. A parent comes before its children
  int child_count;
  double radius; // world
} vt_skeleton_node;

typedef struct vt_skeleton {
  int count, capacity;
  vt_skeleton_node *nodes; // owned
  double tip_radius;       // world; of the thinnest twigs
} vt_skeleton;

// Grows the wood of a tree about 2 units high. Another seed is another tree. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_grow_skeleton(vt_context *, const vt_habit *, uint32_t seed, vt_skeleton *out);
void vt_free_skeleton(vt_context *, vt_skeleton *);

// For those who add wood to it: a node behind all others (VT_OUT_OF_MEMORY), and what they draw from the seed.
vt_status vt_add_node(vt_context *, vt_skeleton *, vt_vec3 position, int parent);
vt_vec3 vt_random_in_ball(vt_rng *);
static inline double vt_draw(vt_rng *rng, vt_span span) { return vt_random_between(rng, span.low, span.high); }

#endif
