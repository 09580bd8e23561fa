// tree_file_write.h - what the parts of the writer of .vtree files hand each other
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_TREE_FILE_WRITE_H
#define VT_OCTREE_TREE_FILE_WRITE_H

#include "octree/tree_file.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_chunk_out {
  vt_chunk_kind kind;
  int level;
  vt_chunk_coding coding;
  uint64_t raw_size, stored_size;
  uint8_t *stored; // owned
} vt_chunk_out;

typedef struct vt_tree_writer {
  vt_context *context;
  const vt_tree *tree;
  vt_tree_head head;
  bool may_pack;
  int count;
  vt_chunk_out chunks[VT_MAX_CHUNKS];
} vt_tree_writer;

// Takes a copy of the bytes, packed if that is smaller.
vt_status vt_add_chunk(vt_tree_writer *, vt_chunk_kind, int level, const void *raw, size_t size);
// The same, and frees `raw`, which the caller got from vt_alloc (NULL: it could not).
vt_status vt_add_owned_chunk(vt_tree_writer *, vt_chunk_kind, int level, uint8_t *raw, size_t size);

#ifdef __cplusplus
}
#endif
#endif
