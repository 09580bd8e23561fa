// compress.c - a raw tree to a packed one: billboard textures as two codewords each
// SPDX-License-Identifier: BSD-3-Clause
//
// [LRMDM06 4.1] Alpha (texel_edge^2 values) and colour (three times as many) of the tiles of all levels are quantised
// apart, with one codebook each. Order of work: choose training tiles, train, round the codewords to 8 bits, and encode
// every tile against the ROUNDED codewords, so that what is minimised is what will be drawn.
//  * A colour counts in training by its tile's mean alpha; tiles that show nothing do not train.
//  * A wholly transparent tile must stay so and an opaque one must not leak, however they are trained: these two alpha
//    codewords are not left to chance but set aside, as numbers 0 and 1.
//  * The default is plain GLA in CIELab: snapping centroids to input vectors (VT_LAB_MODIFIED_GLA) keeps the contrast
//  of
//    real texels and costs 0.6 to 1.5 dB; RGB gains 0.5 dB in RGB and loses 0.3 in mean CIELab distance.
// Tiles are turned to vectors block by block: memory is that of the training set, not of the tree.

#include "compress/blocks.h"
#include "base/lab.h"
#include "compress/field.h"
#include "compress/nearest.h"
#include "base/rng.h"
#include <math.h>
#include <string.h>

enum { BLOCK = 512, MAX_TEXELS = 81 };

vt_compress_desc vt_default_compress_desc(void) {
  return (vt_compress_desc){.cookie = VT_COOKIE,
                            .quantiser = VT_LAB_GLA,
                            .alpha_codewords = 1024,
                            .colour_codewords = 512,
                            .max_iterations = 60,
                            .stop_gain = 2e-3,
                            .training_tiles = 100000,
                            .seed = 1,
                            .set_flat_aside = true,
                            .field_colours = 256,
                            .depth_steps = 3,
                            .least_depth = 1.0f / 1024,
                            .ratio_levels = 16};
}

// ---- training

// One tile from each of `count` equal stretches of all tiles.
static uint64_t choose_tile(const vt_blocks *blocks, uint64_t count, uint64_t i, vt_rng *rng) {
  uint64_t total = blocks->first[blocks->level_count];
  double stretch = (double)total / (double)count;
  uint64_t tile = count == total ? i : (uint64_t)(((double)i + vt_random_unit(rng)) * stretch);
  return tile < total ? tile : total - 1;
}

typedef struct training {
  uint64_t tile_count;
  float *alpha, *colour, *colour_weight;
  size_t alpha_count, colour_count;
  bool any_opaque; // among the training tiles
} training;

static void free_training(vt_context *ctx, training *t) {
  vt_free(ctx, t->alpha);
  vt_free(ctx, t->colour);
  vt_free(ctx, t->colour_weight);
  *t = (training){0};
}

static vt_status gather_training(vt_context *ctx, const vt_compress_desc *desc, const vt_blocks *blocks, training *t) {
  uint64_t total = blocks->first[blocks->level_count];
  size_t texels = blocks->texel_count;
  vt_rng rng = vt_seed_rng(desc->seed, 0x74696c65);
  t->tile_count = desc->training_tiles && desc->training_tiles < total ? desc->training_tiles : total;
  t->alpha = VT_NEW(ctx, float, t->tile_count *texels);
  t->colour = VT_NEW(ctx, float, t->tile_count *texels * 3);
  t->colour_weight = VT_NEW(ctx, float, t->tile_count);
  if (!t->alpha || !t->colour || !t->colour_weight) return VT_OUT_OF_MEMORY;
  for (uint64_t i = 0; i < t->tile_count; i++) {
    const uint8_t *tile = vt_block_texels(blocks, choose_tile(blocks, t->tile_count, i, &rng));
    vt_block_alpha kind = vt_gather_alpha(blocks, tile, t->alpha + t->alpha_count * texels);
    t->any_opaque |= kind == VT_BLOCK_OPAQUE;
    t->alpha_count += kind == VT_BLOCK_MIXED || (kind == VT_BLOCK_OPAQUE && desc->alpha_codewords < 3) ||
                      !desc->set_flat_aside;
    float weight = vt_gather_colour(blocks, tile, t->colour + t->colour_count * texels * 3);
    if (!(weight > 0)) continue;
    t->colour_weight[t->colour_count++] = weight + 1.0f / 64; // a faint tile still has to look right
  }
  return VT_OK;
}

