// test_compress_field.c - fields and view textures of a raw tree to a packed one
// SPDX-License-Identifier: BSD-3-Clause
#include "base/lab.h"
#include "compress/compress.h"
#include "tests/render_scenes.h"
#include "tests/tree_file_bytes.h"

enum { LEVEL = 4 };

// Textures and corners on one level, by default of both kinds.
static vt_tree field_tree(vt_context *context, bool corners, bool views) {
  return scene_field_tree(context, LEVEL, 0.5, 4, corners, views, 5);
}

static bool is_codeword(const vt_codebook *book, const float *colour) {
  for (int j = 0; j < book->codeword_count; j++) {
    const uint8_t *w = book->codewords + 3 * j;
    if (colour[0] == (float)w[0] / 255 && colour[1] == (float)w[1] / 255 && colour[2] == (float)w[2] / 255) return true;
  }
  return false;
}

static int different_codes(const vt_view_textures *textures) {
  bool seen[256] = {0};
  int count = 0;
  for (int v = 0; v < textures->view_count; v++)
    for (int i = 0; i < textures->views[v].columns * textures->views[v].rows; i++) seen[textures->views[v].codes[i]] = true;
  for (int c = 0; c < 256; c++) count += seen[c];
  return count;
}

static void assert_same_level(const vt_tree *a, const vt_tree *b, int number) {
  const vt_level *s = &a->octree.levels[number], *t = &b->octree.levels[number];
  assert_int_equal(s->cell_count, t->cell_count);
  assert_int_equal(s->corner_count, t->corner_count);
  if (s->cell_count) assert_memory_equal(s->optical_depth, t->optical_depth, 4 * (size_t)s->cell_count);
  if (s->cell_count) assert_memory_equal(s->colour, t->colour, 12 * (size_t)s->cell_count);
  if (s->corner_count) assert_memory_equal(s->corner_of, t->corner_of, 32 * (size_t)s->cell_count);
  if (s->corner_count) assert_memory_equal(s->corner_values, t->corner_values, 16 * (size_t)s->corner_count);
  const vt_view_textures *p = &a->view_textures[number], *q = &b->view_textures[number];
  assert_int_equal(p->view_count, q->view_count);
  assert_int_equal(p->factor, q->factor);
  for (int v = 0; v < p->view_count; v++) {
    assert_memory_equal(&p->views[v], &q->views[v], offsetof(vt_view_texture, codes));
    size_t size = (size_t)(p->views[v].columns * p->views[v].rows);
    if (size) assert_memory_equal(p->views[v].codes, q->views[v].codes, size);
  }
}

static void assert_same_packed_tree(const vt_tree *a, const vt_tree *b) {
  assert_int_equal(a->field_codebook.codeword_count, b->field_codebook.codeword_count);
  assert_memory_equal(a->field_codebook.codewords, b->field_codebook.codewords, 3 * (size_t)a->field_codebook.codeword_count);
  for (int l = 0; l < a->octree.level_count; l++) assert_same_level(a, b, l);
}

