// test_compress_gla.c - codebooks and the search for the nearest codeword
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/unit.h"
#include "base/context.h"
#include "base/rng.h"
#include "compress/compress.h"
#include "compress/nearest.h"

static vt_context *context_with(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads;
  desc.log_level = VT_LOG_QUIET;
  return vt_create_context(&desc);
}

// `clusters` clouds of deviation `spread` around points in a cube of edge 100 at `offset`.
static void fill_clouds(float *vectors, size_t count, int dimension, int clusters, double spread, double offset,
                        uint64_t seed) {
  for (size_t i = 0; i < count; i++) {
    vt_rng centre = vt_seed_rng(seed, i % (size_t)clusters), noise = vt_seed_rng(seed ^ 77, i);
    for (int d = 0; d < dimension; d++) {
      double sum = vt_random_unit(&noise) + vt_random_unit(&noise) + vt_random_unit(&noise) - 1.5;
      vectors[i * (size_t)dimension + (size_t)d] = (float)(offset + 100 * vt_random_unit(&centre) + 2 * spread * sum);
    }
  }
}

static void every_path_gives_the_same_bits(void **state) {
  (void)state;
  static const int dimensions[] = {1, 3, 16, 48, 255};
  vt_context *ctx = context_with(1);
  for (int k = 0; k < 5; k++) {
    int dimension = dimensions[k], groups = 3;
    float *x = VT_NEW(ctx, float, (size_t)dimension *VT_NEAREST_ROWS);
    float *packed = VT_NEW(ctx, float, (size_t)dimension *VT_NEAREST_LANES * 3);
    float *half_norm = VT_NEW(ctx, float, VT_NEAREST_LANES * 3);
    fill_clouds(x, VT_NEAREST_ROWS, dimension, 3, 5, -40, 1);
    fill_clouds(packed, VT_NEAREST_LANES * 3, dimension, 7, 5, -60, 2);
    fill_clouds(half_norm, VT_NEAREST_LANES * 3, 1, 96, 5, 300, 3);
    _Alignas(64) static vt_nearest_scores plain, other;
    float lowest[VT_NEAREST_ROWS], other_lowest[VT_NEAREST_ROWS];
    memset(plain, 0, sizeof plain);
    memset(other, 0, sizeof other);
    vt_score_codewords(VT_PATH_PLAIN, dimension, groups, x, packed, half_norm, plain, lowest);
    assert_true(plain[7][95] != 0);
    for (int path = VT_PATH_PLAIN + 1; path <= (int)vt_best_nearest_path(); path++) {
      vt_score_codewords((vt_nearest_path)path, dimension, groups, x, packed, half_norm, other, other_lowest);
      assert_memory_equal(plain, other, sizeof plain);
      assert_memory_equal(lowest, other_lowest, sizeof lowest);
    }
    vt_free(ctx, x);
    vt_free(ctx, packed);
    vt_free(ctx, half_norm);
  }
  vt_destroy_context(ctx);
}

// The code of every vector against all squared differences in double.
static void check_codes(vt_context *ctx, int dimension, const float *codewords, int k, const float *vectors,
                        size_t count) {
  uint16_t *code = VT_NEW(ctx, uint16_t, count);
  assert_int_equal(vt_encode_vectors(ctx, dimension, codewords, k, vectors, count, code), VT_OK);
  for (size_t i = 0; i < count; i++) {
    double least = INFINITY;
    int best = 0;
    for (int j = 0; j < k; j++) {
      double d = vt_squared_distance(dimension, vectors + i * (size_t)dimension, codewords + (size_t)(j * dimension));
      if (d < least) {
        least = d;
        best = j;
      }
    }
    assert_int_equal(code[i], best);
  }
  vt_free(ctx, code);
}

