// octree.h - cells, the walk of a ray through them, billboard tiles, compositing, and the .vtree file
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_OCTREE_H
#define VT_OCTREE_OCTREE_H

#include "base/camera.h"
#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

// ==== cells ==========================================================================================================

#define VT_MAX_LEVEL 10
#define VT_NO_CELL UINT32_MAX

// Where cells are: bricks of brick_edge^3 cells (4 for branching 2, 3 for branching 3), those that hold any. Since cells
// are in Morton order, the cells of a brick are neighbours in every array: cell = first + popcount(mask below its bit).
typedef struct vt_brick {
  uint64_t mask;  // bit = number of the cell within the brick
  uint32_t first; // index of the brick's first cell
  uint32_t spare; // 0
} vt_brick;

// Which brick is where. The top grid has an entry for each brick, or, where that would take more memory than the cells
// do, for each block of top_edge^3 bricks; then a block that holds cells has a page of page_edge^3 entries, and so on
// down to bricks. An entry >= 0 is the number of a brick or of the first entry of a page; an entry < 0 is empty space: in the top
// grid minus the distance to the nearest entry that is not empty (the larger of the axes' distances), in pages -1.
typedef struct vt_brick_map {
  int axis, depth;         // entries along an edge of the top grid; pages between it and a brick
  int top_edge, page_edge; // bricks along an edge of a top entry: page_edge^depth; entries along an edge of a page
  size_t entry_count;      // of the top grid and all pages
  int32_t *entries;        // [entry_count] top grid, then pages; x fastest, then y, then z; owned
} vt_brick_map;

// The occupied cells of one level, in Morton order, as structure of arrays. A cell's edge is root edge / branching^level.
typedef struct vt_level {
  uint32_t cell_count;
  int axis_cells;         // branching^level, cells along an edge of the root
  uint16_t *x, *y, *z;    // [cell_count] 0..axis_cells-1; owned
  float *optical_depth;   // [cell_count] extinction times the cell's edge, >= 0, dimensionless; owned
  float *colour;          // [cell_count][3] sRGB-encoded 0..1, the cell's own colour; owned
  int axis_bricks;        // ceil(axis_cells / brick_edge)
  uint32_t brick_count;   //
  vt_brick *bricks;       // [brick_count] in Morton order; owned
  vt_brick_map map;       // where they are; owned
  // A field: opacity and colour at the cells' corners, interpolated trilinearly within a cell. corner_count 0: cells are
  // constant, and the arrays are NULL. optical_depth and colour above are then the cells' means all the same.
  uint32_t corner_count;
  uint32_t *corner_of;     // [cell_count][8] the cell's corners, x fastest, then y, then z; owned
  float *corner_values;    // [corner_count][4] optical depth across a cell's edge, >= 0, and sRGB-encoded RGB, 0..1; owned
} vt_level;

typedef struct vt_octree {
  vt_vec3 origin;  // world, the corner of the root cube with the smallest coordinates
  double edge;     // world, > 0
  int branching;   // 2; 3 for the tri-grid of [RMMD04]
  int level_count; // leaf level + 1
  vt_level levels[VT_MAX_LEVEL + 1];
} vt_octree;

void vt_free_level(vt_context *, vt_level *);
void vt_free_octree(vt_context *, vt_octree *);
// Morton number of a cell: base-`branching` digits of x, y, z interleaved, x lowest.
uint64_t vt_morton(int branching, uint32_t x, uint32_t y, uint32_t z);
// A level of `count` cells at the given coordinates (any order, no doubles: asserted), sorted into Morton order, opacity
// and colour zero, bricks built. VT_OUT_OF_MEMORY.
vt_status vt_make_level(vt_context *, int branching, int level, size_t count, const uint16_t (*xyz)[3], vt_level *out);
// The children of those parents with keep[i] != 0 (keep NULL: all): branching^3 cells each; colour copied; optical depth
// divided by branching, so that every ray's alpha is unchanged (METHODS 1.2 c).
vt_status vt_split_level(vt_context *, int branching, int level, const vt_level *parent, const uint8_t *keep,
                         vt_level *out_children);
