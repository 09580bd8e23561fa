// tree_file_field.c - corners and view textures in .vtree files, written and read
// SPDX-License-Identifier: BSD-3-Clause
//
// Which cell has which corners follows from the cells (corners.c), so a file holds the corners' values and nothing else; the
// cells' own values are the means of their corners and are not said again. In a packed tree every colour is a codeword of the
// field codebook, whose codewords rise, so that a colour has one number.
// View textures stand as they are, row by row. Differences to the left or upper neighbour, to their mean and to a
// gradient were tried (48 views of a maple, 16 levels): 289 kB without, 308, 326, 309 and 318 kB with them, because zstd finds
// repeated strings and a difference breaks them.

#include "octree/tree_file_field.h"
#include "octree/depth_ladder.h"
#include <float.h>

#define VIEW_BYTES 24u // width, height, left, top, columns, rows
#define MAX_EDGE 65535
#define MAX_FACTOR 65535
#define LINEAR_FLAG (1u << 31) // beside the factor

static size_t index_planes(uint32_t codewords) { return codewords > 256 ? 2 : 1; }

// ==== writing ========================================================================================================

static void check_textures(const vt_tree *tree, int l) {
  const vt_view_textures *textures = &tree->view_textures[l];
  if (!textures->view_count) return;
  VT_ASSERT(textures->view_count == tree->view_count && tree->tiles[l].view_count == 0);
  VT_ASSERT(textures->factor >= 1 && textures->factor <= MAX_FACTOR);
  for (int v = 0; v < textures->view_count; v++) {
    const vt_view_texture *t = &textures->views[v];
    VT_ASSERT(t->width >= 1 && t->width <= MAX_EDGE && t->height >= 1 && t->height <= MAX_EDGE);
    VT_ASSERT(t->columns >= 0 && t->rows >= 0 && (t->columns == 0) == (t->rows == 0));
    VT_ASSERT(t->left >= 0 && t->top >= 0 && t->columns <= t->width - t->left && t->rows <= t->height - t->top);
    VT_ASSERT((t->codes || !t->columns) && t->linear == textures->views[0].linear);
  }
}

void vt_describe_field(vt_tree_writer *w, int l) {
  const vt_tree *tree = w->tree;
  const vt_level *level = &tree->octree.levels[l];
  const vt_view_textures *textures = &tree->view_textures[l];
  check_textures(tree, l);
  for (uint32_t i = 0; i < level->corner_count; i++)
    VT_ASSERT(level->corner_values[4 * (size_t)i] >= 0 && isfinite(level->corner_values[4 * (size_t)i]));
  w->head.field_codewords = (uint32_t)tree->field_codebook.codeword_count;
  w->head.level[l].corner_count = level->corner_count;
  w->head.level[l].has_views = textures->view_count > 0;
  for (int v = 0; v < textures->view_count; v++)
    w->head.level[l].code_count += (uint64_t)textures->views[v].columns * (uint64_t)textures->views[v].rows;
  VT_ASSERT(!w->head.packed || w->head.field_codewords || (!level->corner_count && !textures->view_count));
}

static uint32_t colour_key(const uint8_t rgb[3]) { return (uint32_t)rgb[0] << 16 | (uint32_t)rgb[1] << 8 | rgb[2]; }

static bool codewords_rise(const uint8_t *rgb, size_t count) {
  for (size_t i = 1; i < count; i++)
    if (colour_key(rgb + 3 * i) <= colour_key(rgb + 3 * (i - 1))) return false;
  return true;
}

vt_status vt_add_field_codebook(vt_tree_writer *w) {
  const vt_codebook *book = &w->tree->field_codebook;
  VT_ASSERT(book->codeword_count >= 1 && book->codeword_count <= VT_MAX_CODEWORDS && book->channels == 3);
  VT_ASSERT(codewords_rise(book->codewords, (size_t)book->codeword_count));
  return vt_add_chunk(w, VT_CBKF, 0, book->codewords, (size_t)book->codeword_count * 3);
}

static uint32_t codeword_of(const vt_codebook *book, const float colour[3]) {
  uint8_t rgb[3] = {vt_colour_byte(colour[0]), vt_colour_byte(colour[1]), vt_colour_byte(colour[2])};
  uint32_t key = colour_key(rgb), low = 0, high = (uint32_t)book->codeword_count - 1;
  while (low < high) {
    uint32_t middle = (low + high) / 2;
    if (colour_key(book->codewords + 3 * (size_t)middle) < key) low = middle + 1;
    else high = middle;
  }
  VT_ASSERT(colour_key(book->codewords + 3 * (size_t)low) == key); // octree.h: all colours are among the codewords
  return low;
}

