// clutter_scene.h - a small tree among other things, photographed: pictures, truth, cameras and landmarks
// SPDX-License-Identifier: BSD-3-Clause
//
// Leaves are discs that face the camera, drawn into a depth buffer of twice the pictures' size; ground and wall are
// planes with a pattern. Nothing is shared with the code under test but nouns.
#ifndef VT_TESTS_CLUTTER_SCENE_H
#define VT_TESTS_CLUTTER_SCENE_H

#include "base/rng.h"
#include "capture/clutter.h"
#include "tests/capture_folders.h"

enum {
  SCENE_WIDTH = 320,
  SCENE_HEIGHT = 240,
  SCENE_MOST_VIEWS = 12,
  SCENE_TREE = 1,
  SCENE_REST = 2,
  SCENE_NEIGHBOUR = 3
};

typedef struct scene_ball {
  vt_vec3 at;
  double radius;
  uint8_t rgb[3], kind;
} scene_ball;

typedef struct scene {
  int view_count, ball_count, landmark_count;
  bool parallel; // the cameras look in one direction
  scene_ball balls[4000];
  vt_camera cameras[SCENE_MOST_VIEWS];
  vt_image pictures[SCENE_MOST_VIEWS]; // RGB
  float *truth[SCENE_MOST_VIEWS];      // [height][width] alpha
  uint8_t *kinds[SCENE_MOST_VIEWS];    // [height][width] SCENE_...; 0 where a pixel is of several
  float *depth[SCENE_MOST_VIEWS];      // of the large buffer
} scene;

static inline double scene_number(vt_rng *rng, double low, double high) {
  return low + (high - low) * ((double)vt_random(rng) / 4294967296.0);
}

static inline void scene_put(scene *s, vt_vec3 at, double radius, int r, int g, int b, uint8_t kind) {
  s->balls[s->ball_count++] = (scene_ball){at, radius, {(uint8_t)r, (uint8_t)g, (uint8_t)b}, kind};
}

static inline void scene_plant(scene *s, vt_rng *rng, double x, double y, uint8_t kind, int leaves) {
  for (int i = 0; i < 160; i++) {
    double turn = scene_number(rng, 0, 6.28), z = i / 160.0;
    int light = (int)scene_number(rng, -30, 30);
    scene_put(s, vt_v3(x + 0.06 * cos(turn), y + 0.06 * sin(turn), z), 0.045, 105 + light, 80 + light, 55 + light,
              kind);
  }
  for (int i = 0; i < leaves; i++) {
    vt_vec3 p;
    do p = vt_v3(scene_number(rng, -1, 1), scene_number(rng, -1, 1), scene_number(rng, -1, 1));
    while (vt_length(p) > 1);
    int light = (int)scene_number(rng, -35, 35);
    scene_put(s, vt_v3(x + 0.75 * p.x, y + 0.75 * p.y, 1.6 + 0.75 * p.z), 0.05, 60 + light, 125 + light, 50 + light,
              kind);
  }
}

// Sand with flagstones, and a brick wall.
static inline void scene_plane_colour(bool wall, double u, double v, int out[3]) {
  double row = floor(v * 4), joint = fabs(v * 4 - row - 0.5) > 0.44 ||
                                     fabs(u * 2 + 0.5 * fmod(row, 2) - floor(u * 2 + 0.5 * fmod(row, 2)) - 0.5) > 0.47;
  int tone = (int)(12 * sin(7.1 * floor(u * 2 + 0.5 * fmod(row, 2)) + 3.3 * row));
  out[0] = (wall ? 150 : 175) + tone + (joint ? 35 : 0);
  out[1] = (wall ? 110 : 165) + tone + (joint ? 50 : 0);
  out[2] = (wall ? 90 : 150) + tone + (joint ? 60 : 0);
}