// The cells of `level` with keep[i] != 0, with their values.
vt_status vt_filter_level(vt_context *, int branching, int level_number, const vt_level *level, const uint8_t *keep,
                          vt_level *out);
// Index of the cell at integer coordinates, or VT_NO_CELL (also outside the root).
uint32_t vt_find_cell(const vt_level *, int branching, int x, int y, int z);
// The cells beside a cell, or VT_NO_CELL: across its faces (-x, +x, -y, +y, -z, +z), or all around (x fastest, then y,
// then z; the middle one is itself).
void vt_face_neighbours(const vt_level *, int branching, uint32_t cell, uint32_t out[6]);
void vt_all_neighbours(const vt_level *, int branching, uint32_t cell, uint32_t out[27]);
// The cells of a finer level that lie within a cell of `level`: begin <= index < end.
typedef struct vt_cell_range { uint32_t begin, end; } vt_cell_range;
vt_cell_range vt_cells_below(const vt_octree *, int level, uint32_t cell, int finer_level);
// Gives a level its corners, numbered in the order in which the cells (in Morton order) meet them first; values 0. Corners
// that it had are dropped. VT_OUT_OF_MEMORY.
vt_status vt_make_corners(vt_context *, int branching, vt_level *);
vt_status vt_corners_from_cells(vt_context *, vt_level *); // each corner gets the mean of the cells that touch it
void vt_cells_from_corners(vt_level *); // each cell gets the mean of its corners
// Moves optical depths (every `stride`-th float) to rungs that a packed .vtree holds exactly: those below `least` (at least
// FLT_MIN) become 0, the others low * 2^(k / steps), low the smallest of them; steps an octave: 1, 2, 3, 6, 9 or 18.
void vt_snap_depths(float *depth, size_t stride, size_t count, float least, int steps_per_octave);
double vt_cell_edge(const vt_octree *, int level);                         // world
vt_vec3 vt_cell_centre(const vt_octree *, int level, uint32_t cell);       // world

// ==== the walk of a ray ==============================================================================================

typedef struct vt_segment {
  uint32_t cell;
  float entry;  // distance from the ray's origin where the ray enters the cell, in edges of a cell of this level, >= 0
  float length; // chord within the cell, same unit, > 0
} vt_segment;

// Most segments a ray can have on a level.
size_t vt_max_segments(const vt_level *);
// The occupied cells that a ray meets, front to back, each once; cells are half-open, chords of all cells (occupied or
// not) sum to the ray's length in the root cube. Rays that start inside start there. Chords below 1e-5 edges are
// dropped. Writes at most vt_max_segments; returns their number. Integer stepping after Amanatides & Woo 1987.
size_t vt_walk_ray(const vt_octree *, int level, const vt_ray *, vt_segment *out);

// One cell on a ray.
typedef struct vt_chord {
  uint32_t cell;
  float length; // in edges of the cell
} vt_chord;

// The instructions with which a packet of rays is walked. All give the same bits.
typedef enum vt_walk_path { VT_WALK_PLAIN, VT_WALK_AVX2, VT_WALK_AVX512 } vt_walk_path;
vt_walk_path vt_best_walk_path(void); // the fastest that this machine has; those below it exist too

// The same walk for up to VT_PACKET_RAYS rays at once, best those of neighbouring pixels: ray i's chords, front to back,
// are written from out + i * capacity on, and their number to chord_count[i]. capacity >= vt_max_segments; what lies behind a
// ray's chords in its part of `out` may be overwritten, no more. Pieces below 1e-6 edges are joined to the next cell. Rays with NaN or
// infinity meet nothing.
#define VT_PACKET_RAYS 16
void vt_walk_rays(const vt_octree *, int level, vt_walk_path, const vt_ray *rays, int count, vt_chord *out, size_t capacity,
                  uint32_t *chord_count);

// ==== the field along a ray ==========================================================================================

