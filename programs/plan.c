// plan.c - what a run would do, what the cache has of it, and about what it costs
// SPDX-License-Identifier: BSD-3-Clause
//
// The guesses are made from counts alone: photographs, pixels, and the level at which a tree that fills the photographs has
// cells of the recipe's size. A level has about 1.5 * 4.9^level cells (between a surface's 4 and a solid's 8), half of what
// reconstruct itself makes room for. They are right within a factor of two or three, which is what one wants to know before an
// evening's run.
#include "programs/plan.h"

#include "programs/report.h"

#include <math.h>

#define FILLED 0.8 // of the photographs' longer side, by the cube around the tree

int vt_guess_level(const vt_reconstruct_desc *desc, double longer_side, double *cell_pixels) {
  bool tri = desc->method == VT_METHOD_2004;
  double branching = tri ? 3 : 2, wanted = desc->method == VT_METHOD_BEST ? 2.5 : tri ? 6.6 : 3.3, edge = FILLED * longer_side;
  if (desc->preset == VT_PRESET_DRAFT) wanted *= branching;
  if (desc->preset == VT_PRESET_HIGH) wanted /= branching;
  int level = 0;
  while (level < VT_MAX_LEVEL && (desc->leaf_level ? level < desc->leaf_level : edge > wanted || !level)) {
    edge /= branching;
    level++;
  }
  *cell_pixels = edge;
  return level;
}

static double guess_cells(int level) {
  return 1.5 * pow(2, 2.3 * level);
}

uint64_t vt_guess_tree_bytes(int level, int views, uint64_t view_bytes) {
  double cells = guess_cells(level), chords = fmin(cells * views * 64, 1.5e9);
  return (uint64_t)(1.33 * (chords + 192 * cells + 120 * cells)) + 3 * view_bytes; // the views, reduced ones, view textures
}

vt_status vt_plan_source(vt_session *session, const char *source, vt_plan *out) {
  vt_capture_desc desc = vt_capture_desc_of(session, source);
  *out = (vt_plan){0};
  return vt_plan_capture(session->context, &desc, &out->source);
}

vt_status vt_guess_tree(vt_session *session, const vt_reconstruct_desc *desc, vt_plan *plan) {
  const vt_capture_plan *s = &plan->source;
  int count = s->photograph_count > 0 ? s->photograph_count : 1;
  double pixels = (double)s->view_bytes / 4, effort = desc->preset == VT_PRESET_DRAFT ? 1 : desc->preset == VT_PRESET_HIGH ? 4 : 2;
  plan->wants_tree = true;
  plan->level = vt_guess_level(desc, sqrt(pixels / count * 4 / 3), &plan->cell_pixels);
  plan->tree_bytes = vt_guess_tree_bytes(plan->level, count, s->view_bytes);
  plan->seconds_tree = effort * (2e-6 * pixels + 3e-7 * guess_cells(plan->level) * count) / vt_thread_count(session->context);
  if (desc->time_budget > 0) plan->seconds_tree = desc->time_budget;
  return VT_OK;
}

static void say_stage(vt_session *session, vt_json_writer *json, const char *name, bool kept, double seconds, const char *what) {
  char time[32] = "from the cache";
  if (!kept) snprintf(time, sizeof time, "about %.*f s", seconds < 10 ? 1 : 0, seconds);
  vt_say(session, "  %-12s %-18s %s\n", name, time, what);
  vt_json_open_object(json, NULL);
  vt_json_put_string(json, "stage", name);
  vt_json_put_bool(json, "from_cache", kept);
  vt_json_put_number(json, "seconds_about", kept ? 0 : seconds);
  vt_json_close_object(json);
}

vt_status vt_show_plan(vt_session *session, const char *source, const char *output, const vt_plan *plan) {
  const vt_capture_plan *s = &plan->source;
  vt_json_writer json = vt_begin_report(session);
  char bytes[32], words[160];
  uint64_t memory = plan->wants_tree ? plan->tree_bytes : s->view_bytes;
  vt_json_put_bool(&json, "dry_run", true);
  vt_json_put_string(&json, "source", source);
  vt_json_put_string(&json, "output", output);
  vt_json_put_integer(&json, "photographs_found", s->photograph_count);
  vt_json_open_array(&json, "plan");
  vt_say(session, "%s: %d photographs; nothing is written\n", source, s->photograph_count);
  if (s->kind == VT_SOURCE_PHOTOS)
    say_stage(session, &json, "calibration", s->calibration_kept, s->seconds_calibration,
              s->calibration_begun ? "cameras, by colmap; an interrupted search goes on, so less" : "cameras, by colmap");
  say_stage(session, &json, "views", s->views_kept, s->seconds_developing,
            s->views_cheap ? "reading" : "reading, mattes, foreground colours, undistortion");
  if (plan->wants_tree) {
    snprintf(words, sizeof words, "level %d, cells of about %.1f pixels if the tree fills the photographs", plan->level,
             plan->cell_pixels);
    say_stage(session, &json, "reconstruct", plan->tree_kept, plan->seconds_tree, words);
    say_stage(session, &json, "compress", false, 0.1 * plan->seconds_tree, "codebooks");
  }
  say_stage(session, &json, "write", false, plan->wants_tree ? 0.5 : 2e-8 * (double)s->view_bytes, output);
  vt_json_close_array(&json);
  vt_say(session, "  memory: about %s\n", vt_show_bytes(memory, bytes));
  vt_json_put_integer(&json, "memory_bytes_about", (long long)memory);
  return vt_end_report(session, &json);
}
