// photo_tracks.c - a calibration's points as tracks through pinhole pictures
// SPDX-License-Identifier: BSD-3-Clause
//
// A landmark was seen at a pixel of the photograph as it was taken. The picture that reconstruction gets is straightened and reduced:
// the pixel's ray, by the lens, meets it elsewhere. How surely it was seen is the point's own reprojection error, and never less than
// the mean of all: an error that happens to be small is no measurement of its own.

#include "capture/photo_tracks.h"

#define LEAST_DEVIATION 0.1 // pixels, of the photograph
#define COMMON_DEVIATION 0.5 // where the source does not say

static double mean_error(const vt_landmarks *landmarks) {
  double sum = 0;
  size_t count = 0;
  for (size_t k = 0; k < landmarks->count; k++) {
    double error = (double)landmarks->items[k].error;
    if (isfinite(error) && error > 0) sum += error, count++;
  }
  return count ? fmax(sum / (double)count, LEAST_DEVIATION) : COMMON_DEVIATION;
}

static vt_sight sight_of(const vt_photo *photo, const vt_camera *camera, int view, const float pixel[2], double deviation) {
  double at[2] = {(double)pixel[0], (double)pixel[1]}, ray[2] = {(double)NAN, (double)NAN};
  vt_sight out = {view, (float)(deviation * camera->fx / photo->lens.fx), {NAN, NAN}};
  if (!isfinite(at[0] + at[1]) || !vt_lens_unproject(&photo->lens, at, ray)) return out;
  out.pixel[0] = (float)(camera->fx * ray[0] + camera->cx), out.pixel[1] = (float)(camera->fy * ray[1] + camera->cy);
  return out;
}

vt_status vt_photo_tracks(vt_context *context, const vt_photos *photos, const vt_camera *cameras, vt_tracks *out) {
  const vt_landmarks *landmarks = &photos->landmarks;
  *out = (vt_tracks){0};
  if (!landmarks->count || !landmarks->pixels) return VT_OK;
  out->items = VT_NEW(context, vt_track, landmarks->count);
  out->sights = VT_NEW(context, vt_sight, landmarks->seen_count + 1);
  if (!out->items || !out->sights) {
    vt_free_tracks(context, out);
    return VT_OUT_OF_MEMORY;
  }
  out->count = landmarks->count, out->sight_count = landmarks->seen_count;
  double mean = mean_error(landmarks);
  for (size_t k = 0; k < landmarks->count; k++) {
    const vt_landmark *l = &landmarks->items[k];
    double own = isfinite(l->error) ? fmax((double)l->error, mean) : mean;
    out->items[k] = (vt_track){l->position, l->first, l->count};
    for (uint32_t i = l->first; i < l->first + l->count; i++) {
      int photo = landmarks->seen_by[i];
      if (photo < 0 || photo >= photos->count) out->sights[i] = (vt_sight){-1, 1, {NAN, NAN}};
      else out->sights[i] = sight_of(&photos->items[photo], &cameras[photo], photo, landmarks->pixels[i], own);
    }
  }
  return VT_OK;
}

void vt_renumber_landmarks(vt_landmarks *landmarks, const int *new_place) {
  size_t kept = 0, at = 0;
  for (size_t k = 0; k < landmarks->count; k++) {
    vt_landmark l = landmarks->items[k];
    uint32_t first = (uint32_t)at;
    for (uint32_t i = l.first; i < l.first + l.count; i++) {
      int place = new_place[landmarks->seen_by[i]];
      if (place < 0) continue;
      landmarks->seen_by[at] = place;
      if (landmarks->pixels)
        landmarks->pixels[at][0] = landmarks->pixels[i][0], landmarks->pixels[at][1] = landmarks->pixels[i][1];
      at++;
    }
    l.first = first, l.count = (uint32_t)at - first;
    landmarks->items[kept++] = l;
  }
  landmarks->count = kept, landmarks->seen_count = at;
}