// A view as its texture sees it: homogeneous pixel of the reduced photograph = m X + b, X in cell edges from the root's
// lowest corner.
typedef struct vt_field_view {
  const struct vt_view_texture *texture;
  double m[9], b[3];
  float weight; // >= 0
} vt_field_view;
// `level` of the octree, `factor` by which the view's photographs are reduced.
vt_field_view vt_aim_field_view(const vt_octree *, int level, const vt_camera *, int factor, const struct vt_view_texture *,
                                float weight);

// What stands in the middle of each of a ray's chords.
typedef struct vt_field_samples {
  float *along;          // [capacity] distance of the chord's middle from the ray's first point in the root, cell edges
  float (*inside)[4];    // [capacity] the middle's place within its cell, 0..1 along x, y, z; fourth 0
  float (*value)[4];     // [capacity] optical depth across an edge, RGB
  float *log_ratio;      // [capacity] ln R
} vt_field_samples;
// Fills along, inside and value for chords that vt_walk_rays found.
void vt_sample_field(const vt_octree *, int level, const vt_ray *, const vt_chord *, size_t count, vt_field_samples *);
// Fills log_ratio from `along`. A view whose photograph does not hold the point does not count; 0 where none does.
void vt_sample_ratios(const vt_octree *, int level, const vt_ray *, const vt_field_view *views, int view_count, size_t count,
                      vt_field_samples *);

// ==== order ==========================================================================================================

// Cells of one level, far to near as seen from `eye` (world), exact for every eye outside or inside: on a uniform grid
// the number of cell planes between eye and cell (|dx|+|dy|+|dz| in cells) grows along every ray, so a counting sort of
// that small integer suffices. order[cell_count] is written. Ties never occlude each other and keep Morton order.
vt_status vt_order_back_to_front(vt_context *, const vt_octree *, int level, vt_vec3 eye, uint32_t *order);

// ==== billboard tiles ================================================================================================

#define VT_NO_TILE UINT32_MAX

// The billboard textures of one level. A tile belongs to one (view, cell): texel_edge^2 texels of straight RGBA on the
// plane through the cell's centre that faces the view's camera. Colour is sRGB-encoded. Alpha is the opacity of a FULL
// cell edge; what a ray meets is 1 - (1 - alpha)^(chord / edge), so the chord clips a billboard exactly to its cell.
typedef struct vt_tiles {
  int view_count;
  uint32_t cell_count;
  uint32_t tile_count;
  int grid;               // edge of a texel in pixels of the photographs, 1..65535: the texels lie on the photographs' own grid;
                          // 0: a tile has the side vt_tree.tile_side, wherever its texels fall
  uint32_t *tile_of;      // [view_count][cell_count] tile number, or VT_NO_TILE where pruned; owned
  uint8_t *texels;        // [tile_count][texel_edge][texel_edge][4] RGBA; NULL if packed; owned
  uint16_t *alpha_code;   // [tile_count] codeword of the alpha codebook; NULL if raw; owned
  uint16_t *colour_code;  // [tile_count] codeword of the colour codebook; NULL if raw; owned
} vt_tiles;

typedef struct vt_codebook {
  int codeword_count; // 0..65536
  int channels;       // 1 (alpha) or 3 (sRGB)
  uint8_t *codewords; // [codeword_count][texel_edge][texel_edge][channels]; owned
} vt_codebook;

// Where a cell's tile of view v lies in the picture plane of that view: a square of side `side` pixels around the
// projection of the cell's centre, texel rows along the picture's rows.
typedef struct vt_tile_frame {
  float left, top;   // pixels of the view's camera
  float texel_scale; // texels per pixel: texel_edge / side; 0 if the centre is not in front of the camera
} vt_tile_frame;
// `tile_side`: side of a tile in projected cell edges (vt_tree.tile_side).
vt_tile_frame vt_tile_frame_of(const vt_camera *, vt_vec3 cell_centre, double cell_edge, double tile_side,
                               int texel_edge);
