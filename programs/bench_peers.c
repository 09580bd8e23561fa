// bench_peers.c - foreign programs that are measured in the same run, through one small contract
// SPDX-License-Identifier: BSD-3-Clause
//
// Figures from papers were taken on other machines, other photographs and other days. A peer is therefore run here, on
// the same photographs, at the same time. It is a program that nobody of us wrote: it may crash, hang, write pictures
// of the wrong size or none. All of that is said in the report and stops nothing.
#include "programs/bench_peers.h"

#include "base/child_process.h"
#include "base/file.h"
#include "base/image_file.h"
#include "capture/capture.h"

#include <math.h>
#include <string.h>

#define GRACE 30 // seconds beyond twice the budget

// ---- the list

void vt_free_peers(vt_context *context, vt_peers *peers) {
  for (int i = 0; i < peers->count; i++) {
    vt_free(context, peers->items[i].name);
    vt_free(context, peers->items[i].executable);
  }
  vt_free(context, peers->items);
  *peers = (vt_peers){0};
}

static vt_status add_peer(vt_context *context, const char *text, size_t length, const char *where, vt_peers *peers) {
  const char *equals = memchr(text, '=', length);
  if (!equals || equals == text || equals + 1 == text + length || memchr(text, '/', (size_t)(equals - text)))
    return vt_fail(context, VT_BAD_USAGE, "%s %.*s: is not of the form NAME=EXECUTABLE; give it so", where, (int)length,
                   text);
  for (int i = 0; i < peers->count; i++)
    if (strlen(peers->items[i].name) == (size_t)(equals - text) &&
        !memcmp(peers->items[i].name, text, (size_t)(equals - text)))
      return vt_fail(context, VT_BAD_USAGE, "%s %.*s: there is a peer of this name already; give another", where,
                     (int)length, text);
  vt_peer *more = vt_realloc(context, peers->items, (size_t)peers->count + 1, sizeof *more);
  if (!more) return VT_OUT_OF_MEMORY;
  peers->items = more;
  vt_peer *peer = &peers->items[peers->count++];
  peer->name = vt_print_text(context, "%.*s", (int)(equals - text), text);
  peer->executable = vt_print_text(context, "%.*s", (int)(text + length - equals - 1), equals + 1);
  return peer->name && peer->executable ? VT_OK : VT_OUT_OF_MEMORY;
}

vt_status vt_list_peers(vt_session *session, vt_peers *out) {
  vt_context *context = session->context;
  vt_status status = VT_OK;
  *out = (vt_peers){0};
  const char *text;
  for (int i = 0; !status && (text = vt_listed_of(&session->arguments, "peer", i)); i++)
    status = add_peer(context, text, strlen(text), "--peer", out);
  const char *list = getenv("VOLTREE_PEERS");
  while (!status && list && *list) {
    size_t length = strcspn(list, ",");
    if (length) status = add_peer(context, list, length, "VOLTREE_PEERS", out);
    list += length + (list[length] == ',');
  }
  if (status) vt_free_peers(context, out);
  return status;
}

// ---- the capture

// What the n-th view of its role is called there: unlike file names of photographs, never twice the same.
static void peer_name(vt_role role, int n, char out[32]) {
  snprintf(out, 32, "%s_%03d", role == VT_TEST ? "test" : "train", n);
}

vt_status vt_write_peer_capture(vt_context *context, const vt_views *views, const char *folder) {
  vt_views renamed = {.items = VT_NEW(context, vt_view, (size_t)views->count)};
  char(*names)[40] = vt_alloc(context, (size_t)views->count, sizeof *names);
  int of_role[2] = {0};
  vt_status status = renamed.items && names ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < views->count && !status; i++) {
    renamed.items[i] = views->items[i];
    peer_name(views->items[i].role, of_role[views->items[i].role == VT_TEST]++, names[i]);
    strcat(names[i], ".png"); // an ending that the writer of captures may take away
    renamed.items[i].name = names[i];
    renamed.count++;
  }
  if (!status) status = vt_write_capture(context, &renamed, folder);
  vt_free(context, names);
  vt_free(context, renamed.items);
  return status;
}

// ---- running one

void vt_free_peer_result(vt_context *context, vt_peer_result *result) {
  vt_free_pictures(context, &result->pictures);
  *result = (vt_peer_result){0};
}

typedef struct listener {
  vt_peer_result *result;
  char last[200]; // line that was not empty
} listener;

