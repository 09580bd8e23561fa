// clutter.h - the tree told from what stands around it, by where it stands
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_CLUTTER_H
#define VT_CAPTURE_CLUTTER_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_clutter_photo {
  vt_lens lens;        // of the reduced picture
  vt_mat3 rotation;    // cam_from_world
  vt_vec3 translation; // cam_from_world
  vt_image picture;    // RGB, reduced
  uint8_t *said;       // [height][width] VT_SAID_... by the user; NULL: nothing in this photograph
  vt_image ignored;    // one channel, not 0 where the picture says nothing; no pixels: all of it counts
  uint8_t *tree;       // [height][width] how surely the pixel is tree, 0..255
  vt_image possible;   // one channel, coarse: whether the other photographs allow a tree there, 0..255; none before the
                       // first vote
} vt_clutter_photo;

typedef struct vt_clutter {
  int count;
  vt_clutter_photo *photos; // owned, in the photographs' order
  vt_vec3 focus;            // world: where the tree is taken to stand
  double radius;            // world units: how far it may reach
} vt_clutter;

// Tells the tree from the rest in all photographs together. scribbles: folder of a user's strokes, or NULL.
// VT_BAD_INPUT naming the file, VT_CANCELLED.
vt_status vt_separate_clutter(vt_context *, const vt_photos *, const char *scribbles, vt_clutter *out);
// Straight RGBA of a photograph at its own size, with soft edges and foreground colours. The caller frees `out_rgba`.
vt_status vt_matte_clutter(vt_context *, const vt_clutter *, int photo, const vt_image *rgb, vt_image *out_rgba);
void vt_free_clutter(vt_context *, vt_clutter *);

// ---- between the files of this stage

// Pixel of the reduced picture; false behind the camera or outside the picture.
bool vt_clutter_project(const vt_clutter_photo *, vt_vec3 world, double pixel[2]);

// Fills focus and radius from the cameras, and from the landmarks where the axes say too little.
vt_status vt_find_clutter_region(vt_context *, const vt_landmarks *, vt_clutter *);
// Every photograph's `possible` from all photographs' `tree`, by a coarse grid over the region.
vt_status vt_vote_clutter(vt_context *, vt_clutter *);

// certainty[landmarks->count]: log odds that a landmark is tree, by place, colour, strokes and (once there) the mattes.
vt_status vt_judge_landmarks(vt_context *, const vt_clutter *, const vt_landmarks *, bool with_mattes, float *log_odds);

// Every photograph's `tree` from the landmarks' log odds, the strokes, and (from the second round on) the last `tree`.
vt_status vt_label_pixels(vt_context *, vt_clutter *, const vt_landmarks *, const float *log_odds, int round);

// steps[height][width]: how much CIELab changes from pixel to pixel around each, on average.
vt_status vt_find_steps(vt_context *, int width, int height, const float *lab, float *steps);
// How surely a pixel lies in an area as smooth as no tree is, 0..1.
float vt_smoothness(const float lab[3], float step);

// tree[height][width] from a first guess: prior 0..1 with confidence, smoothed within edges of the picture. In place.
vt_status vt_walk_labels(vt_context *, int width, int height, const float *lab, const float *prior,
                         const float *confidence, float *tree);

#ifdef __cplusplus
}
#endif
#endif
