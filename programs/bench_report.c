// bench_report.c - the documents of a report: JSON for programs and for the comparison, CSV for spreadsheets
// SPDX-License-Identifier: BSD-3-Clause
//
// Times say nothing without the machine, so the JSON document names it: two reports of different machines cannot be
// compared in time. A cell is a number, or null; where it is the median of several, `low` and `high` of its row hold
// the range.
#include "programs/bench_data.h"

#include "base/file.h"
#include "base/image_file.h"
#include "programs/report.h"

#include <math.h>
#include <string.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

// ---- the machine

static void read_processor(char *out, size_t size) {
  snprintf(out, size, "unknown");
  FILE *file = fopen("/proc/cpuinfo", "r"); // Linux only; elsewhere it stays unknown
  char line[400];
  while (file && fgets(line, sizeof line, file)) {
    char *colon = strchr(line, ':');
    if (strncmp(line, "model name", 10) || !colon) continue;
    colon += 1 + strspn(colon + 1, " \t");
    snprintf(out, size, "%.*s", (int)strcspn(colon, "\n"), colon);
    break;
  }
  if (file) fclose(file);
}

static void list_simd(char *out, size_t size) {
  snprintf(out, size, "none known");
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__i386__))
  __builtin_cpu_init();
  snprintf(out, size, "SSE2%s%s%s%s", __builtin_cpu_supports("sse4.2") ? " SSE4.2" : "",
           __builtin_cpu_supports("avx2") ? " AVX2" : "", __builtin_cpu_supports("fma") ? " FMA" : "",
           __builtin_cpu_supports("avx512f") ? " AVX512F" : "");
#elif defined(__ARM_NEON)
  snprintf(out, size, "NEON");
#endif
}

bool vt_read_machine_time(double *had, double *used) {
  FILE *file = fopen("/proc/stat", "r");
  double ticks[8] = {0}; // user, nice, system, idle, waiting, ...
  bool known = file && fscanf(file, "cpu %lf %lf %lf %lf %lf %lf %lf %lf", &ticks[0], &ticks[1], &ticks[2], &ticks[3],
                              &ticks[4], &ticks[5], &ticks[6], &ticks[7]) == 8;
  if (file) fclose(file);
  long rate = sysconf(_SC_CLK_TCK);
  *had = *used = 0;
  for (int i = 0; i < 8; i++) *had += ticks[i] / (double)(rate > 0 ? rate : 100);
  *used = *had - (ticks[3] + ticks[4]) / (double)(rate > 0 ? rate : 100);
  return known;
}

// Peers count as others; they run while nothing of ours is timed.
static double find_others_share(const vt_bench *bench) {
  double had, used;
  if (!vt_read_machine_time(&had, &used) || !(had > bench->machine_had)) return NAN;
  double others = used - bench->machine_used - (vt_cpu_seconds() - bench->own_cpu);
  return fmax(others, 0) / (had - bench->machine_had);
}

