// masks.c - which mask belongs to which photograph, and what it does to it
// SPDX-License-Identifier: BSD-3-Clause
//
// Programs name masks in different ways; the first rule that gives a file wins:
//   masks/a.jpg.png                COLMAP, Brush
//   masks/a.png, masks/a.jpg       most others
//   a.mask.png, a_mask.png         OpenMVS, Metashape; beside the photograph or in masks/
//   a.jpg.mask.png, .mask/a.png    RealityCapture
// A folder that the user names goes before mask_path of transforms.json, and that before these; a file that the user names is
// the mask of all photographs. Masks of what is to be ignored are found in their folder by the same names. A mask that was drawn
// on the upright picture is turned as the photograph is stored. One of another size is resized: averaged over the pixel's
// area, with linear interpolation where it is smaller than the photograph.

#include "capture/masks.h"
#include "base/file.h"
#include "base/image_file.h"

#include <string.h>

typedef enum mask_place { IN_MASKS, BESIDE, IN_DOT_MASK } mask_place;
typedef struct mask_rule {
  const char *shown;
  mask_place place;
  bool whole_name;    // a.jpg, else a
  const char *ending; //
} mask_rule;
static const mask_rule rules[] = {{"masks/NAME.jpg.png", IN_MASKS, true, ".png"},
                                  {"masks/NAME.png", IN_MASKS, false, ".png"},
                                  {"masks/NAME.jpg", IN_MASKS, true, ""},
                                  {"NAME.mask.png", BESIDE, false, ".mask.png"},
                                  {"masks/NAME.mask.png", IN_MASKS, false, ".mask.png"},
                                  {"NAME_mask.png", BESIDE, false, "_mask.png"},
                                  {"masks/NAME_mask.png", IN_MASKS, false, "_mask.png"},
                                  {"NAME.jpg.mask.png", BESIDE, true, ".mask.png"},
                                  {"masks/NAME.jpg.mask.png", IN_MASKS, true, ".mask.png"},
                                  {".mask/NAME.png", IN_DOT_MASK, false, ".png"}};
#define RULE_COUNT ((int)(sizeof rules / sizeof rules[0]))

static bool ends_with(const char *text, const char *ending) {
  size_t n = strlen(text), m = strlen(ending);
  return n >= m && !strcmp(text + n - m, ending);
}

bool vt_is_mask_name(const char *name) {
  for (const char *part = name; *part;) {
    size_t length = strcspn(part, "/");
    if (part[length] && (!strncmp(part, "masks", length) || !strncmp(part, ".mask", length)) && length == 5)
      return true;
    part += length + (part[length] == '/');
  }
  return ends_with(name, ".mask.png") || ends_with(name, "_mask.png");
}

void vt_drop_inside(vt_context *context, const char *folder, const char *inner, vt_names *names) {
  size_t length = strlen(folder), kept = 0;
  if (strncmp(inner, folder, length)) return;
  for (inner += length; *inner == '/';) inner++;
  for (length = strlen(inner); length && inner[length - 1] == '/';) length--;
  for (int i = 0; i < names->count; i++) {
    char *name = names->items[i];
    if (length && !strncmp(name, inner, length) && (name[length] == '/' || !name[length]))
      vt_free(context, name);
    else
      names->items[kept++] = name;
  }
  names->count = (int)kept;
}

// The photograph's name below the folder of photographs, without ending unless `whole`.
static char *name_in_masks(vt_context *context, const char *name, bool whole) {
  if (!strncmp(name, "images/", 7)) name += 7;
  if (name[0] == '/' || strstr(name, "..")) name = vt_base_name(name);
  return whole ? vt_strdup(context, name) : vt_without_ending(context, name);
}

// The file that a rule gives for a photograph, whether it is there or not. NULL only without memory.
static char *rule_path(vt_context *context, const mask_rule *rule, const char *masks, const vt_photo *photo) {
  char *stem = rule->place == BESIDE
                   ? (rule->whole_name ? vt_strdup(context, photo->path) : vt_without_ending(context, photo->path))
                   : name_in_masks(context, photo->name, rule->whole_name);
  char *name = stem ? vt_concat(context, stem, rule->ending, "") : NULL;
  char *path = name ? vt_join(context, rule->place == BESIDE ? "" : masks, name) : NULL;
  vt_free(context, stem);
  vt_free(context, name);
  return path;
}