static void a_packed_field_holds_codewords_few_depths_and_few_codes(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  for (int kind = 1; kind < 4; kind++) {
    bool corners = kind & 1, views = kind & 2;
    vt_tree raw = field_tree(context, corners, views), untouched = field_tree(context, corners, views), packed;
    vt_compress_desc desc = vt_default_compress_desc();
    vt_compress_report report;
    desc.field_colours = 50, desc.ratio_levels = 9;
    assert_int_equal(vt_compress_tree(context, &desc, &raw, &packed, &report), VT_OK);
    assert_true(vt_is_packed(&packed) && !vt_is_packed(&raw));
    assert_int_equal(packed.alpha_codebook.codeword_count, 0);
    assert_int_equal(packed.field_codebook.codeword_count, 50);
    for (int j = 3; j < 150; j += 3) assert_true(memcmp(packed.field_codebook.codewords + j - 3, packed.field_codebook.codewords + j, 3) < 0);
    assert_same_level(&raw, &untouched, LEVEL);
    const vt_level *before = &raw.octree.levels[LEVEL], *after = &packed.octree.levels[LEVEL];
    size_t stride = corners ? 4 : 1, count = corners ? after->corner_count : after->cell_count;
    const float *d = corners ? after->corner_values : after->optical_depth, *was = corners ? before->corner_values : before->optical_depth;
    float low = 1e9f;
    for (size_t i = 0; i < count; i++)
      if (d[i * stride] > 0 && d[i * stride] < low) low = d[i * stride];
    assert_true(low >= 1.0f / 1024);
    for (size_t i = 0; i < count; i++) {
      double rung = d[i * stride] > 0 ? 3 * log2((double)d[i * stride] / low) : 0;
      assert_close(rung, floor(rung + 0.5), 1e-5);
      if (was[i * stride] < 1.0f / 1024) assert_true(d[i * stride] == 0);
      else assert_close(d[i * stride] / was[i * stride], 1, 0.1225);
      assert_true(is_codeword(&packed.field_codebook, corners ? d + 4 * i + 1 : after->colour + 3 * i));
    }
    if (views) assert_in_range(different_codes(&packed.view_textures[LEVEL]), 8, 9);
    assert_int_equal(report.corner_count, after->corner_count);
    assert_int_equal(report.view_pixels, views ? 3 * 60 * 60 : 0);
    assert_true(report.field_codewords == 50 && report.ratio_levels == 9 && report.tile_count == 0);
    vt_free_tree(context, &raw);
    vt_free_tree(context, &untouched);
    vt_free_tree(context, &packed);
  }
  vt_destroy_context(context);
}

static void a_packed_field_comes_back_from_its_file_bit_for_bit(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  for (int kind = 1; kind < 4; kind++)
    for (int words = 1; words <= 1000; words = words == 1 ? 256 : words == 256 ? 1000 : 1001) {
      vt_tree raw = field_tree(context, kind & 1, kind & 2), packed, back;
      vt_compress_desc desc = vt_default_compress_desc();
      desc.field_colours = words;
      size_t size;
      assert_int_equal(vt_compress_tree(context, &desc, &raw, &packed, NULL), VT_OK);
      uint8_t *bytes = bytes_of(context, &packed, &size);
      assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &back, NULL), VT_OK);
      assert_same_packed_tree(&packed, &back);
      vt_free(context, bytes);
      vt_free_tree(context, &back);
      bytes = bytes_of(context, &raw, &size);
      assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &back, NULL), VT_OK);
      if (kind & 1) assert_same_level(&raw, &back, LEVEL); // colours of cells alone become bytes in a raw file too
      vt_free(context, bytes);
      vt_free_tree(context, &raw);
      vt_free_tree(context, &packed);
      vt_free_tree(context, &back);
    }
  vt_destroy_context(context);
}

static void what_nobody_sees_takes_no_codeword(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  const float shown[3][3] = {{0.2f, 0.4f, 0.1f}, {0.6f, 0.4f, 0.2f}, {1, 1, 1}};
  for (int corners = 0; corners < 2; corners++) {
    vt_tree raw = field_tree(context, corners, true), packed;
    vt_level *level = &raw.octree.levels[LEVEL];
    size_t count = corners ? level->corner_count : level->cell_count, hidden = 0;
    uint8_t *visible = VT_NEW(context, uint8_t, count);
    for (size_t i = 0; i < 8 * (size_t)level->cell_count; i++)
      if (level->optical_depth[i / 8] >= 1.0f / 1024) visible[corners ? level->corner_of[i] : i / 8] = 1;
    vt_rng rng = vt_seed_rng(3, 3);
    for (size_t i = 0; i < count; i++) {
      hidden += !visible[i];
      for (int k = 0; k < 3; k++)
        (corners ? level->corner_values + 4 * i + 1 : level->colour + 3 * i)[k] =
            visible[i] ? shown[i % 3][k] : (float)vt_random_unit(&rng);
    }
    assert_true(hidden > count / 10 && hidden < count / 2);
    vt_compress_desc desc = vt_default_compress_desc();
    vt_compress_report report;
    assert_int_equal(vt_compress_tree(context, &desc, &raw, &packed, &report), VT_OK);
    assert_int_equal(report.field_codewords, 3);
    assert_true(report.field_delta_e < 0.2);
    vt_free(context, visible);
    vt_free_tree(context, &raw);
    vt_free_tree(context, &packed);
  }
  vt_destroy_context(context);
}

