// test_base_files.c - files, folders, paths, checksums and packed bytes
// SPDX-License-Identifier: BSD-3-Clause
#define _XOPEN_SOURCE 700
#include "tests/unit.h"

#include "base/byte_codec.h"
#include "base/file.h"
#include "base/hash.h"
#include "base/rng.h"
#include <sys/stat.h>
#include <unistd.h>

typedef struct bench { // a context and a folder of its own
  vt_context *context;
  char folder[64];
} bench;

static void open_bench(bench *b) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 2;
  desc.log_level = VT_LOG_QUIET;
  b->context = vt_create_context(&desc);
  assert_non_null(b->context);
  strcpy(b->folder, "/tmp/voltree-files-XXXXXX");
  assert_non_null(mkdtemp(b->folder));
}

static void close_bench(bench *b) {
  char command[128];
  snprintf(command, sizeof command, "rm -rf '%s'", b->folder);
  assert_int_equal(system(command), 0);
  vt_destroy_context(b->context); // asserts that nothing is left
}

static char *in_folder(bench *b, const char *name) {
  static char path[512];
  snprintf(path, sizeof path, "%s/%s", b->folder, name);
  return path;
}

static void a_written_file_reads_back(void **state) {
  (void)state;
  bench b;
  open_bench(&b);
  const size_t sizes[] = {0, 1, 4095, 4096, 65535, 65536, 300001};
  for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
    uint8_t *bytes = malloc(sizes[i] + 1), *back;
    size_t size;
    vt_rng rng = vt_seed_rng(i, 1);
    for (size_t k = 0; k < sizes[i]; k++) bytes[k] = (uint8_t)vt_random(&rng);
    assert_int_equal(vt_write_file(b.context, in_folder(&b, "data"), bytes, sizes[i]), VT_OK);
    assert_int_equal(vt_read_file(b.context, in_folder(&b, "data"), &back, &size), VT_OK);
    assert_int_equal(size, sizes[i]);
    assert_memory_equal(back, bytes, size);
    assert_int_equal(back[size], 0);
    vt_free(b.context, back);
    free(bytes);
  }
  vt_names names; // no temporary file is left
  assert_int_equal(vt_list_folder(b.context, b.folder, false, &names), VT_OK);
  assert_int_equal(names.count, 1);
  vt_free_names(b.context, &names);
  close_bench(&b);
}

static void a_failed_write_leaves_the_old_file_and_says_why(void **state) {
  (void)state;
  bench b;
  open_bench(&b);
  assert_int_equal(vt_write_file(b.context, in_folder(&b, "none/data"), "x", 1), VT_FAILED);
  assert_non_null(strstr(vt_last_error(b.context), "none/data"));
  assert_non_null(strstr(vt_last_error(b.context), "folder does not exist"));
  vt_clear_error(b.context);
  assert_int_equal(vt_write_file(b.context, b.folder, "x", 1), VT_FAILED);
  assert_non_null(strstr(vt_last_error(b.context), "is a folder"));
  vt_clear_error(b.context);
  assert_int_equal(vt_write_file(b.context, "", "x", 1), VT_FAILED);
  vt_clear_error(b.context);
  if (geteuid()) { // root may write anywhere
    assert_int_equal(vt_write_file(b.context, in_folder(&b, "data"), "old", 3), VT_OK);
    assert_int_equal(chmod(b.folder, 0500), 0);
    assert_int_equal(vt_write_file(b.context, in_folder(&b, "data"), "new", 3), VT_FAILED);
    assert_non_null(strstr(vt_last_error(b.context), "permission"));
    assert_int_equal(chmod(b.folder, 0700), 0);
    uint8_t *back;
    size_t size;
    assert_int_equal(vt_read_file(b.context, in_folder(&b, "data"), &back, &size), VT_OK);
    assert_string_equal((char *)back, "old");
    vt_free(b.context, back);
  }
  close_bench(&b);
}

static void a_full_disk_is_named_as_such(void **state) {
  (void)state;
  if (access("/dev/full", W_OK)) skip();
  bench b;
  open_bench(&b);
  assert_int_equal(vt_write_file(b.context, "/dev/full", "x", 1), VT_FAILED);
  assert_non_null(strstr(vt_last_error(b.context), "the disk is full"));
  close_bench(&b);
}

