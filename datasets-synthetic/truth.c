// truth.c - what the synthetic object really is
// SPDX-License-Identifier: BSD-3-Clause
//
// Phantoms answer from their closed forms. Depth of a phantom's pixel is the mean distance of what makes its alpha,
// weighted by the alpha of each sample: a veil in front of a wall lies between both, as a camera that measures depth by
// what it sees would say.

#include "datasets-synthetic/truth_cells.h"
#include "datasets-synthetic/truth_mesh.h"

struct vt_truth {
  bool is_phantom;
  vt_phantom phantom;
  vt_mesh mesh;          // owned; empty of a phantom
  vt_mesh_truth *traced; // of the mesh; NULL of a phantom
};

static vt_status begin_mesh(vt_context *ctx, const vt_synthetic_desc *desc, vt_truth *truth) {
  vt_status status = vt_make_synthetic_mesh(ctx, desc, &truth->mesh);
  return status ? status : vt_create_mesh_truth(ctx, &truth->mesh, &truth->traced);
}

vt_status vt_create_truth(vt_context *ctx, const vt_synthetic_desc *desc, vt_truth **out) {
  VT_ASSERT(desc->cookie == VT_COOKIE);
  vt_truth *truth = VT_NEW(ctx, vt_truth, 1);
  *out = NULL;
  if (!truth) return VT_OUT_OF_MEMORY;
  vt_status status = VT_OK;
  truth->is_phantom = vt_is_phantom(desc->kind);
  if (truth->is_phantom)
    truth->phantom = vt_make_phantom(desc);
  else
    status = begin_mesh(ctx, desc, truth);
  if (status) {
    vt_destroy_truth(ctx, truth);
    return status;
  }
  *out = truth;
  return VT_OK;
}

void vt_destroy_truth(vt_context *ctx, vt_truth *truth) {
  if (!truth) return;
  vt_destroy_mesh_truth(ctx, truth->traced);
  vt_free_mesh(ctx, &truth->mesh);
  vt_free(ctx, truth);
}

double vt_true_optical_depth(const vt_truth *truth, const vt_ray *ray, double near, double far, double radius) {
  if (!truth->is_phantom) return vt_mesh_optical_depth(truth->traced, ray, near, far, radius);
  return vt_phantom_depth(&truth->phantom, ray, near, far);
}

double vt_true_extinction(const vt_truth *truth, vt_vec3 point) {
  VT_ASSERT(truth->is_phantom);
  return fmax(vt_phantom_extinction(&truth->phantom, point), 0);
}

vt_status vt_true_cells(vt_context *ctx, const vt_truth *truth, vt_vec3 origin, double edge, int axis_cells,
                        size_t count, const uint16_t (*xyz)[3], float *extinction, float *area) {
  vt_grid grid = {origin, edge / axis_cells, axis_cells};
  VT_ASSERT(edge > 0 && axis_cells > 0);
  for (size_t i = 0; i < count; i++)
    VT_ASSERT(xyz[i][0] < axis_cells && xyz[i][1] < axis_cells && xyz[i][2] < axis_cells);
  if (!truth->is_phantom) return vt_mesh_cells(ctx, &truth->mesh, &grid, count, xyz, extinction, area);
  for (size_t i = 0; area && i < count; i++) area[i] = 0;
  return vt_phantom_cells(ctx, &truth->phantom, &grid, count, xyz, extinction);
}

// ---- views

typedef struct view_job {
  vt_context *context;
  const vt_phantom *phantom;
  const vt_camera *camera;
  int supersample;
  float *alpha, *depth; // depth or NULL
} view_job;

static void look_along_rows(void *user, size_t begin, size_t end, int worker) {
  view_job *job = user;
  int s = job->supersample, width = job->camera->width;
  vt_vec3 forward = vt_camera_forward(job->camera);
  (void)worker;
  for (size_t y = begin; y < end && !vt_cancelled(job->context); y++)
    for (int x = 0; x < width; x++) {
      double sum = 0, depths = 0;
      for (int k = 0; k < s * s; k++) {
        double alpha, mean;
        vt_ray ray = vt_camera_ray(job->camera, x + (k % s + 0.5) / s, (double)y + (k / s + 0.5) / s);
        vt_phantom_first_moment(job->phantom, &ray, 0, INFINITY, &alpha, &mean);
        if (!(alpha > 0)) continue;
        sum += alpha, depths += alpha * mean * vt_dot(ray.direction, forward);
      }
      size_t at = y * (size_t)width + (size_t)x;
      job->alpha[at] = (float)(sum / (s * s));
      if (job->depth) job->depth[at] = sum > 0 ? (float)(depths / sum) : INFINITY;
    }
}

vt_status vt_true_view(vt_context *ctx, const vt_truth *truth, const vt_camera *camera, int supersample,
                       vt_fimage *alpha, vt_fimage *depth) {
  VT_ASSERT(supersample >= 1 && supersample <= 32);
  if (!truth->is_phantom) return vt_mesh_view(ctx, truth->traced, camera, supersample, alpha, depth);
  if (depth) *depth = (vt_fimage){0};
  vt_status status = vt_make_fimage(ctx, camera->width, camera->height, 1, alpha);
  if (!status && depth) status = vt_make_fimage(ctx, camera->width, camera->height, 1, depth);
  view_job job = {ctx, &truth->phantom, camera, supersample, alpha->pixels, depth ? depth->pixels : NULL};
  if (!status) status = vt_parallel(ctx, (size_t)camera->height, 4, look_along_rows, &job);
  if (!status) return VT_OK;
  vt_free_fimage(ctx, alpha);
  if (depth) vt_free_fimage(ctx, depth);
  return status;
}
