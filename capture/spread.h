// spread.h - colours known at some pixels, carried smoothly to all others
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_SPREAD_H
#define VT_CAPTURE_SPREAD_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

// RGB whose pixels are those of `rgb` where `known` is not 0, and elsewhere an average of the nearest known ones; all
// black if none is known. `known` is [height][width]. The caller frees `out`.
vt_status vt_spread_colours(vt_context *, const vt_image *rgb, const uint8_t *known, vt_image *out);

#ifdef __cplusplus
}
#endif
#endif
