// light.c - sun with shadows, sky with occlusion, leaves that let light through
// SPDX-License-Identifier: BSD-3-Clause
//
// Everything is matt (Lambert), so that a point looks the same from everywhere on one side: what differs between two
// photographs is occlusion and the side of a leaf. Three terms:
//   sun    albedo * max(0, n.s) * V, V from a shadow map seen from the sun; the mean of nine comparisons around the
//          point (percentage-closer filtering, Reeves, Salesin, Cook 1987) softens its edges;
//   behind the same through a leaf lit from its other side, greener and weaker (no bark);
//   sky    albedo * S * (ground .. sky by the normal's height), S the share of some dozens of directions over the upper
//          hemisphere in which nothing stands above the vertex, each decided by a small depth map from there.
// The maps hold the surfaces themselves: a point is compared after a step towards the light (the bias) that is
// longer than a texel's slope on a leaf, or leaves are covered with stripes of their own shadow.

#include "datasets-synthetic/light.h"
#include "datasets-synthetic/rasterise.h"

#include <string.h>

enum { SUN_MAP = 2048, SKY_MAP = 320, SKY_COUNT = 48 };

static const double sun_bias = 0.008, sky_bias = 0.03; // world units

typedef struct light_view {     // parallel projection along a direction onto a square map
  vt_vec3 right, down, towards; // unit; towards the light
  double scale, offset;         // texels per world unit; texel of the origin
} light_view;

static light_view look_from(vt_vec3 direction, double radius, int size) {
  light_view view = {.towards = direction};
  vt_vec3 helper = fabs(direction.z) < 0.9 ? vt_v3(0, 0, 1) : vt_v3(1, 0, 0);
  view.right = vt_normalise(vt_cross(helper, direction));
  view.down = vt_cross(view.right, direction);
  view.scale = 0.5 * (size - 8) / radius, view.offset = 0.5 * size; // a rim of 4 texels stays empty
  return view;
}

static vt_vec3 position_of(const vt_vertex *v) {
  return vt_v3(v->position[0], v->position[1], v->position[2]);
}

static vt_lit_vertex place_in_map(const light_view *view, vt_vec3 p) {
  return (vt_lit_vertex){.sun_x = (float)(vt_dot(view->right, p) * view->scale + view->offset),
                         .sun_y = (float)(vt_dot(view->down, p) * view->scale + view->offset),
                         .sun_near = (float)vt_dot(view->towards, p)};
}

static void draw_map(const vt_mesh *mesh, const light_view *view, int size, vt_projected *projected, float *map) {
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    vt_lit_vertex at = place_in_map(view, position_of(&mesh->vertices[v]));
    projected[v] = (vt_projected){(int32_t)lrintf(at.sun_x * VT_SAMPLE_UNITS),
                                  (int32_t)lrintf(at.sun_y * VT_SAMPLE_UNITS), at.sun_near};
  }
  vt_sample_band band = {.width = size, .row_count = size, .near = map};
  vt_clear_band(&band);
  vt_draw_mesh(mesh, projected, false, &band);
}

typedef struct sky_job {
  vt_context *context;
  const vt_mesh *mesh;
  double radius;
  vt_vec3 directions[SKY_COUNT];
  vt_projected *projected; // [worker][vertex]
  float *maps;             // [worker][SKY_MAP][SKY_MAP]
  uint8_t *open;           // [direction][vertex]: nothing stands above it there
} sky_job;

static void look_at_sky(void *user, size_t begin, size_t end, int worker) {
  sky_job *job = user;
  size_t count = job->mesh->vertex_count;
  vt_projected *projected = job->projected + (size_t)worker * count;
  float *map = job->maps + (size_t)worker * SKY_MAP * SKY_MAP;
  for (size_t d = begin; d < end && !vt_cancelled(job->context); d++) {
    light_view view = look_from(job->directions[d], job->radius, SKY_MAP);
    draw_map(job->mesh, &view, SKY_MAP, projected, map);
    for (size_t v = 0; v < count; v++) {
      size_t x = (size_t)projected[v].x / VT_SAMPLE_UNITS, y = (size_t)projected[v].y / VT_SAMPLE_UNITS;
      job->open[d * count + v] = map[y * SKY_MAP + x] <= projected[v].near + (float)sky_bias;
    }
  }
}

