// capture.h - from what a user has to calibrated, matted views
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_CAPTURE_H
#define VT_CAPTURE_CAPTURE_H

#include "base/views.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_matte_mode {
  VT_MATTE_AUTO,     // alpha if the pictures have it, else masks if there are any, else what most photographs show
  VT_MATTE_ALPHA,    // the pictures' alpha channel
  VT_MATTE_MASKS,    // mask files: mask_path, masks/a.jpg.png, masks/a.png, a.mask.png, a_mask.png
  VT_MATTE_BACKDROP, // plain backdrop, dark or light
  VT_MATTE_SKY,      // sky behind, with clouds or without; ground below
  VT_MATTE_CLUTTER,  // anything behind and beside: what stands where the cameras look, and strokes that a user drew
  VT_MATTE_NONE      // everything is tree (alpha 1)
} vt_matte_mode;

typedef struct vt_capture_desc {
  uint32_t cookie;
  const char *source;      // a folder of photographs, a COLMAP workspace, a folder with transforms*.json or bundle.out, or such a file
  vt_matte_mode matte;     //
  const char *masks;       // folder of masks, white = tree, or one mask for all; NULL: the usual places
  bool invert_masks;       // black = tree
  const char *scribbles;   // folder of strokes on some photographs: green or white tree, red or black not; NULL: none
  bool keep_strays;        // leaves in mattes before a backdrop or the sky what the other photographs do not show
  const char *ignore;      // folder of masks, white = not to be looked at (a post before the tree); or one for all; or NULL
  const char *marks;       // text file of points marked in photographs and distances between them (marks.c), or NULL
  double marker_size;      // metres along a side of the square ArUco markers in the photographs; 0: there are none
  int marker_cells;        // 4..7, their cells along a side
  double tree_height;      // metres along `up`, if somebody measured it; 0: not known. Marks go before markers, these before it
  const char *colmap;      // program; default "colmap", found on PATH
  const char *cache;       // folder where cameras and developed views are kept by content of the photographs; NULL: none
  int max_image_size;      // pixels, longer side of the pictures that are returned; 0: as they are
  uint32_t seed;           // of COLMAP's random choices where it has them
  bool keep_lens;          // the lenses of a calibration stay as it found them; else they are adjusted to its tracks (adjust_lens.c)
} vt_capture_desc;
vt_capture_desc vt_default_capture_desc(void);

// From where the photographs look at what they look at. Around: about the vertical through the point nearest to their axes.
typedef struct vt_coverage {
  int count;                 // of cameras; 0: nothing is known
  double around;             // degrees, 360 minus the largest gap
  double largest_gap;        // degrees, between neighbours in azimuth
  int gap_begin, gap_end;    // the cameras on its sides
  double lowest, highest;    // degrees above the horizontal plane through that point
} vt_coverage;
void vt_capture_coverage(const vt_camera *cameras, int count, vt_coverage *out);

typedef enum vt_source_kind {
  VT_SOURCE_TRANSFORMS,
  VT_SOURCE_COLMAP,
  VT_SOURCE_PHOTOS,
  VT_SOURCE_BUNDLER,
  VT_SOURCE_PROJECTIONS // 3x4 matrices beside the photographs
} vt_source_kind;
typedef struct vt_capture_report {
  vt_source_kind kind;
  vt_matte_mode matte;           // the mode that was used
  char matte_evidence[256];      // why, where it was recognised; else ""
  int stray_photographs;         // whose mattes were cleared of what the others do not show; 0 where views came from the cache
  double stray_share;            // of all mattes' area
  int photograph_count;          // found
  int left_out_count;            // not registered, or without what they need
  char **left_out;               // [left_out_count] "name: why"; owned
  double reprojection_error;     // pixels, mean; NAN where unknown
  double seconds_calibration, seconds_developing, seconds_mattes; // developing: reading, mattes, undistortion
  bool calibration_from_cache, views_from_cache;
  bool lens_adjusted;            // to the calibration's tracks
  double lens_before, lens_after; // RMS distance of points held back from where they were seen, in deviations; 0: not looked at
  double lens_corner, lens_focal; // pixels by which the corners moved; share by which the focal length did
  int attempt_count;
  char **attempts;               // [attempt_count] what each attempt at the calibration reached; owned
  int warning_count;
  char **warnings;               // [warning_count] sentences: what is wrong with the photographs, and the cure; owned
  vt_coverage coverage;          // its cameras are the views
} vt_capture_report;
void vt_free_capture_report(vt_context *, vt_capture_report *);

// Recognises what `source` is (transforms.json, or transforms_train.json with transforms_test.json whose views get
// VT_TEST; then sparse/0 or sparse with images; then bundle.out, then matrices; then photographs alone), uses what is there and makes the rest:
// calibration by the colmap program, undistortion, mattes, foreground colours. Pictures come undistorted, straight RGBA.
// VT_BAD_INPUT naming the file, VT_TOO_FEW_VIEWS (< 3), VT_MISSING_PROGRAM, VT_CANCELLED. `out` freed by the caller.
vt_status vt_load_views(vt_context *, const vt_capture_desc *, vt_views *out, vt_capture_report *or_null);

// ---- before the work

enum { VT_PHOTO_UNREADABLE = 1, VT_PHOTO_BLURRED = 2, VT_PHOTO_EXPOSURE = 4, VT_PHOTO_WHITE = 8, VT_PHOTO_DOUBLE = 16 };
typedef struct vt_checked_photo {
  char *name;             // owned
  unsigned troubles;      // VT_PHOTO_...
  int width, height, orientation, group; // group: of photographs taken alike (make, model, focal length, size)
  double focal_35mm;      // mm of 35 mm film; 0 unknown
  double sharpness;       // beside the median of its neighbours in the list; NAN unknown
  double exposure_step;   // brighter than its neighbours, in stops (log2)
  double white_step;      // red or blue beside green, away from its neighbours, in stops
  int twin;               // a photograph before it that shows the same, or -1
} vt_checked_photo;

typedef struct vt_check_report {
  int count;
  vt_checked_photo *photos; // owned
  int group_count, unreadable_count;
  double megapixels;        // of all
  int longest;              // pixels, the longest side
  bool cameras_known;       // from the source, or kept in the cache
  bool calibration_wanted;  // the source has no cameras
  vt_coverage coverage;     // count 0 where cameras are not known; its cameras are those of known_names
  double seconds_calibration, seconds_developing; // estimates of what is left to do; 0: nothing
  uint64_t calibration_bytes, view_bytes;         // estimates, on the disk and in memory
  int warning_count;
  char **warnings; // owned, sentences
} vt_check_report;
void vt_free_check_report(vt_context *, vt_check_report *);
// Looks at every photograph of a source and says what is wrong with it, without calibrating. VT_BAD_INPUT (no photographs).
vt_status vt_check_capture(vt_context *, const vt_capture_desc *, vt_check_report *out);

// What vt_load_views would do with a source.
typedef struct vt_capture_plan {
  vt_source_kind kind;
  int photograph_count;
  bool calibration_kept, calibration_begun, views_kept; // in the cache
  bool views_cheap;      // they need only be read
  double seconds_calibration, seconds_developing; // estimates; 0: nothing to do
  uint64_t view_bytes;   // in memory
} vt_capture_plan;
vt_status vt_plan_capture(vt_context *, const vt_capture_desc *, vt_capture_plan *out);

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
