// image_file_oiio.cc - to come
// SPDX-License-Identifier: BSD-3-Clause
