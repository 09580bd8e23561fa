// depth_ladder.h - optical depths as the codes of a packed .vtree
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_DEPTH_LADDER_H
#define VT_OCTREE_DEPTH_LADDER_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

// The content of an OPAC or COPA chunk for every `stride`-th float: low, then codes in one or two planes. NULL: out of
// memory. The caller frees it.
uint8_t *vt_code_depths(vt_context *, const float *depth, size_t stride, size_t count, size_t *size);
// Back again; `wide`: two planes. False if the bytes say what no writer does.
bool vt_decode_depths(const uint8_t *raw, size_t count, bool wide, float *depth, size_t stride);

#ifdef __cplusplus
}
#endif
#endif