static vt_gla_desc gla_desc_of(const vt_compress_desc *desc, size_t dimension, int codeword_count) {
  vt_gla_desc d = vt_default_gla_desc();
  d.dimension = (int)dimension;
  d.codeword_count = codeword_count;
  d.snap = desc->quantiser == VT_LAB_MODIFIED_GLA;
  d.max_iterations = desc->max_iterations;
  d.stop_gain = desc->stop_gain;
  d.seed = desc->seed;
  return d;
}

// Codewords 0 (all 0) and 1 (all 255) are set aside where there is room for them; returns how many.
static int reserve_alpha(const vt_compress_desc *desc, const training *t) {
  if (desc->alpha_codewords == 1 || !desc->set_flat_aside) return t->alpha_count ? 0 : 1;
  return desc->alpha_codewords >= 3 && t->any_opaque ? 2 : 1;
}

static vt_status train_alpha(vt_context *ctx, const vt_compress_desc *desc, const vt_blocks *blocks, const training *t,
                             vt_codebook *book, vt_gla_report *report) {
  size_t texels = blocks->texel_count;
  int reserved = reserve_alpha(desc, t), wanted = desc->alpha_codewords - reserved;
  float *codewords = VT_NEW(ctx, float, (size_t)desc->alpha_codewords *texels);
  book->codewords = VT_NEW(ctx, uint8_t, (size_t)desc->alpha_codewords * texels); // codeword 0 is zero as allocated
  book->channels = 1;
  vt_status status = codewords && book->codewords ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status && wanted > 0) {
    vt_gla_desc gla = gla_desc_of(desc, texels, wanted);
    status = vt_train_codebook(ctx, &gla, t->alpha, NULL, t->alpha_count, codewords, NULL, report);
  }
  if (!status) {
    if (reserved > 1) memset(book->codewords + texels, 255, texels);
    for (int j = 0; j < report->codeword_count; j++)
      vt_store_alpha_codeword(blocks, codewords + (size_t)j * texels,
                              book->codewords + (size_t)(reserved + j) * texels);
    book->codeword_count = reserved + report->codeword_count;
  }
  vt_free(ctx, codewords);
  return status;
}

static vt_status train_colour(vt_context *ctx, const vt_compress_desc *desc, const vt_blocks *blocks, const training *t,
                              vt_codebook *book, vt_gla_report *report) {
  size_t values = 3 * blocks->texel_count;
  float *codewords = VT_NEW(ctx, float, (size_t)desc->colour_codewords *values);
  book->codewords = VT_NEW(ctx, uint8_t, (size_t)desc->colour_codewords * values);
  book->channels = 3;
  vt_status status = codewords && book->codewords ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) {
    vt_gla_desc gla = gla_desc_of(desc, values, desc->colour_codewords);
    status = vt_train_codebook(ctx, &gla, t->colour, t->colour_weight, t->colour_count, codewords, NULL, report);
  }
  for (int j = 0; !status && j < report->codeword_count; j++)
    vt_store_colour_codeword(blocks, codewords + (size_t)j * values, book->codewords + (size_t)j * values);
  if (!status) book->codeword_count = report->codeword_count > 0 ? report->codeword_count : 1; // nothing visible: any
  vt_free(ctx, codewords);
  return status;
}

// ---- encoding

typedef struct error_sums {
  double alpha, rgb, delta_e;
  uint64_t visible;
} error_sums;

typedef struct encoder {
  const vt_blocks *blocks;
  bool search_flat; // flat tiles are encoded like all others
  vt_tree *out;
  vt_nearest alpha, colour;
  float *alpha_words, *colour_words; // the stored codewords as vectors
  float *lab_words;                  // the same in CIELab; colour_words if those are
  uint16_t flat_alpha[3];            // codes of VT_BLOCK_TRANSPARENT and VT_BLOCK_OPAQUE
  float *scratch;                    // [workers][BLOCK] alpha and colour vectors
  error_sums *errors;                // [blocks]
} encoder;

