// tree_file_read.c - the bytes of a .vtree file to a tree, trusting none of them
// SPDX-License-Identifier: BSD-3-Clause
//
// docs/format.md specifies the bytes. Nothing is believed before it is checked, and nothing large is allocated before the
// whole file is known to be consistent: first the table (checksum, offsets, kinds, order), then the checksums of all
// chunks, then the small TREE chunk, from whose counts the size of every other chunk follows; only then are they unpacked.
// Checksums find accidents, not malice, so every value is checked again for itself. A file may not ask for more memory
// than its length justifies (vt_tree_memory), which keeps a few kB of zstd from becoming a few GB of tree.
#include "octree/tree_file_read.h"
#include "octree/depth_ladder.h"
#include "octree/tree_file_field.h"
#include "base/byte_codec.h"
#include "base/file.h"
#include "base/hash.h"
#include <float.h>

// What to do about a file that cannot be read.
static const char *cure_of(const vt_tree_reader *r) {
  return r->is_newer ? "the file is newer than this program; use a newer voltree"
                     : "the file is damaged or cut short; make it again";
}

static vt_status refuse(const vt_tree_reader *r, const char *why) {
  return vt_fail(r->context, VT_BAD_INPUT, "%s: %s; %s", r->name, why, cure_of(r));
}

vt_status vt_refuse_chunk(const vt_tree_reader *r, vt_chunk_kind kind, int level, const char *why) {
  if (kind < VT_CELL)
    return vt_fail(r->context, VT_BAD_INPUT, "%s: chunk %.4s %s; %s", r->name, &VT_CHUNK_TYPES[4 * kind], why, cure_of(r));
  return vt_fail(r->context, VT_BAD_INPUT, "%s: chunk %.4s of level %d %s; %s", r->name, &VT_CHUNK_TYPES[4 * kind], level,
                 why, cure_of(r));
}

// ==== header and table ===============================================================================================

static vt_chunk_kind kind_of(const uint8_t *type) {
  for (int kind = 0; kind < VT_CHUNK_KINDS; kind++)
    if (!memcmp(type, &VT_CHUNK_TYPES[4 * kind], 4)) return (vt_chunk_kind)kind;
  return VT_CHUNK_KINDS;
}

static vt_status read_header(const vt_tree_reader *r, size_t *chunk_count) {
  if (r->size < VT_HEADER_BYTES + 8 || memcmp(r->bytes, VT_FILE_MAGIC, 8) != 0)
    return vt_fail(r->context, VT_BAD_INPUT, "%s: is no .vtree file (it does not begin like one); name a file that "
                   "voltree wrote", r->name);
  unsigned major = vt_get_u16(r->bytes + 8);
  if (major > VT_FILE_MAJOR)
    return vt_fail(r->context, VT_BAD_INPUT, "%s: has format version %u and this program reads up to %d; use a newer "
                   "voltree", r->name, major, VT_FILE_MAJOR);
  if (major < 1) return refuse(r, "has format version 0");
  if (vt_get_u64(r->bytes + 16) != r->size) return refuse(r, "is not as long as its header says");
  *chunk_count = vt_get_u32(r->bytes + 12);
  if (*chunk_count > (r->size - VT_HEADER_BYTES - 8) / VT_ENTRY_BYTES) return refuse(r, "has no room for its chunk table");
  size_t front = VT_HEADER_BYTES + VT_ENTRY_BYTES * *chunk_count;
  if (vt_get_u64(r->bytes + front) != vt_hash(r->bytes, front, 0)) return refuse(r, "its chunk table does not match its checksum");
  return VT_OK;
}

