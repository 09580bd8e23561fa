// develop.c - from calibrated photographs to views: reading, mattes, undistortion, reduction
// SPDX-License-Identifier: BSD-3-Clause
//
// Order: the matte is made on the photograph as it was taken, where a backdrop has not been resampled and a user's mask
// fits; the RGBA picture is undistorted as a whole, so that matte and colour stay together; then it is reduced by a
// whole factor f, which divides fx, fy, cx, cy by exactly f (the last row or column may cover less than f pixels of the
// source, so that width'/width is not quite 1/f and must not be used).
//
// What is not to be looked at goes the same way beside the picture. It is reduced by the greatest: a pixel with
// something ignored in it is ignored.
//
// Photographs go through in batches, one by one on all workers: only as many as there are workers are held at full
// size.

#include "capture/develop.h"
#include "base/file.h"
#include "base/image_file.h"
#include "capture/clutter.h"
#include "capture/masks.h"
#include "capture/matte.h"
#include "capture/photo_tracks.h"
#include "capture/situation.h"
#include "capture/strays.h"

#include <string.h>

#define MAX_BATCH 256    // 4 for each of at most 64 workers
#define WORKING_BYTES 32 // for each pixel of a photograph while it is developed

// ---- which mattes

static bool has_transparency(const vt_image *picture) {
  if (picture->channels != 4) return false;
  size_t count = (size_t)picture->width * (size_t)picture->height;
  for (size_t i = 0; i < count; i++)
    if (picture->pixels[4 * i + 3] != 255) return true;
  return false;
}

// True in *found at the first picture that has an alpha channel with something in it.
static vt_status find_alpha(vt_context *context, const vt_photos *photos, bool *found) {
  *found = false;
  for (int i = 0; i < photos->count && !*found; i++) {
    if (!photos->items[i].has_alpha) continue;
    vt_image picture = {0};
    vt_status status = vt_read_image(context, photos->items[i].path, &picture);
    if (!status) *found = has_transparency(&picture);
    vt_free_image(context, &picture);
    if (status) return status;
  }
  return VT_OK;
}

// Takes photographs without alpha, or without a mask, out of the list.
static vt_status leave_out_unmatted(vt_context *context, vt_photos *photos, vt_matte_mode mode,
                                    vt_capture_report *report) {
  int kept = 0, *place = VT_NEW(context, int, (size_t)photos->count + 1);
  vt_status status = place ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < photos->count && place; i++) {
    vt_photo *photo = &photos->items[i];
    bool usable = mode == VT_MATTE_ALPHA ? photo->has_alpha : mode == VT_MATTE_MASKS ? photo->mask != NULL : true;
    place[i] = usable ? kept : -1;
    if (usable) {
      photos->items[kept++] = *photo;
      continue;
    }
    if (!status)
      status = vt_leave_out(context, report, photo->name,
                            mode == VT_MATTE_ALPHA ? "no alpha channel, which the others have"
                                                   : "no mask, which the others have");
    vt_free_photo(context, photo);
  }
  if (!place) return status;
  if (kept < photos->count) vt_renumber_landmarks(&photos->landmarks, place);
  photos->count = kept;
  vt_free(context, place);
  return status;
}

// By what most photographs show. Clutter is told from the tree by where it stands, which not all captures say.
static vt_status recognise(vt_context *context, const vt_photos *photos, vt_matte_mode *mode,
                           vt_capture_report *report) {
  vt_situation situation = VT_SITUATION_CLUTTER;
  vt_status status = vt_recognise_situation(context, photos, &situation, report->matte_evidence);
  if (status) return status;
  vt_log(context, VT_LOG_NORMAL, "mattes: %s", report->matte_evidence);
  *mode = situation == VT_SITUATION_SKY       ? VT_MATTE_SKY
          : situation == VT_SITUATION_CLUTTER ? VT_MATTE_CLUTTER
                                              : VT_MATTE_BACKDROP;
  if (*mode == VT_MATTE_CLUTTER)
    vt_log(context, VT_LOG_NORMAL,
           "mattes: look at them; where too much or too little is taken for the tree, draw a few strokes on three "
           "photographs "
           "(--scribble)");
  return VT_OK;
}

