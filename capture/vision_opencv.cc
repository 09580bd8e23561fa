// vision_opencv.cc - resampling and square markers by OpenCV 4
// SPDX-License-Identifier: BSD-3-Clause
//
// OpenCV counts pixels from the centre of the first one, we from its corner: half a pixel lies between.
#include "capture/vision.h"

#include <algorithm>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

namespace {

// An exception must not leave this file.
template <class Work> vt_status guarded(vt_context *context, const char *what, Work work) {
  try {
    work();
    return VT_OK;
  } catch (const std::bad_alloc &) {
    return vt_fail(context, VT_OUT_OF_MEMORY, "%s: the system has no more memory; use smaller photographs", what);
  } catch (const std::exception &e) {
    return vt_fail(context, VT_FAILED, "%s: OpenCV failed (%s); undistort the photographs first", what, e.what());
  }
}

} // namespace

vt_status vt_resample_rows(vt_context *context, const vt_image *in, const float *x, const float *y, int first, int rows,
                           vt_image *out) {
  return guarded(context, "undistortion", [&] {
    const cv::Size size(out->width, rows);
    const size_t stride = static_cast<size_t>(out->width) * static_cast<size_t>(out->channels);
    const cv::Mat map_x(size, CV_32FC1, const_cast<float *>(x)), map_y(size, CV_32FC1, const_cast<float *>(y));
    const cv::Mat source(in->height, in->width, CV_8UC(in->channels), in->pixels);
    cv::Mat target(size, CV_8UC(out->channels), out->pixels + stride * static_cast<size_t>(first));
    cv::remap(source, target, map_x, map_y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  });
}

vt_status vt_find_markers(vt_context *context, const vt_image *grey, int cells, vt_marker out[VT_MAX_MARKERS], int *count) {
  *count = 0;
  return guarded(context, "markers", [&] {
    const int names[] = {cv::aruco::DICT_4X4_1000, cv::aruco::DICT_5X5_1000, cv::aruco::DICT_6X6_1000,
                         cv::aruco::DICT_7X7_1000};
    const auto dictionary = cv::aruco::getPredefinedDictionary(names[std::clamp(cells, 4, 7) - 4]);
    const auto parameters = cv::aruco::DetectorParameters::create();
    parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
    parameters->minMarkerPerimeterRate = 0.01; // a sheet of paper beside a tree is small
    const cv::Mat source(grey->height, grey->width, CV_8UC1, grey->pixels);
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(source, dictionary, corners, ids, parameters);
    for (size_t i = 0; i < ids.size() && *count < VT_MAX_MARKERS; i++) {
      vt_marker &marker = out[(*count)++];
      marker.id = ids[i];
      for (size_t c = 0; c < 4; c++) {
        marker.corners[c][0] = static_cast<double>(corners[i][c].x) + 0.5;
        marker.corners[c][1] = static_cast<double>(corners[i][c].y) + 0.5;
      }
    }
    std::stable_sort(out, out + *count, [](const vt_marker &a, const vt_marker &b) { return a.id < b.id; });
  });
}
