// scribbles.c - a user's strokes: this is the tree, this is not
// SPDX-License-Identifier: BSD-3-Clause
//
// A picture of strokes is named as its photograph (a.png, a.jpg.png, a.scribble.png or a_scribble.png for a.jpg) and is
// one of
//   strokes on nothing    transparent where nothing is said; green or white strokes are tree, red or black ones are not
//   strokes on the photo  opaque and coloured; only paint counts, pure green and pure red, which no photograph has
//   a whole mask          opaque and grey: white is tree, black is not, grey says nothing
// Pixels between (the soft rim of a brush) say nothing. Where a stroke is thinner than a pixel of the reduced
// photograph, it still fills it. What goes wrong: strokes saved as JPEG bleed; their rims say nothing, so this only
// makes them thinner.

#include "capture/scribbles.h"
#include "base/file.h"
#include "base/image_file.h"

#include <string.h>

// ---- which file belongs to which photograph

static bool same_name(const char *file, size_t length, const char *name) {
  return strlen(name) == length && !strncmp(file, name, length);
}

// `file` has no ending any more; `name` is the photograph's, or its last part.
static bool fits_name(const char *file, const char *name) {
  static const char *const tails[] = {"", ".scribble", "_scribble", "-scribble", ".mask", "_mask"};
  const char *dot = strrchr(name, '.');
  size_t length = strlen(file), stem = dot ? (size_t)(dot - name) : strlen(name);
  for (size_t t = 0; t < sizeof tails / sizeof *tails; t++) {
    size_t tail = strlen(tails[t]);
    if (length <= tail || strcmp(file + length - tail, tails[t])) continue;
    size_t rest = length - tail;
    if (same_name(file, rest, name) || (rest == stem && !strncmp(file, name, stem))) return true;
  }
  return false;
}

// -1: none. Whole names go before last parts, which may be there twice.
static int photo_of_file(const vt_photos *photos, const char *file) {
  for (int i = 0; i < photos->count; i++)
    if (fits_name(file, photos->items[i].name)) return i;
  for (int i = 0; i < photos->count; i++)
    if (fits_name(vt_base_name(file), vt_base_name(photos->items[i].name))) return i;
  return -1;
}

vt_status vt_find_scribbles(vt_context *context, const char *folder, const vt_photos *photos, char **files) {
  vt_names names = {0};
  int found = 0;
  if (!vt_is_folder(folder))
    return vt_fail(context, VT_BAD_INPUT, "%s: no such folder of scribbles; check the path", folder);
  vt_status status = vt_list_folder(context, folder, true, &names);
  for (int i = 0; i < names.count && !status; i++) {
    if (!vt_is_image_name(names.items[i])) continue;
    char *stem = vt_without_ending(context, names.items[i]);
    int photo = stem ? photo_of_file(photos, stem) : -1;
    vt_free(context, stem);
    if (photo < 0) {
      vt_log(context, VT_LOG_NORMAL,
             "scribbles: %s/%s fits no photograph and is left out; name it as the photograph, like %s.png", folder,
             names.items[i], photos->count ? vt_base_name(photos->items[0].name) : "a.jpg");
      continue;
    }
    if (files[photo]) {
      status = vt_fail(context, VT_BAD_INPUT, "%s/%s: %s has scribbles already, in %s; keep one of them", folder,
                       names.items[i], photos->items[photo].name, files[photo]);
      break;
    }
    files[photo] = vt_join(context, folder, names.items[i]);
    if (!files[photo]) status = VT_OUT_OF_MEMORY;
    found++;
  }
  if (!status && !found)
    status = vt_fail(context, VT_BAD_INPUT,
                     "%s: no scribbles for any photograph in it; name them as the photographs, like %s.png", folder,
                     photos->count ? vt_base_name(photos->items[0].name) : "a.jpg");
  vt_free_names(context, &names);
  return status;
}

// ---- what a pixel says

typedef enum kind { STROKES, PAINTED, WHOLE } kind;

static kind kind_of(const vt_image *picture) {
  size_t count = (size_t)picture->width * (size_t)picture->height, coloured = 0, clear = 0;
  size_t channels = (size_t)picture->channels;
  for (size_t i = 0; i < count; i++) {
    const uint8_t *p = picture->pixels + i * channels;
    if (channels == 4 && p[3] < 128) {
      clear++;
      continue;
    }
    uint8_t most = p[0] > p[1] ? p[0] : p[1], least = p[0] < p[1] ? p[0] : p[1];
    if (p[2] > most) most = p[2];
    if (p[2] < least) least = p[2];
    coloured += most - least > 24;
  }
  return clear ? STROKES : coloured > count / 1000 ? PAINTED : WHOLE;
}

static uint8_t said_by(kind k, const uint8_t *p, bool alpha) {
  int r = p[0], g = p[1], b = p[2];
  if (alpha && p[3] < 128) return VT_SAID_NOTHING;
  if (k == PAINTED)
    return g > 200 && r < 80 && b < 80 ? VT_SAID_TREE : r > 200 && g < 80 && b < 80 ? VT_SAID_REST : VT_SAID_NOTHING;
  bool white = r > 191 && g > 191 && b > 191, black = r < 64 && g < 64 && b < 64;
  if (k == WHOLE) return white ? VT_SAID_TREE : black ? VT_SAID_REST : VT_SAID_NOTHING;
  if (white || (g > 96 && g - r > 64 && g - b > 64)) return VT_SAID_TREE;
  if (black || (r > 96 && r - g > 64 && r - b > 64)) return VT_SAID_REST;
  return VT_SAID_NOTHING;
}

vt_status vt_read_scribble(vt_context *context, const char *file, const vt_photo *photo, int width, int height,
                           uint8_t *said, size_t *tree, size_t *rest) {
  vt_image picture = {0};
  vt_status status = vt_read_image(context, file, &picture);
  if (status) return status;
  double sx = (double)picture.width / photo->width, sy = (double)picture.height / photo->height;
  if (fabs(sx - sy) > 0.02 * fmax(sx, sy))
    status = vt_fail(
        context, VT_BAD_INPUT,
        "%s: scribbles of %d x %d pixels for a photograph of %d x %d, which is another shape; draw them over this "
        "photograph, without turning or cutting it",
        file, picture.width, picture.height, photo->width, photo->height);
  kind k = status ? STROKES : kind_of(&picture);
  size_t channels = (size_t)picture.channels;
  *tree = *rest = 0;
  // from the finer of the two grids to the other, so that none of its pixels is passed over
  int columns = picture.width > width ? picture.width : width, rows = picture.height > height ? picture.height : height;
  for (int y = 0; y < rows && !status; y++)
    for (int x = 0; x < columns; x++) {
      size_t fx = (size_t)((int64_t)x * picture.width / columns), fy = (size_t)((int64_t)y * picture.height / rows);
      size_t tx = (size_t)((int64_t)x * width / columns), ty = (size_t)((int64_t)y * height / rows);
      uint8_t word = said_by(k, picture.pixels + (fy * (size_t)picture.width + fx) * channels, channels == 4);
      if (word != VT_SAID_NOTHING) said[ty * (size_t)width + tx] = word;
    }
  for (size_t i = 0; i < (size_t)width * (size_t)height && !status; i++) {
    *tree += said[i] == VT_SAID_TREE;
    *rest += said[i] == VT_SAID_REST;
  }
  if (!status && !*tree && !*rest)
    status =
        vt_fail(context, VT_BAD_INPUT,
                "%s: no stroke in it; draw the tree in green or white and what is not the tree in red or black, on a "
                "transparent layer of the photograph's size",
                file);
  vt_free_image(context, &picture);
  return status;
}
