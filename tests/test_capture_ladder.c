// test_capture_ladder.c - how the search for cameras tries harder, goes on where it was interrupted, and says what is wrong
// SPDX-License-Identifier: BSD-3-Clause
//
// colmap is played by a script that keeps count of its calls and does what files beside it say. What it needs of the real one
// is in its words: "Name:", "Camera: #1", "Features:".
#ifdef VT_WITH_OPENIMAGEIO
#include "base/cache.h"
#include "base/file.h"
#include "base/folders.h"
#include "base/image_file.h"
#include "capture/colmap_run.h"
#include "capture/match_table.h"
#include "capture/unregistered.h"
#include "tests/unit.h"
#include <sys/stat.h>
#include <unistd.h>

typedef struct stage {
  vt_context *context;
  char folder[64], script[96], images[96], workspace[96];
  vt_names names;
  vt_capture_desc desc;
} stage;

static const char prologue[] =
    "#!/bin/sh\n"
    "here=$(dirname \"$0\")\n"
    "if [ \"$2\" = -h ]; then cat \"$here/help\"; exit 0; fi\n"
    "echo \"$*\" >> \"$here/calls.txt\"\n"
    "command=$1; shift\n"
    "while [ $# -gt 0 ]; do case $1 in --output_path) output=$2;; --image_list_path) list=$2;; --input_path) input=$2;; "
    "--snapshot_path|--Mapper.snapshot_path) snapshots=$2;; --database_path) database=$2;; --SiftExtraction.max_image_size|"
    "--FeatureExtraction.max_image_size) size=$2;; esac; shift; done\n"
    // images.bin of a model of $2 photographs in folder $1: the number, then for each 64 bytes, its name and no points
    "model() { mkdir -p \"$1\"; cp \"$here/model-$2\"/* \"$1/\"; }\n"
    "[ $command = feature_extractor ] && n=0 && while read -r name; do n=$((n+1)); echo \"Processed file [$n/9]\"; "
    "echo \"  Name:            $name\"; echo '  Camera:          #1 - SIMPLE_RADIAL'; "
    "echo \"  Features:        $(cat \"$here/features-$name\" 2>/dev/null || echo 4000)\"; "
    "[ -e \"$here/die-$command\" ] && [ $n -ge 3 ] && kill -9 $$; done < \"$list\"\n"
    "[ -e \"$here/die-$command\" ] && kill -9 $$\n";

static void write_text(const char *folder, const char *name, const char *text, int mode) {
  char path[256];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  fputs(text, file);
  fclose(file);
  assert_int_equal(chmod(path, (mode_t)mode), 0);
}

static void put(FILE *file, const void *bytes, size_t size) {
  assert_int_equal(fwrite(bytes, 1, size, file), size);
}

// A model of the first `count` photographs, all from one camera, with one point that errs by `error` pixels.
static void put_model_named(stage *s, const char *name, int count, double error) {
  char folder[128], path[160];
  snprintf(folder, sizeof folder, "%s/%s", s->folder, name);
  assert_int_equal(mkdir(folder, 0700), 0);
  uint64_t n = 1, size[2] = {8, 6}, many = (uint64_t)count;
  double lens[4] = {10, 4, 3, 0}, pose[7] = {1, 0, 0, 0, 0, 0, 5}, place[4] = {0, 0, 0, error};
  uint32_t one = 1, model = 2; // SIMPLE_RADIAL
  snprintf(path, sizeof path, "%s/cameras.bin", folder);
  FILE *file = fopen(path, "wb");
  put(file, &n, 8), put(file, &one, 4), put(file, &model, 4), put(file, size, 16), put(file, lens, 32);
  fclose(file);
  snprintf(path, sizeof path, "%s/images.bin", folder);
  file = fopen(path, "wb");
  put(file, &many, 8);
  for (uint32_t i = 0; i < (uint32_t)count; i++) {
    uint64_t none = 0;
    uint32_t id = i + 1;
    pose[4] = 0.1 * i;
    put(file, &id, 4), put(file, pose, 56), put(file, &one, 4), put(file, s->names.items[i], strlen(s->names.items[i]) + 1);
    put(file, &none, 8);
  }
  fclose(file);
  snprintf(path, sizeof path, "%s/points3D.bin", folder);
  file = fopen(path, "wb");
  uint8_t rgb[3] = {9, 9, 9};
  uint64_t track = 1;
  uint32_t element[2] = {1, 0};
  put(file, &n, 8), put(file, &n, 8), put(file, place, 24), put(file, rgb, 3), put(file, place + 3, 8), put(file, &track, 8);
  put(file, element, 8);
  fclose(file);
}

