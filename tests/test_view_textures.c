// test_view_textures.c - the ratio between a photograph's matte and the field, pixel by pixel, and the part that is kept
// SPDX-License-Identifier: BSD-3-Clause
//
// A random field photographed by random mattes: every code is compared with a ratio that is computed here in double precision
// from the segments of a walk of its own.
#include "reconstruct/view_textures.h"
#include "tests/field_checks.h"
#include "tests/field_scenes.h"

enum { LEVEL = 3, VIEWS = 4, SIZE = 80, LIMIT = 10 };

typedef struct work {
  vt_context *context;
  vt_tree tree;
  vt_views views;
  vt_reduced_views reduced;
  vt_rays rays;
  vt_view_textures textures;
} work;

// Half of the field is empty. Mattes: nothing left of a slanting line, then anything between nothing and opaque.
static void begin(work *w, int factor, bool all_empty) {
  *w = (work){.context = scene_context(2)};
  w->tree = scene_random_field(w->context, LEVEL, 0.8, VIEWS, 5, true, false);
  vt_level *cells = &w->tree.octree.levels[LEVEL];
  vt_rng rng = vt_seed_rng(6, 2);
  for (uint32_t i = 0; i < cells->cell_count; i++)
    for (int c = 0; c < 8 && cells->z[i] < 3; c++) cells->corner_values[4 * (size_t)cells->corner_of[8 * i + c]] = 0;
  w->views = (vt_views){.count = VIEWS, .items = VT_NEW(w->context, vt_view, VIEWS)};
  for (int v = 0; v < VIEWS; v++) {
    vt_view *view = &w->views.items[v];
    view->name = vt_strdup(w->context, "random");
    w->tree.cameras[v].width = SIZE, w->tree.cameras[v].height = SIZE - 3 * v;
    w->tree.cameras[v].fx /= 2, w->tree.cameras[v].fy /= 2, w->tree.cameras[v].cx /= 2, w->tree.cameras[v].cy /= 2;
    view->camera = w->tree.cameras[v];
    assert_int_equal(vt_make_image(w->context, SIZE, SIZE - 3 * v, 4, &view->picture), VT_OK);
    for (int i = 0; i < SIZE * (SIZE - 3 * v); i++) {
      uint8_t *pixel = view->picture.pixels + 4 * i;
      int x = i % SIZE, y = i / SIZE;
      bool empty = all_empty || x + 2 * y < 40 || x > SIZE - 12 || y > SIZE - 25;
      for (int c = 0; c < 3; c++) pixel[c] = (uint8_t)vt_random(&rng);
      pixel[3] = empty ? 0 : vt_random(&rng) % 9 ? (uint8_t)vt_random(&rng) : 255;
    }
  }
  assert_int_equal(vt_reduce_views(w->context, &w->views, factor, &w->reduced), VT_OK);
  assert_int_equal(vt_collect_rays(w->context, &w->tree.octree, LEVEL, LEVEL, &w->reduced, 1 << 30, &w->rays), VT_OK);
  assert_int_equal(vt_make_view_textures(w->context, &w->rays, LIMIT, false, &w->textures), VT_OK);
}

static void end(work *w) {
  vt_free_view_textures(w->context, &w->textures);
  vt_free_rays(w->context, &w->rays);
  vt_free_reduced_views(w->context, &w->reduced);
  vt_free_views(w->context, &w->views);
  vt_free_tree(w->context, &w->tree);
  vt_destroy_context(w->context);
}

