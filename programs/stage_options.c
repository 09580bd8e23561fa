// stage_options.c - the options that several verbs share, kept in one table each so that they mean the same everywhere
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/stage_options.h"

#include "base/cache.h"

#include <math.h>
#include <string.h>

const vt_option vt_common_options[] = {
    {"help", 'h', VT_OPTION_FLAG, "", 0, 0, false, "show this help and stop"},
    {"version", 0, VT_OPTION_FLAG, "", 0, 0, false, "show the version and stop"},
    {"quiet", 'q', VT_OPTION_FLAG, "", 0, 0, false, "say nothing but errors"},
    {"verbose", 'v', VT_OPTION_FLAG, "", 0, 0, false, "say more on stderr"},
    {"threads", 0, VT_OPTION_INTEGER, "N", 1, 64, false,
     "workers; default: as many as the machine has. Results do not depend on it"},
    {"max-memory", 0, VT_OPTION_BYTES, "SIZE", 0, 0, false,
     "most memory for the data of the run, like 4G; beyond it exit 6"},
    {"json", 0, VT_OPTION_TEXT, "FILE|-", 0, 0, false,
     "write the figures as one JSON document; - is stdout, which then holds nothing else"},
    {"report", 0, VT_OPTION_TEXT, "DIR", 0, 0, false, "write a folder with report.json, index.html and pictures"},
    {"probe", 0, VT_OPTION_TEXT, "DIR", 0, 0, false,
     "write pictures of inner states (trimaps, hulls, residuals) into this folder"},
    {"cache", 0, VT_OPTION_TEXT, "DIR", 0, 0, false,
     "where cameras, mattes and raw trees are kept for the next run; default: $XDG_CACHE_HOME/voltree or ~/.cache/voltree"},
    {"cache-size", 0, VT_OPTION_BYTES, "SIZE", 0, 0, false,
     "most bytes kept there, like 20G; what was used longest ago goes first; default: 10G"},
    {"no-cache", 0, VT_OPTION_FLAG, "", 0, 0, false, "keep nothing and use nothing that was kept"},
    {0}};

// The words stand in the order of vt_matte_mode.
#define MATTE_WORDS "auto|alpha|masks|backdrop|sky|clutter|none"
const vt_option vt_source_options[] = {
    {"matte", 0, VT_OPTION_CHOICE, MATTE_WORDS, 0, 0, false,
     "where the tree's opacity in the photographs comes from; auto: alpha if the pictures have it, else masks if there "
     "are any, else what most photographs show"},
    {"masks", 0, VT_OPTION_TEXT, "DIR", 0, 0, false,
     "folder of masks (or one for all), white is tree; default: the usual places beside the photographs"},
    {"invert-masks", 0, VT_OPTION_FLAG, "", 0, 0, false, "black is tree"},
    {"scribble", 0, VT_OPTION_TEXT, "DIR", 0, 0, false,
     "folder of strokes on some of the photographs, named as they are: green or white is tree, red or black is not"},
    {"keep-strays", 0, VT_OPTION_FLAG, "", 0, 0, false,
     "leave in mattes before a backdrop or the sky what the other photographs do not show"},
    {"ignore", 0, VT_OPTION_TEXT, "DIR", 0, 0, false,
     "folder of masks (or one for all), white where nothing is to be looked at, like a post before the tree"},
    {"lens", 0, VT_OPTION_CHOICE, "auto|keep", 0, 0, false,
     "adjust focal length and distortion of the photographs' lenses to the points that the calibration found; auto: kept only "
     "where points that were held back are seen more nearly where they are"},
    {"max-image-size", 0, VT_OPTION_INTEGER, "N", 16, 65535, false,
     "reduce photographs to at most N pixels on the longer side"},
    {"height", 0, VT_OPTION_NUMBER, "METRES", 1e-6, 1e6, false, "the scale of the world: how high the tree is"},
    {"marks", 0, VT_OPTION_TEXT, "FILE", 0, 0, false,
     "the scale of the world: a text file of points marked in photographs (PHOTOGRAPH X Y NAME) and distances between them "
     "(distance NAME NAME METRES)"},
    {"marker-size", 0, VT_OPTION_NUMBER, "METRES", 1e-6, 1e6, false,
     "the scale of the world: the side of the ArUco markers in the photographs"},
    {"marker-cells", 0, VT_OPTION_INTEGER, "N", 4, 7, false, "cells along a side of these markers; default: 4"},
    {"colmap", 0, VT_OPTION_TEXT, "PROGRAM", 0, 0, false, "the COLMAP program that finds cameras; default: colmap"},
    {0}};

