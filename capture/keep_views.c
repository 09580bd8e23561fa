// keep_views.c - developed views taken from the cache, or made and kept there
// SPDX-License-Identifier: BSD-3-Clause
//
// Key: the bytes of each photograph and of its mask, its lens, pose and role, the options, and the program that makes
// the mattes; for mattes of clutter also landmarks and strokes. What comes out of the cache must be the bits that went
// in, or a second run would give another tree: so cameras are kept as they stand in memory, not as text of another
// convention, and pictures as plain pixels (packed by zstd where there is one). The folder is for this machine and this
// program alone; `voltree capture` writes one for others. Views that need only be read (an alpha channel, no
// distortion) are not kept: that would be a second copy.
#include "capture/keep_views.h"
#include "base/byte_codec.h"
#include "base/cache.h"
#include "base/file.h"
#include "base/folders.h"
#include "base/hash.h"
#include "capture/develop.h"
#include "capture/masks.h"

#include <stdio.h>
#include <string.h>

// A view is its head and its pixels, behind them the map of what is ignored, if there is one. A member that is added to
// vt_view must be added to the head, too.
typedef struct head {
  char magic[8];
  uint64_t pixels_hash, packed_size; // packed_size 0: the pixels stand as they are
  int32_t width, height, channels, role, has_ignored;
  vt_camera camera;
} head;
_Static_assert(sizeof(void *) != 8 || sizeof(vt_view) == 16 + sizeof(vt_camera) + 2 * sizeof(vt_image),
               "keep the new member");
static const char magic[8] = "vtview2";

// ---- the key

typedef struct hashing {
  vt_context *context;
  const vt_photos *photos;
  uint64_t *hashes;
  vt_status *status;
} hashing;

static vt_status hash_file(vt_context *context, const char *path, uint64_t *hash) {
  uint8_t *bytes = NULL;
  size_t size = 0;
  vt_status status = vt_read_file(context, path, &bytes, &size);
  if (!status) *hash = vt_hash(bytes, size, *hash);
  vt_free(context, bytes);
  return status;
}

static vt_status hash_photo(hashing *h, size_t i) {
  const vt_photo *p = &h->photos->items[i];
  const vt_lens *l = &p->lens;
  uint64_t hash = vt_hash(p->name, strlen(p->name) + 1, (uint64_t)p->role);
  enum { TERMS = sizeof l->k / sizeof *l->k };
  double numbers[14 + TERMS + 12] = {l->model,        l->width,          l->height,  l->fx,    l->fy,     l->cx,
                                     l->cy,           p->orientation,    p->upright, p->width, p->height, p->has_alpha,
                                     p->mask != NULL, p->ignored != NULL};
  for (int k = 0; k < TERMS; k++) numbers[14 + k] = l->k[k];
  for (int k = 0; k < 9; k++) numbers[14 + TERMS + k] = p->rotation.m[k];
  numbers[23 + TERMS] = p->translation.x, numbers[24 + TERMS] = p->translation.y,
               numbers[25 + TERMS] = p->translation.z;
  hash = vt_hash(numbers, sizeof numbers, hash);
  vt_status status = hash_file(h->context, p->path, &hash);
  if (!status && p->mask) status = hash_file(h->context, p->mask, &hash);
  if (!status && p->ignored) status = hash_file(h->context, p->ignored, &hash);
  h->hashes[i] = hash;
  return status;
}

static void hash_block(void *user, size_t begin, size_t end, int worker) {
  hashing *h = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) h->status[i] = hash_photo(h, i);
}

// Every option that a pixel may depend on. The paths and the program of desc are no part of it: what they lead to is.
static uint64_t hash_options(const vt_capture_desc *desc, const vt_capture_report *report) {
  int64_t options[] = {(int64_t)report->matte, desc->invert_masks, desc->keep_strays, desc->max_image_size, (int64_t)sizeof(head)};
  return vt_hash(options, sizeof options, vt_program_hash());
}

