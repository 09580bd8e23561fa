// lab.h - sRGB to CIELab (D65) and back
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_LAB_H
#define VT_BASE_LAB_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

void vt_lab_from_srgb(const float srgb[3], float lab[3]); // srgb 0..1, encoded
void vt_srgb_from_lab(const float lab[3], float srgb[3]); // clamped to 0..1

// Linear light of the 256 values of an sRGB channel.
void vt_fill_srgb_table(float linear[256]);
// CIELab [count][3] of `count` colours, their first bytes `stride` bytes apart. The same values as vt_lab_from_srgb.
void vt_lab_from_bytes(const float linear[256], const uint8_t *rgb, size_t stride, size_t count, float *lab);

#ifdef __cplusplus
}
#endif
#endif