// Finds every chunk, checks that they fill the file without gaps and stand in canonical order (so none comes twice), and
// compares their checksums; chunks of unknown type are passed over.
static vt_status read_table(vt_tree_reader *r) {
  size_t count = 0;
  vt_status status = read_header(r, &count);
  if (status) return status;
  r->is_newer = vt_get_u16(r->bytes + 10) > VT_FILE_MINOR;
  size_t at = VT_HEADER_BYTES + VT_ENTRY_BYTES * count + 8;
  int last_rank = -1;
  for (size_t i = 0; i < count; i++) {
    const uint8_t *entry = r->bytes + VT_HEADER_BYTES + VT_ENTRY_BYTES * i;
    vt_chunk_kind kind = kind_of(entry);
    int level = entry[4];
    vt_chunk_in c = {.present = true, .coding = (vt_chunk_coding)entry[5], .bytes = r->bytes + at};
    c.stored_size = vt_get_u64(entry + 8), c.raw_size = vt_get_u64(entry + 16);
    if (c.stored_size > r->size - at) return refuse(r, "a chunk reaches beyond the end");
    at += (size_t)c.stored_size;
    if (vt_hash(c.bytes, (size_t)c.stored_size, 0) != vt_get_u64(entry + 24)) {
      if (kind < VT_CHUNK_KINDS) return vt_refuse_chunk(r, kind, level, "does not match its checksum");
      return refuse(r, "a chunk does not match its checksum");
    }
    if (kind == VT_CHUNK_KINDS) continue;
    if (level > (kind < VT_CELL ? 0 : VT_MAX_LEVEL)) return vt_refuse_chunk(r, kind, level, "has a level that cannot be");
    if (entry[5] > VT_ZSTD) return vt_refuse_chunk(r, kind, level, "has an unknown coding");
    if (vt_get_u16(entry + 6) != 0) return vt_refuse_chunk(r, kind, level, "has unknown flags");
    if (c.coding == VT_STORED && c.raw_size != c.stored_size) return vt_refuse_chunk(r, kind, level, "has two sizes");
    int rank = kind < VT_CELL ? (int)kind : level * VT_CHUNK_KINDS + (int)kind;
    if (rank <= last_rank) return vt_refuse_chunk(r, kind, level, "comes twice or too late");
    last_rank = rank;
    r->chunks[kind][level] = c;
  }
  if (at != r->size) return refuse(r, "has bytes behind its last chunk");
  return VT_OK;
}

vt_status vt_open_chunk(const vt_tree_reader *r, vt_chunk_kind kind, int level, const uint8_t **raw, uint8_t **owned) {
  const vt_chunk_in *c = &r->chunks[kind][level];
  *owned = NULL;
  if (vt_cancelled(r->context)) return vt_fail(r->context, VT_CANCELLED, "%s: reading was interrupted", r->name);
  if (c->coding == VT_STORED) {
    *raw = c->bytes;
    return VT_OK;
  }
  if (!vt_can_pack_bytes())
    return vt_fail(r->context, VT_MISSING_PROGRAM, "%s: is packed with zstd, which this voltree was built without; use "
                   "a voltree with zstd", r->name);
  *owned = VT_NEW(r->context, uint8_t, (size_t)c->raw_size);
  if (!*owned) return VT_OUT_OF_MEMORY;
  char title[300];
  snprintf(title, sizeof title, "%.255s: chunk %.4s of level %d", r->name, &VT_CHUNK_TYPES[4 * kind], level);
  vt_status status =
      vt_unpack_bytes(r->context, c->bytes, (size_t)c->stored_size, *owned, (size_t)c->raw_size, title);
  if (status) vt_free(r->context, *owned), *owned = NULL;
  *raw = *owned;
  return status;
}

// ==== the counts =====================================================================================================

static vt_status check_head(const vt_tree_reader *r, const vt_tree_head *h) {
  if (!vt_is_root_cube(h->origin, h->edge))
    return vt_refuse_chunk(r, VT_TREE, 0, "has a root cube that is not finite or has no extent");
  if (!(h->tile_side >= 1 && h->tile_side <= 1.8f)) return vt_refuse_chunk(r, VT_TREE, 0, "has an impossible tile side");
  uint64_t views = (uint64_t)h->view_count;
  for (int l = 0; l < h->level_count; l++) {
    uint64_t axis = vt_axis_cells(h->branching, l), cells = h->level[l].cell_count, tiles = h->level[l].tile_count;
    if (cells > axis * axis * axis) return vt_refuse_chunk(r, VT_TREE, 0, "counts more cells than a level can have");
    if (tiles > (h->level[l].has_tiles ? views * cells : 0) || tiles == VT_NO_TILE)
      return vt_refuse_chunk(r, VT_TREE, 0, "counts more tiles than views and cells allow");
    if (h->level[l].has_tiles && views == 0) return vt_refuse_chunk(r, VT_TREE, 0, "has tiles without views");
    if (h->level[l].has_views && (views == 0 || h->level[l].has_tiles))
      return vt_refuse_chunk(r, VT_VIDX, l, "stands beside tiles or without views");
    if (l == 0 && h->level[l].form != VT_MORTON_GAPS) return vt_refuse_chunk(r, VT_TREE, 0, "gives the root a parent");
  }
  if (vt_tree_memory(h) > VT_FREE_MEMORY + VT_MEMORY_PER_BYTE * (uint64_t)r->size)
    return vt_refuse_chunk(r, VT_TREE, 0, "counts more than a file of this length can hold");
  return VT_OK;
}

