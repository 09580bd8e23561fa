// damage_bench.h - photographs to damage, and how they are measured
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_DAMAGE_BENCH_H
#define VT_TESTS_DAMAGE_BENCH_H

#include "datasets-synthetic/synthetic.h"
#include "tests/unit.h"

static inline vt_context *open_context(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads, desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

// Views of one size, with cameras around the origin.
static inline vt_views make_views(vt_context *context, int count, int width, int height) {
  vt_views views = {.count = count, .items = VT_NEW(context, vt_view, count)};
  assert_non_null(views.items);
  for (int i = 0; i < count; i++) {
    vt_view *view = &views.items[i];
    double angle = 2 * VT_PI * i / count;
    view->camera =
        vt_look_at(vt_v3(3 * cos(angle), 3 * sin(angle), 1), vt_v3(0, 0, 0), vt_v3(0, 0, 1), 0.7, width, height);
    assert_int_equal(vt_make_image(context, width, height, 4, &view->picture), VT_OK);
    view->name = vt_strdup(context, "a.png");
  }
  return views;
}

static inline void fill(vt_image *picture, int r, int g, int b, int a) {
  for (int i = 0; i < picture->width * picture->height; i++) {
    uint8_t *p = picture->pixels + 4 * i;
    p[0] = (uint8_t)r, p[1] = (uint8_t)g, p[2] = (uint8_t)b, p[3] = (uint8_t)a;
  }
}

static inline double linear(int byte) {
  double v = byte / 255.0;
  return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static inline void damage(vt_context *context, const vt_damage_desc *desc, vt_views *views) {
  vt_status status = vt_damage_views(context, desc, views);
  if (status) fail_msg("%s", vt_last_error(context));
}

static inline double covered(const vt_image *picture) {
  double sum = 0;
  for (int i = 0; i < picture->width * picture->height; i++) sum += picture->pixels[4 * i + 3] / 255.0;
  return sum;
}

// A soft disc of one colour.
static inline void draw_disc(vt_image *picture, double radius) {
  for (int y = 0; y < picture->height; y++)
    for (int x = 0; x < picture->width; x++) {
      double d = hypot(x + 0.5 - picture->width / 2.0, y + 0.5 - picture->height / 2.0);
      double a = fmin(fmax(radius + 0.5 - d, 0), 1);
      uint8_t *p = picture->pixels + 4 * (y * picture->width + x);
      p[3] = (uint8_t)(255 * a + 0.5);
      p[0] = p[3] ? 200 : 0, p[1] = p[3] ? 120 : 0, p[2] = p[3] ? 40 : 0;
    }
}

#endif
