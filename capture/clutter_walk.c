// clutter_walk.c - labels smoothed within the edges of a picture
// SPDX-License-Identifier: BSD-3-Clause
//
// The random walker with prior models [Grady 2005, "Multilabel random walker image segmentation using prior models"]: x
// minimises
//   sum_i lambda_i (x_i - q_i)^2 + sum_ij w_ij (x_i - x_j)^2,   w_ij = exp(-|Lab_i - Lab_j|^2 / 2 sigma^2) + w_0
// over pixels and their four neighbours, q the prior, lambda how sure it is. It is convex, has no bias to short borders
// as a graph cut has (which cuts off leaflets and twigs), and gives grey where it is not sure. Solved by successive
// over-relaxation; most pixels have a prior, so labels need not walk far and tens of sweeps are enough.

#include "capture/clutter.h"

enum { SWEEPS = 24 };
#define SIGMA 5.0f   // CIELab units
#define LEAST 0.004f // w_0
#define RELAXATION 1.6f

static float edge(const float *lab, size_t p, size_t q) {
  float dl = lab[3 * p] - lab[3 * q], da = lab[3 * p + 1] - lab[3 * q + 1], db = lab[3 * p + 2] - lab[3 * q + 2];
  return expf(-(dl * dl + da * da + db * db) / (2 * SIGMA * SIGMA)) + LEAST;
}

static void sweep(int width, int height, const float *right, const float *below, const float *prior,
                  const float *confidence, float *x) {
  size_t w = (size_t)width;
  for (int v = 0; v < height; v++)
    for (int u = 0; u < width; u++) {
      size_t p = (size_t)v * w + (size_t)u;
      float sum = confidence[p] * prior[p], weight = confidence[p];
      if (u > 0) sum += right[p - 1] * x[p - 1], weight += right[p - 1];
      if (u + 1 < width) sum += right[p] * x[p + 1], weight += right[p];
      if (v > 0) sum += below[p - w] * x[p - w], weight += below[p - w];
      if (v + 1 < height) sum += below[p] * x[p + w], weight += below[p];
      if (weight > 0) x[p] += RELAXATION * (sum / weight - x[p]);
    }
}

vt_status vt_walk_labels(vt_context *context, int width, int height, const float *lab, const float *prior,
                         const float *confidence, float *tree) {
  size_t count = (size_t)width * (size_t)height;
  float *right = VT_NEW(context, float, count), *below = VT_NEW(context, float, count);
  vt_status status = right && below ? VT_OK : VT_OUT_OF_MEMORY;
  for (int v = 0; v < height && !status; v++)
    for (int u = 0; u < width; u++) {
      size_t p = (size_t)v * (size_t)width + (size_t)u;
      if (u + 1 < width) right[p] = edge(lab, p, p + 1);
      if (v + 1 < height) below[p] = edge(lab, p, p + (size_t)width);
    }
  for (int n = 0; n < SWEEPS && !status; n++) {
    if (vt_cancelled(context)) status = vt_fail(context, VT_CANCELLED, "mattes: interrupted");
    if (!status) sweep(width, height, right, below, prior, confidence, tree);
  }
  for (size_t i = 0; i < count && !status; i++) tree[i] = tree[i] < 0 ? 0 : tree[i] > 1 ? 1 : tree[i];
  vt_free(context, right);
  vt_free(context, below);
  return status;
}