static vt_status make_encoder(vt_context *ctx, const vt_blocks *blocks, bool search_flat, vt_tree *out, encoder *e) {
  size_t texels = blocks->texel_count, alpha_count = (size_t)out->alpha_codebook.codeword_count;
  size_t colour_count = (size_t)out->colour_codebook.codeword_count, total = blocks->first[blocks->level_count];
  *e = (encoder){.blocks = blocks, .search_flat = search_flat, .out = out};
  e->alpha_words = VT_NEW(ctx, float, alpha_count *texels);
  e->colour_words = VT_NEW(ctx, float, colour_count *texels * 3);
  e->lab_words = blocks->in_lab ? e->colour_words : VT_NEW(ctx, float, colour_count *texels * 3);
  e->scratch = VT_NEW(ctx, float, (size_t)vt_thread_count(ctx) * BLOCK * texels * 4);
  e->errors = VT_NEW(ctx, error_sums, (total + BLOCK - 1) / BLOCK);
  if (!e->alpha_words || !e->colour_words || !e->lab_words || !e->scratch || !e->errors) return VT_OUT_OF_MEMORY;
  for (size_t j = 0; j < alpha_count; j++)
    vt_load_alpha_codeword(blocks, out->alpha_codebook.codewords + j * texels, e->alpha_words + j * texels);
  for (size_t j = 0; j < colour_count; j++) {
    const uint8_t *rgb = out->colour_codebook.codewords + j * texels * 3;
    vt_load_colour_codeword(blocks, rgb, e->colour_words + j * texels * 3);
    if (!blocks->in_lab) vt_lab_from_bytes(blocks->linear, rgb, 3, texels, e->lab_words + j * texels * 3);
  }
  vt_status status = vt_make_nearest(ctx, (int)texels, (int)alpha_count, &e->alpha);
  if (!status) status = vt_make_nearest(ctx, (int)texels * 3, (int)colour_count, &e->colour);
  if (status) return status;
  vt_pack_nearest(&e->alpha, e->alpha_words);
  vt_pack_nearest(&e->colour, e->colour_words);
  float flat[2][MAX_TEXELS] = {{0}};
  for (size_t t = 0; t < texels; t++) flat[1][t] = 255;
  vt_find_nearest(&e->alpha, flat[0], NULL, 1, &e->flat_alpha[VT_BLOCK_TRANSPARENT], NULL);
  vt_find_nearest(&e->alpha, flat[1], NULL, 1, &e->flat_alpha[VT_BLOCK_OPAQUE], NULL);
  return VT_OK;
}

static void free_encoder(vt_context *ctx, encoder *e) {
  if (e->lab_words != e->colour_words) vt_free(ctx, e->lab_words);
  vt_free(ctx, e->alpha_words);
  vt_free(ctx, e->colour_words);
  vt_free(ctx, e->scratch);
  vt_free(ctx, e->errors);
  vt_free_nearest(ctx, &e->alpha);
  vt_free_nearest(ctx, &e->colour);
}

static void add_errors(const encoder *e, const uint8_t *tile, uint16_t alpha_code, uint16_t colour_code,
                       error_sums *sums) {
  size_t texels = e->blocks->texel_count;
  const uint8_t *alpha = e->out->alpha_codebook.codewords + alpha_code * texels;
  const uint8_t *rgb = e->out->colour_codebook.codewords + colour_code * texels * 3;
  const float *word = e->lab_words + colour_code * texels * 3;
  float lab[3 * MAX_TEXELS];
  int alpha_error = 0, rgb_error = 0;
  bool seen = false;
  for (size_t t = 0; t < texels; t++) {
    int difference = tile[4 * t + 3] - alpha[t];
    alpha_error += difference * difference;
    seen |= tile[4 * t + 3] >= VT_VISIBLE_ALPHA;
  }
  sums->alpha += alpha_error;
  if (!seen) return;
  vt_lab_from_bytes(e->blocks->linear, tile, 4, texels, lab);
  for (size_t t = 0; t < texels; t++) {
    if (tile[4 * t + 3] < VT_VISIBLE_ALPHA) continue;
    float square = 0;
    for (size_t c = 0; c < 3; c++) {
      int difference = tile[4 * t + c] - rgb[3 * t + c];
      rgb_error += difference * difference;
      square += (lab[3 * t + c] - word[3 * t + c]) * (lab[3 * t + c] - word[3 * t + c]);
    }
    sums->delta_e += (double)sqrtf(square);
    sums->visible++;
  }
  sums->rgb += rgb_error;
}

