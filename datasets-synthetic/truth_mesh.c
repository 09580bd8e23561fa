// truth_mesh.c - what a mesh really is, asked by rays
// SPDX-License-Identifier: BSD-3-Clause
//
// A mesh has no extinction at a point: something is there, or nothing is. Along a beam of some width there is
//     tau = -ln(share of the beam that nothing stops),
// which is what a photograph's alpha measures over a pixel. The beam is 256 parallel rays, one in the middle of each
// cell of a 16 x 16 grid that is laid onto the disc so that cells keep equal areas [Shirley, Chiu 1997, "A low
// distortion map between disk and square"]; fixed, so that the same question gets the same answer.

#include "datasets-synthetic/truth_mesh.h"
#include "datasets-synthetic/shade_traced.h"

enum { BEAM_EDGE = 16, BEAM_RAYS = BEAM_EDGE * BEAM_EDGE, ROW_RAYS = 1024 };

struct vt_mesh_truth {
  vt_look look;
  vt_tracer *tracer;
  float disc[BEAM_RAYS][2]; // the beam's rays, radius 1
};

static void fill_disc(float disc[BEAM_RAYS][2]) {
  for (int i = 0; i < BEAM_RAYS; i++) {
    double a = 2 * (i % BEAM_EDGE + 0.5) / BEAM_EDGE - 1, b = 2 * ((double)(i / BEAM_EDGE) + 0.5) / BEAM_EDGE - 1;
    bool flat = fabs(a) > fabs(b); // no cell's middle is 0
    double r = flat ? a : b, angle = flat ? VT_PI / 4 * (b / a) : VT_PI / 2 - VT_PI / 4 * (a / b);
    disc[i][0] = (float)(r * cos(angle)), disc[i][1] = (float)(r * sin(angle));
  }
}

vt_status vt_create_mesh_truth(vt_context *ctx, const vt_mesh *mesh, vt_mesh_truth **out) {
  vt_mesh_truth *truth = *out = VT_NEW(ctx, vt_mesh_truth, 1);
  if (!truth) return VT_OUT_OF_MEMORY;
  fill_disc(truth->disc);
  vt_status status = vt_make_look(ctx, mesh, vt_v3(0, 0, 1), &truth->look);
  if (!status) status = vt_trace_look(ctx, &truth->look, mesh->vertices, &truth->tracer);
  if (status) vt_destroy_mesh_truth(ctx, truth), *out = NULL;
  return status;
}

void vt_destroy_mesh_truth(vt_context *ctx, vt_mesh_truth *truth) {
  if (!truth) return;
  vt_destroy_tracer(ctx, truth->tracer);
  vt_free(ctx, truth);
}

double vt_mesh_optical_depth(const vt_mesh_truth *truth, const vt_ray *ray, double near, double far, double radius) {
  vt_trace_ray rays[BEAM_RAYS];
  bool stopped[BEAM_RAYS];
  VT_ASSERT(radius > 0);
  if (!(far > near)) return 0;
  vt_vec3 helper = fabs(ray->direction.z) < 0.9 ? vt_v3(0, 0, 1) : vt_v3(1, 0, 0), d = ray->direction;
  vt_vec3 u = vt_normalise(vt_cross(helper, d)), v = vt_cross(d, u);
  vt_vec3 start = vt_add(ray->origin, vt_scale(d, near)); // in double: a far origin costs no precision
  for (int i = 0; i < BEAM_RAYS; i++) {
    vt_vec3 off =
        vt_add(vt_scale(u, radius * (double)truth->disc[i][0]), vt_scale(v, radius * (double)truth->disc[i][1]));
    vt_vec3 from = vt_add(start, off);
    rays[i] = (vt_trace_ray){.origin = {(float)from.x, (float)from.y, (float)from.z},
                             .direction = {(float)d.x, (float)d.y, (float)d.z},
                             .far = (float)(far - near)};
  }
  vt_any_hits(truth->tracer, rays, BEAM_RAYS, stopped);
  int open = 0;
  for (int i = 0; i < BEAM_RAYS; i++) open += !stopped[i];
  return open == BEAM_RAYS ? 0 : open ? -log((double)open / BEAM_RAYS) : INFINITY;
}

typedef struct view_job {
  const vt_mesh_truth *truth;
  const vt_camera *camera;
  int supersample;
  vt_fimage *alpha, *depth; // depth or NULL
  vt_context *context;
} view_job;

static void look_at_pixels(const view_job *job, int y, int first, int last) { // [first, last) of a row
  vt_trace_ray rays[ROW_RAYS];
  vt_trace_hit hits[ROW_RAYS];
  int edge = job->supersample, samples = edge * edge;
  vt_vec3 eye = vt_camera_centre(job->camera), forward = vt_camera_forward(job->camera);
  size_t count = 0;
  for (int x = first; x < last; x++)
    for (int i = 0; i < samples; i++) {
      vt_ray ray = vt_camera_ray(job->camera, x + (i % edge + 0.5) / edge, y + ((double)(i / edge) + 0.5) / edge);
      // One unit of z long: what the ray meets at a multiple t lies at z = t.
      vt_vec3 d = vt_scale(ray.direction, 1 / vt_dot(ray.direction, forward));
      rays[count++] = (vt_trace_ray){.origin = {(float)eye.x, (float)eye.y, (float)eye.z},
                                     .direction = {(float)d.x, (float)d.y, (float)d.z},
                                     .far = INFINITY};
    }
  vt_nearest_hits(job->truth->tracer, rays, count, hits);
  for (int x = first; x < last; x++) {
    const vt_trace_hit *hit = hits + (size_t)(x - first) * (size_t)samples;
    size_t at = (size_t)y * (size_t)job->camera->width + (size_t)x;
    double sum = 0;
    int covered = 0;
    for (int i = 0; i < samples; i++)
      if (hit[i].triangle != VT_NO_HIT) sum += (double)hit[i].distance, covered++;
    job->alpha->pixels[at] = (float)covered / (float)samples;
    if (job->depth) job->depth->pixels[at] = covered ? (float)(sum / covered) : INFINITY;
  }
}

static void look_at_rows(void *user, size_t begin, size_t end, int worker) {
  const view_job *job = user;
  (void)worker;
  int step = ROW_RAYS / (job->supersample * job->supersample), width = job->camera->width;
  for (size_t y = begin; y < end && !vt_cancelled(job->context); y++)
    for (int x = 0; x < width; x += step) look_at_pixels(job, (int)y, x, x + step < width ? x + step : width);
}

vt_status vt_mesh_view(vt_context *ctx, const vt_mesh_truth *truth, const vt_camera *camera, int supersample,
                       vt_fimage *alpha, vt_fimage *depth_or_null) {
  VT_ASSERT(supersample >= 1 && supersample * supersample <= ROW_RAYS);
  *alpha = (vt_fimage){0};
  if (depth_or_null) *depth_or_null = (vt_fimage){0};
  vt_status status = vt_make_fimage(ctx, camera->width, camera->height, 1, alpha);
  if (!status && depth_or_null) status = vt_make_fimage(ctx, camera->width, camera->height, 1, depth_or_null);
  view_job job = {truth, camera, supersample, alpha, depth_or_null, ctx};
  if (!status) status = vt_parallel(ctx, (size_t)camera->height, 4, look_at_rows, &job);
  if (status) {
    vt_free_fimage(ctx, alpha);
    if (depth_or_null) vt_free_fimage(ctx, depth_or_null);
  }
  return status;
}
