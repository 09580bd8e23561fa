// prepare_views.c - what is mended in photographs and cameras before they are reconstructed from
// SPDX-License-Identifier: BSD-3-Clause
//
// Mattes first: one that belongs to nothing would spoil the volumes by which cameras and colours are judged. Then
// cameras, then colours, which are compared where the cameras say. Each costs seconds, so what was given, not
// estimated, is left alone unless it is asked for.
#include "programs/prepare_views.h"

enum { AUTO, ON, OFF }; // the order of the words, and of vt_refine_mode

static bool is_wanted(const vt_arguments *arguments, const char *option, const vt_views *views) {
  int word = vt_choice_of(arguments, option, AUTO);
  return word == ON || (word == AUTO && views->world.estimated);
}

const vt_option vt_preparation_options[] = {
    {"refine", 0, VT_OPTION_CHOICE, "auto|on|off", 0, 0, false,
     "fit the cameras to the mattes of all photographs; auto: where a quick look says that there is something to gain. "
     "Kept only "
     "where mattes that were held back fit better afterwards"},
    {"check-mattes", 0, VT_OPTION_CHOICE, "auto|on|off", 0, 0, false,
     "leave out photographs whose mattes contradict those of the others"},
    {"balance", 0, VT_OPTION_CHOICE, "auto|on|off", 0, 0, false,
     "bring the photographs to one exposure and white balance where these jump from one to the next; auto, here and "
     "above: "
     "only where cameras or mattes were found from the photographs, not given by a transforms.json with alpha"},
    {0}};

static void say_mattes(vt_session *session, const vt_views *views, const vt_matte_report *report) {
  for (int i = 0; i < views->count; i++)
    if (views->items[i].role == VT_DOUBTFUL)
      vt_say(
          session,
          "  left out: %s: its matte contradicts the others' (disagreement %.3f, usual is %.3f); look at it, or give "
          "--check-mattes off\n",
          views->items[i].name, report->disagreement[i], report->usual);
}

static void say_cameras(vt_session *session, const vt_refine_report *r) {
  if (!r->tried) return;
  if (!r->kept) {
    vt_say(session, "  cameras: kept as they came, %s (alpha error %.4f, %.4f)\n", r->why, r->alpha_before,
           r->alpha_after);
    return;
  }
  vt_say(session,
         "  cameras: refined by %.3f degrees (%.3f at most), %.3f %% of the distance (%.3f), %.2f pixels (%.2f), focal "
         "length %+.3f %%; alpha error of mattes held back %.4f -> %.4f\n",
         r->mean_degrees, r->most_degrees, 100 * r->mean_share, 100 * r->most_share, r->mean_pixels, r->most_pixels,
         100 * r->focal_share, r->alpha_before, r->alpha_after);
  if (r->sight_count)
    vt_say(session, "  cameras: held by %zu sights of points, off by %.3f pixels before and %.3f after\n", r->sight_count,
           r->track_before, r->track_after);
}

vt_status vt_prepare_views(vt_session *session, vt_views *views, vt_preparation *out) {
  vt_context *context = session->context;
  const vt_arguments *arguments = &session->arguments;
  vt_refine_desc refine = vt_default_refine_desc();
  refine.mode = (vt_refine_mode)vt_choice_of(arguments, "refine", VT_REFINE_AUTO);
  *out = (vt_preparation){.cameras = {.why = "the cameras are given"}};
  vt_status status = VT_OK;
  vt_begin_stage(session);
  if (is_wanted(arguments, "check-mattes", views)) status = vt_check_mattes(context, views, &out->mattes);
  if (status) return status;
  vt_end_stage(session, "matte check");
  if (out->mattes.disagreement) say_mattes(session, views, &out->mattes);
  vt_begin_stage(session);
  if (is_wanted(arguments, "refine", views)) status = vt_refine_views(context, &refine, views, &out->cameras);
  vt_free_tracks(context, &views->tracks); // nobody asks for them again
  if (status) return status;
  vt_end_stage(session, "refining cameras");
  say_cameras(session, &out->cameras);
  vt_begin_stage(session);
  if (is_wanted(arguments, "balance", views)) status = vt_balance_views(context, views, &out->colours);
  if (status) return status;
  vt_end_stage(session, "balance");
  if (out->colours.changed)
    vt_say(session,
           "  colours: exposure and white balance jump by %.0f %% from photograph to photograph and were balanced\n",
           100 * out->colours.deviation);
  return VT_OK;
}

static void report_cameras(vt_json_writer *json, const vt_refine_report *r, bool times) {
  vt_json_open_object(json, "cameras");
  vt_json_put_bool(json, "tried", r->tried);
  vt_json_put_bool(json, "kept", r->kept);
  vt_json_put_string(json, "why", r->why);
  vt_json_put_number(json, "first_gain", r->first_gain);
  if (r->tried) {
    vt_json_put_number(json, "alpha_rmse_before", r->alpha_before);
    vt_json_put_number(json, "alpha_rmse_after", r->alpha_after);
  }
  if (r->kept) {
    vt_json_put_number(json, "degrees_mean", r->mean_degrees);
    vt_json_put_number(json, "degrees_most", r->most_degrees);
    vt_json_put_number(json, "distance_share_mean", r->mean_share);
    vt_json_put_number(json, "distance_share_most", r->most_share);
    vt_json_put_number(json, "pixels_mean", r->mean_pixels);
    vt_json_put_number(json, "pixels_most", r->most_pixels);
    vt_json_put_number(json, "focal_share", r->focal_share);
  }
  if (r->sight_count) {
    vt_json_put_number(json, "sights", (double)r->sight_count);
    vt_json_put_number(json, "sights_pixels_before", r->track_before);
    vt_json_put_number(json, "sights_pixels_after", r->track_after);
  }
  if (times) vt_json_put_number(json, "seconds", r->seconds);
  vt_json_close_object(json);
}

void vt_report_preparation(vt_json_writer *json, const vt_views *views, const vt_preparation *p, bool times) {
  vt_json_open_object(json, "preparation");
  vt_json_open_object(json, "mattes");
  vt_json_put_bool(json, "tried", p->mattes.tried);
  vt_json_put_number(json, "disagreement_usual", p->mattes.usual);
  vt_json_open_array(json, "doubtful");
  for (int i = 0; i < views->count && p->mattes.disagreement; i++) {
    if (views->items[i].role != VT_DOUBTFUL) continue;
    vt_json_open_object(json, NULL);
    vt_json_put_string(json, "view", views->items[i].name);
    vt_json_put_number(json, "disagreement", p->mattes.disagreement[i]);
    vt_json_close_object(json);
  }
  vt_json_close_array(json);
  if (times) vt_json_put_number(json, "seconds", p->mattes.seconds);
  vt_json_close_object(json);
  report_cameras(json, &p->cameras, times);
  vt_json_open_object(json, "colours");
  vt_json_put_bool(json, "changed", p->colours.changed);
  vt_json_put_number(json, "deviation", p->colours.deviation);
  vt_json_put_number(json, "most_gain", p->colours.most_gain);
  if (times) vt_json_put_number(json, "seconds", p->colours.seconds);
  vt_json_close_object(json);
  vt_json_close_object(json);
}

void vt_free_preparation(vt_context *context, vt_preparation *p) {
  vt_free_matte_report(context, &p->mattes);
}
