// matte_scenes.h - synthetic trees before backdrops as a camera would see them, with exact alpha
// SPDX-License-Identifier: BSD-3-Clause
//
// A backdrop is laid behind a tree in linear light, where light adds up (or as encoded values); lens, sensor and JPEG
// come after that. Truth is the alpha and the colour of the tree behind the same lens.
#ifndef VT_TESTS_MATTE_SCENES_H
#define VT_TESTS_MATTE_SCENES_H

#include "datasets-synthetic/synthetic.h"

#include <math.h>
#include <string.h>

typedef struct matte_scene {
  vt_synthetic_desc tree;
  vt_backdrop backdrop;
  bool horizon;          // of the sky: in the picture, at 0.84 of its height, else below it
  bool encoded;          // mixed as sRGB values
  vt_damage_desc damage; // blur, noise, JPEG
} matte_scene;

static inline float matte_linear_of(uint8_t v) {
  double s = v / 255.0;
  return (float)(s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4));
}

static inline uint8_t matte_byte_of(double linear) {
  double v = linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
  return (uint8_t)(v <= 0 ? 0 : v >= 1 ? 255 : v * 255 + 0.5);
}

// A copy of the views before their backdrop: the same cameras, tilted until the horizon is where it is wanted, and
// nothing in the pictures.
static inline vt_status make_matte_backdrops(vt_context *context, const matte_scene *a, const vt_views *views, vt_views *out) {
  out->items = VT_NEW(context, vt_view, (size_t)views->count);
  if (!out->items) return VT_OUT_OF_MEMORY;
  out->count = views->count;
  for (int i = 0; i < views->count; i++) {
    const vt_camera *c = &views->items[i].camera;
    vt_vec3 eye = vt_camera_centre(c), away = vt_normalise(vt_v3(-eye.x, -eye.y, 0));
    double rise = ((a->horizon ? 0.84 : 1.4) * c->height - c->cy) / c->fy; // of the axis over the horizon
    vt_view *view = &out->items[i];
    view->camera = vt_look_at(eye, vt_add(eye, vt_v3(away.x, away.y, rise)), vt_v3(0, 0, 1),
                              2 * atan(0.5 * c->height / c->fy), c->width, c->height);
    view->name = vt_strdup(context, "backdrop");
    vt_status status = vt_make_image(context, c->width, c->height, 4, &view->picture);
    if (status) return status;
  }
  vt_synthetic_desc desc = a->tree;
  desc.backdrop = a->backdrop;
  return vt_put_before_backdrop(context, &desc, out);
}

// Lays the tree before its backdrop, in linear light or as encoded values.
static inline void put_before_backdrop(const matte_scene *a, const vt_image *tree, vt_image *backdrop) {
  size_t count = (size_t)tree->width * (size_t)tree->height;
  float linear[256];
  for (int i = 0; i < 256; i++) linear[i] = a->encoded ? (float)i : matte_linear_of((uint8_t)i);
  for (size_t i = 0; i < count; i++) {
    double alpha = tree->pixels[4 * i + 3] / 255.0;
    for (size_t c = 0; c < 3 && alpha > 0; c++) {
      double light = alpha * (double)linear[tree->pixels[4 * i + c]] + (1 - alpha) * (double)linear[backdrop->pixels[4 * i + c]];
      backdrop->pixels[4 * i + c] = a->encoded ? (uint8_t)(light + 0.5) : matte_byte_of(light);
    }
  }
}

// Truth (RGBA, behind the lens) and photographs (opaque RGBA) of a scene. The caller frees both, also on failure.
static inline vt_status make_matte_scene(vt_context *context, const matte_scene *a, vt_views *truth, vt_views *photos) {
  vt_damage_desc lens = vt_default_damage_desc(), sensor = a->damage;
  lens.blur = sensor.blur, sensor.blur = 0;
  vt_status status = vt_make_synthetic_views(context, &a->tree, truth);
  if (!status) status = make_matte_backdrops(context, a, truth, photos);
  if (!status) status = vt_damage_views(context, &lens, truth);
  for (int i = 0; i < truth->count && !status; i++)
    put_before_backdrop(a, &truth->items[i].picture, &photos->items[i].picture);
  return status ? status : vt_damage_views(context, &sensor, photos);
}

static inline vt_status drop_picture_alpha(vt_context *context, const vt_image *rgba, vt_image *out) {
  vt_status status = vt_make_image(context, rgba->width, rgba->height, 3, out);
  size_t count = status ? 0 : (size_t)rgba->width * (size_t)rgba->height;
  for (size_t i = 0; i < count; i++) memcpy(out->pixels + 3 * i, rgba->pixels + 4 * i, 3);
  return status;
}

#endif