static void put_model(stage *s, int count) {
  char name[32];
  snprintf(name, sizeof name, "model-%d", count);
  put_model_named(s, name, count, 0.25);
}

static stage set_stage(const char *body, int photographs, int side) {
  stage s = {0};
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.log_level = VT_LOG_QUIET;
  s.context = vt_create_context(&desc);
  s.desc = vt_default_capture_desc();
  snprintf(s.folder, sizeof s.folder, "/tmp/vt-ladder-XXXXXX");
  assert_non_null(mkdtemp(s.folder));
  snprintf(s.script, sizeof s.script, "%s/colmap", s.folder);
  snprintf(s.images, sizeof s.images, "%s/photos", s.folder);
  snprintf(s.workspace, sizeof s.workspace, "%s/work", s.folder);
  assert_int_equal(mkdir(s.images, 0700), 0);
  assert_int_equal(mkdir(s.workspace, 0700), 0);
  s.names = (vt_names){photographs, VT_NEW(s.context, char *, (size_t)photographs)};
  vt_image picture = {0};
  assert_int_equal(vt_make_image(s.context, side, side * 3 / 4, 3, &picture), VT_OK);
  for (int i = 0; i < picture.width * picture.height * 3; i++)
    picture.pixels[i] = (uint8_t)(i / 3 % picture.width % 20 < 10 ? 60 : 200) ^ (uint8_t)(i / 3 / picture.width % 16 < 8 ? 0 : 40);
  for (int i = 0; i < photographs; i++) {
    char name[16], path[160];
    snprintf(name, sizeof name, "%03d.png", i);
    s.names.items[i] = vt_strdup(s.context, name);
    snprintf(path, sizeof path, "%s/%s", s.images, name);
    if (i == 0) assert_int_equal(vt_write_image(s.context, path, &picture), VT_OK);
    char first[160];
    snprintf(first, sizeof first, "%s/000.png", s.images);
    if (i) assert_int_equal(link(first, path), 0);
  }
  vt_free_image(s.context, &picture);
  char text[6000];
  snprintf(text, sizeof text, "%s%s", prologue, body);
  write_text(s.folder, "colmap", text, 0700);
  write_text(s.folder, "help", "COLMAP 3.8 (Commit Unknown)\n --database_path arg\n --SiftExtraction.use_gpu arg (=1)\n", 0600);
  return s;
}

static void strike(stage *s) {
  vt_free_names(s->context, &s->names);
  assert_true(vt_remove_folder(s->context, s->folder));
  vt_destroy_context(s->context);
}

static vt_status play(stage *s) {
  s->desc.colmap = s->script;
  return vt_run_colmap(s->context, &s->desc, s->images, &s->names, s->workspace);
}

static char *text_of(stage *s, const char *name) { // free with vt_free
  char path[200];
  uint8_t *bytes = NULL;
  size_t size = 0;
  snprintf(path, sizeof path, "%s/%s", s->folder, name);
  if (!vt_is_file(path)) return vt_strdup(s->context, "");
  assert_int_equal(vt_read_file(s->context, path, &bytes, &size), VT_OK);
  return (char *)bytes;
}

static int count_in(const char *text, const char *part) {
  int count = 0;
  for (const char *at = text; (at = strstr(at, part)); at++) count++;
  return count;
}