static void hear(void *user, const char *line) {
  listener *l = user;
  float b[3];
  if (line[strspn(line, " \t")]) snprintf(l->last, sizeof l->last, "%s", line);
  if (sscanf(line, "background %f %f %f", &b[0], &b[1], &b[2]) != 3) return;
  for (int c = 0; c < 3; c++)
    if (!(b[c] >= 0 && b[c] <= 1)) return;
  memcpy(l->result->background, b, sizeof b);
  l->result->has_background = true;
}

// An empty picture stays where the peer's cannot be used; the first reason is kept.
static vt_status take_picture(vt_context *context, const vt_peer *peer, const char *path, const vt_view *view,
                              vt_peer_result *result, vt_image *out) {
  char trouble[600] = "";
  vt_image picture = {0};
  if (!vt_is_file(path)) return VT_OK;
  vt_status status = vt_read_image(context, path, &picture);
  if (status == VT_OUT_OF_MEMORY || status == VT_CANCELLED) return status;
  if (status) {
    snprintf(trouble, sizeof trouble, "%s: %.500s", peer->name, vt_last_error(context));
    vt_clear_error(context);
  } else if (picture.width != view->camera.width || picture.height != view->camera.height) {
    snprintf(trouble, sizeof trouble,
             "%s: %s: is %d x %d, and the view %d x %d; let it write pictures of the view's size", peer->name,
             vt_base_name(path), picture.width, picture.height, view->camera.width, view->camera.height);
  } else if (picture.channels != 4 && !result->has_background) {
    snprintf(trouble, sizeof trouble,
             "%s: %s: is opaque, and no line \"background R G B\" was said; let it say one or write RGBA", peer->name,
             vt_base_name(path));
  } else {
    *out = picture;
    result->drawn++;
    return VT_OK;
  }
  if (!*result->trouble) memcpy(result->trouble, trouble, sizeof trouble);
  vt_free_image(context, &picture);
  return VT_OK;
}

static vt_status take_pictures(vt_context *context, const vt_peer *peer, const char *folder, const vt_views *judged,
                               vt_peer_result *result) {
  vt_status status = vt_make_pictures(context, judged->count, &result->pictures);
  for (int i = 0; i < judged->count && !status; i++) {
    char name[32];
    peer_name(VT_TEST, i, name);
    char *path = vt_print_text(context, "%s/%s.png", folder, name);
    status = path ? take_picture(context, peer, path, &judged->items[i], result, &result->pictures.items[i])
                  : VT_OUT_OF_MEMORY;
    vt_free(context, path);
  }
  if (!status && !result->drawn && !*result->trouble)
    snprintf(result->trouble, sizeof result->trouble,
             "%s: wrote no picture of the %d test views; see its contract in bench/peers", peer->name, judged->count);
  return status;
}

vt_status vt_run_peer(vt_context *context, const vt_peer *peer, const char *capture, double seconds,
                      const char *out_folder, const vt_views *judged, vt_peer_result *out) {
  *out = (vt_peer_result){.seconds = NAN};
  vt_status status = vt_make_folder(context, out_folder);
  if (status) return status;
  char budget[32];
  snprintf(budget, sizeof budget, "%g", seconds);
  char *arguments[] = {peer->executable, (char *)capture, budget, (char *)out_folder, NULL};
  listener ear = {.result = out};
  int code = 0;
  double start = vt_seconds();
  status = vt_run_program_within(context, arguments, 2 * seconds + GRACE, NULL, hear, &ear, &code);
  out->seconds = vt_seconds() - start;
  if (status == VT_CANCELLED || status == VT_OUT_OF_MEMORY) return status;
  if (status == VT_MISSING_PROGRAM)
    snprintf(out->trouble, sizeof out->trouble, "%s: %s: there is no such program; look at its path", peer->name,
             peer->executable);
  else if (status)
    snprintf(out->trouble, sizeof out->trouble, "%s: %.500s", peer->name, vt_last_error(context));
  else if (code == VT_OUT_OF_TIME)
    snprintf(out->trouble, sizeof out->trouble,
             "%s: was ended after %.0f s, twice its budget of %g s and half a minute", peer->name, out->seconds,
             seconds);
  else if (code)
    snprintf(out->trouble, sizeof out->trouble, "%s: failed with exit code %d; it last said: %s", peer->name, code,
             ear.last);
  vt_clear_error(context);
  if (*out->trouble) return vt_make_pictures(context, judged->count, &out->pictures);
  return take_pictures(context, peer, out_folder, judged, out);
}