// Mattes of clutter come of all photographs together, of where the landmarks are, and of what the user drew.
static vt_status hash_clutter(vt_context *context, const vt_capture_desc *desc, const vt_landmarks *landmarks,
                              uint64_t *hash) {
  vt_names names = {0};
  for (size_t k = 0; k < landmarks->count; k++) {
    const vt_landmark *l = &landmarks->items[k];
    double numbers[4] = {l->position.x, l->position.y, l->position.z, l->count};
    *hash = vt_hash(numbers, sizeof numbers, *hash);
  }
  if (landmarks->seen_count)
    *hash = vt_hash(landmarks->seen_by, landmarks->seen_count * sizeof *landmarks->seen_by, *hash);
  if (!desc->scribbles || !vt_is_folder(desc->scribbles)) return VT_OK; // said when it is read
  vt_status status = vt_list_folder(context, desc->scribbles, true, &names);
  for (int i = 0; i < names.count && !status; i++) {
    char *path = vt_join(context, desc->scribbles, names.items[i]);
    *hash = vt_hash(names.items[i], strlen(names.items[i]) + 1, *hash);
    status = path ? hash_file(context, path, hash) : VT_OUT_OF_MEMORY;
    vt_free(context, path);
  }
  vt_free_names(context, &names);
  return status;
}

static vt_status make_key(vt_context *context, const vt_capture_desc *desc, const vt_photos *photos,
                          const vt_capture_report *report, uint64_t *key) {
  size_t count = (size_t)photos->count;
  hashing h = {context, photos, VT_NEW(context, uint64_t, count), VT_NEW(context, vt_status, count)};
  vt_status status = h.hashes && h.status ? vt_parallel(context, count, 1, hash_block, &h) : VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && !status; i++) {
    if (!h.status[i]) continue;
    vt_clear_error(context);
    status = hash_photo(&h, i);
  }
  if (!status) *key = vt_hash(h.hashes, count * sizeof *h.hashes, hash_options(desc, report));
  if (!status && report->matte == VT_MATTE_CLUTTER) status = hash_clutter(context, desc, &photos->landmarks, key);
  vt_free(context, h.hashes);
  vt_free(context, h.status);
  return status;
}

// ---- one view

static char *view_path(vt_context *context, const char *folder, int i) {
  char name[24];
  snprintf(name, sizeof name, "%05d.view", i);
  return vt_join(context, folder, name);
}

static size_t pixel_bytes(const head *h) { // of the picture and of the map
  return (size_t)h->width * (size_t)h->height * (size_t)(h->channels + h->has_ignored);
}

// Picture and map one behind the other. Free with vt_free.
static uint8_t *join_pixels(vt_context *context, const vt_view *view, const head *h) {
  size_t all = pixel_bytes(h), map = h->has_ignored ? (size_t)h->width * (size_t)h->height : 0;
  uint8_t *out = vt_alloc(context, all, 1);
  if (!out) return NULL;
  memcpy(out, view->picture.pixels, all - map);
  if (map) memcpy(out + all - map, view->ignored.pixels, map);
  return out;
}

static vt_status write_view(vt_context *context, const vt_view *view, const char *path) {
  head h;
  memset(&h, 0, sizeof h);
  h.width = view->picture.width, h.height = view->picture.height, h.channels = view->picture.channels;
  h.has_ignored = view->ignored.pixels != NULL;
  uint8_t *pixels = join_pixels(context, view, &h), *packed = NULL;
  size_t size = pixel_bytes(&h), packed_size = 0;
  if (!pixels) return VT_OUT_OF_MEMORY;
  memcpy(h.magic, magic, sizeof magic);
  h.role = (int32_t)view->role;
  h.camera = view->camera;
  h.pixels_hash = vt_hash(pixels, size, 0);
  vt_status status = VT_OK;
  if (vt_can_pack_bytes()) status = vt_pack_bytes(context, pixels, size, 1, &packed, &packed_size);
  h.packed_size = packed_size;
  size_t body = packed ? packed_size : size;
  uint8_t *bytes = status ? NULL : vt_alloc(context, sizeof h + body, 1);
  if (!status && !bytes) status = VT_OUT_OF_MEMORY;
  if (!status) {
    memcpy(bytes, &h, sizeof h);
    memcpy(bytes + sizeof h, packed ? packed : pixels, body);
    status = vt_write_file(context, path, bytes, sizeof h + body);
  }
  vt_free(context, pixels);
  vt_free(context, packed);
  vt_free(context, bytes);
  return status;
}

