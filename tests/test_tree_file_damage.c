// test_tree_file_damage.c - .vtree files that are cut short, damaged or hostile
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/tree_file_bytes.h"
#include "base/byte_codec.h"

// The bytes must be refused, with a sentence that names the file, and leave nothing behind.
static void assert_refused(vt_context *context, const uint8_t *bytes, size_t size, const char *why) {
  vt_tree tree;
  uint64_t before = vt_bytes_in_use(context);
  assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &tree, NULL), VT_BAD_INPUT);
  assert_true(strncmp(vt_last_error(context), "oak.vtree", 9) == 0);
  if (!strstr(vt_last_error(context), why)) fail_msg("'%s' does not say '%s'", vt_last_error(context), why);
  assert_true(vt_bytes_in_use(context) == before);
  vt_clear_error(context);
}

static size_t find_chunk(uint8_t *file, const char *type, int level, size_t *offset) {
  size_t count = chunk_count(file), at = 24 + 32 * count + 8;
  for (size_t i = 0; i < count; i++) {
    uint8_t *entry = chunk_entry(file, i);
    if (offset) *offset = at;
    if (!memcmp(entry, type, 4) && entry[4] == level) return i;
    at += (size_t)get_number(entry + 8, 8);
  }
  fail_msg("no chunk %s of level %d", type, level);
  return 0;
}

// A file with one chunk (type, level, coding, sizes as given) put in the place of chunk `at`, or, if !replace, before it.
static uint8_t *with_chunk(vt_context *context, uint8_t *file, size_t size, size_t at, bool replace, const char *type,
                           int level, int coding, const void *bytes, size_t stored, uint64_t raw_size, size_t *out_size) {
  size_t count = chunk_count(file), old_at = 32 + 32 * count, new_count = count + !replace, new_at = 32 + 32 * new_count;
  uint8_t *out = VT_NEW(context, uint8_t, size + stored + 64);
  memcpy(out, file, 24);
  for (size_t i = 0, o = 0; i <= count; i++) {
    if (i == at) {
      uint8_t *entry = chunk_entry(out, o++);
      memcpy(entry, type, 4);
      entry[4] = (uint8_t)level, entry[5] = (uint8_t)coding;
      put_number(entry + 8, 8, stored), put_number(entry + 16, 8, raw_size);
      if (stored) memcpy(out + new_at, bytes, stored);
      new_at += stored;
    }
    if (i == count) break;
    size_t length = (size_t)get_number(chunk_entry(file, i) + 8, 8);
    if (i != at || !replace) {
      memcpy(chunk_entry(out, o++), chunk_entry(file, i), 32);
      memcpy(out + new_at, file + old_at, length);
      new_at += length;
    }
    old_at += length;
  }
  put_number(out + 12, 4, new_count);
  mend_checksums(out, new_at);
  *out_size = new_at;
  return out;
}

static uint8_t *without_chunk(vt_context *context, const uint8_t *file, size_t size, size_t at, size_t *out_size) {
  uint8_t *out = VT_NEW(context, uint8_t, size);
  memcpy(out, file, size);
  size_t count = chunk_count(file), offset = 32 + 32 * count;
  for (size_t i = 0; i < at; i++) offset += (size_t)get_number(chunk_entry(out, i) + 8, 8);
  size_t length = (size_t)get_number(chunk_entry(out, at) + 8, 8);
  memmove(out + offset, out + offset + length, size - offset - length);
  memmove(chunk_entry(out, at), chunk_entry(out, at + 1), size - length - (24 + 32 * (at + 1)));
  put_number(out + 12, 4, count - 1);
  *out_size = size - length - 32;
  mend_checksums(out, *out_size);
  return out;
}

// ==== damage =========================================================================================================