static vt_status add_colour_codes(vt_tree_writer *w, vt_chunk_kind kind, int l, const float *colour, size_t stride,
                                  size_t count) {
  size_t planes = index_planes(w->head.field_codewords);
  uint8_t *raw = vt_alloc(w->context, count, planes);
  for (size_t i = 0; raw && i < count; i++) {
    uint32_t code = codeword_of(&w->tree->field_codebook, colour + i * stride);
    for (size_t b = 0; b < planes; b++) raw[b * count + i] = (uint8_t)(code >> 8 * b);
  }
  return vt_add_owned_chunk(w, kind, l, raw, count * planes);
}

vt_status vt_add_coded_colours(vt_tree_writer *w, int l) {
  const vt_level *level = &w->tree->octree.levels[l];
  return add_colour_codes(w, VT_COLR, l, level->colour, 3, level->cell_count);
}

// Each number in four planes, the numbers of a corner behind each other; colours outside 0..1 are moved there.
static vt_status add_exact_values(vt_tree_writer *w, vt_chunk_kind kind, int l, size_t first, size_t numbers) {
  const vt_level *level = &w->tree->octree.levels[l];
  size_t count = level->corner_count;
  uint8_t *raw = vt_alloc(w->context, count * numbers, 4);
  for (size_t k = 0; raw && k < numbers; k++)
    for (size_t i = 0; i < count; i++) {
      float value = level->corner_values[4 * i + first + k];
      if (first > 0) value = value > 0 ? value < 1 ? value : 1 : 0; // NaN: 0
      uint8_t bytes[4];
      vt_put_f32(bytes, value);
      for (size_t b = 0; b < 4; b++) raw[(4 * k + b) * count + i] = bytes[b];
    }
  return vt_add_owned_chunk(w, kind, l, raw, count * numbers * 4);
}

vt_status vt_add_corners(vt_tree_writer *w, int l) {
  const vt_level *level = &w->tree->octree.levels[l];
  if (!w->head.packed) {
    vt_status status = add_exact_values(w, VT_COPA, l, 0, 1);
    return status ? status : add_exact_values(w, VT_CCOL, l, 1, 3);
  }
  size_t size = 0;
  uint8_t *raw = vt_code_depths(w->context, level->corner_values, 4, level->corner_count, &size);
  vt_status status = vt_add_owned_chunk(w, VT_COPA, l, raw, size);
  return status ? status : add_colour_codes(w, VT_CCOL, l, level->corner_values + 1, 4, level->corner_count);
}

vt_status vt_add_view_textures(vt_tree_writer *w, int l) {
  const vt_view_textures *textures = &w->tree->view_textures[l];
  size_t views = (size_t)textures->view_count, at = 0;
  uint8_t *index = vt_alloc(w->context, 4 + views * VIEW_BYTES, 1);
  uint8_t *codes = VT_NEW(w->context, uint8_t, (size_t)w->head.level[l].code_count);
  if (!index || !codes) {
    vt_free(w->context, index);
    vt_free(w->context, codes);
    return VT_OUT_OF_MEMORY;
  }
  vt_put_u32(index, (uint32_t)textures->factor | (views && textures->views[0].linear ? LINEAR_FLAG : 0));
  for (size_t v = 0; v < views; v++) {
    const vt_view_texture *t = &textures->views[v];
    bool kept = t->columns > 0;
    const int numbers[6] = {t->width, t->height, kept ? t->left : 0, kept ? t->top : 0, t->columns, t->rows};
    for (size_t i = 0; i < 6; i++) vt_put_u32(index + 4 + v * VIEW_BYTES + 4 * i, (uint32_t)numbers[i]);
    size_t size = (size_t)t->columns * (size_t)t->rows;
    if (size) memcpy(codes + at, t->codes, size);
    at += size;
  }
  vt_status status = vt_add_owned_chunk(w, VT_VIDX, l, index, 4 + views * VIEW_BYTES);
  if (!status) return vt_add_owned_chunk(w, VT_VCOD, l, codes, at);
  vt_free(w->context, codes);
  return status;
}

// ==== reading ========================================================================================================

