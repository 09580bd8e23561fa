// landmarks.h - the points that a calibration found on what stands before the cameras, and who sees them
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_LANDMARKS_H
#define VT_CAPTURE_LANDMARKS_H

#include "base/context.h"
#include "base/vector.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_landmark {
  vt_vec3 position;      // world
  float error;           // pixels, mean reprojection error; NAN unknown
  uint32_t first, count; // who sees it: seen_by[first .. first + count)
} vt_landmark;

typedef struct vt_landmarks {
  size_t count, seen_count;
  vt_landmark *items; // owned
  int *seen_by;       // photographs, by their place in the list they were read with; owned
  float (*pixels)[2]; // [seen_count] where, in the photograph that was calibrated, as its lens bends it; NAN unknown; owned
} vt_landmarks;

// Reads points3D and images (.bin if both are there, else .txt) of a COLMAP model. names[name_count], sorted by strcmp:
// the photographs; what sees a point and is not among them is passed over. A model without points has none.
// VT_BAD_INPUT naming the file.
vt_status vt_read_landmarks(vt_context *, const char *folder, bool binary, const char *const *names, int name_count,
                            vt_landmarks *out);
void vt_free_landmarks(vt_context *, vt_landmarks *);

#ifdef __cplusplus
}
#endif
#endif
