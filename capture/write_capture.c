// write_capture.c - views as a folder that other programs of the field read
// SPDX-License-Identifier: BSD-3-Clause
//
// Who reads what: nerfstudio and instant-ngp want transforms.json with names that have an ending; NeRF, 3D Gaussian
// splatting and what grew from them want transforms_train.json and transforms_test.json and put ".png" behind the names
// themselves. So names have no ending there. Both have lens and size in each frame, and camera_angle_x for those who
// read nothing else. What is ignored of a view is a picture of its own, ignored/NAME.png, white where nothing is known.
//
// An older folder is replaced only if we wrote it and nothing was put into it since: a user's photographs must never go
// because a folder was named twice on a command line.

#include "capture/capture.h"
#include "base/file.h"
#include "base/image_file.h"
#include "base/folders.h"
#include "capture/photos.h"
#include "capture/write_cameras.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const char generator[] = "\"generator\": \"voltree\"";

// ---- names

// "images/" and the view's name below it without ending and without a way out of the folder. Free with vt_free.
static char *picture_stem(vt_context *context, const char *name) {
  if (!strncmp(name, "images/", 7)) name += 7;
  char *stem = vt_without_ending(context, name), *out = stem ? vt_concat(context, "images/", stem, "") : NULL;
  vt_free(context, stem);
  if (!out) return NULL;
  for (char *part = out + 7;;) { // empty, ".", ".." and control characters become harmless
    size_t length = strcspn(part, "/");
    if (!length && part[0] == '/') part[0] = '_', length = strcspn(part, "/");
    if (length == 1 && part[0] == '.') part[0] = '_';
    if (length == 2 && part[0] == '.' && part[1] == '.') part[0] = part[1] = '_';
    for (size_t i = 0; i < length; i++)
      if ((unsigned char)part[i] < 32 || part[i] == '\\' || part[i] == ':') part[i] = '_';
    part += length;
    if (!*part) break;
    part++;
  }
  return out;
}

typedef struct entry {
  char *stem;
  int view;
} entry;

static int compare_entries(const void *a, const void *b) {
  int order = strcmp(((const entry *)a)->stem, ((const entry *)b)->stem);
  return order ? order : ((const entry *)a)->view - ((const entry *)b)->view;
}

static void free_stems(vt_context *context, char **stems, int count) {
  for (int i = 0; stems && i < count; i++) vt_free(context, stems[i]);
  vt_free(context, stems);
}

// One name for each view, no two alike: "a" and "a_2" of a.jpg and a.png. NULL only without memory.
static char **make_stems(vt_context *context, const vt_views *views) {
  size_t count = (size_t)views->count;
  char **stems = VT_NEW(context, char *, count);
  entry *order = VT_NEW(context, entry, count);
  bool clash = stems && order, failed = !clash;
  for (size_t i = 0; i < count && !failed; i++)
    if (!(stems[i] = picture_stem(context, views->items[i].name))) failed = true;
  for (int turn = 0; clash && !failed; turn++) { // a changed name may meet another, so it is looked at again
    clash = false;
    for (size_t i = 0; i < count; i++) order[i] = (entry){stems[i], (int)i};
    if (count) qsort(order, count, sizeof *order, compare_entries);
    for (size_t i = 1, same = 1; i < count && !failed; i++) {
      same = strcmp(order[i - 1].stem, order[i].stem) ? 1 : same + 1;
      if (same == 1) continue;
      char tail[32];
      snprintf(tail, sizeof tail, "_%zu", same);
      stems[order[i].view] = vt_concat(context, order[i].stem, tail, "");
      failed = !stems[order[i].view];
      clash = true;
    }
    for (size_t i = 0; i < count; i++)
      if (order[i].stem != stems[order[i].view]) vt_free(context, order[i].stem);
  }
  vt_free(context, order);
  if (!failed) return stems;
  free_stems(context, stems, views->count);
  return NULL;
}

// ---- cameras

typedef struct transforms { // of which views a file is, and how it names their pictures
  const vt_views *views;
  char *const *stems;
  int role;             // or < 0: all
  const char *ending;   // of file_path
  const char *pictures; // stands before the picture's path
  const char *masks;    // or NULL; stands before the mask's
  const char *ignored;  // or NULL; stands before the picture's of what is ignored, of views that have one
} transforms;

typedef struct frame_names { char *name, *mask, *ignored; } frame_names; // owned