static inline void scene_draw_planes(const scene *s, int v, uint8_t *rgb, uint8_t *kinds) {
  int width = 2 * SCENE_WIDTH, height = 2 * SCENE_HEIGHT;
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      vt_ray ray = vt_camera_ray(&s->cameras[v], (x + 0.5) / 2, (y + 0.5) / 2);
      double to_ground = ray.direction.z < -1e-9 ? -ray.origin.z / ray.direction.z : 1e9;
      double to_wall = ray.direction.y > 1e-9 ? (5 - ray.origin.y) / ray.direction.y : 1e9;
      bool wall = to_wall < to_ground;
      vt_vec3 hit = vt_add(ray.origin, vt_scale(ray.direction, wall ? to_wall : to_ground));
      int colour[3] = {170, 190, 215};
      if (fmin(to_wall, to_ground) < 1e8) scene_plane_colour(wall, hit.x, wall ? hit.z : hit.y, colour);
      size_t p = (size_t)(y * width + x);
      for (int c = 0; c < 3; c++) rgb[3 * p + c] = (uint8_t)(colour[c] < 0 ? 0 : colour[c] > 255 ? 255 : colour[c]);
      s->depth[v][p] = (float)vt_dot(vt_sub(hit, ray.origin), vt_camera_forward(&s->cameras[v]));
      kinds[p] = SCENE_REST;
    }
}

static inline void scene_draw_balls(const scene *s, int v, uint8_t *rgb, uint8_t *kinds) {
  int width = 2 * SCENE_WIDTH, height = 2 * SCENE_HEIGHT;
  for (int i = 0; i < s->ball_count; i++) {
    const scene_ball *ball = &s->balls[i];
    double pixel[2], z = vt_to_camera(&s->cameras[v], ball->at).z;
    if (z < 0.1 || !vt_project(&s->cameras[v], ball->at, pixel)) continue;
    double r = 2 * ball->radius * s->cameras[v].fx / z, cx = 2 * pixel[0], cy = 2 * pixel[1];
    for (int y = (int)fmax(0, cy - r); y <= cy + r && y < height; y++)
      for (int x = (int)fmax(0, cx - r); x <= cx + r && x < width; x++) {
        double far = hypot(x + 0.5 - cx, y + 0.5 - cy) / r;
        size_t p = (size_t)(y * width + x);
        if (far > 1 || z > (double)s->depth[v][p]) continue;
        s->depth[v][p] = (float)z;
        kinds[p] = ball->kind;
        for (int c = 0; c < 3; c++) rgb[3 * p + c] = (uint8_t)(ball->rgb[c] * (1 - 0.35 * far * far));
      }
  }
}

