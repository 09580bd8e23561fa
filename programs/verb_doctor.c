// verb_doctor.c - voltree doctor: what is here, what is missing, and what to do about it
// SPDX-License-Identifier: BSD-3-Clause
//
// Three answers a row: it is there; it is missing, and something works less well or not at all without it; it is missing, and
// demo.sh cannot do without it (exit code 5). The cure is always a command. Last a tree is made, packed, written, read and
// drawn: a machine on which all parts are there may still be broken.
#include "base/cache.h"
#include "base/child_process.h"
#include "base/file.h"
#include "base/folders.h"
#include "base/image_file.h"
#include "base/image_metrics.h"
#include "compress/compress.h"
#include "datasets-synthetic/synthetic.h"
#include "programs/report.h"
#include "programs/stage_options.h"
#include "programs/verbs.h"
#include "reconstruct/reconstruct.h"

#include <string.h>
#include <sys/utsname.h>
#include <unistd.h>

#ifdef VT_WITH_OPENIMAGEIO
#define HAS_OPENIMAGEIO true
#else
#define HAS_OPENIMAGEIO false
#endif
#ifdef VT_WITH_OPENCV
#define HAS_OPENCV true
#else
#define HAS_OPENCV false
#endif
#ifdef VT_WITH_JANSSON
#define HAS_JANSSON true
#else
#define HAS_JANSSON false
#endif
#ifdef VT_WITH_ZSTD
#define HAS_ZSTD true
#else
#define HAS_ZSTD false
#endif
#ifdef VT_WITH_CERES
#define HAS_CERES true
#else
#define HAS_CERES false
#endif
#ifdef VT_WITH_EMBREE
#define HAS_EMBREE true
#else
#define HAS_EMBREE false
#endif
#ifdef VT_WITH_SQLITE
#define HAS_SQLITE true
#else
#define HAS_SQLITE false
#endif
#ifdef VT_WITH_SDL
#define HAS_SDL true
#else
#define HAS_SDL false
#endif

static const vt_option options[] = {{"colmap", 0, VT_OPTION_TEXT, "PROGRAM", 0, 0, false,
                                     "the COLMAP program that finds cameras; default: colmap"},
                                    {0}};

static const struct {
  const char *name, *serves, *package;
  bool here, needed; // needed: by demo.sh
} libraries[] = {{"OpenImageIO", "reading and writing pictures", "libopenimageio-dev", HAS_OPENIMAGEIO, true},
                 {"jansson", "transforms.json", "libjansson-dev", HAS_JANSSON, true},
                 {"OpenCV", "lenses with distortion", "libopencv-dev libopencv-contrib-dev", HAS_OPENCV, false},
                 {"zstd", "small .vtree files", "libzstd-dev", HAS_ZSTD, false},
                 {"Ceres", "refinement of cameras", "libceres-dev", HAS_CERES, false},
                 {"SQLite", "why a photograph has no camera", "libsqlite3-dev", HAS_SQLITE, false},
                 {"Embree", "ray-traced synthetic trees", "libembree-dev", HAS_EMBREE, false},
                 {"SDL", "the window of voltree play", "libsdl2-dev", HAS_SDL, false}};

typedef enum finding { FINE, LESS, UNFIT } finding; // UNFIT: demo.sh cannot run

typedef struct visit {
  vt_session *session;
  vt_json_writer json;
  int less, unfit;
  char line[200]; // of a program that was asked
} visit;

static void tell(visit *v, finding f, const char *name, const char *detail, const char *cure) {
  static const char *const words[] = {"ok", "missing", "MISSING"};
  vt_say(v->session, "  %-8s %-16s %s%s%s\n", words[f], name, detail, f == FINE ? "" : "; ", f == FINE ? "" : cure);
  v->less += f == LESS;
  v->unfit += f == UNFIT;
  vt_json_open_object(&v->json, NULL);
  vt_json_put_string(&v->json, "name", name);
  vt_json_put_bool(&v->json, "ok", f == FINE);
  vt_json_put_bool(&v->json, "needed_by_demo", f == UNFIT);
  vt_json_put_string(&v->json, "detail", detail);
  if (f != FINE) vt_json_put_string(&v->json, "cure", cure);
  vt_json_close_object(&v->json);
}

// ---- what the build holds

