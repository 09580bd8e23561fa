// colmap_run.c - calibration of photographs by the colmap program
// SPDX-License-Identifier: BSD-3-Clause
//
// feature_extractor, a matcher, mapper (Schoenberger, Frahm, "Structure-from-motion revisited", CVPR 2016), on the
// CPU and without a display. Few photographs are matched each with each; many are taken for a walk around the tree
// and matched with their successors, at growing steps. What fails is tried again with more: each with each, then
// guided matching and an easier first pair (a small angle between the first two views, few inliers), which thin
// plants before cloth need. The model with most photographs of all attempts is kept. Options moved between versions:
// those of `colmap feature_extractor -h` decide (use_gpu is in SiftExtraction up to 3.12, in FeatureExtraction
// since).
// What goes wrong: photographs of different focal lengths but one size share a camera here.
#include "capture/colmap_run.h"
#include "base/image_file.h"
#include "base/child_process.h"
#include "base/folders.h"
#include <ctype.h>
#include <stdarg.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ALL_PAIRS = 40, ARGUMENTS = 40, ATTEMPTS = 3 };

typedef struct colmap {
  vt_context *context;
  const char *program;
  bool new_options, seeded; // of this version of the program
  char seed[16], threads[16];
  int photograph_count;
  char *images, *database, *list; // paths
  FILE *log;
  char last[512]; // the last line that said something
  bool last_is_error;
  int registered; // so far in this mapping, for progress
  const char *cameras;
} colmap;

typedef struct arguments {
  char *items[ARGUMENTS];
  int count;
} arguments;

// ---- what the program says

static void hear_options(void *user, const char *line) {
  colmap *c = user;
  if (strstr(line, "--FeatureExtraction.use_gpu")) c->new_options = true;
  if (strstr(line, "--random_seed")) c->seeded = true;
  if (strstr(line, "--database_path")) c->registered = 1;
}

static void keep_last(colmap *c, const char *line) {
  bool words = false,
       error = strstr(line, "rror") || strstr(line, "ailed") || strstr(line, "ERROR") || strstr(line, "Invalid");
  for (const char *p = line; *p; p++) words = words || isalpha((unsigned char)*p);
  if (!words || (c->last_is_error && !error)) return;
  c->last_is_error = error;
  while (isspace((unsigned char)*line)) line++;
  snprintf(c->last, sizeof c->last, "%s", line);
}

static void hear_progress(void *user, const char *line) {
  colmap *c = user;
  int done = 0, all = 0, row = 0, rows = 0;
  const char *at;
  if ((at = strstr(line, "Processed file [")) && sscanf(at, "Processed file [%d/%d", &done, &all) == 2 && all > 0)
    vt_progress(c->context, "features", 0.999 * done / all);
  else if ((at = strstr(line, "Matching block [")) &&
           sscanf(at, "Matching block [%d/%d, %d/%d", &row, &rows, &done, &all) == 4 && all > 0 && rows > 0)
    vt_progress(c->context, "matching", ((row - 1) * (double)all + done - 1) / ((double)all * rows));
  else if ((at = strstr(line, "Matching image [")) && sscanf(at, "Matching image [%d/%d", &done, &all) == 2 && all > 0)
    vt_progress(c->context, "matching", (done - 1.0) / all);
  else if (strstr(line, "Registering image #") && c->photograph_count > 0)
    vt_progress(c->context, "mapping",
                c->registered < c->photograph_count ? (double)c->registered++ / c->photograph_count : 0.999);
  keep_last(c, line);
}

// ---- steps

static void add(arguments *a, ...) { // strings, the last NULL
  va_list list;
  va_start(list, a);
  for (char *s; (s = va_arg(list, char *));) {
    VT_ASSERT(a->count + 1 < ARGUMENTS);
    a->items[a->count++] = s;
  }
  va_end(list);
}

static vt_status fail_missing(colmap *c) {
  return vt_fail(
      c->context, VT_MISSING_PROGRAM,
      "%s: this program, which finds the cameras, was not found; install it (apt-get install colmap), name it "
      "with --colmap, or give photographs with cameras (transforms.json or a COLMAP model in sparse/0)",
      c->program);
}

// Runs one command. *exit_code tells how it ended.
static vt_status run(colmap *c, arguments *a, const char *stage, int *exit_code) {
  c->last[0] = 0;
  c->last_is_error = false;
  if (c->log) {
    for (int i = 0; i < a->count; i++) fprintf(c->log, "%s ", a->items[i]);
    fputc('\n', c->log);
  }
  vt_progress(c->context, stage, 0);
  vt_status status = vt_run_program(c->context, a->items, c->log, hear_progress, c, exit_code);
  if (status == VT_OK || status == VT_CANCELLED) vt_progress(c->context, stage, 1);
  if (c->log) fflush(c->log);
  return status == VT_MISSING_PROGRAM ? fail_missing(c) : status;
}

