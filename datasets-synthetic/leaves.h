// leaves.h - the foliage
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_LEAVES_H
#define VT_DATASETS_SYNTHETIC_LEAVES_H

#include "datasets-synthetic/grow.h"
#include "datasets-synthetic/mesh.h"

vt_leaf_form vt_form_of_seed(const vt_foliage *, uint32_t seed);
// Adds `leaf_count` leaves, or clusters of needles, of that material to the twigs; fewer leaves are larger. VT_OUT_OF_MEMORY.
vt_status vt_add_leaves(vt_context *, const vt_foliage *, const vt_skeleton *, uint32_t seed, int leaf_count, int material,
                        vt_mesh *);

#endif
