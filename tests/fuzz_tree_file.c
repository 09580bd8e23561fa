// fuzz_tree_file.c - libFuzzer's entrance to the reader of .vtree files (clang, -DVT_FUZZ=ON)
// SPDX-License-Identifier: BSD-3-Clause
//
// The first byte says whether checksums are mended before reading; without that hardly any change would get past them.
// Start it on the files of tests/golden, each with one byte put in front. test_tree_file.c runs the same check on
// seeded damage, so that it is done where there is no libFuzzer.
#include "tests/tree_cases.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size < 1) return 0;
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.log_level = VT_LOG_QUIET;
  desc.max_memory = 1ull << 30;
  vt_context *context = vt_create_context(&desc);
  uint8_t *file = VT_NEW(context, uint8_t, size);
  memcpy(file, data + 1, size - 1);
  if (data[0] & 1) mend_checksums(file, size - 1);
  vt_tree tree;
  vt_status status = vt_parse_tree(context, file, size - 1, "fuzz", &tree, NULL);
  VT_ASSERT(status == VT_OK || status == VT_BAD_INPUT || status == VT_OUT_OF_MEMORY || status == VT_MISSING_PROGRAM);
  VT_ASSERT(status == VT_OK || vt_last_error(context)[0]);
  vt_free_tree(context, &tree);
  vt_free(context, file);
  vt_destroy_context(context); // asserts that nothing is left
  return 0;
}
