// file.c - whole files, folders and paths
// SPDX-License-Identifier: BSD-3-Clause
//
// A file is written beside its final name, flushed to the disk and renamed: a reader sees the old bytes or the new
// ones, never a part, whatever stops us. A symbolic link is followed first, so that the link stays and its target is
// replaced. A device or a pipe (/dev/null, /dev/stdout) is written to directly: renaming over it would destroy it.
#define _XOPEN_SOURCE 700 // realpath
#include "base/file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool vt_is_file(const char *path) {
  struct stat s;
  return !stat(path, &s) && S_ISREG(s.st_mode);
}

bool vt_is_folder(const char *path) {
  struct stat s;
  return !stat(path, &s) && S_ISDIR(s.st_mode);
}

static const char *reason_of(int error, char buffer[128]) {
  return strerror_r(error, buffer, 128) ? "unknown error" : buffer;
}

static vt_status fail_reading(vt_context *context, const char *path, int error) {
  char buffer[128];
  switch (error) {
  case ENOENT:
  case ENOTDIR:
    return vt_fail(context, VT_BAD_INPUT, "%s: there is no such file or folder; check the path", path);
  case EACCES:
    return vt_fail(context, VT_BAD_INPUT, "%s: no permission to read it; change its permissions", path);
  case EISDIR:
    return vt_fail(context, VT_BAD_INPUT, "%s: is a folder; give a file", path);
  default:
    return vt_fail(context, VT_BAD_INPUT, "%s: cannot be read: %s; check the disk or copy it again", path,
                   reason_of(error, buffer));
  }
}

static vt_status fail_writing(vt_context *context, const char *path, int error) {
  char buffer[128];
  switch (error) {
  case ENOSPC:
  case EDQUOT:
    return vt_fail(context, VT_FAILED, "%s: the disk is full; free some space or write to another disk", path);
  case ENOENT:
  case ENOTDIR:
    return vt_fail(context, VT_FAILED, "%s: its folder does not exist; make the folder first", path);
  case EACCES:
  case EPERM:
    return vt_fail(context, VT_FAILED,
                   "%s: no permission to write there; choose another folder or change its permissions", path);
  case EROFS:
    return vt_fail(context, VT_FAILED, "%s: the disk is read-only; choose another folder", path);
  case EISDIR:
    return vt_fail(context, VT_FAILED, "%s: is a folder; give the name of a file", path);
  default:
    return vt_fail(context, VT_FAILED, "%s: cannot be written: %s; check the disk or choose another folder", path,
                   reason_of(error, buffer));
  }
}

// ---- whole files

static int open_again(const char *path, int flags) { // open() that survives signals
  int file;
  do file = open(path, flags | O_CLOEXEC, 0666);
  while (file < 0 && errno == EINTR);
  return file;
}

vt_status vt_read_file(vt_context *context, const char *path, uint8_t **bytes, size_t *size) {
  vt_status status = VT_OK;
  uint8_t *block = NULL;
  size_t capacity = 0, filled = 0;
  struct stat s;
  *bytes = NULL;
  *size = 0;
  int file = open_again(path, O_RDONLY);
  if (file < 0) return fail_reading(context, path, errno);
  if (fstat(file, &s)) {
    status = fail_reading(context, path, errno);
    goto done;
  }
  if (S_ISDIR(s.st_mode)) {
    status = fail_reading(context, path, EISDIR);
    goto done;
  }
  // The size is a first guess only: a pipe has none, and a file may grow or shrink while we read it.
  capacity = S_ISREG(s.st_mode) && s.st_size > 0 ? (size_t)s.st_size + 2 : 65536;
  block = vt_alloc(context, capacity, 1);
  for (;;) {
    if (!block) {
      status = VT_OUT_OF_MEMORY;
      goto done;
    }
    ssize_t got = read(file, block + filled, capacity - 1 - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      status = fail_reading(context, path, errno);
      goto done;
    }
    if (got == 0) break;
    filled += (size_t)got;
    if (filled < capacity - 1) continue;
    uint8_t *larger = capacity <= SIZE_MAX / 2 ? vt_realloc(context, block, capacity * 2, 1) : NULL;
    if (!larger) {
      status = VT_OUT_OF_MEMORY;
      goto done;
    }
    block = larger;
    capacity *= 2;
  }
  block[filled] = 0;
  *bytes = block;
  *size = filled;
  block = NULL;
done:
  close(file);
  vt_free(context, block);
  return status;
}

