// byte_codec_zstd.c - to come
// SPDX-License-Identifier: BSD-3-Clause