static vt_status fail_step(colmap *c, const char *step, int exit_code) {
  return vt_fail(c->context, VT_FAILED, "%s %s: ended with code %d: %s", c->program, step, exit_code,
                 c->last[0] ? c->last : "it said nothing; try it by hand on the photographs");
}

// Learns the options of this version.
static vt_status probe(colmap *c) {
  char *const command[] = {(char *)c->program, "feature_extractor", "-h", NULL};
  int exit_code = 0;
  c->registered = 0;
  vt_status status = vt_run_program(c->context, command, c->log, hear_options, c, &exit_code);
  if (status == VT_MISSING_PROGRAM) return fail_missing(c);
  if (status == VT_OK && !c->registered)
    return vt_fail(
        c->context, VT_MISSING_PROGRAM,
        "%s: this is not COLMAP, or it cannot run here (feature_extractor -h ended with code %d); try it by hand",
        c->program, exit_code);
  return status;
}

static void add_common(colmap *c, arguments *a) {
  add(a, "--database_path", c->database, NULL);
  if (c->seeded) add(a, "--random_seed", c->seed, NULL);
}

static vt_status extract(colmap *c) {
  arguments a = {{0}, 0};
  int exit_code = 0;
  add(&a, c->program, "feature_extractor", "--image_path", c->images, "--image_list_path", c->list,
      "--ImageReader.camera_model", "SIMPLE_RADIAL", c->cameras, "1", "--SiftExtraction.max_num_features", "4096",
      NULL);
  add(&a, c->new_options ? "--FeatureExtraction.use_gpu" : "--SiftExtraction.use_gpu", "0", NULL);
  add(&a, c->new_options ? "--FeatureExtraction.num_threads" : "--SiftExtraction.num_threads", c->threads, NULL);
  add_common(c, &a);
  vt_status status = run(c, &a, "features", &exit_code);
  return status == VT_OK && exit_code ? fail_step(c, "feature_extractor", exit_code) : status;
}

static vt_status match(colmap *c, bool all_pairs, bool guided) {
  arguments a = {{0}, 0};
  int exit_code = 0;
  const char *step = all_pairs ? "exhaustive_matcher" : "sequential_matcher";
  add(&a, c->program, step, c->new_options ? "--FeatureMatching.use_gpu" : "--SiftMatching.use_gpu", "0", NULL);
  add(&a, c->new_options ? "--FeatureMatching.num_threads" : "--SiftMatching.num_threads", c->threads, NULL);
  if (!all_pairs)
    add(&a, "--SequentialMatching.overlap", "10", NULL);
  else
    add(&a, "--ExhaustiveMatching.block_size", c->photograph_count <= 100 ? "10" : "50", NULL); // steps of progress
  if (guided)
    add(&a, c->new_options ? "--FeatureMatching.guided_matching" : "--SiftMatching.guided_matching", "1", NULL);
  add_common(c, &a);
  vt_status status = run(c, &a, "matching", &exit_code);
  return status == VT_OK && exit_code ? fail_step(c, step, exit_code) : status;
}

// Forgets matches, which a matcher would not do again. Versions without database_cleaner keep them, no harm done.
static vt_status forget_matches(colmap *c) {
  arguments a = {{0}, 0};
  int exit_code = 0;
  add(&a, c->program, "database_cleaner", "--type", "matches", "--database_path", c->database, NULL);
  return run(c, &a, "matching", &exit_code);
}

// No model is not a failure here, a crash is.
static vt_status map(colmap *c, bool easier, const char *folder) {
  arguments a = {{0}, 0};
  int exit_code = 0;
  add(&a, c->program, "mapper", "--image_path", c->images, "--output_path", folder, "--Mapper.min_model_size", "3",
      "--Mapper.num_threads", c->threads, NULL);
  if (easier)
    add(&a, "--Mapper.init_min_tri_angle", "4", "--Mapper.init_min_num_inliers", "50",
        "--Mapper.abs_pose_min_num_inliers", "15", NULL);
  add_common(c, &a);
  c->registered = 0;
  vt_status status = run(c, &a, "mapping", &exit_code);
  return status == VT_OK && exit_code > 1 ? fail_step(c, "mapper", exit_code) : status;
}

// ---- models

// Photographs in a model: the first number of images.bin. 0 if there is none.
static int count_registered(const char *model_folder, vt_context *context) {
  char *path = vt_join(context, model_folder, "images.bin");
  FILE *file = path ? fopen(path, "rb") : NULL;
  uint8_t bytes[8];
  uint64_t count = 0;
  if (file && fread(bytes, 1, 8, file) == 8)
    for (int i = 7; i >= 0; i--) count = count << 8 | bytes[i];
  if (file) fclose(file);
  vt_free(context, path);
  return count < 1000000 ? (int)count : 0;
}