static int calls_of(stage *s, const char *part) {
  char *text = text_of(s, "calls.txt");
  int count = count_in(text, part);
  vt_free(s->context, text);
  return count;
}

static void shell_in(stage *s, const char *words) {
  char command[400];
  snprintf(command, sizeof command, "cd %s && %s", s->folder, words);
  assert_int_equal(system(command), 0);
}

// ---- the rungs

static void enough_photographs_need_one_attempt(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && model \"$output/0\" 9; exit 0\n", 10, 32);
  put_model(&s, 9);
  assert_int_equal(play(&s), VT_OK); // nine in ten
  assert_int_equal(calls_of(&s, "mapper "), 1);
  assert_int_equal(calls_of(&s, "guided_matching"), 0);
  assert_int_equal(calls_of(&s, "max_image_size 3200"), 1);
  strike(&s);
}

static void fewer_and_fewer_photographs_are_tried_harder_and_harder(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && case $database in *features.db) model \"$output/0\" 4;; *small.db) model "
                      "\"$output/0\" 6;; *) model \"$output/0\" 5;; esac; exit 0\n",
                      10, 1600);
  put_model(&s, 4), put_model(&s, 5), put_model(&s, 6);
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(calls_of(&s, "mapper "), 4);
  assert_int_equal(calls_of(&s, "max_image_size 800"), 1); // half the size
  assert_int_equal(calls_of(&s, "domain_size_pooling 1"), 1);
  assert_int_equal(calls_of(&s, "exhaustive_matcher"), 4);
  assert_int_equal(calls_of(&s, "guided_matching 1"), 3);
  assert_int_equal(calls_of(&s, "init_min_tri_angle 4"), 3);
  assert_int_equal(calls_of(&s, "database_cleaner"), 1); // other features have a database of their own
  char *rungs = text_of(&s, "work/sparse/rungs.txt");
  assert_non_null(strstr(rungs, "the usual way: 4 of 10 photographs, 0.25 px"));
  assert_non_null(strstr(rungs, "half the size: 6 of 10"));
  assert_non_null(strstr(rungs, "affine shape: 5 of 10"));
  vt_free(s.context, rungs);
  char *model = text_of(&s, "work/sparse/0/images.bin");
  assert_int_equal(model[0], 6); // the best of all
  vt_free(s.context, model);
  strike(&s);
}

static void many_photographs_are_matched_with_their_successors_first(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && case $output in *-0) model \"$output/0\" 100;; *) model \"$output/0\" 150;; "
                      "esac; exit 0\n",
                      160, 32);
  put_model(&s, 100), put_model(&s, 150);
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(calls_of(&s, "sequential_matcher"), 1);
  assert_int_equal(calls_of(&s, "exhaustive_matcher"), 1); // 160 are not too many for that
  assert_int_equal(calls_of(&s, "guided"), 0);
  strike(&s);
}

static void newer_versions_have_moved_the_size_too(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && model \"$output/0\" 5; exit 0\n", 5, 32);
  put_model(&s, 5);
  write_text(s.folder, "help", "COLMAP 3.13.0\n --database_path arg\n --FeatureExtraction.use_gpu arg\n"
                               " --FeatureExtraction.max_image_size arg\n", 0600);
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(calls_of(&s, "--FeatureExtraction.max_image_size 3200"), 1);
  assert_int_equal(calls_of(&s, "--SiftExtraction.max_num_features 4096"), 1);
  assert_int_equal(calls_of(&s, "--random_seed"), 0); // this one has none
  strike(&s);
}

