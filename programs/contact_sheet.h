// contact_sheet.h - many pictures in one, with a number under each
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_CONTACT_SHEET_H
#define VT_PROGRAMS_CONTACT_SHEET_H

#include "base/image.h"

typedef struct vt_sheet {
  vt_image image; // RGB; owned
  int columns, cell_width, cell_height, count;
  float background[3];
} vt_sheet;

// A picture of another size: area average when smaller, nearest pixels when larger. Premultiplied RGBA.
vt_status vt_resample_fimage(vt_context *, const vt_fimage *, int width, int height, vt_fimage *out);

// Room for `count` pictures in rows of `columns`; each is fitted into width x height.
vt_status vt_begin_sheet(vt_context *, int count, int columns, int width, int height, const float background[3],
                         vt_sheet *out);
// The next picture, with a label of digits, '.', '-' and the letters L and B below it.
vt_status vt_put_on_sheet(vt_context *, vt_sheet *, const vt_fimage *, const char *label);
// Writes the sheet as a picture.
vt_status vt_write_sheet(vt_context *, const vt_sheet *, const char *path);
void vt_free_sheet(vt_context *, vt_sheet *);
// Pictures of one height side by side over a background, as one file.
vt_status vt_write_row(vt_context *, const vt_fimage *const *pictures, int count, const float background[3],
                       const char *path);
// A label on an RGB picture, its top left corner at (x, y), `scale` pixels a dot.
void vt_draw_label(vt_image *rgb, const char *label, int x, int y, int scale);

#endif
