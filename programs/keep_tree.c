// keep_tree.c - raw trees in the cache, so that other codebooks or another output need no reconstruction
// SPDX-License-Identifier: BSD-3-Clause
//
// Key: cameras and pixels of the photographs that reconstruct looks at, its desc, the bound of memory (where memory is short a
// tree has fewer cells) and the program. What the clock decides (--time-budget) is never kept.
// A raw .vtree holds corners and view textures exactly, but rounds the cells' own colours to bytes. What is compressed from the
// cache must be what would have been compressed without it, so the cells' values stand in a second file as they are, and the
// report in a third. These two are for this program on this machine, which the key makes sure of. Raw tiles of the papers'
// methods can be gigabytes: a tree of more than a quarter of the cache is not kept.
#include "programs/keep_tree.h"

#include "base/cache.h"
#include "base/file.h"
#include "base/folders.h"
#include "base/hash.h"

#include <string.h>

// ---- the key

static uint64_t hash_desc(const vt_reconstruct_desc *d, uint64_t hash) {
  _Static_assert(sizeof(void *) != 8 || sizeof(vt_reconstruct_desc) == 56, "hash the new member");
  int64_t numbers[] = {(int64_t)d->method, (int64_t)d->preset,   d->leaf_level,   d->hull_votes, d->skip_empty_pixels,
                       d->keep_chords,     d->prune_hidden,      d->prune_thin,   d->split_where_needed, d->refine_epochs};
  hash = vt_hash(numbers, sizeof numbers, hash);
  return vt_hash(&d->hidden_threshold, sizeof d->hidden_threshold, hash);
}

char *vt_kept_tree_path(vt_session *session, const vt_reconstruct_desc *desc, const vt_views *views) {
  vt_context *context = session->context;
  _Static_assert(sizeof(void *) != 8 || sizeof(vt_view) == 16 + sizeof(vt_camera) + 2 * sizeof(vt_image), "hash the new member");
  uint64_t program = vt_program_hash(), bound = vt_memory_bound(context);
  if (!session->cache || desc->time_budget > 0 || !program || vt_wants_probes(context)) return NULL;
  uint64_t hash = vt_hash(&bound, sizeof bound, hash_desc(desc, program));
  for (int i = 0; i < views->count; i++) {
    const vt_view *view = &views->items[i];
    const vt_image *p = &view->picture;
    if (view->role != VT_TRAIN) continue;
    double numbers[4 + 12 + 4] = {view->camera.fx, view->camera.fy, view->camera.cx, view->camera.cy};
    for (int k = 0; k < 9; k++) numbers[4 + k] = view->camera.rotation.m[k];
    numbers[13] = view->camera.translation.x, numbers[14] = view->camera.translation.y, numbers[15] = view->camera.translation.z;
    numbers[16] = p->width, numbers[17] = p->height, numbers[18] = p->channels;
    numbers[19] = view->ignored.pixels != NULL;
    hash = vt_hash(numbers, sizeof numbers, hash);
    hash = vt_hash(p->pixels, (size_t)p->width * (size_t)p->height * (size_t)p->channels, hash);
    if (view->ignored.pixels) hash = vt_hash(view->ignored.pixels, (size_t)p->width * (size_t)p->height, hash);
  }
  return vt_cache_entry(context, session->cache, "tree", hash);
}

// ---- the cells' own values

static size_t count_cells(const vt_tree *tree) {
  size_t count = 0;
  for (int l = 0; l < tree->octree.level_count; l++) count += tree->octree.levels[l].cell_count;
  return count;
}

// Copies optical depths and colours of all levels between the tree and one array of 4 floats a cell.
static void move_values(vt_tree *tree, float *values, bool out_of_tree) {
  for (int l = 0; l < tree->octree.level_count; l++) {
    vt_level *level = &tree->octree.levels[l];
    size_t n = level->cell_count;
    if (out_of_tree) {
      memcpy(values, level->optical_depth, n * sizeof *values);
      memcpy(values + n, level->colour, 3 * n * sizeof *values);
    } else {
      memcpy(level->optical_depth, values, n * sizeof *values);
      memcpy(level->colour, values + n, 3 * n * sizeof *values);
    }
    values += 4 * n;
  }
}

