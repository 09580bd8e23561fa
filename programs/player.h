// player.h - what the player shows and how it answers to the user, without any window
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_PLAYER_H
#define VT_PROGRAMS_PLAYER_H

#include "programs/orbit.h"
#include "programs/window.h"
#include "render/render.h"

typedef struct vt_player {
  const vt_tree *tree;
  vt_renderer *renderer;
  vt_orbit orbit, start;
  vt_render_desc desc;
  double azimuth, elevation, distance; // degrees; tree sizes, 0: fitting
  int background;                      // 0 white, 1 black, 2 grey
  bool overlay;
  double scale;            // of the resolution while moving, so that a frame takes about TARGET seconds
  double seconds;          // of the last frame
  vt_render_report report; // of the last frame
} vt_player;

vt_player vt_make_player(const vt_tree *, vt_renderer *, const vt_render_desc *);
typedef enum vt_answer { VT_ANSWER_NOTHING, VT_ANSWER_DRAW, VT_ANSWER_SCREENSHOT, VT_ANSWER_QUIT } vt_answer;
vt_answer vt_tell_player(vt_player *, const vt_event *);
// An RGB picture for a window of that size; smaller while moving if the renderer is slow. The caller frees it.
vt_status vt_draw_player(vt_context *, vt_player *, int width, int height, bool moving, vt_image *out);

#endif
