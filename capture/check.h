// check.h - photographs looked at before the work, inside capture
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_CHECK_H
#define VT_CAPTURE_CHECK_H

#include "base/file.h"
#include "capture/capture.h"

#ifdef __cplusplus
extern "C" {
#endif

// Decodes and measures all photographs, and fills photos, groups and warnings of the report. `strict`: the first that cannot be
// read is an error, VT_BAD_INPUT naming it. To be freed also on failure.
vt_status vt_check_photographs(vt_context *, const char *folder, const vt_names *names, bool strict, vt_check_report *out);
// A sentence about the coverage, if there is something wrong with it.
vt_status vt_warn_of_coverage(vt_context *, const vt_coverage *, const char *name_begin, const char *name_end,
                              int *warning_count, char ***warnings);
// Adds a sentence to a list.
#ifdef __GNUC__
__attribute__((format(printf, 4, 5)))
#endif
vt_status vt_note_sentence(vt_context *, int *count, char ***sentences, const char *format, ...);
void vt_free_sentences(vt_context *, int *count, char ***sentences);

// Rough seconds of wall time.
double vt_guess_calibration(int photographs, double megapixels, int threads);
double vt_guess_developing(double megapixels, int threads, bool mattes);

#ifdef __cplusplus
}
#endif
#endif
