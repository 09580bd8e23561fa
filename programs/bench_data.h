// bench_data.h - what a report of the bench holds, for the files that make, write, show and compare it
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_BENCH_DATA_H
#define VT_PROGRAMS_BENCH_DATA_H

#include "programs/bench.h"

#define VT_MAX_BENCH_COLUMNS 64

typedef struct vt_bench_row {
  char *label;      // owned
  vt_spread *cells; // [column_count]; owned
  int filled;
  double noise_factor;
} vt_bench_row;

struct vt_bench_table {
  vt_bench *bench;
  char *name, *caption; // owned; the name can stand in a file name
  int column_count, row_count, row_capacity;
  vt_bench_column *columns; // owned, their strings are static
  vt_bench_row *rows;       // owned
};

typedef enum vt_bench_kind {
  VT_BENCH_HEADING,
  VT_BENCH_SENTENCE,
  VT_BENCH_TABLE,
  VT_BENCH_PLOT,
  VT_BENCH_PICTURE
} vt_bench_kind;

typedef struct vt_bench_item {
  vt_bench_kind kind;
  char *text;             // heading, sentence, caption of a plot or a picture; owned
  vt_bench_table *table;  // of a table (owned) or of a plot
  int x_column, y_column; // of a plot
  bool log_x, log_y, by_series;
  char *name;       // of a plot or a picture: what it is called in the documents; owned
  vt_image picture; // owned; empty where no page will be written
} vt_bench_item;

struct vt_bench {
  vt_session *session;
  vt_context *context;
  char suite[40];
  char prefix[40]; // of the names of tables, where several suites share a report
  bool quick, failed;
  double machine_had, machine_used, own_cpu; // at the beginning: seconds of processor time
  int item_count, item_capacity;
  vt_bench_item *items; // in the order in which they were added; owned
};

// A heading over what follows: of a suite among several.
void vt_add_heading(vt_bench *, const char *text);

// ---- numbers as they are read: "" of an empty cell, bytes with their unit; `column` decides the decimals of all its
// cells
typedef struct vt_number_style {
  bool bytes;
  int decimals; // negative: so many significant digits each
} vt_number_style;
vt_number_style vt_style_of_column(const vt_bench_table *, int column);
const char *vt_show_number(vt_number_style, double value, char text[40]);
bool vt_is_spread(vt_spread); // more than one number
// "PSNR (dB)"; of bytes, whose unit stands in the cells, the name alone
const char *vt_column_title(const vt_bench_column *, char text[120]);

// ---- bench_report.c: the documents
vt_status vt_write_bench(vt_bench *);
// What a report says about the machine it was made on.
typedef struct vt_machine {
  int cores;
  uint64_t memory_bytes;
  char processor[120], simd[80], system[160], date[40];
  double others_share; // of the processor time of the whole machine that others took meanwhile; NAN where unknown
} vt_machine;
#define VT_BUSY_SHARE 0.15 // beyond it, wall time is no measure of what was run
vt_machine vt_this_machine(const vt_bench *);
// Seconds of processor time that the machine had since it was started, and those of them that were used. False if
// unknown.
bool vt_read_machine_time(double *had, double *used);

// ---- bench_page.c: the page as text; *html is freed with vt_free
vt_status vt_make_bench_page(vt_bench *, const vt_machine *, char **html, size_t *size);

// ---- bench_plot.c: a plot as inline SVG with its legend
void vt_put_plot(FILE *page, const vt_bench_item *);

#endif
