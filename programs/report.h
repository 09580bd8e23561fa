// report.h - the JSON document of a run and the folder of --report
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_REPORT_H
#define VT_PROGRAMS_REPORT_H

#include "base/image_metrics.h"
#include "base/json.h"
#include "programs/session.h"

// Opens the document: schema_version, version, verb. The caller puts its members, then ends or drops it.
vt_json_writer vt_begin_report(vt_session *);
// Closes it with seconds and peak_bytes of the stages; writes it to --json and, with an index.html over the pictures
// that lie there, into --report.
vt_status vt_end_report(vt_session *, vt_json_writer *);
// The parts of it, for a report with a page of its own: the closed document, to be freed with vt_free; the document to --json
// and to report.json of --report; a page to index.html of --report.
vt_status vt_close_report(vt_session *, vt_json_writer *, char **text, size_t *size);
vt_status vt_write_report(vt_session *, const char *text, size_t size);
vt_status vt_write_page(vt_session *, const char *html, size_t size);
// <, >, & and quotes as HTML wants them.
void vt_put_html(FILE *, const char *text);

// Members psnr, psnr_foreground, ssim, alpha_rmse, delta_e, sharpness of the object that is open.
void vt_report_metrics(vt_json_writer *, const vt_metrics *);
// 1234567 -> "1.23 MB"
const char *vt_show_bytes(uint64_t bytes, char text[32]);

#endif
