// child_process.c - running another program and reading what it says
// SPDX-License-Identifier: BSD-3-Clause
//
// The program gets a process group of its own: a Ctrl-C at the terminal reaches us alone, and we end the program with
// all that it started. If we die without that, its next line meets a broken pipe.
#include "base/child_process.h"
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

extern char **environ;

enum { LINE = 2048, LOOK_EVERY = 100, PATIENCE = 30 }; // milliseconds; looks until the program is killed

typedef struct line_buffer {
  char text[LINE];
  size_t length;
} line_buffer;

// environ with QT_QPA_PLATFORM=offscreen. NULL without memory; free with vt_free.
static char **offscreen_environment(vt_context *context) {
  static const char platform[] = "QT_QPA_PLATFORM=offscreen";
  size_t count = 0, n = 0;
  while (environ && environ[count]) count++;
  char **out = VT_NEW(context, char *, count + 2);
  if (!out) return NULL;
  for (size_t i = 0; i < count; i++)
    if (strncmp(environ[i], platform, 16) != 0) out[n++] = environ[i];
  out[n++] = (char *)platform;
  out[n] = NULL;
  return out;
}

// 0 or an errno. *output is the end of a pipe to read from.
static int spawn(char *const arguments[], char **environment, pid_t *pid, int *output) {
  int ends[2];
  if (pipe(ends)) return errno;
  fcntl(ends[0], F_SETFD, FD_CLOEXEC);
  fcntl(ends[1], F_SETFD, FD_CLOEXEC);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  int error = posix_spawn_file_actions_init(&actions);
  if (error) goto close_ends;
  error = posix_spawnattr_init(&attributes);
  if (error) goto destroy_actions;
  if (!error) error = posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  if (!error) error = posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
  if (!error) error = posix_spawn_file_actions_adddup2(&actions, ends[1], 2);
  if (!error) error = posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  if (!error) error = posix_spawnp(pid, arguments[0], &actions, &attributes, arguments, environment);
  posix_spawnattr_destroy(&attributes);
destroy_actions:
  posix_spawn_file_actions_destroy(&actions);
close_ends:
  close(ends[1]);
  if (error)
    close(ends[0]);
  else
    *output = ends[0];
  return error;
}

static void end_line(line_buffer *buffer, FILE *log, vt_line_function hear, void *user) {
  if (!buffer->length) return;
  buffer->text[buffer->length] = 0;
  buffer->length = 0;
  if (log) fprintf(log, "%s\n", buffer->text);
  if (hear) hear(user, buffer->text);
}

static void take_bytes(line_buffer *buffer, const char *bytes, size_t count, FILE *log, vt_line_function hear,
                       void *user) {
  for (size_t i = 0; i < count; i++) {
    if (bytes[i] == '\n' || bytes[i] == '\r' || bytes[i] == 0)
      end_line(buffer, log, hear, user);
    else
      buffer->text[buffer->length++] = bytes[i];
    if (buffer->length == LINE - 1) end_line(buffer, log, hear, user);
  }
}

// Asks the group to end, then makes it.
static void stop(pid_t pid, int *wait_status) {
  const struct timespec pause = {0, LOOK_EVERY * 1000000};
  kill(-pid, SIGTERM);
  for (int i = 0; i < PATIENCE; i++) {
    if (waitpid(pid, wait_status, WNOHANG) != 0) break;
    if (i == PATIENCE - 1) {
      kill(-pid, SIGKILL);
      waitpid(pid, wait_status, 0);
    }
    nanosleep(&pause, NULL);
  }
  kill(-pid, SIGKILL); // what the program started and left behind
}

// Reads until the program and what it started close their output, their time is over, or the run is cancelled.
static vt_status listen_to(vt_context *context, int output, double end, FILE *log, vt_line_function hear, void *user,
                           bool *late) {
  line_buffer buffer;
  buffer.length = 0;
  for (;;) {
    if (vt_cancelled(context)) return VT_CANCELLED;
    *late = vt_seconds() > end;
    if (*late) break;
    struct pollfd waiting = {output, POLLIN, 0};
    int ready = poll(&waiting, 1, LOOK_EVERY);
    if (ready < 0 && errno != EINTR) break;
    if (ready <= 0) continue;
    char bytes[4096];
    ssize_t count = read(output, bytes, sizeof bytes);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    take_bytes(&buffer, bytes, (size_t)count, log, hear, user);
  }
  end_line(&buffer, log, hear, user);
  return VT_OK;
}

// Waits for the end of a program that has closed its output, of its time, or of the run.
static vt_status wait_for(vt_context *context, pid_t pid, double end, int *wait_status, bool *late) {
  const struct timespec pause = {0, 2000000};
  for (;;) {
    pid_t ended = waitpid(pid, wait_status, WNOHANG);
    if (ended == pid || (ended < 0 && errno != EINTR)) return VT_OK;
    if (vt_cancelled(context)) return VT_CANCELLED;
    *late = vt_seconds() > end;
    if (*late) return VT_OK;
    nanosleep(&pause, NULL);
  }
}

vt_status vt_run_program(vt_context *context, char *const arguments[], FILE *log, vt_line_function hear, void *user,
                         int *exit_code) {
  return vt_run_program_within(context, arguments, INFINITY, log, hear, user, exit_code);
}

vt_status vt_run_program_within(vt_context *context, char *const arguments[], double seconds, FILE *log,
                                vt_line_function hear, void *user, int *exit_code) {
  double end = vt_seconds() + seconds;
  bool late = false;
  char **environment = offscreen_environment(context);
  if (!environment) return VT_OUT_OF_MEMORY;
  pid_t pid = 0;
  int output = -1, error = spawn(arguments, environment, &pid, &output), wait_status = 0;
  vt_free(context, environment);
  if (error == ENOENT || error == ENOTDIR) return VT_MISSING_PROGRAM;
  if (error) return vt_fail(context, VT_FAILED, "%s: could not be started: %s", arguments[0], strerror(error));
  vt_status status = listen_to(context, output, end, log, hear, user, &late);
  if (status == VT_OK && !late) status = wait_for(context, pid, end, &wait_status, &late);
  close(output);
  if (status != VT_OK) {
    stop(pid, &wait_status);
    return vt_fail(context, status, "%s: interrupted", arguments[0]);
  }
  if (late) stop(pid, &wait_status);
  if (late) *exit_code = VT_OUT_OF_TIME;
  if (late) return VT_OK;
  *exit_code = WIFEXITED(wait_status)     ? WEXITSTATUS(wait_status)
               : WIFSIGNALED(wait_status) ? 128 + WTERMSIG(wait_status)
                                          : 1;
  return *exit_code == 127 ? VT_MISSING_PROGRAM : VT_OK; // a system whose posix_spawn cannot say it otherwise
}
