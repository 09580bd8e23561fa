// situation.h - what stands behind the tree: a plain backdrop, the sky, or clutter
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_SITUATION_H
#define VT_CAPTURE_SITUATION_H

#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_situation { VT_SITUATION_CLUTTER, VT_SITUATION_PLAIN, VT_SITUATION_SKY } vt_situation;

typedef struct vt_evidence {
  double plain;      // share of the picture's upper and side borders that one smooth surface explains
  double sky;        // share of the picture that is sky
  double sky_top;    // share of the upper edge that is sky
  double brightness; // of the sky, luma 0..1
  double blue;       // of the sky, blue less red, 0..1
  double ground;     // share of the picture below the horizon
  vt_situation situation;
} vt_evidence;

// What one RGB picture says.
vt_status vt_judge_situation(vt_context *, const vt_image *rgb, vt_evidence *out);
// By vote of up to nine photographs, evenly chosen. `sentence` (at least 256 bytes) says what was seen.
vt_status vt_recognise_situation(vt_context *, const vt_photos *, vt_situation *out, char sentence[256]);

#ifdef __cplusplus
}
#endif
#endif
