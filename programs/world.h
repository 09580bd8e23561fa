// world.h - up, scale and height of a tree: measured once, kept in its metadata, told by those who read it
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_WORLD_H
#define VT_PROGRAMS_WORLD_H

#include "base/json.h"
#include "base/views.h"
#include "octree/octree.h"
#include "programs/session.h"

// How far the tree reaches along a direction, world units. False if there is nothing in it, or no memory to find out.
bool vt_measure_reach(vt_context *, const vt_tree *, vt_vec3 direction, double *low, double *high);
// The scale from the tree's height, where that was said and the scale was not. By the tree before it is packed, whose depths are
// exact.
void vt_find_scale(vt_context *, const vt_tree *, vt_world *);
// The member "world" of the tree's metadata: up, height_units, metres_per_unit, height_metres, as far as they are known. A tree
// height that the views bring along gives the scale here, where the tree is there to be measured.
void vt_put_world(vt_json_writer *, const vt_tree *, const vt_world *);
// What the metadata says; zeros where it says nothing.
void vt_read_world(vt_context *, const vt_tree *, vt_world *out);
// A line about it, if there is something to say.
void vt_say_world(vt_session *, const vt_tree *);

#endif
