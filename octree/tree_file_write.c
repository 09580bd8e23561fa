// tree_file_write.c - to come
// SPDX-License-Identifier: BSD-3-Clause