// Optical depth of the field along a ray, each chord taken at its middle.
static double depth_along(const vt_octree *octree, const vt_ray *ray, vt_segment *segments) {
  const vt_level *cells = &octree->levels[LEVEL];
  double tau = 0, edge = vt_cell_edge(octree, LEVEL);
  size_t count = vt_walk_ray(octree, LEVEL, ray, segments);
  for (size_t k = 0; k < count; k++) {
    uint32_t cell = segments[k].cell;
    vt_vec3 p = vt_add(ray->origin, vt_scale(ray->direction, edge * (segments[k].entry + 0.5 * segments[k].length)));
    p = vt_scale(vt_sub(p, octree->origin), 1 / edge);
    double x = p.x - cells->x[cell], y = p.y - cells->y[cell], z = p.z - cells->z[cell], s = 0;
    for (int c = 0; c < 8; c++)
      s += (c & 1 ? x : 1 - x) * (c & 2 ? y : 1 - y) * (c & 4 ? z : 1 - z) *
           cells->corner_values[4 * (size_t)cells->corner_of[8 * (size_t)cell + c]];
    tau += s * segments[k].length;
  }
  return tau;
}

// The code of a pixel; outside of the part that is kept, 0: only what is empty may be left out.
static int code_at(const vt_view_texture *t, int x, int y) {
  x -= t->left, y -= t->top;
  return x < 0 || y < 0 || x >= t->columns || y >= t->rows ? 0 : t->codes[y * t->columns + x];
}

// Where the field has depth, ln R is within half a step of ln(-ln(1 - a) / tau), or at the limit that lies before it; where
// it has none, R is 1; where the matte is empty or shows 1 of 255, the least
// there is.
static void check_codes(int factor) {
  work w;
  int judged[3] = {0};
  double worst = 0, one = -VT_LEAST_LOG_RATIO / VT_LOG_RATIO_STEP;
  begin(&w, factor, false);
  vt_segment *segments = VT_NEW(w.context, vt_segment, vt_max_segments(&w.tree.octree.levels[LEVEL]));
  for (int v = 0; v < VIEWS; v++)
    for (int y = 0; y < w.reduced.pictures[v].height; y++)
      for (int x = 0; x < w.reduced.pictures[v].width; x++) {
        vt_ray ray = vt_camera_ray(&w.reduced.cameras[v], x + 0.5, y + 0.5);
        double a = w.reduced.pictures[v].pixels[4 * (y * w.reduced.pictures[v].width + x) + 3] / 255.0;
        double tau = depth_along(&w.tree.octree, &ray, segments);
        int code = code_at(&w.textures.views[v], x, y), kind = a < 0.004 ? 0 : tau < 1e-7 ? 1 : 2;
        if (kind == 1 || (kind == 2 && tau < 1e-5)) tau = 0; // too thin to be thickened, or about so
        judged[kind]++;
        if (kind == 0) assert_int_equal(code, 0);
        if (kind == 1) assert_close(code, one, 0.51);
        if (kind < 2 || tau < 0.004) continue; // thinner: the limits, tested by pictures
        double most = -log(0.007), matte = fmin(-log(1 - fmin(a, 0.999999)), most), share = fmax(0, (matte - 3) / (most - 3));
        double ratio = log(matte) - (1 - share) * log(tau) - share * log(fmin(tau, most)); // less of what both say "at least"
        double wanted = (fmax(fmin(ratio, log(LIMIT)), VT_LEAST_LOG_RATIO) - VT_LEAST_LOG_RATIO) / VT_LOG_RATIO_STEP;
        worst = fmax(worst, fabs(code - wanted));
      }
  printf("factor %d: %d pixels empty, %d beside the field, %d on it; code off by %.4f steps at worst\n", factor, judged[0],
         judged[1], judged[2], worst);
  assert_true(worst <= 0.51 && judged[0] > 100 && judged[1] > 100 && judged[2] > 500);
  vt_free(w.context, segments);
  end(&w);
}

static void codes_are_right_to_half_a_step(void **state) {
  (void)state;
  check_codes(1);
  check_codes(2);
  check_codes(3); // not a whole number of reduced pixels
}

