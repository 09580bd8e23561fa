// test_compress_tree.c - a raw tree to a packed one
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/unit.h"
#include "base/context.h"
#include "base/rng.h"
#include "base/lab.h"
#include "compress/compress.h"

static vt_context *context_with(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads;
  desc.log_level = VT_LOG_QUIET;
  return vt_create_context(&desc);
}

static uint8_t clamp_byte(double v) {
  return (uint8_t)(v < 0 ? 0 : v > 255 ? 255 : v + 0.5);
}

// A leaf's edge across the tile, green shades and noise; texels that do not show are black, as photographs store them.
static void draw_leaf(uint8_t *texels, int edge, bool opaque, uint64_t seed) {
  vt_rng rng = vt_seed_rng(seed, 11);
  double angle = vt_random_between(&rng, 0, 6.2832), reach = vt_random_between(&rng, -0.6, 0.9);
  double light = vt_random_between(&rng, 0.7, 1.3), hue = vt_random_between(&rng, -25, 25);
  double tilt = vt_random_between(&rng, -25, 25);
  for (int y = 0; y < edge; y++)
    for (int x = 0; x < edge; x++) {
      double u = (x + 0.5) / edge * 2 - 1, v = (y + 0.5) / edge * 2 - 1;
      double side = u * cos(angle) + v * sin(angle) + reach;
      uint8_t *p = texels + 4 * (y * edge + x);
      p[3] = opaque ? 255 : clamp_byte(255 * (side * edge / 2 + 0.5));
      double noise = vt_random_between(&rng, -6, 6) + tilt * u;
      p[0] = p[3] ? clamp_byte(light * (90 + hue) + noise) : 0;
      p[1] = p[3] ? clamp_byte(light * 130 + noise) : 0;
      p[2] = p[3] ? clamp_byte(light * (50 - hue / 2) + noise) : 0;
    }
}

enum { VIEWS = 3 };

// A line of cells on levels 0 and 4 (with textures) and between (without); every seventh tile is wholly transparent,
// every ninth opaque, every fifth entry pruned.
static vt_tree make_tree(vt_context *ctx, int edge) {
  vt_tree tree = {.texel_edge = edge, .tile_side = 1.5f, .view_count = VIEWS};
  tree.octree = (vt_octree){.edge = 2, .branching = 2, .level_count = 5};
  tree.cameras = VT_NEW(ctx, vt_camera, VIEWS);
  tree.cameras[1].fx = 77;
  tree.metadata = vt_strdup(ctx, "{\"source\": \"test\"}");
  for (int l = 0; l < 5; l++) {
    static uint16_t xyz[256][3];
    size_t cells = (size_t)1 << (2 * l);
    for (size_t i = 0; i < cells; i++) {
      xyz[i][0] = (uint16_t)(i % ((size_t)1 << l));
      xyz[i][1] = (uint16_t)(i >> l);
      xyz[i][2] = 0;
    }
    assert_int_equal(vt_make_level(ctx, 2, l, cells, (const uint16_t(*)[3])xyz, &tree.octree.levels[l]), VT_OK);
    tree.octree.levels[l].optical_depth[0] = 1 + (float)l;
    if (l != 0 && l != 4) continue;
    vt_tiles *tiles = &tree.tiles[l];
    tiles->view_count = VIEWS;
    tiles->cell_count = (uint32_t)cells;
    tiles->tile_of = VT_NEW(ctx, uint32_t, VIEWS * cells);
    for (size_t i = 0; i < VIEWS * cells; i++) tiles->tile_of[i] = i % 5 == 4 ? VT_NO_TILE : tiles->tile_count++;
    size_t bytes = (size_t)(edge * edge * 4);
    tiles->texels = VT_NEW(ctx, uint8_t, tiles->tile_count * bytes);
    for (uint32_t i = 0; i < tiles->tile_count; i++) {
      uint8_t *tile = tiles->texels + i * bytes;
      draw_leaf(tile, edge, i % 9 == 8, 1000 * (uint64_t)l + i);
      for (size_t t = 3; t < bytes && i % 7 == 6; t += 4) tile[t] = 0;
    }
  }
  return tree;
}

static vt_compress_desc desc_with(int alpha, int colour) {
  vt_compress_desc desc = vt_default_compress_desc();
  desc.alpha_codewords = alpha;
  desc.colour_codewords = colour;
  return desc;
}

