// scenes.h - small synthetic scenes with names, the same ones for tests and bench
// SPDX-License-Identifier: BSD-3-Clause
//
// Small enough that a whole reconstruction takes about a second, large enough that a loss of quality shows. A scene
// never changes under its name: tests/quality_table.csv and the figures of the bench would speak of something else.
#ifndef VT_TESTS_SCENES_H
#define VT_TESTS_SCENES_H

#include "datasets-synthetic/synthetic.h"

#include <string.h>

typedef struct vt_scene {
  const char *name;
  vt_synthetic_kind kind;
  int size, leaf_count;   // pixels of an edge; leaves of the tree
  double peak_extinction; // of phantoms, per unit length
} vt_scene;

// The i-th scene, NULL behind the last one.
static inline const vt_scene *vt_scene_at(size_t i) {
  static const vt_scene scenes[] = {{"tree_96", VT_SYNTHETIC_TREE, 96, 1500, 1},
                                    {"shell_64", VT_SYNTHETIC_SHELL, 64, 0, 2},
                                    {"blobs_64", VT_SYNTHETIC_BLOBS, 64, 0, 4},
                                    {"ball_64", VT_SYNTHETIC_BALL, 64, 0, 2}};
  return i < sizeof scenes / sizeof *scenes ? &scenes[i] : NULL;
}

static inline vt_synthetic_desc vt_scene_desc(const vt_scene *scene) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = scene->kind;
  desc.seed = 1;
  desc.train_count = 16;
  desc.test_count = 4;
  desc.width = desc.height = scene->size;
  desc.supersample = scene->kind == VT_SYNTHETIC_TREE ? 4 : 2;
  desc.leaf_count = scene->leaf_count;
  desc.fov_y = 0.6;
  desc.peak_extinction = scene->peak_extinction;
  return desc;
}

static inline const vt_scene *vt_find_scene(const char *name) { // NULL if there is none of that name
  for (size_t i = 0; vt_scene_at(i); i++)
    if (!strcmp(vt_scene_at(i)->name, name)) return vt_scene_at(i);
  return NULL;
}

#endif
