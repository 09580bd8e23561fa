// synth_options.h - the options of voltree synth, and the descs that they make
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_SYNTH_OPTIONS_H
#define VT_PROGRAMS_SYNTH_OPTIONS_H

#include "datasets-synthetic/synthetic.h"
#include "programs/session.h"

extern const vt_option vt_synth_options[];  // what is photographed, and how
extern const vt_option vt_damage_options[]; // what is made worse

typedef struct vt_synth_plan {
  vt_synthetic_desc desc;
  vt_damage_desc damage;
  bool damage_test_views;
  int relight_count;
  const char *export_path; // or NULL
} vt_synth_plan;
// VT_BAD_USAGE where options do not go together.
vt_status vt_synth_plan_of(vt_session *, vt_synth_plan *out);

bool vt_harms_mattes(const vt_damage_desc *);
bool vt_harms_cameras(const vt_damage_desc *); // their poses or focal lengths, or the lens, so that the camera says wrong

#endif
