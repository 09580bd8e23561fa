// tree_file_read.h - what the parts of the reader of .vtree files hand each other
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_TREE_FILE_READ_H
#define VT_OCTREE_TREE_FILE_READ_H

#include "octree/tree_file.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_chunk_in {
  bool present;
  vt_chunk_coding coding;
  uint64_t raw_size, stored_size;
  const uint8_t *bytes; // as stored; borrowed from the file
} vt_chunk_in;

typedef struct vt_tree_reader {
  vt_context *context;
  const char *name; // of the file, for the sentence
  const uint8_t *bytes;
  size_t size;
  bool is_newer; // of a greater minor version than this reader
  vt_tree_head head;
  vt_chunk_in chunks[VT_CHUNK_KINDS][VT_MAX_LEVEL + 1];
  vt_tree *tree;
} vt_tree_reader;

// The unpacked bytes of a chunk; *owned is what the caller has to free afterwards.
vt_status vt_open_chunk(const vt_tree_reader *, vt_chunk_kind, int level, const uint8_t **raw, uint8_t **owned);
// VT_BAD_INPUT with a sentence that names file and chunk; `why` goes on from there.
vt_status vt_refuse_chunk(const vt_tree_reader *, vt_chunk_kind, int level, const char *why);

#ifdef __cplusplus
}
#endif
#endif
