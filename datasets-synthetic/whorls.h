// whorls.h - the wood of a tree that makes a whorl of branches every year
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_WHORLS_H
#define VT_DATASETS_SYNTHETIC_WHORLS_H

#include "datasets-synthetic/grow.h"

// Fills an empty skeleton; radii are not set. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_grow_whorls(vt_context *, const vt_whorls *, vt_rng *, vt_skeleton *);

#endif
