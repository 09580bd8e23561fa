// keep_views.h - developed views taken from the cache, or made and kept there
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_KEEP_VIEWS_H
#define VT_CAPTURE_KEEP_VIEWS_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

// vt_develop_photos, or what it made of the same photographs, masks, cameras and options before. Mattes must have been chosen.
vt_status vt_develop_or_take(vt_context *, const vt_capture_desc *, vt_photos *, vt_capture_report *, vt_views *out);
// Only looks: *kept in the cache; *cheap where they need only be read, so that nothing is kept.
vt_status vt_find_developed(vt_context *, const vt_capture_desc *, const vt_photos *, const vt_capture_report *, bool *kept,
                            bool *cheap);

#ifdef __cplusplus
}
#endif
#endif
