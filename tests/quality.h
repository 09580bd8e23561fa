// quality.h - PSNR, SSIM and JPEG of another implementation (OpenCV), to check ours against
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_QUALITY_H
#define VT_TESTS_QUALITY_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

bool vt_has_opencv_quality(void); // false: the calls below give VT_MISSING_PROGRAM
// RGB pictures of one size. PSNR over all channels, dB; SSIM for each channel under a Gaussian of 11 x 11 and deviation
// 1.5 at every pixel, map[height][width][3] written, borders as the library fills them.
vt_status vt_opencv_quality(vt_context *, const vt_image *a, const vt_image *b, double *psnr, float *ssim_map);
// Packs and unpacks: out has the picture's size already.
vt_status vt_opencv_jpeg(vt_context *, const vt_image *rgb, int quality, vt_image *out);

#ifdef __cplusplus
}
#endif
#endif
