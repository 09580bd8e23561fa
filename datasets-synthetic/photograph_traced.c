// photograph_traced.c - pictures of a mesh by ray tracing
// SPDX-License-Identifier: BSD-3-Clause
//
// Each pixel has samples_edge^2 samples on the regular grid of photograph.c, so that both paths measure the same alpha;
// colour is the mean over the covered ones of the sRGB-encoded shades. A tile of about a thousand samples goes through
// in waves: rays from the eye, then one wave for each part of the light (shade_traced.h), so that rays that are traced
// together are alike.
//
// A sample gets one ray for each part, and a pixel's samples share one low-discrepancy sequence a part, R2 [Roberts
// 2018, "The unreasonable effectiveness of quasirandom sequences"], shifted for the pixel, the part and the view by a
// hash: their mean is smooth although each alone is noise, and noise of one photograph is not that of the next.

#include "datasets-synthetic/photograph_traced.h"
#include "datasets-synthetic/encode.h"
#include "datasets-synthetic/shade_traced.h"
#include "datasets-synthetic/trace.h"

enum { TILE_EDGE = 32, TILE_SAMPLES = TILE_EDGE * TILE_EDGE }; // in samples

typedef struct tile_scratch { // of one worker
  vt_trace_ray rays[TILE_SAMPLES];
  vt_trace_hit hits[TILE_SAMPLES];
  vt_surface surfaces[TILE_SAMPLES];
  vt_light_sample light[TILE_SAMPLES];
  uint32_t sample[TILE_SAMPLES]; // of each surface: where it is in the tile, pixel by pixel
  float colour[TILE_SAMPLES][3]; // of each surface, linear
  float sum[TILE_SAMPLES][3];    // of each pixel, encoded
  uint16_t covered[TILE_SAMPLES];
  bool stopped[TILE_SAMPLES];
} tile_scratch;

typedef struct traced_job {
  vt_context *context;
  const vt_look *look;
  const vt_wind *wind;
  vt_views *views;
  int samples_edge, tile;  // tile: pixels an edge
  size_t bands;            // items for each view
  const vt_tracer *tracer; // without wind
  tile_scratch *scratch;   // [worker]
  vt_status *status;       // [view]
  vt_encode_table encode;
} traced_job;

typedef struct tile_place {
  const vt_camera *camera;
  const vt_tracer *tracer;
  const vt_vertex *vertices;
  int view, x, y, width, height; // pixels
} tile_place;

static uint32_t hash32(uint32_t x) { // Wellons 2018, lowbias32
  x ^= x >> 16, x *= 0x7feb352du, x ^= x >> 15, x *= 0x846ca68bu;
  return x ^ x >> 16;
}

static void draw_random(const tile_place *place, uint32_t pixel, uint32_t sample, vt_light_part part, float random[2]) {
  uint32_t seed = hash32(pixel + hash32((uint32_t)place->view * VT_LIGHT_PARTS + (uint32_t)part + 1));
  uint32_t x = seed + sample * 3242174889u, y = hash32(seed) + sample * 2447445414u; // R2 in units of 2^-32
  random[0] = (float)(x >> 8) * (1.0f / (1 << 24)), random[1] = (float)(y >> 8) * (1.0f / (1 << 24));
}

// Rays through the samples of a tile, all those of a pixel one after the other.
static size_t aim_rays(const traced_job *job, const tile_place *place, tile_scratch *s) {
  int edge = job->samples_edge;
  size_t count = 0;
  vt_vec3 eye = vt_camera_centre(place->camera);
  for (int y = place->y; y < place->y + place->height; y++)
    for (int x = place->x; x < place->x + place->width; x++)
      for (int i = 0; i < edge * edge; i++) {
        vt_ray ray = vt_camera_ray(place->camera, x + (i % edge + 0.5) / edge, y + ((double)(i / edge) + 0.5) / edge);
        s->rays[count++] =
            (vt_trace_ray){.origin = {(float)eye.x, (float)eye.y, (float)eye.z},
                           .direction = {(float)ray.direction.x, (float)ray.direction.y, (float)ray.direction.z},
                           .far = INFINITY};
      }
  return count;
}

