// session.c - one run of the program: common options, stages, what is said, and whether outputs can be written
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/session.h"

#include "base/file.h"
#include "base/image_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const char *vt_picture_ending(void) {
  return vt_is_output_name("a.png", true) ? "png" : "pam";
}

// ---- probes

static void write_probe(void *user, const char *name, const struct vt_fimage *picture) {
  vt_session *session = user;
  vt_image bytes = {0};
  if (vt_make_image(session->context, picture->width, picture->height, picture->channels, &bytes)) return;
  size_t count = (size_t)picture->width * (size_t)picture->height * (size_t)picture->channels;
  for (size_t i = 0; i < count; i++) {
    float v = picture->pixels[i];
    bytes.pixels[i] = (uint8_t)(v > 0 ? (v < 1 ? v * 255 + 0.5f : 255) : 0);
  }
  char plain[200];
  vt_plain_name(name, plain, sizeof plain);
  char *path = vt_print_text(session->context, "%s/%s.%s", session->probe, plain, vt_picture_ending());
  if (path && vt_write_image(session->context, path, &bytes)) {
    vt_log(session->context, VT_LOG_NORMAL, "voltree: %s; the work goes on without this probe",
           vt_last_error(session->context));
    vt_clear_error(session->context);
  }
  vt_free(session->context, path);
  vt_free_image(session->context, &bytes);
}

// ---- beginning and end

static void find_cache(vt_session *session) {
  const vt_arguments *arguments = &session->arguments;
  if (vt_given(arguments, "no-cache")) return;
  session->cache = vt_text_of(arguments, "cache", NULL);
  if (session->cache) return;
  const char *xdg = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
  int length = -1;
  if (xdg && *xdg == '/')
    length = snprintf(session->cache_text, sizeof session->cache_text, "%s/voltree", xdg);
  else if (home && *home)
    length = snprintf(session->cache_text, sizeof session->cache_text, "%s/.cache/voltree", home);
  if (length > 0 && (size_t)length < sizeof session->cache_text) session->cache = session->cache_text;
}

vt_status vt_begin_session(vt_session *session, char *problem, size_t size) {
  const vt_arguments *arguments = &session->arguments;
  session->start = session->stage_start = vt_seconds();
  session->json = vt_text_of(arguments, "json", NULL);
  session->report = vt_text_of(arguments, "report", NULL);
  session->probe = vt_text_of(arguments, "probe", NULL);
  session->quiet = vt_given(arguments, "quiet") || (session->json && !strcmp(session->json, "-"));
  find_cache(session);
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = vt_integer_of(arguments, "threads", 0);
  desc.max_memory = vt_bytes_of(arguments, "max-memory", 0);
  if (vt_given(arguments, "verbose")) desc.log_level = VT_LOG_VERBOSE;
  if (vt_given(arguments, "quiet")) desc.log_level = VT_LOG_QUIET;
  const char *term = getenv("TERM");
  desc.show_progress = isatty(STDERR_FILENO) && !(term && !strcmp(term, "dumb"));
  if (session->probe) {
    desc.probe = write_probe;
    desc.probe_user = session;
  }
  session->context = vt_create_context(&desc);
  if (!session->context) {
    snprintf(problem, size, "threads: the system gives no memory or no threads; give a lower --threads");
    return VT_OUT_OF_MEMORY;
  }
  vt_status status = VT_OK;
  if (session->report) status = vt_make_folder(session->context, session->report);
  if (!status && session->probe) status = vt_make_folder(session->context, session->probe);
  if (!status && session->json && strcmp(session->json, "-")) status = vt_check_output_file(session, session->json);
  if (status) snprintf(problem, size, "%s", vt_last_error(session->context));
  return status;
}

void vt_end_session(vt_session *session) {
  if (!session->context) return;
  vt_free(session->context, session->said);
  vt_destroy_context(session->context);
  session->context = NULL;
}

// ---- saying