static vt_status read_head(vt_tree_reader *r) {
  const vt_chunk_in *c = &r->chunks[VT_TREE][0];
  vt_tree_head *h = &r->head;
  if (!c->present) return vt_refuse_chunk(r, VT_TREE, 0, "is missing");
  if (c->raw_size < VT_HEAD_BYTES(1) || c->raw_size > VT_HEAD_BYTES(VT_MAX_LEVEL + 1))
    return vt_refuse_chunk(r, VT_TREE, 0, "has a wrong size");
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_TREE, 0, &raw, &owned);
  if (status) return status;
  uint32_t branching = vt_get_u32(raw + 32), levels = vt_get_u32(raw + 36), texel_edge = vt_get_u32(raw + 40);
  uint16_t minor = vt_get_u16(r->bytes + 10);
  uint32_t views = vt_get_u32(raw + 48), packed = vt_get_u32(raw + 52);
  bool good = (branching == 2 || branching == 3) && levels >= 1 && (texel_edge == 4 || texel_edge == 8) &&
              views <= VT_MAX_TREE_VIEWS && packed <= 1 && levels <= (uint32_t)vt_max_file_level((int)branching) + 1 &&
              c->raw_size == VT_HEAD_BYTES(levels);
  if (good) {
    h->origin = vt_v3(vt_get_f64(raw), vt_get_f64(raw + 8), vt_get_f64(raw + 16)), h->edge = vt_get_f64(raw + 24);
    h->branching = (int)branching, h->level_count = (int)levels, h->texel_edge = (int)texel_edge;
    h->tile_side = vt_get_f32(raw + 44), h->view_count = (int)views, h->packed = packed;
    const uint8_t *p = raw + 56;
    for (int l = 0; l < h->level_count; l++, p += 12) {
      h->level[l].cell_count = vt_get_u32(p), h->level[l].tile_count = vt_get_u32(p + 4);
      h->level[l].form = (vt_cell_form)p[8], h->level[l].has_tiles = p[9], h->level[l].grid = vt_get_u16(p + 10);
      good = good && p[8] <= VT_MORTON_GAPS && p[9] <= 1 && (!h->level[l].grid || (p[9] && minor >= 2));
    }
  }
  vt_free(r->context, owned);
  if (!good) return vt_refuse_chunk(r, VT_TREE, 0, "has a number outside its range");
  status = vt_describe_field_chunks(r);
  return status ? status : check_head(r, h);
}

