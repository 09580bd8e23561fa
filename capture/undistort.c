// undistort.c - pictures as a pinhole camera would have taken them
// SPDX-License-Identifier: BSD-3-Clause
//
// Size, focal lengths and centre stay, unless the pinhole camera would then see what the photograph does not show (a
// pincushion lens): its view is narrowed until all of its border lies in the photograph. A black border would
// otherwise count as a backdrop seen, and the hull would be carved by it. Beyond the radius where a polynomial lens
// model turns back it says nothing, so the border must also lie before that.
#include "capture/lens.h"
#include "capture/vision.h"
#include <math.h>
#include <string.h>

enum { SIDE = 33, POINTS = 4 * SIDE, LARGEST = 32766 }; // border points of a side; edge that OpenCV can resample
#define STEP 1.01                                       // of the focal length, from one trial to the next
#define NARROWEST 8.0

// True if all of the border of the pinhole view, and what is just inside of it, is in the photograph, in that order.
static vt_status border_is_seen(vt_context *context, const vt_lens *lens, const vt_camera *pinhole, bool *seen) {
  double rays[2 * POINTS][2], pixels[2 * POINTS][2];
  for (int i = 0; i < POINTS; i++) {
    double t = (double)(i % SIDE) / (SIDE - 1);
    double u = i < 2 * SIDE ? t : i < 3 * SIDE ? 0 : 1, v = i < SIDE ? 0 : i < 2 * SIDE ? 1 : t;
    for (int inner = 0; inner < 2; inner++) {
      double *ray = rays[2 * i + inner], scale = inner ? 0.98 : 1;
      ray[0] = scale * (u * pinhole->width - pinhole->cx) / pinhole->fx;
      ray[1] = scale * (v * pinhole->height - pinhole->cy) / pinhole->fy;
    }
  }
  vt_status status = vt_distort_points(context, lens, 2 * POINTS, &rays[0][0], &pixels[0][0]);
  *seen = true;
  for (int i = 0; status == VT_OK && i < POINTS; i++) {
    double x = pixels[2 * i][0], y = pixels[2 * i][1];
    double outer = hypot(x - lens->cx, y - lens->cy),
           inner = hypot(pixels[2 * i + 1][0] - lens->cx, pixels[2 * i + 1][1] - lens->cy);
    *seen = *seen && x > -0.5 && y > -0.5 && x < lens->width + 0.5 && y < lens->height + 0.5 && outer > inner;
  }
  return status;
}

vt_status vt_undistort_image(vt_context *context, const vt_lens *lens, const vt_image *in, vt_camera *inout_camera,
                             vt_image *out) {
  VT_ASSERT(in->channels == 3 || in->channels == 4);
  memset(out, 0, sizeof *out);
  if (in->width != lens->width || in->height != lens->height)
    return vt_fail(context, VT_BAD_INPUT,
                   "undistortion: a photograph of %d x %d has a camera of %d x %d; give the "
                   "photographs that were calibrated",
                   in->width, in->height, lens->width, lens->height);
  if (in->width > LARGEST || in->height > LARGEST)
    return vt_fail(context, VT_BAD_INPUT, "undistortion: a photograph of %d x %d is too large; reduce it below %d",
                   in->width, in->height, LARGEST);
  vt_camera camera = *inout_camera;
  camera.width = lens->width, camera.height = lens->height;
  camera.fx = lens->fx, camera.fy = lens->fy, camera.cx = lens->cx, camera.cy = lens->cy;
  bool straight = vt_lens_is_pinhole(lens), seen = straight;
  vt_status status = VT_OK;
  for (double scale = 1; status == VT_OK && !seen && scale < NARROWEST; scale *= STEP) {
    camera.fx = lens->fx * scale, camera.fy = lens->fy * scale;
    status = border_is_seen(context, lens, &camera, &seen);
  }
  if (status == VT_OK && !seen)
    status =
        vt_fail(context, VT_BAD_INPUT, "undistortion: the lens model bends the whole picture away; calibrate it again");
  if (status == VT_OK) status = vt_make_image(context, camera.width, camera.height, in->channels, out);
  if (status == VT_OK && straight)
    memcpy(out->pixels, in->pixels, (size_t)in->width * (size_t)in->height * (size_t)in->channels);
  if (status == VT_OK && !straight) status = vt_resample_picture(context, lens, in, &camera, out);
  if (status == VT_OK)
    *inout_camera = camera;
  else
    vt_free_image(context, out);
  return status;
}
