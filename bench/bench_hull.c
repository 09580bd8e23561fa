// bench_hull.c - seconds of bounds and visual hull, coarse to fine, on a capture or on photographs of a grown tree
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_hull CAPTURE [LEVEL [THREADS]]    the training views of a capture
//   build/bench/bench/bench_hull N [LEVEL [THREADS]]          N exact views of 800 x 800 of a small oak
//
// Silhouettes are made anew for each level at four pixels a cell, as reconstruct.c does. CPU seconds are of all threads.

#include "capture/capture.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/bounds.h"
#include "reconstruct/hull.h"

static vt_status load(vt_context *context, const char *source, vt_views *out) {
  if (atoi(source) > 0) {
    vt_synthetic_desc desc = vt_default_synthetic_desc();
    desc.kind = VT_SYNTHETIC_SMALL_OAK;
    desc.train_count = atoi(source), desc.test_count = 0;
    desc.width = desc.height = 800;
    return vt_make_synthetic_views(context, &desc, out);
  }
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = source;
  return vt_load_views(context, &desc, out, NULL);
}

// Pixels across a cell of that level, where the cube's centre stands in the first view.
static double cell_pixels(const vt_octree *o, const vt_views *views, int level) {
  const vt_camera *camera = &views->items[0].camera;
  vt_vec3 centre = vt_add(o->origin, vt_v3(o->edge / 2, o->edge / 2, o->edge / 2));
  return camera->fx * o->edge / (1 << level) / vt_to_camera(camera, centre).z;
}

static vt_status carve_level(vt_context *context, const vt_views *views, vt_octree *o, int level) {
  int factor = (int)(cell_pixels(o, views, level) / 4);
  vt_silhouettes silhouettes;
  vt_status status = vt_make_silhouettes(context, views, factor < 1 ? 1 : factor, 2, &silhouettes);
  if (status) return status;
  vt_level kept = {0}, *cells = &o->levels[level];
  uint8_t *keep = VT_NEW(context, uint8_t, cells->cell_count);
  status = keep ? vt_carve(context, &silhouettes, o, level, keep) : VT_OUT_OF_MEMORY;
  if (!status) status = vt_filter_level(context, 2, level, cells, keep, &kept);
  vt_free(context, keep);
  vt_free_silhouettes(context, &silhouettes);
  if (status) return status;
  vt_free_level(context, cells);
  *cells = kept;
  return VT_OK;
}

static vt_status carve(vt_context *context, const vt_views *views, int last) {
  const uint16_t root[1][3] = {{0, 0, 0}};
  double wall = vt_seconds(), cpu = vt_cpu_seconds();
  vt_octree o = {.branching = 2, .level_count = last + 1};
  vt_status status = vt_find_bounds(context, views, &o);
  if (!status) status = vt_make_level(context, 2, 0, 1, root, &o.levels[0]);
  printf("%d views, bounds %.2f s wall, %.2f s CPU\n"
         "level   examined       kept   s wall    s CPU   (sums of all levels so far)\n",
         views->count, vt_seconds() - wall, vt_cpu_seconds() - cpu);
  wall = vt_seconds(), cpu = vt_cpu_seconds();
  for (int level = 0; level <= last && !status; level++) {
    if (level) status = vt_split_level(context, 2, level - 1, &o.levels[level - 1], NULL, &o.levels[level]);
    uint32_t examined = o.levels[level].cell_count;
    if (!status) status = carve_level(context, views, &o, level);
    printf("%5d %10u %10u %8.2f %8.2f\n", level, examined, o.levels[level].cell_count, vt_seconds() - wall,
           vt_cpu_seconds() - cpu);
  }
  vt_free_octree(context, &o);
  return status;
}

int main(int count, char **arguments) {
  if (count < 2) return VT_BAD_USAGE;
  vt_context_desc desc = vt_default_context_desc();
  if (count > 3) desc.thread_count = atoi(arguments[3]);
  vt_context *context = vt_create_context(&desc);
  vt_views views = {0}, train = {0};
  vt_status status = context ? load(context, arguments[1], &views) : VT_FAILED;
  if (!status) status = vt_select_views(context, &views, VT_TRAIN, &train);
  if (!status) status = carve(context, &train, count > 2 ? atoi(arguments[2]) : 8);
  if (status && context) fprintf(stderr, "%s\n", vt_last_error(context));
  vt_free(context, train.items);
  vt_free_views(context, &views);
  vt_destroy_context(context);
  return (int)status;
}