// What the counts say about a chunk: its size, the other size it may have, or that it must not be there.
static bool expected_size(const vt_tree_head *h, vt_chunk_kind kind, int level, uint64_t raw_size) {
  uint64_t texels = (uint64_t)(h->texel_edge * h->texel_edge), corners = h->level[level].corner_count;
  uint64_t cells = h->level[level].cell_count, tiles = h->level[level].tile_count;
  switch (kind) {
  case VT_META: return raw_size <= VT_MAX_METADATA;
  case VT_TREE: return true;
  case VT_CAMS: return raw_size == (uint64_t)h->view_count * VT_CAMERA_BYTES;
  case VT_CBKA: return raw_size >= texels && raw_size <= texels * VT_MAX_CODEWORDS && raw_size % texels == 0;
  case VT_CBKC: return raw_size >= texels * 3 && raw_size <= texels * 3 * VT_MAX_CODEWORDS && raw_size % (texels * 3) == 0;
  case VT_CELL:
    return raw_size == (h->level[level].form == VT_MORTON_GAPS
                            ? cells * 4
                            : h->level[level - 1].cell_count * (uint64_t)vt_mask_bytes(h->branching));
  case VT_OPAC: return h->packed ? raw_size == 4 + cells || raw_size == 4 + 2 * cells : raw_size == 4 * cells;
  case VT_COLR: return raw_size == (!h->field_codewords ? 3 : h->field_codewords > 256 ? 2 : 1) * cells;
  case VT_COPA: return h->packed ? raw_size == 4 + corners || raw_size == 4 + 2 * corners : raw_size == 4 * corners;
  case VT_VIDX: return raw_size == 4 + (uint64_t)h->view_count * 24;
  case VT_CCOL: case VT_VCOD: case VT_CBKF: return true; // their own counts follow from them
  case VT_TIDX: return raw_size == ((uint64_t)h->view_count * cells + 7) / 8;
  case VT_TEXL: return raw_size == tiles * texels * 4;
  case VT_TCOD: return raw_size == tiles * 4;
  default: return false;
  }
}

// `has_tile_books`: the tree needs codebooks of tiles, or has them all the same.
static bool is_wanted(const vt_tree_head *h, vt_chunk_kind kind, int level, bool has_tile_books) {
  if (level >= h->level_count) return false;
  bool has_corners = h->level[level].corner_count > 0, has_views = h->level[level].has_views;
  switch (kind) {
  case VT_CBKA: case VT_CBKC: return h->packed && (has_tile_books || !h->field_codewords);
  case VT_CBKF: return h->packed && h->field_codewords;
  case VT_OPAC: case VT_COLR: return !has_corners;
  case VT_COPA: case VT_CCOL: return has_corners;
  case VT_VIDX: case VT_VCOD: return has_views;
  case VT_TIDX: return h->level[level].has_tiles;
  case VT_TEXL: return h->level[level].has_tiles && !h->packed;
  case VT_TCOD: return h->level[level].has_tiles && h->packed;
  default: return true;
  }
}

static bool has_tile_books(const vt_tree_reader *r) {
  bool some = r->chunks[VT_CBKA][0].present || r->chunks[VT_CBKC][0].present;
  for (int l = 0; l < r->head.level_count; l++) some = some || r->head.level[l].has_tiles;
  return some;
}

static vt_status check_chunks(const vt_tree_reader *r) {
  bool tile_books = has_tile_books(r);
  for (int kind = 0; kind < VT_CHUNK_KINDS; kind++)
    for (int level = 0; level <= (kind < VT_CELL ? 0 : VT_MAX_LEVEL); level++) {
      const vt_chunk_in *c = &r->chunks[kind][level];
      bool wanted = is_wanted(&r->head, (vt_chunk_kind)kind, level, tile_books);
      if (c->present && !wanted) return vt_refuse_chunk(r, (vt_chunk_kind)kind, level, "should not be there");
      if (!c->present && wanted) return vt_refuse_chunk(r, (vt_chunk_kind)kind, level, "is missing");
      if (wanted && !expected_size(&r->head, (vt_chunk_kind)kind, level, c->raw_size))
        return vt_refuse_chunk(r, (vt_chunk_kind)kind, level, "has a size that does not fit the counts of the tree");
    }
  return VT_OK;
}

// ==== cells ==========================================================================================================

static bool cells_from_masks(const vt_tree_reader *r, int l, const uint8_t *masks, vt_level *out) {
  unsigned branching = (unsigned)r->head.branching, children = branching == 2 ? 8 : 27;
  size_t mask_bytes = vt_mask_bytes(r->head.branching);
  const vt_level *parents = &r->tree->octree.levels[l - 1];
  uint32_t found = 0, count = r->head.level[l].cell_count;
  for (uint32_t p = 0; p < parents->cell_count; p++) {
    uint32_t mask = mask_bytes == 1 ? masks[p] : vt_get_u32(masks + 4 * (size_t)p);
    if (mask >> (children - 1) > 1) return false;
    for (unsigned digit = 0; digit < children; digit++) {
      if (!(mask >> digit & 1)) continue;
      if (found == count) return false;
      out->x[found] = (uint16_t)(parents->x[p] * branching + digit % branching);
      out->y[found] = (uint16_t)(parents->y[p] * branching + digit / branching % branching);
      out->z[found] = (uint16_t)(parents->z[p] * branching + digit / (branching * branching));
      found++;
    }
  }
  return found == count;
}