static void look_at_libraries(visit *v) {
  for (size_t i = 0; i < sizeof libraries / sizeof *libraries; i++) {
    char cure[200];
    snprintf(cure, sizeof cure, "apt-get install %s, then build again", libraries[i].package);
    tell(v, libraries[i].here ? FINE : libraries[i].needed ? UNFIT : LESS, libraries[i].name, libraries[i].serves, cure);
  }
}

// ---- programs beside it

static void keep_version(void *user, const char *line) {
  visit *v = user;
  if (!v->line[0] && (strstr(line, "COLMAP ") || strstr(line, "ffmpeg version"))) snprintf(v->line, sizeof v->line, "%s", line);
}

// True if it runs; its version stands in v->line.
static bool ask(visit *v, const char *program, const char *word) {
  char *const command[] = {(char *)program, (char *)word, NULL};
  int exit_code = 0;
  v->line[0] = 0;
  vt_status status = vt_run_program_within(v->session->context, command, 20, NULL, keep_version, v, &exit_code);
  vt_clear_error(v->session->context);
  return !status && v->line[0];
}

static void look_at_programs(visit *v) {
  const char *colmap = vt_text_of(&v->session->arguments, "colmap", "colmap");
  char detail[300], version[24] = "";
  bool here = ask(v, colmap, "-h");
  if (here && sscanf(v->line, "COLMAP %23[0-9.]", version) == 1)
    snprintf(detail, sizeof detail, "%s: version %s, run on the CPU and without a display", colmap, version);
  else
    snprintf(detail, sizeof detail, "%s: finds the cameras of photographs; captures that have cameras need it not", colmap);
  tell(v, here ? FINE : LESS, "COLMAP", detail, "apt-get install colmap");
  here = ask(v, "ffmpeg", "-version");
  v->line[strcspn(v->line, " ") + strcspn(v->line + strcspn(v->line, " "), "C")] = 0; // "ffmpeg version 5.1 "
  tell(v, here ? FINE : LESS, "ffmpeg", here ? v->line : "turntables as video", "apt-get install ffmpeg");
}

// ---- the machine

static void look_at_machine(visit *v) {
  static const char *const paths[] = {"no vector instructions that are made use of", "AVX2", "AVX-512"};
  vt_context *context = v->session->context;
  char detail[400], a[32], b[32];
  struct utsname machine;
  snprintf(detail, sizeof detail, "%s, %d thread%s, %s", uname(&machine) ? "unknown" : machine.machine, vt_thread_count(context),
           vt_thread_count(context) == 1 ? "" : "s", paths[vt_best_walk_path()]);
  tell(v, FINE, "processor", detail, "");
  uint64_t bound = vt_memory_bound(context);
  snprintf(detail, sizeof detail, "%s for the data of a run (--max-memory)", vt_show_bytes(bound, a));
  tell(v, bound < 1000000000 ? LESS : FINE, "memory", detail, "give --max-image-size 800, or more memory");
  if (!v->session->cache) return;
  uint64_t left = vt_free_bytes(v->session->cache);
  snprintf(detail, sizeof detail, "%s: %s used, %s free", v->session->cache,
           vt_show_bytes(vt_folder_bytes(context, v->session->cache), a), vt_show_bytes(left, b));
  tell(v, left < 1000000000 ? LESS : FINE, "disk of the cache", detail, "make room, or give another --cache");
}

// ---- a tree from beginning to end

static vt_status look_at_drawing(visit *v, const vt_tree *tree) {
  vt_context *context = v->session->context;
  vt_renderer *renderer = NULL;
  vt_status status = vt_create_renderer(context, tree, VT_BACKEND_GL, &renderer);
  if (!status)
    tell(v, FINE, "OpenGL", vt_renderer_name(renderer), "");
  else
    tell(v, LESS, "OpenGL", "no context through EGL; pictures are drawn by the CPU, more slowly",
         "apt-get install libegl1 libgl1-mesa-dri (and libepoxy-dev libegl-dev to build)");
  vt_destroy_renderer(context, renderer);
  vt_clear_error(context);
  return vt_cancelled(context) ? VT_CANCELLED : VT_OK;
}

