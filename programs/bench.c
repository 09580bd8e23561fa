// bench.c - filling a report of the bench: tables, spreads, plots, pictures, and timing in turn
// SPDX-License-Identifier: BSD-3-Clause
//
// A suite adds and never checks: what could not be kept for want of memory is remembered and refused at the end, so
// that the code of a suite reads like the experiment it is. Times are taken in turn, 0 1 2 0 1 2: a machine that is
// shared, warms up or clocks down changes its speed within seconds, and two variants measured one after the other would
// carry that as if it were theirs. The median of few repetitions is robust against one that was disturbed; the lowest
// and the highest are kept, since a difference is only believed where the ranges are apart.
#include "programs/bench_data.h"

#include "programs/report.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

// ---- items

static vt_bench_item *add_item(vt_bench *bench, vt_bench_kind kind, const char *text) {
  if (bench->item_count == bench->item_capacity) {
    int wanted = 2 * bench->item_capacity + 16;
    vt_bench_item *more = vt_realloc(bench->context, bench->items, (size_t)wanted, sizeof *more);
    if (!more) {
      bench->failed = true;
      return NULL;
    }
    bench->items = more;
    bench->item_capacity = wanted;
  }
  vt_bench_item *item = &bench->items[bench->item_count];
  *item = (vt_bench_item){.kind = kind, .text = vt_strdup(bench->context, text)};
  if (!item->text) {
    bench->failed = true;
    return NULL;
  }
  bench->item_count++;
  return item;
}

void vt_add_heading(vt_bench *bench, const char *text) {
  add_item(bench, VT_BENCH_HEADING, text);
}

void vt_add_sentence(vt_bench *bench, const char *format, ...) {
  char text[2000];
  va_list list;
  va_start(list, format);
  vsnprintf(text, sizeof text, format, list);
  va_end(list);
  add_item(bench, VT_BENCH_SENTENCE, text);
}

void vt_add_picture(vt_bench *bench, const char *caption, const vt_image *rgb) {
  VT_ASSERT(rgb->channels == 3);
  vt_bench_item *item = add_item(bench, VT_BENCH_PICTURE, caption);
  if (!item) return;
  int number = 0;
  for (int i = 0; i < bench->item_count; i++) number += bench->items[i].kind == VT_BENCH_PICTURE;
  item->name = vt_print_text(bench->context, "picture_%02d", number);
  bench->failed |= !item->name;
  if (!bench->session->report) return;
  if (vt_make_image(bench->context, rgb->width, rgb->height, 3, &item->picture))
    bench->failed = true;
  else
    memcpy(item->picture.pixels, rgb->pixels, (size_t)rgb->width * (size_t)rgb->height * 3);
}

// ---- tables

vt_bench_table *vt_add_table(vt_bench *bench, const char *name, const char *caption, const vt_bench_column *columns,
                             int column_count) {
  VT_ASSERT(column_count > 0 && column_count <= VT_MAX_BENCH_COLUMNS);
  vt_context *context = bench->context;
  vt_bench_item *item = add_item(bench, VT_BENCH_TABLE, caption);
  if (!item) return NULL;
  vt_bench_table *table = VT_NEW(context, vt_bench_table, 1);
  if (!table) goto failed;
  item->table = table;
  table->bench = bench;
  char plain[100];
  vt_plain_name(name, plain, sizeof plain);
  table->name = vt_print_text(context, "%s%s", bench->prefix, plain);
  table->caption = vt_strdup(context, caption);
  table->columns = VT_NEW(context, vt_bench_column, (size_t)column_count);
  if (!table->name || !table->caption || !table->columns) goto failed;
  memcpy(table->columns, columns, (size_t)column_count * sizeof *columns);
  table->column_count = column_count;
  for (int i = 0; i < bench->item_count; i++)
    VT_ASSERT(bench->items[i].kind != VT_BENCH_TABLE || bench->items[i].table == table ||
              strcmp(bench->items[i].table->name, table->name));
  return table;
failed:
  bench->failed = true;
  return NULL;
}

void vt_add_row(vt_bench_table *table, const char *label) {
  if (!table) return;
  vt_context *context = table->bench->context;
  for (int i = 0; i < table->row_count; i++) VT_ASSERT(strcmp(table->rows[i].label, label));
  if (table->row_count == table->row_capacity) {
    int wanted = 2 * table->row_capacity + 8;
    vt_bench_row *more = vt_realloc(context, table->rows, (size_t)wanted, sizeof *more);
    if (!more) {
      table->bench->failed = true;
      return;
    }
    table->rows = more;
    table->row_capacity = wanted;
  }
  vt_bench_row *row = &table->rows[table->row_count];
  row->label = vt_strdup(context, label);
  row->cells = VT_NEW(context, vt_spread, (size_t)table->column_count);
  row->filled = 0;
  row->noise_factor = 1;
  if (!row->label || !row->cells) {
    vt_free(context, row->label);
    vt_free(context, row->cells);
    table->bench->failed = true;
    return;
  }
  for (int c = 0; c < table->column_count; c++) row->cells[c] = (vt_spread){NAN, NAN, NAN};
  table->row_count++;
}

