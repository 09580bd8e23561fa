// colmap_program.c - the colmap program: its version and options, its steps one by one, and what it says meanwhile
// SPDX-License-Identifier: BSD-3-Clause
//
// feature_extractor, a matcher, mapper (Schoenberger, Frahm, "Structure-from-motion revisited", CVPR 2016), on the CPU and
// without a display: what is left to its default looks for a graphics card and, without one, ends with "cannot create
// context". Options moved between versions: those of `colmap feature_extractor -h` decide (use_gpu is in SiftExtraction up to
// 3.12, in FeatureExtraction since).
// It has no other report of its progress than what it prints, so that is read: photographs of features, blocks of pairs,
// registered images; and the camera and the number of features of each photograph, which a later run, or the search for why a
// photograph has no place, wants to know.
#include "capture/colmap_program.h"
#include "base/child_process.h"

#include <ctype.h>
#include <stdarg.h>
#include <string.h>

enum { ARGUMENTS = 48, MOST_FEATURES = 4096 };

typedef struct arguments {
  const char *items[ARGUMENTS];
  int count;
} arguments;

// ---- what the program says

static void hear_help(void *user, const char *line) {
  vt_colmap *c = user;
  char version[24];
  if (!c->version[0] && sscanf(line, "COLMAP %23[0-9.]", version) == 1) strcpy(c->version, version);
  if (strstr(line, "--FeatureExtraction.use_gpu")) c->new_options = true;
  if (strstr(line, "--FeatureExtraction.max_image_size")) c->new_size = true;
  if (strstr(line, "--random_seed")) c->seeded = true;
  if (strstr(line, "--database_path")) c->help_seen = true;
}

static void keep_last(vt_colmap *c, const char *line) {
  bool words = false,
       error = strstr(line, "rror") || strstr(line, "ailed") || strstr(line, "ERROR") || strstr(line, "Invalid");
  for (const char *p = line; *p; p++) words = words || isalpha((unsigned char)*p);
  if (!words || (c->last_is_error && !error)) return;
  c->last_is_error = error;
  while (isspace((unsigned char)*line)) line++;
  snprintf(c->last, sizeof c->last, "%s", line);
}

// Lines like "  Name:            a.jpg", whatever a newer version puts in front of them.
static const char *value_of(const char *line, const char *key) {
  const char *at = strstr(line, key);
  if (!at) return NULL;
  at += strlen(key);
  return at + strspn(at, " \t");
}

static void hear_photo(vt_colmap *c, const char *line) {
  const char *value;
  if ((value = value_of(line, " Name:"))) c->heard = vt_find_sorted_name((const char *const *)c->names->items, c->names->count, value);
  if (c->heard < 0) return;
  vt_colmap_photo *photo = &c->photos[c->heard];
  int number;
  if ((value = value_of(line, " Camera:")) && sscanf(value, "#%d", &number) == 1) photo->camera = number;
  if ((value = value_of(line, " Features:")) && sscanf(value, "%d", &number) == 1) photo->features = number;
}

void vt_hear_colmap(vt_colmap *c, const char *line) {
  int done = 0, all = 0, row = 0, rows = 0;
  const char *at;
  if ((at = strstr(line, "Processed file [")) && sscanf(at, "Processed file [%d/%d", &done, &all) == 2 && all > 0) {
    c->heard = -1;
    if (c->features_wanted > 0)
      vt_progress(c->context, "features", 0.999 * (c->features_before + done) / c->features_wanted);
  } else if ((at = strstr(line, "Matching block [")) &&
             sscanf(at, "Matching block [%d/%d, %d/%d", &row, &rows, &done, &all) == 4 && all > 0 && rows > 0) {
    vt_progress(c->context, "matching", ((row - 1) * (double)all + done - 1) / ((double)all * rows));
  } else if ((at = strstr(line, "Matching image [")) && sscanf(at, "Matching image [%d/%d", &done, &all) == 2 && all > 0) {
    vt_progress(c->context, "matching", (done - 1.0) / all);
  } else if (strstr(line, "Registering image #")) {
    vt_progress(c->context, "mapping",
                c->registered < c->names->count ? (double)c->registered++ / c->names->count : 0.999);
  }
  hear_photo(c, line);
  keep_last(c, line);
}