// 0 or the error's number.
static int write_bytes(int file, const uint8_t *bytes, size_t size) {
  while (size) {
    ssize_t put = write(file, bytes, size < SSIZE_MAX ? size : SSIZE_MAX);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return errno;
    if (put == 0) return EIO;
    bytes += put;
    size -= (size_t)put;
  }
  return 0;
}

static vt_status write_device(vt_context *context, const char *path, const void *bytes, size_t size) {
  int file = open_again(path, O_WRONLY);
  if (file < 0) return fail_writing(context, path, errno);
  int error = write_bytes(file, bytes, size);
  if (close(file) && !error) error = errno;
  return error ? fail_writing(context, path, error) : VT_OK;
}

// Without this a rename may be forgotten when the power fails. Not every file system can; the bytes are safe either
// way.
static void flush_folder_of(vt_context *context, const char *path) {
  char *folder = vt_strdup(context, path);
  if (!folder) return;
  char *slash = strrchr(folder, '/');
  if (slash) slash[slash == folder] = 0;
  int file = open_again(slash ? folder : ".", O_RDONLY | O_DIRECTORY);
  if (file >= 0) {
    (void)fsync(file);
    close(file);
  }
  vt_free(context, folder);
}

static vt_status replace_file(vt_context *context, const char *path, const char *target, const void *bytes,
                              size_t size) {
  size_t length = strlen(target) + 32;
  char *temporary = vt_alloc(context, length, 1);
  if (!temporary) return VT_OUT_OF_MEMORY;
  snprintf(temporary, length, "%s.tmp.%ld", target, (long)getpid());
  int error = 0, file = open_again(temporary, O_WRONLY | O_CREAT | O_TRUNC);
  if (file < 0) {
    error = errno;
  } else {
    error = write_bytes(file, bytes, size);
    if (!error && fsync(file) && errno != EINVAL && errno != ENOTSUP) error = errno;
    if (close(file) && !error) error = errno;
    if (!error && rename(temporary, target)) error = errno;
    if (error)
      (void)unlink(temporary);
    else
      flush_folder_of(context, target);
  }
  vt_free(context, temporary);
  return error ? fail_writing(context, path, error) : VT_OK;
}

vt_status vt_write_file(vt_context *context, const char *path, const void *bytes, size_t size) {
  struct stat s;
  if (!*path) return vt_fail(context, VT_FAILED, "the name of the file to write is empty; give one");
  if (stat(path, &s)) return replace_file(context, path, path, bytes, size);
  if (S_ISDIR(s.st_mode)) return fail_writing(context, path, EISDIR);
  if (!S_ISREG(s.st_mode)) return write_device(context, path, bytes, size);
  char *target = realpath(path, NULL);
  vt_status status = replace_file(context, path, target ? target : path, bytes, size);
  free(target);
  return status;
}

// ---- folders

vt_status vt_make_folder(vt_context *context, const char *path) {
  if (!*path) return vt_fail(context, VT_FAILED, "the name of the folder to make is empty; give one");
  char *part = vt_strdup(context, path);
  if (!part) return VT_OUT_OF_MEMORY;
  int error = 0;
  for (char *end = part + 1; !error; end++) {
    char kept = *end;
    if (kept && kept != '/') continue;
    *end = 0;
    if (mkdir(part, 0777) && !vt_is_folder(part)) error = errno;
    *end = kept;
    if (!kept) break;
  }
  vt_free(context, part);
  if (error == EEXIST || error == ENOTDIR)
    return vt_fail(context, VT_FAILED, "%s: a file stands where a folder is needed; choose another name", path);
  return error ? fail_writing(context, path, error) : VT_OK;
}

typedef struct listing {
  vt_names names;
  size_t capacity;
  bool recursive;
} listing;

typedef struct ancestor { // a link that leads back to one of these would never end
  dev_t device;
  ino_t inode;
  const struct ancestor *parent;
} ancestor;

static vt_status add_name(vt_context *context, listing *list, char *owned_name) {
  if (!owned_name) return VT_OUT_OF_MEMORY;
  if ((size_t)list->names.count == list->capacity) {
    size_t capacity = list->capacity ? list->capacity * 2 : 64;
    char **items = capacity <= INT_MAX ? vt_realloc(context, list->names.items, capacity, sizeof *items) : NULL;
    if (!items) {
      vt_free(context, owned_name);
      return VT_OUT_OF_MEMORY;
    }
    list->names.items = items;
    list->capacity = capacity;
  }
  list->names.items[list->names.count++] = owned_name;
  return VT_OK;
}

