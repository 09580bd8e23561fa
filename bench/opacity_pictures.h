// opacity_pictures.h - pictures of a solved opacity to look at: a slice, and where the alpha of a view differs
// SPDX-License-Identifier: BSD-3-Clause
//
// Averages hide fog, ghosts and holes. Written are NAME_slice.png (optical depth of an edge in the upright slice through the
// middle, white: 0, black: 2 or more, blue: no cell), NAME_truth.png and NAME_alpha.png (the first test view's alpha) and
// NAME_difference.png (red: too opaque, blue: too thin, full colour at 0.5).
#ifndef VT_BENCH_OPACITY_PICTURES_H
#define VT_BENCH_OPACITY_PICTURES_H

#include "base/image_file.h"
#include "base/views.h"
#include "octree/octree.h"

#include <math.h>
#include <stdio.h>

static inline vt_status write_and_free(vt_context *context, vt_image *image, const char *folder, const char *name, const char *what) {
  char path[1024];
  snprintf(path, sizeof path, "%s/%s_%s.png", folder, name, what);
  vt_status status = vt_write_image(context, path, image);
  vt_free_image(context, image);
  return status;
}

static inline void put_pixel(vt_image *image, int x, int y, double r, double g, double b) {
  uint8_t *p = image->pixels + 3 * ((size_t)y * (size_t)image->width + (size_t)x);
  const double rgb[3] = {r, g, b};
  for (int c = 0; c < 3; c++) p[c] = (uint8_t)(fmin(fmax(rgb[c], 0), 1) * 255 + 0.5);
}

static inline vt_status write_slice(vt_context *context, const vt_octree *octree, int level, const char *folder, const char *name) {
  const vt_level *cells = &octree->levels[level];
  int side = cells->axis_cells;
  vt_image image = {0};
  vt_status status = vt_make_image(context, side, side, 3, &image);
  for (int z = 0; z < side && !status; z++)
    for (int x = 0; x < side; x++) {
      uint32_t cell = vt_find_cell(cells, octree->branching, x, side / 2, z);
      double grey = cell == VT_NO_CELL ? 0 : 1 - fmin((double)cells->optical_depth[cell] / 2, 1);
      if (cell == VT_NO_CELL)
        put_pixel(&image, x, side - 1 - z, 0.7, 0.8, 1);
      else
        put_pixel(&image, x, side - 1 - z, grey, grey, grey);
    }
  return status ? status : write_and_free(context, &image, folder, name, "slice");
}

static inline vt_status write_view(vt_context *context, const vt_octree *octree, int level, const vt_view *view, const char *folder,
                                   const char *name) {
  vt_fimage picture = {0};
  vt_image images[3] = {{0}, {0}, {0}}; // truth, alpha, difference
  const vt_tree tree = {.octree = *octree};
  int width = view->picture.width, height = view->picture.height;
  vt_status status = vt_composite(context, &tree, level, NULL, VT_BLEND_SUM, true, &view->camera, &picture);
  for (int i = 0; i < 3 && !status; i++) status = vt_make_image(context, width, height, 3, &images[i]);
  for (int y = 0; y < height && !status; y++)
    for (int x = 0; x < width; x++) {
      size_t at = (size_t)y * (size_t)width + (size_t)x;
      double truth = view->picture.pixels[4 * at + 3] / 255.0, alpha = (double)picture.pixels[4 * at + 3], d = 2 * (alpha - truth);
      put_pixel(&images[0], x, y, 1 - truth, 1 - truth, 1 - truth);
      put_pixel(&images[1], x, y, 1 - alpha, 1 - alpha, 1 - alpha);
      put_pixel(&images[2], x, y, 1 + fmin(d, 0), 1 - fabs(d), 1 - fmax(d, 0));
    }
  static const char *const what[3] = {"truth", "alpha", "difference"};
  for (int i = 0; i < 3; i++) {
    if (!status) status = write_and_free(context, &images[i], folder, name, what[i]);
    vt_free_image(context, &images[i]);
  }
  vt_free_fimage(context, &picture);
  return status;
}

static inline vt_status write_opacity_pictures(vt_context *context, const vt_octree *octree, int level, const vt_views *test,
                                               const char *folder, const char *name) {
  vt_status status = write_slice(context, octree, level, folder, name);
  return status || !test->count ? status : write_view(context, octree, level, &test->items[0], folder, name);
}

#endif
