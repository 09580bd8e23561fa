// bench_ray_walk.c - rays and cells a second on one core, ray by ray and in packets, on a hollow crown at levels 5 to 9
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_ray_walk [PICTURE EDGE]     prints a table; compare rows of one run, machines differ
//
// A cell step is a cell that a ray meets within a brick that holds cells, occupied or not; empty bricks cost time and count
// for nothing. Steps are counted by a walk through the same level with all cells of such bricks filled. Times include
// making the rays from the camera.

#include "base/rng.h"
#include "octree/octree.h"

// Cells of a shell with holes, about the share of a tree's crown that holds leaves.
static vt_status make_crown(vt_context *context, int level, vt_octree *out) {
  int n = 1 << level;
  *out = (vt_octree){.edge = 1, .branching = 2, .level_count = level + 1};
  uint16_t(*xyz)[3] = vt_alloc(context, (size_t)n * (size_t)n * (size_t)n / 4 + 64, sizeof *xyz);
  if (!xyz) return VT_OUT_OF_MEMORY;
  size_t count = 0;
  vt_rng rng = vt_seed_rng(1, 1);
  for (int z = 0; z < n; z++)
    for (int y = 0; y < n; y++)
      for (int x = 0; x < n; x++) {
        double r = vt_length(vt_v3((x + 0.5) / n - 0.5, (y + 0.5) / n - 0.5, (z + 0.5) / n - 0.5));
        if (r > 0.32 && r < 0.48 && vt_random_unit(&rng) < 0.2) {
          xyz[count][0] = (uint16_t)x, xyz[count][1] = (uint16_t)y, xyz[count][2] = (uint16_t)z;
          count++;
        }
      }
  vt_status status = vt_make_level(context, 2, level, count, (const uint16_t(*)[3])xyz, &out->levels[level]);
  vt_free(context, xyz);
  return status;
}

// The level with every brick filled that holds a cell.
static vt_status fill_bricks(vt_context *context, const vt_octree *from, int level, vt_octree *out) {
  const vt_level *cells = &from->levels[level];
  *out = *from;
  uint16_t(*xyz)[3] = vt_alloc(context, (size_t)cells->brick_count * 64, sizeof *xyz);
  if (!xyz) return VT_OUT_OF_MEMORY;
  size_t count = 0;
  for (uint32_t b = 0; b < cells->brick_count; b++) {
    uint32_t i = cells->bricks[b].first;
    for (unsigned k = 0; k < 64; k++, count++) {
      xyz[count][0] = (uint16_t)((cells->x[i] & ~3u) + k % 4);
      xyz[count][1] = (uint16_t)((cells->y[i] & ~3u) + k / 4 % 4);
      xyz[count][2] = (uint16_t)((cells->z[i] & ~3u) + k / 16);
    }
  }
  vt_status status = vt_make_level(context, 2, level, count, (const uint16_t(*)[3])xyz, &out->levels[level]);
  vt_free(context, xyz);
  return status;
}

static const char *const WORDS[] = {"plain", "AVX2", "AVX-512"};

typedef struct walk_bench {
  const vt_octree *octree;
  int level, edge;       // pixels of the picture's edge
  vt_camera camera;
  vt_chord *chords;      // room of a packet
  vt_segment *segments;
} walk_bench;

// Occupied cells met by all rays; path < 0: ray by ray.
static size_t walk_picture(const walk_bench *b, int path, double *sum) {
  size_t met = 0, capacity = vt_max_segments(&b->octree->levels[b->level]);
  for (int y = 0; y < b->edge; y++)
    for (int x = 0; x < b->edge; x += VT_PACKET_RAYS) {
      vt_ray rays[VT_PACKET_RAYS];
      uint32_t count[VT_PACKET_RAYS];
      int n = b->edge - x < VT_PACKET_RAYS ? b->edge - x : VT_PACKET_RAYS;
      for (int i = 0; i < n; i++) rays[i] = vt_camera_ray(&b->camera, x + i + 0.5, y + 0.5);
      if (path >= 0) {
        vt_walk_rays(b->octree, b->level, (vt_walk_path)path, rays, n, b->chords, capacity, count);
        for (int i = 0; i < n; i++) met += count[i];
      } else {
        for (int i = 0; i < n; i++) met += vt_walk_ray(b->octree, b->level, &rays[i], b->segments);
      }
    }
  *sum += (double)met;
  return met;
}

static int compare_doubles(const void *a, const void *b) {
  double p = *(const double *)a, q = *(const double *)b;
  return p < q ? -1 : p > q;
}

#define ROUNDS 5

static void time_paths(walk_bench *b, size_t steps) {
  double seconds[4][ROUNDS], sum = 0;
  size_t met[4];
  int best = (int)vt_best_walk_path();
  for (int round = 0; round < ROUNDS; round++)
    for (int path = -1; path <= best; path++) {
      double start = vt_cpu_seconds();
      met[path + 1] = walk_picture(b, path, &sum);
      seconds[path + 1][round] = vt_cpu_seconds() - start;
    }
  double rays = (double)b->edge * b->edge, reference = 0;
  for (int path = -1; path <= best; path++) {
    qsort(seconds[path + 1], ROUNDS, sizeof(double), compare_doubles);
    double s = seconds[path + 1][ROUNDS / 2];
    if (path < 0) reference = s;
    printf("%5d %9u  %-10s %9.2f %12.1f %14.1f %10.2f\n", b->level, b->octree->levels[b->level].cell_count,
           path < 0 ? "ray by ray" : WORDS[path], rays / s * 1e-6, (double)steps / s * 1e-6,
           (double)met[path + 1] / s * 1e-6, reference / s);
  }
}

static vt_status time_level(vt_context *context, int level, int edge) {
  vt_octree octree = {0}, filled = {0};
  vt_status status = make_crown(context, level, &octree);
  if (!status) status = fill_bricks(context, &octree, level, &filled);
  size_t capacity = status ? 0 : vt_max_segments(&octree.levels[level]);
  walk_bench b = {&octree, level, edge, vt_look_at(vt_v3(2.2, 0.4, 0.9), vt_v3(0.5, 0.5, 0.5), vt_v3(0, 0, 1), 0.6, edge, edge),
                  VT_NEW(context, vt_chord, capacity * VT_PACKET_RAYS), VT_NEW(context, vt_segment, capacity)};
  if (!status && (!b.chords || !b.segments)) status = VT_OUT_OF_MEMORY;
  if (!status) {
    double sum = 0;
    b.octree = &filled;
    size_t steps = walk_picture(&b, (int)vt_best_walk_path(), &sum);
    b.octree = &octree;
    time_paths(&b, steps);
  }
  vt_free(context, b.chords);
  vt_free(context, b.segments);
  vt_free_octree(context, &octree);
  vt_free_octree(context, &filled);
  return status;
}

int main(int count, char **arguments) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  vt_context *context = vt_create_context(&desc);
  int edge = count > 1 ? atoi(arguments[1]) : 1000;
  vt_status status = context && edge > 0 && edge < 65536 ? VT_OK : VT_BAD_USAGE;
  printf("level     cells  walk        M rays/s  M steps/s  M occupied/s   times   (one core, median of %d)\n", ROUNDS);
  for (int level = 5; level <= 9 && !status; level++) status = time_level(context, level, edge);
  vt_destroy_context(context);
  return (int)status;
}