static void packing_keeps_everything_but_the_texels(void **state) {
  (void)state;
  vt_context *ctx = context_with(2);
  vt_tree raw = make_tree(ctx, 4), packed;
  vt_compress_desc desc = desc_with(64, 64);
  vt_compress_report report;
  assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, &report), VT_OK);
  assert_true(vt_is_packed(&packed) && !vt_is_packed(&raw));
  assert_string_equal(packed.metadata, raw.metadata);
  assert_int_equal(packed.view_count, VIEWS);
  assert_int_equal(packed.texel_edge, 4);
  assert_memory_equal(packed.cameras, raw.cameras, VIEWS * sizeof *raw.cameras);
  for (int l = 0; l < 5; l++) {
    const vt_tiles *a = &raw.tiles[l], *b = &packed.tiles[l];
    assert_int_equal(a->view_count, b->view_count);
    assert_int_equal(a->tile_count, b->tile_count);
    assert_null(b->texels);
    assert_int_equal(packed.octree.levels[l].cell_count, raw.octree.levels[l].cell_count);
    assert_close(packed.octree.levels[l].optical_depth[0], 1 + l, 0);
    if (!a->view_count) continue;
    assert_memory_equal(a->tile_of, b->tile_of, VIEWS * a->cell_count * sizeof *a->tile_of);
    for (uint32_t i = 0; i < b->tile_count; i++) {
      assert_true(b->alpha_code[i] < packed.alpha_codebook.codeword_count);
      assert_true(b->colour_code[i] < packed.colour_codebook.codeword_count);
    }
  }
  assert_int_equal(packed.alpha_codebook.channels, 1);
  assert_int_equal(packed.colour_codebook.channels, 3);
  assert_int_equal(packed.alpha_codebook.codeword_count, 64);
  assert_int_equal(packed.colour_codebook.codeword_count, 64);
  assert_int_equal(report.tile_count, raw.tiles[0].tile_count + raw.tiles[4].tile_count);
  assert_int_equal(report.raw_bytes, 64 * report.tile_count);
  assert_int_equal(report.packed_bytes, 4 * report.tile_count + 64 * 16 + 64 * 48);
  vt_free_tree(ctx, &raw);
  vt_free_tree(ctx, &packed);
  vt_destroy_context(ctx);
}

typedef struct texel_pair {
  const uint8_t *was;
  uint8_t now[4];
} texel_pair;

static texel_pair texel_of(const vt_tree *raw, const vt_tree *packed, int level, uint32_t tile, int t) {
  int texels = raw->texel_edge * raw->texel_edge;
  texel_pair pair = {raw->tiles[level].texels + ((size_t)tile * (size_t)texels + (size_t)t) * 4, {0}};
  const vt_tiles *tiles = &packed->tiles[level];
  memcpy(pair.now, packed->colour_codebook.codewords + (tiles->colour_code[tile] * texels + t) * 3, 3);
  pair.now[3] = packed->alpha_codebook.codewords[tiles->alpha_code[tile] * texels + t];
  return pair;
}

static void transparent_tiles_stay_so_and_no_visible_texel_turns_black(void **state) {
  (void)state;
  vt_context *ctx = context_with(2);
  vt_tree raw = make_tree(ctx, 4), packed;
  for (int quantiser = VT_RGB_GLA; quantiser <= VT_LAB_MODIFIED_GLA; quantiser++)
    for (int words = 4; words <= 64; words *= 4) {
      vt_compress_desc desc = desc_with(words, words);
      desc.quantiser = (vt_quantiser)quantiser;
      assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, NULL), VT_OK);
      int transparent = 0, revealed = 0;
      for (uint32_t i = 0; i < raw.tiles[4].tile_count; i++)
        for (int t = 0; t < 16; t++) {
          texel_pair p = texel_of(&raw, &packed, 4, i, t);
          if (i % 7 == 6)
            assert_int_equal(p.now[3], 0);
          else if (i % 9 == 8)
            assert_int_equal(p.now[3], 255);
          transparent += i % 7 == 6;
          revealed += p.was[3] == 0 && p.now[3] > 0;
          // The darkest leaf has green 0.7 * 130 - 25 - 6 = 60; less is the black that hidden texels hold.
          if (p.now[3] > 0) assert_true(p.now[1] >= 59);
        }
      assert_true(transparent > 0 && revealed > 0);
      vt_free_tree(ctx, &packed);
    }
  vt_free_tree(ctx, &raw);
  vt_destroy_context(ctx);
}