static void more_values_are_closer_and_all_of_them_lose_nothing(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  vt_tree raw = field_tree(context, true, true), packed;
  const int colours[] = {4, 64, 5000}, steps[] = {1, 3, 18}, levels[] = {3, 16, 256};
  vt_compress_report last = {.field_alpha_rmse = 1, .field_delta_e = 100, .log_ratio_rmse = 10};
  for (int i = 0; i < 3; i++) {
    vt_compress_desc desc = vt_default_compress_desc();
    vt_compress_report report;
    desc.field_colours = colours[i], desc.depth_steps = steps[i], desc.ratio_levels = levels[i];
    assert_int_equal(vt_compress_tree(context, &desc, &raw, &packed, &report), VT_OK);
    assert_true(report.field_alpha_rmse < 0.5 * last.field_alpha_rmse);
    assert_true(report.field_delta_e < 0.5 * last.field_delta_e);
    assert_true(report.log_ratio_rmse < 0.5 * last.log_ratio_rmse);
    last = report;
    if (i == 2)
      for (int v = 0; v < 4; v++) {
        const vt_view_texture *a = &raw.view_textures[LEVEL].views[v], *b = &packed.view_textures[LEVEL].views[v];
        if (a->columns) assert_memory_equal(a->codes, b->codes, (size_t)(a->columns * a->rows));
      }
    vt_free_tree(context, &packed);
  }
  assert_true(last.log_ratio_rmse == 0 && last.field_delta_e < 0.5 && last.field_alpha_rmse < 0.005);
  vt_free_tree(context, &raw);
  vt_destroy_context(context);
}

// R = 1 is what most pixels say; that it becomes another would make the whole tree denser or thinner.
static void the_ratio_one_stays_one(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_tree raw = field_tree(context, true, true), packed;
  vt_view_texture *t = &raw.view_textures[LEVEL].views[1];
  for (int i = 0; i < t->columns * t->rows; i++) t->codes[i] = (uint8_t)(127 + i % 2);
  for (int levels = 2; levels <= 255; levels++) {
    vt_compress_desc desc = vt_default_compress_desc();
    desc.ratio_levels = levels, desc.field_colours = 2;
    assert_int_equal(vt_compress_tree(context, &desc, &raw, &packed, NULL), VT_OK);
    const vt_view_texture *u = &packed.view_textures[LEVEL].views[1];
    for (int i = 0; i < 2; i++) assert_in_range(u->codes[i], 127, 128);
    assert_true(different_codes(&packed.view_textures[LEVEL]) <= levels);
    vt_free_tree(context, &packed);
    levels += levels / 3;
  }
  vt_free_tree(context, &raw);
  vt_destroy_context(context);
}

static void a_packed_field_draws_nearly_the_same_picture(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  vt_camera camera = scene_camera(2.2, -2.4, 0.9, 96);
  vt_view_weights weights = {3, {0, 1, 3}, {0.5f, 0.3f, 0.2f}};
  for (int kind = 1; kind < 4; kind++) {
    vt_tree raw = field_tree(context, kind & 1, kind & 2), packed;
    vt_compress_desc desc = vt_default_compress_desc();
    vt_fimage before, after;
    bool flat = !(kind & 2);
    assert_int_equal(vt_compress_tree(context, &desc, &raw, &packed, NULL), VT_OK);
    assert_int_equal(vt_composite(context, &raw, LEVEL, &weights, VT_BLEND_GEOMETRIC, flat, &camera, &before), VT_OK);
    assert_int_equal(vt_composite(context, &packed, LEVEL, &weights, VT_BLEND_GEOMETRIC, flat, &camera, &after), VT_OK);
    double largest, mean = scene_difference(&before, &after, &largest);
    assert_true(mean > 0 && mean < 0.012 && largest < 0.3); // colours from all of RGB: the hardest for a codebook
    vt_free_fimage(context, &before);
    vt_free_fimage(context, &after);
    vt_free_tree(context, &raw);
    vt_free_tree(context, &packed);
  }
  vt_destroy_context(context);
}

