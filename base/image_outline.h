// image_outline.h - whether a rendered tree keeps to the photograph's matte, and hangs together as it does there
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_IMAGE_OUTLINE_H
#define VT_BASE_IMAGE_OUTLINE_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

// What means over a whole picture do not show: fog beside the tree, and a stem that is broken.
typedef struct vt_outline {
  double psnr_inside; // dB over pixels with true alpha >= 0.5, both over the background, sRGB-encoded; NAN if there are
                      // none
  double near;        // share of the rendered alpha within 3 pixels of true alpha > 0.02; 1 where nothing was rendered
  double reach; // diagonal of the largest connected piece (alpha >= 0.25, eight neighbours) over the truth's; 1: it is
                // as long, below: it is broken; NAN if the truth has none
} vt_outline;

// `result` is premultiplied RGBA, `truth` straight RGBA, of one size (asserted). VT_OUT_OF_MEMORY.
vt_status vt_measure_outline(vt_context *, const vt_fimage *result, const vt_image *truth, const float background[3],
                             vt_outline *out);

#ifdef __cplusplus
}
#endif
#endif
