// test_quality.c - small scenes reconstructed, packed, drawn and judged, against the table of what was reached before
// SPDX-License-Identifier: BSD-3-Clause
//
// The whole way in memory, as the program goes it: photographs, raw tree, packed tree, CPU renderer at the finest
// level, metrics of the photographs that were left out (means over them, over white). A row of tests/quality_table.csv
// is one scene by one method at the level that the method chooses itself. Losses fail, gains are said: who makes one
// writes the table anew in the same commit,
//     VT_WRITE_QUALITY_TABLE=FILE test_quality
// so that git shows what each change was worth. Rounding of other compilers and C libraries stays far within the
// limits.
#include "base/file.h"
#include "base/image_metrics.h"
#include "compress/compress.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/reconstruct.h"
#include "render/render.h"
#include "tests/unit.h"

#define MOST_ROWS 32
static const char table_path[] = VT_SOURCE_DIR "/tests/quality_table.csv";
static const char table_head[] =
    "scene,method,level,psnr,psnr_foreground,ssim,alpha_rmse,cells,billboards,packed_bytes\n";

typedef struct row { // cells and billboards: of all levels
  char scene[24], method[8];
  int level;
  vt_metrics mean;
  unsigned long long cells, billboards, packed_bytes;
} row;

typedef struct table {
  size_t count;
  row rows[MOST_ROWS];
} table;

// ---- the table as text

static size_t print_row(char *text, size_t size, const row *r) {
  int length =
      snprintf(text, size, "%s,%s,%d,%.3f,%.3f,%.5f,%.6f,%llu,%llu,%llu\n", r->scene, r->method, r->level, r->mean.psnr,
               r->mean.psnr_foreground, r->mean.ssim, r->mean.alpha_rmse, r->cells, r->billboards, r->packed_bytes);
  assert_true(length > 0 && (size_t)length < size);
  return (size_t)length;
}

static void parse_table(const char *text, table *out) {
  *out = (table){0};
  if (strncmp(text, table_head, strlen(table_head)))
    fail_msg("%s: its first line is not '%s'\n", table_path, table_head);
  for (text += strlen(table_head); *text; text = strchr(text, '\n') + 1) {
    assert_true(out->count < MOST_ROWS && strchr(text, '\n'));
    row *r = &out->rows[out->count++];
    int fields = sscanf(text, "%23[^,],%7[^,],%d,%lf,%lf,%lf,%lf,%llu,%llu,%llu", r->scene, r->method, &r->level,
                        &r->mean.psnr, &r->mean.psnr_foreground, &r->mean.ssim, &r->mean.alpha_rmse, &r->cells,
                        &r->billboards, &r->packed_bytes);
    if (fields != 10) fail_msg("%s: row %zu has %d fields, not 10\n", table_path, out->count, fields);
  }
}

static const row *find_row(const table *t, const char *scene, const char *method) {
  for (size_t i = 0; i < t->count; i++)
    if (!strcmp(t->rows[i].scene, scene) && !strcmp(t->rows[i].method, method)) return &t->rows[i];
  return NULL;
}

// ---- measuring

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

static void judge(vt_context *context, const vt_tree *tree, const vt_views *views, row *out) {
  const float white[3] = {1, 1, 1};
  int count = vt_count_views(views, VT_TEST);
  vt_renderer *renderer;
  vt_render_desc desc = vt_default_render_desc();
  desc.level = out->level;
  assert_int_equal(vt_create_renderer(context, tree, VT_BACKEND_CPU, &renderer), VT_OK);
  for (int i = 0; i < views->count; i++) {
    const vt_view *view = &views->items[i];
    vt_fimage picture;
    vt_metrics m;
    if (view->role != VT_TEST) continue;
    assert_int_equal(vt_render(context, renderer, &desc, &view->camera, &picture, NULL), VT_OK);
    assert_int_equal(vt_measure(context, &picture, &view->picture, white, &m), VT_OK);
    out->mean.psnr += m.psnr / count;
    out->mean.psnr_foreground += m.psnr_foreground / count;
    out->mean.ssim += m.ssim / count;
    out->mean.alpha_rmse += m.alpha_rmse / count;
    vt_free_fimage(context, &picture);
  }
  vt_destroy_renderer(context, renderer);
}

