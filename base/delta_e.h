// delta_e.h - how different two colours look
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_DELTA_E_H
#define VT_BASE_DELTA_E_H

#ifdef __cplusplus
extern "C" {
#endif

// CIEDE2000 of two CIELab colours, kL = kC = kH = 1. About 1 can just be seen.
double vt_delta_e(const double a[3], const double b[3]);

#ifdef __cplusplus
}
#endif
#endif
