// photograph.c - pictures of a mesh with exact coverage
// SPDX-License-Identifier: BSD-3-Clause
//
// Each pixel has supersample^2 samples on a regular grid. Alpha is the share that is covered; colour is the mean over
// the covered ones of the sRGB-encoded shades, which is the straight form of the premultiplied mean. A view is drawn in
// bands of rows whose samples fit the cache, and each worker has one band.

#include "datasets-synthetic/photograph.h"
#include "datasets-synthetic/encode.h"
#include "datasets-synthetic/rasterise.h"

enum { BAND_SAMPLES = 1 << 18 };

typedef struct photo_job {
  vt_context *context;
  const vt_mesh *mesh;
  const vt_lighting *lighting;
  const vt_wind *wind;
  vt_views *views;
  int supersample, band_rows; // band_rows: pixel rows at a time
  size_t band_samples;
  vt_projected *projected; // [worker][vertex]
  vt_vertex *moved;        // [worker][vertex]; NULL without wind
  float *near;             // [worker][band_samples]
  int32_t *triangle;       // [worker][band_samples]
  vt_status *status;       // [view]
  vt_encode_table encode;
} photo_job;

// False if a vertex does not stand in front of the camera, or is so close that its place has no room in an integer.
static bool project_mesh(const photo_job *job, const vt_mesh *mesh, const vt_camera *camera, vt_projected *projected) {
  double units = (double)job->supersample * VT_SAMPLE_UNITS;
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const float *p = mesh->vertices[v].position;
    vt_vec3 q = vt_to_camera(camera, vt_v3(p[0], p[1], p[2]));
    if (!(q.z > 0)) return false;
    double x = (camera->fx * q.x / q.z + camera->cx) * units, y = (camera->fy * q.y / q.z + camera->cy) * units;
    if (!(fabs(x) < 5e8 && fabs(y) < 5e8)) return false;
    projected[v] = (vt_projected){(int32_t)lrint(x), (int32_t)lrint(y), (float)(1 / q.z)};
  }
  return true;
}

typedef struct seen_triangle { // what interpolation over the last triangle needs; samples often share one
  int32_t id;
  const vt_vertex *vertex[3];
  const vt_lit_vertex *lit[3];
  double weight[3][3]; // weight[k] . (x, y, 1): the k-th corner's share over its z, not yet normalised
  bool thin, back;
} seen_triangle;

static void see_triangle(const photo_job *job, const vt_projected *projected, int32_t id, seen_triangle *seen) {
  const uint32_t *index = job->mesh->triangles[id];
  const vt_projected *p[3] = {&projected[index[0]], &projected[index[1]], &projected[index[2]]};
  double area = (double)vt_twice_area(p[0], p[1], p[2]);
  seen->id = id, seen->thin = (size_t)id >= job->mesh->solid_count, seen->back = area > 0;
  for (int k = 0; k < 3; k++) {
    const vt_projected *b = p[(k + 1) % 3], *c = p[(k + 2) % 3];
    double dx = (double)c->x - b->x, dy = (double)c->y - b->y, scale = p[k]->near / area;
    seen->vertex[k] = &job->mesh->vertices[index[k]];
    seen->lit[k] = &job->lighting->vertices[index[k]];
    seen->weight[k][0] = -dy * scale, seen->weight[k][1] = dx * scale,
    seen->weight[k][2] = (dy * b->x - dx * b->y) * scale;
  }
}

static void shade_sample(const photo_job *job, const seen_triangle *seen, double x, double y, float colour[3]) {
  double share[3], sum = 0;
  for (int k = 0; k < 3; k++) {
    share[k] = seen->weight[k][0] * x + seen->weight[k][1] * y + seen->weight[k][2];
    sum += share[k];
  }
  vt_surface_point point = {.thin = seen->thin, .back = seen->back};
  for (int k = 0; k < 3; k++) {
    float w = (float)(share[k] / sum);
    const vt_vertex *v = seen->vertex[k];
    const vt_lit_vertex *l = seen->lit[k];
    for (int c = 0; c < 3; c++) point.albedo[c] += w * v->albedo[c], point.normal[c] += w * v->normal[c];
    point.sun_x += w * l->sun_x, point.sun_y += w * l->sun_y, point.sun_near += w * l->sun_near,
        point.sky += w * l->sky;
  }
  vt_shade(job->lighting, &point, colour);
}