static void a_file_cut_at_any_byte_is_refused(void **state) {
  (void)state;
  vt_context *context = make_context();
  for (int i = 0; i < TREE_CASE_COUNT; i++) {
    size_t size;
    uint8_t *bytes = bytes_of_case(context, &tree_cases[i], &size);
    for (size_t cut = 0; cut < size; cut++) {
      uint8_t *part = VT_NEW(context, uint8_t, cut); // of its own, so that a sanitizer sees a step beyond it
      memcpy(part, bytes, cut);
      assert_refused(context, part, cut, "");
      if (cut % 7 == 0) mend_checksums(part, cut), assert_refused(context, part, cut, "");
      vt_free(context, part);
    }
    vt_free(context, bytes);
  }
  vt_destroy_context(context);
}

static void a_change_of_any_byte_is_refused(void **state) {
  (void)state;
  vt_context *context = make_context();
  const uint8_t changes[] = {0x01, 0x80, 0xFF};
  for (int i = 0; i < TREE_CASE_COUNT; i++) {
    size_t size;
    uint8_t *bytes = bytes_of_case(context, &tree_cases[i], &size);
    for (size_t at = 0; at < size; at++)
      for (size_t k = 0; k < sizeof changes; k++) {
        bytes[at] ^= changes[k];
        assert_refused(context, bytes, size, "");
        bytes[at] ^= changes[k];
      }
    vt_free(context, bytes);
  }
  vt_destroy_context(context);
}

// Damage that the checksums cannot tell: the result is an error, or a tree that can be written and read for ever.
static void damage_with_true_checksums_gives_an_error_or_a_sound_tree(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_rng rng = vt_seed_rng(1, 1);
  int sound = 0, refused = 0;
  for (int round = 0; round < 2000 * TREE_CASE_COUNT; round++) {
    static uint8_t *bytes;
    static size_t size;
    if (round % 2000 == 0) bytes = bytes_of_case(context, &tree_cases[round / 2000], &size);
    uint8_t *file = VT_NEW(context, uint8_t, size);
    memcpy(file, bytes, size);
    size_t front = 32 + 32 * chunk_count(file);
    for (uint32_t n = 1 + vt_random(&rng) % 3; n > 0; n--) { // half of the changes in header and table
      size_t at = vt_random(&rng) % (vt_random(&rng) % 2 ? size : front);
      file[at] = vt_random(&rng) % 2 ? (uint8_t)(file[at] ^ 1u << vt_random(&rng) % 8) : (uint8_t)vt_random(&rng);
    }
    mend_checksums(file, size);
    vt_tree tree, again;
    vt_status status = vt_parse_tree(context, file, size, "oak.vtree", &tree, NULL);
    if (status == VT_OK && sound++ % 32 == 0) { // each is written to a disk that is waited for
      size_t first_size, second_size;
      uint8_t *first = bytes_of(context, &tree, &first_size);
      assert_int_equal(vt_parse_tree(context, first, first_size, "oak.vtree", &again, NULL), VT_OK);
      uint8_t *second = bytes_of(context, &again, &second_size);
      assert_int_equal(first_size, second_size);
      assert_memory_equal(first, second, first_size);
      vt_free_tree(context, &again);
      vt_free(context, first);
      vt_free(context, second);
    }
    bool unpackable = status == VT_MISSING_PROGRAM && !vt_can_pack_bytes(); // the coding became zstd
    if (status && !unpackable) assert_int_equal(status, VT_BAD_INPUT), refused++;
    vt_clear_error(context);
    vt_free_tree(context, &tree);
    vt_free(context, file);
    if (round % 2000 == 1999) vt_free(context, bytes);
  }
  assert_true(sound > 100 && refused > 1000);
  vt_destroy_context(context);
}

