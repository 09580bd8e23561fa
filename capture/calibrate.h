// calibrate.h - cameras for photographs alone, kept by the photographs' content
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_CALIBRATE_H
#define VT_CAPTURE_CALIBRATE_H

#include "base/file.h"
#include "capture/capture.h"
#include "capture/colmap_model.h"

#ifdef __cplusplus
extern "C" {
#endif

// Photographs below `folder`, without masks. *out is empty if there are none.
vt_status vt_list_photos(vt_context *, const char *folder, const char *masks_or_null, vt_names *out);
// What the search for the cameras found, and what it has to say.
typedef struct vt_calibration {
  vt_colmap_model model;
  char *left_out; // a line "NAME<tab>WHY" for each photograph without a place
  char *attempts; // a line for each attempt
  char *warnings; // a line for each thing that is wrong with the photographs
  bool from_cache;
} vt_calibration;
void vt_free_calibration(vt_context *, vt_calibration *);

// Runs colmap on the photographs, or takes what it found for the same photographs before from desc->cache. A run that was
// interrupted is gone on with.
vt_status vt_calibrate(vt_context *, const vt_capture_desc *, const char *folder, const vt_names *names,
                       vt_calibration *out);
// Only looks into the cache: *kept, and out is filled, or *begun by an interrupted run.
vt_status vt_find_calibration(vt_context *, const vt_capture_desc *, const char *folder, const vt_names *names,
                              vt_calibration *out, bool *kept, bool *begun);

#ifdef __cplusplus
}
#endif
#endif