vt_machine vt_this_machine(const vt_bench *bench) {
  vt_machine machine = {.others_share = find_others_share(bench)};
  long cores = sysconf(_SC_NPROCESSORS_ONLN), pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  machine.cores = cores > 0 ? (int)cores : 1;
  machine.memory_bytes = pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page : 0;
  read_processor(machine.processor, sizeof machine.processor);
  list_simd(machine.simd, sizeof machine.simd);
  struct utsname name;
  if (!uname(&name))
    snprintf(machine.system, sizeof machine.system, "%.40s %.60s %.40s", name.sysname, name.release, name.machine);
  time_t now = time(NULL);
  struct tm parts;
  if (gmtime_r(&now, &parts)) strftime(machine.date, sizeof machine.date, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return machine;
}

static void put_machine(vt_json_writer *json, const vt_machine *machine) {
  vt_json_put_string(json, "date", machine->date);
  vt_json_open_object(json, "machine");
  vt_json_put_string(json, "processor", machine->processor);
  vt_json_put_integer(json, "cores", machine->cores);
  vt_json_put_string(json, "simd", machine->simd);
  vt_json_put_integer(json, "memory_bytes", (long long)machine->memory_bytes);
  vt_json_put_string(json, "system", machine->system);
  vt_json_put_number(json, "others_share", machine->others_share);
#ifdef __VERSION__
  vt_json_put_string(json, "compiler", __VERSION__);
#endif
  vt_json_close_object(json);
}

// ---- JSON

static const char *better_word(vt_better better) {
  static const char *const words[] = {"neither", "less", "more", "one"};
  return words[better];
}

static void put_numbers(vt_json_writer *json, const char *key, const vt_bench_row *row, int count, int which) {
  vt_json_open_array(json, key);
  for (int c = 0; c < count; c++) {
    const vt_spread *cell = &row->cells[c];
    vt_json_put_number(json, NULL, which == 0 ? cell->median : which < 0 ? cell->low : cell->high);
  }
  vt_json_close_array(json);
}

static void put_table(vt_json_writer *json, const vt_bench_table *table) {
  vt_json_open_object(json, NULL);
  vt_json_put_string(json, "name", table->name);
  vt_json_put_string(json, "caption", table->caption);
  vt_json_open_array(json, "columns");
  for (int c = 0; c < table->column_count; c++) {
    const vt_bench_column *column = &table->columns[c];
    vt_json_open_object(json, NULL);
    vt_json_put_string(json, "name", column->name);
    vt_json_put_string(json, "unit", column->unit);
    vt_json_put_string(json, "better", better_word(column->better));
    vt_json_put_number(json, "noise_share", column->noise_share);
    vt_json_put_number(json, "noise", column->noise);
    vt_json_close_object(json);
  }
  vt_json_close_array(json);
  vt_json_open_array(json, "rows");
  for (int r = 0; r < table->row_count; r++) {
    const vt_bench_row *row = &table->rows[r];
    bool spread = false;
    for (int c = 0; c < table->column_count; c++) spread |= vt_is_spread(row->cells[c]);
    vt_json_open_object(json, NULL);
    vt_json_put_string(json, "label", row->label);
    if (row->noise_factor != 1) vt_json_put_number(json, "noise_factor", row->noise_factor);
    put_numbers(json, "values", row, table->column_count, 0);
    if (spread) put_numbers(json, "low", row, table->column_count, -1);
    if (spread) put_numbers(json, "high", row, table->column_count, 1);
    vt_json_close_object(json);
  }
  vt_json_close_array(json);
  vt_json_close_object(json);
}

static void put_plots(vt_json_writer *json, const vt_bench *bench) {
  vt_json_open_array(json, "plots");
  for (int i = 0; i < bench->item_count; i++) {
    const vt_bench_item *item = &bench->items[i];
    if (item->kind != VT_BENCH_PLOT) continue;
    vt_json_open_object(json, NULL);
    vt_json_put_string(json, "name", item->name);
    vt_json_put_string(json, "caption", item->text);
    vt_json_put_string(json, "table", item->table->name);
    vt_json_put_string(json, "x", item->table->columns[item->x_column].name);
    vt_json_put_string(json, "y", item->table->columns[item->y_column].name);
    vt_json_put_bool(json, "log_x", item->log_x);
    vt_json_put_bool(json, "log_y", item->log_y);
    vt_json_close_object(json);
  }
  vt_json_close_array(json);
}

static void put_texts(vt_json_writer *json, const char *key, const vt_bench *bench, vt_bench_kind kind) {
  vt_json_open_array(json, key);
  for (int i = 0; i < bench->item_count; i++)
    if (bench->items[i].kind == kind) vt_json_put_string(json, NULL, bench->items[i].text);
  vt_json_close_array(json);
}

static vt_status make_document(vt_bench *bench, const vt_machine *machine, char **text, size_t *size) {
  static const char *const sabotages[] = {"none", "solver", "blur", "slow"};
  vt_json_writer json = vt_begin_report(bench->session);
  vt_json_put_string(&json, "suite", bench->suite);
  vt_json_put_bool(&json, "quick", bench->quick);
  vt_json_put_string(&json, "sabotage", sabotages[vt_sabotage_of(bench)]);
  put_machine(&json, machine);
  put_texts(&json, "sentences", bench, VT_BENCH_SENTENCE);
  vt_json_open_array(&json, "tables");
  for (int i = 0; i < bench->item_count; i++)
    if (bench->items[i].kind == VT_BENCH_TABLE) put_table(&json, bench->items[i].table);
  vt_json_close_array(&json);
  put_plots(&json, bench);
  put_texts(&json, "pictures", bench, VT_BENCH_PICTURE);
  return vt_close_report(bench->session, &json, text, size);
}

// ---- CSV

static void put_field(FILE *file, const char *text) {
  if (!strpbrk(text, ",\"\r\n")) {
    fputs(text, file);
    return;
  }
  fputc('"', file);
  for (; *text; text++) {
    if (*text == '"') fputc('"', file);
    fputc(*text, file);
  }
  fputc('"', file);
}

// Columns whose cells have ranges are followed by two more with their ends.
static void print_csv(FILE *file, const vt_bench_table *table) {
  bool ranged[VT_MAX_BENCH_COLUMNS] = {false};
  fputs("label", file);
  for (int c = 0; c < table->column_count; c++) {
    char title[160];
    const vt_bench_column *column = &table->columns[c];
    for (int r = 0; r < table->row_count; r++) ranged[c] |= vt_is_spread(table->rows[r].cells[c]);
    for (int part = 0; part < (ranged[c] ? 3 : 1); part++) {
      snprintf(title, sizeof title, "%s%s%s%s%s", column->name,
               part == 0   ? ""
               : part == 1 ? " low"
                           : " high",
               *column->unit ? " (" : "", column->unit, *column->unit ? ")" : "");
      fputc(',', file);
      put_field(file, title);
    }
  }
  fputs("\r\n", file); // RFC 4180
  for (int r = 0; r < table->row_count; r++) {
    put_field(file, table->rows[r].label);
    for (int c = 0; c < table->column_count; c++)
      for (int part = 0; part < (ranged[c] ? 3 : 1); part++) {
        vt_spread cell = table->rows[r].cells[c];
        double value = part == 0 ? cell.median : part == 1 ? cell.low : cell.high;
        fputc(',', file);
        if (value == value) fprintf(file, "%.9g", value);
      }
    fputs("\r\n", file);
  }
}

static vt_status write_csv(vt_bench *bench, const vt_bench_table *table) {
  vt_context *context = bench->context;
  char *text = NULL;
  size_t size = 0;
  FILE *file = open_memstream(&text, &size);
  if (file) print_csv(file, table);
  bool bad = !file || ferror(file);
  if (file && fclose(file)) bad = true;
  char *path = vt_print_text(context, "%s/%s.csv", bench->session->report, table->name);
  vt_status status = bad    ? vt_fail(context, VT_OUT_OF_MEMORY,
                                      "%s.csv: the system has no memory left; close other programs", table->name)
                     : path ? vt_write_file(context, path, text, size)
                            : VT_OUT_OF_MEMORY;
  vt_free(context, path);
  free(text); // of open_memstream
  return status;
}

// ---- the folder

static vt_status write_folder(vt_bench *bench, const vt_machine *machine) {
  vt_context *context = bench->context;
  vt_status status = VT_OK;
  for (int i = 0; i < bench->item_count && !status; i++) {
    const vt_bench_item *item = &bench->items[i];
    if (item->kind == VT_BENCH_TABLE) status = write_csv(bench, item->table);
    if (item->kind != VT_BENCH_PICTURE || vt_is_output_name("a.png", true)) continue; // PNG goes into the page itself
    char *path = vt_print_text(context, "%s/%s.%s", bench->session->report, item->name, vt_picture_ending());
    status = path ? vt_write_image(context, path, &item->picture) : VT_OUT_OF_MEMORY;
    vt_free(context, path);
  }
  char *html = NULL;
  size_t size = 0;
  if (!status) status = vt_make_bench_page(bench, machine, &html, &size);
  if (!status) status = vt_write_page(bench->session, html, size);
  vt_free(context, html);
  return status;
}

vt_status vt_write_bench(vt_bench *bench) {
  vt_machine machine = vt_this_machine(bench);
  char *text = NULL;
  size_t size = 0;
  vt_status status = make_document(bench, &machine, &text, &size);
  if (!status) status = vt_write_report(bench->session, text, size);
  if (!status && bench->session->report) status = write_folder(bench, &machine);
  vt_free(bench->context, text);
  return status;
}