static void extra_bytes_are_refused(void **state) {
  (void)state;
  vt_context *context = make_context();
  size_t size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[1], &size);
  uint8_t *longer = VT_NEW(context, uint8_t, size + 5);
  memcpy(longer, bytes, size);
  assert_refused(context, longer, size + 5, "not as long");
  mend_checksums(longer, size + 5);
  assert_refused(context, longer, size + 5, "behind its last chunk");
  vt_free(context, longer);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void a_greater_major_version_is_refused_and_a_greater_minor_is_read(void **state) {
  (void)state;
  vt_context *context = make_context();
  size_t size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[1], &size);
  put_number(bytes + 8, 2, 2);
  assert_refused(context, bytes, size, "use a newer voltree");
  put_number(bytes + 8, 2, 1);
  put_number(bytes + 10, 2, 9);
  mend_checksums(bytes, size);
  vt_tree tree;
  assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &tree, NULL), VT_OK);
  vt_free_tree(context, &tree);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void an_unknown_chunk_is_ignored_wherever_it_stands(void **state) {
  (void)state;
  vt_context *context = make_context();
  size_t size, longer_size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[1], &size);
  for (size_t at = 0; at <= chunk_count(bytes); at++) {
    uint8_t *longer = with_chunk(context, bytes, size, at, false, "WIND", 200, 9, "breeze", 6, 1ull << 60, &longer_size);
    vt_tree tree;
    assert_int_equal(vt_parse_tree(context, longer, longer_size, "oak.vtree", &tree, NULL), VT_OK);
    size_t again_size;
    uint8_t *again = bytes_of(context, &tree, &again_size);
    assert_int_equal(size, again_size);
    assert_memory_equal(bytes, again, size);
    vt_free_tree(context, &tree);
    vt_free(context, longer);
    vt_free(context, again);
  }
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void a_missing_or_repeated_chunk_is_named(void **state) {
  (void)state;
  vt_context *context = make_context();
  size_t size, other_size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[1], &size);
  size_t offset = 32 + 32 * chunk_count(bytes);
  for (size_t i = 0; i < chunk_count(bytes); i++) {
    char type[5] = "";
    memcpy(type, chunk_entry(bytes, i), 4);
    uint8_t *less = without_chunk(context, bytes, size, i, &other_size);
    assert_refused(context, less, other_size, type);
    assert_refused(context, less, other_size, "is missing");
    const uint8_t *entry = chunk_entry(bytes, i);
    size_t stored = (size_t)get_number(entry + 8, 8);
    uint8_t *more = with_chunk(context, bytes, size, i, false, type, entry[4], entry[5], bytes + offset, stored,
                               get_number(entry + 16, 8), &other_size);
    assert_refused(context, more, other_size, "comes twice");
    offset += stored;
    vt_free(context, less);
    vt_free(context, more);
  }
  uint8_t *foreign = with_chunk(context, bytes, size, chunk_count(bytes), false, "CELL", 9, 0, "", 0, 0, &other_size);
  assert_refused(context, foreign, other_size, "should not be there");
  vt_free(context, foreign);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

// ==== hostile files ==================================================================================================

