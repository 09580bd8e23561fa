// tree_file_read.c - to come
// SPDX-License-Identifier: BSD-3-Clause