static vt_status measure_sky(vt_context *ctx, const vt_mesh *mesh, double radius, vt_lit_vertex *vertices) {
  size_t count = mesh->vertex_count, workers = (size_t)vt_thread_count(ctx);
  sky_job job = {.context = ctx, .mesh = mesh, .radius = radius};
  for (int d = 0; d < SKY_COUNT; d++) {
    double z = (d + 0.5) / SKY_COUNT, r = sqrt(1 - z * z), angle = d * VT_PI * (3 - sqrt(5));
    job.directions[d] = vt_v3(r * cos(angle), r * sin(angle), z);
  }
  vt_status status = VT_OUT_OF_MEMORY;
  job.projected = VT_NEW(ctx, vt_projected, count * workers);
  job.maps = VT_NEW(ctx, float, workers *SKY_MAP *SKY_MAP);
  job.open = VT_NEW(ctx, uint8_t, count * SKY_COUNT);
  if (!job.projected || !job.maps || !job.open) goto done;
  status = vt_parallel(ctx, SKY_COUNT, 1, look_at_sky, &job);
  for (size_t v = 0; v < count && !status; v++) {
    int open = 0;
    for (size_t d = 0; d < SKY_COUNT; d++) open += job.open[d * count + v];
    vertices[v].sky = (float)open / SKY_COUNT;
  }
done:
  vt_free(ctx, job.projected);
  vt_free(ctx, job.maps);
  vt_free(ctx, job.open);
  return status;
}

vt_status vt_light_mesh(vt_context *ctx, const vt_mesh *mesh, vt_vec3 sun, vt_lighting *out) {
  double radius = 1e-6;
  *out = (vt_lighting){.sun = sun, .map_size = SUN_MAP};
  for (size_t v = 0; v < mesh->vertex_count; v++) radius = fmax(radius, vt_length(position_of(&mesh->vertices[v])));
  vt_status status = VT_OUT_OF_MEMORY;
  vt_projected *projected = VT_NEW(ctx, vt_projected, mesh->vertex_count);
  out->map = VT_NEW(ctx, float, (size_t)SUN_MAP *SUN_MAP);
  out->vertices = VT_NEW(ctx, vt_lit_vertex, mesh->vertex_count);
  if (!projected || !out->map || !out->vertices) goto done;
  light_view view = look_from(out->sun, radius, SUN_MAP);
  for (size_t v = 0; v < mesh->vertex_count; v++)
    out->vertices[v] = place_in_map(&view, position_of(&mesh->vertices[v]));
  draw_map(mesh, &view, SUN_MAP, projected, out->map);
  status = measure_sky(ctx, mesh, radius, out->vertices);
done:
  vt_free(ctx, projected);
  if (status) vt_free_lighting(ctx, out);
  return status;
}

void vt_free_lighting(vt_context *ctx, vt_lighting *lighting) {
  vt_free(ctx, lighting->map);
  vt_free(ctx, lighting->vertices);
  *lighting = (vt_lighting){0};
}

static float sunlit_share(const vt_lighting *l, const vt_surface_point *p) {
  const int reach = 2; // texels between comparisons
  int x = (int)p->sun_x, y = (int)p->sun_y, lit = 0;
  if (x < reach || y < reach || x >= l->map_size - reach || y >= l->map_size - reach) return 1;
  float level = p->sun_near + (float)sun_bias;
  for (int dy = -reach; dy <= reach; dy += reach) {
    const float *row = l->map + (ptrdiff_t)(y + dy) * l->map_size + x;
    lit += (row[-reach] <= level) + (row[0] <= level) + (row[reach] <= level);
  }
  return (float)lit * (1.0f / 9);
}

void vt_shade(const vt_lighting *l, const vt_surface_point *p, float colour[3]) {
  static const float sun[3] = {2.75f, 2.6f, 2.3f}, sky[3] = {0.92f, 1.05f, 1.25f}, ground[3] = {0.5f, 0.5f, 0.4f};
  static const float through[3] = {0.62f, 0.66f, 0.3f}; // of a leaf, against what it reflects
  const float *n = p->normal;
  float scale = 1 / sqrtf(fmaxf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1e-20f)) * (p->back ? -1.0f : 1.0f);
  float towards_sun = scale * (n[0] * (float)l->sun.x + n[1] * (float)l->sun.y + n[2] * (float)l->sun.z);
  float direct = 0, height = 0.5f + 0.5f * scale * n[2];
  if (towards_sun > 0 || p->thin) direct = fabsf(towards_sun) * sunlit_share(l, p);
  float open = 0.1f + 0.9f * p->sky;
  for (int k = 0; k < 3; k++) {
    float front = towards_sun > 0 ? sun[k] : sun[k] * through[k];
    float ambient = ground[k] + (sky[k] - ground[k]) * height;
    // What a crown's inside gets it gets through leaves: greenish.
    float tint = p->thin && k == 1 ? 1.05f : 1.0f;
    colour[k] = p->albedo[k] * (front * direct + ambient * open * tint);
  }
}