// The model with most photographs in models/0, models/1, ... *best is its path, if it has more than *best_count.
static vt_status choose_model(colmap *c, const char *models, char **best, int *best_count) {
  for (int i = 0;; i++) {
    char name[16];
    snprintf(name, sizeof name, "%d", i);
    char *folder = vt_join(c->context, models, name);
    if (!folder) return VT_OUT_OF_MEMORY;
    if (!vt_is_folder(folder)) {
      vt_free(c->context, folder);
      return VT_OK;
    }
    int count = count_registered(folder, c->context);
    if (count > *best_count) {
      char *swap = *best;
      *best = folder;
      *best_count = count;
      folder = swap;
    }
    vt_free(c->context, folder);
  }
}

// Attempts, each with more effort, until enough photographs are registered.
static vt_status try_all(colmap *c, const char *workspace, char **best, int *best_count) {
  bool all_pairs = c->photograph_count <= ALL_PAIRS;
  vt_status status = extract(c);
  if (status == VT_OK) status = match(c, all_pairs, false);
  for (int attempt = 0; status == VT_OK; attempt++) {
    char name[16];
    snprintf(name, sizeof name, "models-%d", attempt);
    char *models = vt_join(c->context, workspace, name);
    if (!models) return VT_OUT_OF_MEMORY;
    vt_remove_folder(c->context, models);
    status = vt_make_folder(c->context, models);
    if (status == VT_OK) status = map(c, attempt == ATTEMPTS - 1, models);
    if (status == VT_OK) status = choose_model(c, models, best, best_count);
    vt_free(c->context, models);
    if (status != VT_OK) return status;
    vt_log(c->context, VT_LOG_VERBOSE, "colmap: %d of %d photographs registered", *best_count, c->photograph_count);
    bool few = 10 * *best_count < 9 * c->photograph_count, very_few = 2 * *best_count < c->photograph_count;
    if (attempt == 0 && few && !all_pairs) {
      status = match(c, true, false);
    } else if (attempt < ATTEMPTS - 1 && very_few) {
      attempt = ATTEMPTS - 2;
      status = forget_matches(c);
      if (status == VT_OK) status = match(c, true, true);
    } else {
      return VT_OK;
    }
  }
  return status;
}

static vt_status keep_model(colmap *c, const char *workspace, const char *model) {
  char *sparse = vt_join(c->context, workspace, "sparse"), *target = sparse ? vt_join(c->context, sparse, "0") : NULL;
  vt_status status = target ? VT_OK : VT_OUT_OF_MEMORY;
  if (status == VT_OK) {
    vt_remove_folder(c->context, sparse);
    status = vt_make_folder(c->context, sparse);
  }
  if (status == VT_OK && rename(model, target))
    status = vt_fail(c->context, VT_FAILED, "%s: could not be renamed to %s; is the folder writable?", model, target);
  vt_free(c->context, sparse);
  vt_free(c->context, target);
  return status;
}

// ---- photographs

// Kinds that COLMAP reads in every version.
static bool is_plain(const char *name) {
  static const char *const endings[] = {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp"};
  const char *dot = strrchr(name, '.');
  for (size_t i = 0; dot && i < sizeof endings / sizeof endings[0]; i++)
    if (!strcasecmp(dot, endings[i])) return true;
  return false;
}

// A folder with the same names where COLMAP can read them all: links, and PNG (known by its content) for other kinds.
static vt_status convert_photos(colmap *c, const char *folder, const vt_names *names, const char *workspace) {
  char here[4096]; // links need an absolute path
  if (!getcwd(here, sizeof here)) return vt_fail(c->context, VT_FAILED, "%s: the working folder has no path", folder);
  char *images = vt_join(c->context, workspace, "images"), *real = vt_join(c->context, here, folder);
  vt_status status = images && real ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; status == VT_OK && i < names->count; i++) {
    char *from = vt_join(c->context, real, names->items[i]), *to = vt_join(c->context, images, names->items[i]);
    char *parent = to ? vt_strdup(c->context, to) : NULL, *png = to ? VT_NEW(c->context, char, strlen(to) + 5) : NULL;
    vt_image picture = {0};
    if (!from || !parent || !png) status = VT_OUT_OF_MEMORY;
    if (status == VT_OK) {
      *strrchr(parent, '/') = 0;
      snprintf(png, strlen(to) + 5, "%s.png", to);
      status = vt_make_folder(c->context, parent);
    }
    if (status == VT_OK && is_plain(names->items[i])) {
      if (symlink(from, to)) status = vt_fail(c->context, VT_FAILED, "%s: the link could not be made", to);
    } else if (status == VT_OK) {
      status = vt_read_image(c->context, from, &picture);
      if (status == VT_OK) status = vt_write_image(c->context, png, &picture);
      if (status == VT_OK && rename(png, to)) status = vt_fail(c->context, VT_FAILED, "%s: could not be written", to);
    }
    vt_free_image(c->context, &picture);
    vt_free(c->context, from);
    vt_free(c->context, to);
    vt_free(c->context, parent);
    vt_free(c->context, png);
    if (status == VT_OK && vt_cancelled(c->context)) status = vt_fail(c->context, VT_CANCELLED, "colmap: interrupted");
  }
  vt_free(c->context, real);
  c->images = images;
  return status;
}

