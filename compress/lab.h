// lab.h - CIELab of many 8-bit colours at once
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_COMPRESS_LAB_H
#define VT_COMPRESS_LAB_H

#include <stddef.h>
#include <stdint.h>

// Linear light of the 256 values of an sRGB channel.
void vt_fill_srgb_table(float linear[256]);
// CIELab [count][3] of `count` colours, their first bytes `stride` bytes apart. The same values as vt_lab_from_srgb.
void vt_lab_from_bytes(const float linear[256], const uint8_t *rgb, size_t stride, size_t count, float *lab);

#endif