static bool cells_from_gaps(const vt_tree_reader *r, int l, const uint8_t *planes, vt_level *out) {
  unsigned branching = (unsigned)r->head.branching;
  uint64_t axis = vt_axis_cells(r->head.branching, l), next = 0;
  size_t count = r->head.level[l].cell_count;
  for (size_t i = 0; i < count; i++) {
    const uint8_t gap[4] = {planes[i], planes[count + i], planes[2 * count + i], planes[3 * count + i]};
    uint64_t morton = next + vt_get_u32(gap), rest = morton;
    if (morton >= axis * axis * axis) return false;
    unsigned at[3] = {0, 0, 0};
    for (unsigned scale = 1; rest > 0; scale *= branching)
      for (int k = 0; k < 3; k++) at[k] += (unsigned)(rest % branching) * scale, rest /= branching;
    out->x[i] = (uint16_t)at[0], out->y[i] = (uint16_t)at[1], out->z[i] = (uint16_t)at[2];
    next = morton + 1;
  }
  return true;
}

static vt_status read_cells(const vt_tree_reader *r, int l) {
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_CELL, l, &raw, &owned);
  if (status) return status;
  vt_level *out = &r->tree->octree.levels[l];
  status = vt_allocate_level(r->context, r->head.branching, l, r->head.level[l].cell_count, out);
  if (!status && !(r->head.level[l].form == VT_CHILD_MASKS ? cells_from_masks(r, l, raw, out)
                                                           : cells_from_gaps(r, l, raw, out)))
    status = vt_refuse_chunk(r, VT_CELL, l, "has cells that cannot be or another number of them");
  if (!status) status = vt_build_bricks(r->context, r->head.branching, out);
  vt_free(r->context, owned);
  return status;
}

static vt_status read_depths(const vt_tree_reader *r, int l) {
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_OPAC, l, &raw, &owned);
  if (status) return status;
  size_t count = r->head.level[l].cell_count;
  float *depth = r->tree->octree.levels[l].optical_depth;
  bool good = true;
  if (r->head.packed) {
    good = vt_decode_depths(raw, count, r->chunks[VT_OPAC][l].raw_size > 4 + count, depth, 1);
  } else {
    for (size_t i = 0; i < count; i++) {
      const uint8_t bytes[4] = {raw[i], raw[count + i], raw[2 * count + i], raw[3 * count + i]};
      depth[i] = vt_get_f32(bytes);
      good = good && depth[i] >= 0 && depth[i] <= FLT_MAX;
    }
  }
  vt_free(r->context, owned);
  return good ? VT_OK : vt_refuse_chunk(r, VT_OPAC, l, "has an optical depth that is negative or not finite");
}

static vt_status read_colours(const vt_tree_reader *r, int l) {
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_COLR, l, &raw, &owned);
  if (status) return status;
  size_t count = r->head.level[l].cell_count;
  float *colour = r->tree->octree.levels[l].colour;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 3; k++) colour[i * 3 + k] = (float)raw[k * count + i] / 255;
  vt_free(r->context, owned);
  return VT_OK;
}

// ==== tiles ==========================================================================================================

static vt_status read_tile_index(const vt_tree_reader *r, int l) {
  vt_tiles *tiles = &r->tree->tiles[l];
  tiles->view_count = r->head.view_count, tiles->cell_count = r->head.level[l].cell_count;
  tiles->tile_count = r->head.level[l].tile_count, tiles->grid = r->head.level[l].grid;
  size_t pairs = (size_t)tiles->view_count * tiles->cell_count;
  tiles->tile_of = VT_NEW(r->context, uint32_t, pairs);
  if (!tiles->tile_of) return VT_OUT_OF_MEMORY;
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_TIDX, l, &raw, &owned);
  if (status) return status;
  uint64_t found = 0;
  for (size_t i = 0; i < pairs; i++) tiles->tile_of[i] = raw[i / 8] >> i % 8 & 1 ? (uint32_t)found++ : VT_NO_TILE;
  bool padded = pairs % 8 == 0 || raw[pairs / 8] >> pairs % 8 == 0;
  vt_free(r->context, owned);
  return padded && found == tiles->tile_count ? VT_OK : vt_refuse_chunk(r, VT_TIDX, l, "has another number of tiles");
}

