// bench_plot.c - a plot of a report as inline SVG: axes, curves, spread bars, labels of points
// SPDX-License-Identifier: BSD-3-Clause
//
// Colours are classes s0, s1, ... that the page defines for light and for dark; series keep theirs, and their marker,
// in all plots of a table. A row that has no x, such as a predictor that takes no time, is a dashed line across: what
// the curves have to beat. Labels of points are put where they cover nothing that is there already, or left out; the
// title of a point tells all.
#include "programs/bench_data.h"

#include "programs/report.h"

#include <math.h>
#include <string.h>

#define WIDTH 640.0
#define HEIGHT 420.0
#define LEFT 66.0
#define RIGHT 18.0
#define TOP 14.0
#define BOTTOM 50.0
#define LETTER 6.2 // width of a letter of a label, pixels
#define MAX_BOXES 1024
#define MAX_SERIES 24
#define COLOURS 8

typedef struct axis {
  bool log;
  double low, high; // of the values, or of their logarithms
  bool clipped;     // there are values beyond, drawn at the edge
  double from, to;  // pixels
  double unit;      // values are divided by it to be read: 1e6 where they are bytes
} axis;

typedef struct box {
  double x0, y0, x1, y1;
} box;

typedef struct plot {
  FILE *page;
  const vt_bench_item *item;
  axis x, y;
  int series_count;
  char series[MAX_SERIES][100];
  bool shown[MAX_SERIES];
  int box_count;
  box boxes[MAX_BOXES]; // what is taken
} plot;

// ---- series

static size_t series_length(const plot *p, const char *label) {
  const char *slash = strchr(label, '/');
  return !p->item->by_series ? 0 : slash ? (size_t)(slash - label) : strlen(label);
}

static int series_of(const plot *p, const char *label) {
  size_t length = series_length(p, label);
  for (int i = 0; i < p->series_count; i++)
    if (strlen(p->series[i]) == length && !memcmp(p->series[i], label, length)) return i;
  return -1;
}

static void list_series(plot *p) {
  const vt_bench_table *table = p->item->table;
  for (int r = 0; r < table->row_count && p->series_count < MAX_SERIES; r++)
    if (series_of(p, table->rows[r].label) < 0 && series_length(p, table->rows[r].label) < sizeof p->series[0])
      snprintf(p->series[p->series_count++], sizeof p->series[0], "%.*s", (int)series_length(p, table->rows[r].label),
               table->rows[r].label);
}

static const char *point_name(const plot *p, const char *label) {
  const char *slash = strchr(label, '/');
  return p->item->by_series && slash ? slash + 1 : p->item->by_series ? "" : label;
}

// ---- axes

static bool fits(const axis *a, double value) {
  return isfinite(value) && (!a->log || value > 0);
}
static double scaled(const axis *a, double value) {
  return a->log ? log10(value / a->unit) : value / a->unit;
}
static bool is_beyond(const axis *a, double value) {
  return a->clipped && !(scaled(a, value) >= a->low && scaled(a, value) <= a->high);
}
static double place(const axis *a, double value) {
  double v = scaled(a, value);
  if (a->clipped) v = fmin(fmax(v, a->low), a->high);
  return a->from + (v - a->low) / (a->high - a->low) * (a->to - a->from);
}

// Does the row show on this plot: as a point, or, where x is empty, as a line across?
static bool is_across(const plot *p, const vt_bench_row *row) {
  return isnan(row->cells[p->item->x_column].median) && fits(&p->y, row->cells[p->item->y_column].median);
}
static bool is_point(const plot *p, const vt_bench_row *row) {
  return fits(&p->x, row->cells[p->item->x_column].median) && fits(&p->y, row->cells[p->item->y_column].median);
}

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

// One that is far off would press all others together: what lies beyond twice the distance of the quartiles is drawn at
// the edge.
static void find_limits(const plot *p, const axis *a, int column, double *low, double *high) {
  const vt_bench_table *table = p->item->table;
  double values[256];
  int count = 0;
  *low = -INFINITY, *high = INFINITY;
  for (int r = 0; r < table->row_count && count < 256; r++)
    if (is_point(p, &table->rows[r]) || is_across(p, &table->rows[r]))
      values[count++] = scaled(a, table->rows[r].cells[column].median);
  if (count < 5) return;
  qsort(values, (size_t)count, sizeof *values, compare_doubles);
  double first = values[count / 4], third = values[(3 * count) / 4], reach = 2 * (third - first);
  if (reach > 0) *low = first - reach, *high = third + reach;
}

