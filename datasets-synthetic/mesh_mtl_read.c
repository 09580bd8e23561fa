// mesh_mtl_read.c - material libraries of OBJ files: words to a material, textures to straight RGBA
// SPDX-License-Identifier: BSD-3-Clause
//
// What the words mean here. MTL was never specified well; where programs disagree, the habit of the many is taken:
//   Kd      colour, sRGB-encoded, as it was always shown; times map_Kd. Black with a map means that nobody set it:
//   white Ks      0..1: its mean times 8 % is the reflectance at normal incidence; none under illum 0 and 1 Pr, Ns
//   roughness; from the exponent alone by Ns = 2 / r^4 - 2 [Walter et al. 2007; Karis 2013]. Pr wins map_Kd  texture;
//   where its alpha is below one half is a hole map_d   holes: its alpha if it has any, else (or with -imfchan l, r, g
//   or b) its brightness d, Tr   taken no notice of: half-transparent surfaces have no place in a tree, and programs
//   that write Tr for d are many
// and three words of our own, which others skip: vt_thin 0|1, vt_translucency r g b, vt_cutoff c.
// A texture that is not there is an error: without its holes a leaf would be a card.
#include "datasets-synthetic/mesh_mtl.h"

#include "base/file.h"
#include "base/image_file.h"
#include "datasets-synthetic/mesh_text.h"
#include <string.h>

typedef struct mtl_file {
  vt_text text;
  vt_mtl_entry *entry; // being filled; of the library, or &skipped
  vt_mtl_entry skipped;
  bool has_roughness, has_shine, no_specular;
} mtl_file;

vt_status vt_find_beside(vt_context *ctx, const char *path, const char *name, size_t length, char **out) {
  *out = NULL;
  char *copy = VT_NEW(ctx, char, length + 1), *folder = vt_strdup(ctx, path);
  if (!copy || !folder) {
    vt_free(ctx, copy);
    vt_free(ctx, folder);
    return VT_OUT_OF_MEMORY;
  }
  memcpy(copy, name, length);
  folder[vt_base_name(folder) - folder] = 0;
  char *found = vt_join(ctx, folder, copy[0] == '/' ? vt_base_name(copy) : copy);
  if (found && !vt_is_file(found)) { // made under another system
    for (char *p = copy; *p; p++)
      if (*p == '\\') *p = '/';
    vt_free(ctx, found);
    bool rooted = copy[0] == '/' || (copy[0] && copy[1] == ':');
    found = vt_join(ctx, folder, rooted ? vt_base_name(copy) : copy);
  }
  vt_free(ctx, copy);
  vt_free(ctx, folder);
  if (!found) return VT_OUT_OF_MEMORY;
  if (vt_is_file(found)) {
    *out = found;
  } else {
    vt_free(ctx, found);
  }
  return VT_OK;
}

// ---- words

static vt_status open_entry(mtl_file *file, vt_mtl_library *library, const char *at) {
  vt_context *ctx = file->text.context;
  const char *end = at;
  for (const char *p = at; *p && *p != '\n'; p++)
    if (*p != ' ' && *p != '\t' && *p != '\v') end = p + 1; // a name may hold blanks
  size_t length = (size_t)(end - at);
  uint32_t *value = vt_name_value(ctx, &library->names, at, length);
  if (!value) return VT_OUT_OF_MEMORY;
  file->entry = &file->skipped;
  file->has_roughness = file->has_shine = file->no_specular = false;
  if (*value != VT_NO_VALUE) return VT_OK;
  if (library->count == library->capacity) {
    size_t capacity = library->capacity ? 2 * library->capacity : 16;
    vt_mtl_entry *entries = vt_realloc(ctx, library->entries, capacity, sizeof *entries);
    if (!entries) return VT_OUT_OF_MEMORY;
    library->entries = entries;
    library->capacity = capacity;
  }
  *value = (uint32_t)library->count;
  file->entry = &library->entries[library->count++];
  *file->entry = (vt_mtl_entry){.material = {.albedo = {1, 1, 1}, .roughness = 1, .cutoff = 0.5f}};
  size_t kept = length < sizeof file->entry->material.name ? length : sizeof file->entry->material.name - 1;
  memcpy(file->entry->material.name, at, kept);
  return VT_OK;
}

// One or three numbers 0..1 (more is cut off); false where they are none.
static bool scan_colour(const char *at, double colour[3]) {
  double v[3];
  int count = vt_scan_numbers(at, 3, v);
  if (count != 1 && count != 3) return false;
  for (int c = 0; c < 3; c++) colour[c] = fmin(fmax(v[count == 1 ? 0 : c], 0), 1);
  return true;
}

