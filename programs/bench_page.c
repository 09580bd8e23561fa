// bench_page.c - a report as one HTML page that needs nothing but itself
// SPDX-License-Identifier: BSD-3-Clause
//
// The page is sent by mail, kept as an artefact of CI and opened years later: no script, no font, no picture comes from
// elsewhere. Plots are inline SVG (bench_plot.c), pictures are PNG in base64. Colours follow the reader's choice of
// light or dark.
#include "programs/bench_data.h"

#include "base/base64.h"
#include "base/image_file.h"
#include "programs/report.h"

#include <string.h>

static const char style[] =
    ":root{color-scheme:light dark;--paper:#fcfcfb;--ink:#1d1d1b;--soft:#6a6963;--line:#d9d8d2;--faint:#efeeea;"
    "--c0:#0067a8;--c1:#c8500a;--c2:#2d8a4e;--c3:#a2418c;--c4:#8a6d00;--c5:#3f8fb5;--c6:#6d6d6d;--c7:#8c3b2a}\n"
    "@media(prefers-color-scheme:dark){:root{--paper:#181817;--ink:#e9e8e3;--soft:#9b9a93;--line:#3b3b38;--faint:#"
    "242422;"
    "--c0:#5db3ee;--c1:#f0905a;--c2:#69c98b;--c3:#dc92ce;--c4:#d8bb4e;--c5:#8fd0ec;--c6:#b0b0b0;--c7:#e3917f}}\n"
    "*{box-sizing:border-box}body{margin:0 auto;padding:2.2rem 1.4rem "
    "4rem;max-width:82rem;background:var(--paper);color:var(--ink);"
    "font:15px/1.5 system-ui,sans-serif}\n"
    "h1{font-size:1.7rem;font-weight:600;margin:0 0 .3rem}h2{font-size:1.3rem;font-weight:600;margin:2.8rem 0 "
    ".6rem;padding-top:1rem;"
    "border-top:1px solid var(--line)}h3{font-size:1rem;font-weight:600;margin:1.8rem 0 .5rem}\n"
    ".facts{color:var(--soft);margin:0}.warning{border-left:3px solid var(--c1);padding-left:.8rem}\n"
    ".scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.86rem;font-variant-numeric:tabular-nums}\n"
    "th,td{padding:.28rem .6rem;text-align:right;border-bottom:1px solid var(--faint)}td,tbody "
    "th{white-space:nowrap}tbody th{text-align:left;font-weight:400;padding-left:0}"
    "thead th{font-weight:600;color:var(--soft);border-bottom:1px solid var(--line);vertical-align:bottom}"
    "tbody tr:hover{background:var(--faint)}td "
    "small{display:block;color:var(--soft);font-size:.72rem;line-height:1.1}\n"
    ".plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(26rem,1fr));gap:1.6rem;margin:1.4rem 0}"
    "figure{margin:0;min-width:0}figcaption{font-size:.86rem;font-weight:600;margin-bottom:.3rem}.plot "
    "svg{width:100%;height:auto;display:block}\n"
    ".legend{list-style:none;display:flex;flex-wrap:wrap;gap:.15rem 1.1rem;padding:0;margin:.2rem 0 0 "
    "1rem;font-size:.8rem}"
    ".legend svg{width:14px;display:inline-block;vertical-align:-2px;margin-right:.35rem}\n"
    "svg text{font:12px system-ui,sans-serif;fill:var(--soft)}svg .axis{font-size:13px;fill:var(--ink)}svg "
    ".label{font-size:11px}"
    "svg "
    "path{fill:none}.grid{stroke:var(--faint)}.frame{stroke:var(--line)}.line{stroke-width:1.8;opacity:.75}.bar{"
    "opacity:.6}"
    ".across{stroke-dasharray:6 5;opacity:.8}svg .point{stroke:var(--paper);stroke-width:1}\n"
    ".pictures{display:flex;flex-wrap:wrap;gap:1rem;margin:1.4rem 0}.pictures "
    "figcaption{font-weight:400;color:var(--soft);font-size:.78rem;"
    "max-width:16rem;margin:.3rem 0 0}figure .small{image-rendering:pixelated}.pictures img{display:block;max-width:100%;background:#fff;border:1px solid "
    "var(--line)}\n";

static void put_style(FILE *page) {
  fprintf(page, "<style>\n%s", style);
  for (int i = 0; i < 8; i++)
    fprintf(page, ".s%d{stroke:var(--c%d)}svg .point.s%d{fill:var(--c%d)}svg .t%d{fill:var(--c%d)}", i, i, i, i, i, i);
  fputs("\n</style>\n", page);
}

// ---- parts

static void put_cell(FILE *page, vt_number_style style_of, vt_spread cell) {
  char number[40];
  fprintf(page, "<td>%s", vt_show_number(style_of, cell.median, number));
  if (vt_is_spread(cell)) {
    fprintf(page, "<small>%s", vt_show_number(style_of, cell.low, number));
    fprintf(page, " &ndash; %s</small>", vt_show_number(style_of, cell.high, number));
  }
  fputs("</td>", page);
}

