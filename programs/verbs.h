// verbs.h - the verbs of the program, one file each
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_VERBS_H
#define VT_PROGRAMS_VERBS_H

#include "programs/session.h"

extern const vt_verb vt_verb_synth, vt_verb_capture, vt_verb_reconstruct, vt_verb_compress, vt_verb_evaluate,
    vt_verb_render, vt_verb_play, vt_verb_info, vt_verb_export, vt_verb_bench, vt_verb_doctor;

#endif
