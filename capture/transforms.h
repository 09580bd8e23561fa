// transforms.h - reading transforms.json of NeRF, instant-ngp and nerfstudio
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_TRANSFORMS_H
#define VT_CAPTURE_TRANSFORMS_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

// Adds the frames of the file, in its order, to `photos`; names are relative to the file's folder. VT_BAD_INPUT naming
// the file and the frame.
vt_status vt_read_transforms(vt_context *, const char *path, vt_role role, vt_photos *photos);

#ifdef __cplusplus
}
#endif
#endif
