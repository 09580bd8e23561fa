// verb_bench.c - voltree bench: runs a suite of measurements, or compares two reports
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/bench_data.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"

#include <string.h>

static const vt_option options[] = {
    {"quick", 0, VT_OPTION_FLAG, "", 0, 0, false, "small scenes and few variants: at most two minutes on two cores"},
    {"capture", 0, VT_OPTION_LIST, "DIR", 0, 0, false,
     "photographs, a capture, or the name of a synthetic scene to run on, may be given several times; default: the "
     "suite's own scenes"},
    {"method", 0, VT_OPTION_CHOICE, "2004|2006|best", 0, 0, false, "as in reconstruct; default: best"},
    {"repetitions", 0, VT_OPTION_INTEGER, "N", 1, VT_MAX_REPETITIONS, false,
     "how often each timed thing is run, in turn with the others; medians are shown"},
    {"peer", 0, VT_OPTION_LIST, "NAME=EXECUTABLE", 0, 0, false,
     "a foreign program that the frontier measures too (bench/peers explains what it must do), may be given several "
     "times; "
     "also from the environment variable VOLTREE_PEERS, separated by commas"},
    {"peer-seconds", 0, VT_OPTION_INTEGER, "N", 1, 86400, false,
     "the time that a peer is told to take; default: once 45 and once 180 seconds, with --quick 5"},
    {"compare", 0, VT_OPTION_FLAG, "", 0, 0, false,
     "compare two reports of one suite, OLD.json and NEW.json, and exit 7 if anything got slower or worse beyond "
     "noise"},
    {"sabotage", 0, VT_OPTION_CHOICE, "solver|blur|slow", 0, 0, false,
     "checks the bench itself: halve the optical depths of what was reconstructed, blur what is judged, or take half "
     "as long "
     "again; a comparison with an honest report must find it"},
    {0}};

static const vt_suite *const suites[] = {
    &vt_suite_frontier, &vt_suite_paper, &vt_suite_scaling, &vt_suite_stability, &vt_suite_skips,
};
#define SUITE_COUNT ((int)(sizeof suites / sizeof *suites))

static vt_status complain_suite(vt_context *context, const char *name) {
  char list[400] = "";
  for (int i = 0; i < SUITE_COUNT; i++) {
    size_t length = strlen(list);
    snprintf(list + length, sizeof list - length, "%s, ", suites[i]->name);
  }
  return vt_fail(context, VT_BAD_USAGE, "%s: no such suite; there is %sand all", name, list);
}

// All suites in one report, each under its heading; one that fails leaves its sentence and the others run. Ends the
// bench.
static vt_status run_all(vt_bench *bench) {
  vt_context *context = bench->context;
  vt_status first = VT_OK;
  char sentence[1100] = "";
  for (int i = 0; i < SUITE_COUNT; i++) {
    snprintf(bench->prefix, sizeof bench->prefix, "%s_", suites[i]->name);
    vt_add_heading(bench, suites[i]->name);
    vt_add_sentence(bench, "%s", suites[i]->summary);
    vt_status status = suites[i]->run(bench);
    if (!status) continue;
    if (status == VT_CANCELLED || vt_cancelled(context)) return vt_end_bench(bench, status);
    vt_add_sentence(bench, "%s failed: %s", suites[i]->name, vt_last_error(context));
    if (!first) snprintf(sentence, sizeof sentence, "%s", vt_last_error(context));
    if (!first) first = status;
    vt_clear_error(context);
  }
  vt_status status = vt_end_bench(bench, VT_OK);
  return status || !first ? status : vt_fail(context, first, "%s", sentence);
}

static vt_status run(vt_session *session) {
  const vt_arguments *arguments = &session->arguments;
  const char *name = arguments->operands[0];
  vt_context *context = session->context;
  if (vt_given(arguments, "compare")) {
    if (arguments->operand_count == 2) return vt_compare_benches(session, name, arguments->operands[1]);
    return vt_fail(context, VT_BAD_USAGE, "--compare: takes two reports; give OLD.json and NEW.json");
  }
  if (arguments->operand_count > 1)
    return vt_fail(context, VT_BAD_USAGE, "%s: one name too many for bench; give one suite, or --compare",
                   arguments->operands[1]);
  const vt_suite *suite = NULL;
  for (int i = 0; i < SUITE_COUNT; i++)
    if (!strcmp(suites[i]->name, name)) suite = suites[i];
  bool all = !strcmp(name, "all");
  if (!suite && !all) return complain_suite(context, name);
  vt_bench *bench = NULL;
  vt_status status = vt_begin_bench(session, name, &bench);
  if (status) return status;
  if (all) return run_all(bench);
  return vt_end_bench(bench, suite->run(bench));
}

const vt_verb vt_verb_bench = {
    .name = "bench",
    .operands = "SUITE|OLD.json [NEW.json]",
    .summary = "measure time against error",
    .notes = "SUITE is frontier (time against error: presets, budgets and peers on held-out photographs) or all. "
             "With --report DIR the tables are also written as CSV, and everything as one page, index.html.",
    .example = "voltree bench frontier --quick --json -",
    .operand_count = 1,
    .operand_most = 2,
    .tables = {options, vt_source_options, vt_codebook_options, vt_common_options},
    .run = run};