static row measure(vt_context *context, const vt_views *views, const char *scene, vt_method method) {
  static const char *const names[] = {"2004", "2006", "best"};
  vt_reconstruct_desc reconstruction = vt_default_reconstruct_desc(method, VT_PRESET_NORMAL);
  vt_compress_desc packing = vt_default_compress_desc();
  packing.alpha_codewords = 256; // as small as the scenes are, and quick to train
  packing.colour_codewords = 128;
  vt_tree raw, packed;
  row r = {0};
  snprintf(r.scene, sizeof r.scene, "%s", scene);
  snprintf(r.method, sizeof r.method, "%s", names[method]);
  assert_int_equal(vt_reconstruct(context, &reconstruction, views, &raw, NULL), VT_OK);
  assert_int_equal(vt_compress_tree(context, &packing, &raw, &packed, NULL), VT_OK);
  r.level = packed.octree.level_count - 1;
  r.packed_bytes = vt_texture_bytes(&packed);
  for (int l = 0; l <= r.level; l++) {
    r.cells += packed.octree.levels[l].cell_count;
    r.billboards += packed.tiles[l].tile_count;
  }
  judge(context, &packed, views, &r);
  vt_free_tree(context, &packed);
  vt_free_tree(context, &raw);
  return r;
}

static void measure_all(vt_context *context, table *out) {
  static const struct {
    const char *name;
    bool by_all; // methods, or by `best` alone
  } scenes[] = {{"tree_96", true}, {"shell_64", true}, {"blobs_64", true}, {"oak_128", false}, {"pine_128", false}, {"crown_64", false}};
  static const vt_method methods[] = {VT_METHOD_2004, VT_METHOD_2006, VT_METHOD_BEST};
  out->count = 0;
  for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
    vt_synthetic_desc desc;
    vt_views views;
    assert_true(vt_find_scene(scenes[s].name, &desc));
    if (VT_UNIT_SANITIZED && (desc.width > 96 || (s > 0 && scenes[s].by_all))) continue;
    assert_int_equal(vt_make_synthetic_views(context, &desc, &views), VT_OK);
    for (size_t m = scenes[s].by_all ? 0 : 2; m < sizeof methods / sizeof *methods; m++) {
      char text[256];
      double start = vt_seconds();
      out->rows[out->count] = measure(context, &views, scenes[s].name, methods[m]);
      size_t length = print_row(text, sizeof text, &out->rows[out->count++]);
      printf("%.*s in %.1f s\n", (int)length - 1, text, vt_seconds() - start);
    }
    vt_free_views(context, &views);
  }
}

// ---- comparing

static void say_loss(const row *r, const char *what, double before, double now) {
  printf("%s, method %s: %s was %.8g and is %.8g; mend it or, if it is intended, change tests/quality_table.csv in the "
         "same commit\n",
         r->scene, r->method, what, before, now);
}

// Losses of `now` against `before`, said in a sentence each if wanted. Returns their number. What is no number is a
// loss.
static int count_losses(const row *before, const row *now, bool say) {
  const vt_metrics *a = &before->mean, *b = &now->mean;
  bool psnr = !(b->psnr >= a->psnr - 0.1), alpha = !(b->alpha_rmse <= a->alpha_rmse * 1.01 + 1e-4);
  bool bytes = now->packed_bytes * 100 > before->packed_bytes * 101;
  if (say && psnr) say_loss(now, "psnr", a->psnr, b->psnr);
  if (say && alpha) say_loss(now, "alpha_rmse", a->alpha_rmse, b->alpha_rmse);
  if (say && bytes) say_loss(now, "packed_bytes", (double)before->packed_bytes, (double)now->packed_bytes);
  return psnr + alpha + bytes;
}