static void encoding_finds_the_true_nearest_codeword(void **state) {
  (void)state;
  vt_context *ctx = context_with(2);
  static const struct {
    int dimension, k;
    double spread, offset;
  } cases[] = {{1, 1, 1, 0},        {1, 300, 5, 0},     {2, 33, 5, 0},     {16, 1000, 20, 0},
               {48, 1500, 3, 0},    {48, 700, 1e-3, 0}, {48, 64, 3, 1e6},  {48, 64, 1e-3, -3e5},
               {192, 100, 30, 100}, {256, 31, 30, 0},   {48, 513, 1e-7, 0}};
  for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
    int dimension = cases[c].dimension, k = cases[c].k;
    size_t count = 301;
    float *codewords = VT_NEW(ctx, float, (size_t)(k * dimension)),
          *vectors = VT_NEW(ctx, float, count *(size_t)dimension);
    fill_clouds(codewords, (size_t)k, dimension, 9, cases[c].spread, cases[c].offset, 5);
    fill_clouds(vectors, count, dimension, 9, cases[c].spread, cases[c].offset, 5 + 64 * (c % 2));
    check_codes(ctx, dimension, codewords, k, vectors, count);
    vt_free(ctx, codewords);
    vt_free(ctx, vectors);
  }
  vt_destroy_context(ctx);
}

static void encoding_takes_the_lower_index_of_equal_codewords(void **state) {
  (void)state;
  enum { K = 1100, D = 48, COUNT = 50 };
  vt_context *ctx = context_with(1);
  float *codewords = VT_NEW(ctx, float, K *D);
  uint16_t code[COUNT];
  fill_clouds(codewords, K, D, K, 0, 0, 3);
  for (int j = COUNT; j < K; j++) memcpy(codewords + j * D, codewords + j % COUNT * D, D * sizeof(float));
  assert_int_equal(vt_encode_vectors(ctx, D, codewords, K, codewords + 600 * D, COUNT, code), VT_OK);
  for (int i = 0; i < COUNT; i++) assert_int_equal(code[i], i);
  vt_free(ctx, codewords);
  vt_destroy_context(ctx);
}

static void encoding_survives_values_of_any_size(void **state) {
  (void)state;
  static const double sizes[] = {1e-42, 1e-30, 1e12, 1e17, 1e25, 3e36};
  vt_context *ctx = context_with(1);
  for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
    enum { D = 8, K = 40, COUNT = 40 };
    float codewords[K * D], vectors[COUNT * D];
    fill_clouds(codewords, K, D, 11, 5, -50, 8);
    fill_clouds(vectors, COUNT, D, 13, 5, -50, 9);
    for (int i = 0; i < K * D; i++) codewords[i] = (float)(codewords[i] * sizes[s]);
    for (int i = 0; i < COUNT * D; i++) vectors[i] = (float)(vectors[i] * sizes[s]);
    check_codes(ctx, D, codewords, K, vectors, COUNT);
  }
  vt_destroy_context(ctx);
}

static void training_finds_clouds_that_lie_apart(void **state) {
  (void)state;
  enum { D = 16, K = 40, COUNT = 8000 };
  vt_context *ctx = context_with(2);
  float *vectors = VT_NEW(ctx, float, COUNT *D), *codewords = VT_NEW(ctx, float, K *D);
  fill_clouds(vectors, COUNT, D, K, 1, 0, 4);
  vt_gla_desc desc = vt_default_gla_desc();
  desc.dimension = D;
  desc.codeword_count = K;
  vt_gla_report report;
  assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, COUNT, codewords, NULL, &report), VT_OK);
  assert_int_equal(report.codeword_count, K);
  assert_close(report.distortion, D, 0.03 * D); // each coordinate has variance 4 * 3/12 = 1
  vt_free(ctx, vectors);
  vt_free(ctx, codewords);
  vt_destroy_context(ctx);
}