void vt_say(vt_session *session, const char *format, ...) {
  va_list list, again;
  va_start(list, format);
  va_copy(again, list);
  if (!session->quiet) vprintf(format, list);
  va_end(list);
  int length = vsnprintf(NULL, 0, format, again);
  va_end(again);
  if (length < 0) return;
  size_t wanted = session->said_size + (size_t)length + 1;
  if (wanted > session->said_capacity) {
    char *more = vt_realloc(session->context, session->said, 2 * wanted, 1);
    if (!more) return;
    session->said = more;
    session->said_capacity = 2 * wanted;
  }
  va_start(list, format);
  vsnprintf(session->said + session->said_size, (size_t)length + 1, format, list);
  va_end(list);
  session->said_size += (size_t)length;
}

char *vt_print_text(vt_context *context, const char *format, ...) {
  va_list list;
  va_start(list, format);
  int length = vsnprintf(NULL, 0, format, list);
  va_end(list);
  char *text = length < 0 ? NULL : vt_alloc(context, (size_t)length + 1, 1);
  if (!text) return NULL;
  va_start(list, format);
  vsnprintf(text, (size_t)length + 1, format, list);
  va_end(list);
  return text;
}

void vt_plain_name(const char *name, char *out, size_t size) {
  snprintf(out, size, "%s", name);
  char *dot = strrchr(out, '.');
  if (dot && dot != out && !strchr(dot, '/')) *dot = 0;
  for (char *c = out; *c; c++)
    if (*c == '/' || *c == '\\' || (unsigned char)*c < ' ') *c = '_';
  if (*out == '.') *out = '_';
}

// ---- stages

void vt_note_stage(vt_session *session, const char *name, double seconds, uint64_t peak_bytes) {
  VT_ASSERT(session->stage_count < VT_MAX_STAGES);
  vt_stage_note *note = &session->stages[session->stage_count++];
  snprintf(note->name, sizeof note->name, "%s", name);
  note->seconds = seconds;
  note->peak_bytes = peak_bytes;
  if (peak_bytes > session->peak_bytes) session->peak_bytes = peak_bytes;
}

void vt_begin_stage(vt_session *session) {
  vt_reset_peak(session->context);
  session->stage_start = vt_seconds();
}

void vt_end_stage(vt_session *session, const char *name) {
  vt_note_stage(session, name, vt_seconds() - session->stage_start, vt_peak_bytes(session->context));
}

// ---- outputs

static vt_status explain_output(vt_session *session, const char *path, int problem) {
  const char *cure = problem == ENOENT    ? "make its folder first"
                     : problem == ENOTDIR ? "give a path whose folders are folders"
                     : problem == ENOSPC  ? "make room on the disk"
                                          : "give a path in a folder that you may write to";
  return vt_fail(session->context, VT_FAILED, "%s: cannot be written (%s); %s", path, strerror(problem), cure);
}

vt_status vt_check_output_file(vt_session *session, const char *path) {
  size_t length = strlen(path);
  if (vt_is_folder(path) || (length && path[length - 1] == '/'))
    return vt_fail(session->context, VT_FAILED, "%s: is a folder, and a file is to be written; give a file name", path);
  char *trial = vt_print_text(session->context, "%s.tmp.%ld.try", path, (long)getpid());
  if (!trial) return VT_OUT_OF_MEMORY;
  int file = open(trial, O_WRONLY | O_CREAT | O_EXCL, 0600), problem = errno;
  if (file >= 0) {
    close(file);
    unlink(trial);
  }
  vt_free(session->context, trial);
  return file >= 0 ? VT_OK : explain_output(session, path, problem);
}

vt_status vt_check_output_folder(vt_session *session, const char *path) {
  if (vt_is_file(path))
    return vt_fail(session->context, VT_FAILED, "%s: is a file, and a folder is to be written; give another name",
                   path);
  size_t length = strlen(path);
  while (length > 1 && path[length - 1] == '/') length--;
  char *trial = vt_print_text(session->context, "%.*s.tmp.%ld.try", (int)length, path, (long)getpid());
  if (!trial) return VT_OUT_OF_MEMORY;
  int made = mkdir(trial, 0700), problem = errno;
  if (!made) rmdir(trial);
  vt_free(session->context, trial);
  return made == 0 ? VT_OK : explain_output(session, path, problem);
}
