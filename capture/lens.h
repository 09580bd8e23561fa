// lens.h - the lens a photograph was taken through, before undistortion
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_LENS_H
#define VT_CAPTURE_LENS_H

#include "base/camera.h"
#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_lens_model {
  VT_LENS_PINHOLE, //
  VT_LENS_OPENCV,  // k1 k2 p1 p2 k3 k4 k5 k6, and the coefficient of r^8 above the fraction line (nerfstudio's k4)
  VT_LENS_FISHEYE  // k1 k2 k3 k4 of the equidistant model
} vt_lens_model;

// Pixel coordinates as in vt_camera: the first pixel's centre is (0.5, 0.5).
typedef struct vt_lens {
  vt_lens_model model;
  int width, height;     // pixels
  double fx, fy, cx, cy; // pixels
  double k[9];           // in the order said at the model
} vt_lens;

// True for VT_LENS_PINHOLE and for a model whose coefficients are all zero and that then is one.
bool vt_lens_is_pinhole(const vt_lens *);
// Where the ray (x, y, 1) of the camera's own axes meets the photograph.
void vt_lens_project(const vt_lens *, double x, double y, double pixel[2]);
// The ray (ray[0], ray[1], 1) through a pixel of the photograph; false where the model has none (it turns back before).
bool vt_lens_unproject(const vt_lens *, const double pixel[2], double ray[2]);

// Resamples a picture (1, 3 or 4 channels) taken through `lens` to a pinhole one. width, height, fx, fy, cx, cy of
// `inout_camera` are filled, its pose stays. Outside the source alpha is 0 where there are 4 channels; otherwise no such
// pixel is kept. VT_MISSING_PROGRAM in builds without OpenCV. The caller frees `out`.
vt_status vt_undistort_image(vt_context *, const vt_lens *lens, const vt_image *in, vt_camera *inout_camera,
                             vt_image *out);

#ifdef __cplusplus
}
#endif
#endif
