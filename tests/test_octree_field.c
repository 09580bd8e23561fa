// test_octree_field.c - corners, the field along a ray, views' textures, and pictures of them
// SPDX-License-Identifier: BSD-3-Clause

#include "octree/field.h"
#include "tests/field_scenes.h"

#define ROOM 4096

typedef struct sample_room {
  float along[ROOM], inside[ROOM][4], value[ROOM][4], log_ratio[ROOM];
} sample_room;

static vt_field_samples samples_in(sample_room *room) {
  return (vt_field_samples){room->along, room->inside, room->value, room->log_ratio};
}

// Chords of one ray.
static size_t chords_of(const vt_octree *octree, int level, const vt_ray *ray, vt_chord *out, size_t capacity) {
  uint32_t count;
  vt_walk_rays(octree, level, vt_best_walk_path(), ray, 1, out, capacity, &count);
  return count;
}

static void both_instances_give_the_same_bits(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_rng rng = vt_seed_rng(3, 1);
  sample_room *a = VT_NEW(context, sample_room, 1), *b = VT_NEW(context, sample_room, 1);
  size_t met = 0;
  for (int round = 0; round < 6; round++) {
    vt_tree tree = scene_field_tree(context, 5, 0.3, 5, (uint64_t)round, round % 3 != 1, true);
    const vt_level *cells = &tree.octree.levels[5];
    if (round > 2) scene_cut_textures(&tree, 5, &rng);
    size_t capacity = vt_max_segments(cells);
    vt_chord *chords = VT_NEW(context, vt_chord, capacity);
    for (int i = 0; i < 600; i++) {
      vt_ray ray = scene_random_ray(&rng);
      size_t count = chords_of(&tree.octree, 5, &ray, chords, capacity);
      vt_field_ray entered = vt_enter_root(&tree.octree, 5, &ray);
      vt_field_view views[5];
      vt_field_sight sights[5];
      for (int v = 0; v < 5; v++)
        views[v] = vt_aim_field_view(&tree.octree, 5, &tree.cameras[v], tree.view_textures[5].factor,
                                     &tree.view_textures[5].views[v], 0.1f + 0.2f * v);
      int sight_count = vt_aim_sights(&entered, views, i % 6, sights);
      vt_field_samples to_a = samples_in(a), to_b = samples_in(b);
      memset(a, 0xff, sizeof *a);
      memset(b, 0xff, sizeof *b);
      vt_sample_field_plain(cells, &entered, chords, count, &to_a);
      vt_sample_ratios_plain(sights, sight_count, a->along, count, a->log_ratio);
      vt_sample_field_avx2(cells, &entered, chords, count, &to_b);
      vt_sample_ratios_avx2(sights, sight_count, b->along, count, b->log_ratio);
      assert_memory_equal(a, b, sizeof *a); // and nothing is written behind the chords
      met += count;
    }
    vt_free(context, chords);
    vt_free_tree(context, &tree);
  }
  assert_true(met > 3000);
  vt_free(context, a);
  vt_free(context, b);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(both_instances_give_the_same_bits),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