static vt_status describe_level(vt_tree_reader *r, int l) {
  const vt_chunk_in *colours = &r->chunks[VT_CCOL][l], *codes = &r->chunks[VT_VCOD][l];
  vt_tree_head *h = &r->head;
  if (colours->present) {
    uint64_t bytes = h->packed ? index_planes(h->field_codewords) : 12, corners = colours->raw_size / bytes;
    if (colours->raw_size % bytes || corners == 0 || corners > 8 * (uint64_t)h->level[l].cell_count || corners > UINT32_MAX)
      return vt_refuse_chunk(r, VT_CCOL, l, "has a size that does not fit the counts of the tree");
    h->level[l].corner_count = (uint32_t)corners;
  }
  h->level[l].has_views = r->chunks[VT_VIDX][l].present;
  if (h->level[l].has_views) h->level[l].code_count = codes->raw_size;
  if (h->level[l].code_count > (1ull << 40)) // sums below do not overflow, and no file is as long as that
    return vt_refuse_chunk(r, VT_VCOD, l, "has a size that does not fit the counts of the tree");
  if (h->packed && !h->field_codewords && (colours->present || h->level[l].has_views))
    return vt_refuse_chunk(r, colours->present ? VT_CCOL : VT_VIDX, l, "has no field codebook to go with");
  return VT_OK;
}

vt_status vt_describe_field_chunks(vt_tree_reader *r) {
  const vt_chunk_in *book = &r->chunks[VT_CBKF][0];
  if (book->present && (book->raw_size < 3 || book->raw_size % 3 || book->raw_size > 3 * VT_MAX_CODEWORDS))
    return vt_refuse_chunk(r, VT_CBKF, 0, "has a size that does not fit the counts of the tree");
  if (book->present) r->head.field_codewords = (uint32_t)(book->raw_size / 3);
  vt_status status = VT_OK;
  for (int l = 0; !status && l < r->head.level_count; l++) status = describe_level(r, l);
  return status;
}

vt_status vt_read_field_codebook(const vt_tree_reader *r) {
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_CBKF, 0, &raw, &owned);
  if (status) return status;
  vt_codebook *book = &r->tree->field_codebook;
  size_t count = r->head.field_codewords;
  *book = (vt_codebook){.codeword_count = (int)count, .channels = 3, .codewords = VT_NEW(r->context, uint8_t, 3 * count)};
  if (!book->codewords) status = VT_OUT_OF_MEMORY;
  else if (!codewords_rise(raw, count)) status = vt_refuse_chunk(r, VT_CBKF, 0, "has codewords that do not rise");
  else memcpy(book->codewords, raw, 3 * count);
  vt_free(r->context, owned);
  return status;
}

static vt_status read_colour_codes(const vt_tree_reader *r, vt_chunk_kind kind, int l, float *colour, size_t stride,
                                   size_t count) {
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, kind, l, &raw, &owned);
  if (status) return status;
  bool wide = index_planes(r->head.field_codewords) > 1, good = true;
  for (size_t i = 0; i < count && good; i++) {
    uint32_t code = raw[i] | (wide ? (uint32_t)raw[count + i] << 8 : 0);
    good = code < r->head.field_codewords;
    for (size_t k = 0; k < 3 && good; k++)
      colour[i * stride + k] = (float)r->tree->field_codebook.codewords[3 * (size_t)code + k] / 255;
  }
  vt_free(r->context, owned);
  return good ? VT_OK : vt_refuse_chunk(r, kind, l, "names a codeword that its codebook does not have");
}

vt_status vt_read_coded_colours(const vt_tree_reader *r, int l) {
  return read_colour_codes(r, VT_COLR, l, r->tree->octree.levels[l].colour, 3, r->head.level[l].cell_count);
}

static vt_status read_exact_values(const vt_tree_reader *r, vt_chunk_kind kind, int l, size_t first, size_t numbers,
                                   float most) {
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, kind, l, &raw, &owned);
  if (status) return status;
  vt_level *level = &r->tree->octree.levels[l];
  size_t count = level->corner_count;
  bool good = true;
  for (size_t k = 0; k < numbers; k++)
    for (size_t i = 0; i < count; i++) {
      uint8_t bytes[4];
      for (size_t b = 0; b < 4; b++) bytes[b] = raw[(4 * k + b) * count + i];
      float value = vt_get_f32(bytes);
      good = good && value >= 0 && value <= most && !(first > 0 && signbit(value)); // the writer makes +0 of a colour's -0
      level->corner_values[4 * i + first + k] = value;
    }
  vt_free(r->context, owned);
  return good ? VT_OK : vt_refuse_chunk(r, kind, l, "has a value that is negative, too great or not finite");
}

