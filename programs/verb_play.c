// verb_play.c - voltree play: looks at a tree in a window, or runs the same loop without one
// SPDX-License-Identifier: BSD-3-Clause
#include "base/file.h"
#include "base/image_file.h"
#include "programs/player.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/turntable.h"
#include "programs/verbs.h"

#include <string.h>

static const vt_option options[] = {
    {"size", 0, VT_OPTION_DIMENSIONS, "WxH", 0, 0, false, "pixels of the window; default: 960x720"},
    {"headless", 0, VT_OPTION_INTEGER, "FRAMES", 1, 100000, false,
     "no window: turn once around the tree in so many frames; needs -o"},
    {"output", 'o', VT_OPTION_TEXT, "DIR", 0, 0, false, "the folder of the frames of --headless"},
    {0}};

typedef struct frame_tally {
  int frames;
  double seconds, worst;
} frame_tally;

static void count_frame(frame_tally *tally, double seconds) {
  tally->frames++;
  tally->seconds += seconds;
  if (seconds > tally->worst) tally->worst = seconds;
}

static vt_status finish(vt_session *session, const vt_player *player, const frame_tally *tally) {
  double mean = tally->frames ? tally->seconds / tally->frames : 0;
  vt_say(session, "%s: %d frames, %s, %.1f ms each, %.1f ms at worst\n", session->arguments.operands[0], tally->frames,
         vt_renderer_name(player->renderer), 1e3 * mean, 1e3 * tally->worst);
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_integer(&json, "frames", tally->frames);
  vt_json_put_number(&json, "seconds_per_frame", mean);
  vt_json_put_number(&json, "worst_seconds", tally->worst);
  vt_json_put_string(&json, "renderer", vt_renderer_name(player->renderer));
  vt_json_put_integer(&json, "level", player->report.level);
  return vt_end_report(session, &json);
}

// voltree-0001.png in the current folder, the first name that is free.
static vt_status take_screenshot(vt_session *session, const vt_image *picture) {
  for (int i = 1; i < 10000; i++) {
    char name[64];
    snprintf(name, sizeof name, "voltree-%04d.%s", i, vt_picture_ending());
    if (vt_is_file(name)) continue;
    vt_status status = vt_write_image(session->context, name, picture);
    if (!status) vt_say(session, "%s\n", name);
    return status;
  }
  return vt_fail(session->context, VT_FAILED, "voltree-9999.png: is taken, as are all before it; clear some away");
}

// Draws when something changed: smaller and fast while events come, once more in full when they stop.
static vt_status run_window(vt_session *session, vt_player *player, const int size[2], frame_tally *tally) {
  vt_context *context = session->context;
  vt_window *window = NULL;
  vt_status status = vt_open_window(context, "voltree", size[0], size[1], &window);
  bool draw = true, moving = false, quit = false;
  while (!status && !quit && !vt_cancelled(context)) {
    vt_event event;
    bool screenshot = false, events = false;
    int wait = draw ? 0 : moving ? 100 : 250;
    while (vt_next_event(window, wait, &event)) {
      vt_answer answer = vt_tell_player(player, &event);
      quit |= answer == VT_ANSWER_QUIT;
      screenshot |= answer == VT_ANSWER_SCREENSHOT;
      events |= answer == VT_ANSWER_DRAW;
      wait = 0;
    }
    if (quit) break;
    draw |= events || screenshot || moving;
    if (!draw) continue;
    moving = events;
    vt_image picture = {0};
    int width, height;
    char title[200];
    vt_window_size(window, &width, &height);
    status = vt_draw_player(context, player, width, height, moving && !screenshot, &picture);
    if (!status && screenshot) status = take_screenshot(session, &picture);
    if (!status) status = vt_show_picture(context, window, &picture);
    snprintf(title, sizeof title, "voltree - %s - %.1f ms, level %d, %d x %d", session->arguments.operands[0],
             1e3 * player->seconds, player->report.level, picture.width, picture.height);
    vt_set_window_title(window, title);
    vt_free_image(context, &picture);
    count_frame(tally, player->seconds);
    draw = false;
  }
  vt_close_window(context, window);
  return status;
}

// One turn of drags, the last frame at rest, written to a folder that appears complete.
static vt_status run_headless(vt_session *session, vt_player *player, const int size[2], frame_tally *tally) {
  vt_context *context = session->context;
  int count = vt_integer_of(&session->arguments, "headless", 0);
  vt_turntable turn = {0};
  vt_status status = vt_begin_turntable(session, vt_text_of(&session->arguments, "output", ""), &turn);
  for (int i = 0; i < count && !status; i++) {
    vt_event event = {.kind = VT_EVENT_ORBIT, .dx = 2.0 / count};
    if (i) vt_tell_player(player, &event);
    vt_image picture = {0};
    status = vt_draw_player(context, player, size[0], size[1], i + 1 < count, &picture);
    char *path = vt_turntable_frame(session, &turn, i);
    if (!status) status = path ? vt_write_image(context, path, &picture) : VT_OUT_OF_MEMORY;
    vt_free(context, path);
    vt_free_image(context, &picture);
    count_frame(tally, player->seconds);
    if (!status && vt_cancelled(context)) status = VT_CANCELLED;
  }
  if (!status) status = vt_finish_turntable(session, &turn, false);
  vt_drop_turntable(session, &turn);
  return status;
}

static vt_status run(vt_session *session) {
  vt_context *context = session->context;
  const vt_arguments *arguments = &session->arguments;
  const char *input = arguments->operands[0], *folder = vt_text_of(arguments, "output", NULL);
  bool headless = vt_given(arguments, "headless");
  int size[2] = {960, 720};
  vt_dimensions_of(arguments, "size", size);
  if (headless != (folder != NULL))
    return vt_fail(context, VT_BAD_USAGE, "play: --headless FRAMES and -o DIR go together; give both or neither");
  vt_tree tree = {0};
  vt_renderer *renderer = NULL;
  vt_render_desc desc = vt_render_desc_of(arguments);
  frame_tally tally = {0};
  vt_status status = folder ? vt_check_output_folder(session, folder) : VT_OK;
  if (!status) status = vt_read_tree(context, input, &tree, NULL);
  if (!status) status = vt_check_level(session, &tree, input, desc.level);
  if (!status) status = vt_create_renderer(context, &tree, vt_backend_of(arguments), &renderer);
  if (!status) {
    vt_player player = vt_make_player(&tree, renderer, &desc);
    status = headless ? run_headless(session, &player, size, &tally) : run_window(session, &player, size, &tally);
    if (!status && vt_cancelled(context)) status = VT_CANCELLED;
    if (!status) status = finish(session, &player, &tally);
  }
  if (renderer) vt_destroy_renderer(context, renderer);
  vt_free_tree(context, &tree);
  return status;
}

const vt_verb vt_verb_play = {
    .name = "play",
    .operands = "TREE",
    .summary = "look at a tree in a window",
    .notes = "Left button: orbit. Right button: move. Wheel: distance. Arrows: orbit. R: as at the start. [ and ]: "
             "coarser and "
             "finer level; 0: level by distance; L: show the level. B: background. P or F12: screenshot. Esc: quit.",
    .example = "voltree play tree.vtree",
    .operand_count = 1,
    .tables = {options, vt_picture_options, vt_common_options},
    .run = run};
