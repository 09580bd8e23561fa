// quality_opencv.cc - PSNR and SSIM by OpenCV's quality module, JPEG by its image codecs
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/quality.h"

#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/quality.hpp>

namespace {

cv::Mat mat_of(const vt_image *rgb) { return cv::Mat(rgb->height, rgb->width, CV_8UC3, rgb->pixels); }

template <class Work> vt_status guarded(vt_context *context, Work work) { // an exception must not leave this file
  try {
    work();
    return VT_OK;
  } catch (const std::exception &e) {
    return vt_fail(context, VT_FAILED, "quality: OpenCV failed (%s); look at the pictures", e.what());
  }
}

} // namespace

bool vt_has_opencv_quality(void) { return true; }

vt_status vt_opencv_quality(vt_context *context, const vt_image *a, const vt_image *b, double *psnr, float *ssim_map) {
  return guarded(context, [&] {
    cv::Mat map, none;
    // The module returns four numbers, one a channel; PSNR over all of them is that of the mean squared error.
    const cv::Scalar mse = cv::quality::QualityMSE::compute(mat_of(a), mat_of(b), none);
    *psnr = 10 * std::log10(255.0 * 255.0 / ((mse[0] + mse[1] + mse[2]) / 3));
    cv::quality::QualitySSIM::compute(mat_of(a), mat_of(b), map);
    cv::Mat floats;
    map.convertTo(floats, CV_32F);
    for (int y = 0; y < floats.rows; y++)
      std::memcpy(ssim_map + static_cast<std::size_t>(y) * 3 * static_cast<std::size_t>(floats.cols), floats.ptr<float>(y),
                  3 * sizeof(float) * static_cast<std::size_t>(floats.cols));
  });
}

vt_status vt_opencv_jpeg(vt_context *context, const vt_image *rgb, int quality, vt_image *out) {
  return guarded(context, [&] {
    cv::Mat swapped(rgb->height, rgb->width, CV_8UC3); // OpenCV writes blue first
    std::vector<unsigned char> bytes;
    for (int i = 0; i < 3 * rgb->width * rgb->height; i++) swapped.data[i] = rgb->pixels[i - i % 3 + 2 - i % 3];
    cv::imencode(".jpg", swapped, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
    const cv::Mat back = cv::imdecode(bytes, cv::IMREAD_COLOR);
    for (int i = 0; i < 3 * rgb->width * rgb->height; i++) out->pixels[i] = back.data[i - i % 3 + 2 - i % 3];
  });
}
