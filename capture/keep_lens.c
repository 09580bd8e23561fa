// keep_lens.c - lenses as they were adjusted, taken from the cache, or adjusted and kept there
// SPDX-License-Identifier: BSD-3-Clause
//
// Seconds for sixty photographs, and minutes for a thousand, of every run whose mattes and tree come from the cache. Key: lenses, poses
// and landmarks as the calibration says them, and the program. Kept are the bits that were found, since the mattes' key is made of them.

#include "capture/keep_lens.h"
#include "base/cache.h"
#include "base/file.h"
#include "base/folders.h"
#include "base/hash.h"

#include <string.h>

static const char magic[8] = "vtlens1";
enum { NUMBERS = 5 + 9 + 9 + 3 }; // of a photograph: focal lengths, centre, model; coefficients; rotation; translation

typedef struct head {
  char magic[8];
  uint64_t photo_count, landmark_count, kept, sight_count, hash; // hash: of what follows
  double before, after, focal_share, corner_pixels;
} head; // then NUMBERS of each photograph, and 3 of each landmark, as double

static void photo_numbers(const vt_photo *p, double n[NUMBERS]) {
  const vt_lens *l = &p->lens;
  double lens[5] = {l->fx, l->fy, l->cx, l->cy, l->model}, shift[3] = {p->translation.x, p->translation.y, p->translation.z};
  memcpy(n, lens, sizeof lens), memcpy(n + 5, l->k, sizeof l->k);
  memcpy(n + 14, p->rotation.m, sizeof p->rotation.m), memcpy(n + 23, shift, sizeof shift);
}

static uint64_t make_key(const vt_photos *photos) {
  const vt_landmarks *l = &photos->landmarks;
  uint64_t hash = vt_hash(magic, sizeof magic, vt_program_hash());
  for (int i = 0; i < photos->count; i++) {
    double numbers[NUMBERS + 2];
    photo_numbers(&photos->items[i], numbers);
    numbers[NUMBERS] = photos->items[i].lens.width, numbers[NUMBERS + 1] = photos->items[i].lens.height;
    hash = vt_hash(numbers, sizeof numbers, hash);
  }
  for (size_t k = 0; k < l->count; k++) {
    double numbers[5] = {l->items[k].position.x, l->items[k].position.y, l->items[k].position.z, (double)l->items[k].error, l->items[k].count};
    hash = vt_hash(numbers, sizeof numbers, hash);
  }
  hash = vt_hash(l->seen_by, l->seen_count * sizeof *l->seen_by, hash);
  return vt_hash(l->pixels, l->seen_count * sizeof *l->pixels, hash);
}

static size_t body_size(const vt_photos *photos) {
  return ((size_t)photos->count * NUMBERS + 3 * photos->landmarks.count) * sizeof(double);
}

static vt_status write_lenses(vt_context *context, const vt_photos *photos, const vt_lens_report *report, const char *folder) {
  size_t size = body_size(photos);
  uint8_t *bytes = vt_alloc(context, sizeof(head) + size, 1);
  char *path = vt_join(context, folder, "lenses");
  vt_status status = bytes && path ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) {
    double *n = (double *)(void *)(bytes + sizeof(head)); // vt_alloc aligns to 64, and a head is a multiple of 8
    for (int i = 0; i < photos->count; i++, n += NUMBERS) photo_numbers(&photos->items[i], n);
    for (size_t k = 0; k < photos->landmarks.count; k++, n += 3) memcpy(n, &photos->landmarks.items[k].position, 3 * sizeof *n);
    head h = {{0}, (uint64_t)photos->count, photos->landmarks.count, report->kept, report->sight_count, vt_hash(bytes + sizeof h, size, 0),
              report->before, report->after, report->focal_share, report->corner_pixels};
    memcpy(h.magic, magic, sizeof magic);
    memcpy(bytes, &h, sizeof h);
    status = vt_write_file(context, path, bytes, sizeof h + size);
  }
  vt_free(context, path);
  vt_free(context, bytes);
  return status;
}

static void fill_photos(const double *n, vt_photos *photos) {
  for (int i = 0; i < photos->count; i++, n += NUMBERS) {
    vt_photo *p = &photos->items[i];
    p->lens.fx = n[0], p->lens.fy = n[1], p->lens.cx = n[2], p->lens.cy = n[3], p->lens.model = (vt_lens_model)n[4];
    memcpy(p->lens.k, n + 5, sizeof p->lens.k), memcpy(p->rotation.m, n + 14, sizeof p->rotation.m);
    p->translation = vt_v3(n[23], n[24], n[25]);
  }
  for (size_t k = 0; k < photos->landmarks.count; k++, n += 3) photos->landmarks.items[k].position = vt_v3(n[0], n[1], n[2]);
}

// False where it is damaged: it is made again then.
static bool read_lenses(vt_context *context, const char *folder, vt_photos *photos, vt_lens_report *report) {
  uint8_t *bytes = NULL;
  size_t size = 0, wanted = sizeof(head) + body_size(photos);
  char *path = vt_join(context, folder, "lenses");
  head h = {0};
  vt_status status = path ? vt_read_file(context, path, &bytes, &size) : VT_OUT_OF_MEMORY;
  if (!status && size == wanted) memcpy(&h, bytes, sizeof h);
  bool sound = !status && size == wanted && !memcmp(h.magic, magic, sizeof magic) && h.photo_count == (uint64_t)photos->count &&
               h.landmark_count == photos->landmarks.count && h.hash == vt_hash(bytes + sizeof h, size - sizeof h, 0);
  if (status) vt_clear_error(context);
  if (sound) {
    *report = (vt_lens_report){true, h.kept != 0, "as it was found before", h.sight_count, h.before, h.after, h.focal_share, h.corner_pixels};
    if (h.kept) fill_photos((const double *)(void *)(bytes + sizeof h), photos);
  }
  vt_free(context, path);
  vt_free(context, bytes);
  return sound;
}

// A cache that cannot be written to costs the time of doing it again, never the run.
static void keep_lenses(vt_context *context, const vt_photos *photos, const vt_lens_report *report, const char *cache, const char *entry) {
  char *made = NULL;
  vt_status status = vt_make_folder(context, cache);
  if (!status) status = vt_make_folder_beside(context, entry, &made);
  if (!status) status = write_lenses(context, photos, report, made);
  if (!status) vt_keep_entry(context, made, entry);
  else if (made) vt_remove_folder(context, made);
  if (status && status != VT_CANCELLED) vt_clear_error(context);
  vt_free(context, made);
}

vt_status vt_adjust_lenses_or_take(vt_context *context, const char *cache, bool keep, vt_photos *photos, vt_lens_report *report) {
  if (!cache || !vt_program_hash() || !photos->landmarks.count || !photos->landmarks.pixels) return vt_adjust_lenses(context, photos, report);
  char *entry = vt_cache_entry(context, cache, "lens", make_key(photos));
  if (!entry) return VT_OUT_OF_MEMORY;
  vt_status status = VT_OK;
  bool there = vt_use_entry(entry);
  if (!there || !read_lenses(context, entry, photos, report)) {
    if (there && keep) vt_remove_folder(context, entry);
    status = vt_adjust_lenses(context, photos, report);
    if (!status && keep && report->sight_count) keep_lenses(context, photos, report, cache, entry);
  }
  vt_free(context, entry);
  return status;
}
