// check_table.c - voltree capture --check: photographs looked at before the work
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/check_table.h"

#include "base/cache.h"
#include "programs/plan.h"
#include "programs/report.h"
#include "programs/stage_options.h"

#include <string.h>

enum { MOST_ROWS = 40 }; // of more photographs only those with troubles are listed

static const struct {
  unsigned bit;
  const char *word;
} troubles[] = {{VT_PHOTO_UNREADABLE, "unreadable"}, {VT_PHOTO_BLURRED, "blurred"}, {VT_PHOTO_EXPOSURE, "exposure"},
                {VT_PHOTO_WHITE, "white balance"},   {VT_PHOTO_DOUBLE, "double"}};
#define TROUBLE_COUNT (sizeof troubles / sizeof *troubles)

static void say_photo(vt_session *session, const vt_checked_photo *p, int name_width) {
  char size[24], words[80] = "";
  snprintf(size, sizeof size, "%dx%d", p->width, p->height);
  for (size_t i = 0; i < TROUBLE_COUNT; i++)
    if (p->troubles & troubles[i].bit) {
      if (words[0]) strcat(words, ", ");
      strcat(words, troubles[i].word);
    }
  if (p->troubles & VT_PHOTO_UNREADABLE)
    vt_say(session, "  %-*s %43s  %s\n", name_width, p->name, "", words);
  else
    vt_say(session, "  %-*s %11s %6d %7.0f %% %+8.2f %+7.2f  %s\n", name_width, p->name, size, p->group + 1, 100 * p->sharpness,
           p->exposure_step, p->white_step, *words ? words : "-");
}

static void say_photos(vt_session *session, const vt_check_report *r) {
  int width = 10, shown = 0;
  bool all = r->count <= MOST_ROWS;
  for (int i = 0; i < r->count; i++) {
    int length = (int)strlen(r->photos[i].name);
    if ((all || r->photos[i].troubles) && length > width) width = length < 60 ? length : 60;
    shown += all || r->photos[i].troubles;
  }
  if (shown) vt_say(session, "  %-*s %11s %6s %9s %8s %7s  %s\n", width, "", "size", "camera", "sharpness", "exposure", "white", "trouble");
  for (int i = 0; i < r->count; i++)
    if (all || r->photos[i].troubles) say_photo(session, &r->photos[i], width);
  if (!all) vt_say(session, "  (%d others show no trouble)\n", r->count - shown);
}

static void put_photos(vt_json_writer *json, const vt_check_report *r) {
  vt_json_open_array(json, "photographs");
  for (int i = 0; i < r->count; i++) {
    const vt_checked_photo *p = &r->photos[i];
    vt_json_open_object(json, NULL);
    vt_json_put_string(json, "name", p->name);
    vt_json_put_integer(json, "width", p->width);
    vt_json_put_integer(json, "height", p->height);
    vt_json_put_integer(json, "orientation", p->orientation);
    vt_json_put_integer(json, "camera", p->group + 1);
    vt_json_put_number(json, "focal_35mm", p->focal_35mm);
    vt_json_put_number(json, "sharpness", p->sharpness);
    vt_json_put_number(json, "exposure_step", p->exposure_step);
    vt_json_put_number(json, "white_step", p->white_step);
    if (p->twin >= 0) vt_json_put_string(json, "shows_the_same_as", r->photos[p->twin].name);
    vt_json_open_array(json, "troubles");
    for (size_t k = 0; k < TROUBLE_COUNT; k++)
      if (p->troubles & troubles[k].bit) vt_json_put_string(json, NULL, troubles[k].word);
    vt_json_close_array(json);
    vt_json_close_object(json);
  }
  vt_json_close_array(json);
}

// What the work would take: level, memory, disk, time.
static void advise(vt_session *session, const vt_check_report *r, vt_json_writer *json) {
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
  double cell_pixels = 0, longer = r->longest, seconds = r->seconds_calibration + r->seconds_developing;
  char bytes[32], disk[32], room[32];
  int bound = vt_integer_of(&session->arguments, "max-image-size", 0);
  if (bound > 0 && longer > bound) longer /= ((int)longer + bound - 1) / bound;
  int level = vt_guess_level(&desc, longer, &cell_pixels);
  uint64_t memory = vt_guess_tree_bytes(level, r->count, r->view_bytes), most = vt_memory_bound(session->context);
  uint64_t disk_bytes = r->calibration_bytes + (session->cache ? r->view_bytes / 2 + memory / 20 : 0);
  uint64_t left = vt_free_bytes(session->cache ? session->cache : ".");
  vt_say(session, "  resolution: %.0f pixels a side suffice for level %d (preset normal: cells of %.1f pixels if the tree fills "
                  "the frame)\n",
         longer, level, cell_pixels);
  vt_say(session, "  needed: about %s of memory (%s allowed), %s of disk", vt_show_bytes(memory, bytes), vt_show_bytes(most, room),
         vt_show_bytes(disk_bytes, disk));
  vt_say(session, " (%s free)\n", vt_show_bytes(left, room));
  vt_say(session, "  time: about %.0f s for cameras, %.0f s for mattes\n", r->seconds_calibration, r->seconds_developing);
  if (memory > most)
    vt_say(session, "  warning: more memory than is allowed; give --max-image-size %d, or --max-memory\n", r->longest / 2);
  if (left && disk_bytes > left)
    vt_say(session, "  warning: the disk of the cache is too full; make room, or give another --cache\n");
  vt_json_put_integer(json, "level_about", level);
  vt_json_put_number(json, "cell_pixels_about", cell_pixels);
  vt_json_put_integer(json, "memory_bytes_about", (long long)memory);
  vt_json_put_integer(json, "disk_bytes_about", (long long)disk_bytes);
  vt_json_put_integer(json, "disk_bytes_free", (long long)left);
  vt_json_put_number(json, "seconds_calibration_about", r->seconds_calibration);
  vt_json_put_number(json, "seconds_views_about", r->seconds_developing);
  vt_json_put_number(json, "seconds_about", seconds);
}

vt_status vt_check_source(vt_session *session, const char *source) {
  vt_capture_desc desc = vt_capture_desc_of(session, source);
  vt_check_report r;
  vt_begin_stage(session);
  vt_status status = vt_check_capture(session->context, &desc, &r);
  if (status) return status;
  vt_end_stage(session, "check");
  vt_say(session, "%s: %d photographs, %.0f megapixels, %d kind%s of camera\n", source, r.count, r.megapixels, r.group_count,
         r.group_count == 1 ? "" : "s");
  say_photos(session, &r);
  vt_say_coverage(session, &r.coverage);
  if (!r.coverage.count) vt_say(session, "  coverage: known when the cameras are found; run the check again then\n");
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_string(&json, "source", source);
  vt_json_put_integer(&json, "photographs_found", r.count);
  vt_json_put_integer(&json, "photographs_unreadable", r.unreadable_count);
  vt_json_put_bool(&json, "cameras_known", r.cameras_known);
  put_photos(&json, &r);
  vt_put_coverage(&json, &r.coverage);
  advise(session, &r, &json);
  for (int i = 0; i < r.warning_count; i++) vt_say(session, "  warning: %s\n", r.warnings[i]);
  if (!r.warning_count) vt_say(session, "  nothing is wrong with them\n");
  vt_put_sentences(&json, "warnings", r.warning_count, r.warnings);
  status = vt_end_report(session, &json);
  vt_free_check_report(session->context, &r);
  return status;
}
