// prepare_views.h - what is mended in photographs and cameras before they are reconstructed from
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_PREPARE_VIEWS_H
#define VT_PROGRAMS_PREPARE_VIEWS_H

#include "base/json.h"
#include "programs/session.h"
#include "reconstruct/reconstruct.h"

extern const vt_option vt_preparation_options[];

typedef struct vt_preparation {
  vt_matte_report mattes;
  vt_refine_report cameras;
  vt_balance_report colours;
} vt_preparation;

// Stages "matte check", "refining cameras" and "balance", as the options have it; says what was changed.
vt_status vt_prepare_views(vt_session *, vt_views *, vt_preparation *out);
// Member "preparation" of the object that is open. times: with the seconds (a file's metadata has none).
void vt_report_preparation(vt_json_writer *, const vt_views *, const vt_preparation *, bool times);
void vt_free_preparation(vt_context *, vt_preparation *);

#endif