static void what_errs_is_taken_out_of_the_model_unless_that_costs_a_photograph(void **state) {
  (void)state;
  stage s = set_stage("[ $command = point_filtering ] && cp \"$here/better\"/* \"$output/\"\n"
                      "[ $command = mapper ] && model \"$output/0\" 6; exit 0\n",
                      6, 32);
  put_model(&s, 6);
  put_model_named(&s, "better", 6, 0.125);
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(calls_of(&s, "point_filtering --input_path"), 2);
  assert_int_equal(calls_of(&s, "bundle_adjuster --input_path"), 1);
  char *rungs = text_of(&s, "work/sparse/rungs.txt");
  assert_non_null(strstr(rungs, "0.25 px, "));
  assert_non_null(strstr(rungs, "0.12 px without what erred by more than 2 px"));
  vt_free(s.context, rungs);
  shell_in(&s, "cmp work/sparse/0/points3D.bin better/points3D.bin && rm -rf better work/* && mkdir -p work");
  put_model_named(&s, "better", 5, 0.125);
  assert_int_equal(play(&s), VT_OK);
  shell_in(&s, "cmp work/sparse/0/points3D.bin model-6/points3D.bin");
  strike(&s);
}

static void what_is_to_be_ignored_gets_no_features(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && model \"$output/0\" 6; exit 0\n", 6, 32);
  put_model(&s, 6);
  char folder[160], path[200];
  vt_image mask = {0};
  snprintf(folder, sizeof folder, "%s/ignore", s.folder);
  snprintf(path, sizeof path, "%s/003.png", folder);
  assert_int_equal(mkdir(folder, 0700), 0);
  assert_int_equal(vt_make_image(s.context, 32, 24, 1, &mask), VT_OK);
  memset(mask.pixels, 255, 32 * 10); // the upper rows
  assert_int_equal(vt_write_image(s.context, path, &mask), VT_OK);
  vt_free_image(s.context, &mask);
  s.desc.ignore = folder;
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(calls_of(&s, "--ImageReader.mask_path"), 1);
  snprintf(path, sizeof path, "%s/masks/003.png.png", s.workspace);
  assert_int_equal(vt_read_mask(s.context, path, &mask), VT_OK);
  assert_true(mask.pixels[0] == 0 && mask.pixels[32 * 23] == 255); // black: no features
  vt_free_image(s.context, &mask);
  strike(&s);
}

static void what_colmap_says_is_shown_as_progress(void **state) {
  (void)state;
  stage s = set_stage("case $command in feature_extractor) sleep 0.15; echo 'Processed file [3/6]';; exhaustive_matcher) sleep 0.15; "
                      "echo 'Matching block [2/2, 1/2]';; mapper) for i in 1 2 3 4; do sleep 0.15; echo \"Registering image #$i "
                      "($i)\"; done; model \"$output/0\" 6;; esac; exit 0\n",
                      6, 32);
  put_model(&s, 6);
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.show_progress = true;
  vt_context *quiet = s.context;
  s.context = vt_create_context(&desc);
  char path[160];
  snprintf(path, sizeof path, "%s/said", s.folder);
  fflush(stderr);
  int before = dup(2);
  assert_non_null(freopen(path, "w", stderr));
  vt_status status = play(&s);
  fflush(stderr);
  dup2(before, 2);
  close(before);
  vt_destroy_context(s.context);
  s.context = quiet;
  assert_int_equal(status, VT_OK);
  char *said = text_of(&s, "said");
  char *features = strstr(said, "features "), *matching = strstr(said, "matching "), *mapping = strstr(said, "mapping ");
  assert_true(features && matching > features && mapping > matching);
  assert_non_null(strstr(features, " 50 %"));
  assert_non_null(strstr(matching, " 50 %"));
  assert_non_null(strstr(mapping, " 50 %")); // three of six
  vt_free(s.context, said);
  strike(&s);
}

// ---- going on

static void features_that_were_interrupted_keep_their_camera(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && model \"$output/0\" 6; exit 0\n", 6, 32);
  put_model(&s, 6);
  write_text(s.folder, "die-feature_extractor", "", 0600);
  assert_int_equal(play(&s), VT_FAILED);
  assert_int_equal(calls_of(&s, "existing_camera_id"), 0);
  vt_clear_error(s.context);
  char path[160];
  snprintf(path, sizeof path, "%s/die-feature_extractor", s.folder);
  remove(path);
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(calls_of(&s, "--ImageReader.existing_camera_id 1"), 1);
  strike(&s);
}

