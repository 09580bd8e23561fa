// strays.h - what a matte shows and the other photographs do not
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_STRAYS_H
#define VT_CAPTURE_STRAYS_H

#include "base/views.h"
#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_strays {
  bool tried;       // there were photographs enough, and a place that all look at
  bool refused;     // so much would have gone that mattes and cameras rather disagree: nothing was changed
  int photographs;  // from which something was taken
  double share;     // of all mattes' area that was taken, or would have been
} vt_strays;

// Clears the mattes of all views together, whatever their role, of what stands nowhere where the others show the tree.
// landmarks: of the same photographs in the same order. Alpha there becomes 0, and the colour that of the tree near by.
vt_status vt_clear_strays(vt_context *, const vt_landmarks *, vt_views *, vt_strays *out);

#ifdef __cplusplus
}
#endif
#endif
