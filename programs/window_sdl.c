// window_sdl.c - a window through SDL2
// SPDX-License-Identifier: BSD-3-Clause
//
// The tree is drawn by our renderer, which has an OpenGL context of its own; the window only copies pictures. SDL's
// software renderer keeps its hands off OpenGL, so that the two never fight over the current context.
#include "programs/window.h"

#include <SDL2/SDL.h>
#include <stdlib.h>
#include <string.h>

struct vt_window {
  SDL_Window *window;
  SDL_Renderer *renderer;
  SDL_Texture *texture;
  int texture_width, texture_height;
};

static vt_status complain(vt_context *context) {
  return vt_fail(context, VT_FAILED,
                 "window: %s; use voltree play --headless or voltree render where there is no display", SDL_GetError());
}

// Where there is no display SDL may fall back to a driver whose windows nobody sees and which never gets an event: the
// program would wait for ever. It is taken only if it was asked for by name.
static bool is_unseen(const char *driver) {
  return driver && (!strcmp(driver, "offscreen") || !strcmp(driver, "dummy") || !strcmp(driver, "evdev"));
}

vt_status vt_open_window(vt_context *context, const char *title, int width, int height, vt_window **out) {
  *out = NULL;
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_FRAMEBUFFER_ACCELERATION, "0");
  SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "1");
  if (SDL_Init(SDL_INIT_VIDEO)) return complain(context);
  if (is_unseen(SDL_GetCurrentVideoDriver()) && !getenv("SDL_VIDEODRIVER")) {
    SDL_Quit();
    SDL_SetError("there is no display");
    return complain(context);
  }
  vt_window *window = VT_NEW(context, vt_window, 1);
  if (!window) {
    SDL_Quit();
    return VT_OUT_OF_MEMORY;
  }
  window->window =
      SDL_CreateWindow(title, SDL_WINDOWPOS_UNDEFINED, SDL_WINDOWPOS_UNDEFINED, width, height, SDL_WINDOW_RESIZABLE);
  if (window->window) window->renderer = SDL_CreateRenderer(window->window, -1, SDL_RENDERER_SOFTWARE);
  if (!window->renderer) {
    vt_status status = complain(context);
    vt_close_window(context, window);
    return status;
  }
  *out = window;
  return VT_OK;
}

void vt_close_window(vt_context *context, vt_window *window) {
  if (!window) return;
  if (window->texture) SDL_DestroyTexture(window->texture);
  if (window->renderer) SDL_DestroyRenderer(window->renderer);
  if (window->window) SDL_DestroyWindow(window->window);
  vt_free(context, window);
  SDL_Quit();
}

void vt_window_size(const vt_window *window, int *width, int *height) {
  if (SDL_GetRendererOutputSize(window->renderer, width, height) || *width < 1 || *height < 1) *width = *height = 1;
}

void vt_set_window_title(vt_window *window, const char *title) {
  SDL_SetWindowTitle(window->window, title);
}

static int key_of(SDL_Keycode key) {
  switch (key) {
  case SDLK_ESCAPE:
    return VT_KEY_ESCAPE;
  case SDLK_F12:
    return VT_KEY_F12;
  case SDLK_LEFT:
    return VT_KEY_LEFT;
  case SDLK_RIGHT:
    return VT_KEY_RIGHT;
  case SDLK_UP:
    return VT_KEY_UP;
  case SDLK_DOWN:
    return VT_KEY_DOWN;
  case SDLK_HOME:
    return VT_KEY_HOME;
  default:
    return key > 0 && key < 127 ? (int)key : 0;
  }
}

// False for what is of no interest.
static bool translate(const vt_window *window, const SDL_Event *event, vt_event *out) {
  int width, height;
  switch (event->type) {
  case SDL_QUIT:
    out->kind = VT_EVENT_QUIT;
    return true;
  case SDL_KEYDOWN:
    out->kind = VT_EVENT_KEY;
    out->key = key_of(event->key.keysym.sym);
    return out->key != 0;
  case SDL_MOUSEMOTION:
    if (!(event->motion.state & (SDL_BUTTON_LMASK | SDL_BUTTON_RMASK))) return false;
    SDL_GetWindowSize(window->window, &width, &height);
    out->kind = event->motion.state & SDL_BUTTON_LMASK ? VT_EVENT_ORBIT : VT_EVENT_PAN;
    out->dx = (double)event->motion.xrel / (height > 0 ? height : 1);
    out->dy = (double)event->motion.yrel / (height > 0 ? height : 1);
    return true;
  case SDL_MOUSEWHEEL:
    out->kind = VT_EVENT_WHEEL;
    out->dy = event->wheel.y;
    return true;
  case SDL_WINDOWEVENT:
    out->kind = VT_EVENT_RESIZED;
    return event->window.event == SDL_WINDOWEVENT_SIZE_CHANGED || event->window.event == SDL_WINDOWEVENT_EXPOSED;
  default:
    return false;
  }
}

bool vt_next_event(vt_window *window, int milliseconds, vt_event *out) {
  SDL_Event event;
  *out = (vt_event){0};
  if (milliseconds > 0 ? !SDL_WaitEventTimeout(&event, milliseconds) : !SDL_PollEvent(&event)) return false;
  do {
    if (translate(window, &event, out)) return true;
  } while (SDL_PollEvent(&event));
  return false;
}

vt_status vt_show_picture(vt_context *context, vt_window *window, const vt_image *rgb) {
  VT_ASSERT(rgb->channels == 3);
  if (!window->texture || window->texture_width != rgb->width || window->texture_height != rgb->height) {
    if (window->texture) SDL_DestroyTexture(window->texture);
    window->texture = SDL_CreateTexture(window->renderer, SDL_PIXELFORMAT_RGB24, SDL_TEXTUREACCESS_STREAMING,
                                        rgb->width, rgb->height);
    window->texture_width = rgb->width;
    window->texture_height = rgb->height;
  }
  if (!window->texture || SDL_UpdateTexture(window->texture, NULL, rgb->pixels, 3 * rgb->width) ||
      SDL_RenderCopy(window->renderer, window->texture, NULL, NULL))
    return complain(context);
  SDL_RenderPresent(window->renderer);
  return VT_OK;
}