void vt_set_row_noise(vt_bench_table *table, double factor) {
  if (table && table->row_count) table->rows[table->row_count - 1].noise_factor = factor;
}

void vt_put_spread(vt_bench_table *table, vt_spread value) {
  if (!table || table->bench->failed) return;
  VT_ASSERT(table->row_count > 0);
  vt_bench_row *row = &table->rows[table->row_count - 1];
  VT_ASSERT(row->filled < table->column_count);
  row->cells[row->filled++] = value;
}

void vt_put_value(vt_bench_table *table, double value) {
  vt_put_spread(table, (vt_spread){value, value, value});
}

static int find_column(const vt_bench_table *table, const char *name) {
  int c = 0;
  while (c < table->column_count && strcmp(table->columns[c].name, name)) c++;
  VT_ASSERT(c < table->column_count); // a plot is over columns that its table has
  return c;
}

void vt_add_plot(vt_bench *bench, const vt_bench_table *table, const vt_plot *plot) {
  if (!table) return;
  vt_bench_item *item = add_item(bench, VT_BENCH_PLOT, plot->caption);
  if (!item) return;
  item->name = vt_print_text(bench->context, "%s%s", bench->prefix, plot->name);
  bench->failed |= !item->name;
  for (int i = 0; i < bench->item_count; i++)
    if (bench->items[i].table == table) item->table = bench->items[i].table;
  item->x_column = find_column(table, plot->x_column);
  item->y_column = find_column(table, plot->y_column);
  item->log_x = plot->log_x, item->log_y = plot->log_y, item->by_series = plot->by_series;
}

// ---- numbers

bool vt_is_spread(vt_spread value) {
  return value.low < value.high;
}

// Enough decimals for four significant digits of the largest; columns that span more than two decades go without.
vt_number_style vt_style_of_column(const vt_bench_table *table, int column) {
  const char *unit = table->columns[column].unit;
  vt_number_style style = {.bytes = !strcmp(unit, "bytes"), .decimals = 0};
  double low = INFINITY, high = 0;
  bool whole = true;
  for (int r = 0; r < table->row_count; r++) {
    double value = fabs(table->rows[r].cells[column].median);
    if (!isfinite(value) || value == 0) continue;
    low = fmin(low, value), high = fmax(high, value);
    whole &= value == floor(value);
  }
  if (whole || high == 0) return style;
  bool time = !strcmp(unit, "s") || !strcmp(unit, "ms") || !strcmp(unit, "CPU s");
  if (low < high / 100 || high < 1e-4 || time) {
    style.decimals = time ? -3 : -4;
    return style;
  }
  int digits = (int)floor(log10(high)) + 1;
  style.decimals = digits >= 4 ? 0 : 4 - digits;
  return style;
}

const char *vt_show_number(vt_number_style style, double value, char text[40]) {
  if (isnan(value))
    *text = 0;
  else if (style.bytes && value >= 0 && value < 1e18)
    vt_show_bytes((uint64_t)value, text);
  else if (style.decimals >= 0)
    snprintf(text, 40, "%.*f", style.decimals, value);
  else if (fabs(value) >= 1000 && fabs(value) < 1e7)
    snprintf(text, 40, "%.0f", value);
  else
    snprintf(text, 40, "%.*g", -style.decimals, value);
  return text;
}

const char *vt_column_title(const vt_bench_column *column, char text[120]) {
  const char *unit =
      strncmp(column->name, "CPU", 3) || strcmp(column->unit, "CPU s") ? column->unit : "s"; // CPU said once
  if (*unit && strcmp(unit, "bytes"))
    snprintf(text, 120, "%s (%s)", column->name, unit);
  else
    snprintf(text, 120, "%s", column->name);
  return text;
}

// ---- running

vt_session *vt_session_of(vt_bench *bench) {
  return bench->session;
}
bool vt_is_quick(const vt_bench *bench) {
  return bench->quick;
}

int vt_repetitions_of(const vt_bench *bench, int usual) {
  return vt_integer_of(&bench->session->arguments, "repetitions", usual);
}

vt_sabotage vt_sabotage_of(const vt_bench *bench) {
  return (vt_sabotage)(1 + vt_choice_of(&bench->session->arguments, "sabotage", -1));
}

void vt_bench_step(vt_bench *bench, int done, int total) {
  VT_ASSERT(total > 0 && done >= 0);
  vt_progress(bench->context, bench->suite, fmin((double)done / total, 0.999));
}

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

vt_spread vt_spread_of(double *values, int count) {
  VT_ASSERT(count > 0);
  qsort(values, (size_t)count, sizeof *values, compare_doubles);
  double median = count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
  return (vt_spread){median, values[0], values[count - 1]};
}

