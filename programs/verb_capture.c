// verb_capture.c - voltree capture: photographs to a folder of calibrated, matted pictures that other programs read too
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/check_table.h"
#include "programs/plan.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"

#include <string.h>

static const vt_option options[] = {{"output", 'o', VT_OPTION_TEXT, "CAPTURE", 0, 0, false, "the folder to make; not needed with --check"},
                                    {"holdout", 0, VT_OPTION_INTEGER, "N", 2, 1000, false,
                                     "keep every N-th photograph for judging, in transforms_test.json"},
                                    {"check", 0, VT_OPTION_FLAG, "", 0, 0, false,
                                     "only look at the photographs: what is wrong with them, and what the work takes"},
                                    {"dry-run", 0, VT_OPTION_FLAG, "", 0, 0, false,
                                     "print what would be done, what the cache has of it, and about how long it takes; "
                                     "write nothing"},
                                    {0}};

static vt_status plan(vt_session *session, const char *source, const char *folder) {
  vt_plan p;
  vt_status status = vt_plan_source(session, source, &p);
  return status ? status : vt_show_plan(session, source, folder, &p);
}


static vt_status run(vt_session *session) {
  vt_context *context = session->context;
  const char *source = session->arguments.operands[0], *folder = vt_text_of(&session->arguments, "output", "");
  vt_views views = {0};
  vt_capture_report report = {0};
  if (vt_given(&session->arguments, "check")) return vt_check_source(session, source);
  if (!*folder) return vt_fail(context, VT_BAD_USAGE, "-o CAPTURE is missing; voltree capture --help explains it");
  if (vt_given(&session->arguments, "dry-run")) return plan(session, source, folder);
  vt_status status = vt_check_output_folder(session, folder);
  if (!status) status = vt_load_source(session, source, &views, &report);
  if (status) goto done;
  vt_hold_out(&views, vt_integer_of(&session->arguments, "holdout", 0));
  if (vt_count_views(&views, VT_TRAIN) == 0) {
    status = vt_fail(context, VT_TOO_FEW_VIEWS, "%s: holds no photograph to reconstruct from; add some", source);
    goto done;
  }
  vt_begin_stage(session);
  status = vt_write_capture(context, &views, folder);
  if (status) goto done;
  vt_end_stage(session, "write");
  vt_say_source(session, source, &views, &report);
  vt_say(session, "%s: written in %.1f s (", folder, vt_seconds() - session->start);
  for (int i = 0; i < session->stage_count; i++)
    if (strcmp(session->stages[i].name, "load")) // the sum of those that follow it
      vt_say(session, "%s %.1f%s", session->stages[i].name, session->stages[i].seconds, i + 1 < session->stage_count ? ", " : "");
  vt_say(session, ")\n");
  vt_json_writer json = vt_begin_report(session);
  vt_report_source(&json, source, &views, &report);
  if (views.world.metres_per_unit > 0) vt_json_put_number(&json, "metres_per_unit", views.world.metres_per_unit);
  vt_json_put_string(&json, "output", folder);
  status = vt_end_report(session, &json);
done:
  vt_free_capture_report(context, &report);
  vt_free_views(context, &views);
  return status;
}

const vt_verb vt_verb_capture = {.name = "capture",
                                 .operands = "PHOTOS",
                                 .summary = "find cameras and mattes of photographs and write them as a capture folder",
                                 .notes =
                                     "PHOTOS is a folder of photographs, a COLMAP workspace, or a folder with "
                                     "transforms.json; what is already there "
                                     "is used. CAPTURE gets undistorted PNG pictures with alpha and transforms.json. "
                                     "Give -o CAPTURE, or --check. A run that was interrupted is gone on with by the same "
                                     "command.",
                                 .example = "voltree capture photos/ -o capture --matte backdrop",
                                 .operand_count = 1,
                                 .tables = {options, vt_source_options, vt_common_options},
                                 .run = run};
