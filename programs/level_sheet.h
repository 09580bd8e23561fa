// level_sheet.h - the levels of a tree beside each other
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_LEVEL_SHEET_H
#define VT_PROGRAMS_LEVEL_SHEET_H

#include "programs/session.h"
#include "render/render.h"

// Draws the levels 3 to the finest (all, where that is coarser than 3) from one camera and writes them as one picture.
vt_status vt_write_level_sheet(vt_session *, const vt_tree *, const vt_render_desc *, vt_backend, const vt_camera *,
                               const float background[3], const char *path);

#endif
