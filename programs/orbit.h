// orbit.h - cameras around a tree: where up is, where the photographs stood, how big the tree is
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_ORBIT_H
#define VT_PROGRAMS_ORBIT_H

#include "octree/octree.h"

typedef struct vt_orbit {
  vt_vec3 centre;                // world, of the cells
  double size;                   // world, diagonal of the box around the cells
  vt_vec3 up, ahead, aside;      // world, orthonormal; azimuth 0 is `ahead`, the first photograph's side; 90 is `aside`
  double elevation;              // degrees, mean of the photographs
  int first_width, first_height; // pixels of the first photograph
} vt_orbit;

vt_orbit vt_find_orbit(const vt_tree *);
// Degrees; `distance` in tree sizes from the centre, 0: so that the whole tree is in the picture.
vt_camera vt_orbit_camera(const vt_orbit *, double azimuth, double elevation, double distance, double fov, int width,
                          int height);
// The distance that 0 stands for.
double vt_fitting_distance(double fov, int width, int height);

#endif
