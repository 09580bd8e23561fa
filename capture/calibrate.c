// calibrate.c - cameras for photographs alone, kept by the photographs' content
// SPDX-License-Identifier: BSD-3-Clause
//
// Calibration is the longest stage, so its result is kept in the cache folder under a name made of what it depends on:
// the photographs' names and bytes and the options of colmap. The folder gets that name only when it is complete, and
// one that turns out damaged is made again. Before colmap starts, every photograph is decoded once: a broken file must
// not show after an hour, and what is wrong with the photographs is seen on the way (check.c).
// Until it is complete the workspace stands in the cache too, under a lock: a run that was killed goes on in it, and a second
// run on the same photographs waits for the first one's result. It is removed where trying again would not help.

#include "capture/calibrate.h"
#include "base/cache.h"
#include "base/folders.h"
#include "base/hash.h"
#include "base/image_file.h"
#include "capture/check.h"
#include "capture/colmap_run.h"
#include "capture/masks.h"
#include "capture/photos.h"

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

// ---- the key

typedef struct hashing {
  vt_context *context;
  const char *folder;
  const vt_names *names;
  uint64_t *hashes;
  vt_status *status;
} hashing;

static vt_status hash_one(hashing *h, size_t i) {
  char *path = vt_join(h->context, h->folder, h->names->items[i]);
  if (!path) return VT_OUT_OF_MEMORY;
  uint8_t *bytes = NULL;
  size_t size = 0;
  vt_status status = vt_read_file(h->context, path, &bytes, &size);
  if (!status) h->hashes[i] = vt_hash(bytes, size, 0);
  vt_free(h->context, bytes);
  vt_free(h->context, path);
  return status;
}

static void hash_block(void *user, size_t begin, size_t end, int worker) {
  hashing *h = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) h->status[i] = hash_one(h, i);
}

// Of several bad files the first by name is the one in the sentence.
static vt_status hash_photos(vt_context *context, const char *folder, const vt_names *names, uint64_t *hash) {
  size_t count = (size_t)names->count;
  hashing h = {context, folder, names, VT_NEW(context, uint64_t, count), VT_NEW(context, vt_status, count)};
  vt_status status = h.hashes && h.status ? vt_parallel(context, count, 1, hash_block, &h) : VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && !status; i++) {
    if (h.status[i]) {
      vt_clear_error(context);
      status = hash_one(&h, i);
    }
    *hash = vt_hash(names->items[i], strlen(names->items[i]) + 1, *hash);
    *hash = vt_hash(&h.hashes[i], sizeof h.hashes[i], *hash);
  }
  vt_free(context, h.hashes);
  vt_free(context, h.status);
  return status;
}

// Ignored pixels have no features, so what --ignore names is a part of the key.
static vt_status hash_ignored(vt_context *context, const char *ignore, uint64_t *hash) {
  vt_names names = {0};
  const char *folder = vt_is_folder(ignore) ? ignore : "";
  vt_status status = VT_OK;
  if (*folder) {
    status = vt_list_folder(context, ignore, true, &names);
  } else {
    names.items = VT_NEW(context, char *, 1);
    if (names.items) names.items[0] = vt_strdup(context, ignore);
    names.count = names.items && names.items[0];
    if (!names.count) status = VT_OUT_OF_MEMORY;
  }
  if (!status) status = hash_photos(context, folder, &names, hash);
  vt_free_names(context, &names);
  return status;
}

static vt_status make_key(vt_context *context, const vt_capture_desc *desc, const char *folder, const vt_names *names,
                          uint64_t *key) {
  static const char version[] = "calibration 3"; // to be counted up when the ladder of colmap_run.c changes
  const char *program = desc->colmap ? desc->colmap : "colmap";
  *key = vt_hash(program, strlen(program) + 1, vt_hash(version, sizeof version, desc->seed));
  vt_status status = hash_photos(context, folder, names, key);
  return status || !desc->ignore ? status : hash_ignored(context, desc->ignore, key);
}

// ---- reading and making

