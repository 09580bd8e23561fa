// sweep.c - every pixel's ray through the cells, in fixed lanes
// SPDX-License-Identifier: BSD-3-Clause
//
// Solver, colours, ratios and refinement all do the same walk and differ in what they do with a ray's chords. A picture
// is cut into bands of rows; band b of view i belongs to lane (b + i) mod VT_LANES, so every lane sees an even share of
// every view, and its own sums (one array a lane) depend on nothing but the input. Rays are walked in packets of the
// pixels of a row that may meet a cell, neighbours as a rule.
//
// The walk still costs more than what is done with its chords, and the same rays are swept ten to a hundred times: so the
// chords of a level are kept (8 bytes each) as long as a bound of memory allows, and renumbered when cells are dropped.

#include "reconstruct/sweep.h"
#include "reconstruct/footprint.h"

#include <string.h>

#define BAND_ROWS 4

typedef struct kept_ray {
  uint16_t x, y;
  uint32_t chord_count;
} kept_ray;

typedef struct vt_ray_lane {
  kept_ray *rays;
  vt_chord *chords;
  size_t ray_count, ray_capacity, chord_count, chord_capacity;
  size_t *first_ray, *first_chord; // [views + 1]
  vt_chord *scratch;               // [VT_PACKET_RAYS][capacity] chords of one packet
  size_t capacity;
} vt_ray_lane;

typedef vt_status (*walk_visitor)(void *user, const vt_swept_ray *);

// Pixels of one row that wait to be walked together.
typedef struct packet {
  const vt_rays *rays;
  int lane, view, y, count;
  int parts, part; // only pixels with (x + y) mod parts = part
  int x[VT_PACKET_RAYS];
  walk_visitor visit;
  void *user;
} packet;

static vt_status walk_packet(packet *p) {
  vt_ray_lane *l = &p->rays->lanes[p->lane];
  const vt_image *picture = &p->rays->views->pictures[p->view];
  vt_ray rays[VT_PACKET_RAYS];
  uint32_t chord_count[VT_PACKET_RAYS];
  for (int i = 0; i < p->count; i++) rays[i] = vt_camera_ray(&p->rays->views->cameras[p->view], p->x[i] + 0.5, p->y + 0.5);
  vt_walk_rays(p->rays->octree, p->rays->level, p->rays->path, rays, p->count, l->scratch, l->capacity, chord_count);
  vt_status status = VT_OK;
  for (int i = 0; i < p->count && !status; i++) {
    if (!chord_count[i]) continue;
    const uint8_t *pixel = picture->pixels + 4 * ((size_t)p->y * (size_t)picture->width + (size_t)p->x[i]);
    status = p->visit(p->user, &(vt_swept_ray){p->lane, p->view, p->x[i], p->y, pixel,
                                               l->scratch + (size_t)i * l->capacity, chord_count[i]});
  }
  p->count = 0;
  return status;
}

static vt_status walk_row(packet *p, int stride) {
  const vt_pixel_blocks *blocks = &p->rays->blocks[p->view];
  const uint8_t *marked = blocks->marked + (size_t)(p->y / VT_BLOCK_PIXELS) * (size_t)blocks->width;
  int width = p->rays->views->pictures[p->view].width;
  const uint8_t *ignored = p->rays->views->ignored[p->view].pixels;
  if (ignored) ignored += (size_t)p->y * (size_t)width;
  for (int x = 0; x < width; x += stride) {
    if (!marked[x / VT_BLOCK_PIXELS]) {
      x = x / VT_BLOCK_PIXELS * VT_BLOCK_PIXELS + VT_BLOCK_PIXELS - stride; // the block's last
      continue;
    }
    if ((x + p->y) % p->parts != p->part) continue;
    if (ignored && ignored[x]) continue; // what stands there says nothing
    p->x[p->count++] = x;
    vt_status status = p->count == VT_PACKET_RAYS ? walk_packet(p) : VT_OK;
    if (status) return status;
  }
  return p->count ? walk_packet(p) : VT_OK;
}