static void distortion_never_rises_and_is_what_the_codes_give(void **state) {
  (void)state;
  enum { D = 12, K = 60, COUNT = 3000 };
  vt_context *ctx = context_with(2);
  float *vectors = VT_NEW(ctx, float, COUNT *D), *codewords = VT_NEW(ctx, float, K *D);
  uint16_t *code = VT_NEW(ctx, uint16_t, COUNT);
  fill_clouds(vectors, COUNT, D, 200, 8, 0, 4);
  vt_gla_desc desc = vt_default_gla_desc();
  desc.dimension = D;
  desc.codeword_count = K;
  desc.stop_gain = 0;
  double before = INFINITY, first = 0;
  for (desc.max_iterations = 1; desc.max_iterations < 20; desc.max_iterations++) {
    vt_gla_report report;
    assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, COUNT, codewords, code, &report), VT_OK);
    double sum = 0;
    for (int i = 0; i < COUNT; i++) sum += vt_squared_distance(D, vectors + i * D, codewords + code[i] * D);
    assert_close(sum / COUNT, report.distortion, 1e-9 * report.distortion);
    assert_true(report.distortion <= before * (1 + 1e-7));
    before = report.distortion;
    if (desc.max_iterations == 1) first = before;
  }
  assert_true(before < 0.97 * first);
  vt_free(ctx, vectors);
  vt_free(ctx, codewords);
  vt_free(ctx, code);
  vt_destroy_context(ctx);
}

static void fewer_distinct_vectors_than_codewords_are_kept_exactly(void **state) {
  (void)state;
  enum { D = 5, COUNT = 700, DISTINCT = 23 };
  vt_context *ctx = context_with(2);
  float *vectors = VT_NEW(ctx, float, COUNT *D), codewords[64 * D];
  uint16_t code[COUNT];
  fill_clouds(vectors, COUNT, D, DISTINCT, 0, -20, 6); // spread 0: vectors i and i + DISTINCT are equal
  static const int wanted[] = {DISTINCT, DISTINCT + 1, 64};
  for (int c = 0; c < 3; c++) {
    vt_gla_desc desc = vt_default_gla_desc();
    desc.dimension = D;
    desc.codeword_count = wanted[c];
    vt_gla_report report;
    assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, COUNT, codewords, code, &report), VT_OK);
    assert_int_equal(report.codeword_count, DISTINCT);
    assert_true(report.distortion == 0);
    for (int i = 0; i < COUNT; i++) assert_memory_equal(codewords + code[i] * D, vectors + i * D, D * sizeof(float));
  }
  vt_gla_desc desc = vt_default_gla_desc();
  desc.dimension = D;
  vt_gla_report report;
  assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, 0, codewords, code, &report), VT_OK);
  assert_int_equal(report.codeword_count, 0);
  vt_free(ctx, vectors);
  vt_destroy_context(ctx);
}

static void no_codeword_is_left_without_vectors(void **state) {
  (void)state;
  enum { D = 2, COUNT = 150, K = 140 };
  // Float squares of 1e25 overflow: seeding is then blind, may take a vector twice, and leaves empty cells to be
  // filled.
  static const double sizes[] = {1, 1e25};
  vt_context *ctx = context_with(1);
  for (uint64_t seed = 0; seed < 60; seed++) {
    float vectors[COUNT * D], codewords[K * D];
    uint16_t code[COUNT];
    int used[K] = {0}, unused = 0;
    fill_clouds(vectors, COUNT, D, COUNT, 0, 0, seed);
    for (int i = 0; i < COUNT * D; i++) vectors[i] = (float)(vectors[i] * sizes[seed % 2]);
    vt_gla_desc desc = vt_default_gla_desc();
    desc.dimension = D;
    desc.codeword_count = K;
    desc.seed = seed;
    desc.stop_gain = 0;
    assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, COUNT, codewords, code, NULL), VT_OK);
    for (int i = 0; i < COUNT; i++) used[code[i]]++;
    for (int k = 0; k < K; k++) unused += !used[k];
    assert_int_equal(unused, 0);
  }
  vt_destroy_context(ctx);
}