// The text of a file, "" if there is none.
static vt_status read_text(vt_context *context, const char *folder, const char *name, char **out) {
  char *path = vt_join(context, folder, name);
  uint8_t *bytes = NULL;
  size_t size = 0;
  vt_status status = path ? VT_OK : VT_OUT_OF_MEMORY;
  if (path && vt_is_file(path)) status = vt_read_file(context, path, &bytes, &size);
  vt_free(context, path);
  *out = bytes ? (char *)bytes : status ? NULL : vt_strdup(context, "");
  return status || *out ? status : VT_OUT_OF_MEMORY;
}

static vt_status read_calibration(vt_context *context, const char *folder, vt_calibration *out) {
  char *model = vt_join(context, folder, "0");
  vt_status status = model ? vt_read_colmap_model(context, model, &out->model) : VT_OUT_OF_MEMORY;
  if (!status) status = read_text(context, folder, "left-out.txt", &out->left_out);
  if (!status) status = read_text(context, folder, "rungs.txt", &out->attempts);
  if (!status) status = read_text(context, folder, "warnings.txt", &out->warnings);
  vt_free(context, model);
  if (status) vt_free_calibration(context, out);
  return status;
}

void vt_free_calibration(vt_context *context, vt_calibration *calibration) {
  vt_free_colmap_model(context, &calibration->model);
  vt_free(context, calibration->left_out);
  vt_free(context, calibration->attempts);
  vt_free(context, calibration->warnings);
  *calibration = (vt_calibration){0};
}

static vt_status write_warnings(vt_context *context, const vt_check_report *check, const char *folder) {
  size_t size = 1;
  for (int i = 0; i < check->warning_count; i++) size += strlen(check->warnings[i]) + 1;
  char *text = VT_NEW(context, char, size), *end = text, *path = vt_join(context, folder, "warnings.txt");
  vt_status status = text && path ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < check->warning_count && !status; i++) end += sprintf(end, "%s\n", check->warnings[i]);
  if (!status) status = vt_write_file(context, path, text, (size_t)(end - text));
  vt_free(context, text);
  vt_free(context, path);
  return status;
}

// Runs colmap in `workspace`. *sparse: what is to be kept, its model and notes without database and pictures.
static vt_status run_colmap(vt_context *context, const vt_capture_desc *desc, const char *folder, const vt_names *names,
                            const char *workspace, char **sparse) {
  vt_check_report check = {0};
  *sparse = vt_join(context, workspace, "sparse");
  vt_status status = *sparse ? vt_check_photographs(context, folder, names, true, &check) : VT_OUT_OF_MEMORY;
  if (!status) status = vt_run_colmap(context, desc, folder, names, workspace);
  if (!status) status = write_warnings(context, &check, *sparse);
  vt_free_check_report(context, &check);
  return status;
}

// Whether the same command could go on in the workspace. Where the photographs are at fault it could not.
static bool worth_keeping(vt_status status) {
  return status == VT_CANCELLED || status == VT_FAILED || status == VT_OUT_OF_MEMORY;
}

// A workspace of an earlier run may be what is wrong: then it is tried once from the beginning, unless the disk is.
static vt_status run_in_workspace(vt_context *context, const vt_capture_desc *desc, const char *folder, const vt_names *names,
                                  const char *workspace, char **sparse) {
  bool resumed = vt_is_folder(workspace);
  vt_status status = vt_make_folder(context, workspace);
  if (resumed) vt_log(context, VT_LOG_NORMAL, "%s: an interrupted search for the cameras goes on", folder);
  if (!status) status = run_colmap(context, desc, folder, names, workspace, sparse);
  if (status != VT_FAILED || !resumed || vt_cancelled(context) || vt_free_bytes(workspace) < 64000000) return status;
  vt_log(context, VT_LOG_NORMAL, "%s; it is begun anew", vt_last_error(context));
  vt_clear_error(context);
  vt_free(context, *sparse);
  *sparse = NULL;
  vt_remove_folder(context, workspace);
  status = vt_make_folder(context, workspace);
  return status ? status : run_colmap(context, desc, folder, names, workspace, sparse);
}

