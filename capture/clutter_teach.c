// clutter_teach.c - what a drawn photograph knows, carried to where the others see it
// SPDX-License-Identifier: BSD-3-Clause
//
// Strokes say what their own photograph's pixels are. A pixel has no depth, but the landmarks around it have: the
// inverse depth of a place in the picture is the mean over the landmarks that the photograph sees, weighted by
// 1/distance^4; without landmarks it is the focus' depth. So every third pixel of a drawn photograph becomes a point in
// the world with a colour and a label, and falls into the bilateral grids of the other photographs (clutter_colours.c).
// Their cells are a twelfth of the picture wide, so the depth need not be good. What goes wrong: beside a border in
// depth the mean is of both sides; a photograph from the other side of the tree sees what stands before the point
// instead.

#include "capture/clutter_teach.h"
#include "capture/scribbles.h"

#include <string.h>

enum { EVERY = 3, BLOCK = 16 }; // pixels between samples; pixels of a cell of the map of depths

// Inverse depths at the centres of blocks.
static void map_depths(const float *seen, size_t count, float otherwise, int columns, int rows, float *map) {
  for (int y = 0; y < rows; y++)
    for (int x = 0; x < columns; x++) {
      float sum = 0, weights = 0;
      for (size_t k = 0; k < count; k++) {
        float dx = seen[3 * k] - ((float)x + 0.5f) * BLOCK, dy = seen[3 * k + 1] - ((float)y + 0.5f) * BLOCK;
        float d = dx * dx + dy * dy + BLOCK * BLOCK / 4.0f, w = 1 / (d * d);
        sum += w * seen[3 * k + 2], weights += w;
      }
      map[y * columns + x] = weights > 0 ? sum / weights : otherwise;
    }
}

// x, y in pixels and inverse depth of the landmarks that the photograph sees.
static size_t list_depths(const vt_clutter_photo *photo, const vt_landmarks *landmarks, const uint32_t *points,
                          size_t count, float *seen) {
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    vt_vec3 at = landmarks->items[points[i]].position;
    double pixel[2], z = vt_add(vt_mul(&photo->rotation, at), photo->translation).z;
    if (!vt_clutter_project(photo, at, pixel)) continue;
    seen[3 * kept] = (float)pixel[0], seen[3 * kept + 1] = (float)pixel[1], seen[3 * kept + 2] = (float)(1 / z);
    kept++;
  }
  return kept;
}

static void take_sample(const vt_clutter_photo *photo, int x, int y, double depth, const float *lab, const float *steps,
                        bool labelled, vt_lesson *out) {
  size_t at = (size_t)y * (size_t)photo->picture.width + (size_t)x;
  double pixel[2] = {x + 0.5, y + 0.5}, ray[2];
  bool said = photo->said[at] != VT_SAID_NOTHING;
  float p = said ? (photo->said[at] == VT_SAID_TREE ? 1 : 0) : (float)photo->tree[at] / 255, sure = fabsf(2 * p - 1);
  if ((!said && (!labelled || sure < 0.4f)) || !vt_lens_unproject(&photo->lens, pixel, ray)) return;
  vt_vec3 in_camera = vt_v3(ray[0] * depth, ray[1] * depth, depth);
  vt_sample *sample = &out->samples[out->count++];
  sample->world = vt_mul_transposed(&photo->rotation, vt_sub(in_camera, photo->translation));
  memcpy(sample->lab, lab + 3 * at, sizeof sample->lab);
  sample->step = steps[at];
  sample->tree = p;
  sample->weight = EVERY * EVERY * (said ? VT_SAID_WEIGHT : sure);
}

vt_status vt_make_lesson(vt_context *context, const vt_clutter *clutter, int teacher, const vt_landmarks *landmarks,
                         const uint32_t *points, size_t point_count, const float *lab, const float *steps,
                         bool labelled, vt_lesson *out) {
  const vt_clutter_photo *photo = &clutter->photos[teacher];
  int width = photo->picture.width, height = photo->picture.height;
  int columns = (width + BLOCK - 1) / BLOCK, rows = (height + BLOCK - 1) / BLOCK;
  double focus = vt_add(vt_mul(&photo->rotation, clutter->focus), photo->translation).z;
  float *seen = VT_NEW(context, float, 3 * point_count + 1),
        *map = VT_NEW(context, float, (size_t)columns *(size_t)rows);
  *out = (vt_lesson){.teacher = teacher};
  out->samples = VT_NEW(context, vt_sample, (size_t)(width / EVERY + 1) * (size_t)(height / EVERY + 1));
  vt_status status = seen && map && out->samples ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) {
    size_t count = list_depths(photo, landmarks, points, point_count, seen);
    map_depths(seen, count, (float)(1 / (focus > 1e-9 ? focus : clutter->radius)), columns, rows, map);
    for (int y = 0; y < height; y += EVERY)
      for (int x = 0; x < width; x += EVERY)
        take_sample(photo, x, y, 1 / (double)map[y / BLOCK * columns + x / BLOCK], lab, steps, labelled, out);
  }
  vt_free(context, seen);
  vt_free(context, map);
  return status;
}

int vt_choose_lessons(const vt_clutter *clutter, const vt_lesson *lessons, int count, int pupil, int *chosen) {
  double distances[VT_MOST_LESSONS];
  int kept = 0;
  const vt_clutter_photo *to = &clutter->photos[pupil];
  vt_vec3 own = vt_mul_transposed(&to->rotation, to->translation);
  for (int i = 0; i < count; i++) {
    const vt_clutter_photo *from = &clutter->photos[lessons[i].teacher];
    double distance = vt_length(vt_sub(own, vt_mul_transposed(&from->rotation, from->translation)));
    int at = kept < VT_MOST_LESSONS ? kept++ : kept - 1;
    if (at == kept - 1 && kept == VT_MOST_LESSONS && i >= VT_MOST_LESSONS && distance >= distances[at]) continue;
    while (at > 0 && distances[at - 1] > distance) distances[at] = distances[at - 1], chosen[at] = chosen[at - 1], at--;
    distances[at] = distance, chosen[at] = i;
  }
  return kept;
}
