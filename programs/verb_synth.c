// verb_synth.c - voltree synth: a procedural tree or phantom, photographed with exact cameras and mattes
// SPDX-License-Identifier: BSD-3-Clause
#include "capture/capture.h"
#include "datasets-synthetic/synthetic.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"

// The words stand in the order of vt_synthetic_kind.
static const vt_option options[] = {
    {"kind", 0, VT_OPTION_CHOICE, "tree|oak|pine|small_oak|birch|willow|mesh|ball|shell|blobs|comb|crown", 0, 0, false,
     "a tree grown in the manner of that species, or a phantom of known extinction"},
    {"seed", 0, VT_OPTION_INTEGER, "N", 0, 2147483647, false, "another tree for each N"},
    {"views", 0, VT_OPTION_INTEGER, "N", 1, 1000, false, "photographs to reconstruct from"},
    {"test-views", 0, VT_OPTION_INTEGER, "N", 0, 1000, false, "photographs to judge against"},
    {"size", 0, VT_OPTION_INTEGER, "N", 16, 8192, false, "pixels along an edge of the square photographs"},
    {"leaves", 0, VT_OPTION_INTEGER, "N", -1, 10000000, false, "about so many leaves on the tree"},
    {"supersample", 0, VT_OPTION_INTEGER, "N", 1, 8, false, "samples along an edge of a pixel, for soft mattes"},
    {0}};

static vt_status run(vt_session *session) {
  vt_context *context = session->context;
  const vt_arguments *arguments = &session->arguments;
  const char *folder = arguments->operands[0];
  vt_views views = {0};
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = (vt_synthetic_kind)vt_choice_of(arguments, "kind", (int)desc.kind);
  desc.seed = (uint32_t)vt_integer_of(arguments, "seed", (int)desc.seed);
  desc.train_count = vt_integer_of(arguments, "views", desc.train_count);
  desc.test_count = vt_integer_of(arguments, "test-views", desc.test_count);
  desc.width = vt_integer_of(arguments, "size", desc.width);
  desc.height = vt_integer_of(arguments, "size", desc.height);
  desc.leaf_count = vt_integer_of(arguments, "leaves", desc.leaf_count);
  desc.supersample = vt_integer_of(arguments, "supersample", desc.supersample);

  vt_status status = vt_check_output_folder(session, folder);
  vt_begin_stage(session);
  if (!status) status = vt_make_synthetic_views(context, &desc, &views);
  if (!status) vt_end_stage(session, "synth");
  vt_begin_stage(session);
  if (!status) status = vt_write_capture(context, &views, folder);
  if (!status) vt_end_stage(session, "write");
  if (!status) {
    vt_say(session, "%s: %d photographs of %d x %d pixels, %d to judge against, %.1f s\n", folder, desc.train_count,
           desc.width, desc.height, desc.test_count, vt_seconds() - session->start);
    vt_json_writer json = vt_begin_report(session);
    vt_json_put_string(&json, "output", folder);
    vt_json_put_integer(&json, "seed", desc.seed);
    vt_json_put_integer(&json, "views", desc.train_count);
    vt_json_put_integer(&json, "test_views", desc.test_count);
    vt_json_put_integer(&json, "width", desc.width);
    vt_json_put_integer(&json, "height", desc.height);
    status = vt_end_report(session, &json);
  }
  vt_free_views(context, &views);
  return status;
}

const vt_verb vt_verb_synth = {
    .name = "synth",
    .operands = "OUT",
    .summary = "grow a tree and photograph it with exact cameras and mattes",
    .notes =
        "OUT becomes a capture folder: pictures with alpha, transforms_train.json and transforms_test.json (or one "
        "transforms.json without photographs to judge against). The same options give the same bytes.",
    .example = "voltree synth oak --seed 7 --views 48 --test-views 12 --size 400",
    .operand_count = 1,
    .tables = {options, vt_common_options},
    .run = run};
