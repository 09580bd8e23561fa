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

static vt_fimage draw(const work *w, vt_renderer *renderer, int level, int k, const vt_camera *camera) {
  vt_render_desc desc = vt_default_render_desc();
  desc.level = level;
  desc.blend_views = k;
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

// Once around, each frame against the one before.
static void orbit(const work *w, int k) {
  enum { FRAMES = 72 };
  double psnr[FRAMES], distance = vt_length(vt_camera_centre(&w->views.items[0].camera));
  vt_renderer *renderer;
  vt_fimage before = {0};
  assert_int_equal(vt_create_renderer(w->context, &w->tree, VT_BACKEND_CPU, &renderer), VT_OK);
  for (int i = 0; i <= FRAMES; i++) {
    double t = 2 * VT_PI * i / FRAMES;
    vt_vec3 eye = vt_scale(vt_v3(cos(t) * cos(0.4), sin(t) * cos(0.4), sin(0.4)), distance);
    vt_camera camera = vt_look_at(eye, vt_v3(0, 0, 0), vt_v3(0, 0, 1), w->desc.fov_y, 96, 96);
    vt_fimage picture = draw(w, renderer, w->tree.octree.level_count - 1, k, &camera);
    if (i) psnr[i - 1] = likeness(&before, &picture);
    vt_free_fimage(w->context, &before);
    before = picture;
  }
  vt_free_fimage(w->context, &before);
  vt_destroy_renderer(w->context, renderer);
  qsort(psnr, FRAMES, sizeof *psnr, compare_doubles);
  printf("an orbit's frames, %d views blended, are like those before them by %.2f dB, at worst by %.2f dB\n", k,
         psnr[FRAMES / 2], psnr[0]);
  assert_true(psnr[0] >= psnr[FRAMES / 2] - 3);
}

static void no_frame_of_a_slow_orbit_jumps(void **state) {
  (void)state;
  work w;
  begin(&w, "tree_96");
  if (!VT_UNIT_SANITIZED) orbit(&w, 2);
  orbit(&w, 4);
  end(&w);
}

// ---- levels

// Mean alpha of a level's picture over that of the next finer level's, means over some views, and the RMSE of the two over
// white. Between photographs: from 24 directions at the distance from where `level` is drawn; else at the photographs' own
// cameras, each with its own texture.
static double mass_kept(const work *w, vt_renderer *renderer, int level, bool between, double *rmse) {
  enum { DIRECTIONS = 24, SIZE = 96 };
  double mass[2] = {0, 0}, sum = 0, near = vt_length(vt_camera_centre(&w->views.items[0].camera));
  double texel = vt_cell_edge(&w->tree.octree, level) / w->tree.texel_edge, f = 0.5 * SIZE / tan(0.5 * w->desc.fov_y);
  double distance = fmax(near, 1.2 + texel * f);
  int count = between ? DIRECTIONS : w->tree.view_count;
  for (int i = 0; i < count; i++) {
    double t = 0.3 + 2 * VT_PI * i / DIRECTIONS, up = 0.15 + 0.3 * (i % 3);
    vt_vec3 eye = vt_scale(vt_v3(cos(t) * cos(up), sin(t) * cos(up), sin(up)), distance);
    vt_camera camera = vt_look_at(eye, vt_v3(0, 0, 0), vt_v3(0, 0, 1), w->desc.fov_y, SIZE, SIZE);
    if (!between) camera = w->tree.cameras[i];
    vt_fimage picture[2];
    for (int l = 0; l < 2; l++) {
      picture[l] = draw(w, renderer, level + l, 4, &camera);
      for (int p = 0; p < camera.width * camera.height; p++) mass[l] += picture[l].pixels[4 * p + 3];
    }
    sum += pow(10, -likeness(&picture[0], &picture[1]) / 10) / count;
    for (int l = 0; l < 2; l++) vt_free_fimage(w->context, &picture[l]);
  }
  *rmse = sqrt(sum);
  return mass[0] / mass[1];
}

// Asked is 1 % between photographs, which level_mass.c sets for its own cameras; from these 24 directions, of which only 16 have a
// photograph within tens of degrees, up to 2.6 % was measured (7.6 % where levels were left as they were fitted). At the
// photographs' own cameras coarse levels are too opaque by what they would lack between them.
static void a_coarser_level_shows_as_much_of_the_tree(void **state) {
  (void)state;
  static const char *const scenes[] = {"tree_96", "small_oak_128"};
  for (int s = 0; s < 2 - VT_UNIT_SANITIZED; s++) {
    work w;
    vt_renderer *renderer;
    begin(&w, scenes[s]);
    assert_int_equal(vt_create_renderer(w.context, &w.tree, VT_BACKEND_CPU, &renderer), VT_OK);
    for (int level = 2; level + 1 < w.tree.octree.level_count; level++) { // cells before that are a quarter of the tree
      double rmse, own = mass_kept(&w, renderer, level, false, &rmse), between = mass_kept(&w, renderer, level, true, &rmse);
      printf("%s, level %d for %d: %.4f of the opacity at the photographs' cameras, %.4f between, RMSE over white there %.4f\n",
             scenes[s], level, level + 1, own, between, rmse);
      assert_close(own, 1, level + 2 == w.tree.octree.level_count ? 0.01 : 0.08);
      assert_close(between, 1, 0.03);
      assert_true(rmse < 0.04);
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
