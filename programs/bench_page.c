// bench_page.c - a report as one HTML page that needs nothing but itself
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/bench_data.h"

#include "programs/report.h"

#include <string.h>

static void put_table(FILE *page, const vt_bench_table *table) {
  char title[120], number[40];
  fputs("<table><thead><tr><th></th>", page);
  for (int c = 0; c < table->column_count; c++) {
    fputs("<th>", page);
    vt_put_html(page, vt_column_title(&table->columns[c], title));
    fputs("</th>", page);
  }
  fputs("</tr></thead><tbody>\n", page);
  for (int r = 0; r < table->row_count; r++) {
    fputs("<tr><th>", page);
    vt_put_html(page, table->rows[r].label);
    fputs("</th>", page);
    for (int c = 0; c < table->column_count; c++)
      fprintf(page, "<td>%s</td>", vt_show_number(vt_style_of_column(table, c), table->rows[r].cells[c].median, number));
    fputs("</tr>\n", page);
  }
  fputs("</tbody></table>\n", page);
}

vt_status vt_make_bench_page(vt_bench *bench, const vt_machine *machine, char **html, size_t *size) {
  char *text = NULL;
  FILE *page = open_memstream(&text, size);
  if (!page) return vt_fail(bench->context, VT_OUT_OF_MEMORY, "index.html: the system has no memory left; close other programs");
  fprintf(page, "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>voltree bench %s</title>\n", bench->suite);
  fprintf(page, "<h1>voltree bench %s</h1><p>%s, %d cores, %s</p>\n", bench->suite, machine->processor, machine->cores, machine->date);
  for (int i = 0; i < bench->item_count; i++) {
    const vt_bench_item *item = &bench->items[i];
    fputs(item->kind == VT_BENCH_HEADING || item->kind == VT_BENCH_TABLE ? "<h2>" : "<p>", page);
    vt_put_html(page, item->text);
    fputs(item->kind == VT_BENCH_HEADING || item->kind == VT_BENCH_TABLE ? "</h2>" : "</p>", page);
    if (item->kind == VT_BENCH_TABLE) put_table(page, item->table);
  }
  fputs("</html>\n", page);
  bool bad = ferror(page);
  bad |= fclose(page) != 0;
  *html = bad ? NULL : vt_alloc(bench->context, *size + 1, 1);
  if (*html) memcpy(*html, text, *size);
  free(text); // of open_memstream
  return *html ? VT_OK : vt_fail(bench->context, VT_OUT_OF_MEMORY, "index.html: no memory left; close other programs");
}