// The mask of a photograph by the first rule that gives a file, its path in *out; *rule is RULE_COUNT if none does.
static vt_status find_mask(vt_context *context, const char *chosen, const char *masks, const char *dot_mask,
                           const vt_photo *photo, char **out, int *rule) {
  for (*rule = 0; *rule < RULE_COUNT; ++*rule) {
    const mask_rule *r = &rules[*rule];
    if (chosen && r->place != IN_MASKS) continue;
    const char *folder = chosen ? chosen : r->place == IN_DOT_MASK ? dot_mask : masks;
    char *path = rule_path(context, r, folder, photo);
    if (!path) return VT_OUT_OF_MEMORY;
    if (vt_is_file(path) && strcmp(path, photo->path)) {
      vt_free(context, *out);
      *out = path;
      return VT_OK;
    }
    vt_free(context, path);
  }
  return VT_OK;
}

enum { BY_PATH = RULE_COUNT, ONE_FOR_ALL, NOTHING, WAY_COUNT }; // ways to find a mask, behind those of the rules

static void tell_ways(vt_context *context, const char *what, const int matched[WAY_COUNT]) {
  if (matched[ONE_FOR_ALL]) vt_log(context, VT_LOG_NORMAL, "%s: one for all %d", what, matched[ONE_FOR_ALL]);
  if (matched[BY_PATH]) vt_log(context, VT_LOG_NORMAL, "%s: %d by mask_path", what, matched[BY_PATH]);
  for (int r = 0; r < RULE_COUNT; r++)
    if (matched[r]) vt_log(context, VT_LOG_NORMAL, "%s: %d by the rule %s", what, matched[r], rules[r].shown);
}

vt_status vt_find_masks(vt_context *context, const char *chosen, const char *root, vt_photos *photos, int *found) {
  int matched[WAY_COUNT] = {0};
  vt_status status = VT_OK;
  *found = 0;
  bool one = chosen && vt_is_file(chosen);
  if (chosen && !one && !vt_is_folder(chosen))
    return vt_fail(context, VT_BAD_INPUT, "%s: no such folder of masks; check the path", chosen);
  char *masks = vt_join(context, root, "masks"), *dot_mask = vt_join(context, root, ".mask");
  if (!masks || !dot_mask) status = VT_OUT_OF_MEMORY;
  for (int i = 0; i < photos->count && !status; i++) {
    vt_photo *photo = &photos->items[i];
    int way = NOTHING;
    bool named = photo->mask && vt_is_file(photo->mask);
    if (!named || one) {
      vt_free(context, photo->mask);
      photo->mask = one ? vt_strdup(context, chosen) : NULL;
      if (one && !photo->mask) status = VT_OUT_OF_MEMORY;
    }
    if (!one && (chosen || !named)) status = find_mask(context, chosen, masks, dot_mask, photo, &photo->mask, &way);
    if (one) way = ONE_FOR_ALL;
    if (way == RULE_COUNT && !named) way = NOTHING;
    if (way == NOTHING && named) way = BY_PATH;
    matched[way]++;
    *found += photo->mask != NULL;
  }
  tell_ways(context, "masks", matched);
  vt_free(context, masks);
  vt_free(context, dot_mask);
  return status;
}

vt_status vt_find_ignored(vt_context *context, const char *chosen, vt_photos *photos) {
  int matched[WAY_COUNT] = {0};
  vt_status status = VT_OK;
  bool one = chosen && vt_is_file(chosen);
  if (!chosen) return VT_OK;
  if (!one && !vt_is_folder(chosen))
    return vt_fail(context, VT_BAD_INPUT, "%s: no such folder of masks of what to ignore; check the path", chosen);
  for (int i = 0; i < photos->count && !status; i++) {
    vt_photo *photo = &photos->items[i];
    int way = ONE_FOR_ALL;
    vt_free(context, photo->ignored);
    photo->ignored = one ? vt_strdup(context, chosen) : NULL;
    if (one && !photo->ignored) status = VT_OUT_OF_MEMORY;
    if (!one) status = find_mask(context, chosen, NULL, NULL, photo, &photo->ignored, &way);
    matched[way == RULE_COUNT ? NOTHING : way]++;
  }
  tell_ways(context, "ignored", matched);
  if (!status && matched[NOTHING] == photos->count)
    return vt_fail(context, VT_BAD_INPUT,
                   "%s: no mask of what to ignore fits a photograph; name them as the photographs, as in %s.png, white where "
                   "nothing is to be looked at",
                   chosen, photos->count ? vt_base_name(photos->items[0].name) : "a.jpg");
  return status;
}

