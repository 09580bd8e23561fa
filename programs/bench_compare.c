// bench_compare.c - what got slower or worse between two reports, beyond noise
// SPDX-License-Identifier: BSD-3-Clause
//
// A difference counts only if it is more than what repetitions scatter by. Within `noise_share` of the old value or
// within `noise` nothing is said; where there are ranges, they must also be apart. A time that was taken only once may
// have been disturbed by anything, so it is allowed twice as much. Where other programs had a share in the machine,
// wall time, and what rows of widened noise reached within a time budget, is told but does not count; processor time
// (unit "CPU s") does. Rows are found by their label, columns by their name, so that a report of an older version can
// be compared as far as it goes.
#include "programs/bench_data.h"

#include "base/json.h"

#include <math.h>
#include <string.h>

typedef struct verdicts {
  int worse, better, same, missing, excused;
  bool busy; // one of the machines was, so wall time is no measure
} verdicts;

static const vt_json *find_named(const vt_json *array, const char *key, const char *name) {
  for (size_t i = 0; i < vt_json_count(array); i++)
    if (!strcmp(vt_json_string(vt_json_member(vt_json_item(array, i), key), ""), name)) return vt_json_item(array, i);
  return NULL;
}

static vt_spread cell_of(const vt_json *row, size_t column) {
  double value = vt_json_number(vt_json_item(vt_json_member(row, "values"), column), NAN);
  return (vt_spread){value, vt_json_number(vt_json_item(vt_json_member(row, "low"), column), value),
                     vt_json_number(vt_json_item(vt_json_member(row, "high"), column), value)};
}

// ---- one cell

static bool is_time(const vt_json *column) {
  const char *unit = vt_json_string(vt_json_member(column, "unit"), "");
  return !strcmp(unit, "s") || !strcmp(unit, "ms");
}

// Columns are the same where name and unit are: "reconstruct" may be wall time and processor time.
static const vt_json *find_column(const vt_json *columns, const vt_json *like, size_t *index) {
  const char *name = vt_json_string(vt_json_member(like, "name"), ""),
             *unit = vt_json_string(vt_json_member(like, "unit"), "");
  for (size_t i = 0; i < vt_json_count(columns); i++) {
    const vt_json *column = vt_json_item(columns, i);
    if (strcmp(vt_json_string(vt_json_member(column, "name"), ""), name)) continue;
    if (strcmp(vt_json_string(vt_json_member(column, "unit"), ""), unit)) continue;
    *index = i;
    return column;
  }
  return NULL;
}

// > 0: by how much the new one is worse than noise allows, < 0: better, 0: no change.
static double judge(const vt_json *column, double factor, vt_spread old, vt_spread new) {
  const char *better = vt_json_string(vt_json_member(column, "better"), "neither");
  if (!strcmp(better, "neither")) return 0;
  double share = vt_json_number(vt_json_member(column, "noise_share"), 0);
  double noise = fmax(fabs(old.median) * share, vt_json_number(vt_json_member(column, "noise"), 0));
  bool once = !vt_is_spread(old) && !vt_is_spread(new);
  noise *= is_time(column) && once ? 2 * factor : factor;
  double change = new.median - old.median;
  if (!(fabs(change) > noise)) return 0;
  if (old.low <= new.high &&new.low <= old.high) return 0; // the ranges overlap
  if (!strcmp(better, "one")) {                            // nearer to 1; noise holds for the distance too
    double farther = fabs(new.median - 1) - fabs(old.median - 1);
    return fabs(farther) > noise ? farther : 0;
  }
  return !strcmp(better, "less") ? change : -change;
}

static void compare_cell(vt_session *session, const char *place, const vt_json *column, double factor, vt_spread old,
                         vt_spread new, verdicts *sum) {
  const char *name = vt_json_string(vt_json_member(column, "name"), ""),
             *unit = vt_json_string(vt_json_member(column, "unit"), "");
  if (isnan(old.median) && isnan(new.median)) return;
  if (isnan(old.median) != isnan(new.median)) {
    vt_say(session, "missing  %s, %s: %s\n", place, name,
           isnan(new.median) ? "was measured, is empty now" : "is measured only now");
    sum->missing += isnan(new.median);
    return;
  }
  double verdict = judge(column, factor, old, new);
  if (verdict == 0) {
    sum->same++;
    return;
  }
  bool time = is_time(column) || !strcmp(unit, "CPU s"),
       excused = verdict > 0 && sum->busy && (is_time(column) || factor > 1);
  const char *word = verdict > 0 ? (time ? "slower " : "worse  ") : (time ? "faster " : "better ");
  vt_say(session, "%s  %s, %s: %.5g -> %.5g%s%s", word, place, name, old.median, new.median, *unit ? " " : "", unit);
  if (old.median != 0) vt_say(session, " (%+.1f %%)", 100 * (new.median - old.median) / fabs(old.median));
  vt_say(session, "%s\n", excused ? ", on a busy machine: does not count" : "");
  if (excused)
    sum->excused++;
  else
    verdict > 0 ? sum->worse++ : sum->better++;
}

// ---- tables

