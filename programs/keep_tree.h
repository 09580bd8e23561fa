// keep_tree.h - raw trees in the cache, so that other codebooks or another output need no reconstruction
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_KEEP_TREE_H
#define VT_PROGRAMS_KEEP_TREE_H

#include "programs/session.h"
#include "reconstruct/reconstruct.h"

// The path of the entry that belongs to these views and this desc, to be freed; NULL where nothing is to be kept (no cache, a
// time budget, probes) or without memory.
char *vt_kept_tree_path(vt_session *, const vt_reconstruct_desc *, const vt_views *);
// The tree with the very bits that vt_reconstruct made, and its report. *taken is false if it is not there or damaged.
vt_status vt_take_kept_tree(vt_session *, const char *entry, vt_tree *out, vt_reconstruct_report *report, bool *taken);
// Keeps it; where that fails it is said, and the run goes on.
void vt_keep_raw_tree(vt_session *, const char *entry, const vt_tree *, const vt_reconstruct_report *);

#endif