vt_status vt_choose_mattes(vt_context *context, const vt_capture_desc *desc, const char *root, vt_photos *photos,
                           vt_capture_report *report) {
  static const char *const names[] = {"auto",    "alpha channel",           "masks", "backdrop", "sky",
                                      "clutter", "none: everything is tree"};
  vt_matte_mode mode = desc->matte;
  bool by_user = desc->masks != NULL;
  vt_status status = VT_OK;
  if (mode == VT_MATTE_AUTO && desc->scribbles) mode = VT_MATTE_CLUTTER; // who draws wants it to be used
  if (mode == VT_MATTE_AUTO && !by_user) {
    bool alpha = false;
    status = find_alpha(context, photos, &alpha);
    if (alpha) mode = VT_MATTE_ALPHA;
  }
  if (!status && (mode == VT_MATTE_AUTO || mode == VT_MATTE_MASKS)) {
    int found = 0;
    status = vt_find_masks(context, desc->masks, root, photos, &found);
    if (!status && !found && (by_user || mode == VT_MATTE_MASKS))
      return vt_fail(context, VT_BAD_INPUT,
                     "%s: no mask fits a photograph; name them as the photographs, as in masks/%s.png, white where the "
                     "tree is",
                     by_user ? desc->masks : root, photos->count ? vt_base_name(photos->items[0].name) : "a.jpg");
    mode = found ? VT_MATTE_MASKS : mode;
  }
  if (!status && mode == VT_MATTE_AUTO) status = recognise(context, photos, &mode, report);
  if (status) return status;
  report->matte = mode;
  vt_log(context, VT_LOG_NORMAL, "mattes: %s", names[mode]);
  status = leave_out_unmatted(context, photos, mode, report);
  if (!status && !photos->count)
    status = vt_fail(context, VT_BAD_INPUT,
                     "%s: no photograph has an alpha channel; give --matte masks, backdrop, sky or none", root);
  return status;
}

// ---- one photograph

typedef struct work {
  vt_context *context;
  const vt_capture_desc *desc;
  vt_matte_mode mode;
  vt_photo *photos; // of this batch
  vt_view *views;
  const vt_clutter *clutter;                          // of all photographs
  int first;                                          // place of this batch among them
  double border_share[MAX_BATCH], seconds[MAX_BATCH]; // seconds: of the matte
  vt_status status[MAX_BATCH];
} work;

static vt_status drop_alpha(vt_context *context, vt_image *picture) {
  if (picture->channels == 3) return VT_OK;
  vt_image out = {0};
  vt_status status = vt_make_image(context, picture->width, picture->height, 3, &out);
  if (status) return status;
  size_t count = (size_t)out.width * (size_t)out.height;
  for (size_t i = 0; i < count; i++) memcpy(out.pixels + 3 * i, picture->pixels + 4 * i, 3);
  vt_free_image(context, picture);
  *picture = out;
  return VT_OK;
}

static vt_status read_photo(work *w, int i) {
  vt_photo *photo = &w->photos[i];
  vt_image *picture = &w->views[i].picture;
  vt_status status = vt_read_photo(w->context, photo, picture);
  if (status) return status;
  switch (w->mode) {
  case VT_MATTE_MASKS:
    return vt_apply_mask(w->context, photo, w->desc->invert_masks, picture, &w->border_share[i]);
  case VT_MATTE_ALPHA:
    return picture->channels == 4 ? VT_OK : vt_make_opaque(w->context, picture);
  case VT_MATTE_NONE:
    return vt_make_opaque(w->context, picture);
  default:
    return drop_alpha(w->context, picture);
  }
}

static vt_status matte_photo(work *w, int i) {
  vt_image *picture = &w->views[i].picture, matted = {0};
  if (w->mode == VT_MATTE_MASKS) return vt_estimate_foreground(w->context, picture);
  if (w->mode != VT_MATTE_BACKDROP && w->mode != VT_MATTE_SKY && w->mode != VT_MATTE_CLUTTER) return VT_OK;
  const char *name = w->photos[i].name;
  bool clutter = w->mode == VT_MATTE_CLUTTER; // told from the photograph as it is stored
  int upright = clutter || w->photos[i].orientation > 1 ? 1 : w->photos[i].upright; // a sky comes from above
  vt_status status = vt_turn_upright(w->context, upright, false, picture);
  if (!status)
    status = clutter                   ? vt_matte_clutter(w->context, w->clutter, w->first + i, picture, &matted)
             : w->mode == VT_MATTE_SKY ? vt_matte_sky(w->context, picture, name, &matted)
                                       : vt_matte_backdrop(w->context, picture, name, &matted);
  if (!status) status = vt_turn_upright(w->context, upright, true, &matted);
  if (status) {
    vt_free_image(w->context, &matted);
    return status;
  }
  vt_free_image(w->context, picture);
  *picture = matted;
  return VT_OK;
}

// The factor that a photograph is reduced by.
static int factor_of(int width, int height, int bound) {
  int longer = width > height ? width : height;
  return bound > 0 && longer > bound ? (int)(((long)longer + bound - 1) / bound) : 1;
}

