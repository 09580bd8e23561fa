// tree.h - a grown tree as a mesh
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_TREE_H
#define VT_DATASETS_SYNTHETIC_TREE_H

#include "datasets-synthetic/synthetic.h"

enum { VT_TREE_BARK, VT_TREE_TWIG, VT_TREE_LEAF, VT_TREE_MATERIALS }; // a tree's materials, thin ones last

static inline bool vt_is_grown(vt_synthetic_kind kind) { return kind <= VT_SYNTHETIC_WILLOW; }
// Grows it into an empty mesh, 2 units high and centred. leaf_count -1: as many as the kind has. VT_OUT_OF_MEMORY,
// VT_CANCELLED; the caller frees the mesh in any case.
vt_status vt_grow_tree(vt_context *, vt_synthetic_kind, uint32_t seed, int leaf_count, vt_mesh *);

#endif
