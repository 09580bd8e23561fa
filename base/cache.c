// cache.c - the folder where results of stages are kept by the content of what they were made from
// SPDX-License-Identifier: BSD-3-Clause
//
// An entry's name is a hash of everything that its content depends on, so it never becomes wrong, only useless. It is filled
// under another name and renamed: a run that dies, or a disk that is full, leaves no half entry, only a folder with the number
// of its process in the name, which the next run clears away. Two runs that make the same thing do no harm: the second rename
// fails and the first entry stays. Where making it twice would take hours (the cameras) they take turns by a lock.
//
// The lock is flock() on a file: it belongs to the open file, which programs that we start inherit, so it lasts until the last
// of them has ended. A process that was killed cannot leave it locked, and a child that outlives it keeps others out.
// What goes wrong: flock does not reach over some network disks; there two runs do the same work twice, and the rename still
// decides.
#define _DEFAULT_SOURCE // flock
#include "base/cache.h"
#include "base/file.h"
#include "base/folders.h"
#include "base/hash.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

#define ORPHAN_AGE 60 // seconds after which a dead process's folder is cleared away; its number may be of another machine

char *vt_cache_entry(vt_context *context, const char *folder, const char *kind, uint64_t hash) {
  char name[64];
  snprintf(name, sizeof name, "%s-%016llx", kind, (unsigned long long)hash);
  return vt_join(context, folder, name);
}

bool vt_use_entry(const char *path) {
  if (!vt_is_folder(path)) return false;
  (void)utimensat(AT_FDCWD, path, NULL, 0); // a disk that is read-only can be read all the same
  return true;
}

void vt_keep_entry(vt_context *context, const char *made, const char *entry) {
  if (!rename(made, entry)) return;
  int problem = errno;
  vt_remove_folder(context, made);
  if (!vt_is_folder(entry))
    vt_log(context, VT_LOG_NORMAL, "%s: could not be kept (%s); it will be made again next time", entry, strerror(problem));
}

// ---- sizes

uint64_t vt_folder_bytes(vt_context *context, const char *path) {
  vt_names names = {0};
  uint64_t bytes = 0;
  struct stat about;
  if (lstat(path, &about)) return 0;
  if (!S_ISDIR(about.st_mode)) return (uint64_t)about.st_blocks * 512;
  if (vt_list_folder(context, path, false, &names)) vt_clear_error(context); // it went while we looked
  for (int i = 0; i < names.count; i++) {
    char *inner = vt_join(context, path, names.items[i]);
    if (inner) bytes += vt_folder_bytes(context, inner);
    vt_free(context, inner);
  }
  vt_free_names(context, &names);
  return bytes;
}

uint64_t vt_free_bytes(const char *path) {
  char part[4096];
  struct statvfs disk;
  if ((size_t)snprintf(part, sizeof part, "%s", path) >= sizeof part) return 0;
  while (statvfs(part, &disk)) {
    char *slash = strrchr(part, '/');
    if (!strcmp(part, ".") || !strcmp(part, "/")) return 0;
    if (slash)
      slash[slash == part] = 0;
    else
      strcpy(part, ".");
  }
  return (uint64_t)disk.f_bavail * (uint64_t)disk.f_frsize;
}

// ---- locks

static bool still_named(int file, const char *path) { // not removed since it was opened
  struct stat here, there;
  return !fstat(file, &here) && !stat(path, &there) && here.st_ino == there.st_ino && here.st_dev == there.st_dev;
}

// 0, or an errno: EWOULDBLOCK where another one holds it.
static int lock_once(const char *path, int *file) {
  for (;;) {
    *file = open(path, O_RDWR | O_CREAT, 0666); // not closed on exec: what we start holds it with us
    if (*file < 0) return errno;
    if (flock(*file, LOCK_EX | LOCK_NB)) {
      int problem = errno;
      close(*file);
      return problem == EINTR ? EWOULDBLOCK : problem;
    }
    if (still_named(*file, path)) return 0;
    close(*file);
  }
}

static bool has_lock(vt_context *context, const char *path, int file, vt_lock *out) {
  *out = (vt_lock){vt_strdup(context, path), file};
  if (out->path) return true;
  close(file);
  return false;
}

bool vt_try_lock(vt_context *context, const char *path, vt_lock *out) {
  int file;
  *out = (vt_lock){NULL, -1};
  return !lock_once(path, &file) && has_lock(context, path, file, out);
}

vt_status vt_take_lock(vt_context *context, const char *path, const char *what, vt_lock *out) {
  const struct timespec pause = {0, 100000000};
  int file = -1;
  *out = (vt_lock){NULL, -1};
  for (bool said = false;;) {
    int problem = lock_once(path, &file);
    if (!problem) return has_lock(context, path, file, out) ? VT_OK : VT_OUT_OF_MEMORY;
    if (problem != EWOULDBLOCK)
      return vt_fail(context, VT_FAILED, "%s: cannot be locked (%s); give another --cache, or --no-cache", path,
                     strerror(problem));
    if (!said) vt_log(context, VT_LOG_NORMAL, "%s: another run is at it; waiting", what);
    said = true;
    if (vt_cancelled(context)) return vt_fail(context, VT_CANCELLED, "%s: interrupted", what);
    nanosleep(&pause, NULL);
  }
}