static void encode_block(void *user, size_t begin, size_t end, int worker) {
  encoder *e = user;
  const vt_blocks *blocks = e->blocks;
  size_t texels = blocks->texel_count, alpha_count = 0, colour_count = 0, count = end - begin;
  float *alpha = e->scratch + (size_t)worker * BLOCK * texels * 4, *colour = alpha + BLOCK * texels;
  uint16_t alpha_at[BLOCK], colour_at[BLOCK], found[BLOCK], alpha_code[BLOCK], colour_code[BLOCK] = {0};
  for (size_t i = 0; i < count; i++) {
    const uint8_t *tile = vt_block_texels(blocks, begin + i);
    vt_block_alpha kind = vt_gather_alpha(blocks, tile, alpha + alpha_count * texels);
    alpha_code[i] = e->flat_alpha[kind];
    if (kind == VT_BLOCK_MIXED || e->search_flat) alpha_at[alpha_count++] = (uint16_t)i;
    if (vt_gather_colour(blocks, tile, colour + colour_count * texels * 3) > 0) colour_at[colour_count++] = (uint16_t)i;
  }
  vt_find_nearest(&e->alpha, alpha, NULL, alpha_count, found, NULL);
  for (size_t i = 0; i < alpha_count; i++) alpha_code[alpha_at[i]] = found[i];
  vt_find_nearest(&e->colour, colour, NULL, colour_count, found, NULL);
  for (size_t i = 0; i < colour_count; i++) colour_code[colour_at[i]] = found[i];
  for (size_t i = 0; i < count; i++) {
    int level = vt_block_level(blocks, begin + i);
    size_t tile = begin + i - blocks->first[level];
    e->out->tiles[level].alpha_code[tile] = alpha_code[i];
    e->out->tiles[level].colour_code[tile] = colour_code[i];
    add_errors(e, vt_block_texels(blocks, begin + i), alpha_code[i], colour_code[i], &e->errors[begin / BLOCK]);
  }
}

static vt_status encode_tiles(vt_context *ctx, const vt_blocks *blocks, bool search_flat, vt_tree *out,
                              vt_compress_report *report) {
  encoder e;
  size_t total = blocks->first[blocks->level_count];
  vt_status status = make_encoder(ctx, blocks, search_flat, out, &e);
  if (!status) status = vt_parallel(ctx, total, BLOCK, encode_block, &e);
  error_sums sum = {0};
  for (size_t b = 0; !status && b * BLOCK < total; b++) {
    sum.alpha += e.errors[b].alpha;
    sum.rgb += e.errors[b].rgb;
    sum.delta_e += e.errors[b].delta_e;
    sum.visible += e.errors[b].visible;
  }
  double texels = (double)total * (double)blocks->texel_count, visible = (double)sum.visible;
  report->alpha_rmse = total ? sqrt(sum.alpha / texels) / 255 : 0;
  report->colour_psnr = sum.rgb > 0 ? 10 * log10(255.0 * 255.0 * 3 * visible / sum.rgb) : 99;
  report->colour_delta_e = sum.visible ? sum.delta_e / visible : 0;
  free_encoder(ctx, &e);
  return status;
}

// ---- the tree

static vt_status copy_tile_numbers(vt_context *ctx, const vt_tiles *in, vt_tiles *out) {
  if (in->view_count == 0) return VT_OK;
  size_t entries = (size_t)in->view_count * in->cell_count;
  *out = (vt_tiles){.view_count = in->view_count, .cell_count = in->cell_count, .tile_count = in->tile_count,
                    .grid = in->grid};
  out->tile_of = VT_NEW(ctx, uint32_t, entries);
  out->alpha_code = VT_NEW(ctx, uint16_t, in->tile_count);
  out->colour_code = VT_NEW(ctx, uint16_t, in->tile_count);
  if (!out->tile_of || !out->alpha_code || !out->colour_code) return VT_OUT_OF_MEMORY;
  memcpy(out->tile_of, in->tile_of, entries * sizeof *in->tile_of);
  return VT_OK;
}

