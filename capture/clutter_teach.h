// clutter_teach.h - what a drawn photograph knows, carried to where the others see it
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_CLUTTER_TEACH_H
#define VT_CAPTURE_CLUTTER_TEACH_H

#include "capture/clutter.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VT_SAID_WEIGHT 12.0f // of a pixel that the user drew on, beside one that was labelled so
enum { VT_MOST_LESSONS = 4 };

typedef struct vt_sample {
  vt_vec3 world;
  float lab[3], step; // CIELab, and how rough it is there
  float tree, weight; // how surely it is tree, 0..1; pixels
} vt_sample;

typedef struct vt_lesson {
  int teacher; // the drawn photograph
  size_t count;
  vt_sample *samples; // owned; freed with vt_free
} vt_lesson;

// The lesson of a drawn photograph, of what was labelled too where `labelled`. points[point_count]: the landmarks that
// it sees; lab, steps: of its picture.
vt_status vt_make_lesson(vt_context *, const vt_clutter *, int teacher, const vt_landmarks *, const uint32_t *points,
                         size_t point_count, const float *lab, const float *steps, bool labelled, vt_lesson *out);
// The lessons of the photographs taken nearest to `pupil`: places in lessons[count], at most VT_MOST_LESSONS. How many.
int vt_choose_lessons(const vt_clutter *, const vt_lesson *lessons, int count, int pupil, int *chosen);

#ifdef __cplusplus
}
#endif
#endif
