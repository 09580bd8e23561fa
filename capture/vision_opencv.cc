// vision_opencv.cc - to come
// SPDX-License-Identifier: BSD-3-Clause
