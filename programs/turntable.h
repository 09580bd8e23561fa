// turntable.h - a folder of frames that appears complete, and a film of it
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_TURNTABLE_H
#define VT_PROGRAMS_TURNTABLE_H

#include "programs/session.h"

typedef struct vt_turntable {
  char *folder, *work; // the one to make, and the hidden one beside it where frames gather; owned
} vt_turntable;

vt_status vt_begin_turntable(vt_session *, const char *folder, vt_turntable *out);
char *vt_turntable_frame(vt_session *, const vt_turntable *, int number); // the path to write to; free with vt_free
// Makes turntable.mp4 of the frames if `film` and ffmpeg is found, and gives the folder its name. Files of the same
// names in an older folder are replaced, others stay.
vt_status vt_finish_turntable(vt_session *, vt_turntable *, bool film);
// Removes what is left of an unfinished one. Always to be called.
void vt_drop_turntable(vt_session *, vt_turntable *);

#endif