// *out stays empty where there is nothing, or something damaged.
static vt_status look_up(vt_context *context, const char *entry, vt_calibration *out) {
  char *model = vt_join(context, entry, "0");
  vt_status status = model ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status && vt_is_colmap_model(context, model)) {
    status = read_calibration(context, entry, out);
    out->from_cache = !status && vt_use_entry(entry);
    if (status == VT_BAD_INPUT) {
      vt_log(context, VT_LOG_NORMAL, "%s: a damaged calibration is made again", entry);
      vt_clear_error(context);
      status = VT_OK;
    }
  }
  vt_free(context, model);
  return status;
}

static vt_status make_entry(vt_context *context, const vt_capture_desc *desc, const char *folder, const vt_names *names,
                            const char *entry, const char *workspace, vt_calibration *out) {
  char *sparse = NULL;
  vt_remove_folder(context, entry); // a damaged one
  vt_status status = run_in_workspace(context, desc, folder, names, workspace, &sparse);
  if (!status) status = read_calibration(context, sparse, out);
  if (!status) vt_keep_entry(context, sparse, entry);
  if (!worth_keeping(status)) vt_remove_folder(context, workspace);
  vt_free(context, sparse);
  return status;
}

static vt_status calibrate_in_cache(vt_context *context, const vt_capture_desc *desc, const char *folder,
                                    const vt_names *names, vt_calibration *out) {
  uint64_t key;
  vt_status status = make_key(context, desc, folder, names, &key);
  if (!status) status = vt_make_folder(context, desc->cache);
  if (status) return status;
  char *entry = vt_cache_entry(context, desc->cache, "calibration", key);
  char *workspace = vt_cache_entry(context, desc->cache, "work", key), *lock_path = NULL;
  vt_lock lock = {0};
  status = entry && workspace ? look_up(context, entry, out) : VT_OUT_OF_MEMORY;
  if (status || out->from_cache) goto done;
  lock_path = vt_concat(context, workspace, ".lock", "");
  status = lock_path ? vt_take_lock(context, lock_path, folder, &lock) : VT_OUT_OF_MEMORY;
  if (!status) status = look_up(context, entry, out); // another run may have made it meanwhile
  if (!status && !out->from_cache) status = make_entry(context, desc, folder, names, entry, workspace, out);
  vt_drop_lock(context, &lock);
done:
  vt_free(context, entry);
  vt_free(context, workspace);
  vt_free(context, lock_path);
  return status;
}

vt_status vt_calibrate(vt_context *context, const vt_capture_desc *desc, const char *folder, const vt_names *names,
                       vt_calibration *out) {
  *out = (vt_calibration){0};
  if (desc->cache) return calibrate_in_cache(context, desc, folder, names, out);
  char *workspace = NULL, *sparse = NULL;
  vt_status status = vt_make_scratch_folder(context, &workspace);
  if (status) return status;
  status = run_colmap(context, desc, folder, names, workspace, &sparse);
  if (!status) status = read_calibration(context, sparse, out);
  vt_remove_folder(context, workspace);
  vt_free(context, sparse);
  vt_free(context, workspace);
  return status;
}

vt_status vt_find_calibration(vt_context *context, const vt_capture_desc *desc, const char *folder, const vt_names *names,
                              vt_calibration *out, bool *kept, bool *begun) {
  uint64_t key;
  *out = (vt_calibration){0};
  *kept = *begun = false;
  if (!desc->cache || !vt_is_folder(desc->cache)) return VT_OK;
  vt_status status = make_key(context, desc, folder, names, &key);
  if (status) return status;
  char *entry = vt_cache_entry(context, desc->cache, "calibration", key);
  char *workspace = vt_cache_entry(context, desc->cache, "work", key);
  status = entry && workspace ? look_up(context, entry, out) : VT_OUT_OF_MEMORY;
  *kept = out->from_cache;
  *begun = !status && !*kept && vt_is_folder(workspace);
  vt_free(context, entry);
  vt_free(context, workspace);
  return status;
}
