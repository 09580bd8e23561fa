// image_metrics.h - how far a rendered picture is from the photograph
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_IMAGE_METRICS_H
#define VT_BASE_IMAGE_METRICS_H

#include "base/image.h"

#ifdef __cplusplus
extern "C" {
#endif

// All over one constant background (white unless said), on sRGB-encoded values 0..1.
typedef struct vt_metrics {
  double psnr;            // dB; 10 log10(1/mse) over RGB; 99 where mse is 0
  double psnr_foreground; // dB over pixels with true alpha > 0.02; NAN if there are none
  double ssim;            // Gaussian 11x11, sigma 1.5, K1 .01, K2 .03, mean of the RGB channels (Wang et al. 2004)
  double alpha_rmse;      // 0..1
  double delta_e;         // mean CIEDE2000 over pixels with true alpha > 0.02; NAN if there are none
  double sharpness;       // gradient energy over the same pixels, result's over truth's: 1 is right, less is blurred, more
                          // is noisy; NAN where the truth has no gradient
} vt_metrics;

// `result` is premultiplied RGBA, `truth` straight RGBA, of one size (asserted).
vt_status vt_measure(vt_context *, const vt_fimage *result, const vt_image *truth, const float background[3],
                     vt_metrics *out);

#ifdef __cplusplus
}
#endif
#endif