static uint32_t pixel_number(const traced_job *job, const tile_place *place, uint32_t sample) {
  int pixel = (int)sample / (job->samples_edge * job->samples_edge);
  int x = place->x + pixel % place->width, y = place->y + pixel / place->width;
  return (uint32_t)y * (uint32_t)place->camera->width + (uint32_t)x;
}

static void add_light(const traced_job *job, const tile_place *place, vt_light_part part, size_t surfaces,
                      tile_scratch *s) {
  size_t count = 0;
  uint32_t samples = (uint32_t)(job->samples_edge * job->samples_edge);
  for (size_t i = 0; i < surfaces; i++) {
    float random[2];
    draw_random(place, pixel_number(job, place, s->sample[i]), s->sample[i] % samples, part, random);
    if (!vt_sample_light(job->look, &s->surfaces[i], part, random, &s->light[count])) continue;
    s->light[count].surface = i;
    s->rays[count] = s->light[count].ray;
    count++;
  }
  vt_any_hits(place->tracer, s->rays, count, s->stopped);
  for (size_t i = 0; i < count; i++) {
    const float *light = s->stopped[i] ? s->light[i].stopped : s->light[i].open;
    for (int c = 0; c < 3; c++) s->colour[s->light[i].surface][c] += light[c];
  }
}

static void photograph_tile(const traced_job *job, const tile_place *place, tile_scratch *s, vt_image *picture) {
  size_t count = aim_rays(job, place, s), surfaces = 0, pixels = (size_t)(place->width * place->height);
  uint32_t samples = (uint32_t)(job->samples_edge * job->samples_edge);
  vt_nearest_hits(place->tracer, s->rays, count, s->hits);
  for (size_t i = 0; i < count; i++) {
    if (s->hits[i].triangle == VT_NO_HIT) continue;
    vt_find_surface(job->look, place->vertices, s->rays[i].direction, &s->hits[i], &s->surfaces[surfaces]);
    s->sample[surfaces] = (uint32_t)i;
    for (int c = 0; c < 3; c++) s->colour[surfaces][c] = 0;
    surfaces++;
  }
  if (!surfaces) return;
  for (int part = 0; part < VT_LIGHT_PARTS; part++) add_light(job, place, (vt_light_part)part, surfaces, s);
  for (size_t p = 0; p < pixels; p++) s->covered[p] = 0, s->sum[p][0] = s->sum[p][1] = s->sum[p][2] = 0;
  for (size_t i = 0; i < surfaces; i++) {
    size_t p = s->sample[i] / samples;
    s->covered[p]++;
    for (int c = 0; c < 3; c++) s->sum[p][c] += vt_encode(&job->encode, s->colour[i][c]);
  }
  for (size_t p = 0; p < pixels; p++) {
    if (!s->covered[p]) continue;
    size_t x = (size_t)place->x + p % (size_t)place->width, y = (size_t)place->y + p / (size_t)place->width;
    uint8_t *out = picture->pixels + 4 * (y * (size_t)picture->width + x);
    for (int c = 0; c < 3; c++) out[c] = vt_byte_of((double)s->sum[p][c] / s->covered[p]);
    out[3] = vt_byte_of((double)s->covered[p] / samples);
  }
}

static void photograph_rows(const traced_job *job, int view, const vt_tracer *tracer, const vt_vertex *vertices,
                            int top, int bottom, tile_scratch *scratch) {
  vt_view *item = &job->views->items[view];
  tile_place place = {.camera = &item->camera, .tracer = tracer, .vertices = vertices, .view = view};
  for (place.y = top; place.y < bottom && !vt_cancelled(job->context); place.y += job->tile)
    for (place.x = 0; place.x < item->camera.width; place.x += job->tile) {
      place.width = item->camera.width - place.x < job->tile ? item->camera.width - place.x : job->tile;
      place.height = bottom - place.y < job->tile ? bottom - place.y : job->tile;
      photograph_tile(job, &place, scratch, &item->picture);
    }
}

