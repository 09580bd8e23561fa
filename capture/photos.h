// photos.h - the calibrated photographs of a capture, before any picture is read
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_PHOTOS_H
#define VT_CAPTURE_PHOTOS_H

#include "base/views.h"
#include "capture/capture.h"
#include "capture/landmarks.h"
#include "capture/lens.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_photo {
  char *name, *path;        // the view's name; its file; owned
  char *mask, *ignored;     // files, NULL if there are none: what is tree, what is not to be looked at; owned
  vt_role role;             //
  int width, height;        // pixels of the file, turned by `orientation`
  int orientation;          // EXIF turn that the picture needs to agree with its camera, nearly always 1
  int upright;              // EXIF turn that makes the picture upright, as its camera sees it; 1: it is, or nobody knows
  bool has_alpha;           // by the file's header
  vt_lens lens;             // of width x height; width 0: not said by the source, the file's
  vt_mat3 rotation;         // cam_from_world
  vt_vec3 translation;      // cam_from_world
} vt_photo;

typedef struct vt_photos {
  int count, capacity;
  vt_photo *items; // owned
  vt_landmarks landmarks; // seen_by: places in items; none where the source has none
  vt_world world;  // as far as the source says it
} vt_photos;

// A zeroed photograph behind the others; NULL only without memory. Pointers to earlier ones become invalid.
vt_photo *vt_add_photo(vt_context *, vt_photos *, const char *name, const char *path);
void vt_free_photo(vt_context *, vt_photo *);
void vt_free_photos(vt_context *, vt_photos *);

// Reads the header of the file and scales the lens to its size. VT_BAD_INPUT if the file is no picture or has another
// shape than its camera; `where` stands in front of the sentence.
vt_status vt_fit_photo(vt_context *, vt_photo *, const char *where);
// Reads the picture and turns it by `orientation`. VT_BAD_INPUT naming the file, also if it changed since vt_fit_photo.
vt_status vt_read_photo(vt_context *, const vt_photo *, vt_image *out);
// Turns pixels as the EXIF orientations 5..8, which exchange width and height, ask for. In place.
vt_status vt_turn_picture(vt_context *, int orientation, vt_image *picture);
// The pinhole camera of a photograph whose lens is one, else one to be filled by vt_undistort_image.
vt_camera vt_photo_camera(const vt_photo *);

// Adds "name: why" to the report.
vt_status vt_leave_out(vt_context *, vt_capture_report *, const char *name, const char *why);

// a, b and c in one string. NULL only without memory. Free with vt_free.
char *vt_concat(vt_context *, const char *a, const char *b, const char *c);

#ifdef __cplusplus
}
#endif
#endif