static void attempts_that_are_done_are_not_made_again(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && case $output in *-0) model \"$output/0\" 3;; *) [ -e \"$here/die\" ] && kill -9 "
                      "$$; model \"$output/0\" 6;; esac; exit 0\n",
                      6, 32);
  put_model(&s, 3), put_model(&s, 6);
  write_text(s.folder, "die", "", 0600);
  assert_int_equal(play(&s), VT_FAILED);
  assert_int_equal(calls_of(&s, "mapper "), 2);
  assert_int_equal(calls_of(&s, "database_cleaner"), 1);
  vt_clear_error(s.context);
  char path[160];
  snprintf(path, sizeof path, "%s/die", s.folder);
  remove(path);
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(calls_of(&s, "mapper "), 3);
  assert_int_equal(calls_of(&s, "database_cleaner"), 1); // or the matches of the interrupted attempt would be lost
  strike(&s);
}

static void a_mapping_goes_on_from_its_last_whole_snapshot(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && if [ -n \"$input\" ]; then echo \"$input\" > \"$here/input\"; model \"$output\" 6; "
                      "else model \"$snapshots/0000000001\" 3; model \"$snapshots/0000000002\" 5; model \"$snapshots/0000000003\" "
                      "6; : > \"$snapshots/0000000003/points3D.bin\"; kill -9 $$; fi; exit 0\n",
                      6, 32);
  put_model(&s, 3), put_model(&s, 5), put_model(&s, 6);
  assert_int_equal(play(&s), VT_FAILED);
  vt_clear_error(s.context);
  assert_int_equal(play(&s), VT_OK);
  char *input = text_of(&s, "input");
  assert_non_null(strstr(input, "0000000002")); // the third was cut short
  vt_free(s.context, input);
  char *model = text_of(&s, "work/sparse/0/images.bin");
  assert_int_equal(model[0], 6);
  vt_free(s.context, model);
  strike(&s);
}

static void a_snapshot_that_cannot_be_taken_is_forgotten(void **state) {
  (void)state;
  stage s = set_stage("[ $command = mapper ] && if [ -n \"$input\" ]; then exit 134; elif [ -e \"$here/second\" ]; then model "
                      "\"$output/0\" 6; else : > \"$here/second\"; model \"$snapshots/0000000001\" 3; kill -9 $$; fi; exit 0\n",
                      6, 32);
  put_model(&s, 3), put_model(&s, 6);
  assert_int_equal(play(&s), VT_FAILED);
  vt_clear_error(s.context);
  assert_int_equal(play(&s), VT_OK);
  assert_int_equal(calls_of(&s, "mapper "), 3);
  strike(&s);
}

// ---- what is wrong

static char *left_out(stage *s, const char *name) {
  char *text = text_of(s, "work/sparse/left-out.txt"), *why = vt_find_explanation(s->context, text, name);
  vt_free(s->context, text);
  assert_non_null(why);
  return why;
}

static void expect_reason(stage *s, const char *name, const char *part) {
  char *why = left_out(s, name);
  if (!strstr(why, part)) printf("%s: %s\n", name, why);
  assert_non_null(strstr(why, part));
  vt_free(s->context, why);
}

