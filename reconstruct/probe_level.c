// probe_level.c - pictures of a solved level for context.probe
// SPDX-License-Identifier: BSD-3-Clause
//
// The map of visibility is a picture from one photograph's camera of what another photograph sees: each cell has the colour
// (1, T, T), T the transmittance between it and the other camera, and the cells are composited front to back. White is seen by
// both, red is hidden from the other one: its colours must come from elsewhere, and where they do not, ghosts stand there.

#include "reconstruct/probe_level.h"
#include "base/fast_exp.h"

typedef struct map_job {
  const vt_octree *octree;
  int level;
  const vt_camera *camera, *other;
  float *seen;          // [cells] transmittance before the cell from the other camera
  vt_segment *segments; // [workers][capacity]
  size_t capacity;
  vt_fimage *out;
} map_job;

static void find_seen(void *user, size_t begin, size_t end, int worker) {
  const map_job *job = user;
  const vt_level *level = &job->octree->levels[job->level];
  vt_segment *segments = job->segments + (size_t)worker * job->capacity;
  vt_vec3 eye = vt_camera_centre(job->other);
  for (size_t i = begin; i < end; i++) {
    vt_ray ray = {eye, vt_normalise(vt_sub(vt_cell_centre(job->octree, job->level, (uint32_t)i), eye))};
    size_t count = vt_walk_ray(job->octree, job->level, &ray, segments);
    float tau = 0;
    for (size_t k = 0; k < count && segments[k].cell != i; k++) tau += level->optical_depth[segments[k].cell] * segments[k].length;
    job->seen[i] = vt_exp_of_negative(-tau);
  }
}

static void draw_rows(void *user, size_t begin, size_t end, int worker) {
  const map_job *job = user;
  const float *s = job->octree->levels[job->level].optical_depth;
  vt_segment *segments = job->segments + (size_t)worker * job->capacity;
  for (size_t y = begin; y < end; y++)
    for (int x = 0; x < job->out->width; x++) {
      vt_ray ray = vt_camera_ray(job->camera, x + 0.5, (double)y + 0.5);
      size_t count = vt_walk_ray(job->octree, job->level, &ray, segments);
      float tau = 0, *pixel = job->out->pixels + 4 * (y * (size_t)job->out->width + (size_t)x);
      for (size_t k = 0; k < count; k++) {
        float through = vt_exp_of_negative(-tau);
        tau += s[segments[k].cell] * segments[k].length;
        float shown = through - vt_exp_of_negative(-tau);
        pixel[0] += shown;
        pixel[1] += shown * job->seen[segments[k].cell];
        pixel[2] = pixel[1];
      }
      pixel[3] = pixel[0];
    }
}

static vt_status probe_visibility(vt_context *context, const vt_octree *octree, int level, const vt_reduced_views *views,
                                  int from, int by) {
  const vt_level *cells = &octree->levels[level];
  const vt_camera *camera = &views->cameras[from];
  vt_fimage map;
  char name[64];
  vt_status status = vt_make_fimage(context, camera->width, camera->height, 4, &map);
  if (status) return status;
  map_job job = {octree, level, camera, &views->cameras[by], VT_NEW(context, float, cells->cell_count), NULL,
                 vt_max_segments(cells), &map};
  job.segments = VT_NEW(context, vt_segment, job.capacity * (size_t)vt_thread_count(context));
  status = job.seen && job.segments ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) status = vt_parallel(context, cells->cell_count, 1024, find_seen, &job);
  if (!status) status = vt_parallel(context, (size_t)map.height, 8, draw_rows, &job);
  snprintf(name, sizeof name, "level_%d_visibility_of_%d_from_%d", level, by, from);
  if (!status) vt_probe(context, name, &map);
  vt_free(context, job.segments);
  vt_free(context, job.seen);
  vt_free_fimage(context, &map);
  return status;
}

static vt_status probe_residual(vt_context *context, const vt_tree *tree, int level, const vt_reduced_views *views) {
  vt_fimage cells, residual = {0};
  vt_status status = vt_composite(context, tree, level, NULL, VT_BLEND_SUM, true, &views->cameras[0], &cells);
  if (status) return status;
  status = vt_make_fimage(context, cells.width, cells.height, 1, &residual);
  if (!status) {
    char name[64];
    for (size_t i = 0; i < (size_t)cells.width * (size_t)cells.height; i++)
      residual.pixels[i] = 0.5f + 0.5f * (cells.pixels[4 * i + 3] - (float)views->pictures[0].pixels[4 * i + 3] / 255.0f);
    snprintf(name, sizeof name, "level_%d_cells", level);
    vt_probe(context, name, &cells);
    snprintf(name, sizeof name, "level_%d_residual", level);
    vt_probe(context, name, &residual);
  }
  vt_free_fimage(context, &residual);
  vt_free_fimage(context, &cells);
  return status;
}

vt_status vt_probe_level(vt_context *context, const vt_tree *tree, int level, const vt_reduced_views *views) {
  if (!vt_wants_probes(context) || !views->count) return VT_OK;
  vt_status status = probe_residual(context, tree, level, views);
  for (int i = 0; i < 3 && i < views->count && !status; i++) // by itself, and by those a third and two thirds further in their order
    status = probe_visibility(context, &tree->octree, level, views, 0, i * views->count / 3);
  return status;
}