static void write_table(vt_context *context, const char *path, const table *t) {
  char text[256 * (MOST_ROWS + 1)];
  size_t length = strlen(table_head);
  memcpy(text, table_head, length);
  for (size_t i = 0; i < t->count; i++) length += print_row(text + length, sizeof text - length, &t->rows[i]);
  if (vt_write_file(context, path, text, length)) fail_msg("%s\n", vt_last_error(context));
  printf("written: %s\n", path);
}

static void no_row_is_worse_than_in_the_table(void **state) {
  (void)state;
  vt_context *context = make_context();
  const char *path = getenv("VT_WRITE_QUALITY_TABLE");
  table now, before;
  uint8_t *text;
  size_t size;
  int losses = 0;
  measure_all(context, &now);
  if (path && *path) {
    write_table(context, path, &now);
    vt_destroy_context(context);
    return;
  }
  if (vt_read_file(context, table_path, &text, &size)) fail_msg("%s\n", vt_last_error(context));
  parse_table((const char *)text, &before);
  vt_free(context, text);
  vt_destroy_context(context);
  for (size_t i = 0; i < now.count; i++) {
    const row *r = find_row(&before, now.rows[i].scene, now.rows[i].method);
    if (!r) losses++, printf("%s, method %s: has no row in %s\n", now.rows[i].scene, now.rows[i].method, table_path);
    if (!r) continue;
    losses += count_losses(r, &now.rows[i], true);
    if (count_losses(&now.rows[i], r, false))
      printf("%s, method %s: better than in the table; write it anew so that the gain is kept\n", r->scene, r->method);
  }
  assert_int_equal(losses, 0);
  if (!VT_UNIT_SANITIZED) assert_int_equal(before.count, now.count); // no row that nothing measures, and none twice
}

// The judge is judged: each limit by a value on either side of it.
static void losses_beyond_the_limits_are_found(void **state) {
  (void)state;
  row before = {"scene", "best", 4, {30, 25, 0.9, 0.05, 0, 0}, 1000, 9000, 100000}, now = before;
  assert_int_equal(count_losses(&before, &now, false), 0);
  now.mean.psnr = 29.91, now.mean.alpha_rmse = 0.05055, now.packed_bytes = 100999;
  assert_int_equal(count_losses(&before, &now, false), 0);
  now.mean.psnr = 29.89;
  assert_int_equal(count_losses(&before, &now, false), 1);
  now.mean.alpha_rmse = 0.0507;
  assert_int_equal(count_losses(&before, &now, false), 2);
  now.packed_bytes = 101001;
  assert_int_equal(count_losses(&before, &now, false), 3);
  now = before, now.mean.psnr = NAN, now.mean.alpha_rmse = NAN;
  assert_int_equal(count_losses(&before, &now, false), 2);
}

static void a_written_table_reads_back(void **state) {
  (void)state;
  row r = {"blobs_64", "2004", 3, {31.25, 24.5, 0.91234, 0.012345, 0, 0}, 1234, 56789, 987654321};
  char text[512];
  table back;
  strcpy(text, table_head);
  print_row(text + strlen(text), sizeof text - strlen(text), &r);
  parse_table(text, &back);
  assert_int_equal(back.count, 1);
  const row *found = find_row(&back, "blobs_64", "2004");
  assert_non_null(found);
  assert_null(find_row(&back, "blobs_64", "2006"));
  assert_int_equal(found->level, 3);
  assert_close(found->mean.psnr, 31.25, 1e-12);
  assert_close(found->mean.psnr_foreground, 24.5, 1e-12);
  assert_close(found->mean.ssim, 0.91234, 1e-12);
  assert_close(found->mean.alpha_rmse, 0.012345, 1e-12);
  assert_true(found->cells == 1234 && found->billboards == 56789 && found->packed_bytes == 987654321);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(losses_beyond_the_limits_are_found),
                                     cmocka_unit_test(a_written_table_reads_back),
                                     cmocka_unit_test(no_row_is_worse_than_in_the_table)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