static void put_table(FILE *page, const vt_bench_table *table) {
  char title[120];
  fputs("<h3 id=\"", page);
  vt_put_html(page, table->name);
  fputs("\">", page);
  vt_put_html(page, table->caption);
  fputs("</h3>\n<div class=\"scroll\"><table><thead><tr><th></th>", page);
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
    for (int c = 0; c < table->column_count; c++) put_cell(page, vt_style_of_column(table, c), table->rows[r].cells[c]);
    fputs("</tr>\n", page);
  }
  fputs("</tbody></table></div>\n", page);
}

static vt_status put_picture(vt_context *context, FILE *page, const vt_bench_item *item) {
  uint8_t *bytes = NULL;
  size_t size = 0;
  fputs("<figure>", page);
  vt_status status = vt_encode_png(context, &item->picture, &bytes, &size);
  if (status == VT_MISSING_PROGRAM) { // no PNG in this build: the picture lies beside the page
    vt_clear_error(context);
    status = VT_OK;
  } else if (!status) {
    char *text = vt_base64_encode(context, bytes, size);
    if (!text) status = VT_OUT_OF_MEMORY;
    if (text) {
      int scale = item->picture.width < 160 ? 2 : 1; // small ones are looked at with a lens
      fprintf(page, "<img%s width=\"%d\" height=\"%d\" alt=\"", scale > 1 ? " class=\"small\"" : "",
              scale * item->picture.width, scale * item->picture.height);
      vt_put_html(page, item->text);
      fprintf(page, "\" src=\"data:image/png;base64,%s\">", text);
    }
    vt_free(context, text);
  }
  fputs("<figcaption>", page);
  vt_put_html(page, item->text);
  fputs("</figcaption></figure>\n", page);
  vt_free(context, bytes);
  return status;
}

static void put_head(FILE *page, const vt_bench *bench, const vt_machine *machine) {
  char memory[32];
  fprintf(page,
          "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><meta name=\"viewport\" "
          "content=\"width=device-width\">"
          "<title>voltree bench %s</title>\n",
          bench->suite);
  put_style(page);
  fprintf(page, "</head>\n<body>\n<h1>voltree bench %s%s</h1>\n<p class=\"facts\">", bench->suite,
          bench->quick ? ", quick" : "");
  vt_put_html(page, machine->processor);
  fprintf(page,
          ", %d cores (%s), %d threads used, %s of memory, %s<br>voltree %s, %s. Times are medians of repetitions run "
          "in turn, "
          "with the lowest and the highest below.</p>\n",
          machine->cores, machine->simd, vt_thread_count(bench->context), vt_show_bytes(machine->memory_bytes, memory),
          machine->system, VT_VERSION, machine->date);
  if (machine->others_share > VT_BUSY_SHARE)
    fprintf(page,
            "<p class=\"warning\">Other programs used %.0f %% of the machine while this was measured: times are too "
            "long.</p>\n",
            100 * machine->others_share);
  if (vt_sabotage_of(bench) != VT_NO_SABOTAGE)
    fputs("<p class=\"warning\">This report was broken on purpose (--sabotage), to see whether a comparison finds "
          "it.</p>\n",
          page);
}

// Neighbouring plots share a grid, neighbouring pictures a row.
static vt_status put_items(FILE *page, const vt_bench *bench) {
  vt_bench_kind open = VT_BENCH_SENTENCE;
  vt_status status = VT_OK;
  for (int i = 0; i < bench->item_count && !status; i++) {
    const vt_bench_item *item = &bench->items[i];
    bool grouped = item->kind == VT_BENCH_PLOT || item->kind == VT_BENCH_PICTURE;
    if (open != VT_BENCH_SENTENCE && item->kind != open) fputs("</div>\n", page);
    if (grouped && item->kind != open)
      fputs(item->kind == VT_BENCH_PLOT ? "<div class=\"plots\">\n" : "<div class=\"pictures\">\n", page);
    open = grouped ? item->kind : VT_BENCH_SENTENCE;
    if (item->kind == VT_BENCH_TABLE) put_table(page, item->table);
    if (item->kind == VT_BENCH_PLOT) vt_put_plot(page, item);
    if (item->kind == VT_BENCH_PICTURE) status = put_picture(bench->context, page, item);
    if (grouped || item->kind == VT_BENCH_TABLE) continue;
    fputs(item->kind == VT_BENCH_HEADING ? "<h2>" : "<p>", page);
    vt_put_html(page, item->text);
    fputs(item->kind == VT_BENCH_HEADING ? "</h2>\n" : "</p>\n", page);
  }
  if (open != VT_BENCH_SENTENCE) fputs("</div>\n", page);
  return status;
}

vt_status vt_make_bench_page(vt_bench *bench, const vt_machine *machine, char **html, size_t *size) {
  static const char no_memory[] = "index.html: the system has no memory left; close other programs";
  char *text = NULL;
  *html = NULL;
  FILE *page = open_memstream(&text, size);
  if (!page) return vt_fail(bench->context, VT_OUT_OF_MEMORY, "%s", no_memory);
  put_head(page, bench, machine);
  vt_status status = put_items(page, bench);
  fputs("</body>\n</html>\n", page);
  bool bad = ferror(page);
  bad |= fclose(page) != 0;
  if (bad && !status) status = vt_fail(bench->context, VT_OUT_OF_MEMORY, "%s", no_memory);
  if (!status) *html = vt_alloc(bench->context, *size + 1, 1);
  if (*html) memcpy(*html, text, *size);
  free(text); // of open_memstream
  return status ? status : *html ? VT_OK : VT_OUT_OF_MEMORY;
}