// A raw tree whose TREE chunk is `head`, with the sizes of all other chunks as given by the counts, and nothing in them.
static void assert_head_refused(uint32_t cells, uint32_t tiles, int levels, int branching, const char *why) {
  vt_context *context = make_context();
  size_t size, new_size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[0], &size); // raw, 3 views
  uint8_t head[56 + 12 * 12] = {0};
  double cube[4] = {0, 0, 0, 1};
  float side = 1;
  memcpy(head, cube, sizeof cube); // (a little-endian host)
  put_number(head + 32, 4, (uint64_t)branching), put_number(head + 36, 4, (uint64_t)levels), put_number(head + 40, 4, 4);
  memcpy(head + 44, &side, 4);
  put_number(head + 48, 4, 3);
  for (int l = 0; l < levels; l++) {
    put_number(head + 56 + 12 * l, 4, l == levels - 1 ? cells : 0);
    put_number(head + 60 + 12 * l, 4, l == levels - 1 ? tiles : 0);
    head[64 + 12 * l] = 1, head[65 + 12 * l] = l == levels - 1;
  }
  size_t at = find_chunk(bytes, "TREE", 0, NULL);
  uint8_t *file = with_chunk(context, bytes, size, at, true, "TREE", 0, 0, head, 56 + 12 * (size_t)levels,
                             56 + 12 * (uint64_t)levels, &new_size);
  vt_reset_peak(context);
  uint64_t before = vt_bytes_in_use(context);
  assert_refused(context, file, new_size, why);
  assert_true(vt_peak_bytes(context) - before < 1 << 20);
  vt_free(context, file);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void counts_that_no_file_can_hold_are_refused_before_memory_is_asked_for(void **state) {
  (void)state;
  assert_head_refused(1u << 28, 0, 11, 2, "more than a file of this length");
  assert_head_refused(1u << 21, 3u << 21, 11, 2, "more than a file of this length");
  assert_head_refused(UINT32_MAX, 0, 11, 2, "more cells than a level");
  assert_head_refused(9, 0, 2, 2, "more cells than a level");
  assert_head_refused(8, 25, 2, 2, "more tiles than");
  assert_head_refused(8, UINT32_MAX, 2, 2, "more tiles than");
  assert_head_refused(8, 0, 12, 2, "wrong size");
  assert_head_refused(8, 0, 8, 3, "outside its range");
  assert_head_refused(8, 0, 3, 4, "outside its range");
  assert_head_refused(8, 0, 1, 2, "more cells than a level");
  assert_head_refused(4, 4, 2, 2, "size that does not fit");
}

// Changes `count` bytes of the raw content of a chunk (which is then stored as it is) and expects the file to be refused.
static void assert_content_refused(int case_index, const char *type, int level, size_t at, const void *change,
                                   size_t count, const char *why) {
  vt_context *context = make_context();
  size_t size, offset, new_size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[case_index], &size);
  size_t index = find_chunk(bytes, type, level, &offset);
  const uint8_t *entry = chunk_entry(bytes, index);
  size_t stored = (size_t)get_number(entry + 8, 8), raw_size = (size_t)get_number(entry + 16, 8);
  uint8_t *raw = VT_NEW(context, uint8_t, raw_size);
  if (entry[5] == 1)
    assert_int_equal(vt_unpack_bytes(context, bytes + offset, stored, raw, raw_size, "a chunk"), VT_OK);
  else
    memcpy(raw, bytes + offset, raw_size);
  assert_true(at + count <= raw_size);
  memcpy(raw + at, change, count);
  uint8_t *file = with_chunk(context, bytes, size, index, true, type, level, 0, raw, raw_size, raw_size, &new_size);
  assert_refused(context, file, new_size, why);
  assert_refused(context, file, new_size, type);
  vt_free(context, raw);
  vt_free(context, file);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void values_that_cannot_be_are_refused_although_the_checksums_are_right(void **state) {
  (void)state;
  const double nan_value = NAN, huge = INFINITY, zero = 0, minus = -1;
  const uint8_t ones[8] = {255, 255, 255, 255, 255, 255, 255, 255}, none[8] = {0};
  assert_content_refused(0, "TREE", 0, 0, &nan_value, 8, "root cube");
  assert_content_refused(0, "TREE", 0, 16, &huge, 8, "root cube");
  assert_content_refused(0, "TREE", 0, 24, &zero, 8, "root cube");
  assert_content_refused(0, "TREE", 0, 44, none, 4, "tile side");
  assert_content_refused(0, "TREE", 0, 48, ones, 4, "outside its range");
  assert_content_refused(0, "TREE", 0, 66, ones, 1, "outside its range");
  assert_content_refused(0, "META", 0, 0, "[", 1, "no JSON object");
  assert_content_refused(0, "META", 0, 3, none, 1, "no JSON object");
  assert_content_refused(0, "CAMS", 0, 8, &nan_value, 8, "camera 0");
  assert_content_refused(0, "CAMS", 0, 136 + 16, &minus, 8, "camera 1");
  assert_content_refused(0, "CAMS", 0, 2 * 136, ones, 4, "camera 2");
  assert_content_refused(0, "CELL", 1, 0, ones, 1, "cells that cannot be");
  assert_content_refused(0, "CELL", 0, 0, ones, 1, "cells that cannot be");
  assert_content_refused(2, "CELL", 1, 3, ones, 1, "cells that cannot be");
  assert_content_refused(0, "OPAC", 0, 3, ones, 1, "negative or not finite");
  assert_content_refused(1, "OPAC", 3, 0, ones, 4, "negative or not finite");
  assert_content_refused(1, "TIDX", 3, 0, ones, 8, "another number of tiles");
  assert_content_refused(1, "TIDX", 3, 0, none, 8, "another number of tiles");
  assert_content_refused(1, "TCOD", 3, 0, ones, 1, "names a codeword");
}

