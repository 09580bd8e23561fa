// tree_file_write.c - a tree to the bytes of a .vtree file
// SPDX-License-Identifier: BSD-3-Clause
//
// docs/format.md specifies the bytes. The order of work is theirs: counts first (the TREE chunk), then the chunks in
// their canonical order, each packed by itself and only if that makes it smaller, then header and table in front of them.
// Everything that can be said in two ways is said in one: tiles are numbered view by view in cell order, so that tile_of
// shrinks to one bit per (view, cell); depths become the nearest code above the smallest depth of their level, which is
// itself a code. So writing what was read gives the same bytes again. Numbers of several bytes are split into planes (all
// lowest bytes first), because zstd finds the nearly constant high bytes only when they stand together.
#include "octree/tree_file_write.h"
#include "octree/depth_ladder.h"
#include "octree/tree_file_field.h"
#include "base/byte_codec.h"
#include "base/file.h"
#include "base/hash.h"

#define ZSTD_LEVEL 9        // 1 % smaller than level 3 at half its speed: 0.2 s for 700 000 tiles
#define ZSTD_LEVEL_FIELD 17 // of packed fields and view textures: 9 % smaller than level 9, 0.3 s for a million pixels

static void free_chunks(vt_tree_writer *w) {
  for (int i = 0; i < w->count; i++) vt_free(w->context, w->chunks[i].stored);
  w->count = 0;
}

static bool is_field_kind(vt_chunk_kind kind) { // those of version 1.1
  return kind == VT_CBKF || kind == VT_COPA || kind == VT_CCOL || kind == VT_VIDX || kind == VT_VCOD;
}

vt_status vt_add_chunk(vt_tree_writer *w, vt_chunk_kind kind, int level, const void *raw, size_t size) {
  if (vt_cancelled(w->context)) return vt_fail(w->context, VT_CANCELLED, "writing the tree: interrupted");
  VT_ASSERT(w->count < VT_MAX_CHUNKS);
  vt_chunk_out c = {.kind = kind, .level = level, .coding = VT_STORED, .raw_size = size, .stored_size = size};
  if (w->may_pack && size > 0) {
    size_t packed_size;
    int zstd_level = w->head.packed && is_field_kind(kind) ? ZSTD_LEVEL_FIELD : ZSTD_LEVEL;
    vt_status status = vt_pack_bytes(w->context, raw, size, zstd_level, &c.stored, &packed_size);
    if (status) return status;
    if (packed_size < size) {
      c.coding = VT_ZSTD, c.stored_size = packed_size;
    } else {
      vt_free(w->context, c.stored), c.stored = NULL;
    }
  }
  if (!c.stored) {
    c.stored = VT_NEW(w->context, uint8_t, size);
    if (!c.stored) return VT_OUT_OF_MEMORY;
    if (size) memcpy(c.stored, raw, size);
  }
  w->chunks[w->count++] = c;
  return VT_OK;
}

vt_status vt_add_owned_chunk(vt_tree_writer *w, vt_chunk_kind kind, int level, uint8_t *raw, size_t size) {
  if (!raw) return VT_OUT_OF_MEMORY;
  vt_status status = vt_add_chunk(w, kind, level, raw, size);
  vt_free(w->context, raw);
  return status;
}

// ==== cells ==========================================================================================================

static uint64_t morton_of(int branching, const vt_level *level, uint32_t i) {
  return vt_morton(branching, level->x[i], level->y[i], level->z[i]);
}

// One mask per parent, if every cell has one; false if not. masks NULL: only asks.
static bool fill_child_masks(int branching, const vt_level *parents, const vt_level *cells, uint8_t *masks) {
  uint64_t children = branching == 2 ? 8 : 27;
  size_t mask_bytes = vt_mask_bytes(branching);
  uint32_t parent = 0;
  for (uint32_t i = 0; i < cells->cell_count; i++) {
    uint64_t morton = morton_of(branching, cells, i), wanted = morton / children, digit = morton % children;
    while (parent < parents->cell_count && morton_of(branching, parents, parent) < wanted) parent++;
    if (parent == parents->cell_count || morton_of(branching, parents, parent) != wanted) return false;
    if (masks) masks[parent * mask_bytes + digit / 8] |= (uint8_t)(1u << digit % 8);
  }
  return true;
}