static const char *skip_options(const char *at, bool *luma) {
  static const struct {
    const char *word;
    int least, most; // numbers or words behind it
  } options[] = {{"-blendu", 1, 1}, {"-blendv", 1, 1},  {"-bm", 1, 1},  {"-boost", 1, 1}, {"-cc", 1, 1},
                 {"-clamp", 1, 1},  {"-imfchan", 1, 1}, {"-mm", 2, 2},  {"-o", 1, 3},     {"-s", 1, 3},
                 {"-t", 1, 3},      {"-texres", 1, 1},  {"-type", 1, 1}};
  for (bool again = true; again && *at == '-';) {
    again = false;
    for (size_t i = 0; i < sizeof options / sizeof *options && !again; i++) {
      const char *rest = vt_skip_word(at, options[i].word);
      if (!rest) continue;
      if (!strcmp(options[i].word, "-imfchan")) *luma = strchr("lrgb", *rest) && *rest;
      double number;
      for (int n = 0; n < options[i].most && !vt_at_line_end(rest); n++) {
        if (n >= options[i].least && !vt_scan_number(rest, &number)) break;
        rest = vt_skip_blanks(rest + vt_word_length(rest));
      }
      at = rest;
      again = true;
    }
  }
  return at;
}

static vt_status set_map(mtl_file *file, const char *at, char **path, bool *luma) {
  at = skip_options(at, luma);
  size_t length = 0;
  for (size_t i = 0; at[i] && at[i] != '\n'; i++)
    if (at[i] != ' ' && at[i] != '\t' && at[i] != '\v') length = i + 1;
  if (!length) return vt_fail_line(&file->text, at, "a map without a file; name one or take the line out");
  vt_free(file->text.context, *path);
  vt_status status = vt_find_beside(file->text.context, file->text.path, at, length, path);
  if (status || *path) return status;
  return vt_fail_line(&file->text, at, "there is no such texture; put it beside or take the line out");
}

static vt_status set_maps(mtl_file *file, const char *at, bool *known) {
  bool ignored = false;
  const char *rest;
  *known = true;
  if ((rest = vt_skip_word(at, "map_Kd"))) return set_map(file, rest, &file->entry->colour_map, &ignored);
  if ((rest = vt_skip_word(at, "map_d"))) return set_map(file, rest, &file->entry->alpha_map, &file->entry->luma);
  *known = false;
  return VT_OK;
}

static void set_roughness(mtl_file *file, double roughness, bool outright) {
  if (file->has_roughness && !outright) return;
  file->has_roughness = outright || file->has_roughness;
  file->entry->material.roughness = (float)fmin(fmax(roughness, 0), 1);
}

static bool set_own(vt_mtl_entry *entry, const char *at, bool *good) { // true: the word was one of ours
  double v[3];
  const char *rest;
  if ((rest = vt_skip_word(at, "vt_thin"))) {
    *good = vt_scan_numbers(rest, 1, v) == 1;
    if (*good) entry->sides = v[0] > 0 ? VT_SIDES_THIN : VT_SIDES_SOLID;
  } else if ((rest = vt_skip_word(at, "vt_translucency"))) {
    *good = vt_scan_numbers(rest, 3, v) == 3;
    for (int c = 0; c < 3 && *good; c++) entry->material.translucency[c] = (float)fmax(v[c], 0);
  } else if ((rest = vt_skip_word(at, "vt_cutoff"))) {
    *good = vt_scan_numbers(rest, 1, v) == 1;
    if (*good) entry->material.cutoff = (float)fmin(fmax(v[0], 0), 1);
  } else {
    return false;
  }
  return true;
}

static vt_status set_word(mtl_file *file, const char *at) {
  vt_material *material = &file->entry->material;
  double v[3];
  const char *rest;
  bool good = true, known;
  vt_status status = set_maps(file, at, &known);
  if (known) return status;
  if ((rest = vt_skip_word(at, "Kd"))) {
    good = scan_colour(rest, v);
    for (int c = 0; c < 3 && good; c++) material->albedo[c] = (float)vt_linear_from_srgb(v[c]);
  } else if ((rest = vt_skip_word(at, "Ks"))) { // not cut off at 1: 1 is no bound of ours
    int count = vt_scan_numbers(rest, 3, v);
    good = count == 1 || count == 3;
    double mean = count == 1 ? v[0] : (v[0] + v[1] + v[2]) / 3;
    if (good && !file->no_specular) material->specular = (float)fmin(fmax(mean * VT_SPECULAR_OF_KS, 0), 1);
  } else if ((rest = vt_skip_word(at, "illum"))) {
    good = vt_scan_numbers(rest, 1, v) == 1;
    file->no_specular = good && v[0] < 2;
    if (file->no_specular) material->specular = 0;
  } else if ((rest = vt_skip_word(at, "Pr"))) {
    good = vt_scan_numbers(rest, 1, v) == 1;
    if (good) set_roughness(file, v[0], true);
  } else if ((rest = vt_skip_word(at, "Ns"))) {
    good = vt_scan_numbers(rest, 1, v) == 1;
    if (good) set_roughness(file, pow(2 / (fmax(v[0], 0) + 2), 0.25), false);
  } else {
    (void)set_own(file->entry, at, &good);
  }
  return good ? VT_OK : vt_fail_line(&file->text, at, "is no number or the wrong count of numbers; correct it");
}

