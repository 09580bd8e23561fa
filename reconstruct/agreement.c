// agreement.c - how a photograph and the cells agree: matte ratio and visibility
// SPDX-License-Identifier: BSD-3-Clause
//
// One walk of a photograph's rays through the solved cells gives both things a texture needs. The ratio
// R = ln(1 - a) / -tau says by how much the cells on a pixel's ray must be made denser or thinner so that together they
// show the photograph's matte, leaf edges finer than a cell included (DESIGN 5; METHODS 9 "matte-consistent ratio").
// The visibility of a cell is the transmittance before it, averaged over its pixels by chord.

#include "reconstruct/agreement.h"
#include "base/fast_exp.h"

#define LEAST_LEFT 0.015f // transmittance below which a matte says no more
#define LEAST_RATIO 0.02f

typedef struct agreement_job {
  const vt_rays *rays;
  const vt_octree *octree;
  const vt_reduced_views *views;
  vt_agreement *out;
  const float *s;
  size_t cells;
  int level, view;
  float ratio_limit;
  float *sums;  // [VT_LANES][cells][2]: chord times transmittance, chord
  float *total; // [cells][2]
} agreement_job;

static float log_ratio_of(float alpha, float tau, float limit) {
  float least = logf(LEAST_RATIO), most = logf(limit), cap = -logf(LEAST_LEFT);
  if (alpha < 0.004f) return least;
  if (tau < 0.003f) return 0;
  float wanted = -logf(fmaxf(1 - alpha, LEAST_LEFT)), shown = fmaxf(0.003f, fminf(tau, cap));
  float v = logf(wanted / shown);
  return v < least ? least : v > most ? most : v;
}

static void visit(void *user, const vt_swept_ray *ray) {
  agreement_job *job = user;
  float tau = 0, *sums = job->sums + 2 * job->cells * (size_t)ray->lane;
  for (size_t k = 0; k < ray->chord_count; k++) {
    size_t cell = ray->chords[k].cell;
    float length = ray->chords[k].length;
    sums[2 * cell] += length * vt_exp_of_negative(-tau);
    sums[2 * cell + 1] += length;
    tau += job->s[cell] * length;
  }
  vt_fimage *image = &job->out->log_ratio[ray->view];
  image->pixels[(size_t)ray->y * (size_t)image->width + (size_t)ray->x] =
      log_ratio_of((float)ray->pixel[3] / 255.0f, tau, job->ratio_limit);
}

// A cell that no pixel's centre met: the transmittance along the ray to its own centre.
static float visibility_of_centre(const agreement_job *job, uint32_t cell, vt_segment *segments) {
  const vt_camera *camera = &job->views->cameras[job->view];
  double pixel[2];
  if (!vt_project(camera, vt_cell_centre(job->octree, job->level, cell), pixel) || pixel[0] < 0 || pixel[1] < 0 ||
      pixel[0] > camera->width || pixel[1] > camera->height)
    return -1;
  vt_ray ray = vt_camera_ray(camera, pixel[0], pixel[1]);
  size_t count = vt_walk_ray(job->octree, job->level, &ray, segments);
  float tau = 0;
  for (size_t k = 0; k < count && segments[k].cell != cell; k++) tau += job->s[segments[k].cell] * segments[k].length;
  return vt_exp_of_negative(-tau);
}

typedef struct visibility_job {
  const agreement_job *agreement;
  vt_segment *segments; // [workers][max]
  size_t max_segments;
} visibility_job;

static void write_visibility(void *user, size_t begin, size_t end, int worker) {
  visibility_job *job = user;
  const agreement_job *a = job->agreement;
  uint8_t *out = a->out->visibility + (size_t)a->view * a->cells;
  for (size_t cell = begin; cell < end; cell++) {
    float chord = a->total[2 * cell + 1];
    float v = chord > 1e-3f ? a->total[2 * cell] / chord
                            : visibility_of_centre(a, (uint32_t)cell, job->segments + (size_t)worker * job->max_segments);
    out[cell] = v < 0 ? 0 : (uint8_t)(1.5f + 254 * (v > 1 ? 1 : v));
  }
}

// Pixels whose rays meet no cell, or say nothing: nothing to thicken.
static void fill_without_cells(const agreement_job *job, vt_fimage *log_ratio) {
  const vt_image *picture = &job->views->pictures[job->view];
  const uint8_t *ignored = job->views->ignored[job->view].pixels;
  for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; i++)
    log_ratio->pixels[i] =
        ignored && ignored[i] ? 0 : log_ratio_of((float)picture->pixels[4 * i + 3] / 255.0f, 0, job->ratio_limit);
}

static vt_status find_agreement_of_view(vt_context *context, agreement_job *job, visibility_job *visibility) {
  vt_image *picture = &job->views->pictures[job->view];
  vt_status status = vt_make_fimage(context, picture->width, picture->height, 1, &job->out->log_ratio[job->view]);
  if (status) return status;
  fill_without_cells(job, &job->out->log_ratio[job->view]);
  status = vt_sweep_rays(context, job->rays, &job->view, 1, visit, job);
  if (!status) status = vt_add_lanes(context, job->sums, 2 * job->cells, job->total);
  if (!status) status = vt_parallel(context, job->cells, 4096, write_visibility, visibility);
  return status;
}

vt_status vt_find_agreement(vt_context *context, const vt_rays *rays, float ratio_limit, vt_agreement *out) {
  const vt_octree *octree = rays->octree;
  const vt_reduced_views *views = rays->views;
  const vt_level *cells = &octree->levels[rays->level];
  size_t count = cells->cell_count, max = vt_max_segments(cells);
  *out = (vt_agreement){views->count, cells->cell_count, VT_NEW(context, vt_fimage, (size_t)views->count),
                        VT_NEW(context, uint8_t, (size_t)views->count * count)};
  agreement_job job = {rays, octree, views, out, cells->optical_depth, count, rays->level, 0, ratio_limit,
                       VT_NEW(context, float, 2 * count * VT_LANES), VT_NEW(context, float, 2 * count)};
  visibility_job visibility = {&job, VT_NEW(context, vt_segment, max * (size_t)vt_thread_count(context)), max};
  bool there = out->log_ratio && out->visibility && job.sums && job.total && visibility.segments;
  vt_status status = there ? VT_OK : VT_OUT_OF_MEMORY;
  for (; job.view < views->count && !status; job.view++) {
    status = find_agreement_of_view(context, &job, &visibility);
    vt_progress(context, "visibility", (job.view + 1.0) / views->count);
  }
  vt_free(context, visibility.segments);
  vt_free(context, job.total);
  vt_free(context, job.sums);
  if (status) vt_free_agreement(context, out);
  return status;
}

void vt_free_agreement(vt_context *context, vt_agreement *a) {
  for (int i = 0; i < a->view_count && a->log_ratio; i++) vt_free_fimage(context, &a->log_ratio[i]);
  vt_free(context, a->log_ratio);
  vt_free(context, a->visibility);
  *a = (vt_agreement){0};
}
