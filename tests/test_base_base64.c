// test_base_base64.c - bytes as printable text and back
// SPDX-License-Identifier: BSD-3-Clause
#include "base/base64.h"
#include "base/rng.h"
#include "tests/unit.h"

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1, desc.log_level = VT_LOG_QUIET;
  vt_context *ctx = vt_create_context(&desc);
  assert_non_null(ctx);
  return ctx;
}

static void the_vectors_of_the_rfc_hold_both_ways(void **state) {
  (void)state;
  vt_context *ctx = make_context();
  const char *vectors[][2] = {{"", ""},
                              {"f", "Zg=="},
                              {"fo", "Zm8="},
                              {"foo", "Zm9v"},
                              {"foob", "Zm9vYg=="},
                              {"fooba", "Zm9vYmE="},
                              {"foobar", "Zm9vYmFy"},
                              {"\xff\xef\xbe", "/+++"}};
  for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
    const char *plain = vectors[i][0], *coded = vectors[i][1];
    uint8_t *bytes;
    size_t size;
    char *text = vt_base64_encode(ctx, plain, strlen(plain));
    assert_string_equal(text, coded);
    for (size_t length = strlen(coded);; length--) { // with all, some and none of the padding
      bool half_padded = strstr(coded, "==") && length == strlen(coded) - 1;
      if (!half_padded) {
        assert_int_equal(vt_base64_decode(ctx, coded, length, "text", &bytes, &size), VT_OK);
        assert_int_equal(size, strlen(plain));
        assert_memory_equal(bytes, plain, size + 1); // the zero behind it too
        vt_free(ctx, bytes);
      }
      if (!length || coded[length - 1] != '=') break;
    }
    vt_free(ctx, text);
  }
  vt_destroy_context(ctx);
}

static void any_bytes_come_back(void **state) {
  (void)state;
  vt_context *ctx = make_context();
  vt_rng rng = vt_seed_rng(64, 1);
  for (size_t size = 0; size < 600; size++) {
    uint8_t bytes[600], *back;
    size_t back_size;
    for (size_t i = 0; i < size; i++) bytes[i] = (uint8_t)vt_random(&rng);
    char *text = vt_base64_encode(ctx, bytes, size);
    assert_int_equal(strlen(text), (size + 2) / 3 * 4);
    assert_int_equal(vt_base64_decode(ctx, text, strlen(text), "text", &back, &back_size), VT_OK);
    assert_int_equal(back_size, size);
    assert_memory_equal(back, bytes, size);
    vt_free(ctx, back);
    vt_free(ctx, text);
  }
  vt_destroy_context(ctx);
}

static void other_text_is_refused_with_its_place(void **state) {
  (void)state;
  vt_context *ctx = make_context();
  const char *bad[][2] = {{"Z", "ends within a byte"},   {"Zg=", "character 3"},         {"Zg==Zg==", "character 3"},
                          {"Zm9v\nm9v", "character 5"},  {"Zm-v", "character 3"},        {"Zm 9", "character 3"},
                          {"====", "character 1"},       {"Zh==", "behind its last"},    {"Zm9=", "behind its last"},
                          {"\xc3\xa4Zg", "character 1"}, {"Zm9vY", "ends within a byte"}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    uint8_t *bytes;
    size_t size;
    assert_int_equal(vt_base64_decode(ctx, bad[i][0], strlen(bad[i][0]), "text", &bytes, &size), VT_BAD_INPUT);
    assert_null(bytes);
    if (strncmp(vt_last_error(ctx), "text: ", 6) || !strstr(vt_last_error(ctx), bad[i][1]))
      fail_msg("'%s' gives '%s'", bad[i][0], vt_last_error(ctx));
    vt_clear_error(ctx);
  }
  vt_destroy_context(ctx);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_vectors_of_the_rfc_hold_both_ways),
      cmocka_unit_test(any_bytes_come_back),
      cmocka_unit_test(other_text_is_refused_with_its_place),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