static vt_status write_values(vt_context *context, const vt_tree *tree, const char *path) {
  size_t count = count_cells(tree);
  float *values = VT_NEW(context, float, 4 * count + 2);
  if (!values) return VT_OUT_OF_MEMORY;
  move_values((vt_tree *)tree, values, true);
  uint64_t hash = vt_hash(values, 4 * count * sizeof *values, 0);
  memcpy(values + 4 * count, &hash, sizeof hash);
  vt_status status = vt_write_file(context, path, values, (4 * count + 2) * sizeof *values);
  vt_free(context, values);
  return status;
}

static vt_status read_values(vt_context *context, vt_tree *tree, const char *path) {
  uint8_t *bytes = NULL;
  size_t size = 0, wanted = 4 * count_cells(tree) * sizeof(float);
  uint64_t hash;
  vt_status status = vt_read_file(context, path, &bytes, &size);
  if (!status && size == wanted + sizeof hash) memcpy(&hash, bytes + wanted, sizeof hash);
  if (!status && (size != wanted + sizeof hash || vt_hash(bytes, wanted, 0) != hash))
    status = vt_fail(context, VT_BAD_INPUT, "%s: damaged; it is made again", path);
  if (!status) move_values(tree, (float *)(void *)bytes, false); // vt_alloc aligns to 64
  vt_free(context, bytes);
  return status;
}

// ---- the entry

static vt_status read_report(vt_context *context, const char *path, vt_reconstruct_report *report) {
  uint8_t *bytes = NULL;
  size_t size = 0;
  vt_status status = vt_read_file(context, path, &bytes, &size);
  if (!status && size != sizeof *report) status = vt_fail(context, VT_BAD_INPUT, "%s: damaged; it is made again", path);
  if (!status) memcpy(report, bytes, size);
  vt_free(context, bytes);
  return status;
}

typedef struct paths {
  char *tree, *values, *report;
} paths;

static bool name_paths(vt_context *context, const char *folder, paths *p) {
  *p = (paths){vt_join(context, folder, "raw.vtree"), vt_join(context, folder, "cells"), vt_join(context, folder, "report")};
  return p->tree && p->values && p->report;
}

static void free_paths(vt_context *context, paths *p) {
  vt_free(context, p->tree);
  vt_free(context, p->values);
  vt_free(context, p->report);
}

vt_status vt_take_kept_tree(vt_session *session, const char *entry, vt_tree *out, vt_reconstruct_report *report, bool *taken) {
  vt_context *context = session->context;
  paths p = {0};
  *taken = false;
  if (!entry || !vt_use_entry(entry)) return VT_OK;
  vt_status status = name_paths(context, entry, &p) ? vt_read_tree(context, p.tree, out, NULL) : VT_OUT_OF_MEMORY;
  if (!status) status = read_values(context, out, p.values);
  if (!status) status = read_report(context, p.report, report);
  free_paths(context, &p);
  *taken = !status;
  if (!status) return VT_OK;
  vt_free_tree(context, out);
  *report = (vt_reconstruct_report){0};
  if (status != VT_BAD_INPUT) return status;
  vt_log(context, VT_LOG_NORMAL, "%s: a damaged tree is made again", entry);
  vt_clear_error(context);
  vt_remove_folder(context, entry);
  return VT_OK;
}

void vt_keep_raw_tree(vt_session *session, const char *entry, const vt_tree *tree, const vt_reconstruct_report *report) {
  vt_context *context = session->context;
  char *made = NULL;
  paths p = {0};
  if (!entry || vt_texture_bytes(tree) > vt_bytes_of(&session->arguments, "cache-size", VT_CACHE_BYTES) / 4) return;
  vt_tree named = *tree; // a file has metadata
  if (!named.metadata) named.metadata = (char *)"{}";
  vt_status status = vt_make_folder(context, session->cache);
  if (!status) status = vt_make_folder_beside(context, entry, &made);
  if (!status && !name_paths(context, made, &p)) status = VT_OUT_OF_MEMORY;
  if (!status) status = vt_write_tree(context, &named, p.tree, NULL);
  if (!status) status = write_values(context, tree, p.values);
  if (!status) status = vt_write_file(context, p.report, report, sizeof *report);
  if (!status) {
    vt_keep_entry(context, made, entry);
  } else {
    if (made) vt_remove_folder(context, made);
    vt_log(context, VT_LOG_NORMAL, "%s; the raw tree is not kept", vt_last_error(context));
    vt_clear_error(context);
  }
  free_paths(context, &p);
  vt_free(context, made);
}