static bool name_frame(vt_context *context, const transforms *t, int view, frame_names *out) {
  const char *inner = t->stems[view] + strlen("images/");
  bool ignored = t->ignored && t->views->items[view].ignored.pixels;
  out->name = vt_concat(context, t->pictures, t->stems[view], t->ending);
  if (t->masks) out->mask = vt_concat(context, t->masks, inner, ".png");
  if (ignored) out->ignored = vt_concat(context, t->ignored, inner, ".png");
  return out->name && (out->mask || !t->masks) && (out->ignored || !ignored);
}

static vt_status write_transforms(vt_context *context, const transforms *t, const char *folder, const char *name) {
  size_t all = (size_t)t->views->count;
  vt_listed *list = VT_NEW(context, vt_listed, all);
  frame_names *names = VT_NEW(context, frame_names, all);
  char *path = vt_join(context, folder, name);
  vt_status status = list && names && path ? VT_OK : VT_OUT_OF_MEMORY;
  int count = 0;
  for (int i = 0; i < t->views->count && !status; i++) {
    const vt_camera *c = &t->views->items[i].camera;
    if (t->role >= 0 && t->views->items[i].role != (vt_role)t->role) continue;
    if (!name_frame(context, t, i, &names[i])) status = VT_OUT_OF_MEMORY;
    list[count++] = (vt_listed){names[i].name, names[i].mask, names[i].ignored, vt_lens_of_camera(c), c->rotation,
                                c->translation};
  }
  if (!status) status = vt_write_transforms(context, list, count, &t->views->world, path);
  for (size_t i = 0; i < all && names; i++) {
    vt_free(context, names[i].name);
    vt_free(context, names[i].mask);
    vt_free(context, names[i].ignored);
  }
  vt_free(context, names);
  vt_free(context, list);
  vt_free(context, path);
  return status;
}

// One file, or one for each role where there are views to judge against. NeRF's names have no ending in two files.
static vt_status write_lists(vt_context *context, const vt_views *views, char *const *stems, const char *folder,
                             const char *pictures, const char *masks, const char *ignored) {
  int test_count = vt_count_views(views, VT_TEST);
  transforms t = {views, stems, -1, test_count ? "" : ".png", pictures, masks, ignored};
  if (!test_count) return write_transforms(context, &t, folder, "transforms.json");
  vt_status status = VT_OK;
  t.role = VT_TRAIN;
  if (test_count < views->count) status = write_transforms(context, &t, folder, "transforms_train.json");
  t.role = VT_TEST;
  return status ? status : write_transforms(context, &t, folder, "transforms_test.json");
}

vt_status vt_write_cameras(vt_context *context, const vt_views *views, const char *folder, const char *pictures,
                           const char *masks) {
  VT_ASSERT(views && views->count > 0 && folder && *folder);
  char **stems = make_stems(context, views);
  vt_status status = stems ? write_lists(context, views, stems, folder, pictures, masks, NULL) : VT_OUT_OF_MEMORY;
  free_stems(context, stems, views->count);
  return status;
}

// ---- pictures

typedef struct writing {
  vt_context *context;
  const vt_views *views;
  char *const *stems;
  const char *folder;
  vt_status *status;
} writing;

static vt_status write_one(writing *w, const char *folder, const char *stem, const vt_image *picture) {
  char *name = vt_concat(w->context, folder, stem, ".png"),
       *path = name ? vt_join(w->context, w->folder, name) : NULL;
  char *parent = path ? vt_strdup(w->context, path) : NULL;
  vt_status status = parent ? VT_OK : VT_OUT_OF_MEMORY;
  if (parent) {
    *strrchr(parent, '/') = 0;
    status = vt_make_folder(w->context, parent);
  }
  if (!status) status = vt_write_image(w->context, path, picture);
  vt_free(w->context, parent);
  vt_free(w->context, path);
  vt_free(w->context, name);
  return status;
}

static vt_status write_picture(writing *w, size_t i) {
  const vt_view *view = &w->views->items[i];
  vt_status status = write_one(w, "", w->stems[i], &view->picture);
  return status || !view->ignored.pixels ? status
                                         : write_one(w, "ignored/", w->stems[i] + strlen("images/"), &view->ignored);
}

static void write_block(void *user, size_t begin, size_t end, int worker) {
  writing *w = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) w->status[i] = write_picture(w, i);
}

static vt_status write_pictures(vt_context *context, const vt_views *views, char *const *stems, const char *folder) {
  writing w = {context, views, stems, folder, VT_NEW(context, vt_status, (size_t)views->count)};
  if (!w.status) return VT_OUT_OF_MEMORY;
  vt_status status = vt_parallel(context, (size_t)views->count, 1, write_block, &w);
  for (int i = 0; i < views->count && !status; i++) status = w.status[i];
  vt_free(context, w.status);
  return status;
}