// The view's map of what is ignored, and alpha 0 there.
static vt_status ignore_pixels(work *w, int i, int factor) {
  vt_context *context = w->context;
  const vt_photo *photo = &w->photos[i];
  vt_view *view = &w->views[i];
  vt_image whole = {0}, straight = {0};
  vt_camera unused = view->camera;
  vt_status status = vt_read_ignored(context, photo, photo->width, photo->height, &whole);
  if (!status && !vt_lens_is_pinhole(&photo->lens)) {
    status = vt_undistort_image(context, &photo->lens, &whole, &unused, &straight);
    vt_free_image(context, &whole);
    whole = straight;
  }
  for (size_t k = 0; !status && k < (size_t)whole.width * (size_t)whole.height; k++)
    whole.pixels[k] = whole.pixels[k] > 0 ? 255 : 0;
  if (!status) status = vt_pool_image(context, &whole, factor, &view->ignored);
  vt_free_image(context, &whole);
  for (size_t k = 0; !status && k < (size_t)view->ignored.width * (size_t)view->ignored.height; k++)
    if (view->ignored.pixels[k]) view->picture.pixels[4 * k + 3] = 0;
  return status;
}

static vt_status finish_photo(work *w, int i) {
  vt_photo *photo = &w->photos[i];
  vt_view *view = &w->views[i];
  vt_image other = {0};
  vt_status status = VT_OK;
  view->camera = vt_photo_camera(photo);
  view->role = photo->role;
  if (!vt_lens_is_pinhole(&photo->lens)) {
    status = vt_undistort_image(w->context, &photo->lens, &view->picture, &view->camera, &other);
    if (!status) {
      vt_free_image(w->context, &view->picture);
      view->picture = other;
      other = (vt_image){0};
    }
  }
  int factor = factor_of(view->picture.width, view->picture.height, w->desc->max_image_size);
  if (!status && factor > 1) {
    status = vt_reduce_image(w->context, &view->picture, factor, &other);
    if (!status) {
      vt_free_image(w->context, &view->picture);
      view->picture = other;
      other = (vt_image){0};
      vt_camera *camera = &view->camera;
      camera->width = view->picture.width;
      camera->height = view->picture.height;
      camera->fx /= factor, camera->fy /= factor, camera->cx /= factor, camera->cy /= factor;
    }
  }
  vt_free_image(w->context, &other);
  if (!status && photo->ignored) status = ignore_pixels(w, i, factor);
  return status ? status : vt_check_camera(w->context, &view->camera, photo->path);
}

static vt_status develop_photo(work *w, int i) {
  vt_status status = read_photo(w, i);
  double start = vt_seconds();
  if (!status) status = matte_photo(w, i);
  w->seconds[i] = vt_seconds() - start;
  return status ? status : finish_photo(w, i);
}

// ---- all

static void develop_block(void *user, size_t begin, size_t end, int worker) {
  work *w = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) w->status[i] = develop_photo(w, (int)i);
}

// What failed beside others is tried again alone: of several bad files the first is then the one in the sentence,
// whatever the threads did, and memory that only all together lacked is there.
static vt_status develop_again(work *w, int count) {
  vt_status status = VT_OK;
  for (int i = 0; i < count && !status; i++) {
    if (!w->status[i]) continue;
    vt_clear_error(w->context);
    vt_free_image(w->context, &w->views[i].picture);
    vt_free_image(w->context, &w->views[i].ignored);
    status = develop_photo(w, i);
  }
  return status;
}

// How many photographs go together: few where as many as there are workers, each read, matted and undistorted, would
// take a third of --max-memory; one where probes are wanted, which come in order then.
static int choose_batch(vt_context *context, const vt_photos *photos) {
  uint64_t pixels = 1, bound = vt_max_memory(context);
  int workers = vt_thread_count(context), batch = 4 * workers < MAX_BATCH ? 4 * workers : MAX_BATCH;
  for (int i = 0; i < photos->count; i++) {
    uint64_t own = (uint64_t)photos->items[i].width * (uint64_t)photos->items[i].height;
    if (own > pixels) pixels = own;
  }
  uint64_t fitting = bound ? bound / 3 / (WORKING_BYTES * pixels) : (uint64_t)workers;
  if (fitting < (uint64_t)workers) batch = fitting ? (int)fitting : 1;
  return vt_wants_probes(context) ? 1 : batch;
}

// Bytes that the views take, and the largest photograph while it is developed, at a bound of their longer side.
static uint64_t bytes_needed(const vt_photos *photos, int bound) {
  uint64_t all = 0, largest = 0;
  for (int i = 0; i < photos->count; i++) {
    const vt_photo *p = &photos->items[i];
    uint64_t pixels = (uint64_t)p->width * (uint64_t)p->height, f = (uint64_t)factor_of(p->width, p->height, bound);
    all += (((uint64_t)p->width + f - 1) / f) * (((uint64_t)p->height + f - 1) / f) * (p->ignored ? 5 : 4);
    largest = pixels > largest ? pixels : largest;
  }
  return all + WORKING_BYTES * largest;
}

