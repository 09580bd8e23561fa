// turntable.c - a folder of frames that appears complete, and a film of it
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/turntable.h"

#include "base/file.h"

#include <errno.h>
#include <spawn.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

vt_status vt_begin_turntable(vt_session *session, const char *folder, vt_turntable *out) {
  vt_context *context = session->context;
  size_t length = strlen(folder);
  while (length > 1 && folder[length - 1] == '/') length--;
  *out = (vt_turntable){0};
  out->folder = vt_print_text(context, "%.*s", (int)length, folder);
  char *work = vt_print_text(context, "%.*s.tmp.%ld", (int)length, folder, (long)getpid());
  if (!out->folder || !work) {
    vt_free(context, work);
    return VT_OUT_OF_MEMORY;
  }
  vt_status status = vt_make_folder(context, work);
  if (status)
    vt_free(context, work);
  else
    out->work = work;
  return status;
}

char *vt_turntable_frame(vt_session *session, const vt_turntable *turn, int number) {
  return vt_print_text(session->context, "%s/frame_%04d.%s", turn->work, number, vt_picture_ending());
}

// ffmpeg pads odd sizes, which H.264 in yuv420p cannot hold. No ffmpeg is no error: the frames are there.
static void make_film(vt_session *session, const vt_turntable *turn) {
  char *frames = vt_print_text(session->context, "%s/frame_%%04d.%s", turn->work, vt_picture_ending());
  char *film = vt_print_text(session->context, "%s/turntable.mp4", turn->work);
  if (frames && film) {
    char *words[] = {(char[]){"ffmpeg"},
                     (char[]){"-nostdin"},
                     (char[]){"-y"},
                     (char[]){"-loglevel"},
                     (char[]){"error"},
                     (char[]){"-framerate"},
                     (char[]){"25"},
                     (char[]){"-i"},
                     frames,
                     (char[]){"-vf"},
                     (char[]){"pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white"},
                     (char[]){"-pix_fmt"},
                     (char[]){"yuv420p"},
                     (char[]){"-movflags"},
                     (char[]){"+faststart"},
                     film,
                     NULL};
    pid_t child;
    int wait_status = 0, problem = posix_spawnp(&child, "ffmpeg", NULL, NULL, words, environ);
    if (!problem)
      while (waitpid(child, &wait_status, 0) < 0 && errno == EINTR) {
      }
    if (problem)
      vt_log(session->context, VT_LOG_NORMAL,
             "voltree: ffmpeg: not found, so there is no turntable.mp4; install it to have one");
    else if (wait_status)
      vt_log(session->context, VT_LOG_NORMAL,
             "voltree: ffmpeg: failed, so there is no turntable.mp4; the frames are there");
    if (problem || wait_status) unlink(film);
  }
  vt_free(session->context, frames);
  vt_free(session->context, film);
}

// Moves every file of the hidden folder into an older one of the right name.
static vt_status move_files(vt_session *session, const vt_turntable *turn) {
  vt_context *context = session->context;
  vt_names names = {0};
  vt_status status = vt_list_folder(context, turn->work, false, &names);
  for (int i = 0; i < names.count && !status; i++) {
    char *from = vt_join(context, turn->work, names.items[i]), *to = vt_join(context, turn->folder, names.items[i]);
    if (!from || !to)
      status = VT_OUT_OF_MEMORY;
    else if (rename(from, to))
      status = vt_fail(context, VT_FAILED, "%s: cannot be written (%s); give another folder", to, strerror(errno));
    vt_free(context, from);
    vt_free(context, to);
  }
  vt_free_names(context, &names);
  if (!status) rmdir(turn->work);
  return status;
}

vt_status vt_finish_turntable(vt_session *session, vt_turntable *turn, bool film) {
  if (film) make_film(session, turn);
  if (vt_cancelled(session->context)) return VT_CANCELLED;
  vt_status status = VT_OK;
  if (vt_is_folder(turn->folder))
    status = move_files(session, turn);
  else if (rename(turn->work, turn->folder))
    status = vt_fail(session->context, VT_FAILED, "%s: cannot be made (%s); give another name", turn->folder,
                     strerror(errno));
  if (!status) {
    vt_free(session->context, turn->work);
    turn->work = NULL;
  }
  return status;
}

void vt_drop_turntable(vt_session *session, vt_turntable *turn) {
  vt_context *context = session->context;
  vt_names names = {0};
  if (turn->work && !vt_list_folder(context, turn->work, false, &names)) {
    for (int i = 0; i < names.count; i++) {
      char *path = vt_join(context, turn->work, names.items[i]);
      if (path) unlink(path);
      vt_free(context, path);
    }
    vt_free_names(context, &names);
    rmdir(turn->work);
  }
  vt_free(context, turn->folder);
  vt_free(context, turn->work);
  *turn = (vt_turntable){0};
}
