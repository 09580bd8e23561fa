// matte_peers.h - what others make of a photograph and a trimap (OpenCV), to compare mattes with
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BENCH_MATTE_PEERS_H
#define VT_BENCH_MATTE_PEERS_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

bool vt_has_matte_peers(void); // false: the calls below give VT_MISSING_PROGRAM
// rgb has 3 channels; trimap 1: 0 certain backdrop, 128 unknown, 255 certain tree; alpha, 1 channel, has the picture's
// size already.
// Guided filter (He, Sun, Tang, "Guided image filtering", ECCV 2010; section 4, "guided feathering"): a first alpha,
// one channel, filtered under the guidance of the photograph.
vt_status vt_peer_guided(vt_context *, const vt_image *rgb, const vt_image *start, int radius, double epsilon, vt_image *alpha);
// GrabCut (Rother, Kolmogorov, Blake, SIGGRAPH 2004), its iterated cut alone: alpha is 0 or 255.
vt_status vt_peer_grabcut(vt_context *, const vt_image *rgb, const vt_image *trimap, vt_image *alpha);
// Information flow (Aksoy, Aydin, Pollefeys, CVPR 2017) by OpenCV's contributed module alphamat.
vt_status vt_peer_information_flow(vt_context *, const vt_image *rgb, const vt_image *trimap, vt_image *alpha);

#ifdef __cplusplus
}
#endif
#endif