// Said before the work: an error after an hour helps nobody. The cure is a size that fits.
static vt_status check_room(vt_context *context, const vt_capture_desc *desc, const vt_photos *photos) {
  uint64_t bound = vt_max_memory(context), used = vt_bytes_in_use(context);
  uint64_t need = bytes_needed(photos, desc->max_image_size), room = bound > used ? bound - used : 0;
  if (!bound || need <= room) return VT_OK;
  int fits = 0, most = 0;
  for (int i = 0; i < photos->count; i++) {
    const vt_photo *p = &photos->items[i];
    most = p->width > most ? p->width : most, most = p->height > most ? p->height : most;
  }
  for (int f = 2; f < most && !fits; f++)
    if (bytes_needed(photos, (most + f - 1) / f) <= room) fits = (most + f - 1) / f;
  char cure[64] = "";
  if (fits) snprintf(cure, sizeof cure, "--max-image-size %d, or ", fits);
  return vt_fail(
      context, VT_OUT_OF_MEMORY,
      "--max-memory: the views of %d photographs need %.0f MB, and %.0f MB are allowed; give %s--max-memory %.0fM "
      "and more for what comes after",
      photos->count, (double)need / 1e6, (double)room / 1e6, cure, ceil(1.05 * (double)(need + used) / 1e6));
}

// Estimated mattes are compared; given ones are the user's word, and those of clutter are made by comparing.
static vt_status clear_strays(vt_context *context, const vt_landmarks *landmarks, vt_views *views, vt_capture_report *report) {
  vt_strays strays;
  double start = vt_seconds();
  vt_status status = vt_clear_strays(context, landmarks, views, &strays);
  report->seconds_mattes += vt_seconds() - start;
  if (status || !strays.tried) return status;
  if (strays.refused) {
    vt_log(context, VT_LOG_NORMAL,
           "mattes: %.0f %% of what they show stands nowhere in the other photographs; so they, or the cameras, disagree and "
           "nothing is cleared; look at the mattes",
           100 * strays.share);
    return VT_OK;
  }
  report->stray_photographs = strays.photographs, report->stray_share = strays.share;
  if (strays.photographs)
    vt_log(context, VT_LOG_NORMAL,
           "mattes: cleared in %d photographs of what the others do not show (%.1f %% of all; --keep-strays leaves it)",
           strays.photographs, 100 * strays.share);
  return VT_OK;
}

vt_status vt_develop_photos(vt_context *context, const vt_capture_desc *desc, vt_photos *photos,
                            vt_capture_report *report, vt_views *out) {
  int batch = choose_batch(context, photos), inverted = 0;
  int busy = batch < vt_thread_count(context) ? batch : vt_thread_count(context);
  vt_clutter clutter = {0};
  vt_status status = check_room(context, desc, photos);
  if (status) return status;
  out->items = VT_NEW(context, vt_view, (size_t)photos->count);
  if (!out->items) return VT_OUT_OF_MEMORY;
  out->count = photos->count;
  double start = vt_seconds();
  if (report->matte == VT_MATTE_CLUTTER) status = vt_separate_clutter(context, photos, desc->scribbles, &clutter);
  report->seconds_mattes += vt_seconds() - start;
  for (int first = 0; first < photos->count && !status; first += batch) {
    int count = photos->count - first < batch ? photos->count - first : batch;
    work w = {context, desc, report->matte, photos->items + first, out->items + first, &clutter, first, {0}, {0}, {0}};
    status = vt_parallel(context, (size_t)count, 1, develop_block, &w);
    if (!status) status = develop_again(&w, count);
    for (int i = 0; i < count; i++) {
      inverted += w.border_share[i] > 0.5;
      report->seconds_mattes += w.seconds[i] / busy;
    }
    vt_progress(context, "photographs", (double)(first + count) / photos->count);
  }
  if (!status && 2 * inverted > photos->count)
    vt_log(context, VT_LOG_NORMAL,
           "masks: most of the border is tree in %d of %d pictures; if black is the tree, give --invert-masks",
           inverted, photos->count);
  for (int i = 0; i < photos->count && !status; i++) { // only now: a photograph that is tried again still needs it
    out->items[i].name = photos->items[i].name;
    photos->items[i].name = NULL;
  }
  vt_free_clutter(context, &clutter);
  bool estimated = report->matte == VT_MATTE_BACKDROP || report->matte == VT_MATTE_SKY;
  if (!status && estimated && !desc->keep_strays) status = clear_strays(context, &photos->landmarks, out, report);
  if (status) vt_free_views(context, out);
  return status;
}
