// test_tree_file.c - the .vtree file there and back, and the golden bytes of every version
// SPDX-License-Identifier: BSD-3-Clause
//
// `test_tree_file --write-golden FOLDER` writes the golden files; they are only ever added to, when the version changes.
#include "tests/tree_file_bytes.h"
#include "base/byte_codec.h"
#include <float.h>

// ==== there and back =================================================================================================

static void assert_same_tiles(const vt_tree *a, const vt_tree *b, int l) {
  const vt_tiles *s = &a->tiles[l], *t = &b->tiles[l];
  size_t tile_bytes = (size_t)(a->texel_edge * a->texel_edge) * 4;
  assert_int_equal(s->view_count, t->view_count);
  for (size_t i = 0; i < (size_t)s->view_count * s->cell_count; i++) {
    uint32_t m = s->tile_of[i], n = t->tile_of[i];
    assert_int_equal(m == VT_NO_TILE, n == VT_NO_TILE);
    if (m == VT_NO_TILE) continue;
    if (s->texels) assert_memory_equal(s->texels + m * tile_bytes, t->texels + n * tile_bytes, tile_bytes);
    if (s->alpha_code) assert_int_equal(s->alpha_code[m], t->alpha_code[n]);
    if (s->colour_code) assert_int_equal(s->colour_code[m], t->colour_code[n]);
  }
}

static void assert_same_book(const vt_codebook *a, const vt_codebook *b, int texels) {
  assert_int_equal(a->codeword_count, b->codeword_count);
  assert_int_equal(a->channels, b->channels);
  if (a->codewords) assert_memory_equal(a->codewords, b->codewords, (size_t)(a->codeword_count * a->channels * texels));
}

static void assert_same_tree(const vt_tree *a, const vt_tree *b, double depth_error) {
  assert_int_equal(a->octree.level_count, b->octree.level_count);
  assert_int_equal(a->octree.branching, b->octree.branching);
  assert_true(a->octree.edge == b->octree.edge && a->tile_side == b->tile_side);
  assert_memory_equal(&a->octree.origin, &b->octree.origin, sizeof(vt_vec3));
  assert_int_equal(a->texel_edge, b->texel_edge);
  assert_int_equal(a->view_count, b->view_count);
  for (int v = 0; v < a->view_count; v++) assert_memory_equal(&a->cameras[v], &b->cameras[v], sizeof(vt_camera));
  assert_string_equal(a->metadata, b->metadata);
  assert_same_book(&a->alpha_codebook, &b->alpha_codebook, a->texel_edge * a->texel_edge);
  assert_same_book(&a->colour_codebook, &b->colour_codebook, a->texel_edge * a->texel_edge);
  for (int l = 0; l < a->octree.level_count; l++) {
    const vt_level *s = &a->octree.levels[l], *t = &b->octree.levels[l];
    assert_int_equal(s->cell_count, t->cell_count);
    assert_int_equal(s->axis_cells, t->axis_cells);
    for (uint32_t i = 0; i < s->cell_count; i++) {
      assert_true(s->x[i] == t->x[i] && s->y[i] == t->y[i] && s->z[i] == t->z[i]);
      assert_int_equal(vt_find_cell(t, b->octree.branching, s->x[i], s->y[i], s->z[i]), i);
      assert_close(t->optical_depth[i], s->optical_depth[i], depth_error * s->optical_depth[i]);
      for (int k = 0; k < 3; k++) assert_true(s->colour[3 * i + k] == t->colour[3 * i + k]);
    }
    assert_same_tiles(a, b, l);
  }
}

