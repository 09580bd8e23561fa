// probe_level.h - pictures of a solved level for context.probe
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_PROBE_LEVEL_H
#define VT_RECONSTRUCT_PROBE_LEVEL_H

#include "octree/octree.h"
#include "reconstruct/pyramid.h"

#ifdef __cplusplus
extern "C" {
#endif

// Where context.probe is set: the cells of `level` as the first photograph's camera sees them ("level_7_cells"), and
// where they differ from its matte ("level_7_residual": grey where they agree, light where the cells show too much). And what some photographs
// see of what that camera shows ("level_7_visibility_of_16_from_0": white, and red where it is hidden from photograph 16).
vt_status vt_probe_level(vt_context *, const vt_tree *, int level, const vt_reduced_views *);

#ifdef __cplusplus
}
#endif
#endif
