// test_continuity.c - that neither a slow walk around a tree nor a change of level makes its picture jump
// SPDX-License-Identifier: BSD-3-Clause
//
// Frames of an orbit differ from the ones before them by how the tree turns, all about as much; a blending weight that
// jumps shows as a pair of frames that differ by more. A level stands in for the next finer one from where its texels
// are a pixel: there it must show as much of the tree.
#include "base/image_metrics.h"
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/reconstruct.h"
#include "render/render.h"
#include "tests/field_checks.h"

typedef struct work {
  vt_context *context;
  vt_synthetic_desc desc;
  vt_views views;
  vt_tree tree;
} work;

static void begin(work *w, const char *scene) {
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  *w = (work){.context = vt_create_context(&desc)};
  assert_non_null(w->context);
  assert_true(vt_find_scene(scene, &w->desc));
  assert_int_equal(vt_make_synthetic_views(w->context, &w->desc, &w->views), VT_OK);
  vt_reconstruct_desc how = vt_default_reconstruct_desc(VT_METHOD_BEST, VT_PRESET_NORMAL);
  assert_int_equal(vt_reconstruct(w->context, &how, &w->views, &w->tree, NULL), VT_OK);
}

static void end(work *w) {
  vt_free_tree(w->context, &w->tree);
  vt_free_views(w->context, &w->views);
  vt_destroy_context(w->context);
}

static vt_fimage draw(const work *w, vt_renderer *renderer, int level, const vt_camera *camera) {
  vt_render_desc desc = vt_default_render_desc();
  desc.level = level;
  vt_fimage picture;
  assert_int_equal(vt_render(w->context, renderer, &desc, camera, &picture, NULL), VT_OK);
  return picture;
}

// ---- orbit

// PSNR over white of two pictures of one size.
static double likeness(const vt_fimage *a, const vt_fimage *b) {
  double sum = 0;
  size_t count = (size_t)a->width * (size_t)a->height;
  for (size_t i = 0; i < count; i++)
    for (int c = 0; c < 3; c++) {
      const float *p = a->pixels + 4 * i, *q = b->pixels + 4 * i;
      double e = ((double)p[c] - p[3]) - ((double)q[c] - q[3]);
      sum += e * e;
    }
  return -10 * log10(sum / (3 * (double)count));
}

static int compare_doubles(const void *a, const void *b) {
  double p = *(const double *)a, q = *(const double *)b;
  return p < q ? -1 : p > q;
}

static void no_frame_of_a_slow_orbit_jumps(void **state) {
  (void)state;
  enum { FRAMES = 72 };
  work w;
  double psnr[FRAMES], sorted[FRAMES];
  begin(&w, "tree_96");
  vt_renderer *renderer;
  assert_int_equal(vt_create_renderer(w.context, &w.tree, VT_BACKEND_CPU, &renderer), VT_OK);
  double distance = vt_length(vt_camera_centre(&w.views.items[0].camera));
  vt_fimage before = {0};
  for (int i = 0; i <= FRAMES; i++) { // a degree apart: what turns is small against what a jump would be
    double t = (i - FRAMES / 2) * VT_PI / 180;
    vt_vec3 eye = vt_scale(vt_v3(cos(t) * cos(0.4), sin(t) * cos(0.4), sin(0.4)), distance);
    vt_camera camera = vt_look_at(eye, vt_v3(0, 0, 0), vt_v3(0, 0, 1), w.desc.fov_y, 96, 96);
    vt_fimage picture = draw(&w, renderer, w.tree.octree.level_count - 1, &camera);
    if (i) psnr[i - 1] = likeness(&before, &picture);
    vt_free_fimage(w.context, &before);
    before = picture;
  }
  vt_free_fimage(w.context, &before);
  vt_destroy_renderer(w.context, renderer);
  memcpy(sorted, psnr, sizeof psnr);
  qsort(sorted, FRAMES, sizeof *sorted, compare_doubles);
  printf("an orbit's frames are like those before them by %.2f dB, at worst by %.2f dB\n", sorted[FRAMES / 2], sorted[0]);
  assert_true(sorted[0] >= sorted[FRAMES / 2] - 3);
  end(&w);
}

// ---- levels

// Drawn from where level `level` is chosen, mean alpha of its picture over that of the next finer level's; the mean over
// eight directions. RMSE of the two over white.
static double mass_kept(const work *w, vt_renderer *renderer, int level, double *rmse) {
  enum { DIRECTIONS = 8, SIZE = 96 };
  double ratio = 0, sum = 0, edge = vt_cell_edge(&w->tree.octree, level);
  for (int i = 0; i < DIRECTIONS; i++) {
    double t = 0.3 + 2 * VT_PI * i / DIRECTIONS, mass[2] = {0, 0}, near = vt_length(vt_camera_centre(&w->views.items[0].camera));
    double f = 0.5 * SIZE / tan(0.5 * w->desc.fov_y), distance = fmax(near, 1.2 + edge / w->tree.texel_edge * f);
    vt_vec3 eye = vt_scale(vt_v3(cos(t) * cos(0.3), sin(t) * cos(0.3), sin(0.3)), distance);
    vt_camera camera = vt_look_at(eye, vt_v3(0, 0, 0), vt_v3(0, 0, 1), w->desc.fov_y, SIZE, SIZE);
    vt_fimage picture[2];
    for (int l = 0; l < 2; l++) {
      picture[l] = draw(w, renderer, level + l, &camera);
      for (int p = 0; p < SIZE * SIZE; p++) mass[l] += picture[l].pixels[4 * p + 3];
    }
    sum += pow(10, -likeness(&picture[0], &picture[1]) / 10) / DIRECTIONS;
    ratio += mass[0] / mass[1] / DIRECTIONS;
    for (int l = 0; l < 2; l++) vt_free_fimage(w->context, &picture[l]);
  }
  *rmse = sqrt(sum);
  return ratio;
}

static void a_coarser_level_shows_as_much_of_the_tree(void **state) {
  (void)state;
  static const char *const scenes[] = {"tree_96", "small_oak_128"};
  for (int s = 0; s < 2; s++) {
    work w;
    vt_renderer *renderer;
    begin(&w, scenes[s]);
    assert_int_equal(vt_create_renderer(w.context, &w.tree, VT_BACKEND_CPU, &renderer), VT_OK);
    for (int level = 1; level + 1 < w.tree.octree.level_count; level++) {
      double rmse, ratio = mass_kept(&w, renderer, level, &rmse);
      printf("%s, level %d for %d: %.4f of the opacity, RMSE over white %.4f\n", scenes[s], level, level + 1, ratio, rmse);
    }
    vt_destroy_renderer(w.context, renderer);
    end(&w);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(no_frame_of_a_slow_orbit_jumps),
                                     cmocka_unit_test(a_coarser_level_shows_as_much_of_the_tree)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