// Walks the rays of the packet's view that belong to its lane: all of them, or a sample of one in `stride` along each axis.
static vt_status walk_view(packet p, int stride) {
  int height = p.rays->views->pictures[p.view].height;
  for (int band = (p.lane - p.view % VT_LANES + VT_LANES) % VT_LANES; band * BAND_ROWS < height; band += VT_LANES)
    for (p.y = band * BAND_ROWS; p.y < (band + 1) * BAND_ROWS && p.y < height; p.y += stride) {
      vt_status status = walk_row(&p, stride);
      if (status) return status;
    }
  return VT_OK;
}

typedef struct collect_job {
  vt_context *context;
  vt_rays *rays;
  uint64_t lane_bound; // bytes
  vt_status status[VT_LANES];
} collect_job;

static vt_status make_room(collect_job *job, vt_ray_lane *lane, size_t rays, size_t chords) {
  if (rays * sizeof(kept_ray) + chords * sizeof(vt_chord) > job->lane_bound) return VT_OUT_OF_MEMORY;
  kept_ray *r = vt_realloc(job->context, lane->rays, rays, sizeof *r);
  if (!r) return VT_OUT_OF_MEMORY;
  lane->rays = r;
  lane->ray_capacity = rays;
  vt_chord *c = vt_realloc(job->context, lane->chords, chords, sizeof *c);
  if (!c) return VT_OUT_OF_MEMORY;
  lane->chords = c;
  lane->chord_capacity = chords;
  return VT_OK;
}

static vt_status keep_ray(void *user, const vt_swept_ray *ray) {
  collect_job *job = user;
  vt_ray_lane *lane = &job->rays->lanes[ray->lane];
  if (lane->ray_count == lane->ray_capacity || lane->chord_count + ray->chord_count > lane->chord_capacity) {
    vt_status status = make_room(job, lane, lane->ray_capacity + lane->ray_capacity / 4 + 4096,
                                 lane->chord_capacity + lane->chord_capacity / 4 + 65536);
    if (status) return status;
  }
  lane->rays[lane->ray_count++] = (kept_ray){(uint16_t)ray->x, (uint16_t)ray->y, (uint32_t)ray->chord_count};
  memcpy(lane->chords + lane->chord_count, ray->chords, ray->chord_count * sizeof *ray->chords);
  lane->chord_count += ray->chord_count;
  return VT_OK;
}

static vt_status count_ray(void *user, const vt_swept_ray *ray) {
  size_t *counts = user;
  counts[0]++;
  counts[1] += ray->chord_count;
  return VT_OK;
}

// Room for what a sample of the rays promises, so that growing and copying is the exception.
static vt_status reserve_lane(collect_job *job, int lane_number) {
  size_t counts[2] = {0, 0};
  for (int view = 0; view < job->rays->views->count; view++)
    (void)walk_view((packet){.rays = job->rays, .lane = lane_number, .view = view, .parts = 1, .visit = count_ray, .user = counts},
                    BAND_ROWS);
  vt_ray_lane *lane = &job->rays->lanes[lane_number];
  size_t scale = BAND_ROWS * BAND_ROWS;
  return make_room(job, lane, counts[0] * scale + counts[0] + 4096, counts[1] * scale + counts[1] + 65536);
}

static void collect_lanes(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  collect_job *job = user;
  for (size_t i = begin; i < end; i++) {
    vt_ray_lane *lane = &job->rays->lanes[i];
    job->status[i] = reserve_lane(job, (int)i);
    for (int view = 0; view < job->rays->views->count && !job->status[i]; view++) {
      job->status[i] =
          walk_view((packet){.rays = job->rays, .lane = (int)i, .view = view, .parts = 1, .visit = keep_ray, .user = job}, 1);
      lane->first_ray[view + 1] = lane->ray_count;
      lane->first_chord[view + 1] = lane->chord_count;
    }
  }
}

static void forget_kept(vt_context *context, vt_rays *rays) {
  for (int i = 0; i < VT_LANES; i++) {
    vt_ray_lane *lane = &rays->lanes[i];
    vt_free(context, lane->rays);
    vt_free(context, lane->chords);
    lane->rays = NULL;
    lane->chords = NULL;
  }
  rays->kept = false;
}

typedef struct mark_job {
  vt_context *context;
  vt_rays *rays;
  int level;
} mark_job;