// ---- the folder

static bool is_ours(vt_context *context, const char *folder, const char *name) {
  char *path = vt_join(context, folder, name);
  uint8_t *text = NULL;
  size_t size = 0;
  bool ours = path && !vt_read_file(context, path, &text, &size) && strstr((const char *)text, generator);
  vt_free(context, text);
  vt_free(context, path);
  return ours;
}

// The name without "truth/" or "relight_N/" in front: a synthetic capture holds these (programs/verb_synth.c).
static const char *inner_name(const char *name) {
  static const char relight[] = "relight_";
  if (!strncmp(name, "truth/", 6)) return name + 6;
  if (strncmp(name, relight, strlen(relight))) return name;
  const char *behind = name + strlen(relight), *end = behind + strspn(behind, "0123456789");
  if (end == behind || *end != '/') return name;
  return !strncmp(end + 1, "truth/", 6) ? end + 7 : end + 1;
}

// VT_OK if `folder` is not there, is empty, or holds only what an earlier vt_write_capture put there.
static vt_status check_target(vt_context *context, const char *folder) {
  if (!vt_is_folder(folder))
    return access(folder, F_OK)
               ? VT_OK
               : vt_fail(context, VT_FAILED, "%s: is a file; choose another name for the folder", folder);
  vt_names names = {0};
  vt_status status = vt_list_folder(context, folder, true, &names);
  bool ours = true, listed = false;
  for (int i = 0; i < names.count && !status && ours; i++) {
    const char *name = inner_name(names.items[i]);
    size_t length = strlen(name);
    bool list = !strcmp(name, "transforms.json") || !strcmp(name, "transforms_train.json") ||
                !strcmp(name, "transforms_test.json") || !strcmp(name, "truth.json");
    bool picture = !strncmp(name, "images/", 7) || !strncmp(name, "mattes/", 7) || !strncmp(name, "ignored/", 8);
    listed = listed || list;
    ours = list ? is_ours(context, folder, names.items[i]) : picture && !strcmp(name + length - 4, ".png");
  }
  ours = ours && (listed || !names.count);
  vt_free_names(context, &names);
  if (status || ours) return status;
  return vt_fail(context, VT_FAILED,
                 "%s: there is something in it that voltree did not write; choose another folder, or "
                 "empty it",
                 folder);
}

// Renames `made` to `folder`; an older one is out of the way only for the moment between two renames.
static vt_status swap_in(vt_context *context, const char *made, const char *folder) {
  char *old = NULL;
  vt_status status = VT_OK;
  if (vt_is_folder(folder) && rmdir(folder)) { // not empty
    old = vt_concat(context, made, ".old", "");
    if (!old) return VT_OUT_OF_MEMORY;
    vt_remove_folder(context, old);
    if (rename(folder, old))
      status =
          vt_fail(context, VT_FAILED, "%s: cannot be replaced (%s); choose another folder", folder, strerror(errno));
  }
  if (!status && rename(made, folder)) {
    status = vt_fail(context, VT_FAILED, "%s: cannot be written (%s); choose another folder", folder, strerror(errno));
    if (old) (void)rename(old, folder);
  } else if (!status && old) {
    vt_remove_folder(context, old);
  }
  vt_free(context, old);
  return status;
}

vt_status vt_write_capture(vt_context *context, const vt_views *views, const char *folder) {
  VT_ASSERT(views && views->count > 0 && folder && *folder);
  char *target = vt_strdup(context, folder), *made = NULL, **stems = NULL;
  vt_status status = target ? VT_OK : VT_OUT_OF_MEMORY;
  for (size_t n = target ? strlen(target) : 0; n > 1 && target[n - 1] == '/'; n--) target[n - 1] = 0;
  if (!status) status = check_target(context, target);
  if (!status) status = vt_make_folder_beside(context, target, &made);
  if (!status && !(stems = make_stems(context, views))) status = VT_OUT_OF_MEMORY;
  if (!status) status = write_pictures(context, views, stems, made);
  if (!status) status = write_lists(context, views, stems, made, "", NULL, "ignored/");
  if (!status) status = swap_in(context, made, target);
  if (status && made) vt_remove_folder(context, made);
  free_stems(context, stems, views->count);
  vt_free(context, made);
  vt_free(context, target);
  return status;
}