static void measure_axis(const plot *p, axis *a, int column, bool vertical) {
  const vt_bench_table *table = p->item->table;
  double least = -INFINITY, most = INFINITY;
  if (vertical) find_limits(p, a, column, &least, &most);
  a->low = INFINITY, a->high = -INFINITY;
  for (int r = 0; r < table->row_count; r++) {
    vt_spread cell = table->rows[r].cells[column];
    if (!is_point(p, &table->rows[r]) && !(vertical && is_across(p, &table->rows[r]))) continue;
    a->clipped |= scaled(a, cell.median) < least || scaled(a, cell.median) > most;
    for (int part = 0; part < 3; part++) {
      double v = scaled(a, part == 0 ? cell.median : part == 1 ? cell.low : cell.high);
      if (isfinite(v) && v >= least && v <= most) a->low = fmin(a->low, v), a->high = fmax(a->high, v);
    }
  }
  if (a->low > a->high) return;
  double pad = a->high > a->low ? 0.07 * (a->high - a->low) : a->log ? 0.3 : fmax(fabs(a->high) * 0.05, 1e-9);
  a->low -= pad, a->high += pad;
}

static double nice_step(double range) {
  double raw = range / 5, power = pow(10, floor(log10(raw))), share = raw / power;
  return power * (share < 1.5 ? 1 : share < 3.5 ? 2 : share < 7.5 ? 5 : 10);
}

// The ticks of an axis; at most 40.
static int list_ticks(const axis *a, double ticks[40]) {
  int count = 0;
  if (!a->log) {
    double step = nice_step(a->high - a->low);
    for (double i = ceil(a->low / step - 1e-9); i * step <= a->high * (1 + 1e-12) && count < 40; i++)
      ticks[count++] = i * step;
    return count;
  }
  static const double dense[] = {1, 2, 5};
  int per_decade = a->high - a->low < 2.5 ? 3 : 1, stride = a->high - a->low > 8 ? 2 : 1;
  for (int decade = (int)floor(a->low); decade <= (int)ceil(a->high); decade += stride)
    for (int i = 0; i < per_decade && count < 40; i++) {
      double at = decade + log10(dense[i]);
      if (at >= a->low && at <= a->high) ticks[count++] = pow(10, decade) * dense[i];
    }
  return count;
}

static void put_axis(plot *p, const axis *a, bool horizontal, int column) {
  double ticks[40];
  char title[120];
  int count = list_ticks(a, ticks);
  for (int i = 0; i < count; i++) {
    double at = place(a, ticks[i] * a->unit);
    if (horizontal)
      fprintf(p->page,
              "<path class=\"grid\" d=\"M%.1f %.1fV%.1f\"/><text class=\"tick\" text-anchor=\"middle\" x=\"%.1f\" "
              "y=\"%.1f\">%.6g</text>",
              at, TOP, HEIGHT - BOTTOM, at, HEIGHT - BOTTOM + 17, fabs(ticks[i]) < 1e-12 ? 0 : ticks[i]);
    else
      fprintf(p->page,
              "<path class=\"grid\" d=\"M%.1f %.1fH%.1f\"/><text class=\"tick\" text-anchor=\"end\" x=\"%.1f\" "
              "y=\"%.1f\">%.6g</text>",
              LEFT, at, WIDTH - RIGHT, LEFT - 8, at + 4, fabs(ticks[i]) < 1e-12 ? 0 : ticks[i]);
  }
  const vt_bench_column *c = &p->item->table->columns[column];
  if (a->unit > 1)
    snprintf(title, sizeof title, "%s (MB)", c->name);
  else
    vt_column_title(c, title);
  if (horizontal)
    fprintf(p->page, "<text class=\"axis\" text-anchor=\"middle\" x=\"%.1f\" y=\"%.1f\">", (LEFT + WIDTH - RIGHT) / 2,
            HEIGHT - 10);
  else
    fprintf(p->page, "<text class=\"axis\" text-anchor=\"middle\" transform=\"translate(16 %.1f)rotate(-90)\">",
            (TOP + HEIGHT - BOTTOM) / 2);
  vt_put_html(p->page, title);
  fputs("</text>\n", p->page);
}

// ---- points

static void put_marker(FILE *page, int series, double x, double y) {
  static const char *const shapes[] = {"m-4.5 0a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0 -9 0z", "m-4 -4h8v8h-8z",
                                       "m0 -5.2l5 8.6h-10z", "m0 -5.6l5.6 5.6l-5.6 5.6l-5.6 -5.6z",
                                       "m0 5.2l5 -8.6h-10z"};
  fprintf(page, "<path class=\"point s%d\" d=\"M%.1f %.1f%s\"", series % COLOURS, x, y, shapes[series % 5]);
}

