// scribbles.h - a user's strokes: this is the tree, this is not
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_SCRIBBLES_H
#define VT_CAPTURE_SCRIBBLES_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VT_SAID_NOTHING, VT_SAID_REST, VT_SAID_TREE };

// files[photos->count]: the picture of strokes of each photograph, or NULL; each to be freed. A file that fits no
// photograph is said in the log. VT_BAD_INPUT if none fits one.
vt_status vt_find_scribbles(vt_context *, const char *folder, const vt_photos *photos, char **files);
// said[height][width]: VT_SAID_... of the photograph reduced to that size. *tree, *rest: pixels of each. VT_BAD_INPUT
// naming the file where it has another shape than its photograph or no stroke.
vt_status vt_read_scribble(vt_context *, const char *file, const vt_photo *, int width, int height, uint8_t *said,
                           size_t *tree, size_t *rest);

#ifdef __cplusplus
}
#endif
#endif