static void tiles_beside_a_field_are_packed_as_ever(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_tree tiled = scene_random_tree(context, 3, 0.3, 4, 4, 9), raw = field_tree(context, true, true), packed, alone, back;
  vt_compress_desc desc = vt_default_compress_desc();
  desc.alpha_codewords = desc.colour_codewords = 30;
  assert_int_equal(vt_compress_tree(context, &desc, &tiled, &alone, NULL), VT_OK);
  assert_int_equal(alone.field_codebook.codeword_count, 0);
  vt_free_level(context, &raw.octree.levels[3]);
  raw.octree.levels[3] = tiled.octree.levels[3], raw.tiles[3] = tiled.tiles[3]; // level 3 moves over
  tiled.octree.levels[3] = (vt_level){0}, tiled.tiles[3] = (vt_tiles){0};
  vt_compress_report report;
  assert_int_equal(vt_compress_tree(context, &desc, &raw, &packed, &report), VT_OK);
  assert_true(report.tile_count > 0 && report.field_codewords == 256 && report.alpha_codewords == 30);
  assert_memory_equal(packed.alpha_codebook.codewords, alone.alpha_codebook.codewords, 30 * 16);
  assert_memory_equal(packed.tiles[3].colour_code, alone.tiles[3].colour_code, 2 * alone.tiles[3].tile_count);
  size_t size;
  uint8_t *bytes = bytes_of(context, &packed, &size);
  assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &back, NULL), VT_OK);
  assert_same_packed_tree(&packed, &back);
  for (size_t i = 0; i < 4 * (size_t)packed.tiles[3].cell_count; i++) { // a file has only the tiles that are named
    uint32_t m = packed.tiles[3].tile_of[i], n = back.tiles[3].tile_of[i];
    assert_int_equal(m == VT_NO_TILE, n == VT_NO_TILE);
    if (m != VT_NO_TILE) assert_int_equal(packed.tiles[3].alpha_code[m], back.tiles[3].alpha_code[n]);
  }
  vt_free(context, bytes);
  vt_tree *trees[] = {&tiled, &raw, &packed, &alone, &back};
  for (int i = 0; i < 5; i++) vt_free_tree(context, trees[i]);
  vt_destroy_context(context);
}

static void odd_fields_are_packed_too(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  for (int odd = 0; odd < 5; odd++) {
    vt_tree raw = field_tree(context, odd != 4, true), packed, back;
    vt_level *level = &raw.octree.levels[LEVEL];
    if (odd == 0)
      for (size_t i = 0; i < level->corner_count; i++) level->corner_values[4 * i] = 0; // nothing shows
    if (odd == 1)
      for (size_t i = 0; i < level->corner_count; i++) // colours that are none
        level->corner_values[4 * i + 1] = NAN, level->corner_values[4 * i + 2] = -3, level->corner_values[4 * i + 3] = 7;
    for (int v = 0; odd == 2 && v < 4; v++) // all views keep nothing
      raw.view_textures[LEVEL].views[v].columns = raw.view_textures[LEVEL].views[v].rows = 0,
      raw.view_textures[LEVEL].views[v].left = raw.view_textures[LEVEL].views[v].top = 0;
    if (odd >= 3) { // textures on a level without cells, and no corners anywhere (4)
      vt_free_level(context, level);
      assert_int_equal(vt_make_level(context, 2, LEVEL, 0, NULL, level), VT_OK);
    }
    vt_compress_desc desc = vt_default_compress_desc();
    vt_compress_report report;
    size_t size;
    assert_int_equal(vt_compress_tree(context, &desc, &raw, &packed, &report), VT_OK);
    assert_true(isfinite(report.field_delta_e) && isfinite(report.field_alpha_rmse) && isfinite(report.log_ratio_rmse));
    if (odd != 2) assert_int_equal(report.field_codewords, 1);
    uint8_t *bytes = bytes_of(context, &packed, &size);
    assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &back, NULL), VT_OK);
    assert_same_packed_tree(&packed, &back);
    vt_free(context, bytes);
    vt_free_tree(context, &raw);
    vt_free_tree(context, &packed);
    vt_free_tree(context, &back);
  }
  vt_destroy_context(context);
}