static void resolve_pixel(const photo_job *job, const vt_sample_band *band, const vt_projected *projected, int px,
                          int py, seen_triangle *seen, uint8_t out[4]) {
  int s = job->supersample, covered = 0;
  double sum[3] = {0, 0, 0};
  for (int y = py * s; y < (py + 1) * s; y++) {
    const int32_t *row = band->triangle + (size_t)(y - band->first_row) * (size_t)band->width;
    for (int x = px * s; x < (px + 1) * s; x++) {
      if (row[x] == VT_NO_TRIANGLE) continue;
      if (row[x] != seen->id) see_triangle(job, projected, row[x], seen);
      float colour[3];
      shade_sample(job, seen, (double)vt_sample_centre(x), (double)vt_sample_centre(y), colour);
      for (int c = 0; c < 3; c++) sum[c] += vt_encode(&job->encode, colour[c]);
      covered++;
    }
  }
  if (!covered) return;
  for (int c = 0; c < 3; c++) out[c] = vt_byte_of(sum[c] / covered);
  out[3] = vt_byte_of((double)covered / (s * s));
}

static void photograph_views(void *user, size_t begin, size_t end, int worker) {
  photo_job *job = user;
  vt_projected *projected = job->projected + (size_t)worker * job->mesh->vertex_count;
  for (size_t i = begin; i < end; i++) {
    vt_view *view = &job->views->items[i];
    int width = view->picture.width, height = view->picture.height;
    if (worker == 0) vt_progress(job->context, "photograph", (double)i / job->views->count);
    vt_mesh mesh = *job->mesh;
    if (job->moved) {
      mesh.vertices = job->moved + (size_t)worker * mesh.vertex_count;
      vt_blow(job->wind, job->mesh, vt_gust_of(job->views, (int)i), mesh.vertices);
    }
    if (!project_mesh(job, &mesh, &view->camera, projected)) {
      VT_ASSERT(job->moved);
      job->status[i] = vt_fail(job->context, VT_BAD_INPUT,
                               "synthetic capture: wind of %g blows leaves into the camera of %s; "
                               "give less wind or a narrower fov_y",
                               job->wind->amplitude, view->name);
      continue;
    }
    for (int top = 0; top < height && !vt_cancelled(job->context); top += job->band_rows) {
      int bottom = top + job->band_rows < height ? top + job->band_rows : height;
      vt_sample_band band = {.width = width * job->supersample,
                             .first_row = top * job->supersample,
                             .row_count = (bottom - top) * job->supersample};
      band.near = job->near + (size_t)worker * job->band_samples;
      band.triangle = job->triangle + (size_t)worker * job->band_samples;
      vt_clear_band(&band);
      vt_draw_mesh(job->mesh, projected, true, &band);
      seen_triangle seen = {.id = VT_NO_TRIANGLE};
      for (int y = top; y < bottom; y++)
        for (int x = 0; x < width; x++)
          resolve_pixel(job, &band, projected, x, y, &seen,
                        view->picture.pixels + 4 * ((size_t)y * (size_t)width + (size_t)x));
    }
  }
}

vt_status vt_photograph_mesh(vt_context *ctx, const vt_mesh *mesh, const vt_lighting *lighting, const vt_wind *wind,
                             int supersample, vt_views *views) {
  size_t workers = (size_t)vt_thread_count(ctx), widest = 1;
  photo_job job = {.context = ctx, .mesh = mesh, .lighting = lighting, .wind = wind, .views = views};
  job.supersample = supersample;
  vt_status status = VT_OK;
  for (int i = 0; i < views->count && !status; i++) {
    const vt_camera *camera = &views->items[i].camera;
    status = vt_make_image(ctx, camera->width, camera->height, 4, &views->items[i].picture);
    if ((size_t)camera->width > widest) widest = (size_t)camera->width;
  }
  if (status) return status;
  size_t row_samples = widest * (size_t)(supersample * supersample);
  job.band_rows = row_samples < BAND_SAMPLES ? (int)(BAND_SAMPLES / row_samples) : 1;
  job.band_samples = row_samples * (size_t)job.band_rows;
  vt_make_encode_table(&job.encode);
  status = VT_OUT_OF_MEMORY;
  job.projected = VT_NEW(ctx, vt_projected, workers * mesh->vertex_count);
  if (wind->amplitude > 0) job.moved = VT_NEW(ctx, vt_vertex, workers * mesh->vertex_count);
  job.status = VT_NEW(ctx, vt_status, (size_t)views->count);
  job.near = VT_NEW(ctx, float, workers *job.band_samples);
  job.triangle = VT_NEW(ctx, int32_t, workers * job.band_samples);
  if (job.projected && job.near && job.triangle && job.status && (job.moved || !(wind->amplitude > 0)))
    status = vt_parallel(ctx, (size_t)views->count, 1, photograph_views, &job);
  for (int i = 0; i < views->count && !status; i++) status = job.status[i];
  vt_progress(ctx, "photograph", 1);
  vt_free(ctx, job.status);
  vt_free(ctx, job.projected);
  vt_free(ctx, job.moved);
  vt_free(ctx, job.near);
  vt_free(ctx, job.triangle);
  return status;
}
