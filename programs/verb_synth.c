// verb_synth.c - voltree synth: a procedural tree or phantom, photographed, and damaged if asked for
// SPDX-License-Identifier: BSD-3-Clause
//
// What a capture shows goes into OUT as anyone's photographs would. What is true goes beside it, where no reader of
// captures looks: OUT/truth.json says what was photographed; OUT/truth has the exact cameras and mattes, in a form that
// is itself a capture over the same photographs, so that "what would exact cameras have given" is one more run.
#include "base/file.h"
#include "base/image_file.h"
#include "capture/capture.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/synth_options.h"
#include "programs/truth_file.h"
#include "programs/verbs.h"

#include <string.h>

typedef struct shoot { // one capture on its way
  const vt_synth_plan *plan;
  vt_synthetic_desc desc;
  const char *folder;
  vt_views views;
  vt_views exact;   // shallow: the cameras before damage; pictures are borrowed
  vt_image *mattes; // [views.count] one channel, or NULL where none are kept
} shoot;

static vt_status keep_mattes(vt_context *context, shoot *s) {
  if (s->desc.backdrop == VT_BACKDROP_NONE && !vt_harms_mattes(&s->plan->damage)) return VT_OK;
  s->mattes = VT_NEW(context, vt_image, (size_t)s->views.count);
  if (!s->mattes) return VT_OUT_OF_MEMORY;
  vt_status status = VT_OK;
  for (int i = 0; i < s->views.count && !status; i++) {
    const vt_image *picture = &s->views.items[i].picture;
    status = vt_make_image(context, picture->width, picture->height, 1, &s->mattes[i]);
    size_t count = status ? 0 : (size_t)picture->width * (size_t)picture->height;
    for (size_t k = 0; k < count; k++) s->mattes[i].pixels[k] = picture->pixels[4 * k + 3];
  }
  return status;
}

// Keeps what the photographs and cameras are before anything is done to them.
static vt_status keep_truth(vt_context *context, shoot *s) {
  s->exact.items = VT_NEW(context, vt_view, (size_t)s->views.count);
  if (!s->exact.items) return VT_OUT_OF_MEMORY;
  memcpy(s->exact.items, s->views.items, (size_t)s->views.count * sizeof *s->exact.items);
  s->exact.count = s->views.count;
  return keep_mattes(context, s);
}

static vt_status damage(vt_context *context, shoot *s) {
  vt_views chosen = {0};
  chosen.items = VT_NEW(context, vt_view, (size_t)s->views.count);
  if (!chosen.items) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < s->views.count; i++)
    if (s->plan->damage_test_views || s->views.items[i].role == VT_TRAIN)
      chosen.items[chosen.count++] = s->views.items[i];
  vt_status status = vt_damage_views(context, &s->plan->damage, &chosen);
  for (int i = 0, k = 0; i < s->views.count && k < chosen.count; i++) // pictures are shared, cameras are not
    if (s->views.items[i].name == chosen.items[k].name) s->views.items[i].camera = chosen.items[k++].camera;
  vt_free(context, chosen.items);
  return status;
}

static vt_status write_mattes(vt_context *context, const shoot *s) {
  vt_status status = VT_OK;
  for (int i = 0; i < s->views.count && !status; i++) {
    char *path = vt_print_text(context, "%s/truth/mattes/%s", s->folder, s->views.items[i].name), *slash = NULL;
    if (!path) return VT_OUT_OF_MEMORY;
    slash = strrchr(path, '/');
    *slash = 0;
    status = vt_make_folder(context, path);
    *slash = '/';
    if (!status) status = vt_write_image(context, path, &s->mattes[i]);
    vt_free(context, path);
  }
  return status;
}

static vt_status write_truth(vt_context *context, const shoot *s) {
  vt_status status = vt_write_truth_file(context, &s->desc, &s->plan->damage, s->folder);
  if (status || (!s->mattes && !vt_harms_cameras(&s->plan->damage))) return status;
  char *folder = vt_join(context, s->folder, "truth");
  status = folder ? vt_make_folder(context, folder) : VT_OUT_OF_MEMORY;
  if (!status && s->mattes) status = write_mattes(context, s);
  if (!status) status = vt_write_cameras(context, &s->exact, folder, "../", s->mattes ? "mattes/" : NULL);
  vt_free(context, folder);
  return status;
}

static void free_shoot(vt_context *context, shoot *s) {
  for (int i = 0; i < s->views.count && s->mattes; i++) vt_free_image(context, &s->mattes[i]);
  vt_free(context, s->mattes);
  vt_free(context, s->exact.items);
  vt_free_views(context, &s->views);
}

