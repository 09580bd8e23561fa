// keep_lens.h - lenses as they were adjusted, taken from the cache, or adjusted and kept there
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_KEEP_LENS_H
#define VT_CAPTURE_KEEP_LENS_H

#include "capture/adjust_lens.h"

#ifdef __cplusplus
extern "C" {
#endif

// vt_adjust_lenses, unless the same was done before. cache: folder or NULL; nothing is written there unless `keep`.
vt_status vt_adjust_lenses_or_take(vt_context *, const char *cache_or_null, bool keep, vt_photos *, vt_lens_report *);

#ifdef __cplusplus
}
#endif
#endif
