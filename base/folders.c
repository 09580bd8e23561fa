// folders.c - folders that appear complete or not at all
// SPDX-License-Identifier: BSD-3-Clause
//
// A folder is filled under another name on the same disk and then renamed, which no program can see half done.

#include "base/folders.h"
#include "base/file.h"

#include <dirent.h>
#include <errno.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool vt_remove_folder(vt_context *context, const char *path) {
  DIR *folder = opendir(path);
  if (!folder) return errno == ENOENT;
  bool gone = true;
  for (struct dirent *entry; (entry = readdir(folder));) {
    if (!strcmp(entry->d_name, ".") || !strcmp(entry->d_name, "..")) continue;
    char *inner = vt_join(context, path, entry->d_name);
    struct stat about;
    if (!inner || lstat(inner, &about))
      gone = false;
    else if (S_ISDIR(about.st_mode))
      gone = vt_remove_folder(context, inner) && gone;
    else
      gone = unlink(inner) == 0 && gone;
    vt_free(context, inner);
  }
  closedir(folder);
  return rmdir(path) == 0 && gone;
}

vt_status vt_make_folder_beside(vt_context *context, const char *path, char **out) {
  size_t size = strlen(path) + 32, length = strlen(path);
  *out = vt_alloc(context, size, 1);
  if (!*out) return VT_OUT_OF_MEMORY;
  while (length > 1 && path[length - 1] == '/') length--;
  snprintf(*out, size, "%.*s.tmp.%ld", (int)length, path, (long)getpid());
  bool clean = vt_remove_folder(context, *out); // of an earlier process of the same number
  vt_status status =
      clean ? vt_make_folder(context, *out) : vt_fail(context, VT_FAILED, "%s: cannot be emptied; remove it", *out);
  if (!status) return VT_OK;
  vt_free(context, *out);
  *out = NULL;
  return status;
}

vt_status vt_make_scratch_folder(vt_context *context, char **out) {
  const char *parent = getenv("TMPDIR");
  *out = vt_join(context, parent && *parent ? parent : "/tmp", "voltree-XXXXXX");
  if (!*out) return VT_OUT_OF_MEMORY;
  if (mkdtemp(*out)) return VT_OK;
  vt_status status =
      vt_fail(context, VT_FAILED, "%s: cannot be made (%s); set TMPDIR to a folder with room", *out, strerror(errno));
  vt_free(context, *out);
  *out = NULL;
  return status;
}
