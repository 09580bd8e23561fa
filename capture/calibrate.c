// calibrate.c - cameras for photographs alone, kept by the photographs' content
// SPDX-License-Identifier: BSD-3-Clause
//
// Calibration is the longest stage, so its result is kept in the cache folder under a name made of what it depends on:
// the photographs' names and bytes and the options of colmap. The folder gets that name only when it is complete, and
// one that turns out damaged is made again. Before colmap starts, every photograph is decoded once: a broken file must
// not show after an hour.

#include "capture/calibrate.h"
#include "base/hash.h"
#include "base/image_file.h"
#include "capture/colmap_run.h"
#include "base/folders.h"
#include "capture/masks.h"

#include <stdio.h>
#include <string.h>

vt_status vt_list_photos(vt_context *context, const char *folder, const char *masks, vt_names *out) {
  vt_status status = vt_list_folder(context, folder, true, out);
  int kept = 0;
  size_t folder_length = strlen(folder);
  for (int i = 0; i < out->count && !status; i++) {
    char *name = out->items[i];
    bool photo = vt_is_image_name(name) && !vt_is_mask_name(name);
    if (photo && masks && !strncmp(masks, folder, folder_length)) { // the user's masks lie among the photographs
      const char *inner = masks + folder_length;
      while (*inner == '/') inner++;
      size_t length = strlen(inner);
      while (length && inner[length - 1] == '/') length--;
      photo = !(length && !strncmp(name, inner, length) && name[length] == '/');
    }
    if (photo)
      out->items[kept++] = name;
    else
      vt_free(context, name);
  }
  if (!status) out->count = kept;
  return status;
}

typedef struct check {
  vt_context *context;
  const char *folder;
  const vt_names *names;
  bool decode;
  uint64_t *hashes;
  vt_status *status;
} check;

static vt_status check_one(check *c, size_t i) {
  char *path = vt_join(c->context, c->folder, c->names->items[i]);
  if (!path) return VT_OUT_OF_MEMORY;
  uint8_t *bytes = NULL;
  size_t size = 0;
  vt_image picture = {0};
  vt_status status =
      c->decode ? vt_read_image(c->context, path, &picture) : vt_read_file(c->context, path, &bytes, &size);
  if (!status && !c->decode) c->hashes[i] = vt_hash(bytes, size, 0);
  vt_free_image(c->context, &picture);
  vt_free(c->context, bytes);
  vt_free(c->context, path);
  return status;
}

static void check_block(void *user, size_t begin, size_t end, int worker) {
  check *c = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) c->status[i] = check_one(c, i);
}

// Hashes the files, or decodes them. Of several bad files the first by name is the one in the sentence.
static vt_status check_photos(vt_context *context, const char *folder, const vt_names *names, bool decode,
                              uint64_t *hash) {
  size_t count = (size_t)names->count;
  check c = {context, folder, names, decode, VT_NEW(context, uint64_t, count), VT_NEW(context, vt_status, count)};
  vt_status status = c.hashes && c.status ? vt_parallel(context, count, 1, check_block, &c) : VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && !status; i++) {
    if (c.status[i]) {
      vt_clear_error(context);
      status = check_one(&c, i);
      if (!status) status = vt_fail(context, c.status[i], "%s: cannot be read; run again", names->items[i]);
    }
    *hash = vt_hash(names->items[i], strlen(names->items[i]) + 1, *hash);
    *hash = vt_hash(&c.hashes[i], sizeof c.hashes[i], *hash);
  }
  vt_free(context, c.hashes);
  vt_free(context, c.status);
  return status;
}

// Runs colmap in `workspace` and moves the model, without its database and pictures, to `target` (NULL: reads it only).
static vt_status run_and_keep(vt_context *context, const vt_capture_desc *desc, const char *folder,
                              const vt_names *names, const char *workspace, const char *target, vt_colmap_model *out) {
  uint64_t unused = 0;
  vt_status status = check_photos(context, folder, names, true, &unused);
  if (!status) status = vt_run_colmap(context, desc, folder, names, workspace);
  if (status) return status;
  char *sparse = vt_join(context, workspace, "sparse"), *model = sparse ? vt_join(context, sparse, "0") : NULL;
  status = model ? vt_read_colmap_model(context, model, out) : VT_OUT_OF_MEMORY;
  // A rename onto a folder that another process has finished meanwhile fails, and nothing is lost.
  if (!status && target && rename(sparse, target) && !vt_is_folder(target))
    vt_log(context, VT_LOG_NORMAL, "%s: the calibration could not be kept there; it will be made again next time",
           target);
  vt_free(context, sparse);
  vt_free(context, model);
  return status;
}

static vt_status calibrate_in_cache(vt_context *context, const vt_capture_desc *desc, const char *folder,
                                    const vt_names *names, vt_colmap_model *out, bool *from_cache) {
  const char *program = desc->colmap ? desc->colmap : "colmap";
  uint64_t hash = vt_hash(program, strlen(program) + 1, desc->seed);
  vt_status status = check_photos(context, folder, names, false, &hash);
  if (!status) status = vt_make_folder(context, desc->cache);
  if (status) return status;
  char name[64];
  snprintf(name, sizeof name, "calibration-%016llx", (unsigned long long)hash);
  char *target = vt_join(context, desc->cache, name), *model = target ? vt_join(context, target, "0") : NULL;
  char *workspace = NULL;
  status = model ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status && vt_is_colmap_model(context, model)) {
    status = vt_read_colmap_model(context, model, out);
    *from_cache = !status;
    if (status == VT_BAD_INPUT) {
      vt_log(context, VT_LOG_NORMAL, "%s: a damaged calibration is made again", target);
      vt_clear_error(context);
      status = VT_OK;
    }
  }
  if (!status && !*from_cache) {
    vt_remove_folder(context, target);
    status = vt_make_folder_beside(context, target, &workspace);
    if (!status) status = run_and_keep(context, desc, folder, names, workspace, target, out);
    if (workspace) vt_remove_folder(context, workspace);
  }
  vt_free(context, workspace);
  vt_free(context, model);
  vt_free(context, target);
  return status;
}

vt_status vt_calibrate(vt_context *context, const vt_capture_desc *desc, const char *folder, const vt_names *names,
                       vt_colmap_model *out, bool *from_cache) {
  *from_cache = false;
  if (desc->cache) return calibrate_in_cache(context, desc, folder, names, out, from_cache);
  char *workspace = NULL;
  vt_status status = vt_make_scratch_folder(context, &workspace);
  if (status) return status;
  status = run_and_keep(context, desc, folder, names, workspace, NULL, out);
  vt_remove_folder(context, workspace);
  vt_free(context, workspace);
  return status;
}
