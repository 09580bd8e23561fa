// test_thin_trees.c - a stem a pixel wide stays in one piece between the cameras, and what counts as thin
// SPDX-License-Identifier: BSD-3-Clause
#include "base/image_outline.h"
#include "octree/octree.h"
#include "reconstruct/reconstruct.h"
#include "reconstruct/thinness.h"
#include "tests/field_checks.h"
#include "tests/unit.h"

enum { CAMERAS = 12, BETWEEN = 6, SIZE = 224, JOINTS = 64 };

// A bent stem two units high with a short twig at every eighth joint; each is a line of so many pixels' width.
typedef struct plant {
  vt_vec3 from[JOINTS + JOINTS / 8], to[JOINTS + JOINTS / 8];
  int count;
} plant;

static vt_vec3 stem_at(double t) { return vt_v3(0.25 * sin(2.2 * t), 0.2 * cos(3.1 * t) - 0.2, 2 * t - 1); }

static plant grow(void) {
  plant p = {.count = 0};
  for (int i = 0; i < JOINTS; i++) {
    p.from[p.count] = stem_at((double)i / JOINTS);
    p.to[p.count++] = stem_at((i + 1.0) / JOINTS);
    if (i % 8 != 4) continue;
    p.from[p.count] = stem_at((double)i / JOINTS);
    p.to[p.count] = vt_add(p.from[p.count], vt_v3(0.12 * cos(2.4 * i), 0.12 * sin(2.4 * i), 0.1));
    p.count++;
  }
  return p;
}

static double distance_to_line(const double a[2], const double b[2], double x, double y) {
  double u = b[0] - a[0], v = b[1] - a[1], length = u * u + v * v;
  double t = length > 0 ? ((x - a[0]) * u + (y - a[1]) * v) / length : 0;
  t = fmin(fmax(t, 0), 1);
  return hypot(x - a[0] - t * u, y - a[1] - t * v);
}

// Alpha is the share of the pixel that a straight edge at the line's border leaves.
static void draw_plant(const plant *p, double width, vt_view *view) {
  for (int i = 0; i < p->count; i++) {
    double a[2], b[2];
    assert_true(vt_project(&view->camera, p->from[i], a) && vt_project(&view->camera, p->to[i], b));
    int left = (int)(fmin(a[0], b[0]) - width - 1), right = (int)(fmax(a[0], b[0]) + width + 2);
    int top = (int)(fmin(a[1], b[1]) - width - 1), bottom = (int)(fmax(a[1], b[1]) + width + 2);
    for (int y = top < 0 ? 0 : top; y < bottom && y < SIZE; y++)
      for (int x = left < 0 ? 0 : left; x < right && x < SIZE; x++) {
        double alpha = fmin(fmax(width / 2 + 0.5 - distance_to_line(a, b, x + 0.5, y + 0.5), 0), fmin(width, 1));
        uint8_t *pixel = view->picture.pixels + 4 * ((size_t)y * SIZE + (size_t)x);
        uint8_t code = (uint8_t)(255 * alpha + 0.5);
        pixel[0] = 120, pixel[1] = 150, pixel[2] = 60;
        pixel[3] = code > pixel[3] ? code : pixel[3];
      }
  }
}

// Cameras on a ring above the plant, thirty degrees apart, and some that judge, in the middle between two.
static void photograph(vt_context *context, double width, vt_views *views) {
  plant p = grow();
  views->count = CAMERAS + BETWEEN;
  views->items = VT_NEW(context, vt_view, CAMERAS + BETWEEN);
  for (int i = 0; i < views->count; i++) {
    vt_view *view = &views->items[i];
    double turn = 2 * VT_PI * (i < CAMERAS ? i : (i - CAMERAS) * 2 + 0.5) / CAMERAS;
    view->name = vt_strdup(context, "view.png");
    view->role = i < CAMERAS ? VT_TRAIN : VT_TEST;
    view->camera = vt_look_at(vt_v3(4.5 * cos(turn), 4.5 * sin(turn), 2), vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.55, SIZE, SIZE);
    assert_int_equal(vt_make_image(context, SIZE, SIZE, 4, &view->picture), VT_OK);
    draw_plant(&p, width, view);
  }
}

static vt_context *make_context(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  return vt_create_context(&desc);
}

typedef struct reached {
  double least, least_by_logarithms; // of the pieces' lengths over the truth's; where ln R is interpolated after all
  double alpha;                      // what is shown over what is there
  int level;
} reached;

