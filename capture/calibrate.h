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
// Runs colmap on the photographs, or takes what it found for the same photographs before from desc->cache.
vt_status vt_calibrate(vt_context *, const vt_capture_desc *, const char *folder, const vt_names *names,
                       vt_colmap_model *out, bool *from_cache);

#ifdef __cplusplus
}
#endif
#endif