static void photograph_bands(void *user, size_t begin, size_t end, int worker) {
  traced_job *job = user;
  for (size_t i = begin; i < end; i++) {
    int view = (int)(i / job->bands), top = (int)(i % job->bands) * job->tile;
    int height = job->views->items[view].camera.height, bottom = height - top < job->tile ? height : top + job->tile;
    if (worker == 0 && i % job->bands == 0) vt_progress(job->context, "photograph", (double)view / job->views->count);
    if (top < height)
      photograph_rows(job, view, job->tracer, job->look->mesh->vertices, top, bottom, job->scratch + worker);
  }
}

// In wind every photograph has its own mesh, and its own tracer: as many at a time as there are workers.
static void photograph_gusts(void *user, size_t begin, size_t end, int worker) {
  traced_job *job = user;
  vt_context *ctx = job->context;
  for (size_t i = begin; i < end && !vt_cancelled(ctx); i++) {
    vt_tracer *tracer = NULL;
    vt_vertex *moved = VT_NEW(ctx, vt_vertex, job->look->mesh->vertex_count);
    job->status[i] = moved ? VT_OK : VT_OUT_OF_MEMORY;
    if (worker == 0) vt_progress(ctx, "photograph", (double)i / job->views->count);
    if (moved) vt_blow(job->wind, job->look->mesh, vt_gust_of(job->views, (int)i), moved);
    if (moved) job->status[i] = vt_trace_look(ctx, job->look, moved, &tracer);
    if (!job->status[i])
      photograph_rows(job, (int)i, tracer, moved, 0, job->views->items[i].camera.height, job->scratch + worker);
    vt_destroy_tracer(ctx, tracer);
    vt_free(ctx, moved);
  }
}

vt_status vt_photograph_traced(vt_context *ctx, const vt_mesh *mesh, vt_vec3 sun, const vt_wind *wind, int samples_edge,
                               vt_views *views) {
  VT_ASSERT(samples_edge >= 1 && samples_edge <= TILE_EDGE);
  vt_look *look = VT_NEW(ctx, vt_look, 1);
  if (!look) return VT_OUT_OF_MEMORY;
  bool still = !(wind->amplitude > 0);
  size_t count = (size_t)views->count, workers = (size_t)vt_thread_count(ctx);
  int tallest = 1;
  vt_tracer *tracer = NULL;
  traced_job job = {.context = ctx, .look = look, .wind = wind, .views = views, .samples_edge = samples_edge};
  job.tile = TILE_EDGE / samples_edge;
  vt_make_encode_table(&job.encode);
  vt_status status = VT_OUT_OF_MEMORY;
  job.scratch = VT_NEW(ctx, tile_scratch, workers);
  job.status = VT_NEW(ctx, vt_status, count);
  if (!job.scratch || !job.status) goto done;
  status = VT_OK;
  for (int i = 0; i < views->count && !status; i++) {
    const vt_camera *camera = &views->items[i].camera;
    status = vt_make_image(ctx, camera->width, camera->height, 4, &views->items[i].picture);
    if (camera->height > tallest) tallest = camera->height;
  }
  if (status) goto done;
  job.bands = (size_t)((tallest + job.tile - 1) / job.tile);
  status = vt_make_look(ctx, mesh, sun, look);
  if (!status && still) status = vt_trace_look(ctx, look, mesh->vertices, &tracer);
  job.tracer = tracer;
  if (!status)
    status = still ? vt_parallel(ctx, count * job.bands, 1, photograph_bands, &job)
                   : vt_parallel(ctx, count, 1, photograph_gusts, &job);
  for (size_t i = 0; i < count && !status; i++) status = job.status[i];
  vt_progress(ctx, "photograph", 1);
done:
  vt_destroy_tracer(ctx, tracer);
  vt_free(ctx, job.scratch);
  vt_free(ctx, job.status);
  vt_free(ctx, look);
  return status;
}
