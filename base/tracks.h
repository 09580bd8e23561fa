// tracks.h - points that a calibration found, and where in which photograph it saw them
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_TRACKS_H
#define VT_BASE_TRACKS_H

#include "base/camera.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_sight {
  int view;
  float deviation; // pixels: how surely it was seen there
  float pixel[2];  // of the view's picture, as in vt_camera
} vt_sight;

typedef struct vt_track {
  vt_vec3 place;         // world, as far as it is known; NaN: it is not
  uint32_t first, count; // its sights
} vt_track;

typedef struct vt_tracks {
  size_t count, sight_count;
  vt_track *items;  // owned
  vt_sight *sights; // owned
} vt_tracks;
void vt_free_tracks(vt_context *, vt_tracks *);

// The same tracks for other numbers of views; sights in views whose new number is below 0 are left out. VT_OUT_OF_MEMORY.
vt_status vt_renumber_tracks(vt_context *, const vt_tracks *, int view_count, const int *new_number, vt_tracks *out);

// What of the tracks can be worked with, its places found anew by these cameras: longest first, so many that each view has about
// `most_of_a_view` sights where it has them. Left out: what is no number, behind a camera, in a view that is not there; sights that
// contradict the rest of their track, by several times what is usual among all; tracks that one view alone sees, or all from
// one side. *usual_or_null: how far off all sights are, in their deviations, at least 1: more where the cameras are wrong. VT_OUT_OF_MEMORY.
vt_status vt_choose_tracks(vt_context *, const vt_tracks *, const vt_camera *cameras, int view_count, int most_of_a_view,
                           vt_tracks *out, double *usual_or_null);

// The place that lies best in the photographs that see it, robustly, from *place if that is a number or where their rays meet.
// *error: root mean square distance from the sights, in their deviations, counting each to 2 of them only. False: there is none.
bool vt_settle_track(const vt_camera *cameras, const vt_sight *sights, uint32_t count, vt_vec3 *place, double *error);
// Distance in pixels of a place from where a camera saw it; INFINITY behind the camera.
double vt_sight_distance(const vt_camera *, const vt_sight *, vt_vec3 place);

#ifdef __cplusplus
}
#endif
#endif
