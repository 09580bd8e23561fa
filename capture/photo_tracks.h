// photo_tracks.h - a calibration's points as tracks through pinhole pictures
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_PHOTO_TRACKS_H
#define VT_CAPTURE_PHOTO_TRACKS_H

#include "base/tracks.h"
#include "capture/photos.h"

#ifdef __cplusplus
extern "C" {
#endif

// One track for each landmark, with the landmark's own sights, where `cameras` [photographs], the pinhole ones of the pictures as they
// were developed, see them; NaN where a lens has no ray. Empty where the source says no pixels. VT_OUT_OF_MEMORY.
vt_status vt_photo_tracks(vt_context *, const vt_photos *, const vt_camera *cameras, vt_tracks *out);

// Takes photographs out of the landmarks: new_place[photo] is where a photograph stands now, below 0: nowhere.
void vt_renumber_landmarks(vt_landmarks *, const int *new_place);

#ifdef __cplusplus
}
#endif
#endif