static void devices_and_links_are_written_through(void **state) {
  (void)state;
  bench b;
  struct stat s;
  open_bench(&b);
  assert_int_equal(vt_write_file(b.context, "/dev/null", "x", 1), VT_OK);
  assert_int_equal(stat("/dev/null", &s), 0);
  assert_true(S_ISCHR(s.st_mode));
  assert_int_equal(vt_write_file(b.context, in_folder(&b, "target"), "old", 3), VT_OK);
  assert_int_equal(symlink("target", in_folder(&b, "link")), 0);
  assert_int_equal(vt_write_file(b.context, in_folder(&b, "link"), "new", 3), VT_OK);
  assert_int_equal(lstat(in_folder(&b, "link"), &s), 0);
  assert_true(S_ISLNK(s.st_mode));
  uint8_t *back;
  size_t size;
  assert_int_equal(vt_read_file(b.context, in_folder(&b, "target"), &back, &size), VT_OK);
  assert_string_equal((char *)back, "new");
  vt_free(b.context, back);
  close_bench(&b);
}

static void reading_what_is_no_file_says_why(void **state) {
  (void)state;
  bench b;
  uint8_t *bytes = (uint8_t *)1;
  size_t size = 7;
  open_bench(&b);
  assert_int_equal(vt_read_file(b.context, in_folder(&b, "missing"), &bytes, &size), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(b.context), "missing"));
  assert_null(bytes);
  assert_int_equal(size, 0);
  vt_clear_error(b.context);
  assert_int_equal(vt_read_file(b.context, b.folder, &bytes, &size), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(b.context), "is a folder"));
  assert_false(vt_is_file(b.folder));
  assert_true(vt_is_folder(b.folder));
  assert_false(vt_is_folder(in_folder(&b, "missing")));
  close_bench(&b);
}

static void a_file_over_the_memory_bound_is_refused(void **state) {
  (void)state;
  bench b;
  uint8_t *bytes, *block = calloc(1, 1 << 20);
  size_t size;
  open_bench(&b);
  assert_int_equal(vt_write_file(b.context, in_folder(&b, "large"), block, 1 << 20), VT_OK);
  free(block);
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.max_memory = 1 << 19;
  vt_context *small = vt_create_context(&desc);
  assert_int_equal(vt_read_file(small, in_folder(&b, "large"), &bytes, &size), VT_OUT_OF_MEMORY);
  assert_null(bytes);
  vt_destroy_context(small);
  close_bench(&b);
}

static void folders_are_made_with_their_parents(void **state) {
  (void)state;
  bench b;
  open_bench(&b);
  assert_int_equal(vt_make_folder(b.context, in_folder(&b, "a/b//c/")), VT_OK);
  assert_true(vt_is_folder(in_folder(&b, "a/b/c")));
  assert_int_equal(vt_make_folder(b.context, in_folder(&b, "a/b/c")), VT_OK);
  assert_int_equal(vt_make_folder(b.context, "/"), VT_OK);
  assert_int_equal(vt_write_file(b.context, in_folder(&b, "a/file"), "x", 1), VT_OK);
  assert_int_equal(vt_make_folder(b.context, in_folder(&b, "a/file")), VT_FAILED);
  assert_non_null(strstr(vt_last_error(b.context), "a file stands"));
  vt_clear_error(b.context);
  assert_int_equal(vt_make_folder(b.context, in_folder(&b, "a/file/below")), VT_FAILED);
  close_bench(&b);
}

static void listings_are_sorted_and_survive_loops_of_links(void **state) {
  (void)state;
  bench b;
  vt_names names;
  open_bench(&b);
  assert_int_equal(vt_make_folder(b.context, in_folder(&b, "sub/deep")), VT_OK);
  const char *files[] = {"b.jpg", "a.jpg", ".hidden", "sub/c.jpg", "sub/deep/d.jpg", "B.jpg"};
  for (int i = 0; i < 6; i++) assert_int_equal(vt_write_file(b.context, in_folder(&b, files[i]), "", 0), VT_OK);
  assert_int_equal(symlink("..", in_folder(&b, "sub/up")), 0);
  assert_int_equal(symlink("nowhere", in_folder(&b, "broken")), 0);
  assert_int_equal(vt_list_folder(b.context, b.folder, true, &names), VT_OK);
  const char *expected[] = {"B.jpg", "a.jpg", "b.jpg", "sub/c.jpg", "sub/deep/d.jpg"};
  assert_int_equal(names.count, 5);
  for (int i = 0; i < 5; i++) assert_string_equal(names.items[i], expected[i]);
  vt_free_names(b.context, &names);
  assert_int_equal(vt_list_folder(b.context, b.folder, false, &names), VT_OK);
  assert_int_equal(names.count, 5); // three files, the broken link, the folder
  assert_string_equal(names.items[4], "sub");
  vt_free_names(b.context, &names);
  assert_int_equal(vt_list_folder(b.context, in_folder(&b, "none"), false, &names), VT_BAD_INPUT);
  assert_int_equal(names.count, 0);
  vt_clear_error(b.context);
  assert_int_equal(vt_list_folder(b.context, in_folder(&b, "a.jpg"), false, &names), VT_BAD_INPUT);
  assert_non_null(strstr(vt_last_error(b.context), "is no folder"));
  close_bench(&b);
}

