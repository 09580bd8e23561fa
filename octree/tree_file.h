// tree_file.h - what the writer and the reader of .vtree files share (docs/format.md)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_TREE_FILE_H
#define VT_OCTREE_TREE_FILE_H

#include "octree/cells.h"
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

#define VT_FILE_MAGIC "\x8EVTREE\x1A\x0A" // high bit set; Ctrl-Z and a bare LF catch transfers as text, as in PNG
#define VT_FILE_MAJOR 1
#define VT_FILE_MINOR 3 // 1: corners and view textures; 2: tiles on the photographs' grid; 3: ratios interpolated as they are; files without them are written as 0
#define VT_HEADER_BYTES 24u // magic, major, minor, chunk count, file size; the chunk table and a checksum follow
#define VT_ENTRY_BYTES 32u
#define VT_CAMERA_BYTES 136u
#define VT_MAX_METADATA (64u << 20)
#define VT_MAX_TREE_VIEWS 65535
#define VT_MAX_CODEWORDS 65536

// In the order in which they stand in a file: first those of the whole tree, then level by level.
typedef enum vt_chunk_kind {
  VT_META, VT_TREE, VT_CAMS, VT_CBKA, VT_CBKC, VT_CBKF,
  VT_CELL, VT_OPAC, VT_COLR, VT_COPA, VT_CCOL, VT_TIDX, VT_TEXL, VT_TCOD, VT_VIDX, VT_VCOD,
  VT_CHUNK_KINDS // also: a kind this version does not know
} vt_chunk_kind;
#define VT_CHUNK_TYPES "METATREECAMSCBKACBKCCBKFCELLOPACCOLRCOPACCOLTIDXTEXLTCODVIDXVCOD"
#define VT_MAX_CHUNKS (VT_CELL + (VT_CHUNK_KINDS - VT_CELL) * (VT_MAX_LEVEL + 1))

typedef enum vt_chunk_coding { VT_STORED, VT_ZSTD } vt_chunk_coding;
typedef enum vt_cell_form { VT_CHILD_MASKS, VT_MORTON_GAPS } vt_cell_form;

// The TREE chunk: every count, so that the size of every other chunk is known before any of them is unpacked.
typedef struct vt_tree_head {
  vt_vec3 origin;
  double edge;
  int branching, level_count, texel_edge;
  float tile_side;
  int view_count;
  bool packed;
  struct {
    uint32_t cell_count, tile_count;
    vt_cell_form form;
    bool has_tiles;
    uint16_t grid; // vt_tiles.grid
    bool has_views;        // these three are not in the chunk: they follow from the chunk table
    uint32_t corner_count; // 0: cells are constant
    uint64_t code_count;   // of all view textures
  } level[VT_MAX_LEVEL + 1];
  uint32_t field_codewords; // likewise; 0: the tree has no field codebook
} vt_tree_head;
#define VT_HEAD_BYTES(level_count) (56u + 12u * (size_t)(level_count))

// ---- little-endian, whatever the host is
static inline void vt_put_u16(uint8_t *p, uint16_t v) { p[0] = (uint8_t)v, p[1] = (uint8_t)(v >> 8); }
static inline void vt_put_u32(uint8_t *p, uint32_t v) { vt_put_u16(p, (uint16_t)v), vt_put_u16(p + 2, (uint16_t)(v >> 16)); }
static inline void vt_put_u64(uint8_t *p, uint64_t v) { vt_put_u32(p, (uint32_t)v), vt_put_u32(p + 4, (uint32_t)(v >> 32)); }
static inline uint16_t vt_get_u16(const uint8_t *p) { return (uint16_t)(p[0] | p[1] << 8); }
static inline uint32_t vt_get_u32(const uint8_t *p) { return vt_get_u16(p) | (uint32_t)vt_get_u16(p + 2) << 16; }
static inline uint64_t vt_get_u64(const uint8_t *p) { return vt_get_u32(p) | (uint64_t)vt_get_u32(p + 4) << 32; }
static inline void vt_put_f32(uint8_t *p, float v) {
  uint32_t bits;
  memcpy(&bits, &v, 4);
  vt_put_u32(p, bits);
}
static inline void vt_put_f64(uint8_t *p, double v) {
  uint64_t bits;
  memcpy(&bits, &v, 8);
  vt_put_u64(p, bits);
}
static inline float vt_get_f32(const uint8_t *p) {
  uint32_t bits = vt_get_u32(p);
  float v;
  memcpy(&v, &bits, 4);
  return v;
}
static inline double vt_get_f64(const uint8_t *p) {
  uint64_t bits = vt_get_u64(p);
  double v;
  memcpy(&v, &bits, 8);
  return v;
}