static void values_that_are_no_numbers_are_refused(void **state) {
  (void)state;
  vt_context *ctx = context_with(1);
  vt_gla_desc desc = vt_default_gla_desc();
  desc.dimension = 2;
  desc.codeword_count = 2;
  float codewords[4];
  static const float bad[] = {NAN, INFINITY, -INFINITY};
  for (int i = 0; i < 3; i++) {
    float vectors[8] = {1, 2, 3, 4, 5, 6, 7, 8}, weight[4] = {1, 1, 1, 1};
    vectors[5] = bad[i];
    assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, 4, codewords, NULL, NULL), VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(ctx), "vector 2"));
    vt_clear_error(ctx);
    vectors[5] = 6;
    weight[1] = bad[i];
    assert_int_equal(vt_train_codebook(ctx, &desc, vectors, weight, 4, codewords, NULL, NULL), VT_BAD_INPUT);
    vt_clear_error(ctx);
  }
  float vectors[4] = {1, 2, 3, 4}, negative[2] = {1, -1}, nothing[2] = {0, 0};
  assert_int_equal(vt_train_codebook(ctx, &desc, vectors, negative, 2, codewords, NULL, NULL), VT_BAD_INPUT);
  assert_int_equal(vt_train_codebook(ctx, &desc, vectors, nothing, 2, codewords, NULL, NULL), VT_BAD_INPUT);
  vt_destroy_context(ctx);
}

static void weights_pull_and_weightless_vectors_do_not(void **state) {
  (void)state;
  vt_context *ctx = context_with(1);
  vt_gla_desc desc = vt_default_gla_desc();
  desc.dimension = 1;
  desc.codeword_count = 1;
  float vectors[5] = {0, 4, 4, 1000, 12}, weight[5] = {1, 1, 1, 0, 5}, codeword;
  uint16_t code[5] = {9, 9, 9, 9, 9};
  vt_gla_report report;
  assert_int_equal(vt_train_codebook(ctx, &desc, vectors, weight, 5, &codeword, code, &report), VT_OK);
  assert_close(codeword, (4 + 4 + 60) / 8.0, 1e-6);
  assert_close(report.distortion, (8.5 * 8.5 + 2 * 4.5 * 4.5 + 5 * 3.5 * 3.5) / 8, 1e-5);
  for (int i = 0; i < 5; i++) assert_int_equal(code[i], 0);
  vt_destroy_context(ctx);
}

static void snapped_codewords_are_input_vectors_and_cost_at_most_3_dB(void **state) {
  (void)state;
  enum { D = 16, K = 50, COUNT = 4000 };
  vt_context *ctx = context_with(2);
  float *vectors = VT_NEW(ctx, float, COUNT *D), *codewords = VT_NEW(ctx, float, K *D);
  fill_clouds(vectors, COUNT, D, 300, 8, 0, 4);
  vt_gla_desc desc = vt_default_gla_desc();
  desc.dimension = D;
  desc.codeword_count = K;
  vt_gla_report plain, snapped;
  assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, COUNT, codewords, NULL, &plain), VT_OK);
  desc.snap = true;
  assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, COUNT, codewords, NULL, &snapped), VT_OK);
  assert_true(snapped.distortion > plain.distortion && snapped.distortion < 2.001 * plain.distortion);
  for (int j = 0; j < K; j++) {
    int found = 0;
    for (int i = 0; i < COUNT; i++) found |= !memcmp(codewords + j * D, vectors + i * D, D * sizeof(float));
    assert_true(found);
  }
  vt_free(ctx, vectors);
  vt_free(ctx, codewords);
  vt_destroy_context(ctx);
}

static void threads_change_no_bit_of_a_codebook(void **state) {
  (void)state;
  enum { D = 20, K = 70, COUNT = 9000 };
  static float codewords[3][K * D], weight[COUNT];
  static uint16_t code[3][COUNT];
  double distortion[3];
  for (int t = 0; t < 3; t++) {
    vt_context *ctx = context_with(t + 1);
    float *vectors = VT_NEW(ctx, float, COUNT *D);
    fill_clouds(vectors, COUNT, D, 400, 8, 0, 4);
    for (int i = 0; i < COUNT; i++) weight[i] = (float)(i % 10) / 9;
    vt_gla_desc desc = vt_default_gla_desc();
    desc.dimension = D;
    desc.codeword_count = K;
    vt_gla_report report;
    assert_int_equal(vt_train_codebook(ctx, &desc, vectors, weight, COUNT, codewords[t], code[t], &report), VT_OK);
    distortion[t] = report.distortion;
    assert_memory_equal(codewords[t], codewords[0], sizeof codewords[0]);
    assert_memory_equal(code[t], code[0], sizeof code[0]);
    assert_true(distortion[t] == distortion[0]);
    vt_free(ctx, vectors);
    vt_destroy_context(ctx);
  }
}

