// window.h - a window that shows pictures and tells what the user does (SDL2; window_none.c has none)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_WINDOW_H
#define VT_PROGRAMS_WINDOW_H

#include "base/image.h"

typedef enum vt_event_kind {
  VT_EVENT_QUIT,
  VT_EVENT_KEY,    // key: a character ('l', '['), or one of the keys below
  VT_EVENT_ORBIT,  // left button held, moved by dx, dy in shares of the window's height
  VT_EVENT_PAN,    // right button
  VT_EVENT_WHEEL,  // dy > 0: away from the user
  VT_EVENT_RESIZED // or shown again
} vt_event_kind;

#define VT_KEY_ESCAPE 27
#define VT_KEY_F12 256
#define VT_KEY_LEFT 257
#define VT_KEY_RIGHT 258
#define VT_KEY_UP 259
#define VT_KEY_DOWN 260
#define VT_KEY_HOME 261

typedef struct vt_event {
  vt_event_kind kind;
  int key;
  double dx, dy;
} vt_event;

typedef struct vt_window vt_window;

// VT_MISSING_PROGRAM in builds without SDL, VT_FAILED where there is no display.
vt_status vt_open_window(vt_context *, const char *title, int width, int height, vt_window **out);
void vt_close_window(vt_context *, vt_window *);
void vt_window_size(const vt_window *, int *width, int *height); // pixels
void vt_set_window_title(vt_window *, const char *title);
// The next event, waited for at most so long. False: none.
bool vt_next_event(vt_window *, int milliseconds, vt_event *out);
// Fills the window with an RGB picture of any size.
vt_status vt_show_picture(vt_context *, vt_window *, const vt_image *rgb);

#endif
