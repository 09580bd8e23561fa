// delta_e.c - CIEDE2000
// SPDX-License-Identifier: BSD-3-Clause
//
// CIE 142-2001 in the form of Sharma, Wu, Dalal, "The CIEDE2000 color-difference formula: implementation notes,
// supplementary test data, and mathematical observations", Color Research and Application 2005: differences of
// lightness, chroma and hue, each over a weight that grows where the eye is less sure, and a term that turns the axes
// of hue and chroma against each other in the blue. What goes wrong without care is the mean hue: of 350 and 10 degrees
// it is 0, and a colour without chroma has no hue of its own, so that the other's counts.
#include "base/delta_e.h"

#include <math.h>

#define DEGREE (3.14159265358979323846 / 180)

static double hue_of(double a, double b) { // degrees, 0..360; 0 of a grey
  double h = a == 0 && b == 0 ? 0 : atan2(b, a) / DEGREE;
  return h < 0 ? h + 360 : h;
}

static double mean_hue(double h1, double h2, double chroma_product) {
  if (chroma_product == 0) return h1 + h2;
  if (fabs(h1 - h2) <= 180) return 0.5 * (h1 + h2);
  return h1 + h2 < 360 ? 0.5 * (h1 + h2 + 360) : 0.5 * (h1 + h2 - 360);
}

static double hue_step(double h1, double h2, double chroma_product) {
  if (chroma_product == 0) return 0;
  double d = h2 - h1;
  return d > 180 ? d - 360 : d < -180 ? d + 360 : d;
}

static double seventh_share(double chroma) { // sqrt(C^7 / (C^7 + 25^7))
  double power = pow(chroma / 25, 7);
  return sqrt(power / (power + 1));
}

double vt_delta_e(const double a[3], const double b[3]) {
  double g = 0.5 * (1 - seventh_share(0.5 * (hypot(a[1], a[2]) + hypot(b[1], b[2]))));
  double a1 = (1 + g) * a[1], a2 = (1 + g) * b[1], c1 = hypot(a1, a[2]), c2 = hypot(a2, b[2]);
  double h1 = hue_of(a1, a[2]), h2 = hue_of(a2, b[2]);
  double lightness = b[0] - a[0], chroma = c2 - c1;
  double hue = 2 * sqrt(c1 * c2) * sin(0.5 * DEGREE * hue_step(h1, h2, c1 * c2));
  double l = 0.5 * (a[0] + b[0]), c = 0.5 * (c1 + c2), h = mean_hue(h1, h2, c1 * c2);
  double t = 1 - 0.17 * cos(DEGREE * (h - 30)) + 0.24 * cos(DEGREE * 2 * h) + 0.32 * cos(DEGREE * (3 * h + 6)) -
             0.2 * cos(DEGREE * (4 * h - 63));
  double lightness_weight = 1 + 0.015 * (l - 50) * (l - 50) / sqrt(20 + (l - 50) * (l - 50));
  double chroma_weight = 1 + 0.045 * c, hue_weight = 1 + 0.015 * c * t;
  double turn = 30 * exp(-((h - 275) / 25) * ((h - 275) / 25));
  double rotation = -2 * seventh_share(c) * sin(DEGREE * 2 * turn);
  lightness /= lightness_weight, chroma /= chroma_weight, hue /= hue_weight;
  return sqrt(fmax(lightness * lightness + chroma * chroma + hue * hue + rotation * chroma * hue, 0));
}
