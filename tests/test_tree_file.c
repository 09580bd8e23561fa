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

static void assert_same_field(const vt_tree *a, const vt_tree *b, int l, double depth_error) {
  const vt_level *s = &a->octree.levels[l], *t = &b->octree.levels[l];
  assert_int_equal(s->corner_count, t->corner_count);
  if (s->corner_count) assert_memory_equal(s->corner_of, t->corner_of, 32 * (size_t)s->cell_count);
  for (size_t i = 0; i < 4 * (size_t)s->corner_count; i++)
    assert_close(t->corner_values[i], s->corner_values[i], i % 4 ? 0 : depth_error * s->corner_values[i]);
  const vt_view_textures *p = &a->view_textures[l], *q = &b->view_textures[l];
  assert_int_equal(p->view_count, q->view_count);
  assert_int_equal(p->factor, q->factor);
  for (int v = 0; v < p->view_count; v++) {
    const vt_view_texture *m = &p->views[v], *n = &q->views[v];
    assert_true(m->width == n->width && m->height == n->height && m->left == n->left && m->top == n->top);
    assert_true(m->columns == n->columns && m->rows == n->rows && m->linear == n->linear);
    if (m->columns) assert_memory_equal(m->codes, n->codes, (size_t)(m->columns * m->rows));
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
  assert_same_book(&a->field_codebook, &b->field_codebook, 1);
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
    assert_same_field(a, b, l, depth_error);
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

static void assert_coarse_first(int case_index, const char *first, size_t first_count) {
  vt_context *context = make_context();
  size_t size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[case_index], &size);
  int level = 0;
  for (size_t i = 0; i < chunk_count(bytes); i++) {
    const uint8_t *entry = chunk_entry(bytes, i);
    if (i < first_count) assert_memory_equal(entry, first + 4 * i, 4);
    assert_in_range(entry[4], level, level + 1);
    level = entry[4];
  }
  assert_int_equal(level, tree_cases[case_index].level_count - 1);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void a_prefix_of_the_file_is_a_coarse_tree(void **state) {
  (void)state;
  assert_coarse_first(1, "METATREECAMSCBKACBKCCELL", 6);
  assert_coarse_first(9, "METATREECAMSCBKFCELLOPACCOLRCELLCOPACCOLCELLCOPACCOLVIDXVCODCELLCOPACCOLVIDXVCOD", 20);
}

static void a_file_says_the_least_version_that_has_its_chunks(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int i = 0; i < TREE_CASE_COUNT; i++) {
    size_t size;
    uint8_t *bytes = bytes_of_case(context, &tree_cases[i], &size);
    assert_int_equal(get_number(bytes + 8, 2), 1);
    assert_int_equal(get_number(bytes + 10, 2), has_field(&tree_cases[i]));
    vt_free(context, bytes);
  }
  vt_destroy_context(context);
}

static void the_report_says_the_bytes_of_each_level(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_tree tree;
  vt_file_report report;
  make_tree(context, &tree_cases[8], &tree);
  assert_int_equal(vt_write_tree(context, &tree, scratch_path(), &report), VT_OK);
  uint64_t field = 0, views = 0;
  for (int l = 0; l <= VT_MAX_LEVEL; l++) {
    assert_int_equal(report.level_field_bytes[l] > 0, l >= 1 && l <= 3);
    assert_int_equal(report.level_view_bytes[l] > 0, l >= 2 && l <= 3);
    field += report.level_field_bytes[l], views += report.level_view_bytes[l];
  }
  assert_true(field == report.field_bytes && views == report.view_bytes && report.texel_bytes == 0);
  remove(scratch_path());
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void depths_on_few_rungs_come_back_bit_for_bit(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int steps = 1; steps <= 18; steps++) {
    if (18 % steps) continue;
    vt_tree tree, back;
    vt_rng rng = vt_seed_rng(8, (uint64_t)steps);
    make_tree(context, &tree_cases[9], &tree);
    vt_level *level = &tree.octree.levels[3];
    float before[4096];
    for (uint32_t i = 0; i < level->corner_count; i++)
      before[i] = level->corner_values[4 * i] = (float)(1e-5 * pow(1e6, vt_random_unit(&rng)));
    vt_snap_depths(level->corner_values, 4, level->corner_count, 1e-3f, steps);
    for (uint32_t i = 0; i < level->corner_count; i++)
      if (before[i] < 1e-3f) assert_true(level->corner_values[4 * i] == 0);
      else assert_close(level->corner_values[4 * i] / before[i], 1, exp2(0.5001 / steps) - 1);
    vt_cells_from_corners(level);
    size_t size;
    uint8_t *bytes = bytes_of(context, &tree, &size);
    assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &back, NULL), VT_OK);
    assert_memory_equal(level->corner_values, back.octree.levels[3].corner_values, 16 * (size_t)level->corner_count);
    assert_memory_equal(level->optical_depth, back.octree.levels[3].optical_depth, 4 * (size_t)level->cell_count);
    vt_free(context, bytes);
    vt_free_tree(context, &tree);
    vt_free_tree(context, &back);
  }
  vt_destroy_context(context);
}

static void a_copy_has_corners_and_view_textures_of_its_own(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_tree tree, copy;
  make_tree(context, &tree_cases[8], &tree);
  assert_int_equal(vt_copy_tree_without_tiles(context, &tree, &copy), VT_OK);
  assert_same_tree(&tree, &copy, 0);
  assert_true(copy.octree.levels[3].corner_values != tree.octree.levels[3].corner_values);
  assert_true(copy.view_textures[3].views[0].codes != tree.view_textures[3].views[0].codes);
  vt_free_tree(context, &tree);
  vt_free_tree(context, &copy);
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

static const int golden_cases[] = {0, 1, 2, 4, 8, 9, 10}; // raw, packed, trigrid, orphans; since 1.1 the two fields, textured_cells

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
      cmocka_unit_test(a_file_says_the_least_version_that_has_its_chunks),
      cmocka_unit_test(the_report_says_the_bytes_of_each_level),
      cmocka_unit_test(depths_on_few_rungs_come_back_bit_for_bit),
      cmocka_unit_test(a_copy_has_corners_and_view_textures_of_its_own),
      cmocka_unit_test(coded_depths_are_off_by_at_most_two_per_cent_over_the_whole_range_of_float),
      cmocka_unit_test(a_tree_that_cannot_be_written_leaves_no_file),
      cmocka_unit_test(files_of_version_1_stay_readable),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