// ---- resizing: out[x] = sum of weight * in over the source pixels that output pixel x covers, one axis at a time

typedef struct span {
  int first, count;
  double begin, end, centre, scale; // source pixels
} span;

static span cover(int x, int size, int out_size) {
  span s = {.scale = (double)size / out_size};
  s.begin = x * s.scale;
  s.end = s.begin + s.scale;
  s.centre = 0.5 * (s.begin + s.end) - 0.5;
  s.first = (int)floor(s.scale >= 1 ? s.begin : s.centre);
  int last = s.scale >= 1 ? (int)ceil(s.end) - 1 : s.first + 1;
  s.count = last - s.first + 1;
  return s;
}

static double weight(const span *s, int source) {
  if (s->scale < 1) return fmax(0, 1 - fabs(source - s->centre));
  double from = fmax(s->begin, source), to = fmin(s->end, source + 1);
  return fmax(0, to - from);
}

static int clamp(int v, int high) {
  return v < 0 ? 0 : v > high ? high : v;
}

static vt_status resize_mask(vt_context *context, const vt_image *in, int width, int height, vt_image *out) {
  float *rows = VT_NEW(context, float, (size_t)width *(size_t)in->height);
  vt_status status = rows ? vt_make_image(context, width, height, 1, out) : VT_OUT_OF_MEMORY;
  for (int x = 0; x < width && !status; x++) {
    span s = cover(x, in->width, width);
    for (int y = 0; y < in->height; y++) {
      double sum = 0, whole = 0;
      for (int i = s.first; i < s.first + s.count; i++) {
        double w = weight(&s, i);
        sum += w * in->pixels[(size_t)y * (size_t)in->width + (size_t)clamp(i, in->width - 1)];
        whole += w;
      }
      rows[(size_t)y * (size_t)width + (size_t)x] = (float)(sum / whole);
    }
  }
  for (int y = 0; y < height && !status; y++) {
    span s = cover(y, in->height, height);
    for (int x = 0; x < width; x++) {
      double sum = 0, whole = 0;
      for (int i = s.first; i < s.first + s.count; i++) {
        double w = weight(&s, i);
        sum += w * rows[(size_t)clamp(i, in->height - 1) * (size_t)width + (size_t)x];
        whole += w;
      }
      out->pixels[(size_t)y * (size_t)width + (size_t)x] = (uint8_t)(sum / whole + 0.5);
    }
  }
  vt_free(context, rows);
  return status;
}

// ---- applying

vt_status vt_make_opaque(vt_context *context, vt_image *picture) {
  vt_image out = {0};
  vt_status status = vt_make_image(context, picture->width, picture->height, 4, &out);
  if (status) return status;
  size_t count = (size_t)out.width * (size_t)out.height, channels = (size_t)picture->channels;
  for (size_t i = 0; i < count; i++) {
    for (size_t c = 0; c < 3; c++) out.pixels[4 * i + c] = picture->pixels[channels * i + (channels < 3 ? 0 : c)];
    out.pixels[4 * i + 3] = 255;
  }
  vt_free_image(context, picture);
  *picture = out;
  return VT_OK;
}

static bool same_shape(const vt_image *mask, int width, int height) {
  double sx = (double)mask->width / width, sy = (double)mask->height / height;
  return fabs(sx - sy) <= 0.02 * fmax(sx, sy);
}

