// bench_field.c - nanoseconds a chord for sampling a field and the views' textures, and a picture, on one core
// SPDX-License-Identifier: BSD-3-Clause
//
//   build/bench/bench/bench_field [PICTURE EDGE]     prints a table; compare rows of one run, machines differ
//
// The level is a hollow crown of clumps. `walk` finds the chords of all rays; `field` is what vt_sample_field adds to it and
// `ratio` what vt_sample_ratios adds, by chord (and view); `picture` is vt_composite, whose rays end where nothing shines
// through. Each row is the median of some rounds.

#include "base/rng.h"
#include "octree/field.h"

#define VIEWS 8
#define ROUNDS 5

static vt_status make_crown(vt_context *context, int level, vt_octree *out) {
  int n = 1 << level;
  *out = (vt_octree){.edge = 1, .branching = 2, .level_count = level + 1};
  uint16_t(*xyz)[3] = vt_alloc(context, (size_t)n * (size_t)n * (size_t)n / 4 + 64, sizeof *xyz);
  if (!xyz) return VT_OUT_OF_MEMORY;
  size_t count = 0;
  for (int z = 0; z < n; z++)
    for (int y = 0; y < n; y++)
      for (int x = 0; x < n; x++) {
        double r = vt_length(vt_v3((x + 0.5) / n - 0.5, (y + 0.5) / n - 0.5, (z + 0.5) / n - 0.5));
        vt_rng clump = vt_seed_rng(5, (uint64_t)(x / 4 + 1000 * (y / 4) + 1000000 * (z / 4)));
        if (r < 0.2 || r > 0.48 || vt_random_unit(&clump) > 0.3 || vt_random_unit(&clump) > 0.7) continue;
        vt_rng cell = vt_seed_rng(6, (uint64_t)(x + 1000 * y + 1000000 * z));
        if (vt_random_unit(&cell) > 0.7) continue;
        xyz[count][0] = (uint16_t)x, xyz[count][1] = (uint16_t)y, xyz[count][2] = (uint16_t)z;
        count++;
      }
  vt_status status = vt_make_level(context, 2, level, count, (const uint16_t(*)[3])xyz, &out->levels[level]);
  vt_free(context, xyz);
  if (!status) status = vt_make_corners(context, 2, &out->levels[level]);
  return status;
}

static vt_status make_tree(vt_context *context, int level, vt_tree *out) {
  *out = (vt_tree){.texel_edge = 4, .tile_side = 1.5f, .view_count = VIEWS, .cameras = VT_NEW(context, vt_camera, VIEWS)};
  vt_view_textures *textures = &out->view_textures[level];
  *textures = (vt_view_textures){VIEWS, 2, VT_NEW(context, vt_view_texture, VIEWS)};
  if (!out->cameras || !textures->views) return VT_OUT_OF_MEMORY;
  vt_rng rng = vt_seed_rng(7, 1);
  int width = 4 << level, half = width / 2;
  for (int v = 0; v < VIEWS; v++) {
    double t = 2 * VT_PI * v / VIEWS;
    out->cameras[v] = vt_look_at(vt_v3(0.5 + 2 * cos(t), 0.5 + 2 * sin(t), 0.8), vt_v3(0.5, 0.5, 0.5), vt_v3(0, 0, 1), 0.6,
                                 width, width);
    vt_view_texture *texture = &textures->views[v];
    *texture = (vt_view_texture){half, half, 10, 10, half - 20, half - 20, NULL, false};
    size_t size = (size_t)texture->columns * (size_t)texture->rows;
    texture->codes = VT_NEW(context, uint8_t, size);
    if (!texture->codes) return VT_OUT_OF_MEMORY;
    for (size_t i = 0; i < size; i++) texture->codes[i] = (uint8_t)(vt_random(&rng) & 255);
  }
  vt_status status = make_crown(context, level, &out->octree);
  vt_level *cells = &out->octree.levels[level];
  for (size_t i = 0; !status && i < 4 * (size_t)cells->corner_count; i++)
    cells->corner_values[i] = (float)vt_random_unit(&rng);
  if (!status) vt_cells_from_corners(cells);
  return status;
}

typedef struct sample_bench {
  const vt_tree *tree;
  int level, view_count;
  bool plain, sample;
  const vt_camera *camera;
  vt_chord *chords;
  size_t capacity;
  vt_field_view views[VIEWS];
  vt_field_samples samples;
} sample_bench;

static size_t sample_ray(sample_bench *b, const vt_ray *ray, const vt_chord *chords, size_t count, double *sum) {
  const vt_octree *octree = &b->tree->octree;
  if (b->plain) {
    vt_field_ray entered = vt_enter_root(octree, b->level, ray);
    vt_field_sight sights[VT_MAX_BLEND_VIEWS];
    vt_sample_field_plain(&octree->levels[b->level], &entered, chords, count, &b->samples);
    int sight_count = vt_aim_sights(&entered, b->views, b->view_count, sights);
    if (b->view_count) vt_sample_ratios_plain(sights, sight_count, b->samples.along, count, b->samples.log_ratio);
  } else {
    vt_sample_field(octree, b->level, ray, chords, count, &b->samples);
    if (b->view_count) vt_sample_ratios(octree, b->level, ray, b->views, b->view_count, count, &b->samples);
  }
  if (count) *sum += b->samples.value[count - 1][0] + (b->view_count ? b->samples.log_ratio[count - 1] : 0);
  return count;
}