static void a_tree_comes_back_as_it_was(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int i = 0; i < TREE_CASE_COUNT; i++) {
    vt_tree tree, back;
    vt_file_report written, read;
    make_tree(context, &tree_cases[i], &tree);
    assert_int_equal(vt_write_tree(context, &tree, scratch_path(), &written), VT_OK);
    assert_int_equal(vt_read_tree(context, scratch_path(), &back, &read), VT_OK);
    assert_same_tree(&tree, &back, tree_cases[i].packed ? 0.0195 : 0);
    assert_memory_equal(&written, &read, sizeof read);
    vt_free_tree(context, &tree);
    vt_free_tree(context, &back);
    remove(scratch_path());
  }
  vt_destroy_context(context);
}

static void writing_what_was_read_gives_the_same_bytes(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int i = 0; i < TREE_CASE_COUNT; i++) {
    size_t size, size_again;
    vt_tree back;
    uint8_t *bytes = bytes_of_case(context, &tree_cases[i], &size);
    assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &back, NULL), VT_OK);
    uint8_t *again = bytes_of(context, &back, &size_again);
    assert_int_equal(size, size_again);
    assert_memory_equal(bytes, again, size);
    vt_free_tree(context, &back);
    vt_free(context, bytes);
    vt_free(context, again);
  }
  vt_destroy_context(context);
}

static void a_prefix_of_the_file_is_a_coarse_tree(void **state) {
  (void)state;
  vt_context *context = make_context();
  size_t size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[1], &size);
  int level = 0;
  const char *first[] = {"META", "TREE", "CAMS", "CBKA", "CBKC", "CELL"};
  for (size_t i = 0; i < chunk_count(bytes); i++) {
    const uint8_t *entry = chunk_entry(bytes, i);
    if (i < 6) assert_memory_equal(entry, first[i], 4);
    assert_in_range(entry[4], level, level + 1);
    level = entry[4];
  }
  assert_int_equal(level, tree_cases[1].level_count - 1);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void coded_depths_are_off_by_at_most_two_per_cent_over_the_whole_range_of_float(void **state) {
  (void)state;
  vt_context *context = make_context();
  const double lows[] = {0.5, 1e-3, 1e-20, 1.2e-38, 1}, highs[] = {1, 4, 1e3, FLT_MAX, 1.0000001};
  for (size_t round = 0; round < sizeof lows / sizeof lows[0]; round++) {
    vt_tree tree, back;
    vt_rng rng = vt_seed_rng(7, round);
    make_tree(context, &tree_cases[1], &tree);
    vt_level *level = &tree.octree.levels[3];
    for (uint32_t i = 0; i < level->cell_count; i++)
      level->optical_depth[i] = (float)(lows[round] * pow(highs[round] / lows[round], vt_random_unit(&rng)));
    level->optical_depth[0] = 0, level->optical_depth[1] = (float)highs[round], level->optical_depth[2] = 1e-42f;
    size_t size, size_again;
    uint8_t *bytes = bytes_of(context, &tree, &size);
    assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &back, NULL), VT_OK);
    const float *depth = back.octree.levels[3].optical_depth;
    for (uint32_t i = 3; i < level->cell_count; i++)
      assert_close(depth[i], level->optical_depth[i], 0.01945 * (double)level->optical_depth[i]);
    assert_true(depth[0] == 0 && depth[2] == 0); // denormal: nothing
    assert_close(depth[1], highs[round], 0.01945 * highs[round]);
    uint8_t *again = bytes_of(context, &back, &size_again);
    assert_int_equal(size, size_again);
    assert_memory_equal(bytes, again, size);
    vt_free(context, bytes);
    vt_free(context, again);
    vt_free_tree(context, &tree);
    vt_free_tree(context, &back);
  }
  vt_destroy_context(context);
}

