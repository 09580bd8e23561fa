// capture_folders.h - small capture folders that tests make and remove
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_CAPTURE_FOLDERS_H
#define VT_TESTS_CAPTURE_FOLDERS_H

#include "base/file.h"
#include "base/image_file.h"
#include "capture/capture.h"
#include "base/folders.h"
#include "tests/unit.h"

typedef struct place { // a scratch folder and a context, made and given back by each test
  vt_context *context;
  char *root;
  char path[1024]; // of the last `at`
} place;

static inline place open_place(void) {
  vt_context_desc desc = vt_default_context_desc();
  desc.log_level = VT_LOG_QUIET;
  desc.thread_count = 2;
  place p = {.context = vt_create_context(&desc)};
  assert_non_null(p.context);
  assert_int_equal(vt_make_scratch_folder(p.context, &p.root), VT_OK);
  return p;
}

static inline void close_place(place *p) {
  assert_true(vt_remove_folder(p->context, p->root));
  vt_free(p->context, p->root);
  vt_destroy_context(p->context); // asserts that nothing is left
}

static inline const char *at(place *p, const char *name) {
  snprintf(p->path, sizeof p->path, "%s/%s", p->root, name);
  return p->path;
}

static inline void put_bytes(place *p, const char *name, const void *bytes, size_t size) {
  char folder[1024];
  snprintf(folder, sizeof folder, "%s", at(p, name));
  *strrchr(folder, '/') = 0;
  assert_int_equal(vt_make_folder(p->context, folder), VT_OK);
  assert_int_equal(vt_write_file(p->context, at(p, name), bytes, size), VT_OK);
}

static inline void put_text(place *p, const char *name, const char *text) {
  put_bytes(p, name, text, strlen(text));
}

// Colours that differ everywhere; alpha, if there is any, runs from 0 to 255 over the picture.
static inline vt_image make_picture(place *p, int width, int height, int channels) {
  vt_image image = {0};
  assert_int_equal(vt_make_image(p->context, width, height, channels, &image), VT_OK);
  for (int i = 0; i < width * height; i++)
    for (int c = 0; c < channels; c++)
      image.pixels[i * channels + c] = (uint8_t)(c == 3 ? i * 255 / (width * height - 1) : i * 7 + 50 * c + width);
  return image;
}

static inline void put_image(place *p, const char *name, const vt_image *image) {
  char folder[1024];
  snprintf(folder, sizeof folder, "%s", at(p, name));
  *strrchr(folder, '/') = 0;
  assert_int_equal(vt_make_folder(p->context, folder), VT_OK);
  assert_int_equal(vt_write_image(p->context, at(p, name), image), VT_OK);
}

static inline void put_picture(place *p, const char *name, int width, int height, int channels) {
  vt_image image = make_picture(p, width, height, channels);
  put_image(p, name, &image);
  vt_free_image(p->context, &image);
}

static inline vt_capture_desc desc_of(place *p, const char *name) { // borrows p->path
  vt_capture_desc desc = vt_default_capture_desc();
  desc.source = at(p, name);
  return desc;
}

static inline vt_views load(place *p, const vt_capture_desc *desc, vt_capture_report *report) {
  vt_views views = {0};
  vt_status status = vt_load_views(p->context, desc, &views, report);
  if (status) fail_msg("%d: %s\n", status, vt_last_error(p->context));
  return views;
}

static inline vt_views load_name(place *p, const char *name) {
  char source[1024];
  vt_capture_desc desc = desc_of(p, name);
  snprintf(source, sizeof source, "%s", desc.source);
  desc.source = source;
  return load(p, &desc, NULL);
}

static inline void expect_pixel(const vt_camera *camera, double x, double y, double z, double pixel_x, double pixel_y,
                                double tolerance) {
  double pixel[2];
  assert_true(vt_project(camera, vt_v3(x, y, z), pixel));
  assert_close(pixel[0], pixel_x, tolerance);
  assert_close(pixel[1], pixel_y, tolerance);
}

#endif
