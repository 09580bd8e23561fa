// matte_peers_opencv.cc - mattes by OpenCV: guided filter, GrabCut, information flow
// SPDX-License-Identifier: BSD-3-Clause
#include "bench/matte_peers.h"

#include <cstring>
#include <exception>
#include <opencv2/imgproc.hpp> // before alphamat, which forgets to include what it needs
#include <opencv2/alphamat.hpp>
#include <opencv2/ximgproc.hpp>

namespace {

cv::Mat mat_of(const vt_image *image) {
  return cv::Mat(image->height, image->width, image->channels == 3 ? CV_8UC3 : CV_8UC1, image->pixels);
}

void take(const cv::Mat &from, vt_image *alpha) { // bytes, or floats of 0..1
  cv::Mat bytes;
  if (from.depth() == CV_8U) bytes = from;
  else from.convertTo(bytes, CV_8U, 255);
  for (int y = 0; y < alpha->height; y++)
    std::memcpy(alpha->pixels + static_cast<std::size_t>(y) * static_cast<std::size_t>(alpha->width), bytes.ptr(y),
                static_cast<std::size_t>(alpha->width));
}

template <class Work> vt_status guarded(vt_context *context, Work work) { // an exception must not leave this file
  try {
    work();
    return VT_OK;
  } catch (const std::exception &e) {
    return vt_fail(context, VT_FAILED, "matte peers: OpenCV failed (%s); try another picture", e.what());
  }
}

} // namespace

bool vt_has_matte_peers(void) { return true; }

vt_status vt_peer_guided(vt_context *context, const vt_image *rgb, const vt_image *start, int radius, double epsilon,
                         vt_image *alpha) {
  return guarded(context, [&] {
    cv::Mat guide, mask, out;
    mat_of(rgb).convertTo(guide, CV_32F, 1 / 255.0);
    mat_of(start).convertTo(mask, CV_32F, 1 / 255.0);
    cv::ximgproc::guidedFilter(guide, mask, out, radius, epsilon);
    take(out, alpha);
  });
}

vt_status vt_peer_grabcut(vt_context *context, const vt_image *rgb, const vt_image *trimap, vt_image *alpha) {
  return guarded(context, [&] {
    cv::Mat mask(rgb->height, rgb->width, CV_8UC1), back, fore;
    const std::size_t count = static_cast<std::size_t>(rgb->width) * static_cast<std::size_t>(rgb->height);
    for (std::size_t i = 0; i < count; i++)
      mask.data[i] = static_cast<unsigned char>(trimap->pixels[i] < 64    ? cv::GC_BGD
                                                : trimap->pixels[i] > 192 ? cv::GC_FGD
                                                                          : cv::GC_PR_FGD);
    cv::grabCut(mat_of(rgb), mask, cv::Rect(), back, fore, 4, cv::GC_INIT_WITH_MASK);
    cv::Mat out(rgb->height, rgb->width, CV_8UC1);
    for (std::size_t i = 0; i < count; i++) out.data[i] = mask.data[i] & 1 ? 255 : 0; // foreground, sure or likely, is odd
    take(out, alpha);
  });
}

vt_status vt_peer_information_flow(vt_context *context, const vt_image *rgb, const vt_image *trimap, vt_image *alpha) {
  return guarded(context, [&] {
    cv::Mat out;
    cv::alphamat::infoFlow(mat_of(rgb), mat_of(trimap), out);
    take(out, alpha);
  });
}