static void compare_rows(vt_session *session, const char *table, const vt_json *old, const vt_json *new,
                         verdicts *sum) {
  const vt_json *old_columns = vt_json_member(old, "columns"), *new_columns = vt_json_member(new, "columns");
  const vt_json *rows = vt_json_member(old, "rows");
  for (size_t r = 0; r < vt_json_count(rows); r++) {
    const vt_json *old_row = vt_json_item(rows, r);
    const char *label = vt_json_string(vt_json_member(old_row, "label"), "");
    char place[400];
    snprintf(place, sizeof place, "%s: %s", table, label);
    const vt_json *new_row = find_named(vt_json_member(new, "rows"), "label", label);
    if (!new_row) {
      vt_say(session, "missing  %s\n", place);
      sum->missing++;
      continue;
    }
    double factor = vt_json_number(vt_json_member(old_row, "noise_factor"), 1);
    for (size_t c = 0; c < vt_json_count(old_columns); c++) {
      const vt_json *column = vt_json_item(old_columns, c);
      size_t at;
      if (find_column(new_columns, column, &at))
        compare_cell(session, place, column, factor, cell_of(old_row, c), cell_of(new_row, at), sum);
    }
  }
}

static void compare_tables(vt_session *session, const vt_json *old, const vt_json *new, verdicts *sum) {
  const vt_json *tables = vt_json_member(old, "tables");
  for (size_t t = 0; t < vt_json_count(tables); t++) {
    const vt_json *table = vt_json_item(tables, t);
    const char *name = vt_json_string(vt_json_member(table, "name"), "");
    const vt_json *other = find_named(vt_json_member(new, "tables"), "name", name);
    if (other) {
      compare_rows(session, name, table, other, sum);
    } else {
      vt_say(session, "missing  %s: the whole table\n", name);
      sum->missing++;
    }
  }
}

// ---- can they be compared?

static vt_status check_alike(vt_session *session, const vt_json *old, const vt_json *new, const char *old_path,
                             const char *new_path, bool *busy) {
  vt_context *context = session->context;
  const vt_json *both[] = {old, new};
  for (int i = 0; i < 2; i++)
    if (!vt_json_is_array(vt_json_member(both[i], "tables")))
      return vt_fail(context, VT_BAD_INPUT, "%s: is no report of voltree bench; give what --json wrote",
                     i ? new_path : old_path);
  const char *old_suite = vt_json_string(vt_json_member(old, "suite"), ""),
             *new_suite = vt_json_string(vt_json_member(new, "suite"), "");
  if (strcmp(old_suite, new_suite))
    return vt_fail(context, VT_BAD_INPUT, "%s: is of the suite %s, and %s of %s; give two reports of one suite",
                   old_path, old_suite, new_path, new_suite);
  bool old_quick = vt_json_bool(vt_json_member(old, "quick"), false),
       new_quick = vt_json_bool(vt_json_member(new, "quick"), false);
  if (old_quick != new_quick)
    return vt_fail(context, VT_BAD_INPUT, "%s: was made %s --quick, the other %s; make both alike", old_path,
                   old_quick ? "with" : "without", new_quick ? "with" : "without");
  const vt_json *old_machine = vt_json_member(old, "machine"), *new_machine = vt_json_member(new, "machine");
  const char *a = vt_json_string(vt_json_member(old_machine, "processor"), ""),
             *b = vt_json_string(vt_json_member(new_machine, "processor"), "");
  double c = vt_json_number(vt_json_member(old, "threads"), 0), d = vt_json_number(vt_json_member(new, "threads"), 0);
  if (strcmp(a, b) || c != d)
    vt_say(session, "warning: other machines (%s with %.0f threads, %s with %.0f threads): times cannot be compared\n",
           a, c, b, d);
  for (int i = 0; i < 2; i++) {
    double others = vt_json_number(vt_json_member(vt_json_member(both[i], "machine"), "others_share"), 0);
    if (!(others > VT_BUSY_SHARE)) continue;
    *busy = true;
    vt_say(session, "warning: %s: other programs took %.0f %% of the machine; wall times are told but do not count\n",
           i ? new_path : old_path, 100 * others);
  }
  return VT_OK;
}

vt_status vt_compare_benches(vt_session *session, const char *old_path, const char *new_path) {
  vt_context *context = session->context;
  vt_json *old = NULL, *new = NULL;
  verdicts sum = {0};
  vt_status status = vt_read_json(context, old_path, &old);
  if (!status) status = vt_read_json(context, new_path, &new);
  if (!status) status = check_alike(session, old, new, old_path, new_path, &sum.busy);
  if (!status) {
    compare_tables(session, old, new, &sum);
    vt_say(session, "%d worse, %d better, %d unchanged, %d missing", sum.worse, sum.better, sum.same, sum.missing);
    if (sum.excused) vt_say(session, ", %d not counted", sum.excused);
    vt_say(session, "\n");
    if (sum.worse)
      status =
          vt_fail(context, VT_BELOW_QUALITY, "%s: %d figures got worse than in %s beyond noise; they are listed above",
                  new_path, sum.worse, old_path);
  }
  if (old) vt_free_json(context, old);
  if (new) vt_free_json(context, new);
  return status;
}