// Metadata is JSON; whoever wants something of it parses it. The file only sees to it that it is text between braces.
static inline bool vt_looks_like_object(const char *text, size_t size) {
  while (size > 0 && (text[size - 1] == '\n' || text[size - 1] == ' ')) size--;
  return size >= 2 && text[0] == '{' && text[size - 1] == '}' && !memchr(text, 0, size);
}

// ---- counts
static inline bool vt_is_root_cube(vt_vec3 origin, double edge) {
  return fabs(origin.x) <= 1e300 && fabs(origin.y) <= 1e300 && fabs(origin.z) <= 1e300 && edge >= 1e-300 && edge <= 1e300;
}
static inline int vt_max_file_level(int branching) { return branching == 2 ? VT_MAX_LEVEL : 6; }
static inline uint64_t vt_axis_cells(int branching, int level) {
  uint64_t axis = 1;
  for (int i = 0; i < level; i++) axis *= (uint64_t)branching;
  return axis;
}
static inline size_t vt_mask_bytes(int branching) { return branching == 2 ? 1 : 4; } // of one parent's 8 or 27 children

// Bytes the tree takes in memory. Zstd can say "a billion equal bytes" in a few kB, so a file is only allowed to ask for
// VT_FREE_MEMORY (the brick maps of the finest levels) and VT_MEMORY_PER_BYTE for every byte it has.
#define VT_FREE_MEMORY (512ull << 20)
#define VT_MEMORY_PER_BYTE 1024ull
static inline uint64_t vt_tree_memory(const vt_tree_head *head) {
  uint64_t edge_texels = (uint64_t)head->texel_edge, tile_bytes = 4 * edge_texels * edge_texels, sum = 0;
  if (head->packed) tile_bytes = 4;
  for (int l = 0; l < head->level_count; l++) {
    uint64_t cells = head->level[l].cell_count;
    sum += vt_brick_memory_bound(head->branching, l, cells) + cells * 22 + head->level[l].tile_count * tile_bytes;
    if (head->level[l].has_tiles) sum += cells * (uint64_t)head->view_count * 4;
    if (head->level[l].corner_count) sum += cells * 160; // at most 8 corners a cell: they are counted after they are made
    if (head->level[l].has_views) sum += (uint64_t)head->view_count * 40 + head->level[l].code_count;
  }
  return sum;
}

static inline uint8_t vt_colour_byte(float c) { return (uint8_t)(c > 0 ? (c < 1 ? c * 255 + 0.5f : 255) : 0); } // NaN: 0

static inline uint64_t *vt_report_slot(vt_file_report *report, vt_chunk_kind kind) {
  switch (kind) {
  case VT_CELL: case VT_OPAC: case VT_COLR: return &report->cell_bytes;
  case VT_TIDX: return &report->index_bytes;
  case VT_TCOD: return &report->code_bytes;
  case VT_COPA: case VT_CCOL: return &report->field_bytes;
  case VT_VIDX: case VT_VCOD: return &report->view_bytes;
  case VT_CBKA: case VT_CBKC: case VT_CBKF: return &report->codebook_bytes;
  case VT_TEXL: return &report->texel_bytes;
  default: return NULL;
  }
}
static inline void vt_add_level_bytes(vt_file_report *report, vt_chunk_kind kind, int level, uint64_t bytes) {
  if (kind == VT_COPA || kind == VT_CCOL) report->level_field_bytes[level] += bytes;
  if (kind == VT_VIDX || kind == VT_VCOD) report->level_view_bytes[level] += bytes;
}

#ifdef __cplusplus
}
#endif
#endif