static void few_tiles_are_kept_exactly(void **state) {
  (void)state;
  vt_context *ctx = context_with(2);
  vt_tree raw = make_tree(ctx, 4), packed;
  for (int quantiser = VT_RGB_GLA; quantiser <= VT_LAB_MODIFIED_GLA; quantiser++) {
    vt_compress_desc desc = desc_with(1024, 1024);
    desc.quantiser = (vt_quantiser)quantiser;
    vt_compress_report report;
    assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, &report), VT_OK);
    assert_true(report.alpha_codewords < 1024 && report.colour_codewords < 1024);
    assert_true(report.alpha_rmse == 0 && report.colour_psnr == 99 && report.colour_delta_e == 0);
    for (uint32_t i = 0; i < raw.tiles[4].tile_count; i++)
      for (int t = 0; t < 16; t++) {
        texel_pair p = texel_of(&raw, &packed, 4, i, t);
        assert_int_equal(p.was[3], p.now[3]);
        if (p.was[3] >= 6) assert_memory_equal(p.was, p.now, 4);
      }
    vt_free_tree(ctx, &packed);
  }
  vt_free_tree(ctx, &raw);
  vt_destroy_context(ctx);
}

static void the_report_is_what_the_codes_give(void **state) {
  (void)state;
  vt_context *ctx = context_with(2);
  vt_tree raw = make_tree(ctx, 4), packed;
  vt_compress_desc desc = desc_with(32, 32);
  vt_compress_report report;
  assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, &report), VT_OK);
  double alpha = 0, rgb = 0, delta_e = 0, count = 0, visible = 0;
  for (int l = 0; l <= 4; l += 4)
    for (uint32_t i = 0; i < raw.tiles[l].tile_count; i++)
      for (int t = 0; t < 16; t++) {
        texel_pair p = texel_of(&raw, &packed, l, i, t);
        float was[3], now[3], lab_was[3], lab_now[3];
        double square = 0;
        alpha += (p.was[3] - p.now[3]) * (p.was[3] - p.now[3]);
        count++;
        if (p.was[3] < 6) continue;
        visible++;
        for (int c = 0; c < 3; c++) {
          was[c] = (float)p.was[c] / 255;
          now[c] = (float)p.now[c] / 255;
          rgb += (was[c] - now[c]) * (was[c] - now[c]);
        }
        vt_lab_from_srgb(was, lab_was);
        vt_lab_from_srgb(now, lab_now);
        for (int c = 0; c < 3; c++) square += (lab_was[c] - lab_now[c]) * (lab_was[c] - lab_now[c]);
        delta_e += sqrt(square);
      }
  assert_close(report.alpha_rmse, sqrt(alpha / count) / 255, 1e-9);
  assert_close(report.colour_psnr, 10 * log10(3 * visible / rgb), 1e-3);
  assert_close(report.colour_delta_e, delta_e / visible, 1e-3);
  assert_true(report.alpha_rmse < 0.13 && report.colour_psnr > 26 && report.colour_delta_e < 5.5);
  vt_free_tree(ctx, &raw);
  vt_free_tree(ctx, &packed);
  vt_destroy_context(ctx);
}

static void more_codewords_and_unsnapped_ones_are_better(void **state) {
  (void)state;
  vt_context *ctx = context_with(2);
  vt_tree raw = make_tree(ctx, 4), packed;
  double alpha = 1, colour = 0;
  for (int words = 4; words <= 256; words *= 4) {
    vt_compress_desc desc = desc_with(words, words);
    vt_compress_report plain, snapped;
    assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, &plain), VT_OK);
    vt_free_tree(ctx, &packed);
    assert_true(plain.alpha_rmse < alpha && plain.colour_psnr > colour);
    alpha = plain.alpha_rmse;
    colour = plain.colour_psnr;
    desc.quantiser = VT_LAB_MODIFIED_GLA;
    assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, &snapped), VT_OK);
    vt_free_tree(ctx, &packed);
    assert_true(snapped.colour_psnr < plain.colour_psnr);
  }
  vt_free_tree(ctx, &raw);
  vt_destroy_context(ctx);
}

static void a_packed_tree_is_refused(void **state) {
  (void)state;
  vt_context *ctx = context_with(1);
  vt_tree raw = make_tree(ctx, 4), packed, again;
  vt_compress_desc desc = desc_with(16, 16);
  assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, NULL), VT_OK);
  assert_int_equal(vt_compress_tree(ctx, &desc, &packed, &again, NULL), VT_BAD_INPUT);
  vt_free_tree(ctx, &again);
  vt_free_tree(ctx, &raw);
  vt_free_tree(ctx, &packed);
  vt_destroy_context(ctx);
}

