// matte_peers_none.c - builds without OpenCV's contributed modules
// SPDX-License-Identifier: BSD-3-Clause
#include "bench/matte_peers.h"

static vt_status refuse(vt_context *context) {
  return vt_fail(context, VT_MISSING_PROGRAM, "matte peers: this build has no OpenCV; install its contrib modules");
}

bool vt_has_matte_peers(void) {
  return false;
}

vt_status vt_peer_guided(vt_context *context, const vt_image *rgb, const vt_image *start, int radius, double epsilon,
                         vt_image *alpha) {
  (void)rgb, (void)start, (void)radius, (void)epsilon, (void)alpha;
  return refuse(context);
}

vt_status vt_peer_grabcut(vt_context *context, const vt_image *rgb, const vt_image *trimap, vt_image *alpha) {
  (void)rgb, (void)trimap, (void)alpha;
  return refuse(context);
}

vt_status vt_peer_information_flow(vt_context *context, const vt_image *rgb, const vt_image *trimap, vt_image *alpha) {
  (void)rgb, (void)trimap, (void)alpha;
  return refuse(context);
}