static vt_status add_cells(vt_tree_writer *w, int l) {
  int branching = w->head.branching;
  const vt_level *cells = &w->tree->octree.levels[l];
  if (w->head.level[l].form == VT_CHILD_MASKS) {
    size_t size = w->head.level[l - 1].cell_count * vt_mask_bytes(branching);
    uint8_t *masks = vt_alloc(w->context, size, 1);
    if (masks) (void)fill_child_masks(branching, cells - 1, cells, masks);
    return vt_add_owned_chunk(w, VT_CELL, l, masks, size);
  }
  size_t count = cells->cell_count;
  uint8_t *planes = vt_alloc(w->context, count, 4);
  uint64_t next = 0; // smallest number that the coming cell may have
  for (uint32_t i = 0; planes && i < count; i++) {
    uint64_t morton = morton_of(branching, cells, i);
    VT_ASSERT(morton >= next); // Morton order
    uint8_t gap[4];
    vt_put_u32(gap, (uint32_t)(morton - next));
    for (size_t b = 0; b < 4; b++) planes[b * count + i] = gap[b];
    next = morton + 1;
  }
  return vt_add_owned_chunk(w, VT_CELL, l, planes, count * 4);
}

static vt_status add_exact_depths(vt_tree_writer *w, int l) {
  const vt_level *cells = &w->tree->octree.levels[l];
  size_t count = cells->cell_count;
  uint8_t *planes = vt_alloc(w->context, count, 4);
  for (size_t i = 0; planes && i < count; i++) {
    uint8_t bytes[4];
    vt_put_f32(bytes, cells->optical_depth[i]);
    for (size_t b = 0; b < 4; b++) planes[b * count + i] = bytes[b];
  }
  return vt_add_owned_chunk(w, VT_OPAC, l, planes, count * 4);
}

static vt_status add_coded_depths(vt_tree_writer *w, int l) {
  const vt_level *cells = &w->tree->octree.levels[l];
  size_t size = 0;
  uint8_t *raw = vt_code_depths(w->context, cells->optical_depth, 1, cells->cell_count, &size);
  return vt_add_owned_chunk(w, VT_OPAC, l, raw, size);
}

static vt_status add_colours(vt_tree_writer *w, int l) {
  const vt_level *cells = &w->tree->octree.levels[l];
  size_t count = cells->cell_count;
  uint8_t *planes = vt_alloc(w->context, count, 3);
  for (size_t i = 0; planes && i < count; i++)
    for (size_t k = 0; k < 3; k++) planes[k * count + i] = vt_colour_byte(cells->colour[i * 3 + k]);
  return vt_add_owned_chunk(w, VT_COLR, l, planes, count * 3);
}

// ==== tiles ==========================================================================================================

static vt_status add_texels(vt_tree_writer *w, int l, const uint32_t *order) {
  const vt_tiles *tiles = &w->tree->tiles[l];
  size_t tile_bytes = (size_t)(w->head.texel_edge * w->head.texel_edge) * 4, count = w->head.level[l].tile_count;
  VT_ASSERT(count == 0 || tiles->texels);
  uint8_t *texels = vt_alloc(w->context, count, tile_bytes);
  for (size_t i = 0; texels && i < count; i++)
    memcpy(texels + i * tile_bytes, tiles->texels + order[i] * tile_bytes, tile_bytes);
  return vt_add_owned_chunk(w, VT_TEXL, l, texels, count * tile_bytes);
}

static vt_status add_codes(vt_tree_writer *w, int l, const uint32_t *order) {
  const vt_tiles *tiles = &w->tree->tiles[l];
  size_t count = w->head.level[l].tile_count;
  VT_ASSERT(count == 0 || (tiles->alpha_code && tiles->colour_code));
  uint8_t *planes = vt_alloc(w->context, count, 4);
  for (size_t i = 0; planes && i < count; i++) {
    uint16_t alpha = tiles->alpha_code[order[i]], colour = tiles->colour_code[order[i]];
    VT_ASSERT(alpha < w->tree->alpha_codebook.codeword_count && colour < w->tree->colour_codebook.codeword_count);
    planes[i] = (uint8_t)alpha, planes[count + i] = (uint8_t)(alpha >> 8);
    planes[2 * count + i] = (uint8_t)colour, planes[3 * count + i] = (uint8_t)(colour >> 8);
  }
  return vt_add_owned_chunk(w, VT_TCOD, l, planes, count * 4);
}