static void a_tree_that_cannot_be_written_leaves_no_file(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_tree tree;
  make_tree(context, &tree_cases[0], &tree);
  assert_int_equal(vt_write_tree(context, &tree, "/tmp/voltree no such folder/oak.vtree", NULL), VT_FAILED);
  assert_non_null(strstr(vt_last_error(context), "/tmp/voltree no such folder/oak.vtree"));
  vt_clear_error(context);
  char folder[] = "/tmp/voltree_test_XXXXXX";
  assert_non_null(mkdtemp(folder));
  assert_int_equal(vt_write_tree(context, &tree, folder, NULL), VT_FAILED); // a folder stands where the file should be
  vt_clear_error(context);
  assert_int_equal(rmdir(folder), 0);
  tree.cameras[1].fx = -1;
  assert_int_equal(vt_write_tree(context, &tree, scratch_path(), NULL), VT_BAD_INPUT);
  assert_false(vt_is_file(scratch_path()));
  vt_clear_error(context);
  vt_free_tree(context, &tree);
  vt_tree none;
  assert_int_equal(vt_read_tree(context, "/tmp/voltree no such folder/oak.vtree", &none, NULL), VT_BAD_INPUT);
  vt_free_tree(context, &none); // zeroed
  vt_destroy_context(context);
}

// ==== golden bytes ===================================================================================================

static const int golden_cases[] = {0, 1, 2, 4}; // raw, packed, trigrid, orphans

static void files_of_version_1_stay_readable(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (size_t i = 0; i < sizeof golden_cases / sizeof golden_cases[0]; i++)
    for (int packed = 0; packed <= vt_can_pack_bytes(); packed++) {
      const tree_case *c = &tree_cases[golden_cases[i]];
      char path[sizeof VT_SOURCE_DIR + 64];
      snprintf(path, sizeof path, "%s/tests/golden/v1_%s_%s.vtree", VT_SOURCE_DIR, c->name, packed ? "zstd" : "stored");
      vt_tree golden, tree;
      make_tree(context, c, &tree);
      assert_int_equal(vt_read_tree(context, path, &golden, NULL), VT_OK);
      assert_same_tree(&tree, &golden, c->packed ? 0.0195 : 0);
      if (packed == vt_can_pack_bytes()) { // the writer still makes these bytes (zstd's own may change with its version)
        size_t size, golden_size;
        uint8_t *bytes = bytes_of(context, &tree, &size), *golden_bytes;
        assert_int_equal(vt_read_file(context, path, &golden_bytes, &golden_size), VT_OK);
        assert_int_equal(chunk_count(bytes), chunk_count(golden_bytes));
        if (!packed) assert_int_equal(size, golden_size), assert_memory_equal(bytes, golden_bytes, size);
        vt_free(context, bytes);
        vt_free(context, golden_bytes);
      }
      vt_free_tree(context, &golden);
      vt_free_tree(context, &tree);
    }
  vt_destroy_context(context);
}

static int write_golden(const char *folder) {
  vt_context *context = make_context();
  for (size_t i = 0; i < sizeof golden_cases / sizeof golden_cases[0]; i++) {
    const tree_case *c = &tree_cases[golden_cases[i]];
    char path[4096];
    snprintf(path, sizeof path, "%s/v1_%s_%s.vtree", folder, c->name, vt_can_pack_bytes() ? "zstd" : "stored");
    vt_tree tree;
    make_tree(context, c, &tree);
    if (vt_write_tree(context, &tree, path, NULL)) fprintf(stderr, "%s\n", vt_last_error(context));
    vt_free_tree(context, &tree);
  }
  vt_destroy_context(context);
  return 0;
}

int main(int argc, char **argv) {
  if (argc == 3 && !strcmp(argv[1], "--write-golden")) return write_golden(argv[2]);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_tree_comes_back_as_it_was),
      cmocka_unit_test(writing_what_was_read_gives_the_same_bytes),
      cmocka_unit_test(a_prefix_of_the_file_is_a_coarse_tree),
      cmocka_unit_test(coded_depths_are_off_by_at_most_two_per_cent_over_the_whole_range_of_float),
      cmocka_unit_test(a_tree_that_cannot_be_written_leaves_no_file),
      cmocka_unit_test(files_of_version_1_stay_readable),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
