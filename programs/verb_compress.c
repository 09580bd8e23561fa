// verb_compress.c - voltree compress: a raw tree to a packed one
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/metadata.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"

static const vt_option options[] = {{"output", 'o', VT_OPTION_TEXT, "TREE2.vtree", 0, 0, true, "the file to write"},
                                    {0}};

static vt_status add_compression(vt_context *context, vt_tree *tree, const vt_compress_desc *desc,
                                 const vt_compress_report *report) {
  vt_json_writer json = vt_begin_json(context);
  vt_report_compression(&json, NULL, desc, report);
  char *text;
  size_t size;
  vt_status status = vt_end_json(&json, &text, &size);
  if (status) return status;
  status = vt_add_metadata(context, tree, "compression", text);
  vt_free(context, text);
  return status;
}

static vt_status run(vt_session *session) {
  vt_context *context = session->context;
  const char *input = session->arguments.operands[0], *output = vt_text_of(&session->arguments, "output", "");
  vt_tree raw = {0}, packed = {0};
  vt_compress_desc desc = vt_compress_desc_of(&session->arguments);
  vt_compress_report report;
  vt_file_report file, raw_file;
  char before[32], after[32], bytes[32], raw_bytes[32];
  vt_status status = vt_check_output_file(session, output);
  vt_begin_stage(session);
  if (!status) status = vt_read_tree(context, input, &raw, &raw_file);
  if (status) goto done;
  vt_end_stage(session, "read");
  if (vt_is_packed(&raw)) {
    status = vt_fail(context, VT_BAD_INPUT, "%s: is packed already; give a tree from voltree reconstruct --raw", input);
    goto done;
  }
  vt_begin_stage(session);
  status = vt_compress_tree(context, &desc, &raw, &packed, &report);
  if (status) goto done;
  vt_end_stage(session, "compress");
  status = add_compression(context, &packed, &desc, &report);
  if (status) goto done;
  vt_begin_stage(session);
  status = vt_write_tree(context, &packed, output, &file);
  if (status) goto done;
  vt_end_stage(session, "write");
  vt_say(session, "%s: textures %s, packed %s; file %s, before %s; %.1f s\n", output,
         vt_show_bytes(report.raw_bytes, before), vt_show_bytes(report.packed_bytes, after),
         vt_show_bytes(file.file_bytes, bytes), vt_show_bytes(raw_file.file_bytes, raw_bytes),
         vt_seconds() - session->start);
  vt_say_compression(session, &report);
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_string(&json, "input", input);
  vt_json_put_string(&json, "output", output);
  vt_report_compression(&json, "compression", &desc, &report);
  vt_json_put_integer(&json, "raw_file_bytes", (long long)raw_file.file_bytes);
  vt_json_put_integer(&json, "file_bytes", (long long)file.file_bytes);
  status = vt_end_report(session, &json);
done:
  vt_free_tree(context, &raw);
  vt_free_tree(context, &packed);
  return status;
}

const vt_verb vt_verb_compress = {
    .name = "compress",
    .operands = "TREE",
    .summary = "pack textures, colours and opacities of a raw tree",
    .notes = "TREE comes from voltree reconstruct --raw. Packing it again with other codebooks shows what they cost.",
    .example = "voltree compress raw.vtree -o tree.vtree --colour-codewords 4096",
    .operand_count = 1,
    .tables = {options, vt_codebook_options, vt_common_options},
    .run = run};
