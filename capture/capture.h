// capture.h - from what a user has to calibrated, matted views
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_CAPTURE_H
#define VT_CAPTURE_CAPTURE_H

#include "base/views.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_matte_mode {
  VT_MATTE_AUTO,     // alpha if the pictures have it, else masks if there are any, else backdrop
  VT_MATTE_ALPHA,    // the pictures' alpha channel
  VT_MATTE_MASKS,    // mask files: mask_path, masks/a.jpg.png, masks/a.png, a.mask.png, a_mask.png
  VT_MATTE_BACKDROP, // plain backdrop, dark or light
  VT_MATTE_SKY,      // sky behind: the backdrop is a smooth bright gradient
  VT_MATTE_NONE      // everything is tree (alpha 1)
} vt_matte_mode;

typedef struct vt_capture_desc {
  uint32_t cookie;
  const char *source;      // a folder of photographs, a COLMAP workspace, a folder with transforms*.json, or such a file
  vt_matte_mode matte;     //
  const char *masks;       // folder of masks, white = tree, or one mask for all; NULL: the usual places
  bool invert_masks;       // black = tree
  const char *ignore;      // folder of masks, white = not to be looked at (a post before the tree); or one for all; or NULL
  const char *marks;       // text file of points marked in photographs and distances between them (marks.c), or NULL
  double marker_size;      // metres along a side of the square ArUco markers in the photographs; 0: there are none
  int marker_cells;        // 4..7, their cells along a side
  double tree_height;      // metres along `up`, if somebody measured it; 0: not known. Marks go before markers, these before it
  const char *colmap;      // program; default "colmap", found on PATH
  const char *cache;       // folder where calibrations are kept by content of the photographs; NULL: none
  int max_image_size;      // pixels, longer side of the pictures that are returned; 0: as they are
  uint32_t seed;           // of COLMAP's random choices where it has them
} vt_capture_desc;
vt_capture_desc vt_default_capture_desc(void);

typedef enum vt_source_kind { VT_SOURCE_TRANSFORMS, VT_SOURCE_COLMAP, VT_SOURCE_PHOTOS } vt_source_kind;
typedef struct vt_capture_report {
  vt_source_kind kind;
  vt_matte_mode matte;           // the mode that was used
  int photograph_count;          // found
  int left_out_count;            // not registered, or without what they need
  char **left_out;               // [left_out_count] "name: why"; owned
  double reprojection_error;     // pixels, mean; NAN where unknown
  double seconds_calibration, seconds_mattes;
  bool calibration_from_cache;
} vt_capture_report;
void vt_free_capture_report(vt_context *, vt_capture_report *);

// Recognises what `source` is (transforms.json, or transforms_train.json with transforms_test.json whose views get
// VT_TEST; then sparse/0 or sparse with images; then photographs alone), uses what is there and makes the rest:
// calibration by the colmap program, undistortion, mattes, foreground colours. Pictures come undistorted, straight RGBA.
// VT_BAD_INPUT naming the file, VT_TOO_FEW_VIEWS (< 3), VT_MISSING_PROGRAM, VT_CANCELLED. `out` freed by the caller.
vt_status vt_load_views(vt_context *, const vt_capture_desc *, vt_views *out, vt_capture_report *or_null);

// Writes a Capture folder that other programs of the field read: images/NAME.png (straight RGBA) and transforms.json, or
// transforms_train.json and transforms_test.json if there are test views (OpenGL camera-to-world, fl_x fl_y cx cy w h
// per frame, camera_angle_x). The folder appears complete or not at all, and replaces one that voltree wrote (with its truth,
// and the same views under other light in it). VT_FAILED naming the file.
vt_status vt_write_capture(vt_context *, const vt_views *, const char *folder);
// Writes the same transforms files without pictures into a folder that is there. file_path is `pictures` (like "../") and the
// picture's path within its capture; mask_path is `masks` (like "mattes/", or NULL: none), the view's name and ".png".
vt_status vt_write_cameras(vt_context *, const vt_views *, const char *folder, const char *pictures, const char *masks);

// ---- cameras alone, for other programs
typedef enum vt_camera_format {
  VT_CAMERAS_COLMAP_TEXT,   // cameras.txt, images.txt and an empty points3D.txt
  VT_CAMERAS_COLMAP_BINARY, // the same as .bin
  VT_CAMERAS_TRANSFORMS     // transforms.json, or one for each role where there are test views
} vt_camera_format;
// The cameras of a source with the lenses they were taken through, each of the size of its file; no picture is decoded but what
// calibration needs. A COLMAP model names pictures as they lie in images/, transforms.json by their way from `folder`. *count
// of them. VT_BAD_INPUT naming a lens that the format has no place for; VT_FAILED if something is in the way.
vt_status vt_convert_cameras(vt_context *, const vt_capture_desc *, vt_camera_format, const char *folder, int *count);
// The same for views, whose cameras are pinhole; their pictures are not looked at and need not be there.
vt_status vt_export_cameras(vt_context *, const vt_views *, vt_camera_format, const char *folder);

#ifdef __cplusplus
}
#endif
#endif
