// test_composite.c - the CPU compositor against closed forms
// SPDX-License-Identifier: BSD-3-Clause

#include "tests/render_scenes.h"

static const vt_view_weights only_first = {.count = 1, .view = {0}, .weight = {1}};
static const uint16_t one_cell[][3] = {{2, 1, 2}}; // of level 2: [0, .5] x [-.5, 0] x [0, .5]

static double chord_through(const vt_camera *camera, int x, int y, vt_vec3 low, double edge) {
  vt_ray ray = vt_camera_ray(camera, x + 0.5, y + 0.5);
  double enter, leave;
  return scene_slab(&ray, low, edge, &enter, &leave) ? (leave - enter) / edge : 0;
}

// alpha along oblique rays, from outside and from within, textured and flat
static void single_cell_follows_the_closed_form(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_camera own = scene_camera(2.5, -1.5, 1, 64);
  vt_tree tree = scene_tree(context, 2, 1, one_cell, 1, &own, 4);
  scene_paint(&tree, 2, 0, 0, 200, 100, 50, 120);
  tree.octree.levels[2].optical_depth[0] = 1.7f;
  vt_vec3 eyes[] = {{2.5, -1.5, 1}, {-2, 1, 1.7}, {0.2, -0.2, 3}, {0.3, -0.1, 0.2}, {0.3, -0.1, -0.001}};
  int met = 0;
  for (int e = 0; e < 5; e++)
    for (int flat = 0; flat < 2; flat++) {
      vt_camera camera = vt_look_at(eyes[e], vt_v3(0.21, -0.17, 0.3), vt_v3(0, 0.1, 1), 0.7, 61, 47);
      vt_fimage image;
      const vt_view_weights *weights = flat ? NULL : &only_first;
      assert_int_equal(vt_composite(context, &tree, 2, weights, VT_BLEND_SUM, flat, &camera, &image), VT_OK);
      for (int y = 0; y < 47; y++)
        for (int x = 0; x < 61; x++) {
          double chord = chord_through(&camera, x, y, vt_v3(0, -0.5, 0), 0.5);
          double alpha = flat ? 1 - exp(-1.7f * chord) : 1 - pow(1 - 120 / 255.0, chord);
          const float *p = scene_pixel(&image, x, y);
          met += chord > 0.01;
          assert_close(p[3], alpha, 2e-5);
          if (!flat) assert_close(p[0], alpha * 200 / 255, 2e-5);
          if (!flat) assert_close(p[2], alpha * 50 / 255, 2e-5);
        }
      vt_free_fimage(context, &image);
    }
  assert_true(met > 5000);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

// red and green neighbours, seen from all sides and from inside either
static void two_cells_cover_each_other_in_order(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  const uint16_t cells[][3] = {{1, 2, 1}, {2, 2, 1}};
  vt_camera own = scene_camera(0, 3, 0, 64);
  vt_tree tree = scene_tree(context, 2, 2, cells, 1, &own, 4);
  vt_vec3 low[2];
  for (uint32_t i = 0; i < 2; i++) {
    int red = tree.octree.levels[2].x[i] == 1;
    scene_paint(&tree, 2, 0, i, red ? 255 : 0, red ? 0 : 255, 0, 200);
    vt_vec3 c = vt_cell_centre(&tree.octree, 2, i);
    low[red ? 0 : 1] = vt_sub(c, vt_v3(0.25, 0.25, 0.25));
  }
  for (int e = 0; e < 40; e++) {
    double t = e * 0.7, r = e < 30 ? 2.2 : 0.2; // the last ten from within
    vt_vec3 middle = {0, 0.25, -0.25}, eye = vt_add(middle, vt_scale(vt_v3(cos(t), sin(t), 0.9 * sin(2.3 * t)), r));
    vt_camera camera = vt_look_at(eye, vt_add(middle, vt_v3(0.01, 0.02, 0.03)), vt_v3(0.1, 0, 1), 0.9, 40, 40);
    vt_fimage image;
    assert_int_equal(vt_composite(context, &tree, 2, &only_first, VT_BLEND_SUM, false, &camera, &image), VT_OK);
    for (int y = 0; y < 40; y++)
      for (int x = 0; x < 40; x++) {
        vt_ray ray = vt_camera_ray(&camera, x + 0.5, y + 0.5);
        double enter[2] = {0}, leave[2], a[2];
        for (int i = 0; i < 2; i++) {
          bool met = scene_slab(&ray, low[i], 0.5, &enter[i], &leave[i]);
          a[i] = met ? 1 - pow(55 / 255.0, (leave[i] - enter[i]) / 0.5) : 0;
        }
        bool red_first = enter[0] < enter[1];
        double red = a[0] * (red_first ? 1 : 1 - a[1]), green = a[1] * (red_first ? 1 - a[0] : 1);
        assert_close(scene_pixel(&image, x, y)[0], red, 3e-5);
        assert_close(scene_pixel(&image, x, y)[1], green, 3e-5);
      }
    vt_free_fimage(context, &image);
  }
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void opaque_cell_hides_what_is_behind_it(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  const uint16_t cells[][3] = {{0, 0, 0}, {1, 0, 0}};
  vt_camera own = scene_camera(4, -0.5, -0.5, 64);
  vt_tree tree = scene_tree(context, 1, 2, cells, 1, &own, 4);
  scene_paint(&tree, 1, 0, 0, 255, 255, 255, 255);
  scene_paint(&tree, 1, 0, 1, 10, 20, 30, 255);
  vt_camera camera = vt_look_at(vt_v3(4, -0.5, -0.5), vt_v3(0, -0.5, -0.5), vt_v3(0, 0, 1), 0.5, 65, 65);
  vt_fimage image;
  assert_int_equal(vt_composite(context, &tree, 1, &only_first, VT_BLEND_SUM, false, &camera, &image), VT_OK);
  const float *p = scene_pixel(&image, 32, 32), *corner = scene_pixel(&image, 0, 0);
  assert_close(p[3], 1 - pow(0.5 / 255, 2), 1e-5);
  assert_close(p[0], (10 * (1 - 0.5 / 255) + 255 * 0.5 / 255) / 255, 1e-4);
  for (int c = 0; c < 4; c++) assert_true(corner[c] == 0);
  vt_free_fimage(context, &image);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

// red green / blue white, as rows and columns of the photograph
static void tile_is_the_right_way_round_at_its_own_camera(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_camera own = scene_camera(2.5, -1.5, 1, 200);
  own.cx += 13;
  own.fx *= 1.1;
  for (int n = 2; n <= 8; n *= 2) {
    vt_tree tree = scene_tree(context, 2, 1, one_cell, 1, &own, n);
    for (int y = 0; y < n; y++)
      for (int x = 0; x < n; x++) {
        uint8_t *t = scene_texel(&tree, 2, 0, 0, x, y);
        bool right = x >= n / 2, below = y >= n / 2;
        t[0] = right == below ? 255 : 0; // red, white
        t[1] = right ? 255 : 0;          // green, white
        t[2] = below ? 255 : 0;          // blue, white
        t[3] = 255;
      }
    double middle[2];
    assert_true(vt_project(&own, vt_cell_centre(&tree.octree, 2, 0), middle));
    double depth = vt_to_camera(&own, vt_cell_centre(&tree.octree, 2, 0)).z;
    double quarter = 0.25 * 0.5 * tree.tile_side * 0.5 * (own.fx + own.fy) / depth;
    vt_fimage image;
    assert_int_equal(vt_composite(context, &tree, 2, &only_first, VT_BLEND_SUM, false, &own, &image), VT_OK);
    for (int q = 0; q < 4; q++) {
      int x = (int)(middle[0] + (q & 1 ? quarter : -quarter)), y = (int)(middle[1] + (q & 2 ? quarter : -quarter));
      const float *p = scene_pixel(&image, x, y);
      double red = q == 0 || q == 3, green = q & 1 ? 1 : 0, blue = q & 2 ? 1 : 0;
      assert_true(p[3] > 0.9);
      if (n == 2) continue; // texel centres lie exactly there, but pixels do not
      assert_close(p[0] / p[3], red, 0.02);
      assert_close(p[1] / p[3], green, 0.02);
      assert_close(p[2] / p[3], blue, 0.02);
    }
    vt_free_fimage(context, &image);
    vt_free_tree(context, &tree);
  }
  vt_destroy_context(context);
}

// A ramp from texel to texel must come back as a ramp over the photograph's pixels: u, bilinear, at the right place.
static void tile_follows_the_pixels_of_its_photograph(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_camera own = scene_camera(-2, 1.2, 1.5, 301);
  vt_tree tree = scene_tree(context, 2, 1, one_cell, 1, &own, 4);
  for (int y = 0; y < 4; y++)
    for (int x = 0; x < 4; x++) {
      uint8_t *t = scene_texel(&tree, 2, 0, 0, x, y);
      t[0] = (uint8_t)(60 * x), t[1] = (uint8_t)(60 * y), t[3] = 200;
    }
  vt_tile_frame frame = vt_tile_frame_of(&own, vt_cell_centre(&tree.octree, 2, 0), 0.5, tree.tile_side, 4);
  vt_fimage image;
  assert_int_equal(vt_composite(context, &tree, 2, &only_first, VT_BLEND_SUM, false, &own, &image), VT_OK);
  int seen = 0;
  for (int y = 0; y < 301; y++)
    for (int x = 0; x < 301; x++) {
      const float *p = scene_pixel(&image, x, y);
      if (p[3] < 0.02) continue;
      seen++;
      double u = fmin(fmax((x + 0.5 - frame.left) * frame.texel_scale, 0.5), 3.5) - 0.5;
      double v = fmin(fmax((y + 0.5 - frame.top) * frame.texel_scale, 0.5), 3.5) - 0.5;
      assert_close(p[0] / p[3], 60 * u / 255, 1e-3);
      assert_close(p[1] / p[3], 60 * v / 255, 1e-3);
    }
  assert_true(seen > 1000);
  vt_free_fimage(context, &image);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

// The same ramp from elsewhere: found where the pixel's ray meets the plane through the cell's centre that is parallel
// to the picture plane, seen by the photograph's camera; also where that plane is behind an eye within the cell.
static void tile_stands_on_the_plane_that_faces_the_eye(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_camera own = scene_camera(-2, 1.2, 1.5, 301);
  own.fy *= 1.1;
  vt_tree tree = scene_tree(context, 2, 1, one_cell, 1, &own, 4);
  for (int y = 0; y < 4; y++)
    for (int x = 0; x < 4; x++) {
      uint8_t *t = scene_texel(&tree, 2, 0, 0, x, y);
      t[0] = (uint8_t)(60 * x), t[1] = (uint8_t)(60 * y), t[3] = 200;
    }
  vt_vec3 centre = vt_cell_centre(&tree.octree, 2, 0), eyes[] = {{-1, 2, 1}, {2, -1, 0.4}, {0.3, -0.2, 0.3}};
  vt_tile_frame frame = vt_tile_frame_of(&own, centre, 0.5, tree.tile_side, 4);
  int seen = 0;
  for (int e = 0; e < 3; e++) {
    vt_vec3 target = e == 2 ? vt_v3(3, 1, 1) : vt_add(centre, vt_v3(0.1, 0.2, 0.1));
    vt_camera camera = vt_look_at(eyes[e], target, vt_v3(0, 0.2, 1), 0.7, 90, 70);
    vt_vec3 forward = vt_camera_forward(&camera);
    vt_fimage image;
    assert_int_equal(vt_composite(context, &tree, 2, &only_first, VT_BLEND_SUM, false, &camera, &image), VT_OK);
    for (int y = 0; y < 70; y++)
      for (int x = 0; x < 90; x++) {
        const float *p = scene_pixel(&image, x, y);
        if (p[3] < 0.02) continue;
        vt_ray ray = vt_camera_ray(&camera, x + 0.5, y + 0.5);
        double s = vt_dot(forward, vt_sub(centre, ray.origin)) / vt_dot(forward, ray.direction), pixel[2];
        assert_true(vt_project(&own, vt_add(ray.origin, vt_scale(ray.direction, s)), pixel));
        double u = fmin(fmax((pixel[0] - frame.left) * frame.texel_scale, 0.5), 3.5) - 0.5;
        double v = fmin(fmax((pixel[1] - frame.top) * frame.texel_scale, 0.5), 3.5) - 0.5;
        assert_close(p[0] / p[3], 60 * u / 255, 1e-3);
        assert_close(p[1] / p[3], 60 * v / 255, 1e-3);
        seen++;
      }
    vt_free_fimage(context, &image);
  }
  assert_true(seen > 3000);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void views_blend_as_defined_and_missing_tiles_pass_on_their_weight(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_camera cameras[3] = {scene_camera(3, 0, 0, 64), scene_camera(0, 3, 0, 64), scene_camera(2, 2, 1, 64)};
  vt_tree tree = scene_tree(context, 2, 1, one_cell, 3, cameras, 4);
  int alpha[3] = {40, 240, 0}, red[3] = {10, 200, 255};
  for (int v = 0; v < 3; v++) scene_paint(&tree, 2, v, 0, red[v], 0, 0, alpha[v]);
  vt_camera camera = vt_look_at(vt_v3(2, 1, 1), vt_v3(0.25, -0.25, 0.25), vt_v3(0, 0, 1), 0.5, 33, 33);
  double chord = chord_through(&camera, 16, 16, vt_v3(0, -0.5, 0), 0.5), f = 1e-4;
  assert_true(chord > 0.5);
  for (int present = 1; present < 8; present++)
    for (int geometric = 0; geometric < 2; geometric++) {
      vt_view_weights weights = {.count = 3, .view = {0, 1, 2}, .weight = {0.5f, 0.3f, 0.2f}};
      double total = 0, sum = 0, sum_red = 0, logs = 0, depths = 0, depths_red = 0;
      for (int v = 0; v < 3; v++) {
        tree.tiles[2].tile_of[v] = present >> v & 1 ? (uint32_t)v : VT_NO_TILE;
        if (!(present >> v & 1)) continue;
        double w = weights.weight[v], s = -log(1 - alpha[v] / 255.0), a = 1 - exp(-s * chord);
        total += w;
        sum += w * a;
        sum_red += w * a * red[v] / 255;
        logs += w * log(s + f);
        depths += w * s;
        depths_red += w * s * red[v] / 255;
      }
      double a = geometric ? 1 - exp(-(exp(logs / total) - f) * chord) : sum / total;
      double r = geometric ? (depths > 0 ? a * depths_red / depths : 0) : sum_red / total;
      vt_fimage image;
      assert_int_equal(vt_composite(context, &tree, 2, &weights, geometric ? VT_BLEND_GEOMETRIC : VT_BLEND_SUM, false,
                                    &camera, &image), VT_OK);
      assert_close(scene_pixel(&image, 16, 16)[3], a, 1e-5);
      assert_close(scene_pixel(&image, 16, 16)[0], r, 1e-5);
      vt_free_fimage(context, &image);
    }
  for (int v = 0; v < 3; v++) tree.tiles[2].tile_of[v] = VT_NO_TILE;
  vt_fimage image;
  vt_view_weights weights = {.count = 3, .view = {0, 1, 2}, .weight = {0.5f, 0.3f, 0.2f}};
  assert_int_equal(vt_composite(context, &tree, 2, &weights, VT_BLEND_SUM, false, &camera, &image), VT_OK);
  assert_true(scene_pixel(&image, 16, 16)[3] == 0);
  vt_free_fimage(context, &image);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void draw_random(int threads, int pack, vt_blend blend, bool flat, vt_fimage *out) {
  vt_context *context = scene_context(threads);
  vt_tree tree = scene_random_tree(context, 4, 0.3, 5, 4, 7);
  if (pack) scene_pack(context, &tree, 4);
  vt_view_weights weights = {.count = 3, .view = {4, 0, 2}, .weight = {0.5f, 0.3f, 0.2f}};
  vt_camera camera = vt_look_at(vt_v3(1.5, 0.7, 0.6), vt_v3(0, 0.1, 0), vt_v3(0, 0, 1), 0.9, 101, 83);
  vt_fimage image;
  assert_int_equal(vt_composite(context, &tree, 4, &weights, blend, flat, &camera, &image), VT_OK);
  *out = image;
  out->pixels = malloc(sizeof(float) * 4 * 101 * 83);
  memcpy(out->pixels, image.pixels, sizeof(float) * 4 * 101 * 83);
  vt_free_fimage(context, &image);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void number_of_threads_changes_no_bit_and_packing_without_loss_neither(void **state) {
  (void)state;
  for (int mode = 0; mode < 3; mode++) {
    vt_fimage first, other;
    vt_blend blend = mode == 1 ? VT_BLEND_GEOMETRIC : VT_BLEND_SUM;
    draw_random(1, 0, blend, mode == 2, &first);
    double sum = 0;
    for (int i = 0; i < 101 * 83; i++) sum += first.pixels[4 * i + 3];
    assert_true(sum > 1000);
    for (int threads = 2; threads <= 3; threads++) {
      draw_random(threads, threads == 3, blend, mode == 2, &other);
      assert_memory_equal(first.pixels, other.pixels, sizeof(float) * 4 * 101 * 83);
      free(other.pixels);
    }
    free(first.pixels);
  }
}

static void scaled_and_shifted_scenes_agree(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  double scales[] = {1, 1e-6, 1e6, 1, 1e-6};
  vt_vec3 shifts[] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {1e5, -2e5, 1.2e5}, {0.1, 0.2, -0.1}}; // about 10^6 cells
  vt_view_weights weights = {.count = 2, .view = {1, 2}, .weight = {0.6f, 0.4f}};
  vt_fimage first = {0};
  for (int i = 0; i < 5; i++) {
    vt_tree tree = scene_random_tree(context, 4, 0.3, 3, 4, 11);
    scene_move(&tree, scales[i], shifts[i]);
    vt_camera camera = vt_look_at(vt_v3(1.9, 0.71, 0.63), vt_v3(0, 0.1, 0), vt_v3(0, 0, 1), 0.7, 90, 90);
    scene_move_camera(&camera, scales[i], shifts[i]);
    vt_fimage image;
    assert_int_equal(vt_composite(context, &tree, 4, &weights, VT_BLEND_SUM, false, &camera, &image), VT_OK);
    if (i) {
      double largest, mean = scene_difference(&first, &image, &largest);
      assert_true(mean < 1e-5);
      assert_true(largest < 1e-3);
      vt_free_fimage(context, &image);
    } else {
      first = image;
    }
    vt_free_tree(context, &tree);
  }
  vt_free_fimage(context, &first);
  vt_destroy_context(context);
}

// from outside, so close that most cells are out of the picture, and from within
static void skipping_work_changes_no_pixel(void **state) {
  (void)state;
  vt_context *context = scene_context(2);
  vt_tree tree = scene_random_tree(context, 4, 0.3, 3, 4, 11);
  vt_view_weights weights = {.count = 2, .view = {1, 2}, .weight = {0.6f, 0.4f}};
  vt_vec3 eyes[] = {{1.9, 0.71, 0.63}, {1.1, -0.2, 0.3}, {0.1, 0.2, -0.1}};
  for (int e = 0; e < 3; e++) {
    vt_camera camera = vt_look_at(eyes[e], vt_v3(0, 0.1, 0), vt_v3(0, 0, 1), e == 1 ? 0.2 : 0.9, 70, 50);
    camera.cx -= e == 1 ? 90 : 0; // its axis outside the picture, as in one that was cut out
    vt_fimage all, some;
    vt_blend blend = VT_BLEND_GEOMETRIC;
    assert_int_equal(vt_composite_skipping(context, &tree, 4, &weights, blend, false, 0, &camera, &all), VT_OK);
    double shown = 0, largest = 0;
    for (int i = 0; i < 70 * 50; i++) shown += all.pixels[4 * i + 3];
    assert_true(shown > 50);
    unsigned outside = VT_SKIP_OUTSIDE;
    assert_int_equal(vt_composite_skipping(context, &tree, 4, &weights, blend, false, outside, &camera, &some), VT_OK);
    assert_memory_equal(all.pixels, some.pixels, sizeof(float) * 4 * 70 * 50);
    vt_free_fimage(context, &some);
    assert_int_equal(vt_composite(context, &tree, 4, &weights, blend, false, &camera, &some), VT_OK);
    scene_difference(&all, &some, &largest);
    assert_true(largest <= 1e-4);
    vt_free_fimage(context, &some);
    vt_free_fimage(context, &all);
  }
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

static void tree_without_textures_is_drawn_flat_and_else_shows_nothing(void **state) {
  (void)state;
  vt_context *context = scene_context(1);
  vt_tree tree = scene_tree(context, 2, 1, one_cell, 0, NULL, 4);
  tree.octree.levels[2].optical_depth[0] = 50;
  vt_camera camera = vt_look_at(vt_v3(2, 1, 1), vt_v3(0.25, -0.25, 0.25), vt_v3(0, 0, 1), 0.5, 33, 33);
  vt_view_weights none = {0};
  vt_fimage image;
  assert_int_equal(vt_composite(context, &tree, 2, NULL, VT_BLEND_SUM, true, &camera, &image), VT_OK);
  assert_close(scene_pixel(&image, 16, 16)[3], 1, 1e-6);
  vt_free_fimage(context, &image);
  assert_int_equal(vt_composite(context, &tree, 2, &none, VT_BLEND_SUM, false, &camera, &image), VT_OK);
  assert_true(scene_pixel(&image, 16, 16)[3] == 0);
  vt_free_fimage(context, &image);
  vt_cancel(context);
  assert_int_equal(vt_composite(context, &tree, 2, NULL, VT_BLEND_SUM, true, &camera, &image), VT_CANCELLED);
  assert_null(image.pixels);
  vt_free_tree(context, &tree);
  vt_destroy_context(context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(single_cell_follows_the_closed_form),
      cmocka_unit_test(two_cells_cover_each_other_in_order),
      cmocka_unit_test(opaque_cell_hides_what_is_behind_it),
      cmocka_unit_test(tile_is_the_right_way_round_at_its_own_camera),
      cmocka_unit_test(tile_follows_the_pixels_of_its_photograph),
      cmocka_unit_test(tile_stands_on_the_plane_that_faces_the_eye),
      cmocka_unit_test(views_blend_as_defined_and_missing_tiles_pass_on_their_weight),
      cmocka_unit_test(number_of_threads_changes_no_bit_and_packing_without_loss_neither),
      cmocka_unit_test(scaled_and_shifted_scenes_agree),
      cmocka_unit_test(skipping_work_changes_no_pixel),
      cmocka_unit_test(tree_without_textures_is_drawn_flat_and_else_shows_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
