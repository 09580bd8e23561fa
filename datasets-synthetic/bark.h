// bark.h - the surface of the wood
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_BARK_H
#define VT_DATASETS_SYNTHETIC_BARK_H

#include "datasets-synthetic/grow.h"
#include "datasets-synthetic/mesh.h"

// Adds trunk and branches as closed, tapered tubes and sets mesh->solid_count. Thick wood has the material `bark_material`,
// thin wood the next one. VT_OUT_OF_MEMORY.
vt_status vt_add_bark(vt_context *, const vt_habit *, const vt_skeleton *, uint32_t seed, int bark_material, vt_mesh *);

#endif
