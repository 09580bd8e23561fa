// verb_render.c - voltree render: pictures and turntables of a tree
// SPDX-License-Identifier: BSD-3-Clause
#include "base/file.h"
#include "base/image_file.h"
#include "programs/level_sheet.h"
#include "programs/orbit.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/turntable.h"
#include "programs/verbs.h"

#include <string.h>

static const vt_option options[] = {
    {"output", 'o', VT_OPTION_TEXT, "IMG", 0, 0, true,
     "the picture to write; with --turntable the folder of its frames"},
    {"view", 0, VT_OPTION_INTEGER, "N", 0, 1000000, false,
     "from the camera of the N-th photograph of the tree, from 0"},
    {"azimuth", 0, VT_OPTION_NUMBER, "D", -36000, 36000, false,
     "degrees around the tree; 0, the default, is where the first photograph was taken"},
    {"elevation", 0, VT_OPTION_NUMBER, "D", -90, 90, false,
     "degrees above the tree's middle; default: the mean of the photographs"},
    {"distance", 0, VT_OPTION_NUMBER, "X", 0.001, 1e6, false,
     "from the tree's middle, in tree sizes; default: the whole tree is in the picture"},
    {"fov", 0, VT_OPTION_NUMBER, "D", 1, 150, false, "degrees of the picture's height; default: 40"},
    {"size", 0, VT_OPTION_DIMENSIONS, "WxH", 0, 0, false, "pixels; default: as the first photograph, or as --view"},
    {"background", 0, VT_OPTION_BACKGROUND, "none|white|black|R,G,B", 0, 0, false,
     "behind the tree; default: none (the picture keeps its alpha), of a turntable or sheet white"},
    {"turntable", 0, VT_OPTION_INTEGER, "N", 2, 100000, false,
     "N frames once around; also turntable.mp4 where ffmpeg is found"},
    {"levels-sheet", 0, VT_OPTION_FLAG, "", 0, 0, false,
     "one picture that shows the levels 3 to the finest beside each other"},
    {0}};

static vt_status choose_camera(vt_session *session, const vt_tree *tree, vt_camera *camera) {
  const vt_arguments *arguments = &session->arguments;
  vt_orbit orbit = vt_find_orbit(tree);
  int size[2] = {orbit.first_width, orbit.first_height};
  if (vt_given(arguments, "view")) {
    int view = vt_integer_of(arguments, "view", 0);
    if (view >= tree->view_count)
      return vt_fail(session->context, VT_BAD_USAGE,
                     "--view %d: %s has %d cameras, counted from 0; give a smaller number", view,
                     arguments->operands[0], tree->view_count);
    *camera = tree->cameras[view];
    if (vt_dimensions_of(arguments, "size", size)) *camera = vt_resize_camera(camera, size[0], size[1]);
    return VT_OK;
  }
  vt_dimensions_of(arguments, "size", size);
  *camera = vt_orbit_camera(
      &orbit, vt_number_of(arguments, "azimuth", 0), vt_number_of(arguments, "elevation", orbit.elevation),
      vt_number_of(arguments, "distance", 0), vt_number_of(arguments, "fov", 40), size[0], size[1]);
  return VT_OK;
}

static vt_status draw_one(vt_session *session, vt_renderer *renderer, const vt_render_desc *desc,
                          const vt_camera *camera, const float background[3], bool none, const char *path,
                          vt_render_report *report) {
  vt_context *context = session->context;
  vt_fimage picture = {0};
  vt_image bytes = {0};
  vt_status status = vt_render(context, renderer, desc, camera, &picture, report);
  if (!status)
    status = none ? vt_image_from_fimage(context, &picture, &bytes) : vt_flatten(context, &picture, background, &bytes);
  if (!status) status = vt_write_image(context, path, &bytes);
  vt_free_fimage(context, &picture);
  vt_free_image(context, &bytes);
  return status;
}

static vt_status finish(vt_session *session, const char *output, const char *renderer, const vt_camera *camera,
                        int level, int pictures, double seconds) {
  vt_say(session, "%s: %d picture%s of %d x %d pixels, %s, %.3f s each\n", output, pictures, pictures == 1 ? "" : "s",
         camera->width, camera->height, renderer, seconds / pictures);
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_string(&json, "output", output);
  vt_json_put_integer(&json, "pictures", pictures);
  vt_json_put_integer(&json, "width", camera->width);
  vt_json_put_integer(&json, "height", camera->height);
  vt_json_put_integer(&json, "level", level);
  vt_json_put_string(&json, "renderer", renderer);
  vt_json_put_number(&json, "seconds_per_picture", seconds / pictures);
  return vt_end_report(session, &json);
}