// Packs the tree, writes it, reads it and draws it beside a photograph. *psnr of the photograph's own view.
static vt_status go_round(vt_context *context, const vt_tree *raw, const vt_view *view, const char *folder, double *psnr) {
  vt_compress_desc packing = vt_default_compress_desc();
  vt_render_desc drawing = vt_default_render_desc();
  vt_tree packed = {0}, read = {0};
  vt_renderer *renderer = NULL;
  vt_fimage picture = {0};
  vt_metrics metrics;
  static const float white[3] = {1, 1, 1};
  char *path = vt_join(context, folder, "test.vtree");
  vt_status status = path ? vt_compress_tree(context, &packing, raw, &packed, NULL) : VT_OUT_OF_MEMORY;
  if (!status && !packed.metadata && !(packed.metadata = vt_strdup(context, "{}"))) status = VT_OUT_OF_MEMORY;
  if (!status) status = vt_write_tree(context, &packed, path, NULL);
  if (!status) status = vt_read_tree(context, path, &read, NULL);
  if (!status) status = vt_create_renderer(context, &read, VT_BACKEND_CPU, &renderer);
  drawing.level = status ? 0 : vt_finest_level(&read);
  if (!status) status = vt_render(context, renderer, &drawing, &view->camera, &picture, NULL);
  if (!status) status = vt_measure(context, &picture, &view->picture, white, &metrics);
  if (!status) *psnr = metrics.psnr;
  vt_destroy_renderer(context, renderer);
  vt_free_fimage(context, &picture);
  vt_free_tree(context, &packed);
  vt_free_tree(context, &read);
  vt_free(context, path);
  return status;
}

static vt_status test_itself(visit *v) {
  vt_context *context = v->session->context;
  vt_synthetic_desc scene = vt_default_synthetic_desc();
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_DRAFT);
  vt_views views = {0};
  vt_tree raw = {0};
  char *folder = NULL, detail[200];
  double start = vt_seconds(), psnr = 0;
  scene.train_count = 16;
  scene.test_count = 0;
  scene.width = scene.height = 96;
  desc.leaf_level = 5;
  vt_status status = vt_make_synthetic_views(context, &scene, &views);
  if (!status) status = vt_reconstruct(context, &desc, &views, &raw, NULL);
  if (!status) status = look_at_drawing(v, &raw);
  if (!status) status = vt_make_scratch_folder(context, &folder);
  if (!status) status = go_round(context, &raw, &views.items[0], folder, &psnr);
  if (!status && psnr < 18)
    status = vt_fail(context, VT_FAILED,
                     "doctor: the tree of the self-test shows its photographs at %.1f dB only; this build is broken, "
                     "build it again in an empty folder",
                     psnr);
  if (!status) {
    snprintf(detail, sizeof detail, "a tree of 16 photographs made, packed, read and drawn in %.1f s, %.1f dB",
             vt_seconds() - start, psnr);
    tell(v, FINE, "self-test", detail, "");
  }
  if (folder) vt_remove_folder(context, folder);
  vt_free(context, folder);
  vt_free_tree(context, &raw);
  vt_free_views(context, &views);
  return status;
}

static vt_status run(vt_session *session) {
  visit v = {.session = session};
  v.json = vt_begin_report(session);
  vt_say(session, "voltree %s\n", VT_VERSION);
  vt_json_open_array(&v.json, "findings");
  look_at_libraries(&v);
  look_at_programs(&v);
  look_at_machine(&v);
  vt_status status = test_itself(&v);
  if (status) {
    vt_drop_json(&v.json);
    return status;
  }
  vt_json_close_array(&v.json);
  vt_json_put_bool(&v.json, "demo_can_run", !v.unfit);
  vt_say(session, v.unfit || v.less ? "%d missing, %d of them needed by demo.sh\n" : "everything is here\n", v.unfit + v.less,
         v.unfit);
  status = vt_end_report(session, &v.json);
  if (status || !v.unfit) return status;
  return vt_fail(session->context, VT_MISSING_PROGRAM, "doctor: something is missing that demo.sh needs; ./setup.sh installs it");
}

const vt_verb vt_verb_doctor = {.name = "doctor",
                                .operands = "",
                                .summary = "say what is installed, what is missing and how to get it, and test the whole way",
                                .notes = "Exit code 5 if something is missing without which demo.sh cannot run.",
                                .example = "voltree doctor",
                                .operand_count = 0,
                                .tables = {options, vt_common_options},
                                .run = run};