// 005: few features; 006: nothing in common; 007 and 008: with each other alone; 009: too little; 010: fits nowhere; 011: blurred.
static void photographs_without_a_place_are_told_why(void **state) {
  (void)state;
  if (system("command -v sqlite3 >/dev/null 2>&1")) skip();
  stage s = set_stage(
      "[ $command = exhaustive_matcher ] && sqlite3 \"$database\" < \"$here/pairs.sql\"\n"
      "[ $command = mapper ] && model \"$output/0\" 5; exit 0\n",
      12, 200);
  put_model(&s, 5);
  char sql[4000] = "DROP TABLE IF EXISTS images; DROP TABLE IF EXISTS two_view_geometries; CREATE TABLE images(image_id INTEGER "
                   "PRIMARY KEY, name TEXT, camera_id INTEGER);\n"
                   "CREATE TABLE two_view_geometries(pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER, cols INTEGER);\n",
       line[160];
  for (int i = 0; i < 12; i++) {
    snprintf(line, sizeof line, "INSERT INTO images VALUES(%d,'%03d.png',1);\n", i + 1, i);
    strcat(sql, line);
  }
  static const int pairs[][3] = {{0, 1, 300}, {1, 2, 300}, {2, 3, 300}, {3, 4, 300}, {7, 8, 200}, {4, 9, 22}, {4, 10, 150},
                                 {0, 6, 0}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
    snprintf(line, sizeof line, "INSERT INTO two_view_geometries VALUES(%lld,%d,2);\n",
             2147483647LL * (pairs[i][0] + 1) + pairs[i][1] + 1, pairs[i][2]);
    strcat(sql, line);
  }
  write_text(s.folder, "pairs.sql", sql, 0600);
  write_text(s.folder, "features-005.png", "87", 0600);
  vt_image soft = {0};
  char path[160];
  assert_int_equal(vt_make_image(s.context, 200, 150, 3, &soft), VT_OK);
  for (int i = 0; i < 200 * 150 * 3; i++) soft.pixels[i] = (uint8_t)(128 + 60 * sin(i / 3 % 200 * 0.3));
  snprintf(path, sizeof path, "%s/011.png", s.images);
  remove(path); // a link
  assert_int_equal(vt_write_image(s.context, path, &soft), VT_OK);
  vt_free_image(s.context, &soft);
  assert_int_equal(play(&s), VT_OK);
  expect_reason(&s, "005.png", "too few features (87, the others have 4000)");
  expect_reason(&s, "011.png", "blurred");
  expect_reason(&s, "011.png", "take it again");
  if (vt_can_read_match_tables()) {
    expect_reason(&s, "006.png", "nothing in common");
    expect_reason(&s, "007.png", "it fits to 008.png");
    expect_reason(&s, "009.png", "at most 22 points in common, with 004.png");
    expect_reason(&s, "010.png", "150 points in common with 004.png, but they fit no place");
  }
  strike(&s);
}

static void a_killed_step_and_a_full_disk_are_told_with_the_cure(void **state) {
  (void)state;
  stage s = set_stage("[ $command = exhaustive_matcher ] && { echo 'SQLite error: database or disk is full'; exit 1; }; exit 0\n", 5,
                      32);
  assert_int_equal(play(&s), VT_FAILED);
  assert_non_null(strstr(vt_last_error(s.context), "disk is full"));
  assert_non_null(strstr(vt_last_error(s.context), "make room on the disk"));
  strike(&s);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(enough_photographs_need_one_attempt),
      cmocka_unit_test(fewer_and_fewer_photographs_are_tried_harder_and_harder),
      cmocka_unit_test(many_photographs_are_matched_with_their_successors_first),
      cmocka_unit_test(newer_versions_have_moved_the_size_too),
      cmocka_unit_test(what_errs_is_taken_out_of_the_model_unless_that_costs_a_photograph),
      cmocka_unit_test(what_is_to_be_ignored_gets_no_features),
      cmocka_unit_test(what_colmap_says_is_shown_as_progress),
      cmocka_unit_test(features_that_were_interrupted_keep_their_camera),
      cmocka_unit_test(attempts_that_are_done_are_not_made_again),
      cmocka_unit_test(a_mapping_goes_on_from_its_last_whole_snapshot),
      cmocka_unit_test(a_snapshot_that_cannot_be_taken_is_forgotten),
      cmocka_unit_test(photographs_without_a_place_are_told_why),
      cmocka_unit_test(a_killed_step_and_a_full_disk_are_told_with_the_cure),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
#else
int main(void) {
  return 77;
}
#endif