// The capture under sun number desc.sun + `more` into `folder`; the first one's stages are noted.
static vt_status take_capture(vt_session *session, const vt_synth_plan *plan, int more, const char *folder) {
  vt_context *context = session->context;
  shoot s = {.plan = plan, .desc = plan->desc, .folder = folder};
  s.desc.sun += more;
  if (!more) vt_begin_stage(session);
  vt_status status = vt_make_synthetic_views(context, &s.desc, &s.views);
  if (!status) status = keep_truth(context, &s);
  if (!status) status = vt_put_before_backdrop(context, &s.desc, &s.views);
  if (!status) status = damage(context, &s);
  if (!status && !more) vt_end_stage(session, "synth");
  if (!more) vt_begin_stage(session);
  if (!status) status = vt_write_capture(context, &s.views, folder);
  if (!status) status = write_truth(context, &s);
  if (!status && !more) vt_end_stage(session, "write");
  free_shoot(context, &s);
  return status;
}

static vt_status relight(vt_session *session, const vt_synth_plan *plan, const char *folder) {
  vt_status status = VT_OK;
  vt_begin_stage(session);
  for (int k = 1; k <= plan->relight_count && !status; k++) {
    char *path = vt_print_text(session->context, "%s/relight_%d", folder, k);
    status = path ? take_capture(session, plan, k, path) : VT_OUT_OF_MEMORY;
    vt_free(session->context, path);
  }
  if (!status && plan->relight_count) vt_end_stage(session, "relight");
  return status;
}

static vt_status export_mesh(vt_session *session, const vt_synth_plan *plan) {
  vt_mesh mesh = {0};
  if (!plan->export_path) return VT_OK;
  vt_begin_stage(session);
  vt_status status = vt_make_synthetic_mesh(session->context, &plan->desc, &mesh);
  if (!status) status = vt_write_mesh(session->context, &mesh, plan->export_path);
  if (!status) {
    vt_end_stage(session, "export");
    vt_say(session, "%s: %zu vertices, %zu triangles\n", plan->export_path, mesh.vertex_count, mesh.triangle_count);
  }
  vt_free_mesh(session->context, &mesh);
  return status;
}

static vt_status say_and_report(vt_session *session, const vt_synth_plan *plan, const char *folder) {
  const vt_synthetic_desc *desc = &plan->desc;
  vt_say(session, "%s: %d photographs of %s, %d x %d pixels, %d to judge against, %.1f s\n", folder, desc->train_count,
         vt_synthetic_name(desc->kind), desc->width, desc->height, desc->test_count, vt_seconds() - session->start);
  if (plan->relight_count)
    vt_say(session, "%s/relight_1 to %d: the same under other suns\n", folder, plan->relight_count);
  vt_json_writer json = vt_begin_report(session);
  vt_json_put_string(&json, "output", folder);
  vt_json_put_string(&json, "kind", vt_synthetic_name(desc->kind));
  vt_json_put_integer(&json, "seed", desc->seed);
  vt_json_put_integer(&json, "views", desc->train_count);
  vt_json_put_integer(&json, "test_views", desc->test_count);
  vt_json_put_integer(&json, "width", desc->width);
  vt_json_put_integer(&json, "height", desc->height);
  vt_json_put_integer(&json, "relit", plan->relight_count);
  if (plan->export_path) vt_json_put_string(&json, "mesh", plan->export_path);
  return vt_end_report(session, &json);
}

static vt_status run(vt_session *session) {
  const char *folder = session->arguments.operands[0];
  vt_synth_plan plan;
  vt_status status = vt_synth_plan_of(session, &plan);
  if (!status) status = vt_check_output_folder(session, folder);
  if (!status && plan.export_path) status = vt_check_output_file(session, plan.export_path);
  if (!status) status = take_capture(session, &plan, 0, folder);
  if (!status) status = relight(session, &plan, folder);
  if (!status) status = export_mesh(session, &plan);
  if (!status) status = say_and_report(session, &plan, folder);
  return status;
}

const vt_verb vt_verb_synth = {
    .name = "synth",
    .operands = "OUT",
    .summary = "grow a tree and photograph it with exact cameras and mattes, or with damage of known amounts",
    .notes =
        "OUT becomes a capture folder: pictures with alpha, transforms_train.json and transforms_test.json (or one "
        "transforms.json without photographs to judge against). truth.json in it says what was photographed, for "
        "voltree "
        "evaluate --truth. Where mattes or cameras of the capture are not exact, OUT/truth holds the exact ones and "
        "can be "
        "used as a capture of the same photographs. Amounts of damage are drawn for each photograph from a normal "
        "distribution of the given deviation unless said otherwise. The same options give the same bytes.",
    .example = "voltree synth oak --kind oak --seed 7 --views 48 --test-views 12 --size 400",
    .operand_count = 1,
    .tables = {vt_synth_options, vt_damage_options, vt_common_options},
    .run = run};
