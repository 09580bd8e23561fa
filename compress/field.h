// field.h - packing of corners' values and view textures
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_COMPRESS_FIELD_H
#define VT_COMPRESS_FIELD_H

#include "compress/compress.h"

// Whether any level has corners or view textures.
bool vt_has_field(const vt_tree *);
// Rounds depths, colours and view textures of `out`, a copy of `raw`, and gives it its field codebook.
vt_status vt_compress_field(vt_context *, const vt_compress_desc *, const vt_tree *raw, vt_tree *out, vt_compress_report *);

#endif