static void mark_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  mark_job *job = user;
  for (size_t v = begin; v < end; v++) // without memory `marked` stays NULL
    (void)vt_mark_blocks(job->context, job->rays->octree, job->level, &job->rays->views->cameras[v], &job->rays->blocks[v]);
}

static vt_status mark_all_blocks(vt_context *context, vt_rays *rays, int coarse_level) {
  size_t count = (size_t)rays->views->count;
  rays->blocks = VT_NEW(context, vt_pixel_blocks, count);
  if (!rays->blocks) return VT_OUT_OF_MEMORY;
  vt_status status = vt_parallel(context, count, 1, mark_some, &(mark_job){context, rays, coarse_level});
  for (size_t v = 0; v < count && !status; v++)
    if (!rays->blocks[v].marked) status = VT_OUT_OF_MEMORY;
  return status;
}

vt_status vt_collect_rays(vt_context *context, const vt_octree *octree, int level, int coarse_level,
                          const vt_reduced_views *views, uint64_t memory_bound, vt_rays *out) {
  VT_ASSERT(coarse_level >= 0 && coarse_level <= level);
  size_t max = vt_max_segments(&octree->levels[level]), count = (size_t)views->count;
  *out = (vt_rays){.octree = octree, .views = views, .level = level, .path = vt_best_walk_path()};
  out->lanes = vt_alloc(context, VT_LANES, sizeof(vt_ray_lane));
  if (!out->lanes) return VT_OUT_OF_MEMORY;
  bool there = true;
  for (int i = 0; i < VT_LANES; i++) {
    vt_ray_lane *lane = &out->lanes[i];
    lane->scratch = VT_NEW(context, vt_chord, max * VT_PACKET_RAYS);
    lane->capacity = max;
    lane->first_ray = VT_NEW(context, size_t, count + 1);
    lane->first_chord = VT_NEW(context, size_t, count + 1);
    there = there && lane->scratch && lane->first_ray && lane->first_chord;
  }
  collect_job job = {.context = context, .rays = out, .lane_bound = memory_bound / VT_LANES};
  vt_status status = there ? mark_all_blocks(context, out, coarse_level) : VT_OUT_OF_MEMORY;
  if (!status) status = vt_parallel(context, VT_LANES, 1, collect_lanes, &job);
  out->kept = true;
  for (int i = 0; i < VT_LANES; i++) out->kept = out->kept && !job.status[i];
  if (!status && !out->kept) {
    forget_kept(context, out);
    vt_clear_error(context); // the bound was met: not an error, only slower
    vt_log(context, VT_LOG_VERBOSE, "level %d: its rays need more than %.0f MB and are walked anew each time", level,
           (double)memory_bound / 1e6);
  }
  if (status) vt_free_rays(context, out);
  return status;
}

void vt_free_rays(vt_context *context, vt_rays *rays) {
  if (!rays->lanes) return;
  forget_kept(context, rays);
  for (int i = 0; i < VT_LANES; i++) {
    vt_free(context, rays->lanes[i].scratch);
    vt_free(context, rays->lanes[i].first_ray);
    vt_free(context, rays->lanes[i].first_chord);
  }
  for (int v = 0; v < rays->views->count && rays->blocks; v++) vt_free(context, rays->blocks[v].marked);
  vt_free(context, rays->blocks);
  vt_free(context, rays->lanes);
  *rays = (vt_rays){0};
}

typedef struct renumber_job {
  const vt_rays *rays;
  const uint32_t *new_index;
} renumber_job;

static void renumber_lanes(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  renumber_job *job = user;
  for (size_t i = begin; i < end; i++) {
    vt_ray_lane *lane = &job->rays->lanes[i];
    size_t ray_out = 0, chord_in = 0, chord_out = 0, ray_in = 0;
    for (int view = 0; view < job->rays->views->count; view++) {
      size_t last = lane->first_ray[view + 1];
      lane->first_ray[view] = ray_out;
      lane->first_chord[view] = chord_out;
      for (; ray_in < last; ray_in++) {
        kept_ray ray = lane->rays[ray_in];
        size_t start = chord_out;
        for (size_t k = 0; k < ray.chord_count; k++, chord_in++) {
          uint32_t cell = job->new_index[lane->chords[chord_in].cell];
          if (cell != VT_NO_CELL) lane->chords[chord_out++] = (vt_chord){cell, lane->chords[chord_in].length};
        }
        ray.chord_count = (uint32_t)(chord_out - start);
        if (ray.chord_count) lane->rays[ray_out++] = ray;
      }
    }
    lane->first_ray[job->rays->views->count] = lane->ray_count = ray_out;
    lane->first_chord[job->rays->views->count] = lane->chord_count = chord_out;
  }
}

