// window_none.c - no window: builds without SDL
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/window.h"

vt_status vt_open_window(vt_context *context, const char *title, int width, int height, vt_window **out) {
  (void)title, (void)width, (void)height;
  *out = NULL;
  return vt_fail(context, VT_MISSING_PROGRAM,
                 "window: this voltree was built without SDL; build it with SDL2, or use voltree "
                 "render or voltree play --headless");
}
void vt_close_window(vt_context *context, vt_window *window) {
  (void)context, (void)window;
}
void vt_window_size(const vt_window *window, int *width, int *height) {
  (void)window;
  *width = *height = 1;
}
void vt_set_window_title(vt_window *window, const char *title) {
  (void)window, (void)title;
}
bool vt_next_event(vt_window *window, int milliseconds, vt_event *out) {
  (void)window, (void)milliseconds, (void)out;
  return false;
}
vt_status vt_show_picture(vt_context *context, vt_window *window, const vt_image *rgb) {
  (void)window, (void)rgb;
  return vt_fail(context, VT_MISSING_PROGRAM, "window: this voltree was built without SDL; build it with SDL2");
}