// One camera for photographs of one size, else one for each photograph.
static vt_status choose_cameras(colmap *c, const char *folder, const vt_names *names) {
  vt_image_info first = {0}, info;
  c->cameras = "--ImageReader.single_camera";
  for (int i = 0; i < names->count; i++) {
    char *path = vt_join(c->context, folder, names->items[i]);
    if (!path) return VT_OUT_OF_MEMORY;
    vt_status status = vt_read_image_info(c->context, path, &info);
    vt_free(c->context, path);
    if (status != VT_OK) return status;
    if (i == 0) first = info;
    if (info.width != first.width || info.height != first.height) c->cameras = "--ImageReader.single_camera_per_image";
  }
  return VT_OK;
}

static vt_status write_list(colmap *c, const vt_names *names) {
  size_t size = 1;
  for (int i = 0; i < names->count; i++) size += strlen(names->items[i]) + 1;
  char *text = VT_NEW(c->context, char, size), *end = text;
  if (!text) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < names->count; i++) {
    if (strchr(names->items[i], '\n')) continue; // such a name cannot stand in a list
    end += sprintf(end, "%s\n", names->items[i]);
  }
  vt_status status = vt_write_file(c->context, c->list, text, (size_t)(end - text));
  vt_free(c->context, text);
  return status;
}

static vt_status prepare(colmap *c, const char *folder, const vt_names *names, const char *workspace) {
  char *log = vt_join(c->context, workspace, "colmap.log");
  c->database = vt_join(c->context, workspace, "database.db");
  c->list = vt_join(c->context, workspace, "photographs.txt");
  if (log) c->log = fopen(log, "w"); // without a log it works as well
  vt_free(c->context, log);
  if (!c->database || !c->list) return VT_OUT_OF_MEMORY;
  remove(c->database); // of an interrupted run
  vt_status status = probe(c);
  if (status == VT_OK) status = choose_cameras(c, folder, names);
  if (status == VT_OK) status = write_list(c, names);
  bool plain = true;
  for (int i = 0; i < names->count; i++) plain = plain && is_plain(names->items[i]);
  if (status == VT_OK && !plain) return convert_photos(c, folder, names, workspace);
  c->images = vt_strdup(c->context, folder);
  return status == VT_OK && !c->images ? VT_OUT_OF_MEMORY : status;
}

vt_status vt_run_colmap(vt_context *context, const vt_capture_desc *desc, const char *image_folder,
                        const vt_names *names, const char *workspace) {
  VT_ASSERT(desc->cookie == VT_COOKIE);
  if (names->count < 3)
    return vt_fail(context, VT_TOO_FEW_VIEWS,
                   "%s: %d photographs; give at least 3, better 40 or more all around the tree", image_folder,
                   names->count);
  colmap c = {.context = context, .program = desc->colmap ? desc->colmap : "colmap", .photograph_count = names->count};
  snprintf(c.seed, sizeof c.seed, "%u", desc->seed & 0x7fffffffu);
  snprintf(c.threads, sizeof c.threads, "%d", vt_thread_count(context));
  char *best = NULL;
  int best_count = 0;
  vt_status status = prepare(&c, image_folder, names, workspace);
  if (status == VT_OK) status = try_all(&c, workspace, &best, &best_count);
  if (status == VT_OK && best_count < 3)
    status =
        vt_fail(context, VT_TOO_FEW_VIEWS,
                "%s: only %d of %d photographs could be related to each other; take more of them, with more overlap "
                "(a step of at most 10 degrees), sharp, and with something textured that stands still beside the tree",
                image_folder, best_count, names->count);
  if (status == VT_OK) status = keep_model(&c, workspace, best);
  if (c.log) fclose(c.log);
  vt_free(context, best);
  vt_free(context, c.images);
  vt_free(context, c.database);
  vt_free(context, c.list);
  return status;
}