static void fields_that_cannot_be_are_refused_although_the_checksums_are_right(void **state) {
  (void)state;
  const uint8_t ones[8] = {255, 255, 255, 255, 255, 255, 255, 255}, none[8] = {0}, minus[1] = {0xBF}, two[1] = {0x40};
  vt_context *context = make_context();
  vt_tree tree;
  make_tree(context, &tree_cases[8], &tree);
  size_t corners = tree.octree.levels[3].corner_count; // the highest byte of a number is in its fourth plane
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
  assert_content_refused(8, "COPA", 3, 3 * corners, minus, 1, "negative, too great or not finite");
  assert_content_refused(8, "COPA", 3, 3 * corners, ones, 1, "negative, too great or not finite");
  assert_content_refused(8, "CCOL", 3, 11 * corners, minus, 1, "negative, too great or not finite");
  assert_content_refused(8, "CCOL", 3, 11 * corners, two, 1, "negative, too great or not finite");
  assert_content_refused(9, "COPA", 3, 0, ones, 4, "negative or not finite");
  assert_content_refused(9, "CCOL", 3, 0, ones, 1, "names a codeword");
  assert_content_refused(9, "COLR", 0, 0, ones, 1, "names a codeword");
  assert_content_refused(9, "CBKF", 0, 3, none, 3, "do not rise");
  const size_t places[] = {0, 4, 8, 12, 16, 20, 24}; // factor, then the first view's six numbers
  for (size_t i = 0; i < 7; i++) assert_content_refused(8, "VIDX", 3, places[i], ones, 4, "picture that cannot be");
  assert_content_refused(8, "VIDX", 3, 0, none, 4, "picture that cannot be");
  assert_content_refused(8, "VIDX", 3, 4, none, 4, "picture that cannot be");
  assert_content_refused(8, "VIDX", 3, 20, none, 4, "picture that cannot be"); // no columns, but rows
  assert_content_refused(8, "VIDX", 3, 24, none, 1, "picture that cannot be"); // others than there are codes for
  assert_content_refused(8, "VIDX", 3, 4 + 24 + 8, ones, 1, "picture that cannot be"); // an empty rectangle somewhere
}

