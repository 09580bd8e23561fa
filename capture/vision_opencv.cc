// vision_opencv.cc - undistortion by OpenCV 4
// SPDX-License-Identifier: BSD-3-Clause
//
// OpenCV counts pixels from the centre of the first one, we from its corner: half a pixel is taken off every centre.
#include "capture/vision.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace {

cv::Matx33d matrix_of(double fx, double fy, double cx, double cy) {
  return cv::Matx33d(fx, 0, cx - 0.5, 0, fy, cy - 0.5, 0, 0, 1);
}

cv::Mat coefficients_of(const vt_lens *lens) {
  cv::Mat k(1, lens->model == VT_LENS_FISHEYE ? 4 : 8, CV_64F);
  for (int i = 0; i < k.cols; i++) k.at<double>(0, i) = lens->model == VT_LENS_PINHOLE ? 0 : lens->k[i];
  return k;
}

// An exception must not leave this file.
template <class Work> vt_status guarded(vt_context *context, Work work) {
  try {
    work();
    return VT_OK;
  } catch (const std::bad_alloc &) {
    return vt_fail(context, VT_OUT_OF_MEMORY, "undistortion: the system has no more memory; use smaller photographs");
  } catch (const std::exception &e) {
    return vt_fail(context, VT_FAILED, "undistortion: OpenCV failed (%s); undistort the photographs first", e.what());
  }
}

} // namespace

vt_status vt_distort_points(vt_context *context, const vt_lens *lens, int count, const double *rays_xy,
                            double *pixels_xy) {
  return guarded(context, [&] {
    const cv::Vec3d none(0, 0, 0);
    const cv::Matx33d camera = matrix_of(lens->fx, lens->fy, lens->cx, lens->cy);
    std::vector<cv::Point3d> rays;
    for (int i = 0; i < count; i++) rays.emplace_back(rays_xy[2 * i], rays_xy[2 * i + 1], 1.0);
    std::vector<cv::Point2d> pixels;
    if (lens->model == VT_LENS_FISHEYE)
      cv::fisheye::projectPoints(rays, pixels, none, none, camera, coefficients_of(lens));
    else
      cv::projectPoints(rays, none, none, camera, coefficients_of(lens), pixels);
    for (int i = 0; i < count; i++) {
      pixels_xy[2 * i] = pixels[static_cast<size_t>(i)].x + 0.5;
      pixels_xy[2 * i + 1] = pixels[static_cast<size_t>(i)].y + 0.5;
    }
  });
}

vt_status vt_resample_picture(vt_context *context, const vt_lens *lens, const vt_image *in, const vt_camera *pinhole,
                              vt_image *out) {
  return guarded(context, [&] {
    const cv::Matx33d from = matrix_of(lens->fx, lens->fy, lens->cx, lens->cy);
    const cv::Matx33d to = matrix_of(pinhole->fx, pinhole->fy, pinhole->cx, pinhole->cy);
    const cv::Size size(pinhole->width, pinhole->height);
    cv::Mat x, y;
    if (lens->model == VT_LENS_FISHEYE)
      cv::fisheye::initUndistortRectifyMap(from, coefficients_of(lens), cv::Matx33d::eye(), to, size, CV_32FC1, x, y);
    else
      cv::initUndistortRectifyMap(from, coefficients_of(lens), cv::Matx33d::eye(), to, size, CV_32FC1, x, y);
    const cv::Mat source(in->height, in->width, CV_8UC(in->channels), in->pixels);
    cv::Mat target(out->height, out->width, CV_8UC(out->channels), out->pixels);
    cv::remap(source, target, x, y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
    if (in->channels != 4) return;
    for (int j = 0; j < size.height; j++)
      for (int i = 0; i < size.width; i++) {
        const float u = x.at<float>(j, i), v = y.at<float>(j, i);
        const bool seen = u > -0.51f && v > -0.51f && u < static_cast<float>(in->width) - 0.49f &&
                          v < static_cast<float>(in->height) - 0.49f;
        if (!seen) target.ptr<uint8_t>(j)[4 * i + 3] = 0;
      }
  });
}
