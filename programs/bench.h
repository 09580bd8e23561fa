// bench.h - what the suites of voltree bench measure, and how it is kept, shown and compared
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_BENCH_H
#define VT_PROGRAMS_BENCH_H

#include "base/image.h"
#include "programs/session.h"

// A report is tables of numbers, plots over their columns, pictures and sentences, in the order in which a suite adds them.
// From it come the JSON document, one CSV file a table, and one self-contained HTML page; two of its JSON documents can be
// compared, table by table, row by row (by label), column by column.

typedef enum vt_better { VT_NEITHER_BETTER, VT_LESS_BETTER, VT_MORE_BETTER, VT_ONE_BETTER } vt_better; // ONE: nearer to 1

typedef struct vt_bench_column {
  const char *name, *unit; // "PSNR", "dB"; static strings
  vt_better better;        // what a comparison holds against it
  double noise_share;      // a change within this share of the old value, or
  double noise;            // within this amount, is no change
} vt_bench_column;

typedef struct vt_spread { double median, low, high; } vt_spread; // of repetitions

typedef struct vt_bench vt_bench;
typedef struct vt_bench_table vt_bench_table;

// ---- filling a report; running out of memory is kept and reported by vt_end_bench
vt_bench_table *vt_add_table(vt_bench *, const char *name, const char *caption, const vt_bench_column *columns,
                             int column_count); // columns: copied
void vt_add_row(vt_bench_table *, const char *label);        // labels of a table differ
void vt_set_row_noise(vt_bench_table *, double factor);      // of the last row: so many times the columns'; > 1 where the clock decides
void vt_put_value(vt_bench_table *, double value);           // the next cell of the last row; NAN: empty
void vt_put_spread(vt_bench_table *, vt_spread);             // the same, with how far it was spread
// A curve for each series (rows whose labels agree up to their first '/') if by_series, else one of all rows, in their order,
// over columns by name. Logarithmic axes skip values <= 0.
typedef struct vt_plot {
  const char *name, *caption, *x_column, *y_column;
  bool log_x, log_y, by_series;
} vt_plot;
void vt_add_plot(vt_bench *, const vt_bench_table *, const vt_plot *);
void vt_add_picture(vt_bench *, const char *caption, const vt_image *rgb);
#ifdef __GNUC__
__attribute__((format(printf, 2, 3)))
#endif
void vt_add_sentence(vt_bench *, const char *format, ...);

// ---- running
vt_session *vt_session_of(vt_bench *);
bool vt_is_quick(const vt_bench *);
// What the suite is at, for the progress bar with the time left: `done` of `total` steps of about equal length.
void vt_bench_step(vt_bench *, int done, int total);
// Runs variants 0..variant_count-1 in turn, all of them `repetitions` times (0 1 2 0 1 2 ...), so that a machine whose speed
// drifts drifts for all; seconds[variant] are medians with their lowest and highest. `run` does the timed work alone.
vt_status vt_time_in_turn(vt_bench *, int variant_count, int repetitions, vt_status (*run)(void *user, int variant),
                          void *user, vt_spread *seconds);
vt_spread vt_spread_of(double *values, int count); // sorts them
#define VT_MAX_REPETITIONS 25
int vt_repetitions_of(const vt_bench *, int usual);  // --repetitions, else what is usual here
// --sabotage: what a suite breaks on purpose, to see whether the comparison finds it. The frontier does; others need not.
typedef enum vt_sabotage { VT_NO_SABOTAGE, VT_SABOTAGE_SOLVER, VT_SABOTAGE_BLUR, VT_SABOTAGE_SLOW } vt_sabotage;
vt_sabotage vt_sabotage_of(const vt_bench *);

// ---- the suites (suite_NAME.c)
typedef struct vt_suite {
  const char *name, *summary;
  vt_status (*run)(vt_bench *);
} vt_suite;
extern const vt_suite vt_suite_frontier, vt_suite_paper, vt_suite_scaling, vt_suite_stability, vt_suite_skips;

// ---- the whole (verb_bench.c)
vt_status vt_begin_bench(vt_session *, const char *suite, vt_bench **out);
// Says the tables, writes --json, and into --report NAME.csv of each table and index.html. Frees the bench. `status`: what the
// suite returned; nothing is written unless it is VT_OK.
vt_status vt_end_bench(vt_bench *, vt_status status);
// Reads two JSON documents and says what got slower or worse beyond noise (VT_BELOW_QUALITY if anything did), what got better,
// and what is missing.
vt_status vt_compare_benches(vt_session *, const char *old_path, const char *new_path);

#endif