static void take_box(plot *p, double x0, double y0, double x1, double y1) {
  if (p->box_count < MAX_BOXES) p->boxes[p->box_count++] = (box){x0, y0, x1, y1};
}

static bool is_free(const plot *p, double x0, double y0, double x1, double y1) {
  if (x0 < LEFT || x1 > WIDTH - 2 || y0 < 2 || y1 > HEIGHT - BOTTOM) return false;
  for (int i = 0; i < p->box_count; i++) {
    const box *b = &p->boxes[i];
    if (x0 < b->x1 && b->x0 < x1 && y0 < b->y1 && b->y0 < y1) return false;
  }
  return true;
}

static void put_label(plot *p, const char *text, int series, double x, double y) {
  double width = LETTER * (double)strlen(text);
  const double corners[][2] = {{x + 9, y - 6},          {x - 9 - width, y - 6}, {x - width / 2, y - 20},
                               {x - width / 2, y + 8},  {x + 7, y - 17},        {x + 7, y + 5},
                               {x - 7 - width, y - 17}, {x - 7 - width, y + 5}};
  if (!*text) return;
  for (size_t i = 0; i < sizeof corners / sizeof *corners; i++) {
    double left = corners[i][0], top = corners[i][1];
    if (!is_free(p, left, top, left + width, top + 12)) continue;
    take_box(p, left, top, left + width, top + 12);
    fprintf(p->page, "<text class=\"label t%d\" x=\"%.1f\" y=\"%.1f\">", series % COLOURS, left, top + 10);
    vt_put_html(p->page, text);
    fputs("</text>", p->page);
    return;
  }
}

static void take_bars(plot *p, double x, double y, vt_spread at_x, vt_spread at_y) {
  if (vt_is_spread(at_x) && fits(&p->x, at_x.low))
    take_box(p, place(&p->x, at_x.low), y - 3, place(&p->x, at_x.high), y + 3);
  if (vt_is_spread(at_y) && fits(&p->y, at_y.low))
    take_box(p, x - 3, place(&p->y, at_y.high), x + 3, place(&p->y, at_y.low));
}

static void put_bars(plot *p, int series, double x, double y, vt_spread at_x, vt_spread at_y) {
  if (vt_is_spread(at_x) && fits(&p->x, at_x.low))
    fprintf(p->page, "<path class=\"bar s%d\" d=\"M%.1f %.1fH%.1fm0 -3v6M%.1f %.1fv6\"/>", series % COLOURS,
            place(&p->x, at_x.low), y, place(&p->x, at_x.high), place(&p->x, at_x.low), y - 3);
  if (vt_is_spread(at_y) && fits(&p->y, at_y.low))
    fprintf(p->page, "<path class=\"bar s%d\" d=\"M%.1f %.1fV%.1fm-3 0h6M%.1f %.1fh6\"/>", series % COLOURS, x,
            place(&p->y, at_y.low), place(&p->y, at_y.high), x - 3, place(&p->y, at_y.low));
}

static void put_point(plot *p, const vt_bench_row *row, int series) {
  const vt_bench_item *item = p->item;
  char x_text[40], y_text[40];
  vt_spread x = row->cells[item->x_column], y = row->cells[item->y_column];
  double px = place(&p->x, x.median), py = place(&p->y, y.median);
  put_bars(p, series, px, py, x, y);
  put_marker(p->page, series, px, py);
  fputs("><title>", p->page);
  vt_put_html(p->page, row->label);
  fprintf(p->page, ": %s, %s</title></path>",
          vt_show_number(vt_style_of_column(item->table, item->x_column), x.median, x_text),
          vt_show_number(vt_style_of_column(item->table, item->y_column), y.median, y_text));
}

