// test_base_json.c - JSON written by our writer and read by jansson
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/unit.h"

#include "base/json.h"
#include "base/rng.h"

static vt_context *open_context(uint64_t max_memory) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.log_level = VT_LOG_QUIET;
  desc.max_memory = max_memory;
  return vt_create_context(&desc);
}

static void text_is_laid_out_as_promised(void **state) {
  (void)state;
  vt_context *context = open_context(0);
  char *text;
  size_t size;
  vt_json_writer w = vt_begin_json(context);
  vt_json_open_object(&w, NULL);
  vt_json_put_string(&w, "name", "a \"b\"\\\n\x01");
  vt_json_put_integer(&w, "count", -9223372036854775807ll - 1);
  vt_json_put_bool(&w, "good", true);
  vt_json_put_string(&w, "none", NULL);
  vt_json_put_number(&w, "nan", NAN);
  vt_json_open_array(&w, "empty");
  vt_json_close_array(&w);
  vt_json_open_object(&w, "void");
  vt_json_close_object(&w);
  vt_json_open_array(&w, "matrix");
  for (int i = 0; i < 2; i++) {
    vt_json_open_array(&w, NULL);
    vt_json_put_number(&w, NULL, 0.1);
    vt_json_put_number(&w, NULL, i);
    vt_json_close_array(&w);
  }
  vt_json_close_array(&w);
  vt_json_put_raw(&w, "raw", "{\"x\": 1}\n");
  vt_json_close_object(&w);
  assert_int_equal(vt_end_json(&w, &text, &size), VT_OK);
  assert_string_equal(text, "{\n"
                            "  \"name\": \"a \\\"b\\\"\\\\\\n\\u0001\",\n"
                            "  \"count\": -9223372036854775808,\n"
                            "  \"good\": true,\n"
                            "  \"none\": null,\n"
                            "  \"nan\": null,\n"
                            "  \"empty\": [],\n"
                            "  \"void\": {},\n"
                            "  \"matrix\": [\n"
                            "    [0.1, 0],\n"
                            "    [0.1, 1]\n"
                            "  ],\n"
                            "  \"raw\": {\"x\": 1}\n"
                            "}\n");
  assert_int_equal(size, strlen(text));
  vt_free(context, text);
  vt_destroy_context(context);
}

static void bytes_that_are_no_utf8_are_replaced(void **state) {
  (void)state;
  // Latin-1 letter, stray continuation, overlong slash, surrogate, beyond U+10FFFF, cut at the end
  const char *bad[] = {"\xe4", "\x80", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "ok\xe2\x82"};
  const int replaced[] = {1, 1, 2, 3, 4, 2};
  vt_context *context = open_context(0);
  for (int i = 0; i < 6; i++) {
    char *text, expected[64] = "\"";
    size_t size;
    if (i == 5) strcat(expected, "ok");
    for (int k = 0; k < replaced[i]; k++) strcat(expected, "\xef\xbf\xbd");
    strcat(expected, "\"\n");
    vt_json_writer w = vt_begin_json(context);
    vt_json_put_string(&w, NULL, bad[i]);
    assert_int_equal(vt_end_json(&w, &text, &size), VT_OK);
    assert_string_equal(text, expected);
    vt_free(context, text);
  }
  vt_json_writer w = vt_begin_json(context);
  char *text;
  size_t size;
  vt_json_put_string(&w, NULL, "\xc3\xa4\xe2\x82\xac\xf0\x9f\x8c\xb3"); // good ones stay
  assert_int_equal(vt_end_json(&w, &text, &size), VT_OK);
  assert_string_equal(text, "\"\xc3\xa4\xe2\x82\xac\xf0\x9f\x8c\xb3\"\n");
  vt_free(context, text);
  vt_destroy_context(context);
}

static void writing_over_the_memory_bound_fails_cleanly(void **state) {
  (void)state;
  vt_context *context = open_context(20000);
  char *text;
  size_t size;
  vt_json_writer w = vt_begin_json(context);
  vt_json_open_array(&w, NULL);
  for (int i = 0; i < 20000; i++) vt_json_put_integer(&w, NULL, i);
  vt_json_close_array(&w);
  assert_int_equal(vt_end_json(&w, &text, &size), VT_OUT_OF_MEMORY);
  assert_null(text);
  vt_clear_error(context);
  w = vt_begin_json(context);
  vt_json_open_array(&w, NULL);
  vt_drop_json(&w);
  vt_destroy_context(context);
}

#ifdef VT_WITH_JANSSON
static void every_number_reads_back_the_same(void **state) {
  (void)state;
  vt_context *context = open_context(0);
  enum { COUNT = 20000 };
  static double values[COUNT];
  vt_rng rng = vt_seed_rng(1, 1);
  for (int i = 0; i < COUNT; i++) {
    uint64_t bits = (uint64_t)vt_random(&rng) << 32 | vt_random(&rng);
    memcpy(&values[i], &bits, 8);
    if (!isfinite(values[i])) values[i] = vt_random_unit(&rng);
  }
  values[0] = 0.1, values[1] = 1e22, values[2] = 9007199254740993.0, values[3] = 1.7976931348623157e308,
  values[4] = 4.9e-324;
  vt_json_writer w = vt_begin_json(context);
  vt_json_open_array(&w, NULL);
  for (int i = 0; i < COUNT; i++) vt_json_put_number(&w, NULL, values[i]);
  vt_json_close_array(&w);
  char *text;
  size_t size;
  vt_json *root;
  assert_int_equal(vt_end_json(&w, &text, &size), VT_OK);
  assert_int_equal(vt_parse_json(context, text, size, "numbers", &root), VT_OK);
  assert_int_equal(vt_json_count(root), COUNT);
  for (int i = 0; i < COUNT; i++) assert_true(vt_json_number(vt_json_item(root, (size_t)i), NAN) == values[i]);
  vt_free_json(context, root);
  vt_free(context, text);
  vt_destroy_context(context);
}