vt_status vt_time_in_turn(vt_bench *bench, int variant_count, int repetitions,
                          vt_status (*run)(void *user, int variant), void *user, vt_spread *seconds) {
  VT_ASSERT(variant_count > 0 && repetitions > 0);
  vt_context *context = bench->context;
  double *times = VT_NEW(context, double, (size_t)variant_count *(size_t)repetitions);
  vt_status status = times ? VT_OK : VT_OUT_OF_MEMORY;
  for (int r = 0; r < repetitions && !status; r++)
    for (int v = 0; v < variant_count && !status; v++) {
      double start = vt_seconds();
      status = run(user, v);
      times[v * repetitions + r] = vt_seconds() - start;
      if (!status && vt_cancelled(context)) status = vt_fail(context, VT_CANCELLED, "interrupted: run it again");
    }
  for (int v = 0; v < variant_count && !status; v++) seconds[v] = vt_spread_of(times + v * repetitions, repetitions);
  vt_free(context, times);
  return status;
}

// ---- beginning and end

vt_status vt_begin_bench(vt_session *session, const char *suite, vt_bench **out) {
  vt_bench *bench = VT_NEW(session->context, vt_bench, 1);
  if (!bench) return VT_OUT_OF_MEMORY;
  bench->session = session;
  bench->context = session->context;
  bench->quick = vt_given(&session->arguments, "quick");
  snprintf(bench->suite, sizeof bench->suite, "%s", suite);
  vt_hold_progress(bench->context, bench->suite);
  if (!vt_read_machine_time(&bench->machine_had, &bench->machine_used)) bench->machine_had = NAN;
  bench->own_cpu = vt_cpu_seconds();
  *out = bench;
  return VT_OK;
}

static void free_table(vt_context *context, vt_bench_table *table) {
  if (!table) return;
  for (int r = 0; r < table->row_count; r++) {
    vt_free(context, table->rows[r].label);
    vt_free(context, table->rows[r].cells);
  }
  vt_free(context, table->rows);
  vt_free(context, table->columns);
  vt_free(context, table->caption);
  vt_free(context, table->name);
  vt_free(context, table);
}

// "0.879 ~35%": the median, and half the range as a share of it.
static const char *say_cell(vt_number_style style, vt_spread cell, char text[80]) {
  char number[40];
  double share = cell.median != 0 ? 50 * (cell.high - cell.low) / fabs(cell.median) : 0;
  if (vt_is_spread(cell) && share >= 0.5)
    snprintf(text, 80, "%s ~%.0f%%", vt_show_number(style, cell.median, number), share);
  else
    snprintf(text, 80, "%s", vt_show_number(style, cell.median, number));
  return text;
}

static void say_table(vt_session *session, const vt_bench_table *table) {
  int widths[VT_MAX_BENCH_COLUMNS], label_width = 12;
  char title[120], text[80];
  for (int r = 0; r < table->row_count; r++)
    if ((int)strlen(table->rows[r].label) > label_width) label_width = (int)strlen(table->rows[r].label);
  vt_say(session, "\n%s\n%-*s", table->caption, label_width, "");
  for (int c = 0; c < table->column_count; c++) {
    vt_number_style style = vt_style_of_column(table, c);
    widths[c] = (int)strlen(vt_column_title(&table->columns[c], title));
    for (int r = 0; r < table->row_count; r++) {
      int length = (int)strlen(say_cell(style, table->rows[r].cells[c], text));
      if (length > widths[c]) widths[c] = length;
    }
    vt_say(session, "  %*s", widths[c], title);
  }
  vt_say(session, "\n");
  for (int r = 0; r < table->row_count; r++) {
    vt_say(session, "%-*s", label_width, table->rows[r].label);
    for (int c = 0; c < table->column_count; c++)
      vt_say(session, "  %*s", widths[c], say_cell(vt_style_of_column(table, c), table->rows[r].cells[c], text));
    vt_say(session, "\n");
  }
}

static void say_bench(const vt_bench *bench) {
  for (int i = 0; i < bench->item_count; i++) {
    const vt_bench_item *item = &bench->items[i];
    if (item->kind == VT_BENCH_HEADING) vt_say(bench->session, "\n==== %s\n", item->text);
    if (item->kind == VT_BENCH_SENTENCE) vt_say(bench->session, "%s\n", item->text);
    if (item->kind == VT_BENCH_TABLE) say_table(bench->session, item->table);
  }
}

vt_status vt_end_bench(vt_bench *bench, vt_status status) {
  vt_context *context = bench->context;
  vt_progress(context, bench->suite, 1);
  vt_hold_progress(context, NULL);
  if (!status && bench->failed) status = VT_OUT_OF_MEMORY; // its sentence was kept when it happened
  if (!status) {
    say_bench(bench);
    status = vt_write_bench(bench);
  }
  for (int i = 0; i < bench->item_count; i++) {
    vt_bench_item *item = &bench->items[i];
    if (item->kind == VT_BENCH_TABLE) free_table(context, item->table);
    vt_free_image(context, &item->picture);
    vt_free(context, item->name);
    vt_free(context, item->text);
  }
  vt_free(context, bench->items);
  vt_free(context, bench);
  return status;
}