static size_t sample_picture(sample_bench *b, double *sum) {
  size_t met = 0;
  int edge = b->camera->width;
  for (int y = 0; y < edge; y++)
    for (int x = 0; x < edge; x += VT_PACKET_RAYS) {
      vt_ray rays[VT_PACKET_RAYS];
      uint32_t count[VT_PACKET_RAYS];
      int n = edge - x < VT_PACKET_RAYS ? edge - x : VT_PACKET_RAYS;
      for (int i = 0; i < n; i++) rays[i] = vt_camera_ray(b->camera, x + i + 0.5, y + 0.5);
      vt_walk_rays(&b->tree->octree, b->level, vt_best_walk_path(), rays, n, b->chords, b->capacity, count);
      for (int i = 0; i < n; i++) {
        met += count[i];
        if (b->sample) sample_ray(b, &rays[i], b->chords + (size_t)i * b->capacity, count[i], sum);
      }
    }
  return met;
}

static int compare_doubles(const void *a, const void *b) {
  double p = *(const double *)a, q = *(const double *)b;
  return p < q ? -1 : p > q;
}

static double median_seconds(sample_bench *b, size_t *met) {
  double seconds[ROUNDS], sum = 0;
  for (int round = 0; round < ROUNDS; round++) {
    double start = vt_cpu_seconds();
    *met = sample_picture(b, &sum);
    seconds[round] = vt_cpu_seconds() - start;
  }
  qsort(seconds, ROUNDS, sizeof(double), compare_doubles);
  return seconds[ROUNDS / 2] + (sum == 0.5 ? 1e-9 : 0); // so that nothing is left out
}

static double picture_seconds(vt_context *context, const sample_bench *b, const vt_view_weights *weights) {
  double seconds[ROUNDS];
  for (int round = 0; round < ROUNDS; round++) {
    vt_fimage image;
    double start = vt_cpu_seconds();
    if (vt_composite(context, b->tree, b->level, weights, VT_BLEND_GEOMETRIC, !weights, b->camera, &image)) return NAN;
    seconds[round] = vt_cpu_seconds() - start;
    vt_free_fimage(context, &image);
  }
  qsort(seconds, ROUNDS, sizeof(double), compare_doubles);
  return seconds[ROUNDS / 2];
}

static void time_paths(vt_context *context, sample_bench *b) {
  size_t met = 0;
  vt_view_weights weights = {.count = 0};
  b->sample = false;
  double walk = median_seconds(b, &met), field[2];
  printf("%5d %9u %9.1f  walk                 %7.2f\n", b->level, b->tree->octree.levels[b->level].cell_count,
         (double)met / ((double)b->camera->width * b->camera->height), walk / (double)met * 1e9);
  b->sample = true;
  for (int plain = 1; plain >= 0; plain--) {
    b->plain = plain;
    b->view_count = 0;
    field[plain] = median_seconds(b, &met);
    printf("%27sfield, %-12s  %7.2f\n", "", plain ? "plain" : "best", (field[plain] - walk) / (double)met * 1e9);
    for (int k = 2; k <= 4; k *= 2) {
      b->view_count = k;
      double all = median_seconds(b, &met);
      printf("%27sratio, %d views, %-5s %6.2f\n", "", k, plain ? "plain" : "best",
             (all - field[plain]) / (double)met / k * 1e9);
    }
  }
  printf("%27spicture, flat        %7.1f ms\n", "", picture_seconds(context, b, NULL) * 1e3);
  for (weights.count = 2; weights.count <= 4; weights.count *= 2) {
    for (int v = 0; v < weights.count; v++) weights.view[v] = v, weights.weight[v] = 1.0f / (float)weights.count;
    printf("%27spicture, %d views     %7.1f ms\n", "", weights.count, picture_seconds(context, b, &weights) * 1e3);
  }
}

static vt_status time_level(vt_context *context, int level, int edge) {
  vt_tree tree;
  vt_status status = make_tree(context, level, &tree);
  vt_camera camera = vt_look_at(vt_v3(2.2, 0.4, 0.9), vt_v3(0.5, 0.5, 0.5), vt_v3(0, 0, 1), 0.6, edge, edge);
  size_t room = status ? 0 : vt_max_segments(&tree.octree.levels[level]);
  sample_bench b = {.tree = &tree, .level = level, .camera = &camera, .capacity = room,
                    .chords = VT_NEW(context, vt_chord, room * VT_PACKET_RAYS)};
  b.samples = (vt_field_samples){VT_NEW(context, float, room), vt_alloc(context, room, 4 * sizeof(float)),
                                 vt_alloc(context, room, 4 * sizeof(float)), VT_NEW(context, float, room)};
  if (!status && (!b.chords || !b.samples.along || !b.samples.inside || !b.samples.value || !b.samples.log_ratio))
    status = VT_OUT_OF_MEMORY;
  for (int v = 0; !status && v < VIEWS; v++)
    b.views[v] = vt_aim_field_view(&tree.octree, level, &tree.cameras[v], tree.view_textures[level].factor,
                                   &tree.view_textures[level].views[v], 0.25f);
  if (!status) time_paths(context, &b);
  vt_free(context, b.chords);
  vt_free(context, b.samples.along);
  vt_free(context, b.samples.inside);
  vt_free(context, b.samples.value);
  vt_free(context, b.samples.log_ratio);
  vt_free_tree(context, &tree);
  return status;
}

int main(int count, char **arguments) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  vt_context *context = vt_create_context(&desc);
  int edge = count > 1 ? atoi(arguments[1]) : 400;
  vt_status status = context && edge > 0 && edge < 65536 ? VT_OK : VT_BAD_USAGE;
  printf("level     cells    a ray  what              ns a chord   (one core, median of %d)\n", ROUNDS);
  for (int level = 6; level <= 8 && !status; level++) status = time_level(context, level, edge);
  vt_destroy_context(context);
  return (int)status;
}
