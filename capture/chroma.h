// chroma.h - the detail of colour that a JPEG does not keep, from that of lightness
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_CHROMA_H
#define VT_CAPTURE_CHROMA_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

// How far colours of an RGB picture are smeared beside its lightness: 0 not at all, 1 by a pixel, 2 by two.
int vt_measure_smear(const vt_image *rgb);
// The picture with colour edges as sharp as those of lightness; a copy where smear is 0. The caller frees `out`.
vt_status vt_sharpen_chroma(vt_context *, const vt_image *rgb, int smear, vt_image *out);

#ifdef __cplusplus
}
#endif
#endif
