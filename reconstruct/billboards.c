// billboards.c - the textures of one level, a tile for each view and cell that shows
// SPDX-License-Identifier: BSD-3-Clause
//
// Texel t of cell i in view v looks at the pixel p on which its centre falls. Its opacity (of a full cell edge) is
// 1 - exp(-s_i R_v(p)): the cell's share of the photograph's optical depth (agreement.c), so that the cells of a ray
// together show the photograph's matte. Its colour is the photograph's where the view sees the cell, and the cell's own
// (which the views that do see it agreed on) where something stands before it, in proportion to the transmittance.
// A tile is left out when the cell is hidden from its view [LRMDM06 3.2].

#include "reconstruct/billboards.h"

#include <string.h>

vt_billboard_desc vt_default_billboard_desc(void) { return (vt_billboard_desc){VT_COOKIE, true, 0.99, 0, 10, 10}; }

typedef struct billboard_job {
  const vt_billboard_desc *desc;
  const vt_reduced_views *views;
  const vt_agreement *agreement;
  const vt_tree *tree;
  vt_tiles *tiles;
  int level;
  uint32_t *first; // [views + 1] number of the view's first tile
  int32_t (*corner)[2]; // [tiles] column and row of the first texel in the view's reduced picture
} billboard_job;

static bool is_needed(const billboard_job *job, int view, size_t cell) {
  size_t cells = job->agreement->cell_count;
  const uint8_t *visibility = job->agreement->visibility;
  int least = 1 + (int)(254 * (1 - job->desc->hidden_threshold));
  if (!visibility[(size_t)view * cells + cell]) return false;
  if (job->tree->octree.levels[job->level].optical_depth[cell] < job->desc->least_depth) return false;
  return !job->desc->prune || visibility[(size_t)view * cells + cell] > least;
}

static void count_tiles(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  billboard_job *job = user;
  uint32_t cells = job->tiles->cell_count;
  for (size_t view = begin; view < end; view++) {
    uint32_t *tile_of = job->tiles->tile_of + view * cells, count = 0;
    for (uint32_t cell = 0; cell < cells; cell++)
      tile_of[cell] = is_needed(job, (int)view, cell) ? count++ : VT_NO_TILE;
    job->first[view + 1] = count;
  }
}

typedef struct pixel_source {
  const vt_image *picture;
  const vt_fimage *log_ratio;
} pixel_source;

// Photograph at the pixel, or the nearest: colour unless there is none, and the logarithm of the matte ratio. Returns alpha.
static float sample(const pixel_source *source, int x, int y, float colour[3], float *log_ratio) {
  int w = source->picture->width, h = source->picture->height;
  x = x < 0 ? 0 : x > w - 1 ? w - 1 : x;
  y = y < 0 ? 0 : y > h - 1 ? h - 1 : y;
  size_t at = (size_t)y * (size_t)w + (size_t)x;
  const uint8_t *pixel = source->picture->pixels + 4 * at;
  *log_ratio = source->log_ratio->pixels[at];
  for (int c = 0; c < 3 && pixel[3]; c++) colour[c] = (float)pixel[c] / 255.0f;
  return (float)pixel[3] / 255.0f;
}

static void fill_tile(const billboard_job *job, int view, uint32_t cell, int32_t corner[2], uint8_t *texels) {
  const vt_tree *tree = job->tree;
  const vt_level *level = &tree->octree.levels[job->level];
  const float *own = level->colour + 3 * (size_t)cell, s = level->optical_depth[cell];
  vt_tile_frame frame = vt_frame_of_tile(tree, job->level, view, vt_cell_centre(&tree->octree, job->level, cell));
  pixel_source source = {&job->views->pictures[view], &job->agreement->log_ratio[view]};
  float seen = (float)(job->agreement->visibility[(size_t)view * level->cell_count + cell] - 1) / 254.0f;
  for (int i = 0; i < 2; i++) corner[i] = (int32_t)((i ? frame.top : frame.left) * frame.texel_scale);
  for (int row = 0; row < tree->texel_edge; row++)
    for (int column = 0; column < tree->texel_edge; column++, texels += 4) {
      float colour[3] = {own[0], own[1], own[2]}, log_ratio;
      float alpha = sample(&source, corner[0] + column, corner[1] + row, colour, &log_ratio);
      float trust = seen * (alpha > 0.25f ? 1 : 4 * alpha); // the colour of a nearly empty pixel is a guess
      for (int c = 0; c < 3; c++)
        texels[c] = (uint8_t)(0.5f + 255 * (trust * colour[c] + (1 - trust) * own[c]));
      texels[3] = (uint8_t)(0.5f + 255 * (1 - expf(-s * expf(log_ratio))));
    }
}

static void fill_tiles(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  billboard_job *job = user;
  uint32_t cells = job->tiles->cell_count;
  size_t bytes = 4 * (size_t)(job->tree->texel_edge * job->tree->texel_edge);
  for (size_t i = begin; i < end; i++) {
    size_t view = i / cells, cell = i % cells;
    uint32_t *tile = &job->tiles->tile_of[i];
    if (*tile == VT_NO_TILE) continue;
    *tile += job->first[view];
    fill_tile(job, (int)view, (uint32_t)cell, job->corner[*tile], job->tiles->texels + *tile * bytes);
  }
}

vt_status vt_make_billboards(vt_context *context, const vt_billboard_desc *desc, const vt_rays *rays, vt_tree *tree,
                             vt_match_report *report) {
  const vt_reduced_views *views = rays->views;
  int level = rays->level;
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->ratio_limit >= 1 && views->count == tree->view_count && rays->octree == &tree->octree);
  vt_tiles *tiles = &tree->tiles[level];
  size_t cells = tree->octree.levels[level].cell_count, view_count = (size_t)views->count;
  vt_agreement agreement = {0};
  billboard_job job = {desc, views, &agreement, tree, tiles, level, NULL, NULL};
  vt_status status = vt_find_agreement(context, rays, desc->ratio_limit, &agreement);
  if (status) return status;
  *tiles = (vt_tiles){.view_count = views->count, .cell_count = (uint32_t)cells, .grid = views->factor};
  tiles->tile_of = VT_NEW(context, uint32_t, view_count * cells);
  job.first = VT_NEW(context, uint32_t, view_count + 1);
  status = tiles->tile_of && job.first ? VT_OK : VT_OUT_OF_MEMORY;
  if (status) goto done;
  status = vt_parallel(context, view_count, 1, count_tiles, &job);
  for (size_t v = 0; v < view_count; v++) job.first[v + 1] += job.first[v];
  tiles->tile_count = job.first[view_count];
  if (!status) tiles->texels = vt_alloc(context, tiles->tile_count, 4 * (size_t)(tree->texel_edge * tree->texel_edge));
  if (!status) job.corner = vt_alloc(context, tiles->tile_count, sizeof *job.corner);
  if (!status && !(tiles->texels && job.corner)) status = VT_OUT_OF_MEMORY;
  if (!status) status = vt_parallel(context, view_count * cells, 8192, fill_tiles, &job);
  if (!status) status = vt_match_tiles(context, rays, &agreement, (const int32_t(*)[2])job.corner, desc->match_limit, tree, report);
done:
  vt_free(context, job.corner);
  vt_free(context, job.first);
  vt_free_agreement(context, &agreement);
  if (status) vt_free_tiles(context, tiles);
  return status;
}
