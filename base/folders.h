// folders.h - folders that appear complete or not at all
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_FOLDERS_H
#define VT_BASE_FOLDERS_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

// Removes a folder and all that is in it; links are removed, not followed. Nothing happens if it is not there. False if
// something is left.
bool vt_remove_folder(vt_context *, const char *path);
// Makes a new folder "path.tmp.PID", to be filled and then renamed to `path`. VT_FAILED naming it. Free *out with
// vt_free.
vt_status vt_make_folder_beside(vt_context *, const char *path, char **out);
// Makes a new folder in $TMPDIR, or in /tmp. VT_FAILED naming it. Free *out with vt_free.
vt_status vt_make_scratch_folder(vt_context *, char **out);

#ifdef __cplusplus
}
#endif
#endif
