// file.h - whole files, folders and paths
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_FILE_H
#define VT_BASE_FILE_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_names { int count; char **items; } vt_names; // owned, sorted by strcmp

bool vt_is_file(const char *path);
bool vt_is_folder(const char *path);
// Bytes of a file, one zero byte behind them that is not counted. VT_BAD_INPUT naming the file. Free with vt_free.
vt_status vt_read_file(vt_context *, const char *path, uint8_t **bytes, size_t *size);
// Writes to "path.tmp.PID", flushes it to the disk, renames. On any error the temporary file is removed and an older
// `path` stays as it was. VT_FAILED naming the file and the cure.
vt_status vt_write_file(vt_context *, const char *path, const void *bytes, size_t size);
vt_status vt_make_folder(vt_context *, const char *path); // with its parents; no error if it is there
// Names (not paths) in a folder, without "." files; `recursive` gives relative paths of files below it.
vt_status vt_list_folder(vt_context *, const char *path, bool recursive, vt_names *out);
void vt_free_names(vt_context *, vt_names *);
// Where a name stands in a list sorted by strcmp, -1: nowhere.
int vt_find_sorted_name(const char *const *sorted, int count, const char *name);
// "folder/name" (name alone if it is absolute or folder is ""). NULL only without memory. Free with vt_free.
char *vt_join(vt_context *, const char *folder, const char *name);
const char *vt_base_name(const char *path); // points into path
char *vt_without_ending(vt_context *, const char *path); // "a/b.jpg" -> "a/b"

#ifdef __cplusplus
}
#endif
#endif