static void training_survives_values_of_any_size(void **state) {
  (void)state;
  enum { D = 4, K = 30, COUNT = 500 };
  static const double sizes[] = {1e-42, 1e-30, 1e12, 1e19, 1e35};
  vt_context *ctx = context_with(2);
  for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
    float vectors[COUNT * D], codewords[K * D];
    fill_clouds(vectors, COUNT, D, K, 0.5, -50, 8);
    for (int i = 0; i < COUNT * D; i++) vectors[i] = (float)(vectors[i] * sizes[s]);
    vt_gla_desc desc = vt_default_gla_desc();
    desc.dimension = D;
    desc.codeword_count = K;
    vt_gla_report report;
    assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, COUNT, codewords, NULL, &report), VT_OK);
    assert_true(isfinite(report.distortion) && report.distortion < 30 * sizes[s] * sizes[s]);
    for (int i = 0; i < K * D; i++) assert_true(isfinite(codewords[i]));
  }
  vt_destroy_context(ctx);
}

static void cancelling_and_want_of_memory_leave_nothing_behind(void **state) {
  (void)state;
  enum { D = 8, COUNT = 5000 };
  static float vectors[COUNT * D], codewords[64 * D];
  fill_clouds(vectors, COUNT, D, 400, 8, 0, 4);
  vt_gla_desc desc = vt_default_gla_desc();
  desc.dimension = D;
  desc.codeword_count = 64;
  vt_context *ctx = context_with(2);
  vt_cancel(ctx);
  assert_int_equal(vt_train_codebook(ctx, &desc, vectors, NULL, COUNT, codewords, NULL, NULL), VT_CANCELLED);
  assert_int_equal(vt_bytes_in_use(ctx), 0);
  vt_destroy_context(ctx);
  int failures = 0;
  for (uint64_t bound = 1000; bound < 400000; bound += 7001) {
    vt_context_desc context_desc = vt_default_context_desc();
    context_desc.max_memory = bound;
    context_desc.thread_count = 1;
    ctx = vt_create_context(&context_desc);
    vt_status status = vt_train_codebook(ctx, &desc, vectors, NULL, COUNT, codewords, NULL, NULL);
    assert_true(status == VT_OK || status == VT_OUT_OF_MEMORY);
    failures += status == VT_OUT_OF_MEMORY;
    assert_int_equal(vt_bytes_in_use(ctx), 0);
    vt_destroy_context(ctx);
  }
  assert_true(failures > 3);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(every_path_gives_the_same_bits),
      cmocka_unit_test(encoding_finds_the_true_nearest_codeword),
      cmocka_unit_test(encoding_takes_the_lower_index_of_equal_codewords),
      cmocka_unit_test(encoding_survives_values_of_any_size),
      cmocka_unit_test(training_finds_clouds_that_lie_apart),
      cmocka_unit_test(distortion_never_rises_and_is_what_the_codes_give),
      cmocka_unit_test(fewer_distinct_vectors_than_codewords_are_kept_exactly),
      cmocka_unit_test(no_codeword_is_left_without_vectors),
      cmocka_unit_test(values_that_are_no_numbers_are_refused),
      cmocka_unit_test(weights_pull_and_weightless_vectors_do_not),
      cmocka_unit_test(snapped_codewords_are_input_vectors_and_cost_at_most_3_dB),
      cmocka_unit_test(threads_change_no_bit_of_a_codebook),
      cmocka_unit_test(training_survives_values_of_any_size),
      cmocka_unit_test(cancelling_and_want_of_memory_leave_nothing_behind),
  };
  only_threads_for_the_thread_sanitizer();
  return cmocka_run_group_tests(tests, NULL, NULL);
}
