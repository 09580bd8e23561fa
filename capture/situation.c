// situation.c - what stands behind the tree: a plain backdrop, the sky, or clutter
// SPDX-License-Identifier: BSD-3-Clause
//
// A capture is taken in one place, so its photographs vote. Each is looked at in a reduced copy:
// - Sky: it is found (sky_model.c), bright, not warm, along most of the upper edge, and blue, or with ground below. Grey without
//   ground it may be a wall of paper: then the plain backdrop is asked first.
// - Plain backdrop: one smooth surface explains nearly all of the border that a plant does not cut (left, right, above).
// - Else clutter. More than half must agree; otherwise it is clutter for all: what would come out are mattes that
//   disagree, and hours later a fog.
#include "capture/situation.h"
#include "base/image_file.h"
#include "capture/backdrop_model.h"
#include "capture/masks.h"
#include "capture/matte.h"
#include "capture/sky_model.h"
#include <math.h>
#include <string.h>

enum { VOTERS = 9, SIDE = 900 }; // SIDE: of the reduced copies, pixels
#define PLAIN 0.8       // border explained
#define LEAST_SKY 0.12  // of the picture
#define MOST_GROUND 0.7 // of the picture: from higher up a crown stands before the ground
#define LEAST_TOP 0.5   // of the upper edge
#define BRIGHT 0.3      // luma
#define BLUE 0.03       // blue less red: certainly no paper
#define WARM -0.03      // a wall indoors; a sunset as well, which has to be asked for

static void measure_sky(const vt_sky *sky, vt_evidence *out) {
  double sum[3] = {0}, pixels = 1e-9;
  for (int i = 0; i < sky->columns * sky->rows; i++) {
    const vt_sky_tile *tile = &sky->tiles[i];
    for (int c = 0; c < 3; c++) sum[c] += (double)tile->mean[c] / 255 * tile->pixels;
    pixels += tile->pixels;
  }
  out->sky = sky->share;
  out->sky_top = sky->top_share;
  out->brightness = (0.299 * sum[0] + 0.587 * sum[1] + 0.114 * sum[2]) / pixels;
  out->blue = (sum[2] - sum[0]) / pixels;
  out->ground = 1 - (sky->horizon[0] + sky->horizon[1]) / 2 / sky->height;
}

vt_status vt_judge_situation(vt_context *context, const vt_image *rgb, vt_evidence *out) {
  vt_sky sky = {0};
  *out = (vt_evidence){0};
  vt_status status = vt_measure_plainness(context, rgb, &out->plain);
  if (!status) status = vt_model_sky(context, rgb, &sky);
  if (status) return status;
  measure_sky(&sky, out);
  vt_free_sky(context, &sky);
  bool is_sky = out->sky >= LEAST_SKY && out->sky_top >= LEAST_TOP && out->brightness >= BRIGHT && out->blue >= WARM && out->ground <= MOST_GROUND;
  bool is_plain = out->plain >= PLAIN, is_certain = out->blue >= BLUE || out->ground > 0.03;
  out->situation = is_sky && (is_certain || !is_plain) ? VT_SITUATION_SKY : is_plain ? VT_SITUATION_PLAIN : VT_SITUATION_CLUTTER;
  return VT_OK;
}

vt_status vt_turn_upright(vt_context *context, int upright, bool back, vt_image *picture) {
  if (upright >= 5 && upright <= 8) // 6 and 8 undo each other, 5 and 7 themselves
    return vt_turn_picture(context, back && upright == 6 ? 8 : back && upright == 8 ? 6 : upright, picture);
  size_t channels = (size_t)picture->channels, count = (size_t)picture->width * (size_t)picture->height;
  for (size_t i = 0, j = count - 1; upright == 3 && i < j; i++, j--)
    for (size_t c = 0; c < channels; c++) {
      uint8_t swap = picture->pixels[i * channels + c];
      picture->pixels[i * channels + c] = picture->pixels[j * channels + c];
      picture->pixels[j * channels + c] = swap;
    }
  return VT_OK;
}

// A photograph as RGB, reduced to about SIDE pixels.
static vt_status read_reduced(vt_context *context, const vt_photo *photo, vt_image *out) {
  vt_image picture = {0}, reduced = {0};
  vt_status status = vt_read_image(context, photo->path, &picture);
  if (!status) status = vt_make_opaque(context, &picture);
  int longer = picture.width > picture.height ? picture.width : picture.height;
  if (!status) status = vt_reduce_image(context, &picture, (longer + SIDE - 1) / SIDE, &reduced);
  if (!status) status = vt_make_image(context, reduced.width, reduced.height, 3, out);
  for (size_t i = 0; !status && i < (size_t)out->width * (size_t)out->height; i++)
    memcpy(out->pixels + 3 * i, reduced.pixels + 4 * i, 3);
  if (!status) status = vt_turn_upright(context, photo->upright, false, out);
  vt_free_image(context, &picture);
  vt_free_image(context, &reduced);
  return status;
}

vt_status vt_recognise_situation(vt_context *context, const vt_photos *photos, vt_situation *out, char sentence[256]) {
  int votes[3] = {0}, voters = photos->count < VOTERS ? photos->count : VOTERS;
  vt_evidence mean = {0};
  vt_status status = VT_OK;
  for (int v = 0; v < voters && !status; v++) { // one after the other: each full photograph is in memory for a moment
    const vt_photo *photo = &photos->items[(size_t)v * (size_t)photos->count / (size_t)voters];
    vt_image rgb = {0};
    vt_evidence seen = {0};
    status = read_reduced(context, photo, &rgb);
    if (!status) status = vt_judge_situation(context, &rgb, &seen);
    vt_free_image(context, &rgb);
    votes[seen.situation]++;
    mean.plain += seen.plain / voters, mean.sky += seen.sky / voters, mean.sky_top += seen.sky_top / voters;
    mean.ground += seen.ground / voters;
    vt_log(context, VT_LOG_VERBOSE, "%s: border %.2f plain, sky %.2f of the picture, %.2f of the upper edge, luma %.2f, blue %.2f, ground %.2f",
           photo->name, seen.plain, seen.sky, seen.sky_top, seen.brightness, seen.blue, seen.ground);
  }
  if (status) return status;
  *out = 2 * votes[VT_SITUATION_SKY] > voters     ? VT_SITUATION_SKY
         : 2 * votes[VT_SITUATION_PLAIN] > voters ? VT_SITUATION_PLAIN
                                                  : VT_SITUATION_CLUTTER;
  snprintf(sentence, 256,
           "of %d photographs %d show a plain backdrop, %d the sky, %d neither (border explained by one smooth surface: %.0f %%; "
           "sky: %.0f %% of the picture, %.0f %% of the upper edge; ground: %.0f %%)",
           voters, votes[VT_SITUATION_PLAIN], votes[VT_SITUATION_SKY], votes[VT_SITUATION_CLUTTER], 100 * mean.plain, 100 * mean.sky,
           100 * mean.sky_top, 100 * mean.ground);
  return VT_OK;
}
