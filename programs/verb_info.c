// verb_info.c - voltree info: what is in a .vtree
// SPDX-License-Identifier: BSD-3-Clause
#include "octree/octree.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"
#include "programs/world.h"

#include <string.h>

// What the levels of a tree are made of, and so what is worth saying.
typedef struct contents { bool tiles, corners, views; } contents;
static contents contents_of(const vt_tree *tree) {
  contents c = {0};
  for (int l = 0; l < tree->octree.level_count; l++) {
    c.tiles = c.tiles || tree->tiles[l].view_count;
    c.corners = c.corners || tree->octree.levels[l].corner_count;
    c.views = c.views || tree->view_textures[l].view_count;
  }
  return c;
}

static void say_file(vt_session *session, const contents *has, const vt_file_report *file) {
  char a[32], b[32], c[32], d[32];
  vt_say(session, "  in the file: cells %s, codebooks %s", vt_show_bytes(file->cell_bytes, a),
         vt_show_bytes(file->codebook_bytes, b));
  if (has->corners) vt_say(session, ", corners %s", vt_show_bytes(file->field_bytes, a));
  if (has->views) vt_say(session, ", view textures %s", vt_show_bytes(file->view_bytes, b));
  if (has->tiles)
    vt_say(session, ", indices %s, codes %s, texels %s", vt_show_bytes(file->index_bytes, a),
           vt_show_bytes(file->code_bytes, c), vt_show_bytes(file->texel_bytes, d));
  vt_say(session, "\n");
}

static void say_levels(vt_session *session, const contents *has, const vt_tree *tree, const vt_file_report *file) {
  char a[32];
  vt_say(session, "  level      cells%s%s%s  edge\n", has->tiles ? "  billboards" : "",
         has->corners ? "    corners   in file" : "", has->views ? "  view pixels  factor   in file" : "");
  for (int l = 0; l < tree->octree.level_count; l++) {
    const vt_level *level = &tree->octree.levels[l];
    const vt_view_textures *textures = &tree->view_textures[l];
    vt_say(session, "  %5d %10u", l, (unsigned)level->cell_count);
    if (has->tiles) vt_say(session, " %11u", (unsigned)tree->tiles[l].tile_count);
    if (has->corners)
      vt_say(session, " %10u %9s", (unsigned)level->corner_count, vt_show_bytes(file->level_field_bytes[l], a));
    if (has->views)
      vt_say(session, " %12llu %7d %9s", (unsigned long long)vt_count_view_pixels(textures), textures->factor,
             vt_show_bytes(file->level_view_bytes[l], a));
    vt_say(session, "  %g\n", vt_cell_edge(&tree->octree, l));
  }
}

static void say_tree(vt_session *session, const char *name, const vt_tree *tree, const vt_file_report *file) {
  const vt_octree *octree = &tree->octree;
  contents has = contents_of(tree);
  char a[32];
  vt_say(session, "%s: %s tree, %s\n", name, vt_is_packed(tree) ? "packed" : "raw", vt_show_bytes(file->file_bytes, a));
  say_file(session, &has, file);
  vt_say(session, "  textures in memory: %s\n", vt_show_bytes(vt_texture_bytes(tree), a));
  vt_say(session, "  root cube: edge %g, corner (%g, %g, %g), branching %d; %d photographs\n", octree->edge,
         octree->origin.x, octree->origin.y, octree->origin.z, octree->branching, tree->view_count);
  if (has.tiles)
    vt_say(session, "  billboards: %d x %d texels, side %g cells\n", tree->texel_edge, tree->texel_edge,
           (double)tree->tile_side);
  if (tree->alpha_codebook.codeword_count)
    vt_say(session, "  codewords: %d of opacity, %d of colour\n", tree->alpha_codebook.codeword_count,
           tree->colour_codebook.codeword_count);
  if (tree->field_codebook.codeword_count)
    vt_say(session, "  colours of cells and corners: %d\n", tree->field_codebook.codeword_count);
  say_levels(session, &has, tree, file);
  vt_say_world(session, tree);
  vt_say(session, "  metadata: ");
  bool blank = true;
  for (const char *at = tree->metadata; *at; at++) { // no control sequences from a file to a terminal, no runs of blanks
    bool space = (unsigned char)*at <= ' ' || *at == 127;
    if (!space || !blank) vt_say(session, "%c", space ? ' ' : *at);
    blank = space;
  }
  vt_say(session, "\n");
}

