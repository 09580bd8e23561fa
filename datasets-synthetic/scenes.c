// scenes.c - synthetic scenes with names, the same ones for tests, bench and player
// SPDX-License-Identifier: BSD-3-Clause
//
// A scene never changes under its name. Those whose names end in a number are small enough that a whole reconstruction
// takes about a second, and large enough that a loss of quality shows.

#include "datasets-synthetic/synthetic.h"

#include <string.h>

typedef struct scene {
  const char *name;
  vt_synthetic_kind kind;
  int train_count, test_count, size, supersample, leaf_count;
  double peak_extinction; // of phantoms, per unit length
  vt_light_path light_path;
} scene;

static const scene scenes[] = {{"tree_96", VT_SYNTHETIC_TREE, 16, 4, 96, 4, 1500, 1, VT_RASTERISED},
                               {"shell_64", VT_SYNTHETIC_SHELL, 16, 4, 64, 2, 0, 2, VT_RASTERISED},
                               {"blobs_64", VT_SYNTHETIC_BLOBS, 16, 4, 64, 2, 0, 4, VT_RASTERISED},
                               {"ball_64", VT_SYNTHETIC_BALL, 16, 4, 64, 2, 0, 2, VT_RASTERISED},
                               {"oak", VT_SYNTHETIC_OAK, 48, 12, 400, 4, -1, 1, VT_RAY_TRACED},
                               {"pine", VT_SYNTHETIC_PINE, 48, 12, 400, 4, -1, 1, VT_RAY_TRACED},
                               {"small_oak", VT_SYNTHETIC_SMALL_OAK, 48, 12, 400, 4, -1, 1, VT_RAY_TRACED},
                               {"birch", VT_SYNTHETIC_BIRCH, 48, 12, 400, 4, -1, 1, VT_RAY_TRACED},
                               {"willow", VT_SYNTHETIC_WILLOW, 48, 12, 400, 4, -1, 1, VT_RAY_TRACED},
                               {"oak_128", VT_SYNTHETIC_OAK, 16, 4, 128, 4, 16000, 1, VT_RASTERISED},
                               {"pine_128", VT_SYNTHETIC_PINE, 16, 4, 128, 4, 1200, 1, VT_RASTERISED},
                               {"small_oak_128", VT_SYNTHETIC_SMALL_OAK, 16, 4, 128, 4, 450, 1, VT_RASTERISED},
                               {"birch_128", VT_SYNTHETIC_BIRCH, 16, 4, 128, 4, 4200, 1, VT_RASTERISED},
                               {"willow_128", VT_SYNTHETIC_WILLOW, 16, 4, 128, 4, 6000, 1, VT_RASTERISED},
                               {"comb_64", VT_SYNTHETIC_COMB, 16, 4, 64, 4, 0, 80, VT_RASTERISED},
                               {"crown_64", VT_SYNTHETIC_CROWN, 16, 4, 64, 2, 0, 50, VT_RASTERISED},
                               {"ball_256", VT_SYNTHETIC_BALL, 48, 12, 256, 3, 0, 2, VT_RASTERISED},
                               {"shell_256", VT_SYNTHETIC_SHELL, 48, 12, 256, 3, 0, 2, VT_RASTERISED},
                               {"blobs_256", VT_SYNTHETIC_BLOBS, 48, 12, 256, 3, 0, 4, VT_RASTERISED},
                               {"comb_256", VT_SYNTHETIC_COMB, 48, 12, 256, 3, 0, 80, VT_RASTERISED},
                               {"crown_256", VT_SYNTHETIC_CROWN, 48, 12, 256, 3, 0, 50, VT_RASTERISED}};

const char *vt_scene_name(size_t i) {
  return i < sizeof scenes / sizeof *scenes ? scenes[i].name : NULL;
}

bool vt_find_scene(const char *name, vt_synthetic_desc *out) {
  for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
    const scene *s = &scenes[i];
    if (strcmp(s->name, name)) continue;
    *out = vt_default_synthetic_desc();
    out->kind = s->kind;
    out->train_count = s->train_count, out->test_count = s->test_count;
    out->width = out->height = s->size;
    out->supersample = s->supersample;
    out->leaf_count = s->leaf_count;
    out->peak_extinction = s->peak_extinction;
    out->light_path = s->light_path;
    return true;
  }
  return false;
}