static void check_desc(const vt_compress_desc *d, const vt_tree *raw) {
  VT_ASSERT(d->cookie == VT_COOKIE && d->quantiser >= VT_RGB_GLA && d->quantiser <= VT_LAB_MODIFIED_GLA);
  VT_ASSERT(d->alpha_codewords >= 1 && d->alpha_codewords <= 65536);
  VT_ASSERT(d->colour_codewords >= 1 && d->colour_codewords <= 65536);
  VT_ASSERT(d->max_iterations >= 1 && d->max_iterations <= 1000 && d->stop_gain >= 0);
  VT_ASSERT(d->field_colours >= 1 && d->field_colours <= 65536 && d->least_depth >= 1e-30f);
  VT_ASSERT(d->depth_steps >= 1 && 18 % d->depth_steps == 0 && d->ratio_levels >= 2 && d->ratio_levels <= 256);
  VT_ASSERT(raw->texel_edge >= 1 && raw->texel_edge * raw->texel_edge <= MAX_TEXELS);
}

// Codebooks and codes of all tiles.
static vt_status pack_tiles(vt_context *ctx, const vt_compress_desc *desc, const vt_tree *raw, vt_tree *out,
                            vt_compress_report *report) {
  vt_gla_report alpha = {0}, colour = {0};
  training trained = {0};
  double start = vt_seconds();
  vt_blocks blocks = vt_make_blocks(raw, desc->quantiser != VT_RGB_GLA);
  vt_status status = VT_OK;
  for (int l = 0; !status && l < raw->octree.level_count; l++)
    status = copy_tile_numbers(ctx, &raw->tiles[l], &out->tiles[l]);
  if (!status) status = gather_training(ctx, desc, &blocks, &trained);
  if (!status) status = train_alpha(ctx, desc, &blocks, &trained, &out->alpha_codebook, &alpha);
  vt_progress(ctx, "compress", 0.15);
  if (!status) status = train_colour(ctx, desc, &blocks, &trained, &out->colour_codebook, &colour);
  free_training(ctx, &trained);
  vt_progress(ctx, "compress", 0.5);
  report->seconds_training = vt_seconds() - start;
  start = vt_seconds();
  if (!status) status = encode_tiles(ctx, &blocks, !desc->set_flat_aside, out, report);
  report->seconds_encoding = vt_seconds() - start;
  report->alpha_codewords = out->alpha_codebook.codeword_count;
  report->colour_codewords = out->colour_codebook.codeword_count;
  report->alpha_iterations = alpha.iterations;
  report->colour_iterations = colour.iterations;
  return status;
}

vt_status vt_compress_tree(vt_context *ctx, const vt_compress_desc *desc, const vt_tree *raw, vt_tree *out,
                           vt_compress_report *or_null) {
  check_desc(desc, raw);
  *out = (vt_tree){0};
  if (vt_is_packed(raw))
    return vt_fail(ctx, VT_BAD_INPUT, "tree: it is compressed already; reconstruct it with --raw to compress it anew");
  vt_compress_report report = {0};
  bool field = vt_has_field(raw), tiles = !field;
  for (int l = 0; l < raw->octree.level_count; l++) {
    report.tile_count += raw->tiles[l].tile_count;
    tiles = tiles || raw->tiles[l].view_count > 0;
  }
  vt_progress(ctx, "compress", 0);
  vt_status status = vt_copy_tree_without_tiles(ctx, raw, out);
  if (!status && field) status = vt_compress_field(ctx, desc, raw, out, &report);
  if (!status && tiles) status = pack_tiles(ctx, desc, raw, out, &report);
  vt_progress(ctx, "compress", 1);
  if (status) {
    vt_free_tree(ctx, out);
    return status;
  }
  report.raw_bytes = vt_texture_bytes(raw);
  report.packed_bytes = vt_texture_bytes(out);
  if (or_null) *or_null = report;
  return VT_OK;
}