// A chunk of a level in the place of what the writer made, or before the chunk that is named.
static void assert_chunk_refused(int case_index, const char *at_type, int level, bool replace, const char *type, size_t stored,
                                 uint64_t raw_size, const char *why) {
  vt_context *context = make_context();
  size_t size, new_size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[case_index], &size), *content = VT_NEW(context, uint8_t, stored);
  size_t at = find_chunk(bytes, at_type, level, NULL);
  uint8_t *file = with_chunk(context, bytes, size, at, replace, type, level, stored == raw_size ? 0 : 1, content, stored,
                             raw_size, &new_size);
  vt_reset_peak(context);
  uint64_t before = vt_bytes_in_use(context);
  assert_refused(context, file, new_size, why);
  assert_true(vt_peak_bytes(context) - before < 1 << 20);
  vt_free(context, file);
  vt_free(context, content);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void field_chunks_of_hostile_sizes_are_refused_before_memory_is_asked_for(void **state) {
  (void)state;
  for (int i = 8; i <= 9; i++) {
    assert_chunk_refused(i, "CCOL", 3, true, "CCOL", 0, 0, "size that does not fit");
    assert_chunk_refused(i, "CCOL", 3, true, "CCOL", 5, 12ull << 40, "size that does not fit");
    assert_chunk_refused(i, "CCOL", 3, true, "CCOL", 5, UINT64_MAX, "size that does not fit");
    assert_chunk_refused(i, "CCOL", 3, true, "CCOL", 12, 12, "COPA"); // another count than the depths
    assert_chunk_refused(i, "COPA", 3, true, "COPA", 5, UINT64_MAX, "size that does not fit");
    assert_chunk_refused(i, "VCOD", 3, true, "VCOD", 5, UINT64_MAX, "size that does not fit");
    assert_chunk_refused(i, "VCOD", 3, true, "VCOD", 5, 1ull << 40, "more than a file of this length");
    assert_chunk_refused(i, "VCOD", 3, true, "VCOD", 5, 1ull << 20, "picture that cannot be");
    assert_chunk_refused(i, "VIDX", 3, true, "VIDX", 5, 1ull << 20, "size that does not fit");
    assert_chunk_refused(i, "VIDX", 3, true, "VIDX", 28, 28, "size that does not fit");
    assert_chunk_refused(i, "COPA", 3, false, "COLR", 0, 0, "should not be there");
  }
  assert_chunk_refused(8, "CELL", 0, false, "CBKF", 3, 3, "should not be there"); // a raw tree
  assert_chunk_refused(9, "CBKF", 0, true, "CBKF", 4, 4, "size that does not fit");
  assert_chunk_refused(9, "CBKF", 0, true, "CBKF", 0, 0, "size that does not fit");
  assert_chunk_refused(9, "CBKF", 0, true, "CBKF", 5, 3 * 65537, "size that does not fit");
  assert_chunk_refused(9, "CBKF", 0, true, "CBKA", 16, 16, "no field codebook");
  assert_chunk_refused(9, "CBKF", 0, false, "CBKA", 16, 16, "CBKC is missing");
  assert_chunk_refused(1, "TCOD", 3, false, "VIDX", 0, 0, "comes twice or too late");
}

static void view_textures_beside_tiles_are_refused(void **state) {
  (void)state;
  vt_context *context = make_context();
  size_t size, new_size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[0], &size), index[4 + 3 * 24] = {1}; // raw, 3 views
  for (int v = 0; v < 3; v++) index[4 + 24 * v] = index[8 + 24 * v] = 1;
  uint8_t *file = with_chunk(context, bytes, size, chunk_count(bytes), false, "VIDX", 3, 0, index, sizeof index,
                             sizeof index, &new_size);
  assert_refused(context, file, new_size, "beside tiles");
  vt_free(context, file);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void a_newer_file_that_cannot_be_read_asks_for_a_newer_program(void **state) {
  (void)state;
  vt_context *context = make_context();
  size_t size, new_size;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[8], &size);
  uint8_t *less = without_chunk(context, bytes, size, find_chunk(bytes, "COPA", 3, NULL), &new_size);
  assert_refused(context, less, new_size, "make it again");
  put_number(less + 10, 2, 4);
  mend_checksums(less, new_size);
  assert_refused(context, less, new_size, "use a newer voltree");
  vt_free(context, less);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

// What an older file may not say: how ratios are interpolated.
static void a_flag_that_came_later_is_refused_in_an_older_file(void **state) {
  (void)state;
  vt_context *context = make_context();
  size_t size, again;
  vt_tree tree, back;
  make_tree(context, &tree_cases[8], &tree);
  for (int l = 0; l < tree.octree.level_count; l++)
    for (int v = 0; v < tree.view_textures[l].view_count; v++) tree.view_textures[l].views[v].linear = true;
  uint8_t *bytes = bytes_of(context, &tree, &size);
  assert_int_equal(vt_parse_tree(context, bytes, size, "oak.vtree", &back, NULL), VT_OK);
  assert_true(back.view_textures[3].view_count > 0 && back.view_textures[3].views[0].linear);
  assert_int_equal(back.view_textures[3].factor, tree.view_textures[3].factor);
  uint8_t *same = bytes_of(context, &back, &again);
  assert_true(size == again && !memcmp(bytes, same, size));
  assert_int_equal(bytes[10], 3);
  put_number(bytes + 10, 2, 2);
  mend_checksums(bytes, size);
  assert_refused(context, bytes, size, "picture that cannot be");
  vt_free_tree(context, &tree);
  vt_free_tree(context, &back);
  vt_free(context, bytes);
  vt_free(context, same);
  vt_destroy_context(context);
}

