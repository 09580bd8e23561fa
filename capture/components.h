// components.h - connected parts of a picture, and what is within reach of them
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_COMPONENTS_H
#define VT_CAPTURE_COMPONENTS_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VT_PART_NONE = 0, VT_PART_DOUBTFUL = 1, VT_PART_SURE = 2 };

// Two thresholds, as Canny's: a pixel of strength[height][width] from `doubtful` on is kept where it hangs, by its eight
// neighbours, on at least `few` pixels from `sure` on, and where the mean strength of its part is at least `weak` times that of
// the largest part (0: any). parts[height][width]: VT_PART_...; overwritten.
vt_status vt_find_parts(vt_context *, int width, int height, const uint8_t *strength, uint8_t doubtful, uint8_t sure,
                        size_t few, double weak, uint8_t *parts);
// mask[height][width] becomes 1 where it is not 0 within `radius` (a square), else 0. scratch: of the same size.
void vt_dilate(int width, int height, int radius, uint8_t *mask, uint8_t *scratch);

#ifdef __cplusplus
}
#endif
#endif