// The same on the photograph's grid: texels of grid x grid whole pixels, so that at the photograph's own camera (reduced by
// `grid`) a pixel's centre is a texel's centre and nothing is interpolated. left and top are multiples of grid.
vt_tile_frame vt_snapped_frame_of(const vt_camera *, vt_vec3 cell_centre, int grid, int texel_edge);

// ==== view textures ==================================================================================================

// The opacity texture of one level in the picture plane of one view (METHODS 10): for each pixel of the photograph, reduced
// to the level's resolution, the factor R by which the cells on that pixel's ray must be denser or thinner for the
// photograph's matte to be seen. All billboards on the ray share it. Code c stands for
// ln R = VT_LEAST_LOG_RATIO + VT_LOG_RATIO_STEP * c, that is R = 0.02 .. 50; between pixels' centres codes are interpolated,
// or R itself, which leaves a line that is about a pixel wide as opaque as it is (reconstruct/thinness.c).
#define VT_LEAST_LOG_RATIO (-3.912023f)
#define VT_LOG_RATIO_STEP 0.030682533f
typedef struct vt_view_texture {
  int width, height;            // of the reduced photograph, pixels
  int left, top, columns, rows; // the part that is kept; beyond it the nearest pixel of its rim counts. Nothing kept
                                // (columns and rows 0): the view does not count
  uint8_t *codes;               // [rows][columns]; owned
  bool linear;                  // R is interpolated, not ln R; the same for all views of a tree
} vt_view_texture;

typedef struct vt_view_textures {
  int view_count;         // 0: the level has none
  int factor;             // by which the photographs are reduced
  vt_view_texture *views; // [view_count]; owned
} vt_view_textures;
void vt_free_view_textures(vt_context *, vt_view_textures *);
uint64_t vt_count_view_pixels(const vt_view_textures *); // kept, of all views

// ==== the tree =======================================================================================================

// The noun from which pictures are drawn, raw (texels) or packed (codes and codebooks).
typedef struct vt_tree {
  vt_octree octree;
  int texel_edge;                   // 4; 8 for the baseline of [RMMD04]
  float tile_side;                  // side of a tile in projected cell edges, 1..1.8; about so where a level has a grid
  int view_count;                   //
  vt_camera *cameras;               // [view_count] the photographs' cameras; owned
  vt_tiles tiles[VT_MAX_LEVEL + 1]; // by level; view_count 0 where a level has no tiles
  vt_view_textures view_textures[VT_MAX_LEVEL + 1]; // by level, instead of tiles; view_count 0 where it has none
  vt_codebook alpha_codebook, colour_codebook; // of tiles; empty if raw
  // A packed tree with view textures: the colours of corners (of cells, where a level has no corners) are all among these
  // codewords of one sRGB texel each, their optical depths on the ladder of depth codes; empty if raw.
  vt_codebook field_codebook;
  char *metadata;                   // JSON object: source, options, statistics, "held_out": [names]; never NULL in a
                                    // complete tree; owned
} vt_tree;

bool vt_is_packed(const vt_tree *);
void vt_free_tiles(vt_context *, vt_tiles *);
void vt_free_tree(vt_context *, vt_tree *);
bool vt_has_textures(const vt_tree *, int level); // tiles or view textures
// The frame of the tile of (view, cell), whichever of the two the level has. cell_centre: vt_cell_centre.
vt_tile_frame vt_frame_of_tile(const vt_tree *, int level, int view, vt_vec3 cell_centre);
uint64_t vt_texture_bytes(const vt_tree *); // bytes of textures in memory: texels, or codes and codebooks; view textures
// A deep copy of everything but tiles and codebooks: cells, corners, view textures, cameras, metadata.
vt_status vt_copy_tree_without_tiles(vt_context *, const vt_tree *, vt_tree *out);

// ==== compositing ====================================================================================================

// How the textures of the chosen views become one colour and opacity of a cell.
typedef enum vt_blend {
  VT_BLEND_SUM,      // one premultiplied sum per cell: rgba = sum_v w_v (alpha_v rgb_v, alpha_v) [Meyer 2001, LRMDM06]
  VT_BLEND_GEOMETRIC // optical depths by weighted geometric mean, colours by depth-weighted mean (METHODS 9)
} vt_blend;

