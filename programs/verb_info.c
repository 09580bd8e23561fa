// verb_info.c - voltree info: what is in a .vtree
// SPDX-License-Identifier: BSD-3-Clause
#include "octree/octree.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"

#include <string.h>

static void say_tree(vt_session *session, const char *name, const vt_tree *tree, const vt_file_report *file) {
  const vt_octree *octree = &tree->octree;
  char a[32], b[32], c[32], d[32], e[32], f[32];
  vt_say(session, "%s: %s tree, %s\n", name, vt_is_packed(tree) ? "packed" : "raw", vt_show_bytes(file->file_bytes, a));
  vt_say(session, "  in the file: cells %s, indices %s, codes %s, codebooks %s, texels %s\n",
         vt_show_bytes(file->cell_bytes, b), vt_show_bytes(file->index_bytes, c), vt_show_bytes(file->code_bytes, d),
         vt_show_bytes(file->codebook_bytes, e), vt_show_bytes(file->texel_bytes, f));
  vt_say(session, "  textures in memory: %s\n", vt_show_bytes(vt_texture_bytes(tree), a));
  vt_say(session, "  root cube: edge %g, corner (%g, %g, %g), branching %d\n", octree->edge, octree->origin.x,
         octree->origin.y, octree->origin.z, octree->branching);
  vt_say(session, "  billboards: %d x %d texels, side %g cells, %d photographs\n", tree->texel_edge, tree->texel_edge,
         (double)tree->tile_side, tree->view_count);
  if (vt_is_packed(tree))
    vt_say(session, "  codewords: %d of opacity, %d of colour\n", tree->alpha_codebook.codeword_count,
           tree->colour_codebook.codeword_count);
  vt_say(session, "  level      cells  billboards  edge\n");
  for (int l = 0; l < octree->level_count; l++)
    vt_say(session, "  %5d %10u %11u  %g\n", l, (unsigned)octree->levels[l].cell_count,
           (unsigned)tree->tiles[l].tile_count, vt_cell_edge(octree, l));
  vt_say(session, "  metadata: ");
  bool blank = true;
  for (const char *at = tree->metadata; *at; at++) { // no control sequences from a file to a terminal, no runs of blanks
    bool space = (unsigned char)*at <= ' ' || *at == 127;
    if (!space || !blank) vt_say(session, "%c", space ? ' ' : *at);
    blank = space;
  }
  vt_say(session, "\n");
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
  vt_json_open_array(&json, "levels");
  for (int l = 0; l < octree->level_count; l++) {
    vt_json_open_object(&json, NULL);
    vt_json_put_integer(&json, "level", l);
    vt_json_put_integer(&json, "cells", octree->levels[l].cell_count);
    vt_json_put_integer(&json, "billboards", tree->tiles[l].tile_count);
    vt_json_put_number(&json, "cell_edge", vt_cell_edge(octree, l));
    vt_json_close_object(&json);
  }
  vt_json_close_array(&json);
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