void vt_renumber_rays(vt_context *context, vt_rays *rays, const uint32_t *new_index) {
  if (!rays->kept) return;
  (void)vt_parallel(context, VT_LANES, 1, renumber_lanes, &(renumber_job){rays, new_index});
  for (int i = 0; i < VT_LANES; i++) { // give back what the dropped cells took
    vt_ray_lane *lane = &rays->lanes[i];
    if (lane->chord_count > lane->chord_capacity / 2) continue;
    vt_chord *fewer = vt_realloc(context, lane->chords, lane->chord_count, sizeof *fewer);
    if (!fewer) { // no room for a moment's copy: the larger block stays
      vt_clear_error(context);
      continue;
    }
    lane->chords = fewer;
    lane->chord_capacity = lane->chord_count;
  }
}

typedef struct sweep_job {
  const vt_rays *rays;
  const int *chosen;
  int chosen_count, parts, part;
  vt_ray_visitor visit;
  void *user;
} sweep_job;

static vt_status pass_on(void *user, const vt_swept_ray *ray) {
  sweep_job *job = user;
  job->visit(job->user, ray);
  return VT_OK;
}

static void sweep_kept(const sweep_job *job, int lane_number, int view) {
  const vt_ray_lane *lane = &job->rays->lanes[lane_number];
  const vt_image *picture = &job->rays->views->pictures[view];
  const vt_chord *chords = lane->chords + lane->first_chord[view];
  for (size_t i = lane->first_ray[view]; i < lane->first_ray[view + 1]; i++) {
    const kept_ray *ray = &lane->rays[i];
    const uint8_t *pixel = picture->pixels + 4 * ((size_t)ray->y * (size_t)picture->width + ray->x);
    if ((ray->x + ray->y) % job->parts == job->part)
      job->visit(job->user, &(vt_swept_ray){lane_number, view, ray->x, ray->y, pixel, chords, ray->chord_count});
    chords += ray->chord_count;
  }
}

static void sweep_lanes(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  sweep_job *job = user;
  for (int lane = (int)begin; lane < (int)end; lane++)
    for (int i = 0; i < job->chosen_count; i++) {
      int view = job->chosen ? job->chosen[i] : i;
      if (job->rays->kept)
        sweep_kept(job, lane, view);
      else
        (void)walk_view((packet){.rays = job->rays,
                                 .lane = lane,
                                 .view = view,
                                 .parts = job->parts,
                                 .part = job->part,
                                 .visit = pass_on,
                                 .user = job},
                        1);
    }
}

vt_status vt_sweep_part(vt_context *context, const vt_rays *rays, const int *chosen, int chosen_count, int parts,
                        int part, vt_ray_visitor visit, void *user) {
  VT_ASSERT(parts >= 1 && part >= 0 && part < parts);
  sweep_job job = {rays, chosen, chosen ? chosen_count : rays->views->count, parts, part, visit, user};
  return vt_parallel(context, VT_LANES, 1, sweep_lanes, &job);
}

vt_status vt_sweep_rays(vt_context *context, const vt_rays *rays, const int *chosen, int chosen_count,
                        vt_ray_visitor visit, void *user) {
  return vt_sweep_part(context, rays, chosen, chosen_count, 1, 0, visit, user);
}

typedef struct add_job {
  float *lanes, *out;
  size_t count;
} add_job;

static void add_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  add_job *job = user;
  for (size_t i = begin; i < end; i++) {
    float sum = 0;
    for (size_t lane = 0; lane < VT_LANES; lane++) {
      sum += job->lanes[lane * job->count + i];
      job->lanes[lane * job->count + i] = 0;
    }
    job->out[i] = sum;
  }
}

vt_status vt_add_lanes(vt_context *context, float *lanes, size_t count, float *out) {
  return vt_parallel(context, count, 16384, add_some, &(add_job){lanes, out, count});
}