// Which (view, cell) have a tile, then the tiles in that order.
static vt_status add_tiles(vt_tree_writer *w, int l) {
  const vt_tiles *tiles = &w->tree->tiles[l];
  size_t pairs = (size_t)tiles->view_count * tiles->cell_count, found = 0;
  uint8_t *bits = vt_alloc(w->context, (pairs + 7) / 8, 1);
  uint32_t *order = VT_NEW(w->context, uint32_t, w->head.level[l].tile_count);
  vt_status status = bits && order ? VT_OK : VT_OUT_OF_MEMORY;
  for (size_t i = 0; !status && i < pairs; i++) {
    if (tiles->tile_of[i] == VT_NO_TILE) continue;
    bits[i / 8] |= (uint8_t)(1u << i % 8);
    order[found++] = tiles->tile_of[i];
  }
  if (!status) status = vt_add_chunk(w, VT_TIDX, l, bits, (pairs + 7) / 8);
  if (!status) status = w->head.packed ? add_codes(w, l, order) : add_texels(w, l, order);
  vt_free(w->context, bits);
  vt_free(w->context, order);
  return status;
}

// ==== the whole tree =================================================================================================

static void check_level(const vt_tree *tree, int l) { // what octree.h promises of a level
  const vt_level *cells = &tree->octree.levels[l];
  const vt_tiles *tiles = &tree->tiles[l];
  VT_ASSERT(tiles->view_count == 0 || vt_is_packed(tree) == (tree->alpha_codebook.codeword_count > 0));
  VT_ASSERT((uint64_t)cells->axis_cells == vt_axis_cells(tree->octree.branching, l));
  for (uint32_t i = 0; i < cells->cell_count; i++)
    VT_ASSERT(cells->optical_depth[i] >= 0 && isfinite(cells->optical_depth[i]));
  VT_ASSERT(tiles->view_count == 0 ||
            (tiles->view_count == tree->view_count && tiles->cell_count == cells->cell_count));
}

static vt_status describe(vt_tree_writer *w, const char *path) {
  const vt_tree *tree = w->tree;
  const vt_octree *octree = &tree->octree;
  VT_ASSERT(octree->branching == 2 || octree->branching == 3);
  VT_ASSERT(octree->level_count >= 1 && octree->level_count <= VT_MAX_LEVEL + 1);
  VT_ASSERT(tree->texel_edge == 4 || tree->texel_edge == 8);
  VT_ASSERT(tree->tile_side >= 1 && tree->tile_side <= 1.8f);
  VT_ASSERT(tree->view_count >= 0 && vt_is_root_cube(octree->origin, octree->edge));
  if (octree->level_count - 1 > vt_max_file_level(octree->branching))
    return vt_fail(w->context, VT_FAILED, "%s: a .vtree file with branching 3 ends at level %d; use fewer levels", path,
                   vt_max_file_level(3));
  if (tree->metadata && strlen(tree->metadata) > VT_MAX_METADATA)
    return vt_fail(w->context, VT_FAILED, "%s: metadata above 64 MiB; leave some out", path);
  if (tree->view_count > VT_MAX_TREE_VIEWS)
    return vt_fail(w->context, VT_FAILED, "%s: a .vtree file holds at most %d views; use fewer photographs", path,
                   VT_MAX_TREE_VIEWS);
  w->head = (vt_tree_head){.origin = octree->origin, .edge = octree->edge, .branching = octree->branching,
                           .level_count = octree->level_count, .texel_edge = tree->texel_edge,
                           .tile_side = tree->tile_side, .view_count = tree->view_count, .packed = vt_is_packed(tree)};
  for (int l = 0; l < octree->level_count; l++) {
    const vt_level *cells = &octree->levels[l];
    const vt_tiles *tiles = &tree->tiles[l];
    check_level(tree, l);
    vt_describe_field(w, l);
    size_t found = 0, pairs = (size_t)tiles->view_count * tiles->cell_count;
    for (size_t i = 0; i < pairs; i++) {
      VT_ASSERT(tiles->tile_of[i] == VT_NO_TILE || tiles->tile_of[i] < tiles->tile_count);
      found += tiles->tile_of[i] != VT_NO_TILE;
    }
    VT_ASSERT(found < VT_NO_TILE);
    w->head.level[l].cell_count = cells->cell_count;
    w->head.level[l].tile_count = (uint32_t)found;
    VT_ASSERT(tiles->grid >= 0 && tiles->grid <= UINT16_MAX);
    w->head.level[l].has_tiles = tiles->view_count > 0;
    w->head.level[l].grid = tiles->view_count > 0 ? (uint16_t)tiles->grid : 0;
    w->head.level[l].form =
        l > 0 && fill_child_masks(octree->branching, cells - 1, cells, NULL) ? VT_CHILD_MASKS : VT_MORTON_GAPS;
  }
  return VT_OK;
}

