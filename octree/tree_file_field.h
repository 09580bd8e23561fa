// tree_file_field.h - corners and view textures in .vtree files, written and read
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_OCTREE_TREE_FILE_FIELD_H
#define VT_OCTREE_TREE_FILE_FIELD_H

#include "octree/tree_file_read.h"
#include "octree/tree_file_write.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- writing
void vt_describe_field(vt_tree_writer *, int level);             // asserts what octree.h promises, fills the head
vt_status vt_add_field_codebook(vt_tree_writer *);               // CBKF
vt_status vt_add_coded_colours(vt_tree_writer *, int level);     // COLR by the field codebook
vt_status vt_add_corners(vt_tree_writer *, int level);           // COPA, CCOL
vt_status vt_add_view_textures(vt_tree_writer *, int level);     // VIDX, VCOD

// ---- reading
// What the chunk table says about corners, view textures and the field codebook goes into the head. Before sizes are checked.
vt_status vt_describe_field_chunks(vt_tree_reader *);
vt_status vt_read_field_codebook(const vt_tree_reader *);
vt_status vt_read_coded_colours(const vt_tree_reader *, int level);
vt_status vt_read_corners(const vt_tree_reader *, int level);    // and the cells' means that follow from them
vt_status vt_read_view_textures(const vt_tree_reader *, int level);

#ifdef __cplusplus
}
#endif
#endif
