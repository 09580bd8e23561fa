// player.c - an orbit around a tree, keys, and a resolution that follows the speed of the renderer
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/player.h"

#include "programs/contact_sheet.h"
#include "programs/stage_options.h"

#define FOV 40.0    // degrees
#define TARGET 0.05 // seconds of a frame while moving
#define LEAST_SCALE 0.125

vt_player vt_make_player(const vt_tree *tree, vt_renderer *renderer, const vt_render_desc *desc) {
  vt_player player = {.tree = tree, .renderer = renderer, .desc = *desc, .scale = 1};
  player.orbit = player.start = vt_find_orbit(tree);
  player.elevation = player.orbit.elevation;
  return player;
}

static double bound(double value, double low, double high) {
  return value < low ? low : value > high ? high : value;
}

static double distance_of(const vt_player *player) {
  return player->distance > 0 ? player->distance : vt_fitting_distance(FOV, 1, 1);
}

static void change_level(vt_player *player, int step) {
  int finest = vt_finest_level(player->tree), level = player->desc.level;
  if (level < 0) level = player->report.level;
  for (level += step; level >= 0 && level <= finest; level += step)
    if (vt_has_textures(player->tree, level)) {
      player->desc.level = level;
      return;
    }
}

static vt_answer press(vt_player *player, int key) {
  switch (key) {
  case VT_KEY_ESCAPE:
  case 'q':
    return VT_ANSWER_QUIT;
  case VT_KEY_F12:
  case 'p':
    return VT_ANSWER_SCREENSHOT;
  case VT_KEY_HOME:
  case 'r':
    player->orbit = player->start;
    player->azimuth = player->distance = 0;
    player->elevation = player->orbit.elevation;
    player->desc.level = -1;
    break;
  case 'l':
    player->overlay = !player->overlay;
    break;
  case '[':
    change_level(player, -1);
    break;
  case ']':
    change_level(player, 1);
    break;
  case '0':
    player->desc.level = -1;
    break;
  case 'b':
    player->background = (player->background + 1) % 3;
    break;
  case VT_KEY_LEFT:
    player->azimuth -= 5;
    break;
  case VT_KEY_RIGHT:
    player->azimuth += 5;
    break;
  case VT_KEY_UP:
    player->elevation = bound(player->elevation + 5, -90, 90);
    break;
  case VT_KEY_DOWN:
    player->elevation = bound(player->elevation - 5, -90, 90);
    break;
  default:
    return VT_ANSWER_NOTHING;
  }
  return VT_ANSWER_DRAW;
}

// The middle moves with the hand: one window height is what the picture's height shows at the tree's distance.
static void pan(vt_player *player, double dx, double dy) {
  vt_camera camera =
      vt_orbit_camera(&player->orbit, player->azimuth, player->elevation, distance_of(player), FOV, 64, 64);
  const double *m = camera.rotation.m;
  double reach = 2 * distance_of(player) * player->orbit.size * tan(FOV * VT_PI / 360);
  player->orbit.centre = vt_sub(player->orbit.centre, vt_scale(vt_v3(m[0], m[1], m[2]), dx * reach));
  player->orbit.centre = vt_sub(player->orbit.centre, vt_scale(vt_v3(m[3], m[4], m[5]), dy * reach));
}

vt_answer vt_tell_player(vt_player *player, const vt_event *event) {
  switch (event->kind) {
  case VT_EVENT_QUIT:
    return VT_ANSWER_QUIT;
  case VT_EVENT_KEY:
    return press(player, event->key);
  case VT_EVENT_ORBIT:
    player->azimuth = fmod(player->azimuth - 180 * event->dx, 360);
    player->elevation = bound(player->elevation + 180 * event->dy, -90, 90);
    return VT_ANSWER_DRAW;
  case VT_EVENT_PAN:
    pan(player, event->dx, event->dy);
    return VT_ANSWER_DRAW;
  case VT_EVENT_WHEEL:
    player->distance = bound(distance_of(player) * pow(0.9, event->dy), 0.01, 1000);
    return VT_ANSWER_DRAW;
  case VT_EVENT_RESIZED:
    return VT_ANSWER_DRAW;
  }
  return VT_ANSWER_NOTHING;
}

vt_status vt_draw_player(vt_context *context, vt_player *player, int width, int height, bool moving, vt_image *out) {
  static const float colours[3][3] = {{1, 1, 1}, {0, 0, 0}, {0.5f, 0.5f, 0.5f}};
  double scale = moving ? player->scale : 1, start = vt_seconds();
  int w = (int)(width * scale), h = (int)(height * scale);
  w = w > 1 ? w : 1;
  h = h > 1 ? h : 1;
  vt_camera camera = vt_orbit_camera(&player->orbit, player->azimuth, player->elevation, player->distance, FOV, w, h);
  vt_fimage picture = {0};
  vt_status status = vt_render(context, player->renderer, &player->desc, &camera, &picture, &player->report);
  if (!status) status = vt_flatten(context, &picture, colours[player->background], out);
  vt_free_fimage(context, &picture);
  if (status) return status;
  player->seconds = vt_seconds() - start;
  // Time goes about with the pixels; half a step at a time, so that it does not swing.
  double wanted = scale * sqrt(TARGET / (player->seconds > 1e-4 ? player->seconds : 1e-4));
  if (moving)
    player->scale = bound(sqrt(player->scale * wanted), LEAST_SCALE, 1);
  else if (player->scale > wanted)
    player->scale = bound(wanted, LEAST_SCALE, 1);
  if (player->overlay) {
    char label[64];
    snprintf(label, sizeof label, "L%d %lluB", player->report.level, (unsigned long long)player->report.billboards);
    vt_draw_label(out, label, 4, 4, 1 + out->height / 300);
  }
  return VT_OK;
}
