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
enum { STRIP = 64 };                                    // rows that are resampled at a time
#define STEP 1.01                                       // of the focal length, from one trial to the next
#define NARROWEST 8.0

// True if all of the border of the pinhole view is in the photograph, and what is just inside of it lies farther in.
static bool border_is_seen(const vt_lens *lens, const vt_camera *pinhole) {
  for (int i = 0; i < POINTS; i++) {
    double t = (double)(i % SIDE) / (SIDE - 1), pixel[2], inner[2];
    double u = i < 2 * SIDE ? t : i < 3 * SIDE ? 0 : 1, v = i < SIDE ? 0 : i < 2 * SIDE ? 1 : t;
    double x = (u * pinhole->width - pinhole->cx) / pinhole->fx, y = (v * pinhole->height - pinhole->cy) / pinhole->fy;
    vt_lens_project(lens, x, y, pixel);
    vt_lens_project(lens, 0.98 * x, 0.98 * y, inner);
    bool inside = pixel[0] > -0.5 && pixel[1] > -0.5 && pixel[0] < lens->width + 0.5 && pixel[1] < lens->height + 0.5;
    if (!inside || hypot(pixel[0] - lens->cx, pixel[1] - lens->cy) <= hypot(inner[0] - lens->cx, inner[1] - lens->cy))
      return false;
  }
  return true;
}

// `out` has its size and channels already.
static vt_status resample(vt_context *context, const vt_lens *lens, const vt_image *in, const vt_camera *pinhole,
                          vt_image *out) {
  size_t width = (size_t)out->width;
  float *x = VT_NEW(context, float, STRIP *width), *y = VT_NEW(context, float, STRIP *width);
  vt_status status = x && y ? VT_OK : VT_OUT_OF_MEMORY;
  for (int first = 0; first < out->height && !status; first += STRIP) {
    int rows = out->height - first < STRIP ? out->height - first : STRIP;
    for (int j = 0; j < rows; j++)
      for (size_t i = 0; i < width; i++) {
        double pixel[2];
        vt_lens_project(lens, ((double)i + 0.5 - pinhole->cx) / pinhole->fx, (first + j + 0.5 - pinhole->cy) / pinhole->fy,
                        pixel);
        x[(size_t)j * width + i] = (float)(pixel[0] - 0.5); // counted from the first pixel's centre
        y[(size_t)j * width + i] = (float)(pixel[1] - 0.5);
      }
    status = vt_resample_rows(context, in, x, y, first, rows, out);
    for (size_t i = 0; i < (size_t)rows * width && !status && out->channels == 4; i++)
      if (!(x[i] > -0.51f && y[i] > -0.51f && x[i] < (float)in->width - 0.49f && y[i] < (float)in->height - 0.49f))
        out->pixels[4 * ((size_t)first * width + i) + 3] = 0;
  }
  vt_free(context, x);
  vt_free(context, y);
  return status;
}

vt_status vt_undistort_image(vt_context *context, const vt_lens *lens, const vt_image *in, vt_camera *inout_camera,
                             vt_image *out) {
  VT_ASSERT(in->channels == 1 || in->channels == 3 || in->channels == 4);
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
  for (double scale = 1; !seen && scale < NARROWEST; scale *= STEP) {
    camera.fx = lens->fx * scale, camera.fy = lens->fy * scale;
    seen = border_is_seen(lens, &camera);
  }
  if (status == VT_OK && !seen)
    status =
        vt_fail(context, VT_BAD_INPUT, "undistortion: the lens model bends the whole picture away; calibrate it again");
  if (status == VT_OK) status = vt_make_image(context, camera.width, camera.height, in->channels, out);
  if (status == VT_OK && straight)
    memcpy(out->pixels, in->pixels, (size_t)in->width * (size_t)in->height * (size_t)in->channels);
  if (status == VT_OK && !straight) status = resample(context, lens, in, &camera, out);
  if (status == VT_OK)
    *inout_camera = camera;
  else
    vt_free_image(context, out);
  return status;
}
