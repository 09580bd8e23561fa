// tree_file_bytes.h - what the tests of the .vtree file share: a context, and the bytes that the writer makes
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_TREE_FILE_BYTES_H
#define VT_TESTS_TREE_FILE_BYTES_H

#include "tests/unit.h"
#include "tests/tree_cases.h"
#include "base/file.h"
#include <unistd.h>

static inline vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

// A file of this process; removed by the caller.
static inline const char *scratch_path(void) {
  static char path[64];
  snprintf(path, sizeof path, "/tmp/voltree_test_tree_file_%ld.vtree", (long)getpid());
  return path;
}

// The bytes that the writer makes of a tree.
static inline uint8_t *bytes_of(vt_context *context, const vt_tree *tree, size_t *size) {
  uint8_t *bytes = NULL;
  assert_int_equal(vt_write_tree(context, tree, scratch_path(), NULL), VT_OK);
  assert_int_equal(vt_read_file(context, scratch_path(), &bytes, size), VT_OK);
  remove(scratch_path());
  return bytes;
}

static inline uint8_t *bytes_of_case(vt_context *context, const tree_case *c, size_t *size) {
  vt_tree tree;
  make_tree(context, c, &tree);
  uint8_t *bytes = bytes_of(context, &tree, size);
  vt_free_tree(context, &tree);
  return bytes;
}

#endif
