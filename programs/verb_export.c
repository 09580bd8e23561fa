// verb_export.c - voltree export: the cells of a level as a point cloud, or the cameras, as other programs read them
// SPDX-License-Identifier: BSD-3-Clause
//
// Cameras: of a tree, the pinhole cameras of the photographs it was made of; of a source of photographs, its cameras with
// their lenses, converted from one program's form to another's. Points: PLY, binary little-endian: a point at the centre of each cell with the cell's own colour, its opacity along an edge
// as the point's alpha, and its extinction per unit of length.
#include "base/file.h"
#include "octree/octree.h"
#include "programs/metadata.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"
#include "programs/world.h"

#include <string.h>

// The words stand in the order of vt_camera_format.
static const vt_option options[] = {
    {"output", 'o', VT_OPTION_TEXT, "FILE.ply|DIR", 0, 0, true,
     "the file to write, whose ending says the format, ply; with --cameras the folder"},
    {"cameras", 0, VT_OPTION_CHOICE, "colmap-text|colmap-binary|transforms", 0, 0, false,
     "write the cameras instead: a COLMAP model or transforms.json"},
    {"colmap", 0, VT_OPTION_TEXT, "PROGRAM", 0, 0, false, "the COLMAP program that finds cameras; default: colmap"},
    {"level", 0, VT_OPTION_INTEGER, "L", 0, VT_MAX_LEVEL, false,
     "the level whose cells are written; default: the finest"},
    {"metres", 0, VT_OPTION_FLAG, "", 0, 0, false, "points in metres, for trees whose scale is known (voltree info)"},
    {0}};

#define POINT_BYTES (3 * 4 + 4 + 4)

static uint8_t *put_float(uint8_t *at, double value) { // little-endian on every machine
  float single = (float)value;
  uint32_t bits;
  memcpy(&bits, &single, sizeof bits);
  for (int i = 0; i < 4; i++) *at++ = (uint8_t)(bits >> 8 * i);
  return at;
}

static uint8_t byte_of(double unit) {
  return (uint8_t)(unit <= 0 ? 0 : unit >= 1 ? 255 : unit * 255 + 0.5);
}

// Coordinates are multiplied by `scale`.
static vt_status make_ply(vt_context *context, const vt_octree *octree, int number, double scale, uint8_t **out,
                          size_t *out_size) {
  const vt_level *level = &octree->levels[number];
  double edge = scale * vt_cell_edge(octree, number);
  char *head = vt_print_text(context,
                             "ply\nformat binary_little_endian 1.0\ncomment voltree " VT_VERSION
                             ", level %d, edge of a cell %.17g\n"
                             "element vertex %u\nproperty float x\nproperty float y\nproperty float z\nproperty uchar "
                             "red\nproperty uchar green\n"
                             "property uchar blue\nproperty uchar alpha\nproperty float extinction\nend_header\n",
                             number, edge, (unsigned)level->cell_count);
  if (!head) return VT_OUT_OF_MEMORY;
  size_t head_size = strlen(head);
  *out_size = head_size + (size_t)level->cell_count * POINT_BYTES;
  *out = vt_alloc(context, *out_size, 1);
  if (*out) {
    memcpy(*out, head, head_size);
    uint8_t *at = *out + head_size;
    for (uint32_t i = 0; i < level->cell_count; i++) {
      vt_vec3 centre = vt_scale(vt_cell_centre(octree, number, i), scale);
      at = put_float(put_float(put_float(at, centre.x), centre.y), centre.z);
      for (size_t c = 0; c < 3; c++) *at++ = byte_of((double)level->colour[3 * (size_t)i + c]);
      *at++ = byte_of(-expm1(-(double)level->optical_depth[i]));
      at = put_float(at, (double)level->optical_depth[i] / edge);
    }
  }
  vt_free(context, head);
  return *out ? VT_OK : VT_OUT_OF_MEMORY;
}

static vt_status say_cameras(vt_session *session, const char *output, int count) {
  vt_say(session, "%s: %d cameras\n", output, count);
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_string(&json, "output", output);
  vt_json_put_integer(&json, "cameras", count);
  return vt_end_report(session, &json);
}