#define DEPTH_STEPS "1|2|3|6|9|18"
static const int depth_steps[] = {1, 2, 3, 6, 9, 18};

// The words stand in the order of vt_quantiser.
#define QUANTISER_WORDS "rgb-gla|lab-gla|lab-modified-gla"
const vt_option vt_codebook_options[] = {
    {"alpha-codewords", 0, VT_OPTION_INTEGER, "N", 1, 65536, false, "size of the codebook of opacities"},
    {"colour-codewords", 0, VT_OPTION_INTEGER, "N", 1, 65536, false, "size of the codebook of colours"},
    {"quantiser", 0, VT_OPTION_CHOICE, QUANTISER_WORDS, 0, 0, false, "how codebooks are trained"},
    {"field-colours", 0, VT_OPTION_INTEGER, "N", 1, 65536, false,
     "size of the codebook of the cells' and their corners' own colours"},
    {"depth-steps", 0, VT_OPTION_CHOICE, DEPTH_STEPS, 0, 0, false,
     "to how many steps each doubling of the cells' and their corners' opacity is rounded"},
    {"ratio-levels", 0, VT_OPTION_INTEGER, "N", 2, 256, false,
     "to how many values the textures of views are rounded; 256: they are kept as they are"},
    {0}};

const vt_option vt_picture_options[] = {
    {"level", 0, VT_OPTION_INTEGER, "L", 0, VT_MAX_LEVEL, false, "draw this level of the tree"},
    {"views", 0, VT_OPTION_INTEGER, "K", 1, VT_MAX_BLEND_VIEWS, false,
     "blend the textures of the K closest photographs"},
    {"blend", 0, VT_OPTION_CHOICE, "sum|geometric", 0, 0, false,
     "how they become one: premultiplied sum, or geometric mean of the transmittances"},
    {"backend", 0, VT_OPTION_CHOICE, "auto|gl|cpu", 0, 0, false,
     "who draws; auto: OpenGL on a graphics card, else the CPU"},
    {0}};

// ---- photographs

vt_capture_desc vt_capture_desc_of(const vt_session *session, const char *source) {
  const vt_arguments *arguments = &session->arguments;
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = source;
  desc.matte = (vt_matte_mode)vt_choice_of(arguments, "matte", (int)desc.matte);
  desc.masks = vt_text_of(arguments, "masks", desc.masks);
  desc.invert_masks = vt_given(arguments, "invert-masks");
  desc.scribbles = vt_text_of(arguments, "scribble", desc.scribbles);
  desc.tree_height = vt_number_of(arguments, "height", desc.tree_height);
  desc.marks = vt_text_of(arguments, "marks", desc.marks);
  desc.marker_size = vt_number_of(arguments, "marker-size", desc.marker_size);
  desc.marker_cells = vt_integer_of(arguments, "marker-cells", desc.marker_cells);
  desc.keep_strays = vt_given(arguments, "keep-strays");
  desc.ignore = vt_text_of(arguments, "ignore", desc.ignore);
  desc.keep_lens = vt_choice_of(arguments, "lens", 0) == 1;
  desc.max_image_size = vt_integer_of(arguments, "max-image-size", desc.max_image_size);
  desc.colmap = vt_text_of(arguments, "colmap", desc.colmap);
  desc.cache = session->cache;
  return desc;
}

void vt_trim_kept(vt_session *session) {
  uint64_t most = vt_bytes_of(&session->arguments, "cache-size", VT_CACHE_BYTES);
  if (session->cache) vt_trim_cache(session->context, session->cache, most, NULL);
}

vt_status vt_load_source(vt_session *session, const char *source, vt_views *out, vt_capture_report *report) {
  vt_capture_desc desc = vt_capture_desc_of(session, source);
  vt_begin_stage(session);
  vt_status status = vt_load_views(session->context, &desc, out, report);
  vt_end_stage(session, "load");
  if (status) return status;
  vt_trim_kept(session);
  if (report->seconds_calibration > 0) vt_note_stage(session, "calibration", report->seconds_calibration, 0);
  double reading = report->seconds_developing - report->seconds_mattes;
  vt_note_stage(session, "reading", reading > 0 ? reading : 0, 0); // with undistortion
  if (report->seconds_mattes > 0) vt_note_stage(session, "mattes", report->seconds_mattes, 0);
  return VT_OK;
}

static const char *matte_name(vt_matte_mode mode) {
  static const char *const names[] = {"auto", "alpha", "masks", "backdrop", "sky", "clutter", "none"};
  return names[mode];
}