static vt_status refuse(vt_context *context, const char *path) {
  return vt_fail(context, VT_BAD_INPUT, "%s: damaged; it is made again", path);
}

static bool is_sound(const head *h, size_t body) {
  return !memcmp(h->magic, magic, sizeof magic) && h->width > 0 && h->height > 0 && h->width <= 65535 &&
         h->height <= 65535 && (h->channels == 3 || h->channels == 4) && (h->has_ignored == 0 || h->has_ignored == 1) &&
         (h->role == VT_TRAIN || h->role == VT_TEST) && body == (h->packed_size ? h->packed_size : pixel_bytes(h));
}

static vt_status fill_view(vt_context *context, const head *h, const uint8_t *pixels, vt_view *out) {
  size_t all = pixel_bytes(h), map = h->has_ignored ? (size_t)h->width * (size_t)h->height : 0;
  out->role = (vt_role)h->role;
  out->camera = h->camera;
  vt_status status = vt_make_image(context, h->width, h->height, h->channels, &out->picture);
  if (!status && map) status = vt_make_image(context, h->width, h->height, 1, &out->ignored);
  if (status) return status;
  memcpy(out->picture.pixels, pixels, all - map);
  if (map) memcpy(out->ignored.pixels, pixels + all - map, map);
  return VT_OK;
}

static vt_status read_view(vt_context *context, const char *path, vt_view *out) {
  uint8_t *bytes = NULL, *pixels = NULL;
  size_t size = 0;
  head h;
  vt_status status = vt_read_file(context, path, &bytes, &size);
  if (status) return status;
  if (size >= sizeof h) memcpy(&h, bytes, sizeof h);
  if (size < sizeof h || !is_sound(&h, size - sizeof h)) {
    status = refuse(context, path);
    goto done;
  }
  pixels = vt_alloc(context, pixel_bytes(&h), 1);
  if (!pixels)
    status = VT_OUT_OF_MEMORY;
  else if (h.packed_size)
    status = vt_unpack_bytes(context, bytes + sizeof h, size - sizeof h, pixels, pixel_bytes(&h), path);
  else
    memcpy(pixels, bytes + sizeof h, pixel_bytes(&h));
  if (!status && vt_hash(pixels, pixel_bytes(&h), 0) != h.pixels_hash) status = refuse(context, path);
  if (!status) status = fill_view(context, &h, pixels, out);
  if (!status) status = vt_check_camera(context, &out->camera, path);
done:
  vt_free(context, bytes);
  vt_free(context, pixels);
  return status;
}

// ---- all views

typedef struct work {
  vt_context *context;
  const char *folder;
  vt_views *views;
  bool write;
  vt_status *status;
} work;

static void work_block(void *user, size_t begin, size_t end, int worker) {
  work *w = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    char *path = view_path(w->context, w->folder, (int)i);
    w->status[i] = !path      ? VT_OUT_OF_MEMORY
                   : w->write ? write_view(w->context, &w->views->items[i], path)
                              : read_view(w->context, path, &w->views->items[i]);
    vt_free(w->context, path);
  }
}

static vt_status do_all(vt_context *context, vt_views *views, const char *folder, bool write) {
  work w = {context, folder, views, write, VT_NEW(context, vt_status, (size_t)views->count)};
  vt_status status = w.status ? vt_parallel(context, (size_t)views->count, 1, work_block, &w) : VT_OUT_OF_MEMORY;
  for (int i = 0; i < views->count && !status; i++) status = w.status[i];
  vt_free(context, w.status);
  return status;
}

