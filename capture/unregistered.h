// unregistered.h - why photographs have no place, and what to do about it
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_UNREGISTERED_H
#define VT_CAPTURE_UNREGISTERED_H

#include "capture/colmap_program.h"

#ifdef __cplusplus
extern "C" {
#endif

// Writes folder/left-out.txt: a line "NAME<tab>WHY" for each photograph that is not in the model.
vt_status vt_explain_unregistered(vt_colmap *, const char *image_folder, const char *database, const char *model,
                                  const char *folder);
// The words for `name` in such a text, or NULL. Free with vt_free.
char *vt_find_explanation(vt_context *, const char *text, const char *name);

#ifdef __cplusplus
}
#endif
#endif