static const char *kind_name(vt_source_kind kind) {
  static const char *const names[] = {"transforms", "colmap", "photographs", "bundler", "projections"};
  return names[kind];
}

void vt_put_sentences(vt_json_writer *json, const char *key, int count, char *const *sentences) {
  vt_json_open_array(json, key);
  for (int i = 0; i < count; i++) vt_json_put_string(json, NULL, sentences[i]);
  vt_json_close_array(json);
}

void vt_put_coverage(vt_json_writer *json, const vt_coverage *coverage) {
  if (!coverage->count) return;
  vt_json_open_object(json, "coverage");
  vt_json_put_number(json, "degrees_around", coverage->around);
  vt_json_put_number(json, "largest_gap_degrees", coverage->largest_gap);
  vt_json_put_number(json, "lowest_elevation_degrees", coverage->lowest);
  vt_json_put_number(json, "highest_elevation_degrees", coverage->highest);
  vt_json_close_object(json);
}

void vt_say_coverage(vt_session *session, const vt_coverage *c) {
  if (!c->count) return;
  if (c->largest_gap < 60)
    vt_say(session, "  coverage: all around the tree, the largest gap %.0f degrees", c->largest_gap);
  else
    vt_say(session, "  coverage: %.0f degrees around the tree", c->around);
  vt_say(session, "; %.0f to %.0f degrees above its middle\n", c->lowest, c->highest);
}

void vt_report_source(vt_json_writer *json, const char *source, const vt_views *views,
                      const vt_capture_report *report) {
  vt_json_put_string(json, "source", source);
  vt_json_put_string(json, "source_kind", kind_name(report->kind));
  vt_json_put_string(json, "matte", matte_name(report->matte));
  vt_json_put_string(json, "matte_evidence", report->matte_evidence);
  vt_json_put_integer(json, "photographs_found", report->photograph_count);
  vt_json_put_integer(json, "photographs_used", vt_count_views(views, VT_TRAIN));
  vt_json_put_integer(json, "photographs_test", vt_count_views(views, VT_TEST));
  vt_put_sentences(json, "photographs_left_out", report->left_out_count, report->left_out);
  vt_json_put_number(json, "reprojection_error", report->reprojection_error);
  vt_json_put_bool(json, "lens_adjusted", report->lens_adjusted);
  if (report->lens_before > 0) {
    vt_json_put_number(json, "lens_held_out_before", report->lens_before);
    vt_json_put_number(json, "lens_held_out_after", report->lens_after);
  }
  if (report->lens_adjusted) {
    vt_json_put_number(json, "lens_corner_pixels", report->lens_corner);
    vt_json_put_number(json, "lens_focal_share", report->lens_focal);
  }
  vt_json_put_bool(json, "calibration_from_cache", report->calibration_from_cache);
  vt_json_put_bool(json, "views_from_cache", report->views_from_cache);
  vt_put_sentences(json, "calibration_attempts", report->attempt_count, report->attempts);
  vt_put_sentences(json, "warnings", report->warning_count, report->warnings);
  vt_put_coverage(json, &report->coverage);
}

void vt_say_source(vt_session *session, const char *source, const vt_views *views, const vt_capture_report *report) {
  int test = vt_count_views(views, VT_TEST);
  vt_say(session, "%s: %d of %d photographs with cameras (%s%s), mattes from %s", source, views->count,
         report->photograph_count, kind_name(report->kind), report->calibration_from_cache ? ", from the cache" : "",
         matte_name(report->matte));
  if (test) vt_say(session, ", %d kept for judging", test);
  vt_say(session, "\n");
  vt_say_coverage(session, &report->coverage);
  if (report->attempt_count > 1)
    for (int i = 0; i < report->attempt_count; i++) vt_say(session, "  attempt: %s\n", report->attempts[i]);
  for (int i = 0; i < report->left_out_count; i++) vt_say(session, "  left out: %s\n", report->left_out[i]);
  for (int i = 0; i < report->warning_count; i++) vt_say(session, "  warning: %s\n", report->warnings[i]);
}

// ---- packing

vt_compress_desc vt_compress_desc_of(const vt_arguments *arguments) {
  vt_compress_desc desc = vt_default_compress_desc();
  desc.alpha_codewords = vt_integer_of(arguments, "alpha-codewords", desc.alpha_codewords);
  desc.colour_codewords = vt_integer_of(arguments, "colour-codewords", desc.colour_codewords);
  desc.quantiser = (vt_quantiser)vt_choice_of(arguments, "quantiser", (int)desc.quantiser);
  desc.field_colours = vt_integer_of(arguments, "field-colours", desc.field_colours);
  if (vt_given(arguments, "depth-steps")) desc.depth_steps = depth_steps[vt_choice_of(arguments, "depth-steps", 0)];
  desc.ratio_levels = vt_integer_of(arguments, "ratio-levels", desc.ratio_levels);
  return desc;
}