static void hear(void *user, const char *line) {
  vt_hear_colmap(user, line);
}

// ---- one command

static void add(arguments *a, ...) { // strings, the last NULL
  va_list list;
  va_start(list, a);
  for (const char *s; (s = va_arg(list, const char *));) {
    VT_ASSERT(a->count + 1 < ARGUMENTS);
    a->items[a->count++] = s;
  }
  va_end(list);
}

static vt_status fail_missing(vt_colmap *c) {
  return vt_fail(
      c->context, VT_MISSING_PROGRAM,
      "%s: this program, which finds the cameras, was not found; install it (apt-get install colmap), name it "
      "with --colmap, or give photographs with cameras (transforms.json or a COLMAP model in sparse/0)",
      c->program);
}

// Runs one command. *exit_code tells how it ended.
static vt_status run(vt_colmap *c, arguments *a, const char *stage, int *exit_code) {
  c->last[0] = 0;
  c->last_is_error = false;
  c->heard = -1;
  if (c->log) {
    for (int i = 0; i < a->count; i++) fprintf(c->log, "%s ", a->items[i]);
    fputc('\n', c->log);
  }
  vt_progress(c->context, stage, 0);
  // posix_spawn takes char *const[] by custom, and writes to none of them
  vt_status status = vt_run_program(c->context, (char *const *)a->items, c->log, hear, c, exit_code);
  if (status == VT_OK || status == VT_CANCELLED) vt_progress(c->context, stage, 1);
  return status == VT_MISSING_PROGRAM ? fail_missing(c) : status;
}

static vt_status run_step(vt_colmap *c, arguments *a, const char *stage, int most_exit_code) {
  int exit_code = 0;
  vt_status status = run(c, a, stage, &exit_code);
  if (status || exit_code <= most_exit_code) return status;
  const char *cure = strstr(c->last, "disk is full") || strstr(c->last, "No space left")
                         ? "; make room on the disk of --cache and run it again, it goes on from there"
                     : exit_code == 137 ? "; it was killed, perhaps for want of memory; give a smaller --max-image-size or "
                                          "close other programs, then run it again, it goes on from there"
                                        : "";
  return vt_fail(c->context, VT_FAILED, "%s %s: ended with code %d: %s%s", c->program, a->items[1], exit_code,
                 c->last[0] ? c->last : "it said nothing; try it by hand on the photographs", cure);
}

static void add_common(vt_colmap *c, arguments *a, const char *database) {
  add(a, "--database_path", database, NULL);
  if (c->seeded) add(a, "--random_seed", c->seed, NULL);
}

// ---- the steps

vt_status vt_probe_colmap(vt_colmap *c) {
  char *const command[] = {(char *)c->program, "feature_extractor", "-h", NULL};
  int exit_code = 0;
  c->help_seen = false;
  vt_status status = vt_run_program(c->context, command, NULL, hear_help, c, &exit_code);
  if (status == VT_MISSING_PROGRAM) return fail_missing(c);
  if (status || c->help_seen) return status;
  return vt_fail(c->context, VT_MISSING_PROGRAM,
                 "%s: this is not COLMAP, or it cannot run here (feature_extractor -h ended with code %d); try it by hand",
                 c->program, exit_code);
}

vt_status vt_extract_features(vt_colmap *c, const vt_colmap_effort *effort, const char *database, const char *list,
                              int group) {
  arguments a = {{0}, 0};
  char size[16], features[16], camera[16];
  int known = 0, count = 0;
  for (int i = 0; i < c->names->count; i++) {
    count += c->photos[i].group == group;
    if (c->photos[i].group == group && c->photos[i].camera > 0) known = c->photos[i].camera;
  }
  snprintf(size, sizeof size, "%d", effort->max_image_size);
  snprintf(features, sizeof features, "%d", MOST_FEATURES);
  snprintf(camera, sizeof camera, "%d", known);
  add(&a, c->program, "feature_extractor", "--image_path", c->images, "--image_list_path", list,
      "--ImageReader.camera_model", "SIMPLE_RADIAL", "--ImageReader.single_camera", "1", "--SiftExtraction.max_num_features",
      features, c->new_size ? "--FeatureExtraction.max_image_size" : "--SiftExtraction.max_image_size", size,
      c->new_options ? "--FeatureExtraction.use_gpu" : "--SiftExtraction.use_gpu", "0",
      c->new_options ? "--FeatureExtraction.num_threads" : "--SiftExtraction.num_threads", c->threads, NULL);
  if (c->masks) add(&a, "--ImageReader.mask_path", c->masks, NULL);
  if (known) add(&a, "--ImageReader.existing_camera_id", camera, NULL);
  if (effort->affine)
    add(&a, "--SiftExtraction.estimate_affine_shape", "1", "--SiftExtraction.domain_size_pooling", "1", NULL);
  add_common(c, &a, database);
  vt_status status = run_step(c, &a, "features", 0);
  c->features_before += count;
  return status;
}