// Shortest of the longest pieces from the cameras that judge.
static double judge(vt_context *context, const vt_tree *tree, const vt_views *views, double *alpha) {
  static const float white[3] = {1, 1, 1};
  double least = 2, shown = 0, there = 0;
  for (int i = CAMERAS; i < views->count; i++) {
    vt_outline outline;
    const vt_image *truth = &views->items[i].picture;
    vt_fimage picture = draw_level(context, tree, tree->octree.level_count - 1, 4, &views->items[i].camera);
    assert_int_equal(vt_measure_outline(context, &picture, truth, white, &outline), VT_OK);
    least = fmin(least, outline.reach);
    for (size_t p = 0; p < (size_t)SIZE * SIZE; p++) shown += picture.pixels[4 * p + 3], there += truth->pixels[4 * p + 3] / 255.0;
    vt_free_fimage(context, &picture);
  }
  *alpha = shown / there;
  return least;
}

static reached reconstruct_plant(double width, vt_preset preset) {
  vt_context *context = make_context();
  vt_views views = {0};
  vt_tree tree = {0};
  vt_reconstruct_report report;
  vt_reconstruct_desc desc = vt_default_reconstruct_desc(VT_METHOD_BEST, preset);
  photograph(context, width, &views);
  assert_int_equal(vt_reconstruct(context, &desc, &views, &tree, &report), VT_OK);
  reached out = {.level = report.leaf_level};
  double by_logarithms;
  out.least = judge(context, &tree, &views, &out.alpha);
  for (int v = 0; v < CAMERAS; v++) {
    assert_int_equal(tree.view_textures[out.level].views[v].linear, report.thin_share >= 0.375);
    tree.view_textures[out.level].views[v].linear = false;
  }
  out.least_by_logarithms = judge(context, &tree, &views, &by_logarithms);
  printf("%.2f pixels wide, %.0f %% thin: level %d, longest piece at least %.3f of the truth's, %.3f of the alpha; by logarithms "
         "%.3f, %.3f\n", width, 100 * report.thin_share, out.level, out.least, out.alpha, out.least_by_logarithms, by_logarithms);
  vt_free_tree(context, &tree);
  vt_free_views(context, &views);
  vt_destroy_context(context);
  return out;
}

static void a_stem_a_pixel_wide_stays_in_one_piece_between_its_cameras(void **state) {
  (void)state;
  reached stem = reconstruct_plant(1, VT_PRESET_NORMAL), thinner = reconstruct_plant(0.75, VT_PRESET_NORMAL);
  assert_true(stem.least > 0.95 && stem.alpha > 0.95 && stem.alpha < 1.05);
  assert_true(thinner.least > 0.9 && thinner.alpha > 0.85);
  assert_true(thinner.least_by_logarithms < 0.7);
}

static void a_stem_five_pixels_wide_is_no_thin_tree(void **state) {
  (void)state;
  reached thin = reconstruct_plant(1, VT_PRESET_DRAFT), thick = reconstruct_plant(5, VT_PRESET_DRAFT);
  assert_int_equal(thin.level, thick.level + 1);
  assert_true(thick.least > 0.9);
}

// Columns of 1 to 4 pixels in one picture: those of 1 and 2 are thin. At the frame and beside what is ignored a column may go on.
static void what_a_square_of_three_pixels_enters_is_not_thin(void **state) {
  (void)state;
  vt_context *context = make_context();
  vt_view view = {.role = VT_TRAIN};
  vt_views views = {.count = 1, .items = &view};
  double share;
  assert_int_equal(vt_make_image(context, 40, 24, 4, &view.picture), VT_OK);
  assert_int_equal(vt_measure_thinness(context, &views, &share), VT_OK);
  assert_true(share == 0); // no tree
  for (int y = 0; y < 24; y++)
    for (int width = 1; width <= 4; width++)
      for (int i = 0; i < width; i++) view.picture.pixels[4 * (40 * y + 8 * width + i) + 3] = 200;
  assert_int_equal(vt_measure_thinness(context, &views, &share), VT_OK);
  assert_close(share, 3.0 / 10, 1e-9);
  for (int y = 0; y < 24; y++) view.picture.pixels[4 * (40 * y) + 3] = 200; // cut off by the frame
  assert_int_equal(vt_measure_thinness(context, &views, &share), VT_OK);
  assert_close(share, 4.0 / 11, 1e-9);
  assert_int_equal(vt_make_image(context, 40, 24, 1, &view.ignored), VT_OK);
  for (int y = 0; y < 24; y++)
    for (int x = 18; x < 22; x++) view.ignored.pixels[40 * y + x] = 1; // beside the column of 2
  assert_int_equal(vt_measure_thinness(context, &views, &share), VT_OK);
  assert_close(share, 2.0 / 11, 1e-9);
  vt_free_image(context, &view.picture);
  vt_free_image(context, &view.ignored);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(what_a_square_of_three_pixels_enters_is_not_thin),
      cmocka_unit_test(a_stem_a_pixel_wide_stays_in_one_piece_between_its_cameras),
      cmocka_unit_test(a_stem_five_pixels_wide_is_no_thin_tree),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