const char *vt_quantiser_name(vt_quantiser quantiser) {
  return quantiser == VT_RGB_GLA ? "rgb-gla" : quantiser == VT_LAB_GLA ? "lab-gla" : "lab-modified-gla";
}

void vt_report_compression(vt_json_writer *json, const char *key, const vt_compress_desc *desc,
                           const vt_compress_report *report) {
  vt_json_open_object(json, key);
  vt_json_put_string(json, "quantiser", vt_quantiser_name(desc->quantiser));
  vt_json_put_integer(json, "tiles", (long long)report->tile_count);
  vt_json_put_integer(json, "alpha_codewords", report->alpha_codewords);
  vt_json_put_integer(json, "colour_codewords", report->colour_codewords);
  vt_json_put_integer(json, "alpha_iterations", report->alpha_iterations);
  vt_json_put_integer(json, "colour_iterations", report->colour_iterations);
  vt_json_put_number(json, "texel_alpha_rmse", report->alpha_rmse);
  vt_json_put_number(json, "texel_colour_psnr", report->colour_psnr);
  vt_json_put_number(json, "texel_colour_delta_e", report->colour_delta_e);
  if (report->field_codewords) {
    vt_json_put_integer(json, "corners", (long long)report->corner_count);
    vt_json_put_integer(json, "view_pixels", (long long)report->view_pixels);
    vt_json_put_integer(json, "field_colours", report->field_codewords);
    vt_json_put_integer(json, "depth_steps", desc->depth_steps);
    vt_json_put_integer(json, "ratio_levels", report->ratio_levels);
    vt_json_put_number(json, "field_alpha_rmse", report->field_alpha_rmse);
    vt_json_put_number(json, "field_colour_delta_e", report->field_delta_e);
    vt_json_put_number(json, "log_ratio_rmse", report->log_ratio_rmse);
  }
  vt_json_put_integer(json, "raw_bytes", (long long)report->raw_bytes);
  vt_json_put_integer(json, "packed_bytes", (long long)report->packed_bytes);
  vt_json_close_object(json);
}

void vt_say_compression(vt_session *session, const vt_compress_report *report) {
  if (report->tile_count)
    vt_say(session, "  tiles: %d codewords of opacity, %d of colour; texel alpha RMSE %.4f, colour %.1f dB\n",
           report->alpha_codewords, report->colour_codewords, report->alpha_rmse, report->colour_psnr);
  if (report->field_codewords)
    vt_say(session, "  field: %d colours, CIE76 %.2f; alpha RMSE %.4f; %d levels of opacity ratios, RMSE %.3f\n",
           report->field_codewords, report->field_delta_e, report->field_alpha_rmse, report->ratio_levels,
           report->log_ratio_rmse);
}

// ---- drawing

vt_render_desc vt_render_desc_of(const vt_arguments *arguments) {
  vt_render_desc desc = vt_default_render_desc();
  desc.level = vt_integer_of(arguments, "level", -1);
  desc.blend_views = vt_integer_of(arguments, "views", desc.blend_views);
  desc.blend = (vt_blend)vt_choice_of(arguments, "blend", (int)desc.blend);
  return desc;
}

vt_backend vt_backend_of(const vt_arguments *arguments) {
  return (vt_backend)vt_choice_of(arguments, "backend", VT_BACKEND_AUTO);
}

int vt_finest_level(const vt_tree *tree) {
  for (int level = tree->octree.level_count - 1; level >= 0; level--)
    if (vt_has_textures(tree, level)) return level;
  return -1;
}

vt_status vt_check_level(vt_session *session, const vt_tree *tree, const char *name, int level) {
  int finest = vt_finest_level(tree);
  if (finest < 0)
    return vt_fail(session->context, VT_BAD_INPUT,
                   "%s: has no textures to draw; make the tree again with voltree "
                   "reconstruct",
                   name);
  if (level < 0 || (level <= finest && vt_has_textures(tree, level))) return VT_OK;
  int coarsest = 0;
  while (!vt_has_textures(tree, coarsest)) coarsest++;
  return vt_fail(session->context, VT_BAD_USAGE,
                 "--level %d: %s has textures on the levels %d to %d; give one of these", level, name, coarsest,
                 finest);
}
