// matte.h - alpha from a plain backdrop or the sky, and colours without it
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_MATTE_H
#define VT_CAPTURE_MATTE_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

// Straight RGBA from an RGB picture before a plain backdrop, dark or light: alpha, and foreground colours where it is below 1.
// `name` is the photograph's, for messages. The caller frees `out_rgba`.
vt_status vt_matte_backdrop(vt_context *, const vt_image *rgb, const char *name, vt_image *out_rgba);
// The same before the sky: alpha is coverage in linear light. Where there is no sky all is tree.
vt_status vt_matte_sky(vt_context *, const vt_image *rgb, const char *name, vt_image *out_rgba);

// Turns a picture that is stored as the EXIF orientation `upright` says until the sky is above, and back. In place.
vt_status vt_turn_upright(vt_context *, int upright, bool back, vt_image *picture);

// What is certain before the matte is solved: one channel, 0 backdrop, 128 unknown, 255 tree. The caller frees `out`.
vt_status vt_cut_backdrop(vt_context *, const vt_image *rgb, vt_image *out);
vt_status vt_cut_sky(vt_context *, const vt_image *rgb, vt_image *out);

// Replaces the colours where alpha is below 1 by estimated foreground colours, so that no backdrop bleeds in. In place.
vt_status vt_estimate_foreground(vt_context *, vt_image *rgba);

#ifdef __cplusplus
}
#endif
#endif
