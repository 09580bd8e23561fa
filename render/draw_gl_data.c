// draw_gl_data.c - what the OpenGL renderer uploads, as plain arrays
// SPDX-License-Identifier: BSD-3-Clause
//
// View textures are uploaded as one linear array, the kept parts of the views one behind the other: they are of different
// sizes, and a layer each would be as large as the largest. The shader interpolates by itself, since a cell's fragments need
// the very codes that the CPU takes, and no filter of a driver promises as much.

#include "render/draw_gl_data.h"

#include <string.h>

uint16_t (*vt_gl_places(vt_context *context, const vt_level *level))[4] {
  uint16_t(*places)[4] = vt_alloc(context, level->cell_count, sizeof *places);
  for (uint32_t i = 0; places && i < level->cell_count; i++) {
    places[i][0] = level->x[i];
    places[i][1] = level->y[i];
    places[i][2] = level->z[i];
  }
  return places;
}

float (*vt_gl_looks(vt_context *context, const vt_level *level))[4] {
  float(*looks)[4] = vt_alloc(context, level->cell_count, sizeof *looks);
  for (size_t i = 0; looks && i < level->cell_count; i++) {
    memcpy(looks[i], level->colour + 3 * i, 3 * sizeof(float));
    looks[i][3] = level->optical_depth[i];
  }
  return looks;
}

uint32_t *vt_gl_tile_codes(vt_context *context, const vt_tiles *tiles) {
  uint32_t *codes = VT_NEW(context, uint32_t, tiles->tile_count);
  for (uint32_t i = 0; codes && i < tiles->tile_count; i++)
    codes[i] = (uint32_t)tiles->colour_code[i] << 16 | tiles->alpha_code[i];
  return codes;
}

typedef struct grid_job {
  const vt_tree *tree;
  int level;
  uint32_t *out;
} grid_job;

static void mark_tiles(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  const grid_job *job = user;
  const vt_tiles *tiles = &job->tree->tiles[job->level];
  for (size_t i = begin; i < end; i++) {
    uint32_t cell = (uint32_t)(i % tiles->cell_count), tile = tiles->tile_of[i];
    job->out[i] = tile;
    if (tile == VT_NO_TILE) continue;
    vt_tile_frame frame = vt_frame_of_tile(job->tree, job->level, (int)(i / tiles->cell_count),
                                           vt_cell_centre(&job->tree->octree, job->level, cell));
    int64_t column = (int64_t)(frame.left / (float)tiles->grid), row = (int64_t)(frame.top / (float)tiles->grid);
    job->out[i] = tile | (uint32_t)(column & 3) << 28 | (uint32_t)(row & 3) << 30;
  }
}

uint32_t *vt_gl_grid_tiles(vt_context *context, const vt_tree *tree, int level) {
  const vt_tiles *tiles = &tree->tiles[level];
  size_t count = (size_t)tiles->view_count * tiles->cell_count;
  grid_job job = {tree, level, VT_NEW(context, uint32_t, count)};
  if (job.out && vt_parallel(context, count, 8192, mark_tiles, &job)) vt_free(context, job.out), job.out = NULL;
  return job.out;
}

uint32_t (*vt_gl_quads(vt_context *context, const vt_draw_list *list))[6] {
  uint32_t(*quads)[6] = vt_alloc(context, list->count, sizeof *quads);
  for (uint32_t i = 0; quads && i < list->count; i++) {
    uint32_t first = 4 * list->cells[i];
    const uint32_t corners[6] = {first, first + 1, first + 2, first + 2, first + 1, first + 3};
    memcpy(quads[i], corners, sizeof corners);
  }
  return quads;
}

static size_t codes_of(const vt_view_texture *t) {
  return t->columns > 0 && t->rows > 0 ? (size_t)t->columns * (size_t)t->rows : 0;
}

uint8_t *vt_gl_ratio_codes(vt_context *context, const vt_view_textures *textures, size_t *count) {
  *count = 0;
  for (int v = 0; v < textures->view_count; v++) *count += codes_of(&textures->views[v]);
  uint8_t *codes = VT_NEW(context, uint8_t, *count ? *count : 1), *end = codes;
  for (int v = 0; codes && v < textures->view_count; v++) {
    size_t size = codes_of(&textures->views[v]);
    if (size) memcpy(end, textures->views[v].codes, size);
    end += size;
  }
  return codes;
}

// K (R (centre + edge X) + t) / edge, as in octree/composite.c; the reduced photograph's K is K / factor
static void aim(const vt_camera *camera, double factor, vt_vec3 centre, double edge, float m[9], float b[3]) {
  const double *r = camera->rotation.m;
  double fx = camera->fx / factor, fy = camera->fy / factor, cx = camera->cx / factor, cy = camera->cy / factor;
  vt_vec3 c = vt_scale(vt_to_camera(camera, centre), 1 / edge);
  for (int i = 0; i < 3; i++) { // column by column, as OpenGL ES wants it
    m[3 * i + 0] = (float)(fx * r[i] + cx * r[6 + i]);
    m[3 * i + 1] = (float)(fy * r[3 + i] + cy * r[6 + i]);
    m[3 * i + 2] = (float)r[6 + i];
  }
  b[0] = (float)(fx * c.x + cx * c.z);
  b[1] = (float)(fy * c.y + cy * c.z);
  b[2] = (float)c.z;
}

vt_gl_views vt_aim_gl_views(const vt_tree *tree, int level, const vt_view_weights *weights) {
  const vt_view_textures *textures = &tree->view_textures[level];
  double half = 0.5 * tree->octree.edge, edge = vt_cell_edge(&tree->octree, level);
  vt_vec3 centre = vt_add(tree->octree.origin, vt_v3(half, half, half));
  vt_gl_views out = {0};
  for (int v = 0; v < weights->count; v++) {
    const vt_camera *camera = &tree->cameras[weights->view[v]];
    out.weight[v] = weights->weight[v];
    out.texel_rate[v] = (float)(tree->texel_edge / (tree->tile_side * 0.5 * (camera->fx + camera->fy))); // vt_tile_frame_of
    aim(camera, textures->view_count ? textures->factor : 1, centre, edge, out.m[v], out.b[v]);
    if (!textures->view_count) continue;
    VT_ASSERT(weights->view[v] >= 0 && weights->view[v] < textures->view_count);
    const vt_view_texture *t = &textures->views[weights->view[v]];
    if (!codes_of(t)) out.weight[v] = 0;
    if (t->linear) out.linear = 1;
    for (int i = 0; i < weights->view[v]; i++) out.first_code[v] += (uint32_t)codes_of(&textures->views[i]);
    out.kept[v][0] = (float)t->left + 0.5f;
    out.kept[v][1] = (float)t->top + 0.5f;
    out.kept[v][2] = (float)(t->columns - 1);
    out.kept[v][3] = (float)(t->rows - 1);
    out.photograph[v][0] = (float)t->width;
    out.photograph[v][1] = (float)t->height;
  }
  return out;
}
