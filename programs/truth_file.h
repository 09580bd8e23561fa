// truth_file.h - truth.json: what a synthetic capture shows, and how it was damaged
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_TRUTH_FILE_H
#define VT_PROGRAMS_TRUTH_FILE_H

#include "datasets-synthetic/synthetic.h"

// Writes folder/truth.json with all fields of both descs. VT_FAILED naming the file.
vt_status vt_write_truth_file(vt_context *, const vt_synthetic_desc *, const vt_damage_desc *, const char *folder);
// Reads the one that lies in the capture `source` (a folder, or a file in one). mesh_text: owns desc.mesh_path, vt_free it.
// VT_BAD_INPUT where there is none, where it is damaged, or out of range.
vt_status vt_read_truth_file(vt_context *, const char *source, vt_synthetic_desc *out, char **mesh_text);

#endif
