// mesh_mtl.h - material libraries of OBJ files
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_MESH_MTL_H
#define VT_DATASETS_SYNTHETIC_MESH_MTL_H

#include "datasets-synthetic/mesh_file.h"

typedef struct vt_mtl_entry {
  vt_material material; // without its texture
  vt_sides sides;
  char *colour_map, *alpha_map; // paths of files that are there, or NULL; owned
  bool luma;                    // the alpha map says to take its brightness, not its alpha
} vt_mtl_entry;

typedef struct vt_mtl_library {
  size_t count, capacity;
  vt_mtl_entry *entries; // owned
  vt_key_table names;    // to the index of the entry
} vt_mtl_library;

// Adds the materials of a file; a name that is there already keeps its first meaning. VT_BAD_INPUT naming file and
// line.
vt_status vt_read_mtl(vt_context *, const char *path, vt_mtl_library *);
void vt_free_mtl(vt_context *, vt_mtl_library *);
// The entry's material with its texture and cutoff. The caller frees out->texture.
vt_status vt_load_mtl_entry(vt_context *, const vt_mtl_entry *, vt_material *out);
// The path of a file that another names: beside it, or below; '\' is read as '/', of a path from the root the last
// part. *out is NULL if there is no such file. Free it with vt_free.
vt_status vt_find_beside(vt_context *, const char *path, const char *name, size_t length, char **out);

#endif