static vt_status read_texels(const vt_tree_reader *r, int l) {
  size_t size = (size_t)r->chunks[VT_TEXL][l].raw_size;
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_TEXL, l, &raw, &owned);
  if (status) return status;
  if (!owned) { // stored: the tree needs bytes of its own
    owned = VT_NEW(r->context, uint8_t, size);
    if (!owned) return VT_OUT_OF_MEMORY;
    if (size) memcpy(owned, raw, size);
  }
  r->tree->tiles[l].texels = owned;
  return VT_OK;
}

static vt_status read_codes(const vt_tree_reader *r, int l) {
  vt_tiles *tiles = &r->tree->tiles[l];
  size_t count = tiles->tile_count;
  tiles->alpha_code = VT_NEW(r->context, uint16_t, count);
  tiles->colour_code = VT_NEW(r->context, uint16_t, count);
  if (!tiles->alpha_code || !tiles->colour_code) return VT_OUT_OF_MEMORY;
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_TCOD, l, &raw, &owned);
  if (status) return status;
  unsigned alpha_max = 0, colour_max = 0;
  for (size_t i = 0; i < count; i++) {
    unsigned alpha = raw[i] | (unsigned)raw[count + i] << 8;
    unsigned colour = raw[2 * count + i] | (unsigned)raw[3 * count + i] << 8;
    tiles->alpha_code[i] = (uint16_t)alpha, tiles->colour_code[i] = (uint16_t)colour;
    if (alpha > alpha_max) alpha_max = alpha;
    if (colour > colour_max) colour_max = colour;
  }
  vt_free(r->context, owned);
  if (count > 0 && (alpha_max >= (unsigned)r->tree->alpha_codebook.codeword_count ||
                    colour_max >= (unsigned)r->tree->colour_codebook.codeword_count))
    return vt_refuse_chunk(r, VT_TCOD, l, "names a codeword that its codebook does not have");
  return VT_OK;
}

// ==== the whole tree =================================================================================================

static vt_status read_metadata(const vt_tree_reader *r) {
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_META, 0, &raw, &owned);
  if (status) return status;
  size_t size = (size_t)r->chunks[VT_META][0].raw_size;
  if (!vt_looks_like_object((const char *)raw, size)) {
    status = vt_refuse_chunk(r, VT_META, 0, "is no JSON object");
  } else {
    r->tree->metadata = VT_NEW(r->context, char, size + 1);
    if (!r->tree->metadata) status = VT_OUT_OF_MEMORY;
    else memcpy(r->tree->metadata, raw, size);
  }
  vt_free(r->context, owned);
  return status;
}

static vt_status read_cameras(const vt_tree_reader *r) {
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, VT_CAMS, 0, &raw, &owned);
  if (status) return status;
  r->tree->cameras = VT_NEW(r->context, vt_camera, (size_t)r->head.view_count);
  if (!r->tree->cameras) status = VT_OUT_OF_MEMORY;
  for (int v = 0; !status && v < r->head.view_count; v++) {
    const uint8_t *p = raw + (size_t)v * VT_CAMERA_BYTES;
    vt_camera *camera = &r->tree->cameras[v];
    camera->width = (int)vt_get_u32(p), camera->height = (int)vt_get_u32(p + 4);
    camera->fx = vt_get_f64(p + 8), camera->fy = vt_get_f64(p + 16);
    camera->cx = vt_get_f64(p + 24), camera->cy = vt_get_f64(p + 32);
    for (int i = 0; i < 9; i++) camera->rotation.m[i] = vt_get_f64(p + 40 + 8 * i);
    camera->translation = vt_v3(vt_get_f64(p + 112), vt_get_f64(p + 120), vt_get_f64(p + 128));
    char title[300];
    snprintf(title, sizeof title, "%.255s: chunk CAMS, camera %d", r->name, v);
    status = vt_check_camera(r->context, camera, title);
  }
  vt_free(r->context, owned);
  return status;
}