static inline void scene_photograph(place *p, scene *s, int v, vt_rng *rng) {
  size_t large = 4 * SCENE_WIDTH * SCENE_HEIGHT;
  uint8_t *rgb = VT_NEW(p->context, uint8_t, 3 * large), *kinds = VT_NEW(p->context, uint8_t, large);
  s->depth[v] = VT_NEW(p->context, float, large);
  s->truth[v] = VT_NEW(p->context, float, large / 4);
  s->kinds[v] = VT_NEW(p->context, uint8_t, large / 4);
  assert_int_equal(vt_make_image(p->context, SCENE_WIDTH, SCENE_HEIGHT, 3, &s->pictures[v]), VT_OK);
  scene_draw_planes(s, v, rgb, kinds);
  scene_draw_balls(s, v, rgb, kinds);
  for (int y = 0; y < SCENE_HEIGHT; y++)
    for (int x = 0; x < SCENE_WIDTH; x++) {
      int sum[3] = {0}, tree = 0, alike = 0;
      for (int k = 0; k < 4; k++) {
        size_t q = (size_t)((2 * y + (k >> 1)) * 2 * SCENE_WIDTH + 2 * x + (k & 1));
        tree += kinds[q] == SCENE_TREE;
        alike += kinds[q] == kinds[(size_t)(4 * y * SCENE_WIDTH + 2 * x)];
        for (int c = 0; c < 3; c++) sum[c] += rgb[3 * q + c];
      }
      size_t at = (size_t)(y * SCENE_WIDTH + x);
      s->truth[v][at] = (float)tree / 4;
      s->kinds[v][at] = alike == 4 ? kinds[(size_t)(4 * y * SCENE_WIDTH + 2 * x)] : 0;
      for (int c = 0; c < 3; c++) {
        int value = sum[c] / 4 + (int)scene_number(rng, -3, 4);
        s->pictures[v].pixels[3 * at + c] = (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
      }
    }
  vt_free(p->context, rgb);
  vt_free(p->context, kinds);
}

// The tree at the origin, stones beside it, a neighbour of the same kind at (beside, behind), ground and wall. The
// cameras stand on an arc of 110 degrees, or in a row and look in one direction.
static inline scene *make_scene(place *p, int view_count, double beside, double behind, bool parallel) {
  scene *s = VT_NEW(p->context, scene, 1);
  vt_rng rng = {7, 11};
  s->view_count = view_count;
  s->parallel = parallel;
  scene_plant(s, &rng, 0, 0, SCENE_TREE, 900);
  scene_plant(s, &rng, beside, behind, SCENE_NEIGHBOUR, 900);
  for (int i = 0; i < 300; i++) {
    int grey = (int)scene_number(&rng, 90, 160);
    scene_put(
        s, vt_v3(-1.6 + scene_number(&rng, -0.4, 0.4), 0.3 + scene_number(&rng, -0.4, 0.4), scene_number(&rng, 0, 0.5)),
        0.08, grey, grey, grey + 5, SCENE_REST);
  }
  for (int v = 0; v < view_count; v++) {
    double share = view_count > 1 ? (double)v / (view_count - 1) - 0.5 : 0, turn = share * 110 * VT_PI / 180;
    vt_vec3 eye = parallel ? vt_v3(1.6 * share, -4.5, 1.3 + 0.3 * (v % 3))
                           : vt_v3(4.5 * sin(turn), -4.5 * cos(turn), 1.4 + 0.3 * (v % 3));
    vt_vec3 target = parallel ? vt_add(eye, vt_v3(0, 1, 0)) : vt_v3(0, 0, 1.15);
    s->cameras[v] = vt_look_at(eye, target, vt_v3(0, 0, 1), 2 * atan(120 / 280.0), SCENE_WIDTH, SCENE_HEIGHT);
    scene_photograph(p, s, v, &rng);
  }
  return s;
}

static inline void free_scene(place *p, scene *s) {
  for (int v = 0; v < s->view_count; v++) {
    vt_free_image(p->context, &s->pictures[v]);
    vt_free(p->context, s->truth[v]);
    vt_free(p->context, s->kinds[v]);
    vt_free(p->context, s->depth[v]);
  }
  vt_free(p->context, s);
}

// ---- what a calibration would say

static inline bool scene_sees(const scene *s, int v, vt_vec3 at, double slack) {
  double pixel[2], z = vt_to_camera(&s->cameras[v], at).z;
  if (!vt_project(&s->cameras[v], at, pixel)) return false;
  int x = (int)(2 * pixel[0]), y = (int)(2 * pixel[1]);
  if (pixel[0] < 0 || pixel[1] < 0 || x >= 2 * SCENE_WIDTH || y >= 2 * SCENE_HEIGHT) return false;
  return z <= (double)s->depth[v][y * 2 * SCENE_WIDTH + x] + slack;
}

// A point becomes a landmark where three photographs see it.
static inline void scene_mark(place *p, const scene *s, vt_vec3 at, double slack, vt_landmarks *out) {
  vt_landmark *point = &out->items[out->count];
  *point = (vt_landmark){at, 0.5f, (uint32_t)out->seen_count, 0};
  for (int v = 0; v < s->view_count; v++)
    if (scene_sees(s, v, at, slack)) out->seen_by[out->seen_count + point->count++] = v;
  (void)p;
  if (point->count < 3) return;
  out->seen_count += point->count;
  out->count++;
}

static inline vt_landmarks scene_landmarks(place *p, const scene *s) {
  vt_rng rng = {3, 5};
  vt_landmarks out = {.items = VT_NEW(p->context, vt_landmark, 4000),
                      .seen_by = VT_NEW(p->context, int, 4000 * SCENE_MOST_VIEWS)};
  for (int i = 0; i < s->ball_count; i++) scene_mark(p, s, s->balls[i].at, 1e-3, &out);
  for (int i = 0; i < 300; i++)
    scene_mark(p, s, vt_v3(floor(scene_number(&rng, -10, 10)) / 2, 5, floor(scene_number(&rng, 0, 12)) / 4), 0.05,
               &out);
  for (int i = 0; i < 300; i++)
    scene_mark(p, s, vt_v3(floor(scene_number(&rng, -8, 8)) / 2, floor(scene_number(&rng, -8, 16)) / 4, 0), 0.05, &out);
  return out;
}

// The photographs as files photo_00.pam, ..., with their cameras and (if asked for) landmarks.
static inline vt_photos scene_photos(place *p, const scene *s, bool landmarks) {
  vt_photos photos = {0};
  for (int v = 0; v < s->view_count; v++) {
    char name[32], file[64];
    snprintf(name, sizeof name, "photo_%02d.pam", v);
    snprintf(file, sizeof file, "images/%s", name);
    put_image(p, file, &s->pictures[v]);
    vt_photo *photo = vt_add_photo(p->context, &photos, name, at(p, file));
    assert_non_null(photo);
    const vt_camera *c = &s->cameras[v];
    photo->width = SCENE_WIDTH, photo->height = SCENE_HEIGHT;
    photo->lens = (vt_lens){.model = VT_LENS_PINHOLE,
                            .width = SCENE_WIDTH,
                            .height = SCENE_HEIGHT,
                            .fx = c->fx,
                            .fy = c->fy,
                            .cx = c->cx,
                            .cy = c->cy};
    photo->rotation = c->rotation;
    photo->translation = c->translation;
  }
  if (landmarks) photos.landmarks = scene_landmarks(p, s);
  return photos;
}

// Strokes as a user would draw them on photograph v: a dozen thick dots on each of the tree, its neighbour and the
// rest.
static inline void scene_draw_strokes(place *p, const scene *s, int v) {
  vt_image strokes = {0};
  vt_rng rng = {(uint64_t)v + 1, 9};
  char file[64];
  int drawn[4] = {0};
  assert_int_equal(vt_make_image(p->context, SCENE_WIDTH, SCENE_HEIGHT, 4, &strokes), VT_OK);
  for (int turn = 0; turn < 20000; turn++) {
    int x = 4 + (int)(vt_random(&rng) % (SCENE_WIDTH - 8)), y = 4 + (int)(vt_random(&rng) % (SCENE_HEIGHT - 8)),
        alike = 0;
    uint8_t kind = s->kinds[v][y * SCENE_WIDTH + x];
    for (int j = -2; j <= 2; j++)
      for (int i = -2; i <= 2; i++) alike += s->kinds[v][(y + j) * SCENE_WIDTH + x + i] == kind;
    if (!kind || alike < 25 || drawn[kind]++ >= 12) continue;
    for (int j = -2; j <= 2; j++)
      for (int i = -2; i <= 2; i++) {
        uint8_t *pixel = strokes.pixels + ((size_t)(y + j) * SCENE_WIDTH + (size_t)(x + i)) * 4;
        pixel[0] = kind == SCENE_TREE ? 0 : 220, pixel[1] = kind == SCENE_TREE ? 200 : 0, pixel[3] = 255;
      }
  }
  snprintf(file, sizeof file, "strokes/photo_%02d.pam", v);
  put_image(p, file, &strokes);
  vt_free_image(p->context, &strokes);
}

#endif