static vt_status read_fitting_mask(vt_context *context, const char *path, int upright, int width, int height, vt_image *out) {
  static const int back[] = {5, 8, 7, 6}; // from upright to the rows of the sensor, by the turn the other way, 5..8
  vt_image mask = {0};
  vt_status status = vt_read_mask(context, path, &mask);
  if (!status && upright > 4 && !same_shape(&mask, width, height) && same_shape(&mask, height, width))
    status = vt_turn_picture(context, back[upright - 5], &mask); // drawn on the picture as a viewer shows it
  if (!status && mask.width == width && mask.height == height) {
    *out = mask;
    return VT_OK;
  }
  if (!status && !same_shape(&mask, width, height))
    status =
        vt_fail(context, VT_BAD_INPUT,
                "%s: a mask of %d x %d pixels for a photograph of %d x %d, which is another shape; make it from this "
                "photograph, without turning or cutting it",
                path, mask.width, mask.height, width, height);
  if (!status) status = resize_mask(context, &mask, width, height, out);
  vt_free_image(context, &mask);
  return status;
}

vt_status vt_apply_mask(vt_context *context, const vt_photo *photo, bool invert, vt_image *picture,
                        double *border_share) {
  vt_image mask = {0};
  int width = picture->width, height = picture->height, border = 0, tree = 0;
  vt_status status = read_fitting_mask(context, photo->mask, photo->upright, width, height, &mask);
  if (!status) status = vt_make_opaque(context, picture);
  for (int y = 0; y < height && !status; y++)
    for (int x = 0; x < width; x++) {
      size_t i = (size_t)y * (size_t)width + (size_t)x;
      uint8_t alpha = invert ? (uint8_t)(255 - mask.pixels[i]) : mask.pixels[i];
      picture->pixels[4 * i + 3] = alpha;
      if (x == 0 || y == 0 || x == width - 1 || y == height - 1) border++, tree += alpha > 127;
    }
  *border_share = border ? (double)tree / border : 0;
  vt_free_image(context, &mask);
  return status;
}

// ---- what is not to be looked at

#define MARKED 64 // of 255, from which on a pixel is ignored: a soft border belongs to what it surrounds

vt_status vt_read_ignored(vt_context *context, const vt_photo *photo, int width, int height, vt_image *out) {
  vt_status status = read_fitting_mask(context, photo->ignored, photo->upright, width, height, out);
  if (status) return status;
  for (size_t i = 0; i < (size_t)width * (size_t)height; i++) out->pixels[i] = out->pixels[i] >= MARKED ? 255 : 0;
  return VT_OK;
}

static vt_status write_colmap_mask(vt_context *context, vt_photo *photo, const char *to) {
  char *name = vt_concat(context, photo->name, ".png", ""), *path = name ? vt_join(context, to, name) : NULL;
  char *parent = path ? vt_strdup(context, path) : NULL;
  vt_image mask = {0};
  vt_image_info info;
  vt_status status = parent ? vt_read_image_info(context, photo->path, &info) : VT_OUT_OF_MEMORY;
  if (!status) photo->upright = info.orientation;
  if (!status) status = vt_read_ignored(context, photo, info.width, info.height, &mask);
  for (size_t i = 0; !status && i < (size_t)mask.width * (size_t)mask.height; i++) mask.pixels[i] ^= 255;
  if (!status) {
    *strrchr(parent, '/') = 0;
    status = vt_make_folder(context, parent);
  }
  if (!status) status = vt_write_image(context, path, &mask);
  vt_free_image(context, &mask);
  vt_free(context, parent);
  vt_free(context, path);
  vt_free(context, name);
  return status;
}

vt_status vt_write_colmap_masks(vt_context *context, const char *chosen, const char *folder, const vt_names *names,
                                const char *to, int *written) {
  vt_photos photos = {0};
  vt_status status = VT_OK;
  *written = 0;
  for (int i = 0; i < names->count && !status; i++) {
    char *path = vt_join(context, folder, names->items[i]);
    if (!path || !vt_add_photo(context, &photos, names->items[i], path)) status = VT_OUT_OF_MEMORY;
    vt_free(context, path);
  }
  if (!status) status = vt_find_ignored(context, chosen, &photos);
  for (int i = 0; i < photos.count && !status; i++) {
    if (!photos.items[i].ignored) continue;
    status = write_colmap_mask(context, &photos.items[i], to);
    ++*written;
  }
  vt_free_photos(context, &photos);
  return status;
}