static void a_packed_chunk_that_unpacks_to_another_size_is_refused(void **state) {
  (void)state;
  vt_context *context = make_context();
  if (!vt_can_pack_bytes()) {
    vt_destroy_context(context);
    skip();
  }
  size_t size, new_size, packed_size, offset;
  uint8_t *bytes = bytes_of_case(context, &tree_cases[1], &size), *packed, *many = VT_NEW(context, uint8_t, 1 << 24);
  assert_int_equal(vt_pack_bytes(context, many, 1 << 24, 9, &packed, &packed_size), VT_OK);
  size_t at = find_chunk(bytes, "COLR", 3, &offset);
  uint64_t raw_size = get_number(chunk_entry(bytes, at) + 16, 8);
  vt_reset_peak(context);
  uint64_t before = vt_bytes_in_use(context);
  for (int honest = 0; honest < 2; honest++) { // 16 MB of zeros where the counts ask for some hundred bytes
    uint8_t *bomb = with_chunk(context, bytes, size, at, true, "COLR", 3, 1, packed, packed_size,
                               honest ? 1 << 24 : raw_size, &new_size);
    assert_refused(context, bomb, new_size, "COLR");
    vt_free(context, bomb);
  }
  assert_true(vt_peak_bytes(context) - before < 1 << 20);
  vt_free(context, many);
  vt_free(context, packed);
  vt_free(context, bytes);
  vt_destroy_context(context);
}

static void a_build_without_zstd_says_so(void **state) {
  (void)state;
  vt_context *context = make_context();
  if (vt_can_pack_bytes()) {
    vt_destroy_context(context);
    skip();
  }
  vt_tree tree;
  assert_int_equal(vt_read_tree(context, VT_SOURCE_DIR "/tests/golden/v1_packed_zstd.vtree", &tree, NULL),
                   VT_MISSING_PROGRAM);
  assert_non_null(strstr(vt_last_error(context), "zstd"));
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_file_cut_at_any_byte_is_refused),
      cmocka_unit_test(a_change_of_any_byte_is_refused),
      cmocka_unit_test(damage_with_true_checksums_gives_an_error_or_a_sound_tree),
      cmocka_unit_test(extra_bytes_are_refused),
      cmocka_unit_test(a_greater_major_version_is_refused_and_a_greater_minor_is_read),
      cmocka_unit_test(an_unknown_chunk_is_ignored_wherever_it_stands),
      cmocka_unit_test(a_missing_or_repeated_chunk_is_named),
      cmocka_unit_test(counts_that_no_file_can_hold_are_refused_before_memory_is_asked_for),
      cmocka_unit_test(values_that_cannot_be_are_refused_although_the_checksums_are_right),
      cmocka_unit_test(fields_that_cannot_be_are_refused_although_the_checksums_are_right),
      cmocka_unit_test(field_chunks_of_hostile_sizes_are_refused_before_memory_is_asked_for),
      cmocka_unit_test(view_textures_beside_tiles_are_refused),
      cmocka_unit_test(a_newer_file_that_cannot_be_read_asks_for_a_newer_program),
      cmocka_unit_test(a_flag_that_came_later_is_refused_in_an_older_file),
      cmocka_unit_test(a_packed_chunk_that_unpacks_to_another_size_is_refused),
      cmocka_unit_test(a_build_without_zstd_says_so),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