static vt_status list_below(vt_context *context, listing *list, const char *path, const char *relative,
                            const ancestor *parent);

static vt_status list_entry(vt_context *context, listing *list, const char *path, const char *relative,
                            const char *entry, const ancestor *parent) {
  char *name = vt_join(context, relative, entry);
  if (!name) return VT_OUT_OF_MEMORY;
  if (!list->recursive) return add_name(context, list, name);
  char *full = vt_join(context, path, entry);
  struct stat s;
  vt_status status = full ? VT_OK : VT_OUT_OF_MEMORY;
  bool known = full && !stat(full, &s); // a broken link is no file
  if (known && S_ISREG(s.st_mode)) {
    status = add_name(context, list, name);
    name = NULL;
  } else if (known && S_ISDIR(s.st_mode)) {
    ancestor self = {s.st_dev, s.st_ino, parent};
    bool loops = false;
    for (const ancestor *a = parent; a; a = a->parent) loops |= a->device == self.device && a->inode == self.inode;
    if (!loops) status = list_below(context, list, full, name, &self);
  }
  vt_free(context, full);
  vt_free(context, name);
  return status;
}

static vt_status list_below(vt_context *context, listing *list, const char *path, const char *relative,
                            const ancestor *parent) {
  DIR *folder = opendir(path);
  if (!folder) {
    if (errno == ENOTDIR) return vt_fail(context, VT_BAD_INPUT, "%s: is no folder; give a folder", path);
    return fail_reading(context, path, errno);
  }
  vt_status status = VT_OK;
  while (!status) {
    errno = 0;
    struct dirent *entry = readdir(folder);
    if (!entry && errno) status = fail_reading(context, path, errno);
    if (!entry) break;
    if (entry->d_name[0] != '.') status = list_entry(context, list, path, relative, entry->d_name, parent);
  }
  closedir(folder);
  return status;
}

static int compare_names(const void *a, const void *b) {
  return strcmp(*(char *const *)a, *(char *const *)b);
}

vt_status vt_list_folder(vt_context *context, const char *path, bool recursive, vt_names *out) {
  listing list = {{0, NULL}, 0, recursive};
  struct stat s;
  *out = (vt_names){0, NULL};
  ancestor root = {0, 0, NULL};
  if (!stat(path, &s)) root = (ancestor){s.st_dev, s.st_ino, NULL};
  vt_status status = list_below(context, &list, path, "", &root);
  if (status) {
    vt_free_names(context, &list.names);
    return status;
  }
  if (list.names.count) qsort(list.names.items, (size_t)list.names.count, sizeof *list.names.items, compare_names);
  *out = list.names;
  return VT_OK;
}

int vt_find_sorted_name(const char *const *sorted, int count, const char *name) {
  int low = 0, high = count;
  while (low < high) {
    int middle = low + (high - low) / 2, order = strcmp(name, sorted[middle]);
    if (!order) return middle;
    if (order < 0)
      high = middle;
    else
      low = middle + 1;
  }
  return -1;
}

void vt_free_names(vt_context *context, vt_names *names) {
  for (int i = 0; i < names->count; i++) vt_free(context, names->items[i]);
  vt_free(context, names->items);
  *names = (vt_names){0, NULL};
}

// ---- paths

char *vt_join(vt_context *context, const char *folder, const char *name) {
  size_t folder_length = strlen(folder), name_length = strlen(name);
  if (!folder_length || name[0] == '/') return vt_strdup(context, name);
  bool slash = folder[folder_length - 1] != '/';
  char *path = vt_alloc(context, folder_length + slash + name_length + 1, 1);
  if (!path) return NULL;
  memcpy(path, folder, folder_length);
  if (slash) path[folder_length] = '/';
  memcpy(path + folder_length + slash, name, name_length + 1);
  return path;
}

const char *vt_base_name(const char *path) {
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

char *vt_without_ending(vt_context *context, const char *path) {
  char *copy = vt_strdup(context, path);
  if (!copy) return NULL;
  char *name = copy + (vt_base_name(copy) - copy), *dot = strrchr(name, '.');
  if (dot && dot != name) *dot = 0; // ".profile" has no ending
  return copy;
}