static void paths_are_joined_and_cut(void **state) {
  (void)state;
  bench b;
  open_bench(&b);
  const char *joins[][3] = {{"a", "b", "a/b"}, {"a/", "b", "a/b"}, {"", "b", "b"}, {"a", "/b", "/b"}, {"/", "b", "/b"}};
  for (int i = 0; i < 5; i++) {
    char *path = vt_join(b.context, joins[i][0], joins[i][1]);
    assert_string_equal(path, joins[i][2]);
    vt_free(b.context, path);
  }
  const char *cuts[][2] = {
      {"a/b.jpg", "a/b"}, {"a.b/c", "a.b/c"}, {".x", ".x"}, {"a/.x", "a/.x"}, {"t.tar.gz", "t.tar"}};
  for (int i = 0; i < 5; i++) {
    char *path = vt_without_ending(b.context, cuts[i][0]);
    assert_string_equal(path, cuts[i][1]);
    vt_free(b.context, path);
  }
  assert_string_equal(vt_base_name("a/b/c.png"), "c.png");
  assert_string_equal(vt_base_name("c.png"), "c.png");
  close_bench(&b);
}

static void checksums_are_those_of_the_published_vectors(void **state) {
  (void)state;
  assert_true(vt_hash("", 0, 0) == 0xEF46DB3751D8E999u);
  assert_true(vt_hash("a", 1, 0) == 0xD24EC4F1A98C6E5Bu);
  assert_true(vt_hash("abc", 3, 0) == 0x44BC2CF5AD770999u);
  // The sanity bytes of the reference implementation: 64-bit generator, lengths that meet every tail.
  uint8_t bytes[222];
  uint64_t generator = 2654435761u;
  for (int i = 0; i < 222; i++) {
    bytes[i] = (uint8_t)(generator >> 56);
    generator *= 11400714785074694797u;
  }
  const uint64_t prime = 2654435761u;
  assert_true(vt_hash(bytes, 0, prime) == 0xAC75FDA2929B17EFu);
  assert_true(vt_hash(bytes, 1, 0) == 0xE934A84ADB052768u);
  assert_true(vt_hash(bytes, 1, prime) == 0x5014607643A9B4C3u);
  assert_true(vt_hash(bytes, 4, 0) == 0x9136A0DCA57457EEu);
  assert_true(vt_hash(bytes, 14, 0) == 0x8282DCC4994E35C8u);
  assert_true(vt_hash(bytes, 14, prime) == 0xC3BD6BF63DEB6DF0u);
  assert_true(vt_hash(bytes, 222, 0) == 0xB641AE8CB691C174u);
  assert_true(vt_hash(bytes, 222, prime) == 0x20CB8AB7AE10C14Au);
}

#ifdef VT_WITH_ZSTD
static void packed_bytes_unpack_to_the_same(void **state) {
  (void)state;
  bench b;
  open_bench(&b);
  assert_true(vt_can_pack_bytes());
  const size_t sizes[] = {0, 1, 1000, 200000};
  for (int i = 0; i < 4; i++)
    for (int level = 1; level <= 19; level += 9) {
      uint8_t *bytes = malloc(sizes[i] + 1), *back = malloc(sizes[i] + 8), *packed;
      size_t packed_size;
      for (size_t k = 0; k < sizes[i]; k++) bytes[k] = (uint8_t)(k * k >> 9);
      memset(back, 0xa5, sizes[i] + 8);
      assert_int_equal(vt_pack_bytes(b.context, bytes, sizes[i], level, &packed, &packed_size), VT_OK);
      if (i == 3) assert_true(packed_size < sizes[i] / 2);
      assert_int_equal(vt_unpack_bytes(b.context, packed, packed_size, back, sizes[i], "block"), VT_OK);
      assert_memory_equal(back, bytes, sizes[i]);
      assert_memory_equal(back + sizes[i], "\xa5\xa5\xa5\xa5\xa5\xa5\xa5\xa5", 8);
      vt_free(b.context, packed);
      free(bytes);
      free(back);
    }
  close_bench(&b);
}

