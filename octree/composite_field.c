// composite_field.c - a picture of one level that is drawn from its field and view textures
// SPDX-License-Identifier: BSD-3-Clause
//
// Rays of neighbouring pixels are walked in packets; field.c says what stands in the middle of each chord; it is
// composited front to back [Porter & Duff 1984], C += T a c, T *= 1 - a with a = 1 - exp(-s R l), until T is small. A ray
// is sampled a few chords at a time, so that what lies behind a trunk costs nothing but its walk.

#include "octree/composite_field.h"
#include "base/fast_exp.h"

#define BLOCK_EDGE 16 // pixels of a block of work: a packet is one of its rows
#define AT_ONCE 32    // chords sampled together

typedef struct field_picture {
  vt_context *context;
  const vt_octree *octree;
  const vt_camera *camera;
  int level, view_count, blocks_across;
  float least_transmittance;
  vt_walk_path path;
  vt_field_view views[VT_MAX_BLEND_VIEWS];
  vt_chord *chords; // [thread_count][VT_PACKET_RAYS][capacity]
  size_t capacity;
  vt_fimage *out;
} field_picture;

static void composite_ray(const field_picture *p, const vt_ray *ray, const vt_chord *chords, size_t count, float out[4]) {
  float along[AT_ONCE], inside[AT_ONCE][4], value[AT_ONCE][4], log_ratio[AT_ONCE] = {0}, t = 1, sum[3] = {0, 0, 0};
  vt_field_samples samples = {along, inside, value, log_ratio};
  for (size_t first = 0; first < count && t >= p->least_transmittance; first += AT_ONCE) {
    size_t some = count - first < AT_ONCE ? count - first : AT_ONCE;
    vt_sample_field(p->octree, p->level, ray, chords + first, some, &samples);
    if (p->view_count) vt_sample_ratios(p->octree, p->level, ray, p->views, p->view_count, some, &samples);
    for (size_t k = 0; k < some && t >= p->least_transmittance; k++) {
      float ratio = p->view_count ? vt_exp_of_any(log_ratio[k]) : 1;
      float left = vt_exp_of_negative(-value[k][0] * ratio * chords[first + k].length), w = t * (1 - left);
      for (int c = 0; c < 3; c++) sum[c] += w * value[k][c + 1];
      t *= left;
    }
  }
  for (int c = 0; c < 3; c++) out[c] = sum[c];
  out[3] = 1 - t;
}

static void composite_row(const field_picture *p, int left, int y, vt_chord *chords) {
  vt_ray rays[VT_PACKET_RAYS] = {0};
  uint32_t chord_count[VT_PACKET_RAYS];
  int count = p->out->width - left < VT_PACKET_RAYS ? p->out->width - left : VT_PACKET_RAYS;
  for (int i = 0; i < count; i++) rays[i] = vt_camera_ray(p->camera, left + i + 0.5, y + 0.5);
  vt_walk_rays(p->octree, p->level, p->path, rays, count, chords, p->capacity, chord_count);
  float *out = p->out->pixels + 4 * ((size_t)y * (size_t)p->out->width + (size_t)left);
  for (int i = 0; i < count; i++)
    if (chord_count[i]) composite_ray(p, &rays[i], chords + (size_t)i * p->capacity, chord_count[i], out + 4 * i);
}

static void composite_blocks(void *user, size_t begin, size_t end, int worker) {
  const field_picture *p = user;
  vt_chord *chords = p->chords + (size_t)worker * VT_PACKET_RAYS * p->capacity;
  for (size_t block = begin; block < end; block++) {
    int left = (int)(block % (size_t)p->blocks_across) * BLOCK_EDGE;
    int top = (int)(block / (size_t)p->blocks_across) * BLOCK_EDGE;
    if (vt_cancelled(p->context)) return;
    for (int y = top; y < top + BLOCK_EDGE && y < p->out->height; y++) composite_row(p, left, y, chords);
  }
}

vt_status vt_composite_field(vt_context *context, const vt_tree *tree, int level, const vt_view_weights *weights,
                             float least_transmittance, const vt_camera *camera, vt_fimage *out) {
  const vt_view_textures *textures = &tree->view_textures[level];
  field_picture p = {.context = context, .octree = &tree->octree, .camera = camera, .level = level,
                     .least_transmittance = least_transmittance, .path = vt_best_walk_path(), .out = out};
  for (int v = 0; weights && v < weights->count; v++) {
    int view = weights->view[v];
    VT_ASSERT(view >= 0 && view < textures->view_count && weights->weight[v] > 0);
    p.views[p.view_count++] = vt_aim_field_view(p.octree, level, &tree->cameras[view], textures->factor,
                                                &textures->views[view], weights->weight[v]);
  }
  p.capacity = vt_max_segments(&tree->octree.levels[level]);
  p.chords = VT_NEW(context, vt_chord, p.capacity * VT_PACKET_RAYS * (size_t)vt_thread_count(context));
  if (!p.chords) return VT_OUT_OF_MEMORY;
  p.blocks_across = (out->width + BLOCK_EDGE - 1) / BLOCK_EDGE;
  size_t blocks = (size_t)p.blocks_across * (size_t)((out->height + BLOCK_EDGE - 1) / BLOCK_EDGE);
  vt_status status = vt_parallel(context, blocks, 1, composite_blocks, &p);
  vt_free(context, p.chords);
  return status;
}