static vt_status read_corner_depths(const vt_tree_reader *r, int l) {
  if (!r->head.packed) return read_exact_values(r, VT_COPA, l, 0, 1, FLT_MAX);
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_COPA, l, &raw, &owned);
  if (status) return status;
  vt_level *level = &r->tree->octree.levels[l];
  size_t count = level->corner_count;
  bool good = vt_decode_depths(raw, count, r->chunks[VT_COPA][l].raw_size > 4 + count, level->corner_values, 4);
  vt_free(r->context, owned);
  return good ? VT_OK : vt_refuse_chunk(r, VT_COPA, l, "has an optical depth that is negative or not finite");
}

vt_status vt_read_corners(const vt_tree_reader *r, int l) {
  vt_level *level = &r->tree->octree.levels[l];
  vt_status status = vt_make_corners(r->context, r->head.branching, level);
  if (status) return status;
  if (level->corner_count != r->head.level[l].corner_count)
    return vt_refuse_chunk(r, VT_CCOL, l, "counts other corners than the cells have");
  status = read_corner_depths(r, l);
  if (!status && r->head.packed)
    status = read_colour_codes(r, VT_CCOL, l, level->corner_values + 1, 4, level->corner_count);
  else if (!status) status = read_exact_values(r, VT_CCOL, l, 1, 3, 1);
  if (!status) vt_cells_from_corners(level);
  return status;
}

// Sizes and rectangles of all views; false if one of them cannot be or they do not hold `code_count` codes in all.
static bool read_view_index(const uint8_t *raw, uint64_t code_count, bool may_be_linear, vt_view_textures *out) {
  uint64_t sum = 0;
  uint32_t factor = vt_get_u32(raw);
  bool linear = may_be_linear && (factor & LINEAR_FLAG);
  factor &= linear ? ~LINEAR_FLAG : UINT32_MAX;
  if (factor < 1 || factor > MAX_FACTOR) return false;
  out->factor = (int)factor;
  for (int v = 0; v < out->view_count; v++) {
    uint32_t n[6];
    for (size_t i = 0; i < 6; i++) n[i] = vt_get_u32(raw + 4 + (size_t)v * VIEW_BYTES + 4 * i);
    uint32_t width = n[0], height = n[1], left = n[2], top = n[3], columns = n[4], rows = n[5];
    if (width < 1 || width > MAX_EDGE || height < 1 || height > MAX_EDGE) return false;
    if (left > width || columns > width - left || top > height || rows > height - top) return false;
    if ((columns == 0) != (rows == 0) || (columns == 0 && (left || top))) return false;
    out->views[v] = (vt_view_texture){.width = (int)width, .height = (int)height, .left = (int)left, .top = (int)top,
                                      .columns = (int)columns, .rows = (int)rows, .linear = linear};
    sum += (uint64_t)columns * rows;
  }
  return sum == code_count;
}

vt_status vt_read_view_textures(const vt_tree_reader *r, int l) {
  vt_view_textures *out = &r->tree->view_textures[l];
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_VIDX, l, &raw, &owned);
  if (status) return status;
  out->views = VT_NEW(r->context, vt_view_texture, (size_t)r->head.view_count);
  if (!out->views) status = VT_OUT_OF_MEMORY;
  else out->view_count = r->head.view_count;
  if (!status && !read_view_index(raw, r->head.level[l].code_count, vt_get_u16(r->bytes + 10) >= 3, out))
    status = vt_refuse_chunk(r, VT_VIDX, l, "has a picture that cannot be, or others than there are codes for");
  vt_free(r->context, owned);
  if (status) return status;
  status = vt_open_chunk(r, VT_VCOD, l, &raw, &owned);
  for (int v = 0; !status && v < out->view_count; v++) {
    size_t size = (size_t)out->views[v].columns * (size_t)out->views[v].rows;
    out->views[v].codes = VT_NEW(r->context, uint8_t, size);
    if (!out->views[v].codes) status = VT_OUT_OF_MEMORY;
    else if (size) memcpy(out->views[v].codes, raw, size), raw += size;
  }
  vt_free(r->context, owned);
  return status;
}
