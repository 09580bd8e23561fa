// cache.h - the folder where results of stages are kept by the content of what they were made from
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_CACHE_H
#define VT_BASE_CACHE_H

#include "base/context.h"

#ifdef __cplusplus
extern "C" {
#endif

// "folder/KIND-HASH", the path of an entry, a folder that appears complete or not at all. NULL only without memory. Free with
// vt_free.
char *vt_cache_entry(vt_context *, const char *folder, const char *kind, uint64_t hash);
// True if the entry is there; it then counts as just used.
bool vt_use_entry(const char *path);
// Renames the filled folder `made` to `entry`. Where another run was quicker its entry stays. What fails is told and left: a
// result that cannot be kept is made again. `made` is gone afterwards.
void vt_keep_entry(vt_context *, const char *made, const char *entry);
// Removes what killed runs left behind, then the entries that were used longest ago, until at most `most_bytes` are left
// (0: no bound). Entries that a run works on stay, and so does `kept` (or NULL).
void vt_trim_cache(vt_context *, const char *folder, uint64_t most_bytes, const char *kept);
uint64_t vt_folder_bytes(vt_context *, const char *path); // of the files below it; 0 if there is none
uint64_t vt_free_bytes(const char *path);                 // of the disk that the path, or its nearest parent, lies on; 0 unknown

// A lock that ends with the process that holds it and with the programs that it has started, however they end.
typedef struct vt_lock { char *path; int file; } vt_lock;
// Waits until the lock is free, and says so once with the words of `what`. VT_CANCELLED; VT_FAILED naming it.
vt_status vt_take_lock(vt_context *, const char *path, const char *what, vt_lock *out);
bool vt_try_lock(vt_context *, const char *path, vt_lock *out); // false: another one holds it
void vt_drop_lock(vt_context *, vt_lock *); // a zeroed one may be dropped

// A hash of the running program's own bytes, so that results of another version are not taken for this one's. 0: unknown.
uint64_t vt_program_hash(void);

#ifdef __cplusplus
}
#endif
#endif
