// program_run.h - runs the built program in a folder of its own and keeps what it said
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_PROGRAM_RUN_H
#define VT_TESTS_PROGRAM_RUN_H

#include "tests/unit.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

typedef struct outcome {
  int code;
  char out[200000], err[20000];
} outcome;

static char run_folder[64];

static int enter_folder(void) {
  strcpy(run_folder, "/tmp/vt-program-XXXXXX");
  return mkdtemp(run_folder) && !chdir(run_folder) ? 0 : -1;
}
static void leave_folder(void) {
  char command[128];
  snprintf(command, sizeof command, "rm -rf %s", run_folder);
  if (chdir("/") || system(command)) printf("%s: not removed\n", run_folder);
}

static void read_text(const char *path, char *text, size_t size) {
  FILE *file = fopen(path, "rb");
  size_t got = file ? fread(text, 1, size - 1, file) : 0;
  text[got] = 0;
  if (file) fclose(file);
}

// Runs `voltree WORDS` through the shell, without anything of the user's home.
static outcome *run(const char *words) {
  static outcome last;
  char command[2000];
  snprintf(command, sizeof command, "HOME=%s XDG_CACHE_HOME= '%s' %s >%s/.out 2>%s/.err", run_folder, VT_PROGRAM, words,
           run_folder, run_folder);
  int status = system(command);
  char path[128];
  last.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  snprintf(path, sizeof path, "%s/.out", run_folder);
  read_text(path, last.out, sizeof last.out);
  snprintf(path, sizeof path, "%s/.err", run_folder);
  read_text(path, last.err, sizeof last.err);
  return &last;
}

static inline int exists(const char *path) {
  struct stat info;
  return !lstat(path, &info);
}
static inline long size_of(const char *path) {
  struct stat info;
  return stat(path, &info) ? -1 : (long)info.st_size;
}
static inline void write_bytes(const char *path, const void *bytes, size_t size) {
  FILE *file = fopen(path, "wb");
  if (!file || fwrite(bytes, 1, size, file) != size || fclose(file)) printf("%s: not written\n", path), abort();
}
static inline void write_words(const char *path, const char *text) {
  write_bytes(path, text, strlen(text));
}
static inline void shell(const char *command) {
  if (system(command)) printf("%s: failed\n", command), abort();
}
// Entries of the current folder whose name holds `part`.
static inline int count_entries(const char *part) {
  int count = 0;
  DIR *folder = opendir(".");
  for (struct dirent *entry; folder && (entry = readdir(folder));) count += strstr(entry->d_name, part) != NULL;
  if (folder) closedir(folder);
  return count;
}

#define assert_code(outcome_, code_)                                                                                   \
  do {                                                                                                                 \
    if ((outcome_)->code != (code_))                                                                                   \
      printf("%s:%d: exit %d, not %d: %s\n", __FILE__, __LINE__, (outcome_)->code, (code_), (outcome_)->err);          \
    assert_int_equal((outcome_)->code, (code_));                                                                       \
  } while (0)
#define assert_says(text_, part_)                                                                                      \
  do {                                                                                                                 \
    if (!strstr((text_), (part_))) printf("%s:%d: \"%s\" is not in: %s\n", __FILE__, __LINE__, (part_), (text_));      \
    assert_non_null(strstr((text_), (part_)));                                                                         \
  } while (0)

#endif