void vt_drop_lock(vt_context *context, vt_lock *lock) {
  if (!lock->path) return;
  (void)unlink(lock->path); // before it is free: whoever has opened it meanwhile sees that it has no name, and makes a new one
  close(lock->file);
  vt_free(context, lock->path);
  *lock = (vt_lock){NULL, -1};
}

// ---- clearing

typedef struct entry {
  char *path;
  uint64_t bytes;
  struct timespec used;
} entry;

static int compare_entries(const void *a, const void *b) {
  const entry *p = a, *q = b;
  if (p->used.tv_sec != q->used.tv_sec) return p->used.tv_sec < q->used.tv_sec ? -1 : 1;
  if (p->used.tv_nsec != q->used.tv_nsec) return p->used.tv_nsec < q->used.tv_nsec ? -1 : 1;
  return strcmp(p->path, q->path);
}

// A folder or file "NAME.tmp.PID" of a process that is no more.
static bool is_orphan(const char *name, const struct stat *about) {
  const char *mark = strstr(name, ".tmp.");
  long number = mark ? strtol(mark + 5, NULL, 10) : 0;
  return number > 1 && kill((pid_t)number, 0) && errno == ESRCH && time(NULL) - about->st_mtime > ORPHAN_AGE;
}

static bool is_entry(const char *name) {
  static const char *const kinds[] = {"calibration-", "work-", "lens-", "views-", "tree-"}; // what we never made is never removed
  size_t length = strlen(name);
  for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
    if (!strncmp(name, kinds[i], strlen(kinds[i])))
      return strspn(name + strlen(kinds[i]), "0123456789abcdef") == 16 && length == strlen(kinds[i]) + 16;
  return false;
}

// Removes an entry that nobody works on. It gets another name first: nobody finds half of it.
static bool remove_entry(vt_context *context, const char *path) {
  size_t size = strlen(path) + 32;
  char *name = vt_alloc(context, size, 1);
  vt_lock lock;
  bool gone = false;
  if (!name) return false;
  snprintf(name, size, "%s.lock", path);
  if (vt_try_lock(context, name, &lock)) {
    snprintf(name, size, "%s.tmp.%ld", path, (long)getpid());
    gone = !rename(path, name) && vt_remove_folder(context, name);
    vt_drop_lock(context, &lock);
  }
  vt_free(context, name);
  return gone;
}

void vt_trim_cache(vt_context *context, const char *folder, uint64_t most_bytes, const char *kept) {
  vt_names names = {0};
  if (!vt_is_folder(folder) || vt_list_folder(context, folder, false, &names)) {
    vt_clear_error(context);
    return;
  }
  entry *entries = VT_NEW(context, entry, (size_t)names.count);
  uint64_t sum = 0;
  size_t count = 0;
  for (int i = 0; entries && i < names.count; i++) {
    char *path = vt_join(context, folder, names.items[i]);
    struct stat about;
    bool known = path && !lstat(path, &about);
    size_t length = strlen(names.items[i]);
    vt_lock lock;
    if (known && is_orphan(names.items[i], &about)) {
      vt_remove_folder(context, path);
    } else if (known && length > 5 && !strcmp(names.items[i] + length - 5, ".lock")) { // of a run that was killed
      if (vt_try_lock(context, path, &lock)) vt_drop_lock(context, &lock);
    } else if (known && is_entry(names.items[i]) && S_ISDIR(about.st_mode)) {
      entries[count] = (entry){path, most_bytes ? vt_folder_bytes(context, path) : 0, about.st_mtim};
      sum += entries[count++].bytes;
      path = NULL;
    }
    vt_free(context, path);
  }
  if (count) qsort(entries, count, sizeof *entries, compare_entries);
  for (size_t i = 0; i < count; i++) {
    if (most_bytes && sum > most_bytes && !(kept && !strcmp(kept, entries[i].path)) &&
        remove_entry(context, entries[i].path)) {
      sum -= entries[i].bytes;
      vt_log(context, VT_LOG_VERBOSE, "%s: removed, the cache holds at most %.1f MB", entries[i].path,
             (double)most_bytes * 1e-6);
    }
    vt_free(context, entries[i].path);
  }
  vt_free(context, entries);
  vt_free_names(context, &names);
}

// ---- which program

uint64_t vt_program_hash(void) {
  FILE *file = fopen("/proc/self/exe", "rb");
  if (!file) return 0;
  uint8_t bytes[65536];
  uint64_t hash = 1;
  for (size_t count; (count = fread(bytes, 1, sizeof bytes, file)) > 0;) hash = vt_hash(bytes, count, hash);
  bool bad = ferror(file) != 0;
  fclose(file);
  return bad ? 0 : hash | 1;
}