static vt_status write_tree_cameras(vt_context *context, const char *input, vt_camera_format format, const char *output,
                                    int *count) {
  vt_tree tree = {0};
  vt_names names = {0};
  vt_views views = {0};
  vt_status status = vt_read_tree(context, input, &tree, NULL);
  if (!status) status = vt_metadata_names(context, &tree, input, "views", &names);
  if (!status && (!tree.view_count || names.count != tree.view_count))
    status = vt_fail(context, VT_BAD_INPUT,
                     "%s: holds no cameras with names of their photographs; give the folder of photographs", input);
  if (!status && !(views.items = VT_NEW(context, vt_view, (size_t)names.count))) status = VT_OUT_OF_MEMORY;
  for (int i = 0; i < names.count && !status; i++)
    views.items[views.count++] = (vt_view){.name = names.items[i], .camera = tree.cameras[i]};
  if (!status) status = vt_export_cameras(context, &views, format, output);
  *count = views.count;
  vt_free(context, views.items); // the names are borrowed
  vt_free_names(context, &names);
  vt_free_tree(context, &tree);
  return status;
}

static bool ends_with(const char *text, const char *ending) {
  size_t n = strlen(text), m = strlen(ending);
  return n >= m && !strcmp(text + n - m, ending);
}

static vt_status export_cameras(vt_session *session, const char *input, const char *output) {
  vt_context *context = session->context;
  vt_camera_format format = (vt_camera_format)vt_choice_of(&session->arguments, "cameras", 0);
  int count = 0;
  vt_status status;
  if (ends_with(input, ".vtree")) {
    status = write_tree_cameras(context, input, format, output, &count);
  } else {
    vt_capture_desc desc = vt_default_capture_desc();
    desc.source = input;
    desc.colmap = vt_text_of(&session->arguments, "colmap", desc.colmap);
    desc.cache = session->cache;
    status = vt_convert_cameras(context, &desc, format, output, &count);
  }
  return status ? status : say_cameras(session, output, count);
}

static vt_status run(vt_session *session) {
  vt_context *context = session->context;
  const char *input = session->arguments.operands[0], *output = vt_text_of(&session->arguments, "output", "");
  if (vt_given(&session->arguments, "cameras")) return export_cameras(session, input, output);
  const char *ending = strrchr(vt_base_name(output), '.');
  if (!ending || strcmp(ending, ".ply"))
    return vt_fail(context, VT_BAD_USAGE, "%s: no format goes by this ending; give a name that ends in .ply", output);
  vt_tree tree = {0};
  uint8_t *bytes = NULL;
  size_t size = 0;
  char text[32];
  vt_status status = vt_check_output_file(session, output);
  if (!status) status = vt_read_tree(context, input, &tree, NULL);
  if (status) goto done;
  int level = vt_integer_of(&session->arguments, "level", tree.octree.level_count - 1);
  if (level >= tree.octree.level_count) {
    status = vt_fail(context, VT_BAD_USAGE, "--level %d: %s has the levels 0 to %d; give one of these", level, input,
                     tree.octree.level_count - 1);
    goto done;
  }
  vt_world world = {.metres_per_unit = 1};
  if (vt_given(&session->arguments, "metres")) vt_read_world(context, &tree, &world);
  if (!(world.metres_per_unit > 0)) {
    status = vt_fail(context, VT_BAD_INPUT,
                     "%s: its scale is not known; reconstruct it with --height, --marks or --marker-size, or leave out --metres",
                     input);
    goto done;
  }
  status = make_ply(context, &tree.octree, level, world.metres_per_unit, &bytes, &size);
  if (!status) status = vt_write_file(context, output, bytes, size);
  if (status) goto done;
  uint32_t points = tree.octree.levels[level].cell_count;
  vt_say(session, "%s: %u points of level %d, %s\n", output, (unsigned)points, level, vt_show_bytes(size, text));
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_string(&json, "output", output);
  vt_json_put_integer(&json, "level", level);
  vt_json_put_integer(&json, "points", points);
  vt_json_put_integer(&json, "file_bytes", (long long)size);
  status = vt_end_report(session, &json);
done:
  vt_free(context, bytes);
  vt_free_tree(context, &tree);
  return status;
}

const vt_verb vt_verb_export = {.name = "export",
                                .operands = "TREE|PHOTOS",
                                .summary = "write the cells of a level as a point cloud (PLY), or cameras",
                                .notes = "With --cameras the operand may also be a folder of photographs, a COLMAP workspace "
                                         "or a folder with transforms.json, whose cameras are then converted, lenses and all.",
                                .example = "voltree export tree.vtree -o tree.ply --level 6",
                                .operand_count = 1,
                                .tables = {options, vt_common_options},
                                .run = run};
