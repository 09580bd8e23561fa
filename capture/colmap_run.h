// colmap_run.h - calibration of photographs by the colmap program
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_COLMAP_RUN_H
#define VT_CAPTURE_COLMAP_RUN_H

#include "base/file.h"
#include "capture/capture.h"

#ifdef __cplusplus
extern "C" {
#endif

// Calibrates the photographs `names` (relative to image_folder) and leaves a model (cameras, images, points3D .bin) in
// workspace/sparse/0: the one with most images. The folder `workspace` must exist. VT_MISSING_PROGRAM, VT_TOO_FEW_VIEWS.
vt_status vt_run_colmap(vt_context *, const vt_capture_desc *, const char *image_folder, const vt_names *names,
                        const char *workspace);

#ifdef __cplusplus
}
#endif
#endif
