// match_table.h - how many points photographs have in common, from the database of colmap (SQLite)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_MATCH_TABLE_H
#define VT_CAPTURE_MATCH_TABLE_H

#include "base/file.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef void (*vt_pair_function)(void *user, const char *name_a, const char *name_b, int inliers);

// Every pair of photographs with points in common that fit a camera's motion. False where the database cannot be read, or in
// builds without SQLite: then nothing is known.
bool vt_read_match_table(const char *database, vt_pair_function, void *user);
// False in builds without SQLite.
bool vt_can_read_match_tables(void);

#ifdef __cplusplus
}
#endif
#endif