static void report_levels(vt_json_writer *json, const vt_tree *tree, const vt_file_report *file) {
  vt_json_open_array(json, "levels");
  for (int l = 0; l < tree->octree.level_count; l++) {
    vt_json_open_object(json, NULL);
    vt_json_put_integer(json, "level", l);
    vt_json_put_integer(json, "cells", tree->octree.levels[l].cell_count);
    vt_json_put_integer(json, "billboards", tree->tiles[l].tile_count);
    vt_json_put_integer(json, "corners", tree->octree.levels[l].corner_count);
    vt_json_put_integer(json, "view_pixels", (long long)vt_count_view_pixels(&tree->view_textures[l]));
    vt_json_put_integer(json, "view_factor", tree->view_textures[l].factor);
    vt_json_put_integer(json, "field_bytes", (long long)file->level_field_bytes[l]);
    vt_json_put_integer(json, "view_bytes", (long long)file->level_view_bytes[l]);
    vt_json_put_number(json, "cell_edge", vt_cell_edge(&tree->octree, l));
    vt_json_close_object(json);
  }
  vt_json_close_array(json);
}

static vt_status report_tree(vt_session *session, const char *name, const vt_tree *tree, const vt_file_report *file) {
  const vt_octree *octree = &tree->octree;
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_string(&json, "input", name);
  vt_json_put_bool(&json, "packed", vt_is_packed(tree));
  vt_json_open_object(&json, "file");
  vt_json_put_integer(&json, "bytes", (long long)file->file_bytes);
  vt_json_put_integer(&json, "cell_bytes", (long long)file->cell_bytes);
  vt_json_put_integer(&json, "index_bytes", (long long)file->index_bytes);
  vt_json_put_integer(&json, "code_bytes", (long long)file->code_bytes);
  vt_json_put_integer(&json, "codebook_bytes", (long long)file->codebook_bytes);
  vt_json_put_integer(&json, "texel_bytes", (long long)file->texel_bytes);
  vt_json_put_integer(&json, "field_bytes", (long long)file->field_bytes);
  vt_json_put_integer(&json, "view_bytes", (long long)file->view_bytes);
  vt_json_close_object(&json);
  vt_json_put_integer(&json, "texture_bytes", (long long)vt_texture_bytes(tree));
  vt_json_open_array(&json, "origin");
  vt_json_put_number(&json, NULL, octree->origin.x);
  vt_json_put_number(&json, NULL, octree->origin.y);
  vt_json_put_number(&json, NULL, octree->origin.z);
  vt_json_close_array(&json);
  vt_json_put_number(&json, "edge", octree->edge);
  vt_json_put_integer(&json, "branching", octree->branching);
  vt_json_put_integer(&json, "texel_edge", tree->texel_edge);
  vt_json_put_number(&json, "tile_side", (double)tree->tile_side);
  vt_json_put_integer(&json, "views", tree->view_count);
  vt_json_put_integer(&json, "alpha_codewords", tree->alpha_codebook.codeword_count);
  vt_json_put_integer(&json, "colour_codewords", tree->colour_codebook.codeword_count);
  vt_json_put_integer(&json, "field_codewords", tree->field_codebook.codeword_count);
  report_levels(&json, tree, file);
  vt_json *metadata = NULL; // raw only if it is JSON: the file may come from anywhere
  if (!vt_parse_json(session->context, tree->metadata, strlen(tree->metadata), name, &metadata)) {
    vt_json_put_raw(&json, "metadata", tree->metadata);
  } else {
    vt_clear_error(session->context);
    vt_json_put_string(&json, "metadata", tree->metadata);
  }
  vt_free_json(session->context, metadata);
  return vt_end_report(session, &json);
}

static vt_status run(vt_session *session) {
  const char *input = session->arguments.operands[0];
  vt_tree tree = {0};
  vt_file_report file;
  vt_status status = vt_read_tree(session->context, input, &tree, &file);
  if (!status) {
    say_tree(session, input, &tree, &file);
    status = report_tree(session, input, &tree, &file);
  }
  vt_free_tree(session->context, &tree);
  return status;
}

const vt_verb vt_verb_info = {.name = "info",
                              .operands = "TREE",
                              .summary = "tell what is in a .vtree",
                              .notes = "",
                              .example = "voltree info tree.vtree --json -",
                              .operand_count = 1,
                              .tables = {vt_common_options},
                              .run = run};
