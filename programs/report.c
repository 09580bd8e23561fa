// report.c - one JSON document for each run, and a folder that a browser can show
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/report.h"

#include "base/file.h"
#include "base/image_file.h"

#include <string.h>
#include <sys/resource.h>

vt_json_writer vt_begin_report(vt_session *session) {
  vt_json_writer json = vt_begin_json(session->context);
  vt_json_open_object(&json, NULL);
  vt_json_put_integer(&json, "schema_version", 1);
  vt_json_put_string(&json, "version", VT_VERSION);
  vt_json_put_string(&json, "verb", session->arguments.verb->name);
  vt_json_put_integer(&json, "threads", vt_thread_count(session->context));
  return json;
}

void vt_report_metrics(vt_json_writer *json, const vt_metrics *metrics) {
  vt_json_put_number(json, "psnr", metrics->psnr);
  vt_json_put_number(json, "psnr_foreground", metrics->psnr_foreground);
  vt_json_put_number(json, "ssim", metrics->ssim);
  vt_json_put_number(json, "alpha_rmse", metrics->alpha_rmse);
  vt_json_put_number(json, "delta_e", metrics->delta_e);
  vt_json_put_number(json, "sharpness", metrics->sharpness);
}

const char *vt_show_bytes(uint64_t bytes, char text[32]) {
  if (bytes < 1000)
    snprintf(text, 32, "%llu bytes", (unsigned long long)bytes);
  else if (bytes < 1000000)
    snprintf(text, 32, "%.1f kB", (double)bytes / 1e3);
  else if (bytes < 1000000000)
    snprintf(text, 32, "%.2f MB", (double)bytes / 1e6);
  else
    snprintf(text, 32, "%.2f GB", (double)bytes / 1e9);
  return text;
}

static void put_stages(vt_session *session, vt_json_writer *json) {
  vt_json_open_object(json, "seconds");
  for (int i = 0; i < session->stage_count; i++)
    vt_json_put_number(json, session->stages[i].name, session->stages[i].seconds);
  vt_json_put_number(json, "total", vt_seconds() - session->start);
  vt_json_close_object(json);
  vt_json_open_object(json, "peak_bytes");
  for (int i = 0; i < session->stage_count; i++)
    if (session->stages[i].peak_bytes)
      vt_json_put_integer(json, session->stages[i].name, (long long)session->stages[i].peak_bytes);
  uint64_t peak = vt_peak_bytes(session->context);
  vt_json_put_integer(json, "total", (long long)(peak > session->peak_bytes ? peak : session->peak_bytes));
  struct rusage usage;
  if (!getrusage(RUSAGE_SELF, &usage)) vt_json_put_integer(json, "process", (long long)usage.ru_maxrss * 1024);
  vt_json_close_object(json);
}

// ---- index.html: what was said, the pictures, the document

void vt_put_html(FILE *page, const char *text) {
  for (; *text; text++) switch (*text) {
    case '<':
      fputs("&lt;", page);
      break;
    case '>':
      fputs("&gt;", page);
      break;
    case '&':
      fputs("&amp;", page);
      break;
    case '"':
      fputs("&quot;", page);
      break;
    default:
      fputc(*text, page);
    }
}

vt_status vt_write_page(vt_session *session, const char *html, size_t size) {
  char *path = vt_join(session->context, session->report, "index.html");
  vt_status status = path ? vt_write_file(session->context, path, html, size) : VT_OUT_OF_MEMORY;
  vt_free(session->context, path);
  return status;
}

static vt_status make_page(vt_session *session, const char *json) {
  vt_context *context = session->context;
  vt_names names = {0};
  char *text = NULL;
  size_t size = 0;
  vt_status status = vt_list_folder(context, session->report, false, &names);
  if (status) return status;
  FILE *page = open_memstream(&text, &size);
  if (!page) {
    status = vt_fail(context, VT_OUT_OF_MEMORY, "index.html: the system has no memory left; close other programs");
    goto done;
  }
  fprintf(page,
          "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>voltree %s</title>\n<style>body{font-"
          "family:sans-serif;margin:2em}img{max-width:100%%}pre{background:#eee;padding:1em;overflow:auto}</style>\n",
          session->arguments.verb->name);
  fprintf(page, "<h1>voltree %s</h1>\n<pre>", session->arguments.verb->name);
  if (session->said) vt_put_html(page, session->said);
  fputs("</pre>\n", page);
  for (int i = 0; i < names.count; i++) {
    if (!vt_is_image_name(names.items[i])) continue;
    fputs("<figure><img loading=\"lazy\" alt=\"\" src=\"", page);
    vt_put_html(page, names.items[i]);
    fputs("\"><figcaption>", page);
    vt_put_html(page, names.items[i]);
    fputs("</figcaption></figure>\n", page);
  }
  fputs("<h2>report.json</h2>\n<pre>", page);
  vt_put_html(page, json);
  fputs("</pre>\n</html>\n", page);
  bool bad = ferror(page) != 0;
  bad |= fclose(page) != 0;
  if (bad)
    status = vt_fail(context, VT_OUT_OF_MEMORY, "index.html: the system has no memory left; close other programs");
  else
    status = vt_write_page(session, text, size);
done:
  free(text); // of open_memstream
  vt_free_names(context, &names);
  return status;
}

vt_status vt_close_report(vt_session *session, vt_json_writer *json, char **text, size_t *size) {
  put_stages(session, json);
  vt_json_close_object(json);
  return vt_end_json(json, text, size);
}

vt_status vt_write_report(vt_session *session, const char *text, size_t size) {
  vt_context *context = session->context;
  vt_status status = VT_OK;
  if (session->json && !strcmp(session->json, "-")) {
    bool open_line = size == 0 || text[size - 1] != '\n';
    if (fwrite(text, 1, size, stdout) != size || (open_line && fputc('\n', stdout) == EOF) || fflush(stdout))
      status = vt_fail(context, VT_FAILED, "standard output: the report cannot be written; look at where it goes");
  } else if (session->json) {
    status = vt_write_file(context, session->json, text, size);
  }
  if (status || !session->report) return status;
  char *path = vt_join(context, session->report, "report.json");
  status = path ? vt_write_file(context, path, text, size) : VT_OUT_OF_MEMORY;
  vt_free(context, path);
  return status;
}

vt_status vt_end_report(vt_session *session, vt_json_writer *json) {
  char *text = NULL;
  size_t size = 0;
  vt_status status = vt_close_report(session, json, &text, &size);
  if (!status) status = vt_write_report(session, text, size);
  if (!status && session->report) status = make_page(session, text);
  vt_free(session->context, text);
  return status;
}