static vt_status add_head(vt_tree_writer *w) {
  const vt_tree_head *h = &w->head;
  uint8_t raw[VT_HEAD_BYTES(VT_MAX_LEVEL + 1)] = {0}, *p = raw + 56;
  vt_put_f64(raw, h->origin.x), vt_put_f64(raw + 8, h->origin.y), vt_put_f64(raw + 16, h->origin.z);
  vt_put_f64(raw + 24, h->edge);
  vt_put_u32(raw + 32, (uint32_t)h->branching), vt_put_u32(raw + 36, (uint32_t)h->level_count);
  vt_put_u32(raw + 40, (uint32_t)h->texel_edge), vt_put_f32(raw + 44, h->tile_side);
  vt_put_u32(raw + 48, (uint32_t)h->view_count), vt_put_u32(raw + 52, h->packed);
  for (int l = 0; l < h->level_count; l++, p += 12) {
    vt_put_u32(p, h->level[l].cell_count), vt_put_u32(p + 4, h->level[l].tile_count);
    p[8] = (uint8_t)h->level[l].form, p[9] = h->level[l].has_tiles;
    vt_put_u16(p + 10, h->level[l].grid);
  }
  return vt_add_chunk(w, VT_TREE, 0, raw, VT_HEAD_BYTES(h->level_count));
}

static vt_status add_cameras(vt_tree_writer *w, const char *path) {
  size_t count = (size_t)w->tree->view_count, size = count * VT_CAMERA_BYTES;
  uint8_t *raw = vt_alloc(w->context, size, 1);
  for (size_t v = 0; raw && v < count; v++) {
    const vt_camera *camera = &w->tree->cameras[v];
    char title[300];
    snprintf(title, sizeof title, "%.255s: camera %zu", path, v);
    vt_status status = vt_check_camera(w->context, camera, title);
    if (status) {
      vt_free(w->context, raw);
      return status;
    }
    uint8_t *p = raw + v * VT_CAMERA_BYTES;
    const double values[4] = {camera->fx, camera->fy, camera->cx, camera->cy};
    const double shift[3] = {camera->translation.x, camera->translation.y, camera->translation.z};
    vt_put_u32(p, (uint32_t)camera->width), vt_put_u32(p + 4, (uint32_t)camera->height);
    for (int i = 0; i < 4; i++) vt_put_f64(p + 8 + 8 * i, values[i]);
    for (int i = 0; i < 9; i++) vt_put_f64(p + 40 + 8 * i, camera->rotation.m[i]);
    for (int i = 0; i < 3; i++) vt_put_f64(p + 112 + 8 * i, shift[i]);
  }
  return vt_add_owned_chunk(w, VT_CAMS, 0, raw, size);
}

static vt_status add_codebook(vt_tree_writer *w, vt_chunk_kind kind, const vt_codebook *book, int channels) {
  VT_ASSERT(book->codeword_count >= 1 && book->codeword_count <= VT_MAX_CODEWORDS && book->channels == channels);
  size_t codeword_bytes = (size_t)(w->head.texel_edge * w->head.texel_edge * channels);
  return vt_add_chunk(w, kind, 0, book->codewords, (size_t)book->codeword_count * codeword_bytes);
}

static vt_status add_level(vt_tree_writer *w, int l) {
  vt_status status = add_cells(w, l);
  if (!status && w->head.level[l].corner_count) {
    status = vt_add_corners(w, l);
  } else {
    if (!status) status = w->head.packed ? add_coded_depths(w, l) : add_exact_depths(w, l);
    if (!status) status = w->head.field_codewords ? vt_add_coded_colours(w, l) : add_colours(w, l);
  }
  if (!status && w->head.level[l].has_tiles) status = add_tiles(w, l);
  if (!status && w->head.level[l].has_views) status = vt_add_view_textures(w, l);
  return status;
}

static vt_status add_all_chunks(vt_tree_writer *w, const char *path) {
  const vt_tree *tree = w->tree;
  const char *metadata = tree->metadata ? tree->metadata : "{}";
  VT_ASSERT(vt_looks_like_object(metadata, strlen(metadata)));
  vt_status status = vt_add_chunk(w, VT_META, 0, metadata, strlen(metadata));
  if (!status) status = add_head(w);
  if (!status) status = add_cameras(w, path);
  bool tile_books = tree->alpha_codebook.codeword_count > 0;
  if (!status && tile_books) status = add_codebook(w, VT_CBKA, &tree->alpha_codebook, 1);
  if (!status && tile_books) status = add_codebook(w, VT_CBKC, &tree->colour_codebook, 3);
  if (!status && w->head.field_codewords) status = vt_add_field_codebook(w);
  for (int l = 0; !status && l < w->head.level_count; l++) status = add_level(w, l);
  return status;
}