static vt_status read_codebook(const vt_tree_reader *r, vt_chunk_kind kind, int channels, vt_codebook *book) {
  const uint8_t *raw;
  uint8_t *owned;
  vt_status status = vt_open_chunk(r, kind, 0, &raw, &owned);
  if (status) return status;
  size_t size = (size_t)r->chunks[kind][0].raw_size;
  *book = (vt_codebook){.channels = channels,
                        .codeword_count = (int)(size / (size_t)(r->head.texel_edge * r->head.texel_edge * channels))};
  book->codewords = VT_NEW(r->context, uint8_t, size);
  if (!book->codewords) status = VT_OUT_OF_MEMORY;
  else memcpy(book->codewords, raw, size);
  vt_free(r->context, owned);
  return status;
}

static vt_status read_level(const vt_tree_reader *r, int l) {
  const vt_tree_head *h = &r->head;
  vt_status status = read_cells(r, l);
  if (!status && h->level[l].corner_count) {
    status = vt_read_corners(r, l);
  } else {
    if (!status) status = read_depths(r, l);
    if (!status) status = h->field_codewords ? vt_read_coded_colours(r, l) : read_colours(r, l);
  }
  if (!status && h->level[l].has_tiles) {
    status = read_tile_index(r, l);
    if (!status) status = h->packed ? read_codes(r, l) : read_texels(r, l);
  }
  if (!status && h->level[l].has_views) status = vt_read_view_textures(r, l);
  return status;
}

static vt_status read_all_chunks(const vt_tree_reader *r) {
  const vt_tree_head *h = &r->head;
  vt_tree *tree = r->tree;
  tree->octree = (vt_octree){.origin = h->origin, .edge = h->edge, .branching = h->branching,
                             .level_count = h->level_count};
  tree->texel_edge = h->texel_edge, tree->tile_side = h->tile_side, tree->view_count = h->view_count;
  vt_status status = read_metadata(r);
  if (!status) status = read_cameras(r);
  bool tile_books = r->chunks[VT_CBKA][0].present;
  if (!status && tile_books) status = read_codebook(r, VT_CBKA, 1, &tree->alpha_codebook);
  if (!status && tile_books) status = read_codebook(r, VT_CBKC, 3, &tree->colour_codebook);
  if (!status && h->field_codewords) status = vt_read_field_codebook(r);
  for (int l = 0; !status && l < h->level_count; l++) status = read_level(r, l);
  return status;
}

static void report_sizes(const vt_tree_reader *r, vt_file_report *report) {
  *report = (vt_file_report){.file_bytes = r->size};
  for (int kind = 0; kind < VT_CHUNK_KINDS; kind++) {
    uint64_t *sum = vt_report_slot(report, (vt_chunk_kind)kind);
    for (int l = 0; sum && l <= VT_MAX_LEVEL; l++) *sum += r->chunks[kind][l].stored_size;
    for (int l = 0; l <= VT_MAX_LEVEL; l++)
      vt_add_level_bytes(report, (vt_chunk_kind)kind, l, r->chunks[kind][l].stored_size);
  }
}

vt_status vt_parse_tree(vt_context *context, const uint8_t *bytes, size_t size, const char *name, vt_tree *out,
                        vt_file_report *report) {
  *out = (vt_tree){0};
  vt_tree_reader r = {.context = context, .name = name, .bytes = bytes, .size = size, .tree = out};
  vt_status status = read_table(&r);
  if (!status) status = read_head(&r);
  if (!status) status = check_chunks(&r);
  if (!status) status = read_all_chunks(&r);
  if (!status && report) report_sizes(&r, report);
  if (status) vt_free_tree(context, out);
  return status;
}

vt_status vt_read_tree(vt_context *context, const char *path, vt_tree *out, vt_file_report *report) {
  uint8_t *bytes = NULL;
  size_t size = 0;
  *out = (vt_tree){0};
  vt_status status = vt_read_file(context, path, &bytes, &size);
  if (!status) status = vt_parse_tree(context, bytes, size, path, out, report);
  vt_free(context, bytes);
  return status;
}