vt_status vt_match_features(vt_colmap *c, const vt_colmap_effort *effort, const char *database) {
  const char *const use_gpu = c->new_options ? "--FeatureMatching.use_gpu" : "--SiftMatching.use_gpu";
  const char *const threads = c->new_options ? "--FeatureMatching.num_threads" : "--SiftMatching.num_threads";
  const char *const guided = c->new_options ? "--FeatureMatching.guided_matching" : "--SiftMatching.guided_matching";
  arguments a = {{0}, 0}, b = {{0}, 0};
  add(&a, c->program, effort->all_pairs ? "exhaustive_matcher" : "sequential_matcher", use_gpu, "0", threads, c->threads,
      NULL);
  if (effort->all_pairs) // blocks are what progress and a later run count in
    add(&a, "--ExhaustiveMatching.block_size", c->names->count <= 100 ? "10" : "25", NULL);
  else
    add(&a, "--SequentialMatching.overlap", effort->transitive ? "20" : "10", NULL);
  if (effort->guided) add(&a, guided, "1", NULL);
  add_common(c, &a, database);
  vt_status status = run_step(c, &a, "matching", 0);
  if (status || !effort->transitive) return status;
  add(&b, c->program, "transitive_matcher", use_gpu, "0", threads, c->threads, NULL);
  if (effort->guided) add(&b, guided, "1", NULL);
  add_common(c, &b, database);
  return run_step(c, &b, "matching", 0);
}

// Versions without database_cleaner keep them, no harm done.
vt_status vt_forget_matches(vt_colmap *c, const char *database) {
  arguments a = {{0}, 0};
  int exit_code = 0;
  add(&a, c->program, "database_cleaner", "--type", "matches", "--database_path", database, NULL);
  return run(c, &a, "matching", &exit_code);
}

vt_status vt_map_photographs(vt_colmap *c, const vt_colmap_effort *effort, const char *database, const char *folder,
                             const char *snapshot, const char *snapshots) {
  arguments a = {{0}, 0};
  int every = c->names->count / 20;
  char frequency[16];
  snprintf(frequency, sizeof frequency, "%d", every < 25 ? 25 : every);
  add(&a, c->program, "mapper", "--image_path", c->images, "--output_path", folder, "--Mapper.min_model_size", "3",
      "--Mapper.num_threads", c->threads, "--Mapper.snapshot_path", snapshots, "--Mapper.snapshot_images_freq", frequency,
      NULL);
  if (snapshot) add(&a, "--input_path", snapshot, NULL);
  if (effort->easier)
    add(&a, "--Mapper.init_min_tri_angle", "4", "--Mapper.init_min_num_inliers", "50",
        "--Mapper.abs_pose_min_num_inliers", "15", NULL);
  add_common(c, &a, database);
  c->registered = 0;
  return run_step(c, &a, "mapping", 1);
}

vt_status vt_filter_model(vt_colmap *c, const char *from, const char *to, double pixels) {
  arguments a = {{0}, 0};
  char most[16];
  snprintf(most, sizeof most, "%g", pixels);
  add(&a, c->program, "point_filtering", "--input_path", from, "--output_path", to, "--max_reproj_error", most, NULL);
  return run_step(c, &a, "adjustment", 0);
}

vt_status vt_adjust_model(vt_colmap *c, const char *from, const char *to) {
  arguments a = {{0}, 0};
  add(&a, c->program, "bundle_adjuster", "--input_path", from, "--output_path", to, NULL);
  return run_step(c, &a, "adjustment", 0);
}