static void odd_trees_are_packed_too(void **state) {
  (void)state;
  vt_context *ctx = context_with(2);
  vt_tree packed;
  vt_compress_report report;
  for (int words = 1; words <= 3; words++) {
    vt_compress_desc desc = desc_with(words, words);
    for (int edge = 1; edge <= 8; edge += 7) {
      vt_tree raw = make_tree(ctx, edge);
      assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, &report), VT_OK);
      assert_true(vt_is_packed(&packed) && report.alpha_codewords == words && report.colour_codewords == words);
      vt_free_tree(ctx, &packed);
      for (int l = 0; l <= 4; l += 4) // nothing to see
        memset(raw.tiles[l].texels, 0, (size_t)raw.tiles[l].tile_count * (size_t)(edge * edge * 4));
      assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, &report), VT_OK);
      assert_true(vt_is_packed(&packed) && report.alpha_rmse == 0 && report.colour_psnr == 99);
      vt_free_tree(ctx, &packed);
      for (int l = 0; l <= 4; l += 4) vt_free_tiles(ctx, &raw.tiles[l]); // no tiles at all
      assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, &report), VT_OK);
      assert_true(vt_is_packed(&packed) && report.tile_count == 0);
      vt_free_tree(ctx, &packed);
      vt_free_tree(ctx, &raw);
    }
  }
  vt_destroy_context(ctx);
}

static void threads_change_no_bit_of_a_packed_tree(void **state) {
  (void)state;
  vt_tree packed[3];
  vt_context *ctx[3];
  for (int i = 0; i < 3; i++) {
    ctx[i] = context_with(i + 1);
    vt_tree raw = make_tree(ctx[i], 4);
    vt_compress_desc desc = desc_with(40, 40);
    desc.training_tiles = 500;
    vt_compress_report report;
    assert_int_equal(vt_compress_tree(ctx[i], &desc, &raw, &packed[i], &report), VT_OK);
    vt_free_tree(ctx[i], &raw);
    size_t tiles = packed[0].tiles[4].tile_count;
    assert_memory_equal(packed[i].alpha_codebook.codewords, packed[0].alpha_codebook.codewords, 40 * 16);
    assert_memory_equal(packed[i].colour_codebook.codewords, packed[0].colour_codebook.codewords, 40 * 48);
    assert_memory_equal(packed[i].tiles[4].alpha_code, packed[0].tiles[4].alpha_code, tiles * 2);
    assert_memory_equal(packed[i].tiles[4].colour_code, packed[0].tiles[4].colour_code, tiles * 2);
  }
  for (int i = 0; i < 3; i++) {
    vt_free_tree(ctx[i], &packed[i]);
    vt_destroy_context(ctx[i]);
  }
}

static void cancelling_and_want_of_memory_leave_nothing_of_a_tree(void **state) {
  (void)state;
  vt_context *ctx = context_with(2);
  vt_tree raw = make_tree(ctx, 4), packed;
  uint64_t before = vt_bytes_in_use(ctx);
  vt_compress_desc desc = desc_with(40, 40);
  vt_cancel(ctx);
  assert_int_equal(vt_compress_tree(ctx, &desc, &raw, &packed, NULL), VT_CANCELLED);
  assert_int_equal(vt_bytes_in_use(ctx), before);
  vt_free_tree(ctx, &raw);
  vt_destroy_context(ctx);
  int failures = 0;
  for (uint64_t more = 100; more < 1000000; more += more / 7) {
    vt_context_desc context_desc = vt_default_context_desc();
    context_desc.thread_count = 1;
    context_desc.max_memory = before + more;
    ctx = vt_create_context(&context_desc);
    raw = make_tree(ctx, 4);
    vt_status status = vt_compress_tree(ctx, &desc, &raw, &packed, NULL);
    assert_true(status == VT_OK || status == VT_OUT_OF_MEMORY);
    failures += status == VT_OUT_OF_MEMORY;
    if (status) assert_int_equal(vt_bytes_in_use(ctx), before);
    vt_free_tree(ctx, &packed);
    vt_free_tree(ctx, &raw);
    vt_destroy_context(ctx);
  }
  assert_true(failures > 10);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(packing_keeps_everything_but_the_texels),
      cmocka_unit_test(transparent_tiles_stay_so_and_no_visible_texel_turns_black),
      cmocka_unit_test(few_tiles_are_kept_exactly),
      cmocka_unit_test(the_report_is_what_the_codes_give),
      cmocka_unit_test(more_codewords_and_unsnapped_ones_are_better),
      cmocka_unit_test(a_packed_tree_is_refused),
      cmocka_unit_test(odd_trees_are_packed_too),
      cmocka_unit_test(threads_change_no_bit_of_a_packed_tree),
      cmocka_unit_test(cancelling_and_want_of_memory_leave_nothing_of_a_tree),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
