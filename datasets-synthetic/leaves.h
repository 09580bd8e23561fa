// leaves.h - the foliage
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_LEAVES_H
#define VT_DATASETS_SYNTHETIC_LEAVES_H

#include "datasets-synthetic/grow.h"
#include "datasets-synthetic/mesh.h"

// Adds `leaf_count` leaves to the twigs; fewer leaves are larger. VT_OUT_OF_MEMORY.
vt_status vt_add_leaves(vt_context *, const vt_skeleton *, uint32_t seed, int leaf_count, vt_mesh *);

#endif