// *out stays empty if the entry is damaged.
static vt_status take_views(vt_context *context, const char *entry, vt_photos *photos, vt_views *out) {
  out->items = VT_NEW(context, vt_view, (size_t)photos->count);
  if (!out->items) return VT_OUT_OF_MEMORY;
  out->count = photos->count;
  vt_status status = do_all(context, out, entry, false);
  for (int i = 0; i < photos->count && !status; i++) {
    out->items[i].name = photos->items[i].name;
    photos->items[i].name = NULL;
  }
  if (!status) return VT_OK;
  vt_free_views(context, out);
  if (status != VT_BAD_INPUT) return status;
  vt_log(context, VT_LOG_NORMAL, "%s: damaged mattes are made again", entry);
  vt_clear_error(context);
  vt_remove_folder(context, entry);
  return VT_OK;
}

// A cache that cannot be written to costs a sentence and the time of making it again, never the run.
static void keep_views(vt_context *context, vt_views *views, const char *cache, const char *entry) {
  char *made = NULL;
  vt_status status = vt_make_folder(context, cache);
  if (!status) status = vt_make_folder_beside(context, entry, &made);
  if (!status) status = do_all(context, views, made, true);
  if (!status) {
    vt_keep_entry(context, made, entry);
  } else {
    if (made) vt_remove_folder(context, made);
    if (status != VT_CANCELLED) {
      vt_log(context, VT_LOG_NORMAL, "%s; the mattes are not kept", vt_last_error(context));
      vt_clear_error(context);
    }
  }
  vt_free(context, made);
}

static bool need_only_be_read(const vt_photos *photos, const vt_capture_report *report) {
  if (report->matte != VT_MATTE_ALPHA && report->matte != VT_MATTE_NONE) return false;
  for (int i = 0; i < photos->count; i++)
    if (!vt_lens_is_pinhole(&photos->items[i].lens) || photos->items[i].ignored) return false;
  return true;
}

vt_status vt_develop_or_take(vt_context *context, const vt_capture_desc *desc, vt_photos *photos,
                             vt_capture_report *report, vt_views *out) {
  bool useless = !desc->cache || !vt_program_hash() || vt_wants_probes(context) || need_only_be_read(photos, report);
  if (useless) return vt_develop_photos(context, desc, photos, report, out);
  uint64_t key;
  vt_status status = make_key(context, desc, photos, report, &key);
  char *entry = status ? NULL : vt_cache_entry(context, desc->cache, "views", key);
  if (!status && !entry) status = VT_OUT_OF_MEMORY;
  if (!status && vt_use_entry(entry)) status = take_views(context, entry, photos, out);
  report->views_from_cache = !status && out->count > 0;
  if (!status && !report->views_from_cache) {
    status = vt_develop_photos(context, desc, photos, report, out);
    if (!status) keep_views(context, out, desc->cache, entry);
    if (!status && vt_cancelled(context)) status = vt_fail(context, VT_CANCELLED, "mattes: interrupted");
    if (status) vt_free_views(context, out);
  }
  vt_free(context, entry);
  return status;
}

vt_status vt_find_developed(vt_context *context, const vt_capture_desc *desc, const vt_photos *photos,
                            const vt_capture_report *report, bool *kept, bool *cheap) {
  uint64_t key;
  *kept = false;
  *cheap = need_only_be_read(photos, report);
  if (*cheap || !desc->cache || !vt_program_hash() || vt_wants_probes(context)) return VT_OK;
  vt_status status = make_key(context, desc, photos, report, &key);
  char *entry = status ? NULL : vt_cache_entry(context, desc->cache, "views", key);
  if (!status && !entry) status = VT_OUT_OF_MEMORY;
  *kept = !status && vt_is_folder(entry);
  vt_free(context, entry);
  return status;
}
