// run_plan.c - what the next level will cost, and which cells it comes from
// SPDX-License-Identifier: BSD-3-Clause

#include "reconstruct/run.h"
#include "reconstruct/split.h"

#include <math.h>

#define LARGEST_RAY_STORE (3ull << 29) // bytes
#define LARGEST_SHARE_LEFT 0.05        // of the opacity, in cells that are not split for want of memory

uint64_t vt_ray_bound(const vt_run *r) {
  uint64_t quarter = vt_memory_bound(r->context) / 4;
  if (!r->desc->keep_chords) return 0;
  return quarter < LARGEST_RAY_STORE ? quarter : LARGEST_RAY_STORE;
}

// Of so many cells: tiles for each view, or a field with its sums and moments (three corners to two cells) and two sets
// of view textures.
static uint64_t texture_bytes(const vt_run *r, uint64_t cells) {
  uint64_t tile = 4 * (uint64_t)(r->tree->texel_edge * r->tree->texel_edge), pixels = 0;
  if (!r->recipe.field) return cells * (uint64_t)r->views->count * (tile + 5);
  for (int i = 0; i < r->views->count; i++)
    pixels += (uint64_t)r->views->items[i].picture.width * (uint64_t)r->views->items[i].picture.height;
  return cells * 3 / 2 * (16 * VT_LANES + 48) + cells * 32 +
         8 * pixels; // with reduced pictures, and pictures of probes
}

// Bytes that a level will take, about: chords of rays, sums of the lanes, and what becomes of the cells that are kept
// (two in five of the hull).
uint64_t vt_level_bytes(const vt_run *r, uint64_t hull_cells) {
  uint64_t chords = hull_cells * (uint64_t)r->views->count * 64, most = vt_ray_bound(r);
  uint64_t bytes =
      (chords < most ? chords : most) + hull_cells * (64 + 16 * VT_LANES) + texture_bytes(r, hull_cells * 2 / 5);
  return r->recipe.field ? bytes + bytes / 3 : bytes; // the split's sums, and the level before, which stays
}

static double growth_of(const vt_run *r) {
  return r->tree->octree.branching == 2 ? 6 : 13;
} // of the cells of a hull

// So many cells can be split within memory.
static uint32_t most_splits(const vt_run *r, int level) {
  uint32_t low = 0, high = r->tree->octree.levels[level].cell_count;
  while (low < high) {
    uint32_t middle = high - (high - low) / 2;
    if (r->bytes_before + vt_level_bytes(r, (uint64_t)(growth_of(r) * middle)) <= vt_memory_bound(r->context))
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

static void end_tree(vt_run *r, int level) {
  uint64_t bytes = vt_level_bytes(r, (uint64_t)(growth_of(r) * r->tree->octree.levels[level].cell_count));
  vt_log(r->context, VT_LOG_NORMAL, "level %d would take about %.0f MB of %.0f MB; the tree ends at level %d",
         level + 1, (double)bytes * 1e-6, (double)vt_memory_bound(r->context) * 1e-6, level);
  r->leaf = level;
}

static void report_split(vt_run *r, int level, const vt_split_report *split) {
  vt_level_report *report = &r->report->levels[level];
  report->unsplit_empty = split->empty;
  report->unsplit_hidden = split->hidden;
  report->unsplit_for_memory = split->for_memory;
  if (split->for_memory)
    vt_log(r->context, VT_LOG_NORMAL,
           "level %d: memory is short, %u of %u cells with %.1f %% of the opacity are not split", level,
           split->for_memory, r->tree->octree.levels[level].cell_count, 100 * split->opacity_left);
}

// Which cells of the solved level the next one comes from. Where too much would have to be left behind for want of
// memory, this level is the last.
vt_status vt_plan_next_level(vt_run *r, int level, const vt_rays *rays) {
  const vt_level *cells = &r->tree->octree.levels[level];
  uint32_t most = level > 3 ? most_splits(r, level) : cells->cell_count;
  if (!r->desc->split_where_needed) {
    if (most < cells->cell_count) end_tree(r, level);
    return VT_OK;
  }
  vt_split_desc desc = vt_default_split_desc();
  vt_split_report split;
  desc.hidden_threshold = (float)r->desc->hidden_threshold;
  desc.most_cells = most;
  r->split = VT_NEW(r->context, uint8_t, cells->cell_count);
  if (!r->split) return VT_OUT_OF_MEMORY;
  vt_status status = vt_choose_splits(r->context, &desc, rays, cells, r->split, &split);
  if (!status && split.split && split.opacity_left <= LARGEST_SHARE_LEFT) {
    report_split(r, level, &split);
    return VT_OK;
  }
  vt_free(r->context, r->split);
  r->split = NULL;
  if (!status && split.split < cells->cell_count) end_tree(r, level);
  return status;
}

// Whether the level after `level`, whose hull is known, can be made within the time that was given, from what the level
// before took. Seconds grow more slowly than cells, since reading and walking rays costs as much for large ones. A
// guess that is too low is no harm: the fit, more than half of a level, ends with its time, and a level too many with
// half a fit shows more than one too few with all of it (maple: 24 dB against 21.9 after 20 s).
bool vt_time_is_left(const vt_run *r, int level, double seconds_before) {
  const vt_level *cells = &r->tree->octree.levels[level];
  if (!(r->desc->time_budget > 0)) return true;
  double left = r->start + r->desc->time_budget - vt_seconds();
  double growth = pow(fmin((double)cells->cell_count / cells[-1].cell_count, growth_of(r)), 0.7);
  return seconds_before * growth * (1 + growth) < 0.95 * left;
}
