// bench_ray_walk.c - how many rays and occupied cells a second one core walks, on a hollow crown at levels 5 to 8
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_ray_walk [RAYS]     prints a table; compare rows of one run, machines differ

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

static vt_status time_level(vt_context *context, int level, int rays) {
  vt_octree octree;
  vt_status status = make_crown(context, level, &octree);
  vt_segment *segments = status ? NULL : VT_NEW(context, vt_segment, vt_max_segments(&octree.levels[level]));
  if (segments) {
    vt_camera camera = vt_look_at(vt_v3(2.2, 0.4, 0.9), vt_v3(0.5, 0.5, 0.5), vt_v3(0, 0, 1), 0.6, 1000, 1000);
    vt_rng rng = vt_seed_rng(2, 2);
    size_t met = 0;
    double start = vt_cpu_seconds();
    for (int i = 0; i < rays; i++) {
      vt_ray ray = vt_camera_ray(&camera, vt_random_between(&rng, 0, 1000), vt_random_between(&rng, 0, 1000));
      met += vt_walk_ray(&octree, level, &ray, segments);
    }
    double seconds = vt_cpu_seconds() - start;
    printf("%5d %10u %12.2f %16.1f %14.1f\n", level, octree.levels[level].cell_count, rays / seconds * 1e-6,
           (double)met / seconds * 1e-6, (double)met / rays);
  }
  vt_free(context, segments);
  vt_free_octree(context, &octree);
  return segments ? VT_OK : VT_OUT_OF_MEMORY;
}

int main(int count, char **arguments) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  vt_context *context = vt_create_context(&desc);
  int rays = count > 1 ? atoi(arguments[1]) : 1000000;
  vt_status status = context && rays > 0 ? VT_OK : VT_BAD_USAGE;
  printf("level      cells   M rays / s  M occupied / s  cells a ray   (one core)\n");
  for (int level = 5; level <= 8 && !status; level++) status = time_level(context, level, rays);
  vt_destroy_context(context);
  return (int)status;
}
