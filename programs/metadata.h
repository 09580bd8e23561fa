// metadata.h - the JSON inside a .vtree: written once by reconstruct, read by those who judge
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_METADATA_H
#define VT_PROGRAMS_METADATA_H

#include "base/file.h"
#include "base/json.h"
#include "base/views.h"
#include "octree/octree.h"

// The names in the array `key` of the tree's metadata, in their order. No names if there is no such array. VT_BAD_INPUT
// with `file` in the sentence if the metadata is no JSON. The caller frees `out` with vt_free_names.
vt_status vt_metadata_names(vt_context *, const vt_tree *, const char *file, const char *key, vt_names *out);
bool vt_has_name(const vt_names *, const char *name);
// Puts `"key": json` behind the members that are there.
vt_status vt_add_metadata(vt_context *, vt_tree *, const char *key, const char *json);
// VT_BAD_INPUT if a photograph that made the tree has another camera among `views`: then they were calibrated apart and
// nothing could be compared.
vt_status vt_check_same_cameras(vt_context *, const vt_tree *, const char *file, const vt_views *, const char *source);

#endif