static vt_status draw_turntable(vt_session *session, vt_renderer *renderer, const vt_render_desc *desc,
                                const vt_tree *tree, const vt_camera *first, const float background[3], bool none,
                                vt_render_report *report) {
  const vt_arguments *arguments = &session->arguments;
  vt_orbit orbit = vt_find_orbit(tree);
  vt_turntable turn = {0};
  int count = vt_integer_of(arguments, "turntable", 0);
  double azimuth = vt_number_of(arguments, "azimuth", 0),
         elevation = vt_number_of(arguments, "elevation", orbit.elevation);
  vt_status status = vt_begin_turntable(session, vt_text_of(arguments, "output", ""), &turn);
  for (int i = 0; i < count && !status; i++) {
    vt_camera camera =
        vt_orbit_camera(&orbit, azimuth + 360.0 * i / count, elevation, vt_number_of(arguments, "distance", 0),
                        vt_number_of(arguments, "fov", 40), first->width, first->height);
    char *path = vt_turntable_frame(session, &turn, i);
    status = path ? draw_one(session, renderer, desc, &camera, background, none, path, report) : VT_OUT_OF_MEMORY;
    vt_free(session->context, path);
    vt_progress(session->context, "turntable", (i + 1.0) / count);
    if (!status && vt_cancelled(session->context)) status = VT_CANCELLED;
  }
  if (!status) status = vt_finish_turntable(session, &turn, true);
  vt_drop_turntable(session, &turn);
  return status;
}

// Before the work, not after it.
static vt_status check_output(vt_session *session, const char *output, bool folder, bool alpha) {
  if (folder) return vt_check_output_folder(session, output);
  if (alpha && vt_is_output_name(output, false) && !vt_is_output_name(output, true))
    return vt_fail(session->context, VT_BAD_USAGE,
                   "%s: JPEG keeps no transparency; give --background white, or a name that ends in .png", output);
  if (!vt_is_output_name(output, alpha))
    return vt_fail(session->context, VT_BAD_USAGE,
                   "%s: no picture can be written under this ending; give a name that ends in .%s", output,
                   vt_picture_ending());
  return vt_check_output_file(session, output);
}

static vt_status run(vt_session *session) {
  vt_context *context = session->context;
  const vt_arguments *arguments = &session->arguments;
  const char *input = arguments->operands[0], *output = vt_text_of(arguments, "output", "");
  bool turntable = vt_given(arguments, "turntable"), sheet = vt_given(arguments, "levels-sheet");
  float background[3] = {1, 1, 1};
  bool none = !turntable && !sheet;
  vt_background_of(arguments, "background", background, &none);
  if (turntable + sheet + vt_given(arguments, "view") > 1 && (turntable || !vt_given(arguments, "view")))
    return vt_fail(context, VT_BAD_USAGE, "--turntable: does not go with --view or --levels-sheet; give one of them");
  if (vt_given(arguments, "view") && (vt_given(arguments, "azimuth") || vt_given(arguments, "elevation") ||
                                      vt_given(arguments, "distance") || vt_given(arguments, "fov")))
    return vt_fail(context, VT_BAD_USAGE,
                   "--view: stands where a photograph was taken, so --azimuth, --elevation, --distance and --fov do not "
                   "go with it; leave out one or the other");
  if (sheet && none)
    return vt_fail(context, VT_BAD_USAGE,
                   "--background none: the sheet is drawn over a colour; give white, black or R,G,B");
  vt_tree tree = {0};
  vt_renderer *renderer = NULL;
  vt_camera camera;
  vt_render_desc desc = vt_render_desc_of(arguments);
  vt_render_report report = {.level = desc.level};
  vt_status status = check_output(session, output, turntable, none);
  if (!status) status = vt_read_tree(context, input, &tree, NULL);
  if (!status) status = vt_check_level(session, &tree, input, desc.level);
  if (!status) status = choose_camera(session, &tree, &camera);
  if (!status) status = vt_create_renderer(context, &tree, vt_backend_of(arguments), &renderer);
  double start = vt_seconds();
  if (!status && turntable)
    status = draw_turntable(session, renderer, &desc, &tree, &camera, background, none, &report);
  else if (!status && sheet)
    status = vt_write_level_sheet(session, &tree, &desc, vt_backend_of(arguments), &camera, background, output);
  else if (!status)
    status = draw_one(session, renderer, &desc, &camera, background, none, output, &report);
  if (!status)
    status = finish(session, output, vt_renderer_name(renderer), &camera, report.level,
                    turntable ? vt_integer_of(arguments, "turntable", 1) : 1, vt_seconds() - start);
  if (renderer) vt_destroy_renderer(context, renderer);
  vt_free_tree(context, &tree);
  return status;
}

const vt_verb vt_verb_render = {.name = "render",
                                .operands = "TREE",
                                .summary = "draw pictures or a turntable of a tree",
                                .notes = "The camera looks at the tree's middle from --azimuth, --elevation and "
                                         "--distance, or stands where a photograph "
                                         "was taken (--view). Up is what the photographs show as up. The level follows "
                                         "from the distance unless --level is "
                                         "given.",
                                .example =
                                    "voltree render tree.vtree -o tree.png --azimuth 30 --elevation 20 --size 800x800",
                                .operand_count = 1,
                                .tables = {options, vt_picture_options, vt_common_options},
                                .run = run};