// Lines of the series, and what has no x.
static void put_lines(plot *p, int series) {
  const vt_bench_item *item = p->item;
  const vt_bench_table *table = item->table;
  int count = 0;
  for (int r = 0; r < table->row_count; r++) {
    if (series_of(p, table->rows[r].label) != series) continue;
    double x = table->rows[r].cells[item->x_column].median, y = table->rows[r].cells[item->y_column].median;
    if (!fits(&p->y, y)) continue;
    if (isnan(x)) {
      double at = place(&p->y, y);
      fprintf(p->page, "<path class=\"across s%d\" d=\"M%.1f %.1fH%.1f\"/>", series % COLOURS, LEFT, at, WIDTH - RIGHT);
      take_box(p, LEFT, at - 2, WIDTH - RIGHT, at + 2);
      p->shown[series] = true;
    } else if (fits(&p->x, x)) {
      if (count++ == 0) fprintf(p->page, "<path class=\"line s%d\" d=\"M", series % COLOURS);
      fprintf(p->page, "%s%.1f %.1f", count > 1 ? "L" : "", place(&p->x, x), place(&p->y, y));
      take_box(p, place(&p->x, x) - 5, place(&p->y, y) - 5, place(&p->x, x) + 5, place(&p->y, y) + 5);
      take_bars(p, place(&p->x, x), place(&p->y, y), table->rows[r].cells[item->x_column],
                table->rows[r].cells[item->y_column]);
      p->shown[series] = true;
    }
  }
  if (count) fputs("\"/>", p->page);
}

static void put_series(plot *p) {
  const vt_bench_table *table = p->item->table;
  for (int s = 0; s < p->series_count; s++) put_lines(p, s);
  for (int r = 0; r < table->row_count; r++) {
    int series = series_of(p, table->rows[r].label);
    if (series >= 0 && is_point(p, &table->rows[r])) put_point(p, &table->rows[r], series);
  }
  for (int r = 0; r < table->row_count; r++) {
    const vt_bench_row *row = &table->rows[r];
    double x = row->cells[p->item->x_column].median, y = row->cells[p->item->y_column].median;
    int series = series_of(p, row->label);
    bool point = is_point(p, row);
    if (series < 0 || (!point && !is_across(p, row))) continue;
    char beyond[160], number[40];
    snprintf(beyond, sizeof beyond, "%s: %s, beyond", row->label,
             vt_show_number(vt_style_of_column(table, p->item->y_column), y, number));
    const char *name = is_beyond(&p->y, y) ? beyond : point ? point_name(p, row->label) : row->label;
    put_label(p, name, series, point ? place(&p->x, x) : LEFT + 4, place(&p->y, y));
  }
}

static void put_legend(plot *p) {
  if (p->series_count < 2) return;
  fputs("<ul class=\"legend\">", p->page);
  for (int s = 0; s < p->series_count; s++) {
    if (!p->shown[s]) continue;
    fputs("<li><svg width=\"14\" height=\"14\" viewBox=\"0 0 14 14\" aria-hidden=\"true\">", p->page);
    put_marker(p->page, s, 7, 7);
    fputs("/></svg>", p->page);
    vt_put_html(p->page, p->series[s]);
    fputs("</li>", p->page);
  }
  fputs("</ul>\n", p->page);
}

void vt_put_plot(FILE *page, const vt_bench_item *item) {
  plot p = {.page = page, .item = item};
  const vt_bench_column *columns = item->table->columns;
  p.x = (axis){.log = item->log_x,
               .from = LEFT,
               .to = WIDTH - RIGHT,
               .unit = strcmp(columns[item->x_column].unit, "bytes") ? 1 : 1e6};
  p.y = (axis){.log = item->log_y,
               .from = HEIGHT - BOTTOM,
               .to = TOP,
               .unit = strcmp(columns[item->y_column].unit, "bytes") ? 1 : 1e6};
  list_series(&p);
  measure_axis(&p, &p.x, item->x_column, false);
  measure_axis(&p, &p.y, item->y_column, true);
  fputs("<figure class=\"plot\"><figcaption>", page);
  vt_put_html(page, item->text);
  fputs("</figcaption>\n", page);
  if (p.x.low > p.x.high || p.y.low > p.y.high) {
    fputs("<p>Nothing to plot: no row has both values.</p></figure>\n", page);
    return;
  }
  fprintf(page, "<svg viewBox=\"0 0 %.0f %.0f\" role=\"img\" aria-label=\"", WIDTH, HEIGHT);
  vt_put_html(page, item->text);
  fputs("\">\n", page);
  put_axis(&p, &p.x, true, item->x_column);
  put_axis(&p, &p.y, false, item->y_column);
  fprintf(page, "<path class=\"frame\" d=\"M%.1f %.1fV%.1fH%.1f\"/>\n", LEFT, TOP, HEIGHT - BOTTOM, WIDTH - RIGHT);
  put_series(&p);
  fputs("\n</svg>\n", page);
  put_legend(&p);
  fputs("</figure>\n", page);
}