// No more is kept than what is not empty and a rim around it, except at the picture's own edge.
static void what_is_kept_has_a_rim(void **state) {
  (void)state;
  work w;
  begin(&w, 1, false);
  for (int v = 0; v < VIEWS; v++) {
    const vt_view_texture *t = &w.textures.views[v];
    int rim[4] = {0}, inner[4] = {0}; // not empty, in the outermost line kept and in the next: left, right, top, bottom
    assert_true(t->left >= 0 && t->top >= 0 && t->left + t->columns <= t->width && t->top + t->rows <= t->height);
    for (int y = 0; y < t->rows; y++)
      for (int x = 0; x < t->columns; x++) {
        bool full = t->codes[y * t->columns + x] > 0;
        int from[4] = {x, t->columns - 1 - x, y, t->rows - 1 - y};
        for (int side = 0; side < 4; side++) rim[side] += full && from[side] == 0, inner[side] += full && from[side] == 1;
      }
    bool at_edge[4] = {t->left == 0, t->left + t->columns == t->width, t->top == 0, t->top + t->rows == t->height};
    for (int side = 0; side < 4; side++) {
      assert_true(inner[side] > 0 || (at_edge[side] && rim[side] > 0));
      assert_true(rim[side] == 0 || at_edge[side]);
    }
    assert_true(t->columns < t->width || t->rows < t->height); // something could be cut
  }
  end(&w);
}

static void an_empty_matte_keeps_next_to_nothing_and_shows_next_to_nothing(void **state) {
  (void)state;
  work w;
  begin(&w, 1, true);
  for (int v = 0; v < VIEWS; v++) {
    const vt_view_texture *t = &w.textures.views[v];
    assert_true(t->columns * t->rows >= 1 && t->columns * t->rows <= 9);
    for (int i = 0; i < t->columns * t->rows; i++) assert_int_equal(t->codes[i], 0);
  }
  end(&w);
}

// The picture at a photograph's own camera is its matte, within what the limits allow: R up to 10, 255 of 255 as 0.993.
static void the_own_camera_shows_the_matte_where_the_field_is_thick_enough(void **state) {
  (void)state;
  work w;
  begin(&w, 1, false);
  w.tree.view_textures[LEVEL] = w.textures;
  vt_segment *segments = VT_NEW(w.context, vt_segment, vt_max_segments(&w.tree.octree.levels[LEVEL]));
  double worst = 0;
  for (int v = 0; v < VIEWS; v++) {
    vt_view_weights alone = {.count = 1, .view = {v}, .weight = {1}};
    vt_fimage picture;
    assert_int_equal(vt_composite(w.context, &w.tree, LEVEL, &alone, VT_BLEND_GEOMETRIC, false, &w.tree.cameras[v], &picture), VT_OK);
    for (int y = 0; y < picture.height; y++)
      for (int x = 0; x < picture.width; x++) {
        vt_ray ray = vt_camera_ray(&w.tree.cameras[v], x + 0.5, y + 0.5);
        double a = w.views.items[v].picture.pixels[4 * (y * picture.width + x) + 3] / 255.0;
        double tau = depth_along(&w.tree.octree, &ray, segments), wanted = -log(1 - fmin(a, 0.993));
        if (a == 0 || wanted > 9.5 * tau || wanted < 0.021 * tau) continue;
        double shown = picture.pixels[4 * ((size_t)y * (size_t)picture.width + (size_t)x) + 3];
        if (a < 0.99 && tau < 4.9) worst = fmax(worst, fabs(shown - a));
        assert_true(a < 0.99 || shown > 0.985);
      }
    vt_free_fimage(w.context, &picture);
  }
  printf("own cameras: alpha off by %.5f at worst\n", worst);
  assert_true(worst < 0.0065); // half a step of ln R: at most 0.0153 / e
  vt_free(w.context, segments);
  w.tree.view_textures[LEVEL] = (vt_view_textures){0};
  end(&w);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(codes_are_right_to_half_a_step), cmocka_unit_test(what_is_kept_has_a_rim),
                                     cmocka_unit_test(an_empty_matte_keeps_next_to_nothing_and_shows_next_to_nothing),
                                     cmocka_unit_test(the_own_camera_shows_the_matte_where_the_field_is_thick_enough)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