#define VT_MAX_BLEND_VIEWS 8
typedef struct vt_view_weights {
  int count;                        // 1..VT_MAX_BLEND_VIEWS
  int view[VT_MAX_BLEND_VIEWS];     // indices of tree.cameras
  float weight[VT_MAX_BLEND_VIEWS]; // > 0, sum 1
} vt_view_weights;

// The k views whose directions (from the tree's centre) are closest to the eye's, weights (1/angle)(1 - angle/angle of
// view k+1), normalised: they fall to zero where the choice changes. (Unstructured Lumigraph, Buehler 2001.)
vt_view_weights vt_choose_views(const vt_tree *, vt_vec3 eye, int k);
vt_view_weights vt_choose_views_but(const vt_tree *, vt_vec3 eye, int k, int left_out); // as if that view were not there

// What one cell shows to a fragment (the one definition that the CPU and the OpenGL renderer both follow):
//  X  = where the pixel's ray meets the plane through the cell's centre that is parallel to the picture plane;
//  each chosen view v that has a tile: texture coordinates of pi_v(X) in the tile's frame, clamped to the centres of the
//  outer texels, bilinear; weights of views without a tile go to those that have one; no tile at all: nothing is drawn;
//  chord exponent and blend as above. Colours are composited on sRGB-encoded values.
// A level with view textures shows instead, at the middle Xm of the ray's chord l in the cell:
//  s and rgb = the cell's optical depth and colour, interpolated between its corners where the level has them;
//  ln R = mean, with the views' weights, of ln R_v at pi_v(Xm) over the views in whose photograph Xm falls; without any: 0;
//  alpha = 1 - exp(-s R l). (The blend is geometric by nature.) Flat: the same with R = 1.
// Draws a picture of `level` front to back with early termination at transmittance 1e-4, tiled and threaded.
// out: premultiplied RGBA of the camera's size, caller frees. flat != 0: the cells' own optical depth and colour, no tiles
// (weights may then be NULL).
vt_status vt_composite(vt_context *, const vt_tree *, int level, const vt_view_weights *, vt_blend, bool flat,
                       const vt_camera *, vt_fimage *out);

// Work that a picture does not need. Skipping changes no pixel by more than the transmittance at which rays end;
// `voltree bench skips` turns each off to see what it saves.
enum {
  VT_SKIP_HIDDEN = 1,  // a ray ends at transmittance 1e-4
  VT_SKIP_OUTSIDE = 2, // no billboards for cells outside the picture
  VT_SKIP_ALL = 3
};
// The same picture with only those of the VT_SKIP_... in `skips` skipped; vt_composite skips all.
vt_status vt_composite_skipping(vt_context *, const vt_tree *, int level, const vt_view_weights *, vt_blend, bool flat,
                                unsigned skips, const vt_camera *, vt_fimage *out);

// ==== the .vtree file (docs/format.md) ===============================================================================

typedef struct vt_file_report {
  uint64_t file_bytes, cell_bytes, index_bytes, code_bytes, codebook_bytes, texel_bytes; // as stored
  uint64_t field_bytes, view_bytes; // corners' values; view textures
  uint64_t level_field_bytes[VT_MAX_LEVEL + 1], level_view_bytes[VT_MAX_LEVEL + 1]; // the same by level
} vt_file_report;
// Writes to a temporary name, flushes, renames. VT_FAILED naming the file.
vt_status vt_write_tree(vt_context *, const vt_tree *, const char *path, vt_file_report *or_null);
// Trusts nothing: VT_BAD_INPUT naming file, chunk and the reason, nothing allocated is left. Caller frees `out`.
vt_status vt_read_tree(vt_context *, const char *path, vt_tree *out, vt_file_report *or_null);
// The same from bytes in memory, `name` for the sentence.
vt_status vt_parse_tree(vt_context *, const uint8_t *bytes, size_t size, const char *name, vt_tree *out,
                        vt_file_report *or_null);

#ifdef __cplusplus
}
#endif
#endif
