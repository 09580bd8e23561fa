// hang.h - fine twigs that hang
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_HANG_H
#define VT_DATASETS_SYNTHETIC_HANG_H

#include "datasets-synthetic/grow.h"

// Adds hanging twigs to a skeleton whose radii are set; those of the new nodes are not, and the old ones no longer hold.
// VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_hang_twigs(vt_context *, const vt_hanging *, vt_rng *, vt_skeleton *);

#endif