static void values_are_found_and_chains_need_no_checks(void **state) {
  (void)state;
  vt_context *context = open_context(0);
  const char *text = "\xef\xbb\xbf{\"a\": {\"b\": [1, 2.5, \"x\", true, null, 123456789012345678901234567890]}}";
  vt_json *root;
  assert_int_equal(vt_parse_json(context, text, strlen(text), "t", &root), VT_OK);
  const vt_json *list = vt_json_member(vt_json_member(root, "a"), "b");
  assert_true(vt_json_is_array(list));
  assert_false(vt_json_is_array(root));
  assert_int_equal(vt_json_count(list), 6);
  assert_int_equal(vt_json_count(root), 1);
  assert_close(vt_json_number(vt_json_item(list, 0), -1), 1, 0);
  assert_close(vt_json_number(vt_json_item(list, 1), -1), 2.5, 0);
  assert_string_equal(vt_json_string(vt_json_item(list, 2), "none"), "x");
  assert_true(vt_json_bool(vt_json_item(list, 3), false));
  assert_true(vt_json_is_number(vt_json_item(list, 5)));
  assert_close(vt_json_number(vt_json_item(list, 5), -1), 123456789012345678901234567890.0, 0);
  assert_null(vt_json_item(list, 6));
  assert_null(vt_json_item(root, 0));
  assert_null(vt_json_member(list, "b"));
  assert_null(vt_json_member(vt_json_member(vt_json_member(root, "no"), "no"), "no"));
  assert_close(vt_json_number(vt_json_item(list, 2), -1), -1, 0);
  assert_close(vt_json_number(NULL, -1), -1, 0);
  assert_string_equal(vt_json_string(vt_json_item(list, 0), "none"), "none");
  assert_true(vt_json_bool(vt_json_item(list, 0), true));
  assert_false(vt_json_is_number(NULL));
  assert_int_equal(vt_json_count(NULL), 0);
  vt_free_json(context, root);
  vt_free_json(context, NULL);
  vt_destroy_context(context);
}

static void text_that_is_no_json_is_refused_with_its_place(void **state) {
  (void)state;
  vt_context *context = open_context(0);
  const char *bad[] = {"",          "{",     "{\"a\": NaN}", "[Infinity]", "[1,]",
                       "{\"a\" 1}", "[1] x", "[1e999]",      "\"\xff\"",   "nul"};
  vt_json *root;
  for (int i = 0; i < 10; i++) {
    assert_int_equal(vt_parse_json(context, bad[i], strlen(bad[i]), "scene.json", &root), VT_BAD_INPUT);
    assert_null(root);
    assert_non_null(strstr(vt_last_error(context), "scene.json: line 1"));
    vt_clear_error(context);
  }
  assert_int_equal(vt_parse_json(context, "[1,\n2,\n}", 8, "scene.json", &root), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(context), "line 3, column 1"));
  vt_clear_error(context);
  size_t depth = 1000000;
  char *deep = malloc(depth);
  memset(deep, '[', depth);
  assert_int_equal(vt_parse_json(context, deep, depth, "deep.json", &root), VT_BAD_INPUT);
  free(deep);
  vt_clear_error(context);
  assert_int_equal(vt_read_json(context, "/no/such/scene.json", &root), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(context), "/no/such/scene.json"));
  vt_destroy_context(context);
}

static void broken_text_never_crashes(void **state) {
  (void)state;
  vt_context *context = open_context(0);
  const char *good =
      "{\"frames\": [{\"file_path\": \"a\\u00e4\", \"m\": [[1, -2.5e3], [0, true]]}, null], \"k\": \"v\"}";
  size_t size = strlen(good);
  vt_rng rng = vt_seed_rng(5, 1);
  char text[256];
  vt_json *root;
  for (int i = 0; i < 20000; i++) {
    memcpy(text, good, size);
    for (int k = 0; k < 3; k++) text[vt_random(&rng) % size] = (char)vt_random(&rng);
    size_t cut = i % 2 ? size : vt_random(&rng) % size;
    if (!vt_parse_json(context, text, cut, "t", &root)) {
      assert_non_null(root);
      vt_free_json(context, root);
    }
    vt_clear_error(context);
  }
  vt_destroy_context(context);
}
#else
static void reading_without_jansson_is_refused(void **state) {
  (void)state;
  vt_context *context = open_context(0);
  vt_json *root;
  assert_int_equal(vt_read_json(context, "scene.json", &root), VT_MISSING_PROGRAM);
  assert_non_null(strstr(vt_last_error(context), "scene.json"));
  assert_null(root);
  assert_close(vt_json_number(vt_json_member(root, "a"), 3), 3, 0);
  vt_destroy_context(context);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(text_is_laid_out_as_promised),
      cmocka_unit_test(bytes_that_are_no_utf8_are_replaced),
      cmocka_unit_test(writing_over_the_memory_bound_fails_cleanly),
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(every_number_reads_back_the_same),
      cmocka_unit_test(values_are_found_and_chains_need_no_checks),
      cmocka_unit_test(text_that_is_no_json_is_refused_with_its_place),
      cmocka_unit_test(broken_text_never_crashes),
#else
      cmocka_unit_test(reading_without_jansson_is_refused),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