vt_status vt_read_mtl(vt_context *ctx, const char *path, vt_mtl_library *library) {
  mtl_file file = {0};
  vt_status status = vt_open_text(ctx, path, &file.text);
  if (status) return status;
  for (const char *at = vt_next_line(&file.text, NULL); at && !status; at = vt_next_line(&file.text, at)) {
    if (vt_at_line_end(at)) continue;
    const char *name = vt_skip_word(at, "newmtl");
    if (name)
      status = vt_at_line_end(name) ? vt_fail_line(&file.text, at, "a material without a name; give it one")
                                    : open_entry(&file, library, name);
    else if (file.entry)
      status = set_word(&file, at);
  }
  vt_free(ctx, file.skipped.colour_map);
  vt_free(ctx, file.skipped.alpha_map);
  vt_close_text(&file.text);
  return status;
}

void vt_free_mtl(vt_context *ctx, vt_mtl_library *library) {
  for (size_t i = 0; i < library->count; i++) {
    vt_free(ctx, library->entries[i].colour_map);
    vt_free(ctx, library->entries[i].alpha_map);
  }
  vt_free(ctx, library->entries);
  vt_free(ctx, library->names.slots);
  *library = (vt_mtl_library){0};
}

// ---- textures

static uint8_t luma_of(const uint8_t *p) {
  return (uint8_t)((77u * p[0] + 150u * p[1] + 29u * p[2] + 128u) >> 8);
}

// The alpha of an RGBA picture that is a map of holes.
static void take_holes(vt_image *map, bool luma) {
  size_t count = (size_t)map->width * (size_t)map->height, opaque = 0;
  for (size_t i = 0; i < count; i++) opaque += map->pixels[4 * i + 3] == 255;
  for (size_t i = 0; i < count && (luma || opaque == count); i++) map->pixels[4 * i + 3] = luma_of(map->pixels + 4 * i);
}

// Colour of one picture and alpha of another, as large as the larger one; the nearest texel of each.
static vt_status join_maps(vt_context *ctx, const vt_image *colour, const vt_image *holes, vt_image *out) {
  int width = colour->width > holes->width ? colour->width : holes->width;
  int height = colour->height > holes->height ? colour->height : holes->height;
  vt_status status = vt_make_image(ctx, width, height, 4, out);
  if (status) return status;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      size_t cx = (size_t)x * (size_t)colour->width / (size_t)width,
             cy = (size_t)y * (size_t)colour->height / (size_t)height;
      size_t hx = (size_t)x * (size_t)holes->width / (size_t)width,
             hy = (size_t)y * (size_t)holes->height / (size_t)height;
      uint8_t *to = out->pixels + 4 * ((size_t)y * (size_t)width + (size_t)x);
      memcpy(to, colour->pixels + 4 * (cy * (size_t)colour->width + cx), 3);
      to[3] = holes->pixels[4 * (hy * (size_t)holes->width + hx) + 3];
    }
  return VT_OK;
}

static vt_status read_rgba(vt_context *ctx, const char *path, vt_image *out) {
  vt_status status = vt_read_image(ctx, path, out);
  return status ? status : vt_make_rgba(ctx, out);
}

vt_status vt_load_mtl_entry(vt_context *ctx, const vt_mtl_entry *entry, vt_material *out) {
  vt_image colour = {0}, holes = {0};
  vt_status status = VT_OK;
  *out = entry->material;
  if (entry->colour_map) status = read_rgba(ctx, entry->colour_map, &colour);
  if (entry->colour_map && out->albedo[0] + out->albedo[1] + out->albedo[2] <= 0)
    for (int c = 0; c < 3; c++) out->albedo[c] = 1;
  if (!status && entry->alpha_map) {
    status = read_rgba(ctx, entry->alpha_map, &holes);
    if (!status) take_holes(&holes, entry->luma);
    if (!status && entry->colour_map) {
      status = join_maps(ctx, &colour, &holes, &out->texture);
    } else if (!status) { // white with holes
      size_t count = (size_t)holes.width * (size_t)holes.height;
      for (size_t i = 0; i < count; i++) memset(holes.pixels + 4 * i, 255, 3);
      out->texture = holes, holes = (vt_image){0};
    }
  } else if (!status) {
    out->texture = colour, colour = (vt_image){0};
  }
  if (!out->texture.pixels || !vt_has_holes(&out->texture, out->cutoff)) out->cutoff = 0;
  vt_free_image(ctx, &colour);
  vt_free_image(ctx, &holes);
  if (status) vt_free_image(ctx, &out->texture);
  return status;
}