static uint64_t file_size(const vt_tree_writer *w) {
  uint64_t size = VT_HEADER_BYTES + VT_ENTRY_BYTES * (uint64_t)w->count + 8;
  for (int i = 0; i < w->count; i++) size += w->chunks[i].stored_size;
  return size;
}

// A file says the least version that knows all of its chunks, so that an older program reads what it can.
static uint16_t least_minor(const vt_tree_writer *w) {
  for (int l = 0; l < w->head.level_count; l++) {
    const vt_view_textures *textures = &w->tree->view_textures[l];
    if (textures->view_count && textures->views[0].linear) return 3;
  }
  for (int l = 0; l < w->head.level_count; l++)
    if (w->head.level[l].grid) return 2;
  for (int i = 0; i < w->count; i++)
    if (is_field_kind(w->chunks[i].kind)) return 1;
  return 0;
}

// Header, table, checksum, chunks. Frees the chunks as it goes, so that the bytes are not in memory twice for long.
static uint8_t *join_chunks(vt_tree_writer *w, size_t size) {
  uint8_t *bytes = vt_alloc(w->context, size, 1);
  if (!bytes) return NULL;
  size_t front = VT_HEADER_BYTES + VT_ENTRY_BYTES * (size_t)w->count, at = front + 8;
  memcpy(bytes, VT_FILE_MAGIC, 8);
  vt_put_u16(bytes + 8, VT_FILE_MAJOR), vt_put_u16(bytes + 10, least_minor(w));
  vt_put_u32(bytes + 12, (uint32_t)w->count), vt_put_u64(bytes + 16, size);
  for (int i = 0; i < w->count; i++) {
    vt_chunk_out *c = &w->chunks[i];
    uint8_t *entry = bytes + VT_HEADER_BYTES + VT_ENTRY_BYTES * (size_t)i;
    memcpy(entry, &VT_CHUNK_TYPES[4 * c->kind], 4);
    entry[4] = (uint8_t)c->level, entry[5] = (uint8_t)c->coding;
    vt_put_u64(entry + 8, c->stored_size), vt_put_u64(entry + 16, c->raw_size);
    vt_put_u64(entry + 24, vt_hash(c->stored, (size_t)c->stored_size, 0));
    if (c->stored_size) memcpy(bytes + at, c->stored, (size_t)c->stored_size);
    at += (size_t)c->stored_size;
    vt_free(w->context, c->stored), c->stored = NULL;
  }
  vt_put_u64(bytes + front, vt_hash(bytes, front, 0));
  return bytes;
}

static void report_sizes(const vt_tree_writer *w, vt_file_report *report) {
  *report = (vt_file_report){.file_bytes = file_size(w)};
  for (int i = 0; i < w->count; i++) {
    uint64_t *sum = vt_report_slot(report, w->chunks[i].kind);
    if (sum) *sum += w->chunks[i].stored_size;
    vt_add_level_bytes(report, w->chunks[i].kind, w->chunks[i].level, w->chunks[i].stored_size);
  }
}

vt_status vt_write_tree(vt_context *context, const vt_tree *tree, const char *path, vt_file_report *report) {
  vt_tree_writer w = {.context = context, .tree = tree, .may_pack = vt_can_pack_bytes()};
  uint8_t *bytes = NULL;
  vt_status status = describe(&w, path);
  if (!status) status = add_all_chunks(&w, path);
  if (!status && vt_tree_memory(&w.head) > VT_FREE_MEMORY + VT_MEMORY_PER_BYTE * file_size(&w)) {
    // Nearly constant data packs so well that a reader would take the file for a bomb; then it is stored.
    free_chunks(&w);
    w.may_pack = false;
    status = add_all_chunks(&w, path);
  }
  if (status) goto done;
  size_t size = (size_t)file_size(&w);
  bytes = join_chunks(&w, size);
  status = bytes ? vt_write_file(context, path, bytes, size) : VT_OUT_OF_MEMORY;
  if (!status && report) report_sizes(&w, report);
done:
  free_chunks(&w);
  vt_free(context, bytes);
  return status;
}
