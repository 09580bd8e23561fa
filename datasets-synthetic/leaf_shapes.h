// leaf_shapes.h - outlines of leaves, and one leaf or cluster of needles as triangles
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_LEAF_SHAPES_H
#define VT_DATASETS_SYNTHETIC_LEAF_SHAPES_H

#include "base/rng.h"
#include "datasets-synthetic/habits.h"
#include "datasets-synthetic/mesh.h"

enum { VT_OUTLINE_LIMIT = 12, VT_NEEDLE_COUNT = 16 };

typedef struct vt_leaf_shape { // in units of the leaf's length; x along the midrib, y across
  double centre;               // x of the fan's hub: sees the whole outline
  int count;
  double outline[VT_OUTLINE_LIMIT][2]; // the half with y >= 0, from the stalk to the tip, both on the midrib
  double vein_rise;                    // side veins: how far along the midrib they move for each step across
  int vein_count;                      // of each half
} vt_leaf_shape;

typedef struct vt_leaf_frame {
  vt_vec3 origin, along, across, up;
  double length;             // world
  double fold, droop, stalk; // in units of the length
} vt_leaf_frame;

const vt_leaf_shape *vt_shape_of(vt_leaf_form); // not for needles (asserted)
double vt_half_width(const vt_leaf_shape *);    // largest y of the outline
double vt_leaf_area(vt_leaf_form);              // of a leaf (or a cluster's needles) of length 1, one side
// Width of a leaf of length 1 at x is that of its outline: half of it, 0 outside.
double vt_outline_at(const vt_leaf_shape *, double x);

// What one leaf takes; the caller has reserved it.
void vt_count_leaf(vt_leaf_form, bool stalked, size_t *vertices, size_t *triangles);
// Texture coordinates: v from stalk (0) to tip (1), u across, the midrib at 0.5.
void vt_add_leaf(vt_mesh *, const vt_leaf_shape *, const vt_leaf_frame *, bool stalked, vt_vec3 colour);
// Needles spread like a brush around the frame's `along`; u across each, v from foot to tip.
void vt_add_needles(vt_mesh *, const vt_leaf_frame *, vt_vec3 colour, vt_rng *);

#endif
