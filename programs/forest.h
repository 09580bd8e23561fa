// forest.h - many trees in one picture, far to near
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_FOREST_H
#define VT_PROGRAMS_FOREST_H

#include "render/render.h"

// The scene: z is up, the ground is z = 0, any unit.
typedef struct vt_instance {
  int species;  // which tree
  double x, y;  // where its axis meets the ground
  double angle; // about the axis, radians
  double scale; // scene units per unit of the tree's own world, > 0
} vt_instance;

// A tree that is ready to be drawn, and the upright cylinders around its finest level.
typedef struct vt_species {
  const vt_tree *tree; // borrowed
  vt_renderer *renderer;
  vt_vec3 foot;           // tree's world: where the cylinder's axis meets its bottom
  vt_vec3 aside, back, up; // tree's world, orthonormal: the scene's x, y and z at angle 0
  double radius;          // tree's world, around all but 0.5 % of the opacity: no other tree may stand in it
  double reach, height;   // tree's world, around all cells
} vt_species;

typedef struct vt_forest {
  int species_count, instance_count;
  vt_species *species;    // owned
  vt_instance *instances; // owned
} vt_forest;

typedef struct vt_forest_report {
  int drawn, outside;  // instances
  uint64_t billboards; // of all that were drawn
  uint64_t pixels;     // of all their rectangles
} vt_forest_report;

// The trees must outlive the forest. VT_MISSING_PROGRAM if the back end is not there.
vt_status vt_begin_forest(vt_context *, const vt_tree *const *trees, int count, vt_backend, vt_forest *out);
void vt_free_forest(vt_context *, vt_forest *);
// `count` trees of all species in turn, in rows around the origin, turned, moved and scaled (0.8 to 1.2) by chance, as
// close as their cylinders allow; tree heights are brought to 1 before. Replaces those that stood there.
vt_status vt_plant_forest(vt_context *, vt_forest *, int count, uint64_t seed);
// Half the side of the square in which the planted trees stand.
double vt_forest_reach(const vt_forest *);
// A picture of the camera's size, premultiplied RGBA; the caller frees it. desc.level -1: each tree's by its distance.
vt_status vt_draw_forest(vt_context *, const vt_forest *, const vt_render_desc *, const vt_camera *, vt_fimage *out,
                         vt_forest_report *or_null);

#endif