static void damaged_packed_bytes_are_refused_and_write_nothing_outside(void **state) {
  (void)state;
  bench b;
  open_bench(&b);
  enum { SIZE = 5000 };
  uint8_t bytes[SIZE], back[SIZE + 8], *packed, *copy;
  size_t packed_size;
  vt_rng rng = vt_seed_rng(3, 1);
  for (int k = 0; k < SIZE; k++) bytes[k] = (uint8_t)(vt_random(&rng) & 15);
  assert_int_equal(vt_pack_bytes(b.context, bytes, SIZE, 3, &packed, &packed_size), VT_OK);
  copy = malloc(packed_size + 1);
  memset(back, 0xa5, sizeof back);
  for (size_t cut = 0; cut < packed_size; cut++) {
    memcpy(copy, packed, packed_size);
    assert_int_equal(vt_unpack_bytes(b.context, copy, cut, back, SIZE, "tree.vtree"), VT_BAD_INPUT);
    assert_non_null(strstr(vt_last_error(b.context), "tree.vtree"));
    vt_clear_error(b.context);
  }
  memcpy(copy, packed, packed_size);
  copy[packed_size] = 0;
  assert_int_equal(vt_unpack_bytes(b.context, copy, packed_size + 1, back, SIZE, "t"), VT_BAD_INPUT);
  assert_int_equal(vt_unpack_bytes(b.context, packed, packed_size, back, SIZE - 1, "t"), VT_BAD_INPUT);
  assert_int_equal(vt_unpack_bytes(b.context, packed, packed_size, back, SIZE + 1, "t"), VT_BAD_INPUT);
  for (int i = 0; i < 3000; i++) { // a flip may go unseen here (the file has checksums), but must stay inside
    memcpy(copy, packed, packed_size);
    copy[vt_random(&rng) % packed_size] ^= (uint8_t)(1u << (vt_random(&rng) & 7));
    (void)vt_unpack_bytes(b.context, copy, packed_size, back, SIZE, "t");
    assert_memory_equal(back + SIZE, "\xa5\xa5\xa5\xa5\xa5\xa5\xa5\xa5", 8);
  }
  free(copy);
  vt_free(b.context, packed);
  close_bench(&b);
}
#else
static void packing_without_zstd_is_refused(void **state) {
  (void)state;
  bench b;
  uint8_t *packed, out[1];
  size_t size;
  open_bench(&b);
  assert_false(vt_can_pack_bytes());
  assert_int_equal(vt_pack_bytes(b.context, "x", 1, 3, &packed, &size), VT_MISSING_PROGRAM);
  vt_clear_error(b.context);
  assert_int_equal(vt_unpack_bytes(b.context, "x", 1, out, 1, "tree.vtree"), VT_MISSING_PROGRAM);
  assert_non_null(strstr(vt_last_error(b.context), "tree.vtree"));
  close_bench(&b);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_written_file_reads_back),
      cmocka_unit_test(a_failed_write_leaves_the_old_file_and_says_why),
      cmocka_unit_test(a_full_disk_is_named_as_such),
      cmocka_unit_test(devices_and_links_are_written_through),
      cmocka_unit_test(reading_what_is_no_file_says_why),
      cmocka_unit_test(a_file_over_the_memory_bound_is_refused),
      cmocka_unit_test(folders_are_made_with_their_parents),
      cmocka_unit_test(listings_are_sorted_and_survive_loops_of_links),
      cmocka_unit_test(paths_are_joined_and_cut),
      cmocka_unit_test(checksums_are_those_of_the_published_vectors),
#ifdef VT_WITH_ZSTD
      cmocka_unit_test(packed_bytes_unpack_to_the_same),
      cmocka_unit_test(damaged_packed_bytes_are_refused_and_write_nothing_outside),
#else
      cmocka_unit_test(packing_without_zstd_is_refused),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