static void threads_change_no_bit_of_a_packed_field(void **state) {
  (void)state;
  vt_tree packed[3];
  vt_context *context[3];
  for (int i = 0; i < 3; i++) {
    context[i] = scene_context(i == 2 ? 7 : i + 1);
    vt_tree raw = field_tree(context[i], true, true);
    vt_compress_desc desc = vt_default_compress_desc();
    desc.training_tiles = 700;
    assert_int_equal(vt_compress_tree(context[i], &desc, &raw, &packed[i], NULL), VT_OK);
    vt_free_tree(context[i], &raw);
    assert_same_packed_tree(&packed[0], &packed[i]);
  }
  for (int i = 0; i < 3; i++) {
    vt_free_tree(context[i], &packed[i]);
    vt_destroy_context(context[i]);
  }
}

static void cancelling_and_want_of_memory_leave_nothing_of_a_field(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  vt_tree raw = field_tree(context, true, true), packed;
  uint64_t before = vt_bytes_in_use(context);
  vt_compress_desc desc = vt_default_compress_desc();
  desc.field_colours = 8;
  vt_cancel(context);
  assert_int_equal(vt_compress_tree(context, &desc, &raw, &packed, NULL), VT_CANCELLED);
  assert_int_equal(vt_bytes_in_use(context), before);
  vt_free_tree(context, &raw);
  vt_destroy_context(context);
  context = scene_context(1);
  vt_tree scratch = field_tree(context, true, true); // making it takes more than packing it: the limit is for what comes after
  size_t size;
  uint8_t *bytes = bytes_of(context, &scratch, &size);
  int failures = 0;
  for (uint64_t more = 1000; more < 2000000; more += more / 6) {
    vt_context_desc limited = vt_default_context_desc();
    limited.thread_count = 1, limited.log_level = VT_LOG_QUIET, limited.max_memory = before + more;
    vt_context *small = vt_create_context(&limited);
    vt_status status = vt_parse_tree(small, bytes, size, "oak.vtree", &raw, NULL);
    uint64_t read = vt_bytes_in_use(small);
    if (!status) status = vt_compress_tree(small, &desc, &raw, &packed, NULL);
    else packed = (vt_tree){0};
    assert_true(status == VT_OK || status == VT_OUT_OF_MEMORY);
    failures += status == VT_OUT_OF_MEMORY && read > 1000;
    if (status) assert_int_equal(vt_bytes_in_use(small), read);
    vt_free_tree(small, &packed);
    vt_free_tree(small, &raw);
    vt_destroy_context(small);
  }
  assert_true(failures > 10);
  vt_free(context, bytes);
  vt_free_tree(context, &scratch);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_packed_field_holds_codewords_few_depths_and_few_codes),
      cmocka_unit_test(a_packed_field_comes_back_from_its_file_bit_for_bit),
      cmocka_unit_test(what_nobody_sees_takes_no_codeword),
      cmocka_unit_test(more_values_are_closer_and_all_of_them_lose_nothing),
      cmocka_unit_test(the_ratio_one_stays_one),
      cmocka_unit_test(a_packed_field_draws_nearly_the_same_picture),
      cmocka_unit_test(tiles_beside_a_field_are_packed_as_ever),
      cmocka_unit_test(odd_fields_are_packed_too),
      cmocka_unit_test(threads_change_no_bit_of_a_packed_field),
      cmocka_unit_test(cancelling_and_want_of_memory_leave_nothing_of_a_field),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
