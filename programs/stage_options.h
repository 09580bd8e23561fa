// stage_options.h - the options that several verbs hand to one stage, and the stage called with them
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_STAGE_OPTIONS_H
#define VT_PROGRAMS_STAGE_OPTIONS_H

#include "base/json.h"
#include "capture/capture.h"
#include "compress/compress.h"
#include "programs/session.h"
#include "render/render.h"

extern const vt_option vt_common_options[];   // of every verb
extern const vt_option vt_source_options[];   // how photographs are read
extern const vt_option vt_codebook_options[]; // how textures are packed
extern const vt_option vt_picture_options[];  // how pictures are drawn

vt_capture_desc vt_capture_desc_of(const vt_session *, const char *source);
// Keeps the cache within --cache-size.
void vt_trim_kept(vt_session *);
// Stage "load": views from a folder, with the flags of vt_source_options.
vt_status vt_load_source(vt_session *, const char *source, vt_views *out, vt_capture_report *report);
// Members of the object that is open: source, matte, photographs, left_out, ...
void vt_report_source(vt_json_writer *, const char *source, const vt_views *, const vt_capture_report *);
void vt_put_sentences(vt_json_writer *, const char *key, int count, char *const *sentences);
void vt_put_coverage(vt_json_writer *, const vt_coverage *); // nothing where it is not known
void vt_say_coverage(vt_session *, const vt_coverage *);
void vt_say_source(vt_session *, const char *source, const vt_views *, const vt_capture_report *);

vt_compress_desc vt_compress_desc_of(const vt_arguments *);
const char *vt_quantiser_name(vt_quantiser);
void vt_report_compression(vt_json_writer *, const char *key_or_null, const vt_compress_desc *,
                           const vt_compress_report *);
void vt_say_compression(vt_session *, const vt_compress_report *); // what was lost

vt_render_desc vt_render_desc_of(const vt_arguments *); // level -1 where it was not given
vt_backend vt_backend_of(const vt_arguments *);
// The finest level that has textures; -1 if there is none.
int vt_finest_level(const vt_tree *);
// VT_BAD_USAGE if --level asks for one that the tree does not have textures of.
vt_status vt_check_level(vt_session *, const vt_tree *, const char *name, int level);

#endif
