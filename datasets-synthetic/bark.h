// bark.h - the surface of the wood
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_BARK_H
#define VT_DATASETS_SYNTHETIC_BARK_H

#include "datasets-synthetic/grow.h"
#include "datasets-synthetic/mesh.h"

// Adds trunk and branches as closed, tapered tubes and sets mesh->solid_count. VT_OUT_OF_MEMORY.
vt_status vt_add_bark(vt_context *, const vt_skeleton *, uint32_t seed, vt_mesh *);

#endif
